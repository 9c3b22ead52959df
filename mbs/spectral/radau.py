"""One step of the collocation at three Radau points, compiled: Newton's method, error, projection.

Unknowns are rates V_i and multipliers L_i at the nodes c_i, with A = (a_ij) the integrals of the nodes' Lagrange polynomials,

    Q = q + h A V,    M A_i = f(Q_i, V_i) - G^T L_i,    A^-1 (V - v)/h = (A_i),    G(Q_i) V_i = speed(t + c_i h),

that is, constraints at the level of velocities: index 2, in which places and rates are of fifth order. Its eigenvalues take A^-1
apart into one real problem of the mechanism's size and one complex one; with mu an eigenvalue and k = h/mu,

    [ M + k C + k^2 K   G^T ] [ dV   ]     [ k R ]
    [ G                 0   ] [ k dL ]  = -[ r   ],

R and r what the equations lack. Strips' stresses are further unknowns, see `strips`. The local error is that of the embedded
method of third order, freed by the real matrix of what steps of this length need not resolve,

    e = (mu/h - J)^-1 (y'(t) + sum_i e_i (Y_i - y)/h).

References
----------
E. Hairer, G. Wanner, Solving ordinary differential equations II, 2nd ed., Springer 1996, ch. IV.8 and VII.4,
doi 10.1007/978-3-642-05221-7.
E. Hairer, C. Lubich, M. Roche, The numerical solution of differential-algebraic systems by Runge-Kutta methods, Springer 1989,
doi 10.1007/BFb0093947.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from buckler.mbs.spectral.compiling import aside, copy, inner
from buckler.mbs.spectral.fronts import factor, solve
from buckler.mbs.spectral.kernel import (
    add_mass_slope,
    add_multipliers,
    add_reactions,
    add_rows,
    changes_at,
    forces,
    mass_matrix,
    mass_times,
    renew_mass,
    row_times,
    rows_at,
    tangents,
)
from buckler.mbs.spectral.lawtable import BEFORE
from buckler.mbs.spectral.markers import place_markers
from buckler.mbs.spectral.strips import MIXED, RENEWED, carry_stresses
from buckler.mbs.spectral.tape import MODE, READS, SLOT, free_slot


def _coefficients() -> tuple[Any, ...]:
    """Nodes, A, A^-1, its real and complex eigenvalues, T and T^-1 that take it apart, weights of the error."""
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
"""Where the last step's rates are known."""
MOST = 14
"""Newton iterations with one matrix."""
ROUNDING = 1e-12
"""A Newton step below this, of the coordinates' whole units, can grow no smaller."""
LEAST_EASE = 0.1
"""A first Newton step leaves at least this share of itself, however fast the last step's converged."""
SLOW = 0.3
"""Ratio of Newton steps beyond which the next step has a new matrix."""


@aside
def size_of(x, elastic, u):
    """Largest component of a change u of the coordinates, in their units."""
    worst = 0.0
    for i in range(u.size):
        worst = max(worst, abs(u[i]) * x.weight[i])
    for k in range(elastic.shape[0]):
        i, j = elastic[k, 0], elastic[k, 1]
        if j >= 0:
            c, sn = x.turn[k, 0], x.turn[k, 1]
            worst = max(worst, abs(c * u[i] + sn * u[j]) / x.whole[i], abs(c * u[j] - sn * u[i]) / x.across[k])
    return worst


@inner
def lagrange(at, j):
    """Lagrange's polynomial j of the places where a step's rates are known, at a fraction of the step."""
    factor = 1.0
    for m in range(4):
        if m != j:
            factor *= (at - PAST[m]) / (PAST[j] - PAST[m])
    return factor


@aside
def predict(x, h, before):
    """First guess at the nodes: rates by the last step's polynomial, or where there is none by the present acceleration;
    multipliers and stresses by the line through the last step's last two nodes, or as they are.
    """
    n = x.q.size
    for i in range(3):
        rates, stress, slope = x.rates[i], x.stresses[i], 0.0
        if before > 0.0:
            slope = NODES[i] * h / (before * (1.0 - NODES[1]))
        for k in range(x.lam.size):
            x.multipliers[i, k] = x.lam[k] + slope * (x.lam[k] - x.past_lam[k])
        for p in range(x.stress.size):
            stress.flat[p] = x.stress.flat[p] + slope * (x.stress.flat[p] - x.past_stress.flat[p])
        if before == 0.0:
            for k in range(n):
                rates[k] = x.v[k] + NODES[i] * h * x.a[k]
            continue
        at = 1.0 + NODES[i] * h / before
        for k in range(n):
            rates[k] = x.v[k] - x.past[3, k]
        for j in range(4):
            factor, past = lagrange(at, j), x.past[j]
            for k in range(n):
                rates[k] += factor * past[k]


@aside
def integrate(x, h):
    """Places and accelerations at the nodes from the rates there."""
    for i in range(3):
        for k in range(x.q.size):
            r0, r1, r2, v = x.rates[0, k], x.rates[1, k], x.rates[2, k], x.v[k]
            x.places[i, k] = x.q[k] + h * (A[i, 0] * r0 + A[i, 1] * r1 + A[i, 2] * r2)
            x.seconds[i, k] = (INVERSE[i, 0] * (r0 - v) + INVERSE[i, 1] * (r1 - v) + INVERSE[i, 2] * (r2 - v)) / h


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
    x.at[SLOT] = at = free_slot(x)
    copy(w.held, x.tape.held[at])
    factor(e.newton, x.matrix, x.tape.real[at], x.tape.swaps[at, 0], x.amount_of_row, False)
    factor(e.newton, x.twisted, x.tape.complex[at], x.tape.swaps[at, 1], x.amount_of_row, False)
    x.ease[0] = 1.0
    return True


@aside
def renew_heavy(s, e, w, x, q, jacobian, again):
    """Factor [M G^T; G 0] with these rows."""
    renew_mass(s, w, q, jacobian, x.bare)
    factor(e.mass, x.bare, x.heavy, x.heavy_swaps, x.amount_of_row, again)


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


@inner
def _solve_real(e, x, right):
    """Solve with the real Newton matrix, in place."""
    solve(e.newton, x.tape.real[x.at[SLOT]], x.tape.swaps[x.at[SLOT], 0], right, x.part)


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
    _solve_real(e, x, x.step)
    solve(e.newton, x.tape.complex[x.at[SLOT]], x.tape.swaps[x.at[SLOT], 1], x.swirl, x.twin)
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

    Where a kept matrix contracts too slowly, it is made anew from the nodes as they are. By a tape two iterations are the least:
    what one leaves is small beside the local error, but not beside the difference of two runs.
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
        if (whole <= ROUNDING or ease * size <= allowed) and (left < MOST - 1 or x.at[MODE] != READS):
            x.ease[0] = ease
            return min(ratio, 1.0)  # of two steps of rounding
        last = size
    return 2.0


@inner
def _embedded(nodes, start, k):
    """What the nodes of component k add to its slope at the start, times the length of the step, by the embedded formula."""
    return ERROR[0] * (nodes[0, k] - start[k]) + ERROR[1] * (nodes[1, k] - start[k]) + ERROR[2] * (nodes[2, k] - start[k])


@aside
def error_of(s, e, x, h):
    """Put the local error of the coordinates into x.step; its size in their units."""
    n, r, k1 = x.q.size, x.lam.size, h / REAL
    moved, pushed = x.dq[0], x.dv[0]
    for k in range(n):
        moved[k] = x.v[k] + _embedded(x.places, x.q, k) / h
        pushed[k] = x.a[k] + moved[k] / k1 + _embedded(x.rates, x.v, k) / h
    mass_times(s, x.q, pushed, x.step[:n])
    for k in range(s.row.size):
        if s.row[k] < n and s.col[k] < n:
            x.step[s.row[k]] += x.damping[k] * moved[s.col[k]]
    for i in range(n):
        x.step[i] *= k1 * k1
    for k in range(r):
        x.step[n + k] = k1 * row_times(s, k, x.base, moved)
    _solve_real(e, x, x.step)
    return size_of(x, s.elastic, x.step[:n])


@aside
def put_back(s, e, w, x, t):
    """Move the step's end onto the constraints: places by the Newton matrix, rates and accelerations with least kinetic energy.

    The constraints' directions of the latter are the present ones: with those of a kept matrix the motion along them would be
    wrong.
    """
    n, r, q, v, a, lam = x.q.size, x.lam.size, x.places[2], x.rates[2], x.seconds[2], x.multipliers[2]
    if r == 0:
        place_markers(s, w, q, v)
        return
    for attempt in range(4):
        place_markers(s, w, q, v)
        rows_at(s, w, t, x.gap, x.jacobian, x.speed)
        worst = 0.0
        for k in range(r):
            worst = max(worst, abs(x.gap[k]))
        if attempt == 3 or worst <= 1e-13:
            break
        _fill(x.right, n, x.gap)
        _solve_real(e, x, x.right)
        for i in range(n):
            q[i] -= x.right[i]
    changes_at(s, w, t, BEFORE, x.change)
    for k in range(r):
        x.speed[k] = row_times(s, k, x.jacobian, v) - x.speed[k]
        x.change[k] = row_times(s, k, x.jacobian, a) - x.change[k]
    renew_heavy(s, e, w, x, q, x.jacobian, True)
    _project(e, x, x.speed, v)
    _project(e, x, x.change, a)
    for k in range(r):
        lam[k] -= x.right[n + k]


@inner
def _project(e, x, rows, y):
    """Take from y what makes the constraints' rows, with least kinetic energy."""
    _fill(x.right, y.size, rows)
    solve(e.mass, x.heavy, x.heavy_swaps, x.right, x.part)
    for i in range(y.size):
        y[i] -= x.right[i]


@inner
def _fill(right, n, rows):
    """Make a right side of rows alone."""
    right[:] = 0.0
    for k in range(rows.size):
        right[n + k] = rows[k]
