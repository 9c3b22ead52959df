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
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from ..kit import registry
from ..kit.parameters import StudyParameters, specs
from ..kit.report import QUIET, Progress
from ..kit.versions import versions
from .executors import Here, Local, SweepError, Workers
from .rows import Row
from .store import About, Store, StoreError
from .worker import Job, run_case, sources, stamp

__all__ = ["sweep", "Part", "Row", "StoreError", "SweepError"]

CRASHED = "its process died several times: killed, out of memory, or a fault in compiled code"
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
                with closing(_rows(workers, jobs, stamp(module.__name__))) as rows:
                    for row in progress(rows, total=len(jobs), label=name):
                        try:
                            book.record(row)
                        except StoreError as error:  # no fault of who called
                            raise SweepError(str(error)) from None
                        pending.remove(row.number)
        except BaseException:
            if store:
                LOG.warning("%d of %d cases are stored in %s", len(mine) - len(pending), len(mine), store)
            raise
        return [row for row in book.rows(signals) if row.number in mine]


def _rows(workers: Workers, jobs: Sequence[Job], mine: Mapping[str, object]) -> Generator[Row]:
    """Run jobs, a row each in the order in which they end; `mine` is the stamp of this process."""
    waiting, running, deaths = deque(jobs), dict[Future[Row], Job](), Counter[int]()
    with workers:
        _compare(_loaded(workers, jobs[0].module), mine)
        while waiting or running:
            while waiting and len(running) < workers.slots:
                job = waiting.popleft()
                running[workers.submit(run_case, job)] = job
            ended, _ = wait(running, timeout=PAUSE, return_when=FIRST_COMPLETED)
            if not ended:
                workers.idle()
            for future in ended:
                job = running.pop(future)
                row = _result(workers, future, "a worker failed outside any case")
                if row is not None:
                    _compare(row.provenance, mine)
                    yield row
                    continue
                deaths[job.number] += 1
                if deaths[job.number] < workers.tries:
                    LOG.warning("a worker died of case %d, which runs again", job.number)
                    waiting.append(job)
                else:
                    ended_at = datetime.now(UTC).isoformat(timespec="seconds")
                    yield Row(job.number, {}, "CRASHED", CRASHED, provenance={**mine, "ended": ended_at})


def _loaded(workers: Workers, module: str) -> Mapping[str, Any]:
    """Let a worker load the study before any case is risked on it; its stamp."""
    for _ in range(workers.tries or 1):
        found: Mapping[str, Any] | None = _result(workers, workers.submit(stamp, module), f"workers cannot load {module}")
        if found is not None:
            return found
    raise SweepError(f"workers cannot load {module}: they die; a script that sweeps needs `if __name__ == '__main__':`")


def _result(workers: Workers, future: Future[Any], what: str) -> Any:
    """What a future gives; None if its worker has died."""
    try:
        return future.result()
    except CancelledError:
        raise SweepError(f"{workers.where} is gone") from None
    except workers.dead:
        if not workers.tries:
            raise SweepError(f"a worker of {workers.where} died, and it cannot be started again from here") from None
        return None
    except Exception as error:
        raise SweepError(f"{what}: {type(error).__name__}: {error}") from error


def _compare(found: Mapping[str, Any], mine: Mapping[str, Any]) -> None:
    """Refuse rows that another version of anything has computed."""
    for name, version in mine["versions"].items():
        if found["versions"].get(name) != version:
            raise SweepError(f"the worker on {found['host']} has {name} {found['versions'].get(name)}, not {version}")
