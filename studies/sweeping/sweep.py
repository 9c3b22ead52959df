"""Sweeps: many cases of one study, run on an executor, on processes of this machine, or in this process.

The result of a case is a row, which is stored when the case ends. So a call with the store of an interrupted sweep runs only the
other cases. Rows do not depend on the executor.
"""

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

from buckler.mbs.declare import declarations

from ..kit import registry
from ..kit.parameters import StudyParameters
from ..kit.report import QUIET, Progress
from ..kit.versions import describe_process, versions
from .store import About, Part, Row, Store, StoreError, read

__all__ = ["sweep", "read", "Part", "Row", "StoreError", "SweepError"]

LOST = (BrokenExecutor, EOFError, OSError)
"""Exceptions of a pool whose process, or fork server, has died."""
CRASHED = "its process died twice, the second time alone: killed, out of memory, or a fault in compiled code"
_ENGINE_LOCK = threading.Lock()  # for one run at a time in a process: the engine is not safe for threads


class SweepError(RuntimeError):
    """Failure of the workers or the store, not of a case; the rows of cases that have ended are stored."""


def sweep(
    study: str | ModuleType, cases: Sequence[StudyParameters], *, workers: int = 0, executor: Executor | None = None,
    store: Path | None = None, part: Part | None = None, retry: bool = False, progress: Progress = QUIET,
    name: str = "", units: Mapping[str, str] | None = None,
) -> list[Row]:  # fmt: skip
    """Run a study for many parameters; return the rows of all cases, or of the cases of the part, in their order.

    Parameters
    ----------
    study : name in the registry, or a module with `run` that workers can import
    cases : instances of the study's `Parameters`, no two alike; a case that fails gives a row with status and message
    workers : number of worker processes, 0 to run in this process; a process that dies is replaced
    executor : `ProcessPoolExecutor`, `distributed.Client.get_executor()`, `MPIPoolExecutor`; the caller shuts it down
    store : file of the rows; a case does not run again if its row is there, or in the store of a part in the same folder
    part : run only this part of the cases, and store them in `part.store(store)`
    retry : run cases again that are stored as failed
    name, units : name of the study and units of its parameters in the store; by default those of the study

    Raises
    ------
    ValueError : two cases are the same or one is not of this study
    StoreError : the store is in use, damaged, on a full disk, or of another sweep
    SweepError : the workers cannot load the study, have other versions, or are lost
    """
    if workers < 0:
        raise ValueError(f"workers = {workers}: out of range; allowed: 0 or more")
    module = registry.load(study) if isinstance(study, str) else study
    for i, case in enumerate(cases):
        if not isinstance(case, module.Parameters):
            raise ValueError(f"case {i} is {type(case).__name__}, not the Parameters of {module.__name__}")
    name = name or (study if isinstance(study, str) else module.__name__)
    units = {key: each.spec.unit for key, each in declarations(module.Parameters).items()} if units is None else units
    about, numbers = About(name, versions(), units), range(len(cases))
    if part:  # every `part.of`-th case; parts are counted from 1
        numbers = numbers[part.number - 1 :: part.of]
    with Store(part.store(store) if part and store else store) as opened:
        opened.plan(about, cases, retry)  # writes the cases to the file
        if store and not part:
            for other in sorted(store.parent.glob(f"{store.stem}-part-*-of-*{store.suffix}")):
                opened.copy(other, about)
        ended = {row.number for row in opened.rows()}
        jobs = [Job(number, module.__name__, cases[number]) for number in numbers if number not in ended]
        # Only the first job prints a forecast, for the jobs of its worker; an executor counts as one worker. A callable that is
        # no `Progress` may show the rows, too, but asks for no forecast.
        if jobs and isinstance(progress, Progress) and not progress.quiet:
            jobs[0] = jobs[0]._replace(jobs_a_worker=len(jobs) / max(1, workers))
        with closing(_rows(jobs, workers, executor)) as found:
            for row in progress(found, total=len(jobs), label=f"{name}, {len(ended)} stored" if ended else name):
                if row.provenance["versions"] != about.versions:
                    others = ", ".join(f"{key} {version}" for key, version in row.provenance["versions"].items())
                    raise SweepError(f"the worker on {row.provenance['host']} has other versions: {others}")
                try:
                    opened.record(row)
                except StoreError as error:  # the store was usable above: an error of the disk
                    raise SweepError(str(error)) from None
        return [row for row in opened.rows() if row.number in numbers]


class Job(NamedTuple):
    """Case to run."""

    number: int
    module: str  # of the study
    parameters: StudyParameters
    jobs_a_worker: float = 1.0  # passed on as `cases_a_process`; above 1 this job prints a forecast for this number of cases


def run_case(job: Job) -> Row:
    """Run one case. An exception of its run gives a row with status ERROR; an exception of its import is raised."""
    study: Any = importlib.import_module(job.module)
    with _ENGINE_LOCK:
        start = time.perf_counter()
        try:
            # There is no bar. The first `simulate` of the study prints the forecast: its own run time times `cases_a_process`.
            result = study.run(job.parameters, progress=Progress(quiet=True, cases_a_process=job.jobs_a_worker))
            outcome = {name: getattr(result, name) for name in ("status", "message", "metrics", "work")}
        except (Exception, SystemExit) as error:
            origin = traceback.extract_tb(error.__traceback__)[-1]
            message = f"{type(error).__name__}: {' '.join(str(error).split())} ({Path(origin.filename).name}:{origin.lineno})"
            outcome = {"status": "ERROR", "message": message}
        wall = time.perf_counter() - start
    return Row(job.number, job.parameters.plain(), wall_s=wall, provenance=describe_process(), **outcome)


def _initialise() -> None:
    """Prepare a worker process: it ignores Ctrl-C, which its parent handles, and ends when its parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()


def _follow_parent() -> None:
    if parent := multiprocessing.parent_process():
        parent.join()
        os._exit(1)


def _rows(jobs: Sequence[Job], workers: int, executor: Executor | None) -> Generator[Row]:
    """Run jobs on the executor, on processes, or in this process; yield the row of each job when it ends."""
    if jobs and executor is not None:
        _load(executor, jobs[0].module)
        remaining = len(jobs)
        # the limit is enough for the workers of a cluster, and small enough for its scheduler's memory
        for job, outcome in _outcomes(executor, jobs, limit=1000):
            if isinstance(outcome, BrokenExecutor):
                raise SweepError(f"{type(executor).__name__} has lost a worker and starts no other: {outcome}")
            remaining -= 1
            yield _make_row(job, outcome)
        if remaining:
            raise SweepError(f"{type(executor).__name__} has lost its workers; {remaining} of {len(jobs)} cases did not run")
    elif jobs and workers:
        yield from _in_processes(jobs, workers)
    else:
        yield from map(run_case, jobs)


def _in_processes(jobs: Sequence[Job], workers: int) -> Generator[Row]:
    """Run jobs on processes of this machine; if one dies, the jobs that were running are suspects, which run again one by one."""
    remaining, suspects, starts = {job.number: job for job in jobs}, set[int](), 0
    while remaining:
        suspected = [remaining[number] for number in sorted(suspects)]
        batch, count = (suspected, 1) if suspected else (list(remaining.values()), min(workers, len(remaining)))
        with _processes(count, batch[0].module) as pool:
            try:
                _load(pool, batch[0].module)
            except SweepError:
                starts += 1
                if starts == 3:  # chosen; a process killed at its start looks like a failed import
                    raise
                time.sleep(0.2)  # an earlier start may still use a fork server that is being killed; 0.2 s is chosen
                continue
            starts = 0
            for job, outcome in _outcomes(pool, batch, count):
                # jobs that still waited have no outcome, and run in the next round
                if isinstance(outcome, BrokenExecutor) and not suspected:
                    suspects.add(job.number)
                    continue
                suspects.discard(job.number)
                del remaining[job.number]
                yield _make_row(job, outcome)


@contextmanager
def _processes(count: int, module: str) -> Iterator[Executor]:
    """Open a pool of processes that have imported the study; an exception in the `with` block ends them at once."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")  # by default each process would have as many threads as the machine has cores
    # no fork of this process, which has threads and an open store; a fork server imports only once
    context = multiprocessing.get_context("forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn")
    context.set_forkserver_preload([__name__, module])
    before, pool = set(multiprocessing.active_children()), ProcessPoolExecutor(count, context, _initialise)
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
    """Run jobs, `limit` at a time, and yield each with its row or exception; jobs that wait when the executor dies have none."""
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


def _make_row(job: Job, outcome: Row | Exception) -> Row:
    """Return the row of a job, CRASHED if its process died; raise a SweepError for failures outside the case."""
    if isinstance(outcome, Row):
        return outcome
    if isinstance(outcome, BrokenExecutor) or type(outcome).__name__ == "KilledWorker":  # Dask raises it after several attempts
        return Row(job.number, job.parameters.plain(), "CRASHED", CRASHED, provenance=describe_process())
    if isinstance(outcome, CancelledError):
        raise SweepError("the executor has dropped its cases: it was shut down, or its scheduler is gone")
    raise SweepError(f"a worker failed outside any case: {type(outcome).__name__}: {outcome}") from outcome


def _load(executor: Executor, module: str) -> None:
    """Import the study in one worker as a trial, before any case runs; raise a SweepError if the import fails."""
    try:
        executor.submit(_import, module).result()
    except LOST:
        advice = "a script that sweeps needs `if __name__ == '__main__':`"
        raise SweepError(f"workers cannot load {module}: they die; {advice}") from None
    except Exception as error:
        raise SweepError(f"workers cannot load {module}: {type(error).__name__}: {error}") from None


def _import(module: str) -> None:
    importlib.import_module(module)
