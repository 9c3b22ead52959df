"""Compilation of laws: as functions that Numba can call, or as addresses of machine code.

The compiled solver knows the laws of this package as numbers in a table. A user's law is compiled once, its numbers being
constants of the code. A law that does more than arithmetic on its arguments and numbers is called back in Python, with
the same result and some fifty times slower; `Pointer.compiled` is then False.
"""

from __future__ import annotations

import ctypes
import dis
import inspect
import types
from collections import namedtuple
from collections.abc import Callable, Hashable, Sequence
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..geometry import Array
from ..process import has_compiler


class Pointer(NamedTuple):
    """Address of a C function of a pointer to doubles; True if it is machine code; the object that owns it."""

    address: int
    compiled: bool
    owner: object


def compile_method(law: object, name: str, jit: Callable[..., Any]) -> Callable[..., float]:
    """Compile a law's method by Numba's decorator `jit`: `self` becomes a tuple of the numbers and methods it uses.

    A method that does more than arithmetic on its arguments and the law's numbers raises NumbaError, AttributeError, TypeError or
    RecursionError.
    """
    function = inspect.unwrap(getattr(type(law), name))
    used = [n for n in function.__code__.co_names if hasattr(law, n)]
    values: list[Any] = [compile_method(law, n, jit) if callable(getattr(law, n)) else float(getattr(law, n)) for n in used]
    me: Any = namedtuple("me", used)  # type: ignore[misc]
    inner, bound = compile_plain(function, jit), me(*values)
    return jit(lambda *arguments: inner(bound, *arguments))


def compile_plain(function: Callable[..., object], jit: Callable[..., object], outer: Callable[..., object] | None = None) -> Any:
    """Compile a plain function, by `outer` where that is given, after the plain functions it calls."""
    if not isinstance(function, types.FunctionType):
        return function
    if any(each.opname == "RAISE_VARARGS" for each in dis.get_instructions(function)):
        raise TypeError(f"{function.__name__} may raise an exception, which compiled code would lose")
    names = function.__code__.co_names
    calls = {name: compile_plain(each, jit) for name, each in function.__globals__.items() if name in names}
    cells = tuple(types.CellType(compile_plain(cell.cell_contents, jit)) for cell in function.__closure__ or ()) or None
    calls["__name__"] = function.__module__
    plain = types.FunctionType(function.__code__, calls, function.__name__, function.__defaults__, cells)
    return (outer or jit)(plain)


def stamp_of(*paths: Path) -> str:
    """Compute a checksum of the contents of files, in any order."""
    return sha256(b"".join(sorted(path.read_bytes() for path in paths))).hexdigest()[:16]


def compile_cached(function: Callable[..., object], stamp: str, **options: object) -> Any:
    """Compile a function for the types it is called with; the machine code stays on disk until the stamp changes.

    Numba checks only the file of the function itself, although its machine code contains that of the functions it calls.
    Therefore the stamp is part of the name in the cache.
    """
    import numba

    name = function.__qualname__
    function.__qualname__ = f"{name}_{stamp}"
    try:
        found = numba.njit(cache=True, error_model="numpy", **options)(function)
    except RuntimeError:  # nowhere to keep it
        return numba.njit(error_model="numpy", **options)(function)
    module = function.__module__.rpartition(".")[2]
    for old in Path(found.stats.cache_path).glob(f"{module}.{name}[_-]*"):
        if stamp not in old.name:
            old.unlink(missing_ok=True)
    return found


def function_pointer(function: Callable[..., object], arguments: int) -> Pointer:
    """Return the address of a function of a number of floats, compiled once for all functions of the same code and values."""
    if isinstance(function, types.MethodType):
        law, name = function.__self__, function.__name__
        key: tuple[Any, ...] = ("method", type(law), _value(law), name, arguments)
        made_by = partial(compile_method, law, name)
    else:
        key, made_by = (_value(function), arguments), partial(compile_plain, function)
    if None in key:  # code or values are not known
        return _compile_pointer(made_by, arguments) or _call_back(function, arguments)
    if key not in _COMPILED:
        _COMPILED[key] = _compile_pointer(made_by, arguments)
        while len(_COMPILED) > MOST_KEPT:
            del _COMPILED[next(iter(_COMPILED))]
    return _COMPILED[key] or _call_back(function, arguments)


MOST_KEPT = 256
"""Number of functions whose machine code is kept for the next run of a process; some ten kilobytes each."""
_COMPILED: dict[Hashable, Pointer | None] = {}


def _value(thing: object, depth: int = 0) -> Hashable:
    """Return a key that is equal for equal machine code: the code of a function and the values it uses; None if unknown."""
    if isinstance(thing, types.FunctionType):
        used = {name: thing.__globals__[name] for name in _names(thing.__code__) if name in thing.__globals__}
        cells = [cell.cell_contents for cell in thing.__closure__ or ()]
        parts = [*used.items(), *cells, *(thing.__defaults__ or ())]
        values = tuple(_value(part, depth + 1) for part in parts) if depth < DEEPEST else (None,)
        return None if None in values else (thing.__code__, *values)
    if isinstance(thing, tuple):
        values = tuple(_value(part, depth) for part in thing)
        return None if None in values else values
    if isinstance(thing, int | float | str | bool):
        return type(thing), repr(thing)
    if callable(thing) or isinstance(thing, types.ModuleType) or type(thing).__hash__ is not object.__hash__:
        try:
            hash(thing)
        except TypeError:
            return None
        return type(thing), thing
    items = getattr(thing, "__dict__", {"": None}).items()
    values = tuple(_value(each, depth + 1) for each in items) if depth < DEEPEST else (None,)
    return None if None in values else (type(thing), *values)


DEEPEST = 8
"""Largest depth of functions that call functions to which code and values are compared."""


def _names(code: types.CodeType) -> set[str]:
    """Names of globals in a function's code and in that of the functions within it."""
    inner = (each for each in code.co_consts if isinstance(each, types.CodeType))
    return {*code.co_names, *(name for each in inner for name in _names(each))}


def _compile_pointer(made_by: Callable[[Any], Any], arguments: int) -> Pointer | None:
    """Compile the function that `made_by` makes with a decorator; None without a compiler, or if it fails."""
    if not has_compiler():
        return None
    import numba
    from numba.np.unsafe.ndarray import to_fixed_tuple

    errors = (numba.core.errors.NumbaError, AttributeError, TypeError, RecursionError, NotImplementedError, ValueError)
    signature = numba.float64(numba.types.CPointer(numba.float64))
    try:
        inner = made_by(numba.njit)
        made = numba.cfunc(signature, error_model="numpy")(
            lambda given: float(inner(*to_fixed_tuple(numba.carray(given, (arguments,)), arguments)))
        )
    except errors:
        return None
    return Pointer(int(made.address), True, made)


def evaluate_compiled(function: Callable[..., object], columns: Sequence[Array]) -> Array | None:
    """Evaluate a function at columns of arguments by the machine code that a run has made of it; None where there is none."""
    known = _COMPILED.get((_value(function), len(columns))) if isinstance(function, types.FunctionType) else None
    if known is None:
        return None
    values = np.empty(len(columns[0]))
    _row_caller()(known.address, np.column_stack(columns), values)
    return values


@cache
def _row_caller() -> Any:
    """Compile `call_rows`, once."""
    from . import table  # it loads Numba, which a run of the engine does not need

    return compile_cached(table.call_rows, stamp_of(Path(table.__file__)))


RAISED: list[BaseException] = []
"""First exception in a callback since the start of a run, which clears the list."""


def _call_back(function: Callable[..., Any], arguments: int) -> Pointer:
    """Return the address of a callback into Python; an exception there becomes nan, which the solver reports."""

    def safe(given: Any) -> float:
        """Call the function and store its exception, which ctypes would drop."""
        try:
            return float(function(*given[:arguments]))
        except (Exception, SystemExit) as error:  # ctypes would print and drop it
            RAISED[:] = RAISED or [error]
            return float("nan")

    made = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.POINTER(ctypes.c_double))(safe)
    return Pointer(int(ctypes.cast(made, ctypes.c_void_p).value or 0), False, made)
