"""Units of inner coordinates of strips and modes, by their largest deformation so far, and of laws' states, compiled."""

from __future__ import annotations

import numpy as np

from .compiling import aside, inner
from .newton import ROUNDING
from .tables import STATE

SHARE = 100.0
"""The tolerance of inner coordinates of strips and modes is relative to so many times their largest deformation so far."""


@inner
def deformed(x, elastic, k):
    """An inner coordinate, or a vector's part across its chord, whose direction is noted."""
    i, j = elastic[k, 0], elastic[k, 1]
    if j < 0:
        return x.q[i]
    dx, dy = x.q[elastic[k, 5]] - x.q[elastic[k, 3]], x.q[elastic[k, 6]] - x.q[elastic[k, 4]]
    length = max(np.sqrt(dx * dx + dy * dy), 1e-300)
    x.turn[k, 0], x.turn[k, 1] = dx / length, dy / length
    return x.turn[k, 0] * x.q[j] - x.turn[k, 1] * x.q[i]


@aside
def follow_units(x, elastic, tolerance):
    """Take the largest deformation across the chord so far as the unit of inner coordinates, as far as rounding allows.

    A state's is 1, or its largest value so far.
    """
    least = max(1e-5, 10.0 * ROUNDING / tolerance)
    for k in range(elastic.shape[0]):
        group = elastic[k, 2]
        x.amount[group] = max(x.amount[group], abs(deformed(x, elastic, k) - x.rest[k]))
    for k in range(elastic.shape[0]):
        i, j, group = elastic[k, 0], elastic[k, 1], elastic[k, 2]
        if j == STATE:
            x.weight[i] = min(x.weight[i], 1.0 / max(abs(x.v[i]), 1e-300))
            continue
        unit = min(x.whole[i], max(least * x.whole[i], SHARE * x.amount[group]))
        if j >= 0:
            x.across[k] = unit
        else:
            x.weight[i] = 1.0 / unit
