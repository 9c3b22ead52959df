"""State that a run shares with its process: Ctrl-C, threads of linear algebra, the compiler, a clock without its work."""

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
def compiler() -> bool:
    """Return True if Numba is installed and not switched off by its variable NUMBA_DISABLE_JIT.

    Without it the equations run as plain Python: the same numbers, some hundred times slower. A small task such as one
    equilibrium is then done before Numba would have been loaded.
    """
    return os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0") and find_spec("numba") is not None


class Stopwatch:
    """Seconds that this process has spent compiling: no part of what a run takes, nor of the time that it may take."""

    seconds = 0.0


COMPILING = Stopwatch()


def working_time() -> float:
    """Seconds of a clock that stands still while functions are compiled."""
    return perf_counter() - COMPILING.seconds


Progress = Callable[[float], None]
"""Is told what share of a run is done."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended `simulate`: scripts end as they do without it, unless they ask for what there is.

    Attributes
    ----------
    result : Result
        INTERRUPTED: the run that got farthest, as far as it got. No check looked at it.
    """

    def __init__(self, result: Any) -> None:
        super().__init__(result.message)
        self.result = result


class TimeUpError(Exception):
    """The time of `time_limit` is over."""


@contextmanager
def time_limit(seconds: float | None) -> Iterator[None]:
    """Raise TimeUpError in the main thread once, after so many seconds [s]; without a number never."""

    def end(number: int, frame: FrameType | None) -> None:
        """End the process's work by an error when the time is over."""
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


class _Noted:
    """Handler that notes Ctrl-C for as long as it is the handler."""

    def __init__(self) -> None:
        self.pressed = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.pressed = True


@contextmanager
def ctrl_c() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether Ctrl-C came since; never, where Python's own handler does not wait for it.

    That handler would raise a KeyboardInterrupt inside a callback, where the engine makes a failed step of it. Within another
    such context the function is the outer one's.
    """
    here = threading.current_thread() is threading.main_thread()
    before = signal.getsignal(signal.SIGINT) if here else None
    noted = before if isinstance(before, _Noted) else _Noted()
    ours = before is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, noted)
    try:
        yield lambda: noted.pressed
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)


_LOCK = Lock()
_BEFORE: list[list[int]] = []
"""Numbers of threads that those found who entered; the last to leave takes those of the first."""
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
    """Let linear algebra use one thread, until the last of those that ask for it at a time has left."""
    with _LOCK:
        _BEFORE.append([read() for read, _ in _thread_functions()])
        for _, write in _thread_functions():
            write(1)
    try:
        yield
    finally:
        with _LOCK:
            for (_, write), count in zip(_thread_functions(), _BEFORE.pop(), strict=True):
                write(count)
