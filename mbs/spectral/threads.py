"""The compiled solver's matrices are small: threads of the linear algebra library would wait for each other most of the time."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import scipy

NAMES = ("scipy_openblas_{}_num_threads", "openblas_{}_num_threads", "scipy_openblas_{}_num_threads64_")


@cache
def _doors() -> tuple[Any, Any] | None:
    """Functions that get and set the number of threads of scipy's own library, if it has one: Numba uses the same."""
    for file in Path(scipy.__file__).parent.parent.glob("scipy.libs/*openblas*"):
        library = ctypes.CDLL(str(file))
        for name in NAMES:
            if hasattr(library, name.format("set")):
                return getattr(library, name.format("get")), getattr(library, name.format("set"))
    return None


@contextmanager
def one_thread() -> Iterator[None]:
    """Let linear algebra use one thread."""
    doors = _doors()
    if doors is None:
        yield
        return
    before = doors[0]()
    doors[1](1)
    try:
        yield
    finally:
        doors[1](before)
