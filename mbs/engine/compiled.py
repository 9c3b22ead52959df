"""Laws and the clearance kernel through Numba. Imported only where Numba is installed and a scene has joints with clearance.

The kernel takes the laws as pointers to machine code: it is compiled once and kept on disk. Laws, whose numbers are constants
of their code, are compiled for each scene that has others.
"""

from __future__ import annotations

import types
from collections.abc import Callable
from functools import cache, lru_cache, partial
from typing import Any

import numba
from numba import float64, int64, void

from buckler.mbs.elements import journal
from buckler.mbs.engine.callback import engine_call
from buckler.mbs.engine.kernel import Kernel, has_bristle
from buckler.mbs.laws.compiled import LAW_ERRORS, compile_method

PAIR, TRIPLE = float64(float64, float64), float64(float64, float64, float64)
LAWS = numba.types.FunctionType(TRIPLE), numba.types.FunctionType(PAIR), numba.types.FunctionType(TRIPLE)
"""Normal force, friction coefficient, bristle."""
V, T, PLACES = float64[::1], float64[:, ::1], int64[:, ::1]
SIGNATURES = {
    "forces": void(*LAWS, float64, V, V, T, PLACES, T, V),
    "report": void(*LAWS, float64, V, V, T, PLACES, T, T),
}


@cache
def _compiled(function: Callable[..., Any]) -> Any:
    """Compile one of the journal's functions after those it calls; with one of `SIGNATURES`, at once and kept on disk."""
    names = function.__code__.co_names
    calls = {k: _compiled(v) if isinstance(v, types.FunctionType) else v for k, v in function.__globals__.items() if k in names}
    plain = types.FunctionType(function.__code__, calls | {"__name__": function.__module__}, function.__name__)
    signature = SIGNATURES.get(function.__name__)
    if signature is None:
        return numba.njit(plain, error_model="numpy")
    try:
        return numba.njit(signature, error_model="numpy", cache=True)(plain)
    except RuntimeError:  # nowhere to keep it
        return numba.njit(signature, error_model="numpy")(plain)


@lru_cache(maxsize=32)
def compile_kernel(law: Any, friction: Any) -> Kernel | None:
    """Compile the kernel for these laws; None if they do not compile."""
    try:
        laws = _laws(law, friction)
    except LAW_ERRORS:
        return None
    forces, report = (partial(_compiled(getattr(journal, name)), *laws) for name in SIGNATURES)
    return Kernel(forces, report, engine_call(forces.func, *laws), compiled=True)


def _laws(law: Any, friction: Any) -> tuple[Any, Any, Any]:
    """Normal force of (depth, rate, onset), friction of (speed, bristle), bristle of (bristle, speed, time)."""
    force, coefficient = compile_method(law, "force"), compile_method(friction, "coefficient")
    normal = numba.njit(TRIPLE)(lambda depth, rate, onset: force(depth, rate, onset))
    if not has_bristle(friction):
        sliding = numba.njit(PAIR)(lambda speed, bristle: coefficient(speed))
        return normal, sliding, numba.njit(TRIPLE)(lambda bristle, speed, time: 0.0)
    after = compile_method(friction, "after")
    rubbing = numba.njit(PAIR)(lambda speed, bristle: coefficient(speed, bristle))
    return normal, rubbing, numba.njit(TRIPLE)(lambda bristle, speed, time: after(bristle, speed, time))
