"""Where the cases of a sweep run: this process, processes of this machine, a Dask cluster, MPI ranks.

Each is a `concurrent.futures.Executor` with what the protocol leaves open: how many cases to keep in flight, what a dead worker
looks like, and how often a case may bring that about.
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
from queue import SimpleQueue
from typing import Any, Self

from . import worker

START = "forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn"
"""Never a fork of this process, whose threads and open store would come along. A fork server imports the engine once,
so that a worker that died is replaced in milliseconds; it is single-threaded when it forks."""


class SweepError(RuntimeError):
    """The machinery failed, not a case; what was stored stays. The message says what to do."""


class Workers(Executor):
    """An executor as a sweep needs it; a context manager that ends at once, without waiting for cases at work, if it is left
    by an exception.
    """

    where: str
    """What to call it."""
    slots: int
    """How many cases to keep in flight."""
    dead: tuple[type[BaseException], ...] = (BrokenExecutor,)
    """What a future raises whose worker has died."""
    tries = 1
    """How often a case may take its worker down before it is given up; 0 where nothing goes on after that."""

    def __exit__(self, *raised: object) -> None:
        """End; nothing by default."""

    def idle(self) -> None:
        """Called when nothing has ended for a while; raises SweepError if nothing ever will."""


class Local(Workers):
    """Processes of this machine, each a pool of its own: of one that dies it is known with which case.

    Parameters
    ----------
    count : how many, at least 1
    module : the study, which the fork server imports before it forks
    """

    where, tries = "the pool of processes", 3

    def __init__(self, count: int, module: str) -> None:
        if count < 1:
            raise ValueError(f"workers = {count}: out of range; allowed: 0 or more")
        self.slots, self.module, self._context = count, module, multiprocessing.get_context(START)
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
            os.environ.setdefault(name, "1")  # a process a core, each with a thread a core, would crowd the machine

    def __enter__(self) -> Self:
        """Begin, with a pipe of which this process holds the only writing end: workers end when it closes."""
        self._reader, self._leash = self._context.Pipe(duplex=False)
        self._made: list[ProcessPoolExecutor] = []
        self._free: SimpleQueue[ProcessPoolExecutor] = SimpleQueue()
        for _ in range(self.slots):
            self._free.put(self._pool())
        return self

    def _pool(self) -> ProcessPoolExecutor:
        if START == "forkserver":
            _start_server([worker.__name__, self.module])
        self._made.append(ProcessPoolExecutor(1, self._context, worker.begin, (self._reader,)))
        return self._made[-1]

    def submit(self, fn: Callable[..., object], /, *args: object, **options: object) -> Future[Any]:
        """Send a case to a process that is free, or to a new one in place of one that has died."""
        pool = self._free.get()
        with _undisturbed():
            for left in reversed(range(self.tries)):
                try:
                    future = pool.submit(fn, *args, **options)
                    break
                except (BrokenExecutor, EOFError, OSError):  # its process has died, or the fork server as it was to start one
                    if not left:
                        raise
                    time.sleep(0.1)  # or a server that is being killed is taken for alive
                    pool = self._pool()
        future.add_done_callback(lambda _: self._free.put(pool))
        return future

    def __exit__(self, *raised: object) -> None:
        """End."""
        if raised[0] is not None:
            self._leash.close()
        for pool in self._made:
            pool.shutdown(cancel_futures=True)
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


def _start_server(modules: list[str]) -> None:
    """Start the fork server, unless it runs, with Ctrl-C blocked in it and in all it forks, from their first moment."""
    from multiprocessing import forkserver, resource_tracker  # not on every system

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
    slots : how many cases to keep in flight
    """

    tries = 0

    def __init__(self, executor: Executor, slots: int) -> None:
        self.executor, self.slots, self.where = executor, slots, type(executor).__name__

    def submit(self, fn: Callable[..., object], /, *args: object, **options: object) -> Future[Any]:
        """Hand it on."""
        return self.executor.submit(fn, *args, **options)


class Here(Workers):
    """In this process: for a handful of quick cases, and to step through one in a debugger."""

    where, slots = "this process", 1

    def submit(self, fn: Callable[..., object], /, *args: object, **options: object) -> Future[Any]:
        """Run it now."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **options))
        return future


class Dask(Workers):
    """A Dask cluster that is already running; `pip install 'buckler[cluster]'`. It tries a case on several workers itself.

    Parameters
    ----------
    address : of its scheduler, such as tcp://127.0.0.1:8786, or the file in which the scheduler has written it
    patience : how long, s, it may be without workers
    """

    def __init__(self, address: str | Path, patience: float = 60.0) -> None:
        self.address, self.patience, self._alone_since = address, patience, 0.0
        self.where = f"the Dask cluster {'of' if isinstance(address, Path) else 'at'} {address}"

    def __enter__(self) -> Self:
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
        self.dead = (distributed.KilledWorker,)
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
        self._executor = self._client.get_executor(pure=False)  # pure: an equal call would get an earlier result
        return self

    @property
    def slots(self) -> int:  # type: ignore[override]
        """Two for each thread there is now; workers may come and go."""
        return 2 * max(1, sum(self._client.nthreads().values()))

    def submit(self, fn: Callable[..., object], /, *args: object, **options: object) -> Future[Any]:
        """Hand it on."""
        future: Future[Any] = self._executor.submit(fn, *args, **options)
        return future

    def __exit__(self, *raised: object) -> None:
        """Cancel what is at work and leave the cluster as it was."""
        self._executor.shutdown(wait=raised[0] is None)
        self._client.close()

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
