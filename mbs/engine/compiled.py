"""Laws and the clearance kernel through Numba. Imported only where Numba is installed and a scene has joints with clearance.

The kernel is compiled once for all laws: the laws of `buckler.mbs.laws` are numbers of a joint's row, as they are rows of the
table of the compiled solver, whose functions it calls. A user's own law is compiled for itself and is an address there.

The engine asks some ten times a step. Turning its lists into arrays, calling a compiled function of arrays and handing the
result back costs ten times what the contact forces themselves do: its user function is a function of C, made by Numba, which
Python takes for one of its own.
"""

from __future__ import annotations

import ctypes
import types as python_types
from collections.abc import Callable, Hashable, Sequence
from ctypes import POINTER, c_double, c_int, c_int64, c_ssize_t, c_void_p, pythonapi
from functools import cache, lru_cache, partial
from typing import Any, NamedTuple

import numba
import numpy as np
from numba import carray, cfunc, float64, int64, types, void
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

from ..elements import journal
from ..geometry import Array
from ..laws import BristleLaw, FrictionLaw, NormalLaw
from ..laws.compiled import Pointer
from ..spectral.compiling import kept
from ..spectral.laws import add_friction, add_normal
from ..spectral.lawtable import bristle_after, friction, normal_force
from . import Callback
from .kernel import PATIENCE, STUCK, Kernel, NoStepError

METH_VARARGS = 1
TIME, Q, Q_T = 1, 3, 4
"""Places among the engine's arguments: system, time, item, coordinates, their rates."""
OBJECT, NULL = c_ssize_t, 0
"""A pointer to an object of Python, as compiled code has it: a number."""


def _c(name: str, result: Any, *arguments: Any) -> Any:
    """Give a function of Python's C API a form that compiled code can call; the interpreter's lock is held there."""
    return ctypes.CFUNCTYPE(result, *arguments)(ctypes.cast(getattr(pythonapi, name), c_void_p).value)  # type: ignore[arg-type]


tuple_size = _c("PyTuple_Size", c_ssize_t, OBJECT)
tuple_item = _c("PyTuple_GetItem", OBJECT, OBJECT, c_ssize_t)
list_item = _c("PyList_GetItem", OBJECT, OBJECT, c_ssize_t)
list_size = _c("PyList_Size", c_ssize_t, OBJECT)
new_list = _c("PyList_New", OBJECT, c_ssize_t)
set_item = _c("PyList_SetItem", c_int, OBJECT, c_ssize_t, OBJECT)
as_float = _c("PyFloat_AsDouble", c_double, OBJECT)
new_float = _c("PyFloat_FromDouble", OBJECT, c_double)
set_error = _c("PyErr_SetObject", None, OBJECT, OBJECT)
as_size = _c("PyLong_AsSsize_t", c_ssize_t, OBJECT)
as_floats = _c("PyLong_AsVoidPtr", POINTER(c_double), OBJECT)
as_integers = _c("PyLong_AsVoidPtr", POINTER(c_int64), OBJECT)


class _Method(ctypes.Structure):
    """PyMethodDef."""

    _fields_ = (("name", ctypes.c_char_p), ("call", c_void_p), ("flags", c_int), ("doc", ctypes.c_char_p))


_function = pythonapi.PyCFunction_NewEx
_function.restype, _function.argtypes = ctypes.py_object, (POINTER(_Method), ctypes.py_object, c_void_p)


def engine_call(
    forces: Any, normal: Any, friction: Any, bend: Any, width: int
) -> Callable[[Array, Array, Array, int, Array], Callback]:
    """Compile the compiled `forces` of the clearance kernel with its laws into a maker of user functions; see `Kernel`.

    Each joint has `width` numbers.
    """

    @cfunc(types.intp(types.intp, types.intp))
    def call(own: Any, given: Any) -> Any:
        joints, n = as_size(tuple_item(own, 0)), as_size(tuple_item(own, 1))
        memory = carray(as_floats(tuple_item(own, 2)), (joints, 4))
        places = carray(as_integers(tuple_item(own, 3)), (joints, 2))
        numbers = carray(as_floats(tuple_item(own, 4)), (joints, width))
        q, v = carray(as_floats(tuple_item(own, 5)), n), carray(as_floats(tuple_item(own, 6)), n)
        out = carray(as_floats(tuple_item(own, 7)), n)
        latest = carray(as_floats(tuple_item(own, 8)), 2)  # time, and calls since that is the latest
        if tuple_size(given) <= Q_T:
            return tuple_item(given, Q_T)  # NULL, and sets Python's error: something else than the engine calls
        places_given, rates_given = tuple_item(given, Q), tuple_item(given, Q_T)
        if list_size(places_given) != n or list_size(rates_given) != n:
            return list_item(places_given, -1)  # NULL likewise
        t = as_float(tuple_item(given, TIME))
        latest[1] = 0.0 if t > latest[0] else latest[1] + 1.0
        latest[0] = max(t, latest[0])
        if latest[1] > PATIENCE:
            latest[1] = np.inf
            set_error(tuple_item(own, 9), tuple_item(own, 10))
            return NULL
        for i in range(n):
            q[i], v[i] = as_float(list_item(places_given, i)), as_float(list_item(rates_given, i))
        forces(normal, friction, bend, t, q, v, memory, places, numbers, out)
        result = new_list(n)
        for i in range(n):
            set_item(result, i, new_float(out[i]))
        return result

    method = _Method(b"forces", call.address, METH_VARARGS, None)

    def user_function(memory: Array, places: Array, numbers: Array, size: int, latest: Array) -> Callback:
        arrays = memory, places, numbers, np.zeros(size), np.zeros(size), np.zeros(size), latest
        # all that the machine code needs must live as long as the function: its own tuple holds it
        error = NoStepError, STUCK
        own = (len(memory), size, *(array.ctypes.data for array in arrays), *error, arrays, method, call)
        return _function(ctypes.byref(method), own, None)

    return user_function


V, T, PLACES = float64[::1], float64[:, ::1], int64[:, ::1]
PAIR, TRIPLE = float64(V, float64, float64), float64(V, float64, float64, float64)
LAWS = types.FunctionType(TRIPLE), types.FunctionType(PAIR), types.FunctionType(TRIPLE)
"""Normal force, friction coefficient, bristle."""
SIGNATURES = {"forces": void(*LAWS, float64, V, V, T, PLACES, T, V), "report": void(*LAWS, float64, V, V, T, PLACES, T, T)}
CODES, NUMBERS = 4, 8
"""Codes and numbers of a law. The codes of both laws follow the geometry, as the bits of
whole numbers, and the numbers of both laws follow them."""
GEOMETRY = 10
"""Numbers of a joint's row before those of the laws: places and arms of both ends, radius, clearance. It stands here because the
machine code kept on disk has it, and is compiled again when this file changes."""
BETWEEN, ALL = GEOMETRY + 2 * CODES, GEOMETRY + 2 * (CODES + NUMBERS)
NORMAL, FRICTION = range(2)


class _Table(NamedTuple):
    """Both laws of a joint, as the compiled solver's table has them."""

    laws: Array
    law_numbers: Array


def _block(first: int, columns: int, scalar: Any) -> Any:
    """Make what reads two rows of so many columns, from a place in a joint's row on; the row must outlive them.

    A slice and a reshape do the same, and take as long as the law itself.
    """
    kind = types.Array(scalar, 2, "C")

    @intrinsic
    def block(_typing: Any, numbers: Any) -> Any:
        def codegen(context: Any, builder: Any, _signature: Any, values: Any) -> Any:
            row, found = context.make_array(numbers)(context, builder, values[0]), context.make_array(kind)(context, builder)
            size = context.get_constant
            data = builder.bitcast(builder.gep(row.data, [size(types.intp, first)]), found.data.type)
            shape, strides = ([size(types.intp, k) for k in pair] for pair in ((2, columns), (8 * columns, 8)))
            populate_array(found, data=data, shape=shape, strides=strides, itemsize=size(types.intp, 8), meminfo=None)
            return found._getvalue()

        return kind(numbers), codegen

    return block


_codes, _numbers = _block(GEOMETRY, CODES, int64), _block(BETWEEN, NUMBERS, float64)


@numba.njit(error_model="numpy")
def _laws_of(numbers):  # type: ignore[no-untyped-def]
    return _Table(_codes(numbers), _numbers(numbers))


@cache
def _laws() -> tuple[Any, Any, Any]:
    """Normal force, friction coefficient and bristle of the laws in a joint's row of numbers."""

    def normal(numbers, depth, rate, onset):  # type: ignore[no-untyped-def]
        return normal_force(_laws_of(numbers), NORMAL, depth, rate, onset)

    def rubbing(numbers, speed, bristle):  # type: ignore[no-untyped-def]
        return friction(_laws_of(numbers), FRICTION, speed, bristle)

    def bend(numbers, bristle, speed, time):  # type: ignore[no-untyped-def]
        return bristle_after(_laws_of(numbers), FRICTION, bristle, speed, time)

    made = tuple(kept(law, "lawtable") for law in (normal, rubbing, bend))
    for law, kind in zip(made, (TRIPLE, PAIR, TRIPLE), strict=True):
        law.compile(kind)
        law.disable_compile()
    return made


@cache
def _compiled(function: Callable[..., Any]) -> Any:
    """Compile one of the journal's functions after those it calls; with one of `SIGNATURES`, at once and kept on disk."""
    names = function.__code__.co_names
    calls = {
        k: _compiled(v) if isinstance(v, python_types.FunctionType) else v for k, v in function.__globals__.items() if k in names
    }
    plain = python_types.FunctionType(function.__code__, calls | {"__name__": function.__module__}, function.__name__)
    signature = SIGNATURES.get(function.__name__)
    if signature is None:
        return numba.njit(plain, error_model="numpy")
    try:
        return numba.njit(signature, error_model="numpy", cache=True)(plain)
    except RuntimeError:  # nowhere to keep it
        return numba.njit(signature, error_model="numpy")(plain)


@cache
def _functions() -> tuple[Any, Any, Any]:
    """The kernel with the laws, and what makes the engine's user functions of it; once for all laws."""
    normal, rubbing, bend = laws = _laws()
    forces, report = (_compiled(getattr(journal, name)) for name in SIGNATURES)

    @numba.njit(void(float64, V, V, T, PLACES, T, T), error_model="numpy")
    def asked(t, q, v, memory, places, numbers, out):  # type: ignore[no-untyped-def]  # laws as arguments cost a millisecond
        report(normal, rubbing, bend, t, q, v, memory, places, numbers, out)

    return partial(forces, *laws), asked, engine_call(forces, *laws, ALL)


@lru_cache(maxsize=256)
def compile_kernel(law: NormalLaw, friction: FrictionLaw | BristleLaw) -> Kernel | None:
    """Build the kernel for these laws; None if a law does more than arithmetic on its arguments and its own numbers."""
    rows = _Rows()
    add_normal(rows, law)
    add_friction(rows, friction)
    if not all(pointer.compiled for pointer in rows.pointers):
        return None
    constants = np.concatenate([np.array(rows.codes, dtype=np.int64).ravel().view(float), np.array(rows.numbers).ravel()])
    return Kernel(*_functions(), compiled=True, constants=constants, owners=tuple(rows.pointers))


class _Rows:
    """What the functions that describe laws to the compiled solver write into."""

    def __init__(self) -> None:
        self.codes: list[list[int]] = []
        self.numbers: list[list[float]] = []
        self.pointers: list[Pointer] = []

    def add_law(
        self, _key: Hashable, kind: int, numbers: Sequence[float], pointers: Sequence[Pointer] = (), _about: str = ""
    ) -> int:
        addresses = [pointer.address for pointer in pointers]
        self.codes.append([kind, *addresses, *[0] * (CODES - 1 - len(addresses))])
        self.numbers.append([*map(float, numbers), *[0.0] * (NUMBERS - len(numbers))])
        self.pointers += pointers
        return len(self.codes) - 1
