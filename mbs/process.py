"""State of the process during a run: Ctrl-C, threads of linear algebra, the compiler, a clock that leaves out compile time."""

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
    """Return True if Numba is installed and not switched off by NUMBA_DISABLE_JIT: without it functions run as plain Python."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") in ("", "0") and find_spec("numba") is not None


class Stopwatch:
    """Time that this process has spent compiling [s], and True while it compiles; `mbs.spectral.compiling` sets both."""

    seconds = 0.0
    is_active = False


COMPILING = Stopwatch()


def working_time() -> float:
    """Return the time of a clock that stops while functions are compiled [s]."""
    return perf_counter() - COMPILING.seconds


Progress = Callable[[float], None]
"""Function that is called with the fraction of a run that is done."""
CTRL_C = "Ctrl-C"
"""Text of the KeyboardInterrupt that Buckler raises after Ctrl-C."""


class Interrupted(KeyboardInterrupt):
    """End of a call by Ctrl-C, with the best answer so far as `result`, of the type that the call returns.

    `simulate` gives the Result of the run that got farthest, with the status INTERRUPTED and no self-checks made.
    """

    def __init__(self, result: Any) -> None:
        super().__init__(getattr(result, "message", CTRL_C))
        self.result = result


class Handler:
    """Memory of Ctrl-C: `note` is the signal handler."""

    is_pressed = False

    def __call__(self) -> bool:
        """Return True if Ctrl-C was pressed."""
        return self.is_pressed

    def note(self, number: int, frame: FrameType | None) -> None:
        """Remember Ctrl-C; raise KeyboardInterrupt the second time, and at once in the compiler, which never asks for it."""
        was_pressed, self.is_pressed = self.is_pressed, True
        if was_pressed or COMPILING.is_active:
            raise KeyboardInterrupt(CTRL_C)


@contextmanager
def catch_ctrl_c() -> Iterator[Handler]:
    """Yield a `Handler`, which returns True after Ctrl-C; always False in other threads or under a caller's own handler.

    Python's default handler would raise a KeyboardInterrupt inside a function that Exudyn calls, which then takes the step for
    failed. Nested contexts use the handler of the outer one.
    """
    is_main = threading.current_thread() is threading.main_thread()
    previous = signal.getsignal(signal.SIGINT) if is_main else None
    outer = getattr(previous, "__self__", None)  # of the method `note` of an outer context: the Handler
    handler = outer if isinstance(outer, Handler) else Handler()
    is_default = previous is signal.default_int_handler
    if is_default:
        signal.signal(signal.SIGINT, handler.note)
    try:
        yield handler
    finally:
        if is_default:
            signal.signal(signal.SIGINT, signal.default_int_handler)


_LOCK = Lock()
_COUNTS: list[list[int]] = []
"""Numbers of threads found at the start of each active `one_thread`: the original ones, then always 1. A context that ends takes
and restores the last entry, so that the last to end, in any order, restores the original numbers."""


@cache
def _thread_functions() -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Find the functions that get and set the number of threads, in the OpenBLAS libraries of SciPy and NumPy."""
    found = []
    for package in ("scipy", "numpy"):
        for file in Path(scipy.__file__).parent.parent.glob(f"{package}.libs/*openblas*"):
            library = ctypes.CDLL(str(file))
            # a library has functions of one of these names, with `get` or `set` in the braces
            for name in ("scipy_openblas_{}_num_threads", "openblas_{}_num_threads", "scipy_openblas_{}_num_threads64_"):
                if hasattr(library, name.format("set")):
                    found.append((getattr(library, name.format("get")), getattr(library, name.format("set"))))
    return found


@contextmanager
def one_thread() -> Iterator[None]:
    """Let linear algebra use one thread until the last active context of this kind ends."""
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
