"""Integrals over the times of a record, which need not be equidistant."""

from __future__ import annotations

import numpy as np

from buckler.mbs.geometry import Array

EVEN = 10.0
"""Ratio of neighbouring steps beyond which a time between them is taken for a kink: parabolas do not cross it."""


def trapezoidal(time: Array, rate: Array) -> Array:
    """Integral since the first time by the trapezoidal rule, each (times,): that of motions integrated to the second order.

    Their discrete balance closes by this rule better than by a finer one, as it is the integrator's own.
    """
    return _summed(np.diff(time) * (rate[1:] + rate[:-1]) / 2)


def corrected(time: Array, rate: Array) -> Array:
    """Integral since the first time, each (times,), to the fourth order: the rule of values known to rounding.

    The trapezoidal rule corrected by the slopes at both ends, int f dt = h (f0 + f1)/2 + h^2 (f0' - f1')/12 + O(h^5), which
    are those of parabolas through three neighbours; at a kink that of the parabola on the step's own side.
    """
    steps = np.diff(time)
    areas = steps * (rate[1:] + rate[:-1]) / 2
    if len(steps) > 1:
        secant, before, after = np.diff(rate) / steps, steps[:-1], steps[1:]
        even = (after < EVEN * before) & (before < EVEN * after)
        slope = np.where(even, (after * secant[:-1] + before * secant[1:]) / (before + after), np.nan)
        first, last = np.append(np.nan, slope), np.append(slope, np.nan)
        kinked = np.isnan(first), np.isnan(last)
        fall = np.select([kinked[0] & kinked[1], *kinked], [0.0, 2 * (secant - last), 2 * (first - secant)], first - last)
        areas += fall * steps**2 / 12
    return _summed(areas)


def _summed(areas: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(areas)])
