"""One step of collocation at the three Radau points, compiled: first guess, error estimate, projection onto the constraints.

The module `newton` solves the equations, (3) and (4) of docs/theory-spectral.md. Unknowns at the nodes are the n rates v, the
r multipliers lam and the stresses of strips (`strips`). At the nodes the n coordinates q follow from the rates.
Constraints g(q, t) = 0 hold for velocities (index 2): G v = speed, with G = dg/dq. Their second derivative is G a = change.
The eigenvectors of A^-1, A the Runge-Kutta matrix, decouple Newton's equations into a real and a complex system. Its real
matrix is M + k1 C + k1^2 K with G, k1 = h over the real eigenvalue; M mass, C damping, K stiffness, h step length. The arrays
of `state` are listed in `output`; `unit` is the unit of each coordinate.
"""

from typing import Any

import numpy as np

from .compiling import copy, kernel_function
from .fronts import factor, solve
from .kernel import add_reactions, compute_changes, compute_forces, compute_rows, fill_saddle, multiply_mass, multiply_row
from .lawtable import JUST_BEFORE
from .markers import place_markers
from .tables import LAW_STATE, Elastic, Instant


def _compute_coefficients() -> tuple[Any, ...]:
    """Compute the nodes, A, A^-1, its real and its complex eigenvalue, T, T^-1, and the weights of the error."""
    root = np.sqrt(6.0)
    nodes = np.array([(4 - root) / 10, (4 + root) / 10, 1.0])
    powers = np.vander(nodes, increasing=True)
    a = powers * nodes[:, None] / np.arange(1, 4) @ np.linalg.inv(powers)
    values, vectors = np.linalg.eig(np.linalg.inv(a))
    real, pair = np.argmin(np.abs(values.imag)), np.argmax(values.imag)
    t = np.column_stack([vectors[:, real].real, vectors[:, pair].real, vectors[:, pair].imag])  # eigenvectors of A^-1
    weights = np.array([-(13 + 7 * root) / 3, (7 * root - 13) / 3, -1 / 3])  # Hairer and Wanner 1996, IV.8
    return nodes, a, np.linalg.inv(a), float(values[real].real), complex(values[pair]), t, np.linalg.inv(t), weights


NODES, A, A_INVERSE, REAL_EIGENVALUE, COMPLEX_EIGENVALUE, T, T_INVERSE, ERROR_WEIGHTS = _compute_coefficients()
START_AND_NODES = np.array([0.0, NODES[0], NODES[1], 1.0])
"""Fractions of the last step at which its rates are known."""
ROUNDING = 1e-14
"""Newton increment, over the unit of its coordinate, that counts as rounding. The errors left add up over steps: with a hundred
times more a double pendulum of 10 s cannot gain accuracy at tolerances below 1e-8."""
LEAST_ERROR = 1e-11
"""Least error of an inner coordinate, over its unit, that the error control resolves. A smaller one costs steps for a strip that
hardly bends, and changes no signal."""
LEAST_UNIT = 1e-5
"""Least unit of the error control for an inner coordinate, over the coordinate's own unit, at any tolerance. A tenth and
ten times of it change the steps of a slider-crank with a strip by 5 per cent."""
DEFORMATION_FACTOR = 100.0
"""Unit of the error control for an inner coordinate, over the largest deformation so far of its strip piece or link: a
deformation's relative error is a hundred times the tolerance. A tenth of it costs 13 per cent more steps at tolerance 1e-4."""


@kernel_function
def measure_change(state, elastic, u):
    """Compute the largest component of a change u (n,) of q, in units of the error control.

    A row of `elastic` with j >= 0 is a vector (x at dof i, y at j), a coefficient of a strip. Across the chord it has
    a unit of its own; along it that of a length, so that axial vibrations set no steps. The inverse units of i and j alone are 0.
    """
    worst = 0.0
    for i in range(u.size):
        worst = max(worst, abs(u[i]) * state.inverse_error_unit[i])
    for k in range(elastic.shape[0]):
        i, j = elastic[k, Elastic.FIRST], elastic[k, Elastic.SECOND]
        if j >= 0:
            c, sn = state.chord[k, 0], state.chord[k, 1]
            worst = max(worst, abs(c * u[i] + sn * u[j]) / state.unit[i], abs(c * u[j] - sn * u[i]) / state.error_unit_across[k])
    return worst


@kernel_function
def evaluate_lagrange(fraction, j):
    """Evaluate Lagrange polynomial j of `START_AND_NODES` at a fraction of the step."""
    value = 1.0
    for m in range(4):
        if m != j:
            value *= (fraction - START_AND_NODES[m]) / (START_AND_NODES[j] - START_AND_NODES[m])
    return value


@kernel_function
def predict(state, h, last_h):
    """Fill in the first guess at the nodes; `last_h` is the length of the last step, 0 after a jump."""
    # rates continue the last step's polynomial of third degree, multipliers and stresses the line through its last two nodes
    n, extrapolates = state.q.size, h < 100.0 * last_h  # rounding grows with the cube of the ratio
    for i in range(3):
        rates, node_stress = state.node_v[i], state.node_stress[i]
        # past_lam and past_stress are those (1 - NODES[1]) last_h ago, at the second node of the last step
        slope = NODES[i] * h / (last_h * (1.0 - NODES[1])) if extrapolates else 0.0
        for k in range(state.lam.size):
            state.node_lam[i, k] = state.lam[k] + slope * (state.lam[k] - state.past_lam[k])
        for p in range(state.stress.size):
            present = state.stress.flat[p]
            node_stress.flat[p] = present + slope * (present - state.past_stress.flat[p])
        if not extrapolates:  # after a jump or a tiny step
            for k in range(n):
                rates[k] = state.v[k] + NODES[i] * h * state.a[k]
            continue
        fraction = 1.0 + NODES[i] * h / last_h
        rates[:] = 0.0
        for j in range(4):
            weight, past = evaluate_lagrange(fraction, j), state.past_v[j]
            for k in range(n):
                rates[k] += weight * past[k]


@kernel_function
def integrate(state, h):
    """Compute coordinates and accelerations at the nodes from the rates there."""
    for i in range(3):
        for k in range(state.q.size):
            r0, r1, r2, v = state.node_v[0, k], state.node_v[1, k], state.node_v[2, k], state.v[k]
            state.node_q[i, k] = state.q[k] + h * (A[i, 0] * r0 + A[i, 1] * r1 + A[i, 2] * r2)
            state.node_a[i, k] = (A_INVERSE[i, 0] * (r0 - v) + A_INVERSE[i, 1] * (r1 - v) + A_INVERSE[i, 2] * (r2 - v)) / h


@kernel_function
def factor_saddle(tables, orders, work, state, q, jacobian):
    """Factor the saddle-point matrix [M G^T; G 0] with the given Jacobian."""
    fill_saddle(tables, work, q, jacobian, state.saddle)
    factor(orders.mass, state.saddle, state.saddle_factors, state.saddle_swaps, state.row_magnitude)


@kernel_function
def _combine_nodes(nodes, start, k):
    """Compute component k of the embedded formula: the weighted sum of the changes from the start to the nodes."""
    w = ERROR_WEIGHTS
    return w[0] * (nodes[0, k] - start[k]) + w[1] * (nodes[1, k] - start[k]) + w[2] * (nodes[2, k] - start[k])


@kernel_function
def estimate_error(tables, orders, state, h):
    """Compute the local error e_q of the coordinates; return its largest component in units of the error control.

    With Q_i and V_i at the nodes the embedded formula of third order has the defect d_q = v + sum w_i (Q_i - q)/h. That of the
    rates is d_v = a + sum w_i (V_i - v)/h. The filtered errors satisfy three equations: e_q/k1 - e_v = d_q;
    M e_v/k1 + C e_v + K e_q = M d_v; G e_v = 0. Without e_v:

        (M + k1 C + k1^2 K) e_q = k1^2 [M (d_v + d_q/k1) + C d_q],    G e_q = k1 G d_q.

    state.real_solution has e_q and multipliers, state.dq[0] has d_q.
    """
    n, r, k1, error = state.q.size, state.lam.size, h / REAL_EIGENVALUE, state.real_solution
    d_q, sum_of_defects = state.dq[0], state.dv[0]
    for k in range(n):
        d_q[k] = state.v[k] + _combine_nodes(state.node_q, state.q, k) / h
        sum_of_defects[k] = state.a[k] + d_q[k] / k1 + _combine_nodes(state.node_v, state.v, k) / h
    multiply_mass(tables, state.q, sum_of_defects, error[:n])
    for k in range(tables.row.size):  # C d_q, by the nonzeros of C
        row, column = tables.row[k], tables.col[k]
        if row < n and column < n:
            error[row] += state.damping[k] * d_q[column]
    for i in range(n):
        error[i] *= k1 * k1
    for k in range(r):
        error[n + k] = k1 * multiply_row(tables, k, state.start_jacobian, d_q)
    solve(orders.newton, state.real_factors, state.real_swaps, error, state.front_work)
    return measure_change(state, tables.elastic, error[:n])


@kernel_function
def project(tables, orders, work, state, t, h):
    """Project the end of a step onto g = 0, then its rates onto G v = speed and its accelerations onto G a = change.

    The last two corrections are M^-1 G^T mu, as in (5). With that of a, lam becomes lam - mu: so the residual M a - f + G^T lam
    stays. Newton's method leaves a residual M x + G^T nu, with G x = 0. Without strips lam becomes lam - nu at the end; at the
    nodes this change grows linearly from 0 at the start. With strips nu would contain residuals of their stresses. The projection
    is as small as a local error: forces and rates of markers stay those before it.
    """
    n, q, v, a, lam = state.q.size, state.node_q[2], state.node_v[2], state.node_a[2], state.node_lam[2]
    if lam.size == 0:
        place_markers(tables, work, q, v)
        return
    residual, corrects_multipliers = state.residual[2], state.stress.size == 0  # without strips
    if corrects_multipliers:
        compute_forces(tables, work, Instant(t, h, q, v, lam, state.memory), state.force)
        multiply_mass(tables, q, a, residual[:n])
        for i in range(n):
            residual[i] -= state.force[i]
    _project_coordinates(tables, orders, work, state, t)
    if corrects_multipliers:
        add_reactions(tables, state.jacobian, lam, residual)
    compute_changes(tables, work, t, JUST_BEFORE, state.change)
    factor_saddle(tables, orders, work, state, q, state.jacobian)
    _project_rates(tables, orders, state, state.speed, v)
    mu = _project_rates(tables, orders, state, state.change, a)
    for k in range(lam.size):
        lam[k] -= mu[k]
    if corrects_multipliers:
        residual[n:] = 0.0
        solve(orders.mass, state.saddle_factors, state.saddle_swaps, residual, state.front_work)
        nu = residual[n:]
        for k in range(lam.size):
            for i in range(3):
                state.node_lam[i, k] -= NODES[i] * nu[k]


@kernel_function
def _project_coordinates(tables, orders, work, state, t):
    """Move the coordinates at the end of the step onto g = 0 by at most three steps with the real Newton matrix."""
    n, q, correction = state.q.size, state.node_q[2], state.right_side
    for iteration in range(4):
        place_markers(tables, work, q, state.node_v[2])
        compute_rows(tables, work, t, state.violation, state.jacobian, state.speed)
        worst = 0.0
        for k in range(state.lam.size):
            worst = max(worst, abs(state.violation[k]))
        if iteration == 3 or worst <= 1e-13:  # 1e-13 m or rad: rounding
            break
        correction[:n] = 0.0
        copy(state.violation, correction[n:])
        solve(orders.newton, state.real_factors, state.real_swaps, correction, state.front_work)
        for i in range(n):
            q[i] -= correction[i]


@kernel_function
def _project_rates(tables, orders, state, target, y):
    """Move rates or accelerations y (n,) onto G y = target (r,) by the least correction in the mass metric; return mu (r,)."""
    n, correction = y.size, state.right_side
    correction[:n] = 0.0
    for k in range(target.size):
        correction[n + k] = multiply_row(tables, k, state.jacobian, y) - target[k]
    solve(orders.mass, state.saddle_factors, state.saddle_swaps, correction, state.front_work)
    for i in range(n):
        y[i] -= correction[i]
    return correction[n:]  # the next solution overwrites them


@kernel_function
def measure_deformation(state, elastic, k):
    """Return the inner coordinate of row k of `elastic`; of a vector the component across the chord. Update state.chord."""
    i, j = elastic[k, Elastic.FIRST], elastic[k, Elastic.SECOND]
    if j < 0:
        return state.q[i]
    dx = state.q[elastic[k, Elastic.END_X]] - state.q[elastic[k, Elastic.START_X]]
    dy = state.q[elastic[k, Elastic.END_Y]] - state.q[elastic[k, Elastic.START_Y]]
    length = max(np.sqrt(dx * dx + dy * dy), 1e-300)
    state.chord[k, 0], state.chord[k, 1] = dx / length, dy / length
    return state.chord[k, 0] * state.q[j] - state.chord[k, 1] * state.q[i]


@kernel_function
def update_units(state, elastic, tolerance):
    """Update the units of the error control: `DEFORMATION_FACTOR` times the largest deformation so far, within bounds.

    The bounds are `unit` and a share of it, below which errors are rounding. A row is a vector if j >= 0, a single coordinate if
    j = -1. If j = LAW_STATE, it is the integral of a law's state. Its unit is the state's largest value so far, times 1 s.
    """
    least = max(LEAST_UNIT, LEAST_ERROR / tolerance)
    for k in range(elastic.shape[0]):
        group, change = elastic[k, Elastic.GROUP], abs(measure_deformation(state, elastic, k) - state.start_deformation[k])
        state.largest_deformation[group] = max(state.largest_deformation[group], change)
    for k in range(elastic.shape[0]):
        i, j, group = elastic[k, Elastic.FIRST], elastic[k, Elastic.SECOND], elastic[k, Elastic.GROUP]
        if j == LAW_STATE:  # v is the state; the unit does not fall, and began as max(1, |initial state|)
            state.inverse_error_unit[i] = min(state.inverse_error_unit[i], 1.0 / max(abs(state.v[i]), 1e-300))
            continue
        unit = min(state.unit[i], max(least * state.unit[i], DEFORMATION_FACTOR * state.largest_deformation[group]))
        if j >= 0:
            state.error_unit_across[k] = unit
        else:
            state.inverse_error_unit[i] = 1.0 / unit
