"""Laws as rows of a table for compiled code: normal forces, friction coefficients and bristles by kind and numbers.

Each function has the equation of the law's class, whose docstring names the source. The numbers p of a law are in the order of
`NORMAL_KINDS` and `FRICTION_KINDS` of `buckler.mbs.laws.contact`; beta is the viscous coefficient [s/m]. That module compiles
the functions for joints in Exudyn, and `buckler.mbs.spectral.lawtable` for the spectral solver.
"""

from collections.abc import Sequence
from ctypes import CFUNCTYPE, POINTER, c_double
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from ..geometry import Array
from ..process import has_compiler
from .pieces import stribeck_level

if has_compiler():
    from llvmlite import ir
    from numba import float64, int64, types
    from numba.core import cgutils
    from numba.extending import intrinsic

    @intrinsic
    def call(_typing: Any, _address: Any, arguments_type: Any) -> Any:
        """Call the machine code at an address with the numbers of an array or a tuple."""

        def codegen(context: Any, builder: Any, signature: Any, values: Sequence[Any]) -> Any:
            """Emit the call of the function at the address, which takes a pointer to doubles."""
            address, arguments = values
            kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType().as_pointer()])
            if isinstance(arguments_type, types.Array):  # its numbers lie in memory
                data = context.make_array(arguments_type)(context, builder, arguments).data
            else:  # the numbers of a tuple are stored on the stack
                data = cgutils.alloca_once(builder, ir.DoubleType(), size=len(arguments_type))
                for i, (type_, value) in enumerate(zip(arguments_type, cgutils.unpack_tuple(builder, arguments), strict=True)):
                    builder.store(context.cast(builder, value, type_, float64), cgutils.gep_inbounds(builder, data, i))
            return builder.call(builder.inttoptr(address, kind.as_pointer()), [data])

        return float64(int64, arguments_type), codegen

else:

    def call(address: int, arguments: Sequence[float]) -> float:
        """Call the machine code at an address with the numbers of an array or a tuple."""
        return CFUNCTYPE(c_double, POINTER(c_double))(int(address))((c_double * len(arguments))(*arguments))


def call_rows(address: int, rows: Array, values: Array) -> None:
    """Call the function at an address with each of the `rows` (n, arguments), and store the results in `values` (n,)."""
    for i in range(len(values)):
        values[i] = call(address, rows[i])


NormalKind = IntEnum("NormalKind", "POWER VOIGT IMPACT CALLED", start=0)
"""Kinds of normal laws: laws of this package, and functions given by their address."""
FrictionKind = IntEnum(
    "FrictionKind", "SMOOTH COULOMB ADAMS AMBROSIO THRELFALL STRIBECK LUGRE COEFFICIENT_CALLED BRISTLE_CALLED", start=0
)
"""Kinds of friction laws: laws of this package, and functions given by their address, without or with a bristle."""
LawColumn = IntEnum("LawColumn", "KIND FIRST_ADDRESS SECOND_ADDRESS", start=0)
"""Columns of integers of a law: kind, address of its function, and of a second one, the bristle after a time at constant speed.

In the compiled solver a row may also stand for a force over time or a drive. A force has the addresses of its two components and
uses no kind. A drive has a `MotionKind` and the addresses of its travel and speed."""
CODES = len(LawColumn)
"""Number of integers (codes) of a law: its kind and two addresses."""
NUMBERS = 8
"""Number of columns of floats of a law; LuGre, the longest, has 7."""


class Laws(NamedTuple):
    """Table of laws: kinds and addresses (laws, `CODES`), and floats (laws, `NUMBERS`)."""

    laws: Array
    law_numbers: Array


def power(x: float, n: float) -> float:
    """Return x^n for x >= 0; faster than `x**n` for n = 1.5 and 1."""
    if n == 1.5:
        return x * np.sqrt(x)
    if n == 1.0:
        return x
    return x**n


def cubic_step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
    """Return the ADAMS function STEP, the cubic of `pieces.step`, for floats."""
    part = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
    return h0 + (h1 - h0) * part * part * (3.0 - 2.0 * part)


def normal_force(tables: Laws, law: int, depth: float, rate: float, onset_speed: float) -> float:
    """Return the force >= 0 [N] of a normal law at a depth > 0 [m], its rate [m/s], and the rate > 0 at contact onset [m/s]."""
    kind, p = tables.laws[law, LawColumn.KIND], tables.law_numbers[law]
    if kind == NormalKind.POWER:  # p: stiffness, exponent, hysteresis factor
        return p[0] * power(depth, p[1]) * max(0.0, 1.0 + p[2] * rate / onset_speed)
    if kind == NormalKind.VOIGT:  # p: stiffness, damping
        return max(0.0, p[0] * depth + p[1] * rate)
    if kind == NormalKind.IMPACT:  # p: stiffness, exponent, damping, damping depth
        return max(0.0, p[0] * power(depth, p[1]) + cubic_step(depth, 0.0, 0.0, p[3], p[2]) * rate)
    return call(tables.laws[law, LawColumn.FIRST_ADDRESS], (depth, rate, onset_speed))


def bristle_rate(tables: Laws, law: int, bristle: float, speed: float) -> float:
    """Return dz/dt of a bristle [m/s]; zero for a law without a bristle."""
    kind, p = tables.laws[law, LawColumn.KIND], tables.law_numbers[law]
    if kind == FrictionKind.LUGRE:  # p: mu_s, mu_d, v_str, delta, s0, ...; s0: bristle stiffness over the normal force [1/m]
        return speed - p[4] * abs(speed) * bristle / stribeck_level(speed, p[0], p[1], p[2], p[3])
    if kind == FrictionKind.BRISTLE_CALLED:
        step = 1e-9  # of a forward difference of the time [s], short compared with any motion
        return (call(tables.laws[law, LawColumn.SECOND_ADDRESS], (bristle, speed, step)) - bristle) / step
    return 0.0


def bristle_after(tables: Laws, law: int, bristle: float, speed: float, time: float) -> float:
    """Return the bristle [m] after a time [s] at constant speed [m/s]."""
    kind, p = tables.laws[law, LawColumn.KIND], tables.law_numbers[law]
    if kind == FrictionKind.LUGRE:  # p as in `bristle_rate`
        steady = stribeck_level(speed, p[0], p[1], p[2], p[3]) / p[4]  # deflection in steady sliding [m]
        return bristle - np.expm1(-abs(speed) * time / steady) * (steady * np.sign(speed) - bristle)
    if kind == FrictionKind.BRISTLE_CALLED:
        return call(tables.laws[law, LawColumn.SECOND_ADDRESS], (bristle, speed, time))
    return 0.0


def friction(tables: Laws, law: int, speed: float, bristle: float) -> float:
    """Return the signed friction coefficient [1] at a speed [m/s] and a bristle [m]."""
    kind, p = tables.laws[law, LawColumn.KIND], tables.law_numbers[law]
    if kind == FrictionKind.SMOOTH:  # no friction
        return 0.0
    if kind == FrictionKind.COULOMB:  # p: mu_d, v_reg, beta
        return p[0] * min(max(speed / p[1], -1.0), 1.0) + p[2] * speed
    if kind == FrictionKind.ADAMS:  # p: mu_s, mu_d, v_s, v_d
        x = min(max(speed / p[2], -1.0), 1.0)
        return 0.5 * x * (3.0 - x * x) * cubic_step(abs(speed), p[2], p[0], p[3], p[1])
    if kind == FrictionKind.AMBROSIO:  # p: mu_d, v0, v1
        return np.sign(speed) * p[0] * min(max((abs(speed) - p[1]) / (p[2] - p[1]), 0.0), 1.0)
    if kind == FrictionKind.THRELFALL:  # p: mu_d, v0
        return -p[0] * np.sign(speed) * np.expm1(-3.0 * abs(speed) / p[1])
    if kind == FrictionKind.STRIBECK:  # p: mu_s, mu_d, v_str, delta, v_reg, beta
        return stribeck_level(speed, p[0], p[1], p[2], p[3]) * min(max(speed / p[4], -1.0), 1.0) + p[5] * speed
    if kind == FrictionKind.LUGRE:  # p: mu_s, mu_d, v_str, delta, s0, s1, beta
        return p[4] * bristle + p[5] * bristle_rate(tables, law, bristle, speed) + p[6] * speed
    if kind == FrictionKind.COEFFICIENT_CALLED:
        return call(tables.laws[law, LawColumn.FIRST_ADDRESS], (speed,))
    return call(tables.laws[law, LawColumn.FIRST_ADDRESS], (speed, bristle))
