"""Compilation of users' functions and laws by Numba, to functions or to addresses of machine code.

The compiled solver has the laws of this package as numbers in a table. A user's law is compiled once, with its numbers as
constants in the machine code. A law that does more than arithmetic on its arguments and numbers is a callback into Python, with
the same result but some fifty times slower; `Pointer.compiled` is then False. `jit` stands for a decorator such as `numba.njit`.
"""

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
    """Address of a C function that takes a pointer to doubles; `compiled` is False for a callback; `owner` keeps it alive."""

    address: int
    compiled: bool
    owner: object


def compile_method(law: object, name: str, jit: Callable[..., Any]) -> Callable[..., float]:
    """Compile a method of a law; its `self` becomes a named tuple of the numbers and compiled methods that it uses."""
    function = inspect.unwrap(getattr(type(law), name))
    # `co_names` has globals and attributes; a global with the name of an attribute adds a field to the tuple that is not used
    used = [attribute for attribute in function.__code__.co_names if hasattr(law, attribute)]
    values: list[Any] = []
    for attribute in used:
        value = getattr(law, attribute)
        values.append(compile_method(law, attribute, jit) if callable(value) else float(value))
    law_type: Any = namedtuple("law_type", used)  # type: ignore[misc]
    inner, bound = compile_function(function, jit), law_type(*values)
    return jit(lambda *arguments: inner(bound, *arguments))


def compile_function(function: Callable[..., object], jit: Callable[..., object]) -> Any:
    """Compile a function, and the Python functions that it calls, by `jit`; return anything else unchanged."""
    return jit(with_compiled_names(function, jit)) if isinstance(function, types.FunctionType) else function


def with_compiled_names(function: types.FunctionType, jit: Callable[..., object]) -> types.FunctionType:
    """Copy a function with compiled functions in its globals and closure; raise a TypeError if it may raise an exception."""
    if any(each.opname == "RAISE_VARARGS" for each in dis.get_instructions(function)):
        raise TypeError(f"{function.__name__} may raise an exception, which compiled code would lose")
    names = function.__code__.co_names  # not those that only nested functions use: then Numba refuses the function
    used = {name: compile_function(each, jit) for name, each in function.__globals__.items() if name in names}
    cells = tuple(types.CellType(compile_function(cell.cell_contents, jit)) for cell in function.__closure__ or ()) or None
    used["__name__"] = function.__module__
    return types.FunctionType(function.__code__, used, function.__name__, function.__defaults__, cells)


def stamp_of(*paths: Path) -> str:
    """Compute a checksum of the contents of files, in any order."""
    return sha256(b"".join(sorted(path.read_bytes() for path in paths))).hexdigest()[:16]  # 64 bits tell all versions apart


def compile_cached(function: Callable[..., object], stamp: str, **options: object) -> Any:
    """Compile a function for the types it is called with, and keep its machine code on disk until the stamp changes.

    Numba does not look at files of functions that it calls: so the stamp is a part of its name in the cache.
    """
    import numba

    name = function.__qualname__
    function.__qualname__ = f"{name}_{stamp}"
    try:
        found = numba.njit(cache=True, error_model="numpy", **options)(function)
    except RuntimeError:  # no folder can be written
        return numba.njit(error_model="numpy", **options)(function)
    module = function.__module__.rpartition(".")[2]
    # Numba names its files module.name_stamp-line... The pattern also matches functions with a longer name of the same module.
    # Their files in use have this stamp, too, as all functions of a module are compiled with one stamp.
    for old in Path(found.stats.cache_path).glob(f"{module}.{name}[_-]*"):
        if stamp not in old.name:
            old.unlink(missing_ok=True)
    return found


def function_pointer(function: Callable[..., object], arguments: int) -> Pointer:
    """Return the address of a function of a number of `arguments`, compiled once for all functions of equal code and values."""
    if isinstance(function, types.MethodType):
        law, name = function.__self__, function.__name__
        key: tuple[Any, ...] = ("method", type(law), _identify(law), name, arguments)
        compile_with = partial(compile_method, law, name)
    else:
        key, compile_with = (_identify(function), arguments), partial(compile_function, function)
    if None in key:  # code or values are not known
        return _compile_pointer(compile_with, arguments) or _make_callback(function, arguments)
    if key not in _COMPILED:
        _COMPILED[key] = _compile_pointer(compile_with, arguments)
        while len(_COMPILED) > MOST_KEPT:
            del _COMPILED[next(iter(_COMPILED))]
    return _COMPILED[key] or _make_callback(function, arguments)


MOST_KEPT = 256
"""Number of functions whose machine code a process keeps for later runs; some ten kilobytes each."""
_COMPILED: dict[Hashable, Pointer | None] = {}
"""Machine code by the key of its function; None for a function that Numba does not compile."""


def _identify(function: object) -> Hashable:
    """Return a key of a function's code and the values it uses, equal for equal machine code; None if values are not known."""
    try:
        return _make_key(function, 0)
    except TypeError:  # a value cannot be hashed, and so not be compared with one of an earlier call
        return None


def _make_key(thing: object, depth: int) -> Hashable:
    """Return the key of a thing that a function uses; `depth` is the number of functions and objects around it.

    A law, a built-in or compiled function and a module are their own keys. The key of a Python function has its code and the
    values that it uses; the key of any other object has its attributes. Without a key, as for a list, raise a TypeError.
    """
    if isinstance(thing, tuple):
        return tuple(_make_key(part, depth) for part in thing)
    if isinstance(thing, int | float | str | bool):
        return type(thing), repr(thing)
    has_equality = type(thing).__hash__ is not object.__hash__  # true for frozen objects, as laws, and for lists
    has_key = has_equality or callable(thing) or isinstance(thing, types.ModuleType)
    if has_key and not isinstance(thing, types.FunctionType):
        hash(thing)  # raises a TypeError for a list, whose `__hash__` is None
        return type(thing), thing  # laws are compared by equality, functions and modules by identity
    if depth == DEEPEST or not hasattr(thing, "__dict__"):
        raise TypeError("too many levels, or a value without attributes")
    if isinstance(thing, types.FunctionType):
        return thing.__code__, *(_make_key(part, depth + 1) for part in _values_used(thing))
    return type(thing), *(_make_key(part, depth + 1) for part in thing.__dict__.items())


def _values_used(function: types.FunctionType) -> Sequence[object]:
    """Return the globals with their names, variables of closures and defaults of a function."""
    known = function.__globals__
    used = [(name, known[name]) for name in _global_names(function.__code__) if name in known]
    return [*used, *(cell.cell_contents for cell in function.__closure__ or ()), *(function.__defaults__ or ())]


DEEPEST = 8
"""Levels of functions that call functions down to which code and values are compared; deeper ones are compiled each time."""


def _global_names(code: types.CodeType) -> set[str]:
    """Return the names of globals in the code of a function and of the functions within it."""
    inner = (each for each in code.co_consts if isinstance(each, types.CodeType))
    return {*code.co_names, *(name for each in inner for name in _global_names(each))}


def _compile_pointer(compile_with: Callable[[Any], Any], arguments: int) -> Pointer | None:
    """Compile a C function from `compile_with(jit)`; None without a compiler, or if the function cannot be compiled."""
    if not has_compiler():
        return None
    import numba
    from numba.np.unsafe.ndarray import to_fixed_tuple

    errors = numba.core.errors
    refusals = (
        errors.NumbaError,
        errors.UnsupportedBytecodeError,
        AttributeError,
        TypeError,
        RecursionError,
        NotImplementedError,
        ValueError,
    )
    signature = numba.float64(numba.types.CPointer(numba.float64))
    try:
        inner = compile_with(numba.njit)
        c_function = numba.cfunc(signature, error_model="numpy")(
            lambda doubles: float(inner(*to_fixed_tuple(numba.carray(doubles, (arguments,)), arguments)))
        )
    except refusals:
        return None
    return Pointer(int(c_function.address), True, c_function)


def evaluate_compiled(function: Callable[..., object], columns: Sequence[Array]) -> Array | None:
    """Evaluate a function for columns of arguments by machine code of an earlier run; None if there is none."""
    known = _COMPILED.get((_identify(function), len(columns))) if isinstance(function, types.FunctionType) else None
    if known is None:
        return None
    values = np.empty(len(columns[0]))
    _row_caller()(known.address, np.column_stack(columns), values)
    return values


@cache
def _row_caller() -> Any:
    from . import table  # it loads Numba, which a run of the engine does not need

    return compile_cached(table.call_rows, stamp_of(Path(table.__file__)))


RAISED: list[BaseException] = []
"""The first exception in a callback of a run, which clears the list at its start."""


def _make_callback(function: Callable[..., Any], arguments: int) -> Pointer:
    """Return the address of a callback into Python, which returns nan after an exception; the solver reports it."""

    def safe(doubles: Any) -> float:
        """Call the function and store its first exception, which ctypes would print and drop."""
        try:
            return float(function(*doubles[:arguments]))
        except (Exception, SystemExit) as error:
            RAISED[:] = RAISED or [error]
            return float("nan")

    callback = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.POINTER(ctypes.c_double))(safe)
    return Pointer(int(ctypes.cast(callback, ctypes.c_void_p).value or 0), False, callback)
