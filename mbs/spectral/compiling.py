"""How the kernel is compiled: once for all mechanisms, kept on disk, without the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from llvmlite import ir
from numba import float64, int64
from numba.core import cgutils
from numba.extending import intrinsic

from buckler.mbs.spectral.tables import Tables, Work

COMPILED = (
    "compiling", "tables", "markers", "lawtable", "strips", "forces", "kernel", "output", "contacts", "room", "radau", "implicit",
    "explicit", "ledger", "recording",
)  # fmt: skip
"""Files that hold compiled functions."""
SUMS = {"reassoc", "contract", "arcp", "nsz"}
"""Liberties with the order of sums, which let them be made four at a time; what is not finite is still seen."""


def _stamp() -> tuple[tuple[str, float, int], ...]:
    """Names, times and sizes of the files that hold compiled functions."""
    files = [Path(__file__).with_name(f"{name}.py") for name in COMPILED]
    return tuple((file.name, file.stat().st_mtime, file.stat().st_size) for file in files)


STAMP = _stamp()


def jit(function: Callable[..., Any]) -> Any:
    """Compile for the types it is first called with, and keep that on disk as long as none of these files changes.

    Numba looks only at the file of the function itself, but its machine code holds that of the functions it calls.
    """
    compiled = numba.njit(error_model="numpy", nogil=True, fastmath=SUMS)(function)
    try:
        compiled.enable_caching()
        compiled._cache._cache_file._source_stamp = STAMP
    except (RuntimeError, AttributeError):  # nowhere to keep it, or another Numba
        compiled = numba.njit(error_model="numpy", nogil=True, fastmath=SUMS)(function)
    return compiled


def inner(function: Callable[..., Any]) -> Any:
    """Compile a function that only compiled ones call: no door for Python, nothing kept on disk, half the time."""
    return numba.njit(error_model="numpy", nogil=True, fastmath=SUMS, no_cpython_wrapper=True, no_cfunc_wrapper=True)(function)


def close(function: Callable[..., Any]) -> Any:
    """Compile a function into those that call it: handing over all tables in a call takes a tenth of a microsecond."""
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}
    return numba.njit(error_model="numpy", nogil=True, fastmath=SUMS, **options)(function)


def _call(arguments: int) -> Any:
    """Make an intrinsic that calls a C function of that many doubles by its address."""

    def codegen(_context: Any, builder: Any, _signature: Any, values: Any) -> Any:
        double = ir.DoubleType()
        kind = ir.FunctionType(double, [double] * arguments)
        return builder.call(builder.inttoptr(values[0], kind.as_pointer()), values[1:])

    return codegen


@intrinsic
def call1(_typing: Any, address: Any, a: Any) -> Any:
    """f(a) of the function at this address."""
    return float64(int64, float64), _call(1)


@intrinsic
def call2(_typing: Any, address: Any, a: Any, b: Any) -> Any:
    """f(a, b) of the function at this address."""
    return float64(int64, float64, float64), _call(2)


@intrinsic
def call3(_typing: Any, address: Any, a: Any, b: Any, c: Any) -> Any:
    """f(a, b, c) of the function at this address."""
    return float64(int64, float64, float64, float64), _call(3)


@intrinsic
def borrowed(_typing: Any, array: Any) -> Any:
    """The same array without its share in the memory's reference count; its owner must outlive it.

    Numba counts references at each call that it does not see through, by locked instructions: as long as the rest together.
    """

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        view = context.make_array(array)(context, builder, values[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), codegen


@close
def lend_tables(s):
    """The tables without their shares in the memory's reference counts."""
    return Tables(
        borrowed(s.mass), borrowed(s.weight), borrowed(s.modal), borrowed(s.strips), borrowed(s.markers), borrowed(s.places),
        borrowed(s.measures), borrowed(s.directions), borrowed(s.rows), borrowed(s.values), borrowed(s.motions),
        borrowed(s.ramps), borrowed(s.forces), borrowed(s.factors), borrowed(s.elastic),
        borrowed(s.laws), borrowed(s.law_numbers), borrowed(s.data),
    )  # fmt: skip


@close
def lend_work(w):
    """The room to work in, likewise."""
    return Work(
        borrowed(w.state), borrowed(w.slope), borrowed(w.drift), borrowed(w.small), borrowed(w.element), borrowed(w.mixed),
        borrowed(w.stress), borrowed(w.slack), borrowed(w.held), borrowed(w.strain), borrowed(w.force), borrowed(w.reports),
    )  # fmt: skip
