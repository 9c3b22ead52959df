"""Calls of C functions of doubles by their address, from compiled code or, without a compiler, from Python."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from ctypes import CFUNCTYPE, POINTER, c_double
from typing import Any

from ..geometry import Array
from ..process import compiler

if compiler():
    from numba import float64, int64
    from numba.extending import intrinsic

    def _call(arguments: int) -> Callable[..., Any]:
        """Make the writer of a call of that many doubles."""

        def codegen(context: Any, builder: Any, _signature: Any, values: Sequence[Any]) -> Any:
            """Emit the call of the function at the address."""
            from llvmlite import ir

            kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType()] * arguments)
            return builder.call(builder.inttoptr(values[0], kind.as_pointer()), values[1:])

        return codegen

    @intrinsic
    def call1(_typing: object, address: object, a: object) -> Any:
        """f(a) of the function at this address."""
        return float64(int64, float64), _call(1)

    @intrinsic
    def call2(_typing: object, address: object, a: object, b: object) -> Any:
        """f(a, b) of the function at this address."""
        return float64(int64, float64, float64), _call(2)

    @intrinsic
    def call3(_typing: object, address: object, a: object, b: object, c: object) -> Any:
        """f(a, b, c) of the function at this address."""
        return float64(int64, float64, float64, float64), _call(3)

    @intrinsic
    def call_array(_typing: Any, address: Any, given: Any) -> Any:
        """Call the function at this address with the numbers in an array."""

        def codegen(context: Any, builder: Any, signature: Any, values: Sequence[Any]) -> Any:
            """Emit the call of the function at the address."""
            from llvmlite import ir

            kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType().as_pointer()])
            data = context.make_array(signature.args[1])(context, builder, values[1]).data
            return builder.call(builder.inttoptr(values[0], kind.as_pointer()), [data])

        return float64(int64, given), codegen

else:

    def call1(address: int, a: float) -> float:
        """f(a) of the function at this address."""
        return CFUNCTYPE(c_double, c_double)(int(address))(a)

    def call2(address: int, a: float, b: float) -> float:
        """f(a, b) of the function at this address."""
        return CFUNCTYPE(c_double, c_double, c_double)(int(address))(a, b)

    def call3(address: int, a: float, b: float, c: float) -> float:
        """f(a, b, c) of the function at this address."""
        return CFUNCTYPE(c_double, c_double, c_double, c_double)(int(address))(a, b, c)

    def call_array(address: int, given: Array) -> float:
        """Call the function at this address with the numbers in an array."""
        return CFUNCTYPE(c_double, POINTER(c_double))(int(address))(given.ctypes.data_as(POINTER(c_double)))
