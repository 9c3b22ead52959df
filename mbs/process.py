"""State of the process that a run needs: Ctrl-C, threads of linear algebra, the compiler, a clock without compile time."""

from __future__ import annotations

import ctypes
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from threading import Lock
from time import perf_counter
from types import FrameType
from typing import Any

import scipy


@cache
def has_compiler() -> bool:
    """Return True if Numba is installed and not switched off by its variable NUMBA_DISABLE_JIT.

    Without it the equations run as plain Python: the same numbers, some hundred times slower. A small task such as one
    equilibrium is then done before Numba would have been loaded.
    """
    return os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0") and find_spec("numba") is not None


class Stopwatch:
    """Seconds that this process has spent compiling, which count neither as run time nor towards a time limit."""

    seconds = 0.0


COMPILING = Stopwatch()


def working_time() -> float:
    """Return the seconds of a clock that stops while functions are compiled."""
    return perf_counter() - COMPILING.seconds


Progress = Callable[[float], None]
"""Function that is called with the fraction of a run that is done."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended `simulate`; as it is a KeyboardInterrupt, a script ends unless it catches this.

    Attributes
    ----------
    result : Result
        The run that got farthest, without checks; its status is INTERRUPTED.
    """

    def __init__(self, result: Any) -> None:
        super().__init__(result.message)
        self.result = result


class TimeUpError(Exception):
    """The time of `time_limit` is over."""


@contextmanager
def time_limit(seconds: float | None) -> Iterator[None]:
    """Raise TimeUpError in the main thread after a time [s]; never without a number."""

    def end(number: int, frame: FrameType | None) -> None:
        """Raise TimeUpError, as a handler of the alarm."""
        raise TimeUpError(f"--timeout {seconds:g}: the time is over")

    if seconds is None:
        yield
        return
    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


class _Handler:
    """Signal handler that remembers Ctrl-C."""

    def __init__(self) -> None:
        self.pressed = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.pressed = True


@contextmanager
def ctrl_c() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns True after Ctrl-C; always False in other threads, or where a caller has its own handler.

    Python's default handler would raise a KeyboardInterrupt inside a callback, which the engine turns into a failed step. Nested
    contexts use the function of the outer one.
    """
    here = threading.current_thread() is threading.main_thread()
    before = signal.getsignal(signal.SIGINT) if here else None
    handler = before if isinstance(before, _Handler) else _Handler()
    replaced = before is signal.default_int_handler
    if replaced:
        signal.signal(signal.SIGINT, handler)
    try:
        yield lambda: handler.pressed
    finally:
        if replaced:
            signal.signal(signal.SIGINT, signal.default_int_handler)


_LOCK = Lock()
_COUNTS: list[list[int]] = []
"""Numbers of threads before each `one_thread` that is active; the last one to end restores those of the first."""
NAMES = ("scipy_openblas_{}_num_threads", "openblas_{}_num_threads", "scipy_openblas_{}_num_threads64_")


@cache
def _thread_functions() -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Find the functions that get and set the number of threads of the libraries of SciPy and of NumPy."""
    found = []
    for package in ("scipy", "numpy"):
        for file in Path(scipy.__file__).parent.parent.glob(f"{package}.libs/*openblas*"):
            library = ctypes.CDLL(str(file))
            names = [name for name in NAMES if hasattr(library, name.format("set"))]
            found += [(getattr(library, name.format("get")), getattr(library, name.format("set"))) for name in names[:1]]
    return found


@contextmanager
def one_thread() -> Iterator[None]:
    """Let linear algebra use one thread, until the last active context of this kind ends."""
    with _LOCK:
        _COUNTS.append([read() for read, _ in _thread_functions()])
        for _, write in _thread_functions():
            write(1)
    try:
        yield
    finally:
        with _LOCK:
            for (_, write), count in zip(_thread_functions(), _COUNTS.pop(), strict=True):
                write(count)
