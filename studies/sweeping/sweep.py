"""Sweeps: many cases of one study over many processes, each written down as it ends.

    from buckler.studies.sweeping.sweep import sweep

    cases = [slider_crank.Parameters(thickness=t, models="beam") for t in (1e-4, 3e-4, 5e-4)]
    rows = sweep("slider-crank", cases, workers=2, store=Path("thickness.sqlite"), progress=progress)
    forces = [row.value("beam.contact_force_180") for row in rows if row.status == "OK"]

    sweep(study, cases, *, workers=1, store=None, signals=False, retry=False, progress=QUIET) -> list[Row]

`workers` is a number of processes, 0 for this one, or any `studies.sweeping.executors.Workers`. Rows come in the order of the
cases and do not depend on the workers. The same call with the same store runs only what has not ended.
"""

from __future__ import annotations

import logging
from collections import Counter, deque
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from buckler.studies.kit import registry
from buckler.studies.kit.parameters import StudyParameters, specs
from buckler.studies.kit.report import QUIET, Progress
from buckler.studies.kit.versions import versions
from buckler.studies.sweeping.executors import Here, Local, SweepError, Workers
from buckler.studies.sweeping.rows import Row
from buckler.studies.sweeping.store import About, Store, StoreError
from buckler.studies.sweeping.worker import Job, run_case, sources, stamp

__all__ = ["sweep", "Part", "Row", "StoreError", "SweepError"]

TRIES = 3
"""How often a case may take its process down, from the second time on alone in a fresh pool, before it is given up."""
PAUSE = 5.0
"""Seconds without a result after which the workers are asked whether they are still there."""
LOG = logging.getLogger("buckler.studies.sweeping.sweep")


class Part(NamedTuple):
    """One of several jobs that share the cases of a sweep: every `of`-th case, from the `number`-th on."""

    number: int
    of: int

    @classmethod
    def read(cls, text: str) -> Part:
        """Read `2/8`.

        Raises
        ------
        ValueError
            If it is no such thing.
        """
        number, _, of = text.partition("/")
        if not (number.isdigit() and of.isdigit() and 1 <= int(number) <= int(of)):
            raise ValueError(f"{text}: write I/N, such as 2/8 for the second of eight parts")
        return cls(int(number), int(of))


def sweep(
    study: str | ModuleType,
    cases: Sequence[StudyParameters],
    *,
    workers: int | Workers = 1,
    store: Path | None = None,
    signals: bool = False,
    retry: bool = False,
    progress: Progress = QUIET,
    name: str = "",
    units: Mapping[str, str] | None = None,
    part: Part | None = None,
) -> list[Row]:
    """Run a study for many parameters.

    Parameters
    ----------
    study : str or module
        Its name in the registry, or a module with `run` that workers can import.
    cases : sequence of StudyParameters
        The study's own `Parameters`, no two alike.
    workers : int or Workers
        Number of processes of this machine, 0 for none but this one; or where else to run.
    store : Path, optional
        File to keep the rows in and to take those from that are already there; without it in memory only.
    signals : bool
        Whether to keep the signals of each case too; `Row.arrays` has them.
    retry : bool
        Whether to run again what the store holds as failed.
    progress : Progress
    name : str
        What the store calls it; by default the study's name.
    units : dict of str to str, optional
        Of the parameters; by default those the study declares.
    part : Part, optional
        Run only this part of the cases; `merge` puts the stores of all parts together.

    Returns
    -------
    rows : list of Row
        One a case, in their order, or one a case of the part. A case that fails is a row with its status and message.

    Raises
    ------
    ValueError
        If two cases are the same or one is not of this study.
    StoreError
        If the store is in use, damaged, full, or holds something else.
    SweepError
        If the workers cannot be started or are lost.
    """
    module = registry.load(study) if isinstance(study, str) else study
    for i, case in enumerate(cases):
        if not isinstance(case, module.Parameters):
            raise ValueError(f"case {i} is {type(case).__name__}, not the Parameters of {module.__name__}")
    name = name or (study if isinstance(study, str) else module.__name__)
    if units is None:
        units = {key: spec.unit for key, spec in specs(module.Parameters).items()}
    with Store(store) as book:
        mine = set(range(len(cases)) if part is None else range(part.number - 1, len(cases), part.of))
        pending = mine.intersection(book.plan(About(name, versions(), units, signals), cases, retry))
        if book.sources() - {sources()}:
            LOG.warning("%s has cases that other sources of Buckler have computed; a new file would not mix them", store)
        LOG.info("%d cases, %d of them stored already", len(mine), len(mine) - len(pending))
        try:
            if pending:
                jobs = [Job(number, module.__name__, cases[number], signals) for number in sorted(pending)]
                if isinstance(workers, int):
                    workers = Local(min(workers, len(jobs)), module.__name__) if workers else Here()
                with closing(_Run(workers, stamp(module.__name__)).rows(jobs)) as rows:
                    for row in progress(rows, total=len(jobs), label=name):
                        _record(book, row)
                        pending.remove(row.number)
        except BaseException:
            if store:
                LOG.warning("%d of %d cases are stored in %s", len(mine) - len(pending), len(mine), store)
            raise
        return [row for row in book.rows(signals) if row.number in mine]


def _record(book: Store, row: Row) -> None:
    """Write a row down; that it cannot be is no fault of who called."""
    try:
        book.record(row)
    except StoreError as error:
        raise SweepError(str(error)) from None


class _Run:
    """Jobs on their way through workers that may die."""

    def __init__(self, workers: Workers, stamp: dict[str, Any]) -> None:
        self.workers, self.stamp = workers, stamp
        self.waiting: deque[Job] = deque()
        self.suspects: deque[Job] = deque()
        """Were in flight when a worker died; each runs alone, so that none is blamed for another's end."""
        self.running: dict[Future[Row], Job] = {}
        self.crashes: Counter[int] = Counter()

    def rows(self, jobs: Sequence[Job]) -> Generator[Row]:
        """Run them; a row each, in the order in which they end."""
        self.waiting.extend(jobs)
        self.executor = self.workers.start()
        finished = False
        try:
            self._check_workers(jobs[0].module)
            while self.waiting or self.suspects or self.running:
                self._fill()
                yield from self._collect()
            finished = True
        finally:
            self.workers.stop(self.executor, at_once=not finished)

    def _check_workers(self, module: str) -> None:
        """Let a worker load the study before any case is risked on it."""
        for attempt in range(TRIES):
            try:
                return self._compare(self.executor.submit(stamp, module).result())
            except SweepError:
                raise
            except CancelledError:
                raise SweepError(f"{self.workers.where} is gone") from None
            except Exception as error:
                died = self.workers.died(error)
                if not died or attempt == TRIES - 1:
                    hint = "; a script that sweeps needs `if __name__ == '__main__':`" if died else ""
                    raise SweepError(f"workers cannot load {module}: {type(error).__name__}: {error}{hint}") from None
                self._begin_again()

    def _compare(self, found: Mapping[str, Any]) -> None:
        """Refuse rows that another version of anything has computed."""
        for name, version in self.stamp["versions"].items():
            if found["versions"].get(name) != version:
                raise SweepError(f"the worker on {found['host']} has {name} {found['versions'].get(name)}, not {version}")

    def _fill(self) -> None:
        """Keep as many in flight as the workers take; a suspect only alone."""
        if self.suspects:
            if not self.running:
                self._submit(self.suspects)
            return
        for _ in range(min(len(self.waiting), self.workers.slots - len(self.running))):
            if not self._submit(self.waiting):
                return

    def _submit(self, queue: deque[Job]) -> bool:
        """Send the next case off, unless a worker has died just now."""
        try:
            future = self.executor.submit(run_case, queue[0])
        except Exception as error:
            if not self.workers.died(error):
                raise
            if not self.running:  # otherwise the cases in flight tell, and all of it is done then
                self._begin_again()
            return False
        self.running[future] = queue.popleft()
        return True

    def _collect(self) -> Iterator[Row]:
        """Rows of what has ended; none after a pause."""
        if not self.running:
            return
        ended, _ = wait(self.running, timeout=PAUSE, return_when=FIRST_COMPLETED)
        if not ended:
            self.workers.idle()
        lost: list[Job] = []
        yield from self._read(ended, lost)
        if lost and self.workers.fall_together:
            yield from self._read(wait(self.running).done, lost)
            yield from self._suspect(lost)
            self._begin_again()
        else:
            yield from map(self._crashed, lost)

    def _read(self, ended: set[Future[Row]], lost: list[Job]) -> Iterator[Row]:
        """Rows of futures that have ended; those whose worker died join `lost`."""
        for future in ended:
            job = self.running.pop(future)
            try:
                row = future.result()
            except CancelledError:
                raise SweepError(f"{self.workers.where} is gone") from None
            except Exception as error:
                if not self.workers.died(error):
                    raise SweepError(f"a worker failed outside any case: {type(error).__name__}: {error}") from error
                lost.append(job)
            else:
                self._compare(row.provenance)
                yield row

    def _suspect(self, lost: list[Job]) -> Iterator[Row]:
        """Put cases whose worker may have died of them aside; a row for the one that has done it too often."""
        self.crashes.update(job.number for job in lost)
        if len(lost) == 1 and self.crashes[lost[0].number] >= TRIES:
            yield self._crashed(lost.pop())
            return
        again = sorted(lost, key=lambda job: job.number)
        LOG.warning("a worker died; run again, one at a time: cases %s", ", ".join(str(job.number) for job in again))
        self.suspects.extend(again)

    def _crashed(self, job: Job) -> Row:
        message = "its process died several times: killed, out of memory, or a fault in compiled code"
        ended = datetime.now(UTC).isoformat(timespec="seconds")
        return Row(job.number, {}, "CRASHED", message, provenance={**self.stamp, "ended": ended})

    def _begin_again(self) -> None:
        self.workers.stop(self.executor, at_once=True)
        self.executor = self.workers.start()
