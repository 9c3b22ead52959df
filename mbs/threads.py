"""Matrices and vectors are small: threads of the linear algebra library would wait for each other most of the time."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from threading import Lock

import scipy

_LOCK = Lock()
_BEFORE: list[list[int]] = []
"""Numbers of threads that those found who entered; the last to leave takes those of the first."""
NAMES = ("scipy_openblas_{}_num_threads", "openblas_{}_num_threads", "scipy_openblas_{}_num_threads64_")


@cache
def _doors() -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Functions that get and set the number of threads of the libraries of SciPy and of NumPy."""
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
        _BEFORE.append([read() for read, _ in _doors()])
        for _, write in _doors():
            write(1)
    try:
        yield
    finally:
        with _LOCK:
            for (_, write), count in zip(_doors(), _BEFORE.pop(), strict=True):
                write(count)
