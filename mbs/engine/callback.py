"""A compiled force as a function the engine can call: Python's own C functions read its lists, and no interpreter runs.

The engine asks some ten times a step. Turning its lists into arrays, calling a compiled function of arrays and handing the
result back costs ten times what the contact forces themselves do; this is a function of C, made by Numba, which Python takes
for one of its own.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import POINTER, c_double, c_int, c_int64, c_ssize_t, c_void_p, pythonapi
from typing import Any

import numpy as np
from numba import carray, cfunc, types

from buckler.mbs.engine.kernel import PATIENCE, STUCK, NoStepError
from buckler.mbs.engine.system import Callback
from buckler.mbs.geometry import Array

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
