"""Laws and the clearance kernel through Numba. Imported only where Numba is installed and a scene has joints with play."""

from __future__ import annotations

import inspect
import types
from collections import namedtuple
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numba

from mbs import clearance


def compile_method(law: Any, name: str) -> Callable[..., float]:
    """Compile a law's method as a function of floats: `self` becomes a tuple of the numbers the method reads.

    Raises
    ------
    numba.core.errors.NumbaError, AttributeError
        If the method does more than arithmetic on its arguments and the law's numbers, such as calling other methods.
    """
    function = getattr(type(law), name)
    names = [n for n in function.__code__.co_names if isinstance(getattr(law, n, None), int | float)]
    numbers = namedtuple("numbers", names)(*(float(getattr(law, n)) for n in names))  # type: ignore[arg-type]
    inner = _compiled(function)
    if len(inspect.signature(function).parameters) == 2:  # self and the sliding speed
        return numba.njit(lambda speed: inner(numbers, speed))
    return numba.njit(lambda depth, rate, onset: inner(numbers, depth, rate, onset))


def _compiled(function: Callable[..., Any]) -> Any:
    """Compile a plain function after the plain functions it calls."""
    names = function.__code__.co_names
    calls = {k: _compiled(v) if inspect.isfunction(v) else v for k, v in function.__globals__.items() if k in names}
    return numba.njit(types.FunctionType(function.__code__, calls, function.__name__))


@lru_cache(maxsize=32)
def compile_kernel(law: Any, friction: Any) -> clearance.Kernel | None:
    """Compile the kernel for these laws; None if they do not compile."""
    try:
        normal, sliding = compile_method(law, "force"), compile_method(friction, "coefficient")
        normal(1e-6, 0.0, 1.0), sliding(0.1)
    except (numba.core.errors.NumbaError, AttributeError):
        return None
    made = {name: _with_laws(getattr(clearance, name), normal, sliding) for name in ("_forces", "_report")}
    along = _with_laws(clearance._along, normal, sliding)
    return clearance.Kernel(made["_forces"], made["_report"], along, compiled=True)


def _with_laws(function: Callable[..., None], normal: Any, sliding: Any) -> Any:
    inner = _compiled(function)
    return numba.njit(lambda q, v, onset, places, numbers, out: inner(q, v, onset, places, numbers, normal, sliding, out))
