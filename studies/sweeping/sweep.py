"""Sweeps: many cases of one study on any executor, each stored as it ends.

The same call with the same store runs only what has not ended. Rows do not depend on the executor.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections import deque
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from contextlib import closing, contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from ..kit import registry
from ..kit.parameters import StudyParameters, specs
from ..kit.report import QUIET, Progress
from ..kit.versions import provenance, versions
from .store import About, Part, Row, Store, StoreError, read

__all__ = ["sweep", "read", "Part", "Row", "StoreError", "SweepError"]

IN_FLIGHT = 1000
"""Cases handed to a given executor at once: enough for the workers of a cluster, few enough for its scheduler's memory."""
START = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
"""Start of processes: never a fork of this one, which has threads and an open store. A fork server imports the study once."""
STARTS = 3
"""Attempts to start processes that load the study, as they may be killed while they start."""
LOST = (BrokenExecutor, EOFError, OSError)
"""Exceptions of a pool whose process, or fork server, has died."""
CRASHED = "its process died twice, the second time alone: killed, out of memory, or a fault in compiled code"
_ONE_AT_A_TIME = threading.Lock()
"""Lock of this process: the engine is not made for threads."""


class SweepError(RuntimeError):
    """A failure of the workers or the store, not of a case; what has ended stays stored."""


def sweep(
    study: str | ModuleType,
    cases: Sequence[StudyParameters],
    *,
    workers: int = 0,
    executor: Executor | None = None,
    store: Path | None = None,
    part: Part | None = None,
    retry: bool = False,
    progress: Progress = QUIET,
    name: str = "",
    units: Mapping[str, str] | None = None,
) -> list[Row]:
    """Run a study for many parameters; return the rows of all cases, in their order, or of the cases of the part.

    Parameters
    ----------
    study : its name in the registry, or a module with `run` that workers can import
    cases : the study's own `Parameters`, no two alike; one that fails is a row with its status and message
    workers : processes of this machine, 0 for none but this; a process that dies is replaced
    executor : `ProcessPoolExecutor`, `distributed.Client.get_executor()`, `MPIPoolExecutor`; it is not shut down here
    store : file that keeps the rows; cases that it has, or a store of a part beside it, do not run again
    part : run only this part of the cases, and keep them in `part.store(store)`
    retry : run cases again that are stored as failed
    name, units : name of the study and units of its parameters in the store; by default its own

    Raises
    ------
    ValueError : two cases are the same or one is not of this study
    StoreError : the store is in use, damaged, full, or of another sweep
    SweepError : the workers cannot load the study, have other versions, or are lost
    """
    if workers < 0:
        raise ValueError(f"workers = {workers}: out of range; allowed: 0 or more")
    module = registry.load(study) if isinstance(study, str) else study
    for i, case in enumerate(cases):
        if not isinstance(case, module.Parameters):
            raise ValueError(f"case {i} is {type(case).__name__}, not the Parameters of {module.__name__}")
    name = name or (study if isinstance(study, str) else module.__name__)
    units = {key: spec.unit for key, spec in specs(module.Parameters).items()} if units is None else units
    about, numbers = About(name, versions(), units), range(part.number - 1 if part else 0, len(cases), part.of if part else 1)
    with Store(part.store(store) if part and store else store) as book:
        book.plan(about, cases, retry)
        for other in sorted(store.parent.glob(f"{store.stem}-part-*-of-*{store.suffix}")) if store and not part else ():
            book.take(other, about)
        ended = {row.number for row in book.rows()}
        jobs = [Job(number, module.__name__, cases[number]) for number in numbers if number not in ended]
        if jobs and isinstance(progress, Progress) and not progress.quiet:
            jobs[0] = jobs[0]._replace(cases=len(jobs) / max(1, workers))
        with closing(_rows(jobs, workers, executor)) as found:
            for row in progress(found, total=len(jobs), label=f"{name}, {len(ended)} stored" if ended else name):
                if row.provenance["versions"] != about.versions:
                    others = ", ".join(f"{key} {version}" for key, version in row.provenance["versions"].items())
                    raise SweepError(f"the worker on {row.provenance['host']} has other versions: {others}")
                try:
                    book.record(row)
                except StoreError as error:  # an error of the disk, not of the arguments
                    raise SweepError(str(error)) from None
        return [row for row in book.rows() if row.number in numbers]


class Job(NamedTuple):
    """One case: its number, the module of its study, its parameters."""

    number: int
    module: str
    parameters: StudyParameters
    cases: float = 1.0
    """Cases one after another, of which this is the first, for the estimate of their duration."""


def run_case(job: Job) -> Row:
    """Run one case. An exception of the study becomes a row; one of its import does not."""
    study: Any = importlib.import_module(job.module)
    with _ONE_AT_A_TIME:
        start = time.perf_counter()
        try:
            followed = {"progress": Progress(quiet=True, cases=job.cases)} if job.cases > 1 else {}
            result = study.run(job.parameters, **followed)
            found = {name: getattr(result, name) for name in ("status", "message", "metrics", "work")}
        except (Exception, SystemExit) as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            message = f"{type(error).__name__}: {' '.join(str(error).split())} ({Path(place.filename).name}:{place.lineno})"
            found = {"status": "ERROR", "message": message}
        wall = time.perf_counter() - start
    return Row(job.number, job.parameters.plain(), wall_s=wall, provenance=provenance(), **found)


def _begin() -> None:
    """Start a worker process: it leaves Ctrl-C to its parent, and ends when its parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()


def _follow_parent() -> None:
    if parent := multiprocessing.parent_process():
        parent.join()
        os._exit(1)


def _rows(jobs: Sequence[Job], workers: int, executor: Executor | None) -> Generator[Row]:
    """Run jobs on the executor, on processes, or here; yield rows as they end."""
    if jobs and executor is not None:
        _load(executor, jobs[0].module)
        for job, outcome in _outcomes(executor, jobs, IN_FLIGHT):
            if isinstance(outcome, BrokenExecutor):
                raise SweepError(f"{type(executor).__name__} has lost a worker and starts no other: {outcome}")
            yield _row_of(job, outcome)
    elif jobs and workers:
        yield from _in_processes(jobs, workers)
    else:
        yield from map(run_case, jobs)


def _in_processes(jobs: Sequence[Job], workers: int) -> Generator[Row]:
    """Run jobs on processes of this machine. Those in flight when one dies run again, one at a time in a single process."""
    left, suspects, starts = {job.number: job for job in jobs}, set[int](), 0
    while left:
        alone = [left[number] for number in sorted(suspects)]
        batch, count = (alone, 1) if alone else (list(left.values()), min(workers, len(left)))
        with _processes(count, batch[0].module) as pool:
            try:
                _load(pool, batch[0].module)
            except SweepError:
                starts += 1
                if starts == STARTS:
                    raise
                time.sleep(0.2)  # a fork server that is being killed is taken for alive
                continue
            starts = 0
            for job, outcome in _outcomes(pool, batch, count):
                if isinstance(outcome, BrokenExecutor) and not alone:
                    suspects.add(job.number)
                    continue
                suspects.discard(job.number)
                del left[job.number]
                yield _row_of(job, outcome)


@contextmanager
def _processes(count: int, module: str) -> Iterator[Executor]:
    """Open a pool of processes that have imported the study; end them at once if it is left by an exception."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # processes on all cores, each with as many threads, would overload the machine
    context = multiprocessing.get_context(START)
    context.set_forkserver_preload([__name__, module])
    before, pool = set(multiprocessing.active_children()), ProcessPoolExecutor(count, context, _begin)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _outcomes(executor: Executor, jobs: Sequence[Job], limit: int) -> Iterator[tuple[Job, Row | Exception]]:
    """Yield each job with its row or exception as it ends, `limit` in flight; a broken executor gets no further ones."""
    waiting, running = deque(jobs), dict[Future[Row], Job]()
    try:
        while waiting or running:
            while waiting and len(running) < limit:
                try:
                    future = executor.submit(run_case, waiting[0])
                    running[future] = waiting.popleft()
                except LOST:
                    waiting.clear()
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                job = running.pop(future)
                try:
                    outcome: Row | Exception = future.result()
                except Exception as error:
                    outcome = error
                yield job, outcome
    finally:
        for future in running:
            future.cancel()


def _row_of(job: Job, outcome: Row | Exception) -> Row:
    if isinstance(outcome, Row):
        return outcome
    if isinstance(outcome, BrokenExecutor) or type(outcome).__name__ == "KilledWorker":  # of Dask, after tries of its own
        return Row(job.number, job.parameters.plain(), "CRASHED", CRASHED, provenance=provenance())
    if isinstance(outcome, CancelledError):
        raise SweepError("the executor has dropped its cases: it was shut down, or its scheduler is gone")
    raise SweepError(f"a worker failed outside any case: {type(outcome).__name__}: {outcome}") from outcome


def _load(executor: Executor, module: str) -> None:
    """Import the study in a worker before any case runs there."""
    try:
        executor.submit(_import, module).result()
    except LOST:
        advice = "a script that sweeps needs `if __name__ == '__main__':`"
        raise SweepError(f"workers cannot load {module}: they die; {advice}") from None
    except Exception as error:
        raise SweepError(f"workers cannot load {module}: {type(error).__name__}: {error}") from None


def _import(module: str) -> None:
    importlib.import_module(module)
