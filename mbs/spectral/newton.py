"""Newton's method for the nodes of a step, compiled, with matrices that are kept while it converges. See `radau`."""

from __future__ import annotations

import numpy as np

from .compiling import copy, draft
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
from .radau import BACK, NODES, PAIR, REAL, ROUNDING, A, T, integrate, size_of, solve_real
from .strips import MIXED, RENEWED, carry_stresses
from .tables import Instant

MOST = 14
"""Newton iterations with one matrix."""
LEAST_REMAINDER = 0.1
"""Least error assumed after a first Newton step, over that step, however fast the last time step converged."""
SLOW = 0.3
"""Ratio of successive Newton steps beyond which the next time step has a new matrix."""


@draft
def renew(tables, orders, work, state, t, h, counts):
    """Compute and factor the real and the complex Newton matrix at the middle node; return False if they are not finite."""
    q, lam = state.node_q[1], state.node_lam[1]
    since = NODES[1] * h
    copy(state.node_stress[1], work.stress)
    work.strip_form[0] = RENEWED  # strips in the mixed form keep their B0 of here
    now = Instant(t + since, since, q, state.node_v[1], lam, state.memory)
    forces(tables, work, now, state.force)
    work.strip_form[0] = MIXED
    mass_matrix(tables, work, q, state.mass)
    tangents(tables, work, now, state.mass, state.damping, state.stiffness)
    rows_at(tables, work, t + since, state.gap, state.jacobian, state.speed)
    add_rows(tables, state.jacobian, state.mass)
    add_multipliers(tables, work, q, lam, state.stiffness)
    if tables.modal.shape[0] > 0:
        add_mass_slope(tables, work, q, state.node_a[1], state.stiffness)
    counts.jacobians += 1
    if not np.isfinite(state.stiffness.sum() + state.damping.sum() + state.mass.sum()):
        return False
    k1, k2 = h / REAL, h / PAIR
    for i in range(state.mass.size):
        state.matrix[i] = state.mass[i] + k1 * (state.damping[i] + k1 * state.stiffness[i])
        state.complex_matrix[i] = state.mass[i] + k2 * (state.damping[i] + k2 * state.stiffness[i])
    factor(orders.newton, state.matrix, state.real, state.real_swaps, state.amount_of_row)
    factor(orders.newton, state.complex_matrix, state.complex, state.complex_swaps, state.amount_of_row)
    state.remainder[0] = 1.0
    return True


@draft
def _residuals(tables, work, state, t, h):
    """Compute the residual of the equations at the three nodes; slacks are those of stresses that are unknowns."""
    n, r = state.q.size, state.lam.size
    for i in range(3):
        since, residual, lam = NODES[i] * h, state.residual[i], state.node_lam[i]
        at, q, v = t + NODES[i] * h, state.node_q[i], state.node_v[i]
        copy(state.node_stress[i], work.stress)
        forces(tables, work, Instant(at, since, q, v, lam, state.memory), state.force)
        copy(work.slack, state.node_slack[i])
        rows_at(tables, work, at, state.gap, state.jacobian, state.speed)
        mass_times(tables, q, state.node_a[i], residual[:n])
        for k in range(n):
            residual[k] -= state.force[k]
        add_reactions(tables, state.jacobian, lam, residual)
        for k in range(r):
            residual[n + k] = row_times(tables, k, state.jacobian, v) - state.speed[k]


@draft
def _correct(tables, orders, work, state, h):
    """Take a Newton step, by way of k times the multipliers; return its size in the error control's units, and in full sizes."""
    n, m, size, whole = state.q.size, state.step.size, 0.0, 0.0
    k1, k2 = h / REAL, h / PAIR
    for k in range(m):
        r0, r1, r2 = state.residual[0, k], state.residual[1, k], state.residual[2, k]
        one = BACK[0, 0] * r0 + BACK[0, 1] * r1 + BACK[0, 2] * r2
        two = complex(BACK[1, 0] * r0 + BACK[1, 1] * r1 + BACK[1, 2] * r2, -BACK[2, 0] * r0 - BACK[2, 1] * r1 - BACK[2, 2] * r2)
        state.step[k], state.complex_step[k] = (-k1 * one, -k2 * two) if k < n else (-one, -two)
    solve_real(orders, state, state.step)
    solve(orders.newton, state.complex, state.complex_swaps, state.complex_step, state.complex_part)
    for k in range(m):
        one, two = (state.step[k], state.complex_step[k]) if k < n else (state.step[k] / k1, state.complex_step[k] / k2)
        for i in range(3):
            change = T[i, 0] * one + T[i, 1] * two.real - T[i, 2] * two.imag
            if k < n:
                state.dv[i, k] = change
                state.node_v[i, k] += change
            else:
                state.node_lam[i, k - n] += change
    for i in range(3):
        for k in range(n):
            state.dq[i, k] = h * (A[i, 0] * state.dv[0, k] + A[i, 1] * state.dv[1, k] + A[i, 2] * state.dv[2, k])
            whole = max(whole, abs(state.dq[i, k]) / state.full_unit[k])
            if not abs(state.dq[i, k]) < np.inf:
                return np.inf, np.inf  # nan fails all comparisons
        size = max(size, size_of(state, tables.elastic, state.dq[i]))
        carry_stresses(tables, work, state.dq[i], state.dv[i], state.node_stress[i], state.node_slack[i])
    integrate(state, h)
    return size, whole


@draft
def newton(model, t, h, allowed, fresh, counts):
    """Solve for the nodes to an `allowed` error; return the ratio of the last two Newton steps if it converged, else 2.

    With `fresh` the matrix is new. A kept one that would not converge in the iterations left is renewed at the present nodes.
    """
    tables, orders, work, state = model.tables, model.orders, model.work, model.state
    last, ratio, left = 0.0, 0.0, MOST
    if fresh and not renew(tables, orders, work, state, t, h, counts):
        return 2.0
    remainder = max(state.remainder[0], LEAST_REMAINDER)
    while left > 0:
        left -= 1
        _residuals(tables, work, state, t, h)
        size, whole = _correct(tables, orders, work, state, h)
        counts.iterations += 1
        if not np.isfinite(size):
            return 2.0
        if last > 0.0:
            ratio = size / last
            if ratio < 0.99:
                remainder = ratio / (1.0 - ratio)
            is_slow = left < MOST - 2 and (ratio >= 0.99 or size * remainder * ratio**left > allowed)
            if whole > ROUNDING and (ratio > 2.0 or is_slow):
                if fresh or not renew(tables, orders, work, state, t, h, counts):
                    return 2.0
                fresh, last, left, remainder = True, 0.0, MOST, 1.0
                continue
        if whole <= ROUNDING or remainder * size <= allowed:
            state.remainder[0] = remainder
            return min(ratio, 1.0)  # above 1 between two steps of the size of rounding
        last = size
    return 2.0
