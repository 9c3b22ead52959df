"""Whether there is a compiler, and a clock that does not count its work."""

from __future__ import annotations

import os
from functools import cache
from importlib.util import find_spec
from time import perf_counter


@cache
def compiler() -> bool:
    """Whether Numba is installed, and is not switched off by its variable NUMBA_DISABLE_JIT.

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
