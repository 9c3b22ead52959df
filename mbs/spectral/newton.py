"""Simplified Newton's method for the nodes of a Radau step, compiled; its matrices are kept while it converges.

Symbols: h length of the step, M mass, C damping, K stiffness, G Jacobian of the constraints, n coordinates, r constraints; the
arrays of `state` are listed in `output`. Equations (3) and (4): docs/theory-spectral.md; transformation by T: Hairer and Wanner
1996, IV.8. All matrices are those of all unknowns, with M, C, K as blocks; state.saddle_mass has M, G and G^T - df/dlambda. The
stresses of strips are unknowns, too, by (4). Their increments are eliminated at each Gauss point, by `advance_stresses`.
"""

import numpy as np

from . import kernel
from .compiling import copy, kernel_function
from .fronts import factor, solve
from .radau import COMPLEX_EIGENVALUE, NODES, REAL_EIGENVALUE, ROUNDING, T_INVERSE, A, T, integrate, measure_change
from .strips import MIXED, RENEWED, advance_stresses
from .tables import Instant

MATRIX_NODE = 1
"""Index of the node, 0.645 h after the start, whose matrices serve for all three."""
MOST_ITERATIONS = 14
"""Largest number of iterations with one matrix; 3 to 6 suffice with a fresh one."""
UNKNOWN_ERROR_RATIO = 1.0
"""Value of `error_ratio` for the first increment with new matrices: that of increments which halve."""
FAILED = 2.0
"""Value that `solve_nodes` returns if it fails; any above 1, the largest of a success."""
SLOW = 0.3
"""Ratio theta of the last two increments above which `implicit` asks for new matrices in the next step."""


@kernel_function
def renew_matrices(tables, orders, work, state, t, h, counts):
    """Compute and factor M + k C + k^2 K with G, k = h/eigenvalue of A^-1, real and complex; return False if not finite."""
    q, v, lam = state.node_q[MATRIX_NODE], state.node_v[MATRIX_NODE], state.node_lam[MATRIX_NODE]
    since = NODES[MATRIX_NODE] * h
    copy(state.node_stress[MATRIX_NODE], work.stress)
    now = Instant(t + since, since, q, v, lam, state.memory)
    work.strip_form[0] = RENEWED  # for these forces only: the gradients of strains at this state are kept for the matrices
    kernel.compute_forces(tables, work, now, state.force)
    work.strip_form[0] = MIXED  # the form of the whole run, with stresses as unknowns
    kernel.compute_rows(tables, work, t + since, state.violation, state.jacobian, state.speed)
    kernel.fill_saddle(tables, work, q, state.jacobian, state.saddle_mass)
    kernel.compute_tangents(tables, work, now, state.saddle_mass, state.damping, state.stiffness)
    kernel.add_inertia_stiffness(tables, work, q, state.node_a[MATRIX_NODE], state.stiffness)
    counts.jacobians += 1
    if not np.isfinite(state.stiffness.sum() + state.damping.sum() + state.saddle_mass.sum()):
        return False
    k1, k2 = h / REAL_EIGENVALUE, h / COMPLEX_EIGENVALUE
    for i in range(state.saddle_mass.size):
        state.real_matrix[i] = state.saddle_mass[i] + k1 * (state.damping[i] + k1 * state.stiffness[i])
        state.complex_matrix[i] = state.saddle_mass[i] + k2 * (state.damping[i] + k2 * state.stiffness[i])
    factor(orders.newton, state.real_matrix, state.real_factors, state.real_swaps, state.row_magnitude)
    factor(orders.newton, state.complex_matrix, state.complex_factors, state.complex_swaps, state.row_magnitude)
    state.error_ratio[0] = UNKNOWN_ERROR_RATIO
    return True


@kernel_function
def _compute_residuals(tables, work, state, t, h):
    """Compute the residuals M a - f + G^T lambda and G v - speed at the nodes, and those of the strips' stresses."""
    n, r = state.q.size, state.lam.size
    for i in range(3):
        since, residual, lam = NODES[i] * h, state.residual[i], state.node_lam[i]
        node_time, q, v = t + NODES[i] * h, state.node_q[i], state.node_v[i]
        copy(state.node_stress[i], work.stress)
        kernel.compute_forces(tables, work, Instant(node_time, since, q, v, lam, state.memory), state.force)
        copy(work.stress_residual, state.node_stress_residual[i])
        kernel.compute_rows(tables, work, node_time, state.violation, state.jacobian, state.speed)
        kernel.multiply_mass(tables, q, state.node_a[i], residual[:n])
        for k in range(n):
            residual[k] -= state.force[k]
        kernel.add_reactions(tables, state.jacobian, lam, residual)
        for k in range(r):
            residual[n + k] = kernel.multiply_row(tables, k, state.jacobian, v) - state.speed[k]


@kernel_function
def _apply_increment(tables, orders, work, state, h):
    """Add one Newton increment to the unknowns at the nodes; return the size of its change of the coordinates in two norms.

    `size` is that of `measure_change`, with the error control's own units for strips and modes, `size_in_coordinate_units` the
    largest component over `state.unit`. Multipliers are scaled by k = h/eigenvalue of A^-1: so G needs no factor.

    Residuals are sums over the eigenvectors of A^-1: `one` times the real one plus the real part of `two` times the complex one.
    With the columns T_1 and T_2 of T, its real and imaginary part, Re(two (T_1 + i T_2)) = Re(two) T_1 - Im(two) T_2.
    """
    n, unknowns, b = state.q.size, state.real_solution.size, T_INVERSE
    size = size_in_coordinate_units = 0.0
    real, complex_ = state.real_solution, state.complex_solution
    k1, k2 = h / REAL_EIGENVALUE, h / COMPLEX_EIGENVALUE
    for k in range(unknowns):
        r0, r1, r2 = state.residual[0, k], state.residual[1, k], state.residual[2, k]
        one = b[0, 0] * r0 + b[0, 1] * r1 + b[0, 2] * r2
        two = complex(b[1, 0] * r0 + b[1, 1] * r1 + b[1, 2] * r2, -b[2, 0] * r0 - b[2, 1] * r1 - b[2, 2] * r2)
        real[k], complex_[k] = (-k1 * one, -k2 * two) if k < n else (-one, -two)
    solve(orders.newton, state.real_factors, state.real_swaps, real, state.front_work)
    solve(orders.newton, state.complex_factors, state.complex_swaps, complex_, state.complex_front_work)
    for k in range(unknowns):
        one, two = (real[k], complex_[k]) if k < n else (real[k] / k1, complex_[k] / k2)
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
            size_in_coordinate_units = max(size_in_coordinate_units, abs(state.dq[i, k]) / state.unit[k])
            if not abs(state.dq[i, k]) < np.inf:
                return np.inf, np.inf  # nan fails all comparisons
        size = max(size, measure_change(state, tables.elastic, state.dq[i]))
        advance_stresses(tables, work, state.dq[i], state.dv[i], state.node_stress[i], state.node_stress_residual[i])
    integrate(state, h)  # coordinates and accelerations at the nodes from the rates
    return size, size_in_coordinate_units


@kernel_function
def solve_nodes(model, t, h, allowed, renew, counts):
    """Solve the equations at the nodes to an `allowed` error, in units of the error control.

    Returns theta, the ratio of the last two increments, at most 1, or FAILED. The matrices are computed first if `renew`. Kept
    ones are renewed once, at the present nodes, if the iterations left would not suffice.
    """
    tables, orders, work, state = model.tables, model.orders, model.work, model.state
    last_size, ratio, left = 0.0, 0.0, MOST_ITERATIONS  # left: iterations left
    has_new_matrices = renew
    if renew and not renew_matrices(tables, orders, work, state, t, h, counts):
        return FAILED
    error_ratio = max(state.error_ratio[0], 0.1)  # 0.1: the last step's rate of convergence may not hold
    while left > 0:
        left -= 1
        _compute_residuals(tables, work, state, t, h)
        size, size_in_coordinate_units = _apply_increment(tables, orders, work, state, h)
        counts.iterations += 1
        if not np.isfinite(size):
            return FAILED
        if last_size > 0.0:
            ratio = size / last_size
            if ratio < 0.99:  # at 1 the error has no bound
                error_ratio = ratio / (1.0 - ratio)  # of the error after an increment to this increment
            # from the third iteration on: no convergence, or one too slow for the iterations left
            is_slow = left < MOST_ITERATIONS - 2 and (ratio >= 0.99 or size * error_ratio * ratio**left > allowed)
            is_divergent = ratio > 2.0  # below 2 a third iteration is tried
            if size_in_coordinate_units > ROUNDING and (is_divergent or is_slow):
                if has_new_matrices or not renew_matrices(tables, orders, work, state, t, h, counts):
                    return FAILED
                has_new_matrices, last_size, ratio, left, error_ratio = True, 0.0, 0.0, MOST_ITERATIONS, UNKNOWN_ERROR_RATIO
                continue
        if size_in_coordinate_units <= ROUNDING or error_ratio * size <= allowed:
            state.error_ratio[0] = error_ratio
            return min(ratio, 1.0)  # rounding alone may make it larger than 1
        last_size = size
    return FAILED
