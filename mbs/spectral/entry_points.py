"""Functions of the kernel that Python calls, besides the integrators: equations of motion at a state, states of markers."""

from __future__ import annotations

import numpy as np

from .compiling import jit
from .fronts import factor, solve
from .kernel import add_multipliers, add_rows, changes_at, forces, mass_matrix, rows_at, tangents
from .lawtable import AFTER
from .markers import hessian, measure, place_markers
from .strips import carry_stresses


@jit
def place(tables, work, q, v):
    """Place the markers."""
    place_markers(tables, work, q, v)


@jit
def measure_at(tables, work, k, grad, hess):
    """Return measure k, and fill its gradient and Hessian. Markers are placed."""
    value, _ = measure(tables, work, k, grad)
    hessian(tables, work, k, grad, hess)
    return value


@jit
def mass_at(tables, work, q, mass):
    """Fill mass with M(q)."""
    mass_matrix(tables, work, q, mass)


@jit
def assemble(tables, work, now, matrices, force, sides):
    """Fill in forces; residuals g and right sides of G v = speed and G a = change, the rows of `sides`; and matrices.

    These, (4, slots + 1) nonzeros, are -df/dlambda, damping, stiffness, and G with its transpose; or the last alone.
    """
    forces(tables, work, now, force)
    every, jacobian = matrices.shape[0] > 1, np.zeros(tables.members.size)
    if every:
        tangents(tables, work, now, matrices[0], matrices[1], matrices[2])
    rows_at(tables, work, now.time, sides[0], jacobian, sides[1])
    changes_at(tables, work, now.time, AFTER, sides[2])
    if every:
        add_multipliers(tables, work, now.q, now.lam, matrices[2])
    add_rows(tables, jacobian, matrices[matrices.shape[0] - 1])


@jit
def carry(tables, work, shift):
    """Update the strips' stresses, which are unknowns, for a change of the coordinates since forces were last assembled."""
    carry_stresses(tables, work, shift, np.zeros(shift.size), work.stress, work.slack)


@jit
def accelerate(tables, order, work, q, x):
    """Solve M a + G^T lambda = force, G a = change at coordinates q in place, for x = (force, change)."""
    r, values = tables.rows.shape[0], np.zeros(tables.mass.size)
    jacobian, unused = np.zeros(tables.members.size), np.zeros((2, r))
    place_markers(tables, work, q, np.zeros(q.size))
    rows_at(tables, work, 0.0, unused[0], jacobian, unused[1])
    mass_matrix(tables, work, q, values)
    add_rows(tables, jacobian, values)
    factors, swaps = np.zeros(order.fronts[-1, 3] + order.fronts[-1, 1] ** 2), np.zeros(order.unknowns.size, np.int64)
    factor(order, values, factors, swaps, np.zeros(x.size))
    solve(order, factors, swaps, x, np.zeros(x.size))
