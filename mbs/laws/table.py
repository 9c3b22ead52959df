"""Laws as rows of a table for compiled code: normal forces, friction coefficients and bristles by kind and numbers.

Each function is the equation of the law's class, which has the source. They are plain functions of floats, compiled by
`buckler.mbs.laws.contact` for Exudyn's joints and by `buckler.mbs.spectral.lawtable` for the compiled solver.
"""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import CFUNCTYPE, POINTER, c_double
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from ..geometry import Array
from ..process import has_compiler

if has_compiler():
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


def call_rows(address: int, rows: Array, values: Array) -> None:
    """Call the function at an address with each row."""
    for i in range(len(values)):
        values[i] = call(address, rows[i])


NormalKind = IntEnum("NormalKind", "POWER VOIGT IMPACT CALLED", start=0)
"""Kinds of normal laws: those of this package, or a function by address."""
FrictionKind = IntEnum(
    "FrictionKind", "SMOOTH COULOMB ADAMS AMBROSIO THRELFALL STRIBECK LUGRE COEFFICIENT_CALLED BRISTLE_CALLED", start=0
)
"""Kinds of friction laws: those of this package, or functions by address of a coefficient, or of a bristle too."""
LawColumn = IntEnum("LawColumn", "KIND CALL CALL_TOO", start=0)
"""Columns of whole numbers of a law or of a drive's motion: kind, addresses of functions."""
CODES = 4
"""Columns of whole numbers of a law."""
NUMBERS = 8
"""Columns of numbers of a law."""


class Laws(NamedTuple):
    """A table of laws: whole numbers (laws, `CODES`) and numbers (laws, `NUMBERS`)."""

    laws: Array
    law_numbers: Array


def power(x: float, n: float) -> float:
    """Return x^n for x >= 0, fast for the usual exponents."""
    if n == 1.5:
        return x * np.sqrt(x)
    if n == 1.0:
        return x
    return x**n


def cubic_step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
    """Evaluate the ADAMS function STEP."""
    part = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
    return h0 + (h1 - h0) * part * part * (3.0 - 2.0 * part)


def normal_force(s: Laws, law: int, depth: float, rate: float, onset: float) -> float:
    """Return the force >= 0 of a normal law at a depth > 0, its rate and its onset speed."""
    kind, p = s.laws[law, LawColumn.KIND], s.law_numbers[law]
    if kind == NormalKind.POWER:
        return p[0] * power(depth, p[1]) * max(0.0, 1.0 + p[2] * rate / onset)
    if kind == NormalKind.VOIGT:
        return max(0.0, p[0] * depth + p[1] * rate)
    if kind == NormalKind.IMPACT:
        return max(0.0, p[0] * power(depth, p[1]) + cubic_step(depth, 0.0, 0.0, p[3], p[2]) * rate)
    return call(s.laws[law, LawColumn.CALL], (depth, rate, onset))


def stribeck(speed: float, p: Array) -> float:
    """mu_d + (mu_s - mu_d) exp(-|v/v_str|^delta); p: static, dynamic, v_stribeck, exponent."""
    return p[1] + (p[0] - p[1]) * np.exp(-((abs(speed) / p[2]) ** p[3]))


def bristle_rate(s: Laws, law: int, bristle: float, speed: float) -> float:
    """Return dz/dt of a bristle; zero for a law without a bristle."""
    kind, p = s.laws[law, LawColumn.KIND], s.law_numbers[law]
    if kind == FrictionKind.LUGRE:
        return speed - p[4] * abs(speed) * bristle / stribeck(speed, p)
    if kind == FrictionKind.BRISTLE_CALLED:
        short = 1e-9
        return (call(s.laws[law, LawColumn.CALL_TOO], (bristle, speed, short)) - bristle) / short
    return 0.0


def bristle_after(s: Laws, law: int, bristle: float, speed: float, time: float) -> float:
    """Return the bristle after a time at constant speed."""
    kind, p = s.laws[law, LawColumn.KIND], s.law_numbers[law]
    if kind == FrictionKind.LUGRE:
        level = stribeck(speed, p) / p[4]
        return bristle - np.expm1(-abs(speed) * time / level) * (level * np.sign(speed) - bristle)
    if kind == FrictionKind.BRISTLE_CALLED:
        return call(s.laws[law, LawColumn.CALL_TOO], (bristle, speed, time))
    return 0.0


def friction(s: Laws, law: int, speed: float, bristle: float) -> float:
    """Return the signed friction coefficient."""
    kind, p = s.laws[law, LawColumn.KIND], s.law_numbers[law]
    if kind == FrictionKind.SMOOTH:
        return 0.0
    if kind == FrictionKind.COULOMB:
        return p[0] * min(max(speed / p[1], -1.0), 1.0) + p[2] * speed
    if kind == FrictionKind.ADAMS:
        x = min(max(speed / p[2], -1.0), 1.0)
        return 0.5 * x * (3.0 - x * x) * cubic_step(abs(speed), p[2], p[0], p[3], p[1])
    if kind == FrictionKind.AMBROSIO:
        return np.sign(speed) * p[0] * min(max((abs(speed) - p[1]) / (p[2] - p[1]), 0.0), 1.0)
    if kind == FrictionKind.THRELFALL:
        return -p[0] * np.sign(speed) * np.expm1(-3.0 * abs(speed) / p[1])
    if kind == FrictionKind.STRIBECK:
        return stribeck(speed, p) * min(max(speed / p[4], -1.0), 1.0) + p[5] * speed
    if kind == FrictionKind.LUGRE:
        rate = speed - p[4] * abs(speed) * bristle / stribeck(speed, p)
        return p[4] * bristle + s.law_numbers[law, 5] * rate + s.law_numbers[law, 6] * speed
    if kind == FrictionKind.COEFFICIENT_CALLED:
        return call(s.laws[law, LawColumn.CALL], (speed,))
    return call(s.laws[law, LawColumn.CALL], (speed, bristle))
