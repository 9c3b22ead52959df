"""Laws and the clearance kernel through Numba. Imported only where Numba is installed and a scene has joints with play.

The kernel takes the laws as pointers to machine code: it is compiled once and kept on disk. Laws, whose numbers are constants
of their code, are compiled for each scene that has others.
"""

from __future__ import annotations

import types
from collections import namedtuple
from collections.abc import Callable
from functools import cache, lru_cache, partial
from typing import Any

import numba
from numba import float64, int64, void

from buckler.mbs.elements import journal
from buckler.mbs.engine.callback import engine_call

PAIR, TRIPLE = float64(float64, float64), float64(float64, float64, float64)
LAWS = numba.types.FunctionType(TRIPLE), numba.types.FunctionType(PAIR), numba.types.FunctionType(TRIPLE)
"""Normal force, friction coefficient, bristle."""
V, T, PLACES = float64[::1], float64[:, ::1], int64[:, ::1]
SIGNATURES = {
    "_forces": void(*LAWS, float64, V, V, T, PLACES, T, V),
    "_report": void(*LAWS, float64, V, V, T, PLACES, T, T),
}


def compile_method(law: Any, name: str) -> Callable[..., float]:
    """Compile a law's method as a function of floats: `self` becomes a tuple of the numbers and methods it uses.

    Raises
    ------
    numba.core.errors.NumbaError, AttributeError, TypeError, RecursionError
        If the method does more than arithmetic on its arguments and the law's numbers.
    """
    function = getattr(type(law), name)
    used = [n for n in function.__code__.co_names if hasattr(law, n)]
    values: list[Any] = [compile_method(law, n) if callable(getattr(law, n)) else float(getattr(law, n)) for n in used]
    inner, me = _compiled(function), namedtuple("me", used)(*values)
    return numba.njit(lambda *arguments: inner(me, *arguments))


@cache
def _compiled(function: Callable[..., Any]) -> Any:
    """Compile a plain function after the plain functions it calls; with one of `SIGNATURES`, at once and kept on disk."""
    names = function.__code__.co_names
    calls = {k: _compiled(v) if isinstance(v, types.FunctionType) else v for k, v in function.__globals__.items() if k in names}
    plain = types.FunctionType(function.__code__, calls | {"__name__": function.__module__}, function.__name__)
    if function.__module__ != journal.__name__:
        return numba.njit(plain)
    signature = SIGNATURES.get(function.__name__)
    if signature is None:
        return numba.njit(plain, error_model="numpy")
    try:
        return numba.njit(signature, error_model="numpy", cache=True)(plain)
    except RuntimeError:  # nowhere to keep it
        return numba.njit(signature, error_model="numpy")(plain)


@lru_cache(maxsize=32)
def compile_kernel(law: Any, friction: Any) -> journal.Kernel | None:
    """Compile the kernel for these laws; None if they do not compile."""
    try:
        laws = _laws(law, friction)
    except (numba.core.errors.NumbaError, AttributeError, TypeError, RecursionError):
        return None
    forces, report = (partial(_compiled(getattr(journal, name)), *laws) for name in SIGNATURES)
    return journal.Kernel(forces, report, engine_call(forces.func, *laws), compiled=True)


def _laws(law: Any, friction: Any) -> tuple[Any, Any, Any]:
    """Normal force of (depth, rate, onset), friction of (speed, bristle), bristle of (bristle, speed, time)."""
    force, coefficient = compile_method(law, "force"), compile_method(friction, "coefficient")
    normal = numba.njit(TRIPLE)(lambda depth, rate, onset: force(depth, rate, onset))
    if not journal.has_bristle(friction):
        sliding = numba.njit(PAIR)(lambda speed, bristle: coefficient(speed))
        return normal, sliding, numba.njit(TRIPLE)(lambda bristle, speed, time: 0.0)
    after = compile_method(friction, "after")
    rubbing = numba.njit(PAIR)(lambda speed, bristle: coefficient(speed, bristle))
    return normal, rubbing, numba.njit(TRIPLE)(lambda bristle, speed, time: after(bristle, speed, time))
