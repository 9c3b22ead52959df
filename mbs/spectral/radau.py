"""One step of the collocation at three Radau points, compiled: first guess, error, projection; `newton` solves the equations.

Unknowns are rates and multipliers at the nodes; constraints hold at the level of velocities (index 2). The eigenvectors of A^-1
decouple Newton's equations into a real and a complex problem. Equations and sources: docs/theory-spectral.md, (3) to (5).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .compiling import draft
from .fronts import factor, solve
from .kernel import add_reactions, changes_at, forces, mass_times, renew_mass, row_times, rows_at
from .lawtable import BEFORE
from .markers import place_markers
from .tables import STATE, Instant


def _coefficients() -> tuple[Any, ...]:
    """Nodes, A, A^-1, its real and complex eigenvalue, T and T^-1 that diagonalise it, weights of the error."""
    root = np.sqrt(6.0)
    nodes = np.array([(4 - root) / 10, (4 + root) / 10, 1.0])
    powers = np.vander(nodes, increasing=True)
    a = powers * nodes[:, None] / np.arange(1, 4) @ np.linalg.inv(powers)
    values, vectors = np.linalg.eig(np.linalg.inv(a))
    real, pair = np.argmin(np.abs(values.imag)), np.argmax(values.imag)
    t = np.column_stack([vectors[:, real].real, vectors[:, pair].real, vectors[:, pair].imag])
    weights = np.array([-(13 + 7 * root) / 3, (7 * root - 13) / 3, -1 / 3])
    return nodes, a, np.linalg.inv(a), float(values[real].real), complex(values[pair]), t, np.linalg.inv(t), weights


NODES, A, INVERSE, REAL, PAIR, T, BACK, ERROR = _coefficients()
PAST = np.array([0.0, NODES[0], NODES[1], 1.0])
"""Places at which the last step's rates are known, over the step."""
ROUNDING = 1e-14
"""A Newton step below this, of the coordinates' whole units, can grow no smaller. What is left adds up: at a hundred times more
no tolerance below 1e-8 makes a double pendulum of 10 s better."""
LEAST_ERROR = 1e-11
"""Least error of an inner coordinate, over its whole unit, that is asked for: less lets a strip that is hardly bent take more
steps than what one sees of it needs."""
SHARE = 100.0
"""The tolerance of inner coordinates of strips and modes is relative to so many times their largest deformation so far."""
MOST_EXTRAPOLATION = 100.0
"""Lengths of the last step over which they are extrapolated: rounding grows by the cube."""


@draft
def size_of(state, elastic, u):
    """Largest component of a change u of the coordinates, in their units."""
    worst = 0.0
    for i in range(u.size):
        worst = max(worst, abs(u[i]) * state.inverse_unit[i])
    for k in range(elastic.shape[0]):
        i, j = elastic[k, 0], elastic[k, 1]
        if j >= 0:
            c, sn = state.chord[k, 0], state.chord[k, 1]
            worst = max(worst, abs(c * u[i] + sn * u[j]) / state.full_unit[i], abs(c * u[j] - sn * u[i]) / state.across_unit[k])
    return worst


@draft
def lagrange(at, j):
    """Lagrange's polynomial j of the places where a step's rates are known, at a fraction of the step."""
    factor = 1.0
    for m in range(4):
        if m != j:
            factor *= (at - PAST[m]) / (PAST[j] - PAST[m])
    return factor


@draft
def predict(state, h, before):
    """First guess at the nodes: rates by the last step's polynomial, multipliers and stresses by the line through its last two
    nodes. After a jump or a tiny step rates are guessed by the present acceleration, the others as they are.
    """
    n, known = state.q.size, h < MOST_EXTRAPOLATION * before
    for i in range(3):
        rates, stress, slope = state.node_v[i], state.node_stress[i], 0.0
        if known:
            slope = NODES[i] * h / (before * (1.0 - NODES[1]))
        for k in range(state.lam.size):
            state.node_lam[i, k] = state.lam[k] + slope * (state.lam[k] - state.past_lam[k])
        for p in range(state.stress.size):
            stress.flat[p] = state.stress.flat[p] + slope * (state.stress.flat[p] - state.past_stress.flat[p])
        if not known:
            for k in range(n):
                rates[k] = state.v[k] + NODES[i] * h * state.a[k]
            continue
        at = 1.0 + NODES[i] * h / before
        for k in range(n):
            rates[k] = state.v[k] - state.past_v[3, k]
        for j in range(4):
            factor, past = lagrange(at, j), state.past_v[j]
            for k in range(n):
                rates[k] += factor * past[k]


@draft
def integrate(state, h):
    """Compute coordinates and accelerations at the nodes from the rates there."""
    for i in range(3):
        for k in range(state.q.size):
            r0, r1, r2, v = state.node_v[0, k], state.node_v[1, k], state.node_v[2, k], state.v[k]
            state.node_q[i, k] = state.q[k] + h * (A[i, 0] * r0 + A[i, 1] * r1 + A[i, 2] * r2)
            state.node_a[i, k] = (INVERSE[i, 0] * (r0 - v) + INVERSE[i, 1] * (r1 - v) + INVERSE[i, 2] * (r2 - v)) / h


@draft
def renew_heavy(tables, orders, work, state, q, jacobian):
    """Factor [M G^T; G 0] with these rows."""
    renew_mass(tables, work, q, jacobian, state.saddle)
    factor(orders.mass, state.saddle, state.saddle_factors, state.saddle_swaps, state.amount_of_row)


@draft
def solve_real(orders, state, right):
    """Solve with the real Newton matrix, in place."""
    solve(orders.newton, state.real, state.real_swaps, right, state.part)


@draft
def _embedded_slope(nodes, start, k):
    """Contribution of the nodes to component k of the embedded formula, times the length of the step."""
    return ERROR[0] * (nodes[0, k] - start[k]) + ERROR[1] * (nodes[1, k] - start[k]) + ERROR[2] * (nodes[2, k] - start[k])


@draft
def error_of(tables, orders, state, h):
    """Compute the local error of the coordinates in state.step; return its size in their units."""
    n, r, k1 = state.q.size, state.lam.size, h / REAL
    moved, pushed = state.dq[0], state.dv[0]
    for k in range(n):
        moved[k] = state.v[k] + _embedded_slope(state.node_q, state.q, k) / h
        pushed[k] = state.a[k] + moved[k] / k1 + _embedded_slope(state.node_v, state.v, k) / h
    mass_times(tables, state.q, pushed, state.step[:n])
    for k in range(tables.row.size):
        if tables.row[k] < n and tables.col[k] < n:
            state.step[tables.row[k]] += state.damping[k] * moved[tables.col[k]]
    for i in range(n):
        state.step[i] *= k1 * k1
    for k in range(r):
        state.step[n + k] = k1 * row_times(tables, k, state.start_jacobian, moved)
    solve_real(orders, state, state.step)
    return size_of(state, tables.elastic, state.step[:n])


@draft
def put_back(tables, orders, work, state, t, h):
    """Project the step's end onto the constraints: coordinates by the Newton matrix, rates and accelerations in the mass metric.

    Multipliers of rigid links are corrected so that the equations of motion hold along the constraints, and those at the other
    nodes likewise; see docs/theory-spectral.md, (5).
    """
    n, r, q, v, a, lam = state.q.size, state.lam.size, state.node_q[2], state.node_v[2], state.node_a[2], state.node_lam[2]
    if r == 0:
        place_markers(tables, work, q, v)
        return
    lacking, rigid = state.residual[2], state.stress.size == 0
    if rigid:
        forces(tables, work, Instant(t, h, q, v, lam, state.memory), state.force)
        mass_times(tables, q, a, lacking[:n])
        for i in range(n):
            lacking[i] -= state.force[i]
    for attempt in range(4):
        place_markers(tables, work, q, v)
        rows_at(tables, work, t, state.gap, state.jacobian, state.speed)
        worst = 0.0
        for k in range(r):
            worst = max(worst, abs(state.gap[k]))
        if attempt == 3 or worst <= 1e-13:
            break
        _fill(state.right, n, state.gap)
        solve_real(orders, state, state.right)
        for i in range(n):
            q[i] -= state.right[i]
    changes_at(tables, work, t, BEFORE, state.change)
    for k in range(r):
        state.speed[k] = row_times(tables, k, state.jacobian, v) - state.speed[k]
        state.change[k] = row_times(tables, k, state.jacobian, a) - state.change[k]
    renew_heavy(tables, orders, work, state, q, state.jacobian)
    _project(orders, state, state.speed, v)
    _project(orders, state, state.change, a)
    if rigid:
        add_reactions(tables, state.jacobian, lam, lacking)
    for k in range(r):
        lam[k] -= state.right[n + k]
    if rigid:
        lacking[n:] = 0.0
        solve(orders.mass, state.saddle_factors, state.saddle_swaps, lacking, state.part)
        for k in range(r):
            for i in range(3):
                state.node_lam[i, k] -= NODES[i] * lacking[n + k]


@draft
def _project(orders, state, rows, y):
    """Subtract from y the change with the given products with the constraints' rows and least kinetic energy."""
    _fill(state.right, y.size, rows)
    solve(orders.mass, state.saddle_factors, state.saddle_swaps, state.right, state.part)
    for i in range(y.size):
        y[i] -= state.right[i]


@draft
def _fill(right, n, rows):
    """Fill a right side with zero for coordinates, and `rows` for multipliers."""
    right[:] = 0.0
    for k in range(rows.size):
        right[n + k] = rows[k]


@draft
def deformation(state, elastic, k):
    """Return an inner coordinate, or the component of a pair across its chord, whose direction is stored."""
    i, j = elastic[k, 0], elastic[k, 1]
    if j < 0:
        return state.q[i]
    dx, dy = state.q[elastic[k, 5]] - state.q[elastic[k, 3]], state.q[elastic[k, 6]] - state.q[elastic[k, 4]]
    length = max(np.sqrt(dx * dx + dy * dy), 1e-300)
    state.chord[k, 0], state.chord[k, 1] = dx / length, dy / length
    return state.chord[k, 0] * state.q[j] - state.chord[k, 1] * state.q[i]


@draft
def follow_units(state, elastic, tolerance):
    """Update the units of inner coordinates: the largest deformation so far, bounded below by rounding.

    The unit of a state is 1, or its largest value so far.
    """
    least = max(1e-5, LEAST_ERROR / tolerance)
    for k in range(elastic.shape[0]):
        group = elastic[k, 2]
        state.largest_deformation[group] = max(
            state.largest_deformation[group], abs(deformation(state, elastic, k) - state.start_deformation[k])
        )
    for k in range(elastic.shape[0]):
        i, j, group = elastic[k, 0], elastic[k, 1], elastic[k, 2]
        if j == STATE:
            state.inverse_unit[i] = min(state.inverse_unit[i], 1.0 / max(abs(state.v[i]), 1e-300))
            continue
        unit = min(state.full_unit[i], max(least * state.full_unit[i], SHARE * state.largest_deformation[group]))
        if j >= 0:
            state.across_unit[k] = unit
        else:
            state.inverse_unit[i] = 1.0 / unit
