"""Laws compiled for the solver: those of `buckler.mbs.laws.table`, motions of drives, and forces along a measure."""

from __future__ import annotations

import numpy as np

from ..laws import table
from ..laws.table import FrictionKind, LawColumn, call
from .compiling import compile_below, draft
from .tables import ForceKind, Forces, Memory, MotionKind

normal_force, friction = compile_below(table.normal_force), compile_below(table.friction)
bristle_rate, bristle_after = compile_below(table.bristle_rate), compile_below(table.bristle_after)
AFTER = 1e-6
"""Step [s] of the difference for a drive's acceleration just after a time, short compared with any motion."""
BEFORE = -AFTER
"""Step [s] of the difference for a drive's acceleration just before a time."""


@draft
def normal_slopes(tables, law, depth, rate, onset):
    """Derivatives of the normal force by depth and rate, by central differences of the scalar law."""
    hd, hr = 1e-5 * depth, 1e-5 * (abs(rate) + onset)
    by_depth = normal_force(tables, law, depth + hd, rate, onset) - normal_force(tables, law, depth - hd, rate, onset)
    by_rate = normal_force(tables, law, depth, rate + hr, onset) - normal_force(tables, law, depth, rate - hr, onset)
    return by_depth / (2.0 * hd), by_rate / (2.0 * hr)


@draft
def friction_now(tables, law, speed, mem, since):
    """Friction coefficient and bristle: that advanced from the last step, or, if since < 0, the present one (it is a state)."""
    kind = tables.laws[law, LawColumn.KIND]
    if kind != FrictionKind.LUGRE and kind != FrictionKind.BRISTLE_CALLED:
        return friction(tables, law, speed, 0.0), 0.0
    bristle = mem[Memory.BRISTLE]
    if since >= 0.0:
        bristle = bristle_after(tables, law, mem[Memory.BRISTLE], 0.5 * (mem[Memory.SLIDING] + speed), since)
    return friction(tables, law, speed, bristle), bristle


@draft
def friction_slope(tables, law, speed, mem, since):
    """Derivative of the coefficient by the speed, by central differences."""
    h = 1e-6 * max(abs(speed), 1e-4)
    return (friction_now(tables, law, speed + h, mem, since)[0] - friction_now(tables, law, speed - h, mem, since)[0]) / (2.0 * h)


@draft
def motion(tables, k, t):
    """Travel of drive k at time t, and its speed."""
    kind, pace = tables.motions[k, LawColumn.KIND], tables.time_factor[0]
    t = pace * t
    if kind == MotionKind.RAMP:
        start, end, duration = tables.ramps[k, 0], tables.ramps[k, 1], tables.ramps[k, 2]
        r, slope = min(t, duration), (end - start) / duration
        return start * r + 0.5 * slope * r * r + end * (t - r), pace * (start + slope * r)
    if kind == MotionKind.STEADY:
        return 0.0, 0.0
    return call(tables.motions[k, LawColumn.CALL], (t,)), pace * call(tables.motions[k, LawColumn.CALL_TOO], (t,))


@draft
def second_rate(tables, k, t, side):
    """Acceleration of drive k at time t; at a jump the limit from the side AFTER or BEFORE."""
    kind, pace = tables.motions[k, LawColumn.KIND], tables.time_factor[0]
    t = pace * t
    if kind == MotionKind.RAMP:
        start, end, duration = tables.ramps[k, 0], tables.ramps[k, 1], tables.ramps[k, 2]
        return pace * pace * (end - start) / duration if t < duration else 0.0
    if kind == MotionKind.STEADY:
        return 0.0
    speed, h = tables.motions[k, LawColumn.CALL_TOO], side if t + 2.0 * side >= 0.0 else AFTER
    return pace * pace * (4.0 * call(speed, (t + h,)) - 3.0 * call(speed, (t,)) - call(speed, (t + 2.0 * h,))) / (2.0 * h)


@draft
def dry(speed, p):
    """Friction force; p: dynamic, static minus dynamic, viscous coefficient, regularisation and Stribeck speeds."""
    fast = abs(speed) - p[3]
    if fast <= 0.0:
        return (p[0] + p[1]) * speed / p[3]
    return np.sign(speed) * (p[0] + p[1] * np.exp(-fast / p[4]) + p[2] * fast)


@draft
def strut(value, rate, p, address):
    """Tension of a post-buckled strut; p: length, rigidity, unit load, compliance, critical load, damping."""
    stretch = value - p[0]
    if stretch > 0.0:
        return max(0.0, p[1] * stretch + p[5] * rate)
    total = -stretch / p[0]
    if total <= p[3] * p[4]:
        return p[1] * stretch
    bending = max(0.0, total - p[3] * p[4])
    u = max(0.0, total - p[3] * call(address, (bending,)))
    return -p[2] * call(address, (u,))


@draft
def motor(t, speed, p, address):
    """Torque of a DC motor on its link; p: voltage, resistance, constant, gear, friction, dead band, regularisation."""
    voltage = p[0] if address == 0 else call(address, (t,))
    voltage = np.sign(voltage) * max(0.0, abs(voltage) - p[5])
    fast = p[3] * speed
    current = (voltage - p[2] * fast) / p[1]
    return p[3] * (p[2] * current - p[4] * min(max(fast / p[6], -1.0), 1.0))


@draft
def value_along(tables, k, now, value, rate, reaction):
    """Force k along its measure; `reaction` is the normal force of friction."""
    t, mem = tables.time_factor[0] * now.time, now.memory[k]
    kind, number = tables.forces[k, Forces.KIND], tables.forces[k, Forces.NUMBERS]
    p = tables.data[number : number + 8]
    if kind == ForceKind.SPRING:
        return -p[0] * (value - p[2]) - p[1] * rate
    if kind == ForceKind.CONTACT:
        depth = p[0] * (value - p[1])
        if depth <= 0.0:
            return 0.0
        return -p[0] * normal_force(tables, tables.forces[k, Forces.LAW], depth, p[0] * rate, mem[Memory.ONSET])
    if kind == ForceKind.FRICTION_FORCE:
        return -dry(rate, p)
    if kind == ForceKind.FRICTION:
        return -friction_now(tables, tables.forces[k, Forces.FRICTION], rate, mem, now.since)[0] * abs(reaction)
    if kind == ForceKind.STRUT:
        return -strut(value, rate, p, tables.laws[tables.forces[k, Forces.LAW], LawColumn.CALL])
    if kind == ForceKind.PRESCRIBED:
        address = tables.laws[tables.forces[k, Forces.LAW], LawColumn.CALL] if tables.forces[k, Forces.LAW] >= 0 else 0
        return p[0] if address == 0 else call(address, (t,))
    if kind == ForceKind.MOTOR:
        return motor(
            t, rate, p, tables.laws[tables.forces[k, Forces.LAW], LawColumn.CALL] if tables.forces[k, Forces.LAW] >= 0 else 0
        )
    if p[0] == 1.0:  # a spring's law
        return -call(tables.laws[tables.forces[k, Forces.LAW], LawColumn.CALL], (value - p[2], rate))
    return call(tables.laws[tables.forces[k, Forces.LAW], LawColumn.CALL], (t, value - p[2], rate))


@draft
def slopes_along(tables, k, now, value, rate, reaction):
    """Derivatives of the force along a measure by the measure and its rate."""
    mem = now.memory[k]
    kind, number = tables.forces[k, Forces.KIND], tables.forces[k, Forces.NUMBERS]
    p = tables.data[number : number + 8]
    if kind == ForceKind.SPRING:
        return -p[0], -p[1]
    if kind == ForceKind.CONTACT:
        depth = p[0] * (value - p[1])
        if depth <= 0.0:
            return 0.0, 0.0
        by_depth, by_rate = normal_slopes(tables, tables.forces[k, Forces.LAW], depth, p[0] * rate, mem[Memory.ONSET])
        return -by_depth, -by_rate
    if kind == ForceKind.PRESCRIBED:
        return 0.0, 0.0
    if kind == ForceKind.FRICTION:
        return 0.0, -friction_slope(tables, tables.forces[k, Forces.FRICTION], rate, mem, now.since) * abs(reaction)
    by_value, hr = 0.0, 1e-6 * max(abs(rate), p[6] if kind == ForceKind.MOTOR else 1e-3)
    if kind == ForceKind.STRUT or kind == ForceKind.LAW:
        hv = 1e-6 * max(abs(value), 1e-3) if kind == ForceKind.LAW else 1e-4 * max(abs(value - p[0]), 1e-2 * p[3] * p[4] * p[0])
        by_value = (
            value_along(tables, k, now, value + hv, rate, reaction) - value_along(tables, k, now, value - hv, rate, reaction)
        ) / (2.0 * hv)
    by_rate = (
        value_along(tables, k, now, value, rate + hr, reaction) - value_along(tables, k, now, value, rate - hr, reaction)
    ) / (2.0 * hr)
    return by_value, by_rate
