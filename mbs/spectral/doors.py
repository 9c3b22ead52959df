"""What Python calls of the kernel but the integrators: equations of motion at a state, places of markers.

Each lends its tables to functions that are compiled as often as they are called with other types, which is once: see `compiling`.
"""

from __future__ import annotations

import numpy as np

from .compiling import aside, jit, lend
from .fronts import factor, solve
from .kernel import add_multipliers, add_rows, constraints, forces, mass_matrix, tangents
from .markers import curve, measure, place_markers
from .strips import carry_stresses


@jit
def place(s, w, q, v):
    """Place the markers."""
    place_markers(lend(s), lend(w), q, v)


@jit
def measured(s, w, k, grad, hess):
    """Length or angle k, its gradient and Hessian. Markers are placed."""
    return _measured(lend(s), lend(w), k, grad, hess)


@aside
def _measured(s, w, k, grad, hess):
    value, _ = measure(s, w, k, grad)
    curve(s, w, k, grad, hess)
    return value


@jit
def mass_at(s, w, q, mass):
    """Fill mass with M(q)."""
    mass_matrix(lend(s), lend(w), q, mass)


@jit
def assemble(s, w, t, q, v, lam, memory, since, matrices, force, residual, speed, change):
    """Forces, residuals g, right sides of G v = speed and G a = change, and matrices by their entries.

    Those (4, slots + 1) are -df/dlambda, damping, stiffness, and G and its transpose; where they are only the last one, it is
    filled alone.
    """
    _assemble(lend(s), lend(w), t, q, v, lam, memory, since, matrices, force, residual, speed, change)


@aside
def _assemble(s, w, t, q, v, lam, memory, since, matrices, force, residual, speed, change):
    forces(s, w, t, q, v, lam, memory, since, force)
    every, jacobian = matrices.shape[0] > 1, np.zeros(s.members.size)
    if every:
        tangents(s, w, t, q, v, lam, memory, since, matrices[0], matrices[1], matrices[2])
    constraints(s, w, t, jacobian, residual, speed, change)
    if every:
        add_multipliers(s, w, q, lam, matrices[2])
    add_rows(s, jacobian, matrices[matrices.shape[0] - 1])


@jit
def carry(s, w, dq):
    """Carry the strips' stresses, unknowns of their own, over a change of the coordinates since forces were last assembled."""
    _carry(lend(s), lend(w), dq)


@aside
def _carry(s, w, dq):
    carry_stresses(s, w, dq, np.zeros(dq.size), w.stress, w.slack)


@jit
def held(s, e, w, q, x):
    """Solve M a + G^T lambda = force, G a = change at coordinates q in place, for x = (force, change)."""
    _held(lend(s), lend(e), lend(w), q, x)


@aside
def _held(s, e, w, q, x):
    r, values = s.rows.shape[0], np.zeros(s.mass.size)
    jacobian, unused = np.zeros(s.members.size), np.zeros((3, r))
    place_markers(s, w, q, np.zeros(q.size))
    constraints(s, w, 0.0, jacobian, unused[0], unused[1], unused[2])
    mass_matrix(s, w, q, values)
    add_rows(s, jacobian, values)
    factors, swaps = np.zeros(e.fronts[-1, 3] + e.fronts[-1, 1] ** 2), np.zeros(e.unknowns.size, np.int64)
    factor(e, values, factors, swaps, np.zeros(x.size), False)
    solve(e, factors, swaps, x, np.zeros(x.size))
