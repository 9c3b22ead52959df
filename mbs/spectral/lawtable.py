"""The laws of `buckler.mbs.laws.table` compiled for the solver, their slopes, and the motions of drives."""

from __future__ import annotations

from ..laws import table
from ..laws.calls import call
from ..laws.table import BRISTLE_CALLED, LUGRE
from .compiling import compile_below, draft
from .tables import BRISTLE, CALL, CALL_TOO, KIND, RAMP, SLIDING, STEADY

normal_force, friction = compile_below(table.normal_force), compile_below(table.friction)
bristle_rate, bristle_after = compile_below(table.bristle_rate), compile_below(table.bristle_after)
AFTER = 1e-6
"""Step [s] of the difference that gives a drive's acceleration just after a time: short beside any motion."""
BEFORE = -1e-6
"""Step [s] of the difference that gives a drive's acceleration just before a time."""


@draft
def normal_slopes(tables, law, depth, rate, onset):
    """Derivatives of the normal force by depth and rate, by central differences of the scalar law."""
    hd, hr = 1e-5 * depth, 1e-5 * (abs(rate) + onset)
    by_depth = normal_force(tables, law, depth + hd, rate, onset) - normal_force(tables, law, depth - hd, rate, onset)
    by_rate = normal_force(tables, law, depth, rate + hr, onset) - normal_force(tables, law, depth, rate - hr, onset)
    return by_depth / (2.0 * hd), by_rate / (2.0 * hr)


@draft
def rubbing(tables, law, speed, mem, since):
    """Coefficient and bristle now: the bristle bent since the last step, or as it stands where since < 0 (it is a state)."""
    kind = tables.laws[law, KIND]
    if kind != LUGRE and kind != BRISTLE_CALLED:
        return friction(tables, law, speed, 0.0), 0.0
    bristle = mem[BRISTLE]
    if since >= 0.0:
        bristle = bristle_after(tables, law, mem[BRISTLE], 0.5 * (mem[SLIDING] + speed), since)
    return friction(tables, law, speed, bristle), bristle


@draft
def rubbing_slope(tables, law, speed, mem, since):
    """Derivative of the coefficient by the speed, by central differences."""
    h = 1e-6 * max(abs(speed), 1e-4)
    return (rubbing(tables, law, speed + h, mem, since)[0] - rubbing(tables, law, speed - h, mem, since)[0]) / (2.0 * h)


@draft
def motion(tables, k, t):
    """Travel of drive k at time t, and its speed."""
    kind, pace = tables.motions[k, KIND], tables.pace[0]
    t = pace * t
    if kind == RAMP:
        start, end, duration = tables.ramps[k, 0], tables.ramps[k, 1], tables.ramps[k, 2]
        r, slope = min(t, duration), (end - start) / duration
        return start * r + 0.5 * slope * r * r + end * (t - r), pace * (start + slope * r)
    if kind == STEADY:
        return 0.0, 0.0
    return call(tables.motions[k, CALL], (t,)), pace * call(tables.motions[k, CALL_TOO], (t,))


@draft
def second_rate(tables, k, t, side):
    """Acceleration of drive k at time t; where it jumps, that of the side AFTER or BEFORE."""
    kind, pace = tables.motions[k, KIND], tables.pace[0]
    t = pace * t
    if kind == RAMP:
        start, end, duration = tables.ramps[k, 0], tables.ramps[k, 1], tables.ramps[k, 2]
        return pace * pace * (end - start) / duration if t < duration else 0.0
    if kind == STEADY:
        return 0.0
    speed, h = tables.motions[k, CALL_TOO], side if t + 2.0 * side >= 0.0 else AFTER
    return pace * pace * (4.0 * call(speed, (t + h,)) - 3.0 * call(speed, (t,)) - call(speed, (t + 2.0 * h,))) / (2.0 * h)
