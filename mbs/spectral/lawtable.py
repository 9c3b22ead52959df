"""The laws of `buckler.mbs.laws` as rows of a table, compiled once: normal forces, friction coefficients, bristles, drives.

Each function is the equation of the law's class, which has its source. `mbs/spectral/laws.py` writes the rows.
"""

from __future__ import annotations

import numpy as np

from .compiling import aside, call1, call2, call3, inner
from .tables import (
    ADAMS,
    AMBROSIO,
    BRISTLE,
    BRISTLE_CALLED,
    CALL,
    CALL_TOO,
    COEFFICIENT_CALLED,
    COULOMB,
    IMPACT,
    KIND,
    LUGRE,
    POWER,
    RAMP,
    SLIDING,
    SMOOTH,
    STEADY,
    STRIBECK,
    THRELFALL,
    VOIGT,
)  # fmt: skip

AFTER, BEFORE = 1e-6, -1e-6
"""Step, s, of the difference that gives a drive's acceleration just after a time or just before it: short beside any motion."""


@inner
def power(x, n):
    """x^n for x >= 0, quick for the usual exponents."""
    if n == 1.5:
        return x * np.sqrt(x)
    if n == 1.0:
        return x
    return x**n


@inner
def cubic_step(x, x0, h0, x1, h1):
    """The ADAMS function STEP."""
    part = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
    return h0 + (h1 - h0) * part * part * (3.0 - 2.0 * part)


@inner
def normal_force(s, law, depth, rate, onset):
    """Force >= 0 of a normal law at a depth > 0, its rate and its onset speed."""
    kind, p = s.laws[law, KIND], s.law_numbers[law]
    if kind == POWER:
        return p[0] * power(depth, p[1]) * max(0.0, 1.0 + p[2] * rate / onset)
    if kind == VOIGT:
        return max(0.0, p[0] * depth + p[1] * rate)
    if kind == IMPACT:
        return max(0.0, p[0] * power(depth, p[1]) + cubic_step(depth, 0.0, 0.0, p[3], p[2]) * rate)
    return call3(s.laws[law, CALL], depth, rate, onset)


@aside
def normal_slopes(s, law, depth, rate, onset):
    """Derivatives of the normal force by depth and rate, by central differences of the scalar law."""
    hd, hr = 1e-5 * depth, 1e-5 * (abs(rate) + onset)
    by_depth = normal_force(s, law, depth + hd, rate, onset) - normal_force(s, law, depth - hd, rate, onset)
    by_rate = normal_force(s, law, depth, rate + hr, onset) - normal_force(s, law, depth, rate - hr, onset)
    return by_depth / (2.0 * hd), by_rate / (2.0 * hr)


@inner
def _level(speed, p):
    """mu_d + (mu_s - mu_d) exp(-|v/v_str|^delta); p: static, dynamic, v_stribeck, exponent."""
    return p[1] + (p[0] - p[1]) * np.exp(-((abs(speed) / p[2]) ** p[3]))


@inner
def bristle_rate(s, law, bristle, speed):
    """dz/dt of a bristle; zero for a law without."""
    kind, p = s.laws[law, KIND], s.law_numbers[law]
    if kind == LUGRE:
        return speed - p[4] * abs(speed) * bristle / _level(speed, p)
    if kind == BRISTLE_CALLED:
        short = 1e-9
        return (call3(s.laws[law, CALL_TOO], bristle, speed, short) - bristle) / short
    return 0.0


@inner
def bristle_after(s, law, bristle, speed, time):
    """Bristle after a time at constant speed."""
    kind, p = s.laws[law, KIND], s.law_numbers[law]
    if kind == LUGRE:
        level = _level(speed, p) / p[4]
        return bristle - np.expm1(-abs(speed) * time / level) * (level * np.sign(speed) - bristle)
    if kind == BRISTLE_CALLED:
        return call3(s.laws[law, CALL_TOO], bristle, speed, time)
    return 0.0


@inner
def friction(s, law, speed, bristle):
    """Signed friction coefficient."""
    kind, p = s.laws[law, KIND], s.law_numbers[law]
    if kind == SMOOTH:
        return 0.0
    if kind == COULOMB:
        return p[0] * min(max(speed / p[1], -1.0), 1.0) + p[2] * speed
    if kind == ADAMS:
        x = min(max(speed / p[2], -1.0), 1.0)
        return 0.5 * x * (3.0 - x * x) * cubic_step(abs(speed), p[2], p[0], p[3], p[1])
    if kind == AMBROSIO:
        return np.sign(speed) * p[0] * min(max((abs(speed) - p[1]) / (p[2] - p[1]), 0.0), 1.0)
    if kind == THRELFALL:
        return -p[0] * np.sign(speed) * np.expm1(-3.0 * abs(speed) / p[1])
    if kind == STRIBECK:
        return _level(speed, p) * min(max(speed / p[4], -1.0), 1.0) + p[5] * speed
    if kind == LUGRE:
        rate = speed - p[4] * abs(speed) * bristle / _level(speed, p)
        return p[4] * bristle + s.law_numbers[law, 5] * rate + s.law_numbers[law, 6] * speed
    if kind == COEFFICIENT_CALLED:
        return call1(s.laws[law, CALL], speed)
    return call2(s.laws[law, CALL], speed, bristle)


@inner
def rubbing(s, law, speed, mem, since):
    """Coefficient and bristle now: the bristle bent since the last step, or as it stands where since < 0 (it is a state)."""
    kind = s.laws[law, KIND]
    if kind != LUGRE and kind != BRISTLE_CALLED:
        return friction(s, law, speed, 0.0), 0.0
    bristle = mem[BRISTLE]
    if since >= 0.0:
        bristle = bristle_after(s, law, mem[BRISTLE], 0.5 * (mem[SLIDING] + speed), since)
    return friction(s, law, speed, bristle), bristle


@aside
def rubbing_slope(s, law, speed, mem, since):
    """Derivative of the coefficient by the speed, by central differences."""
    h = 1e-6 * max(abs(speed), 1e-4)
    return (rubbing(s, law, speed + h, mem, since)[0] - rubbing(s, law, speed - h, mem, since)[0]) / (2.0 * h)


@inner
def motion(s, k, t):
    """Travel of drive k at time t, and its speed."""
    kind, pace = s.motions[k, KIND], s.pace[0]
    t = pace * t
    if kind == RAMP:
        start, end, duration = s.ramps[k, 0], s.ramps[k, 1], s.ramps[k, 2]
        r, slope = min(t, duration), (end - start) / duration
        return start * r + 0.5 * slope * r * r + end * (t - r), pace * (start + slope * r)
    if kind == STEADY:
        return 0.0, 0.0
    return call1(s.motions[k, CALL], t), pace * call1(s.motions[k, CALL_TOO], t)


@inner
def second_rate(s, k, t, side):
    """Acceleration of drive k at time t; where it jumps, that of the side AFTER or BEFORE."""
    kind, pace = s.motions[k, KIND], s.pace[0]
    t = pace * t
    if kind == RAMP:
        start, end, duration = s.ramps[k, 0], s.ramps[k, 1], s.ramps[k, 2]
        return pace * pace * (end - start) / duration if t < duration else 0.0
    if kind == STEADY:
        return 0.0
    speed, h = s.motions[k, CALL_TOO], side if t + 2.0 * side >= 0.0 else AFTER
    return pace * pace * (4.0 * call1(speed, t + h) - 3.0 * call1(speed, t) - call1(speed, t + 2.0 * h)) / (2.0 * h)
