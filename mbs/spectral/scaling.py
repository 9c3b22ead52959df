"""Units of inner coordinates of strips and modes, by their largest deformation so far, and of laws' states, compiled."""

from __future__ import annotations

import numpy as np

from .compiling import draft, noinline
from .newton import ROUNDING
from .tables import STATE

SHARE = 100.0
"""The tolerance of inner coordinates of strips and modes is relative to so many times their largest deformation so far."""


@draft
def deformation(state, elastic, k):
    """An inner coordinate, or a vector's part across its chord, whose direction is noted."""
    i, j = elastic[k, 0], elastic[k, 1]
    if j < 0:
        return state.q[i]
    dx, dy = state.q[elastic[k, 5]] - state.q[elastic[k, 3]], state.q[elastic[k, 6]] - state.q[elastic[k, 4]]
    length = max(np.sqrt(dx * dx + dy * dy), 1e-300)
    state.turn[k, 0], state.turn[k, 1] = dx / length, dy / length
    return state.turn[k, 0] * state.q[j] - state.turn[k, 1] * state.q[i]


@noinline
def follow_units(state, elastic, tolerance):
    """Take the largest deformation across the chord so far as the unit of inner coordinates, as far as rounding allows.

    A state's is 1, or its largest value so far.
    """
    least = max(1e-5, 10.0 * ROUNDING / tolerance)
    for k in range(elastic.shape[0]):
        group = elastic[k, 2]
        state.amount[group] = max(state.amount[group], abs(deformation(state, elastic, k) - state.rest[k]))
    for k in range(elastic.shape[0]):
        i, j, group = elastic[k, 0], elastic[k, 1], elastic[k, 2]
        if j == STATE:
            state.weight[i] = min(state.weight[i], 1.0 / max(abs(state.v[i]), 1e-300))
            continue
        unit = min(state.whole[i], max(least * state.whole[i], SHARE * state.amount[group]))
        if j >= 0:
            state.across[k] = unit
        else:
            state.weight[i] = 1.0 / unit
