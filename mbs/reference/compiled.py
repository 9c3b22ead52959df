"""What Numba needs: types of what the compiled parts hand to each other, and contact laws as compiled functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numba
from numba import float64, int64, void
from numba.core import cgutils
from numba.core.errors import NumbaError
from numba.extending import intrinsic

from buckler.mbs.laws.compiled import compile_method

V, T, COUNTS = float64[::1], float64[:, ::1], int64[::1]
FRICTION = numba.types.FunctionType(float64(float64))
NORMAL = numba.types.FunctionType(float64(float64, float64, float64))
MOTION = numba.types.FunctionType(void(float64, V, V, V, T, V, T, V, NORMAL, FRICTION))
"""Of `equations.motion`. Functions handed over as pointers are compiled, and cached, each for itself."""

jit = partial(numba.njit, error_model="numpy", forceinline=True)
law_jit = partial(numba.njit, error_model="numpy", fastmath={"afn"})
"""Allows x**1.5 to become x sqrt(x)."""


@intrinsic
def borrowed(_: Any, array: Any) -> Any:
    """The same array without its share in the memory's reference count; its owner must outlive it.

    Numba counts references at each call that it does not see through, by locked instructions: as long as the rest together.
    """

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        view = context.make_array(array)(context, builder, arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), codegen


@intrinsic
def pointer(_: Any, array: Any) -> Any:
    """Pointer to an array's first number."""

    def codegen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return context.make_array(array)(context, builder, arguments[0]).data

    return numba.types.CPointer(array.dtype)(array), codegen


def entry(signature: Any) -> Callable[[Callable[..., None]], Any]:
    """Compile for one signature, without the interpreter's lock; kept on disk where there is a place to write."""

    def compile_it(function: Callable[..., None]) -> Any:
        try:
            return jit(signature, nogil=True, cache=True)(function)
        except RuntimeError:  # nowhere to keep it
            return jit(signature, nogil=True)(function)

    return compile_it


class Laws(NamedTuple):
    """A normal and a friction law as pointers to machine code."""

    normal: Any
    friction: Any


def compile_laws(law: Any, friction: Any) -> Laws:
    """Compile what the equations of motion need of the two laws.

    Raises
    ------
    ValueError
        If a law is not plain arithmetic on its arguments and its own numbers.
    """
    normal = _kept(law, "force", float64(float64, float64, float64))
    return Laws(normal, _kept(friction, "coefficient", float64(float64)))


def _kept(law: Any, name: str, signature: Any) -> Any:
    """Compiled once where the law can be hashed: of a grid of normal and friction laws, each."""
    try:
        hash(law)
    except TypeError:
        return _pointer(law, name, signature)
    return _once(law, name, signature)


@lru_cache(maxsize=256)
def _once(law: Any, name: str, signature: Any) -> Any:
    return _pointer(law, name, signature)


def _pointer(law: Any, name: str, signature: Any) -> Any:
    try:
        method = compile_method(law, name, law_jit)
        if len(signature.args) == 3:
            return law_jit(signature)(lambda depth, rate, onset: method(depth, rate, onset))
        return law_jit(signature)(lambda x: method(x))
    except (NumbaError, AttributeError, TypeError) as error:
        raise ValueError(f"{law!r}: its method '{name}' does not compile: {str(error).splitlines()[0]}") from error
