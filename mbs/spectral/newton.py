"""Newton's method for the nodes of a step, compiled: its matrices, kept while they contract, and when it ends. See `radau`."""

from __future__ import annotations

import numpy as np

from .compiling import aside, copy
from .fronts import factor, solve
from .kernel import (
    add_mass_slope,
    add_multipliers,
    add_reactions,
    add_rows,
    forces,
    mass_matrix,
    mass_times,
    row_times,
    rows_at,
    tangents,
)
from .radau import BACK, NODES, PAIR, REAL, A, T, integrate, size_of, solve_real
from .strips import MIXED, RENEWED, carry_stresses

MOST = 14
"""Newton iterations with one matrix."""
ROUNDING = 1e-12
"""A Newton step below this, of the coordinates' whole units, can grow no smaller."""
LEAST_EASE = 0.1
"""A first Newton step leaves at least this share of itself, however fast the last step's converged."""
SLOW = 0.3
"""Ratio of Newton steps beyond which the next step has a new matrix."""


@aside
def renew(s, e, w, x, t, h, counts):
    """Make the Newton matrices anew, at the middle node."""
    q, v, lam = x.places[1], x.rates[1], x.multipliers[1]
    since = NODES[1] * h
    copy(x.stresses[1], w.stress)
    w.mixed[0] = RENEWED
    forces(s, w, t + since, q, v, lam, x.memory, since, x.force)
    w.mixed[0] = MIXED
    mass_matrix(s, w, q, x.mass)
    tangents(s, w, t + since, q, v, lam, x.memory, since, x.mass, x.damping, x.stiffness)
    rows_at(s, w, t + since, x.gap, x.jacobian, x.speed)
    add_rows(s, x.jacobian, x.mass)
    add_multipliers(s, w, q, lam, x.stiffness)
    if s.modal.shape[0] > 0:
        add_mass_slope(s, w, q, x.seconds[1], x.stiffness)
    counts.jacobians += 1
    if not np.isfinite(x.stiffness.sum() + x.damping.sum() + x.mass.sum()):
        return False
    k1, k2 = h / REAL, h / PAIR
    for i in range(x.mass.size):
        x.matrix[i] = x.mass[i] + k1 * (x.damping[i] + k1 * x.stiffness[i])
        x.twisted[i] = x.mass[i] + k2 * (x.damping[i] + k2 * x.stiffness[i])
    factor(e.newton, x.matrix, x.real, x.real_swaps, x.amount_of_row, False)
    factor(e.newton, x.twisted, x.complex, x.complex_swaps, x.amount_of_row, False)
    x.ease[0] = 1.0
    return True


@aside
def _lacks(s, w, x, t, h):
    """What the equations lack at the three nodes."""
    n, r = x.q.size, x.lam.size
    for i in range(3):
        since, residual, lam = NODES[i] * h, x.residual[i], x.multipliers[i]
        at, q, v = t + NODES[i] * h, x.places[i], x.rates[i]
        copy(x.stresses[i], w.stress)
        forces(s, w, at, q, v, lam, x.memory, since, x.force)
        copy(w.slack, x.slacks[i])
        rows_at(s, w, at, x.gap, x.jacobian, x.speed)
        mass_times(s, q, x.seconds[i], residual[:n])
        for k in range(n):
            residual[k] -= x.force[k]
        add_reactions(s, x.jacobian, lam, residual)
        for k in range(r):
            residual[n + k] = row_times(s, k, x.jacobian, v) - x.speed[k]


@aside
def _correct(s, e, w, x, h):
    """One Newton step from what the equations lack; its size in the coordinates' units, and in whole ones."""
    n, m = x.q.size, x.step.size
    k1, k2 = h / REAL, h / PAIR
    for k in range(m):
        r0, r1, r2 = x.residual[0, k], x.residual[1, k], x.residual[2, k]
        one = BACK[0, 0] * r0 + BACK[0, 1] * r1 + BACK[0, 2] * r2
        two = complex(BACK[1, 0] * r0 + BACK[1, 1] * r1 + BACK[1, 2] * r2, -BACK[2, 0] * r0 - BACK[2, 1] * r1 - BACK[2, 2] * r2)
        x.step[k], x.swirl[k] = (-k1 * one, -k2 * two) if k < n else (-one, -two)
    solve_real(e, x, x.step)
    solve(e.newton, x.complex, x.complex_swaps, x.swirl, x.twin)
    for k in range(m):
        one, two = (x.step[k], x.swirl[k]) if k < n else (x.step[k] / k1, x.swirl[k] / k2)
        for i in range(3):
            change = T[i, 0] * one + T[i, 1] * two.real - T[i, 2] * two.imag
            if k < n:
                x.dv[i, k] = change
                x.rates[i, k] += change
            else:
                x.multipliers[i, k - n] += change
    size, whole = 0.0, 0.0
    for i in range(3):
        for k in range(n):
            x.dq[i, k] = h * (A[i, 0] * x.dv[0, k] + A[i, 1] * x.dv[1, k] + A[i, 2] * x.dv[2, k])
            whole = max(whole, abs(x.dq[i, k]) / x.whole[k])
            if not abs(x.dq[i, k]) < np.inf:
                return np.inf, np.inf  # not a number is larger than nothing
        size = max(size, size_of(x, s.elastic, x.dq[i]))
        carry_stresses(s, w, x.dq[i], x.dv[i], x.stresses[i], x.slacks[i])
    integrate(x, h)
    return size, whole


@aside
def newton(s, e, w, x, t, h, allowed, fresh, counts):
    """Solve for the nodes; the ratio of the last two Newton steps if it converged, else 2.

    Where a kept matrix contracts too slowly, it is made anew from the nodes as they are.
    """
    last, ratio, left = 0.0, 0.0, MOST
    if fresh and not renew(s, e, w, x, t, h, counts):
        return 2.0
    ease = max(x.ease[0], LEAST_EASE)
    while left > 0:
        left -= 1
        _lacks(s, w, x, t, h)
        size, whole = _correct(s, e, w, x, h)
        counts.iterations += 1
        if not np.isfinite(size):
            return 2.0
        if last > 0.0:
            ratio = size / last
            if ratio < 0.99:
                ease = ratio / (1.0 - ratio)
            if whole > ROUNDING and (ratio > 2.0 or (left < MOST - 2 and (ratio >= 0.99 or size * ease * ratio**left > allowed))):
                if fresh or not renew(s, e, w, x, t, h, counts):
                    return 2.0
                fresh, last, left, ease = True, 0.0, MOST, 1.0
                continue
        if whole <= ROUNDING or ease * size <= allowed:
            x.ease[0] = ease
            return min(ratio, 1.0)  # of two steps of rounding
        last = size
    return 2.0
