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
    """Seconds that this process has spent compiling, which count neither as run time nor towards a time limit.

    It `runs` while something is compiled.
    """

    seconds = 0.0
    runs = False


COMPILING = Stopwatch()


def working_time() -> float:
    """Return the seconds of a clock that stops while functions are compiled."""
    return perf_counter() - COMPILING.seconds


Progress = Callable[[float], None]
"""Function that is called with the fraction of a run that is done."""


CTRL_C = "Ctrl-C"
"""Text of the KeyboardInterrupt that follows a Ctrl-C that was noted."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a call; as it is a KeyboardInterrupt, a script ends unless it catches this.

    Attributes
    ----------
    result : Result, or what the call returns
        Best so far; of `simulate` the run that got farthest, without checks, whose status is INTERRUPTED.
    """

    def __init__(self, result: Any) -> None:
        super().__init__(getattr(result, "message", CTRL_C))
        self.result = result


class CtrlC:
    """Signal handler, its `note`, that remembers Ctrl-C; a second one raises KeyboardInterrupt at once."""

    def __init__(self) -> None:
        self.pressed = False

    def __call__(self) -> bool:
        """Return True if it came."""
        return self.pressed

    def note(self, number: int, frame: FrameType | None) -> None:
        """Remember it; the compiler has no safe point at which it would be asked for."""
        again, self.pressed = self.pressed, True
        if again or COMPILING.runs:
            raise KeyboardInterrupt(CTRL_C)


@contextmanager
def ctrl_c() -> Iterator[CtrlC]:
    """Yield the handler of Ctrl-C, True after it; always False in other threads, or where a caller has its own handler.

    Python's default handler would raise a KeyboardInterrupt inside a callback, which the engine turns into a failed step. Nested
    contexts use the handler of the outer one.
    """
    here = threading.current_thread() is threading.main_thread()
    before = signal.getsignal(signal.SIGINT) if here else None
    outer = getattr(before, "__self__", None)
    handler = outer if isinstance(outer, CtrlC) else CtrlC()
    replaced = before is signal.default_int_handler
    if replaced:
        signal.signal(signal.SIGINT, handler.note)
    try:
        yield handler
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
