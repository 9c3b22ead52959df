"""Call of a C function of a pointer to doubles by its address, from compiled code or, without a compiler, from Python."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import CFUNCTYPE, POINTER, c_double
from typing import Any

from ..process import compiler

if compiler():
    from llvmlite import ir
    from numba import float64, int64, types
    from numba.core import cgutils
    from numba.extending import intrinsic

    @intrinsic
    def call(_typing: Any, address: Any, given: Any) -> Any:
        """Call the function at this address with the numbers of an array or a tuple."""

        def codegen(context: Any, builder: Any, signature: Any, values: Sequence[Any]) -> Any:
            """Emit the call of the function at the address."""
            kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType().as_pointer()])
            if isinstance(given, types.Array):
                data = context.make_array(given)(context, builder, values[1]).data
            else:
                data = cgutils.alloca_once(builder, ir.DoubleType(), size=len(given))
                for i, (each, found) in enumerate(zip(given, cgutils.unpack_tuple(builder, values[1]), strict=True)):
                    builder.store(context.cast(builder, found, each, float64), cgutils.gep_inbounds(builder, data, i))
            return builder.call(builder.inttoptr(values[0], kind.as_pointer()), [data])

        return float64(int64, given), codegen

else:

    def call(address: int, given: Sequence[float]) -> float:
        """Call the function at this address with the numbers of an array or a tuple."""
        return CFUNCTYPE(c_double, POINTER(c_double))(int(address))((c_double * len(given))(*given))
