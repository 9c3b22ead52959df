"""Where the cases of a sweep run: this process, processes of this machine, a Dask cluster, MPI ranks.

Each is a `concurrent.futures.Executor` with three things the protocol leaves open: how many cases to keep in flight,
what a dead worker looks like, and how to begin again after one.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from buckler.studies.sweeping import worker

START = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
"""Never a fork of this process, whose threads and open store would come along. A fork server imports the engine once,
so that a worker that died is replaced in milliseconds; it is single-threaded when it forks."""
PATIENCE = 60.0
"""How long, s, a cluster may be without workers."""


class SweepError(RuntimeError):
    """The machinery failed, not a case; what was stored stays. The message says what to do."""


class Workers:
    """What a sweep needs to know of an executor."""

    where: str
    """What to call it."""
    fall_together = True
    """Whether all cases in flight are lost with a worker, and which of them it died of is not known."""
    slots: int
    """How many cases to keep in flight."""

    def start(self) -> Executor:
        """Begin, or begin again after a worker has died."""
        raise NotImplementedError

    def stop(self, executor: Executor, at_once: bool) -> None:
        """End; `at_once` without waiting for the cases at work."""

    def died(self, error: BaseException) -> bool:
        """Whether a case ended in this way because its worker died."""
        return isinstance(error, BrokenExecutor)

    def idle(self) -> None:
        """Called when nothing has ended for a while; raises SweepError if nothing ever will."""


class Local(Workers):
    """Processes of this machine.

    Parameters
    ----------
    count : int
        How many, at least 1.
    module : str
        The study, which the fork server imports before it forks.
    """

    where = "the pool of processes"

    def __init__(self, count: int, module: str) -> None:
        if count < 1:
            raise ValueError(f"workers = {count}: out of range; allowed: 0 or more")
        self.count, self.slots = count, 2 * count
        self.module, self._context = module, multiprocessing.get_context(START)
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            os.environ.setdefault(name, "1")  # a process a core, each with a thread a core, would crowd the machine

    def start(self) -> Executor:
        """Begin, with a pipe of which this process holds the only writing end: workers end when it closes."""
        if START == "forkserver":
            _start_server([worker.__name__, self.module])
        self._reader, self._leash = self._context.Pipe(duplex=False)
        return _Pool(self.count, self._context, worker.begin, (self._reader,))

    def stop(self, executor: Executor, at_once: bool) -> None:
        """End."""
        if at_once:
            self._leash.close()
        executor.shutdown(wait=True, cancel_futures=True)
        self._leash.close()
        self._reader.close()


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Put Ctrl-C off to the end of the block: a process half started would be lost to its pool and complain at length."""
    asked: list[Any] = []
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {s: signal.signal(s, lambda *args: asked.append(args)) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for s, handler in before.items():
            signal.signal(s, handler)
    if asked:
        signal.raise_signal(asked[0][0])


class _Pool(ProcessPoolExecutor):
    def submit(self, fn: Callable[..., Any], /, *args: Any, **options: Any) -> Future[Any]:
        """Send a case off, and start a process for it if there is none."""
        with _undisturbed():
            return super().submit(fn, *args, **options)


def _start_server(modules: list[str]) -> None:
    """Start the fork server, unless it runs, with Ctrl-C blocked in it and in all it forks, from their first moment."""
    from multiprocessing import forkserver, resource_tracker

    forkserver.set_forkserver_preload(modules)
    resource_tracker.ensure_running()  # or the server would start it, and that unblocks signals
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


class Given(Workers):
    """An executor somebody else made and will shut down, such as `mpi4py.futures.MPIPoolExecutor`.

    Parameters
    ----------
    executor : Executor
    slots : int
        How many cases to keep in flight.
    """

    def __init__(self, executor: Executor, slots: int) -> None:
        self.executor, self.slots, self._begun = executor, slots, False
        self.where = type(executor).__name__

    def start(self) -> Executor:
        """Begin; there is no second time."""
        if self._begun:
            raise SweepError(f"a worker of {self.where} died, and it cannot be started again from here")
        self._begun = True
        return self.executor


class Here(Workers, Executor):
    """In this process: for a handful of quick cases, and to step through one in a debugger."""

    where = "this process"
    slots = 1
    fall_together = False

    def start(self) -> Executor:
        """Begin."""
        return self

    def submit(self, fn: Callable[..., Any], /, *args: Any, **options: Any) -> Future[Any]:
        """Run it now."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **options))
        return future


class Dask(Workers):
    """A Dask cluster that is already running; `pip install 'buckler[cluster]'`.

    Parameters
    ----------
    address : str or Path
        Of its scheduler, such as tcp://127.0.0.1:8786, or the file in which the scheduler has written it.
    patience : float
        How long, s, it may be without workers.
    """

    fall_together = False

    def __init__(self, address: str | Path, patience: float = PATIENCE) -> None:
        self.address, self.patience, self._alone_since = address, patience, 0.0
        self.where = f"the Dask cluster {'of' if isinstance(address, Path) else 'at'} {address}"

    def start(self) -> Executor:
        """Connect.

        Raises
        ------
        SweepError
            If there is no scheduler or it has no workers.
        """
        try:
            import distributed
        except ImportError as error:
            raise SweepError(f"a Dask cluster needs `pip install 'buckler[cluster]'`: {error}") from None
        self._killed = distributed.KilledWorker
        for name in ("distributed.client", "distributed.core", "distributed.comm", "tornado.application"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # pages of traceback for what is said here in one line
        try:
            where = {"scheduler_file": str(self.address)} if isinstance(self.address, Path) else {"address": self.address}
            self._client: Any = distributed.Client(timeout=self.patience if isinstance(self.address, Path) else 10, **where)
        except (OSError, ValueError) as error:
            raise SweepError(f"no Dask scheduler at {self.address}: {' '.join(str(error).split())[:200]}") from None
        try:
            self._client.wait_for_workers(1, timeout=self.patience)
        except TimeoutError:
            self._client.close()
            raise SweepError(f"the Dask cluster has no workers; start some with `dask worker {self.address}`") from None
        return self._client.get_executor(pure=False)  # pure: an equal call would get an earlier result

    @property
    def slots(self) -> int:  # type: ignore[override]
        """Two for each thread there is now; workers may come and go."""
        return 2 * max(1, sum(self._client.nthreads().values()))

    def stop(self, executor: Executor, at_once: bool) -> None:
        """Cancel what is at work and leave the cluster as it was."""
        executor.shutdown(wait=not at_once)
        self._client.close()

    def died(self, error: BaseException) -> bool:
        """Dask has tried it on several workers by then, and knows which case it was."""
        return isinstance(error, self._killed)

    def idle(self) -> None:
        """Find out whether the scheduler and any worker are still there."""
        if self._client.status != "running":
            raise SweepError(f"{self.where} is gone")
        if self._client.nthreads():
            self._alone_since = 0.0
        elif not self._alone_since:
            self._alone_since = time.monotonic()
        elif time.monotonic() - self._alone_since > self.patience:
            raise SweepError(f"{self.where} has had no workers for {self.patience:g} s")
