"""Compiled functions that Python calls, besides the integrators: equations of motion at a state, states of markers.

The equations are M(q) a = f(q, v, lambda, t) - G^T lambda and g(q, t) = 0 with G = dg/dq, for n coordinates q and r multipliers
lambda. Differentiated in time, g = 0 gives G v = speed and G a = change. Matrices are stored as their slots, the entries that can
be nonzero, and one more entry, which is never read. `kernel` tells how `jacobian` stores G.
"""

import numpy as np

from . import kernel
from .compiling import jit
from .elimination import FrontColumn
from .fronts import factor, solve
from .lawtable import JUST_AFTER
from .markers import compute_measure, place_markers
from .strips import advance_stresses

place = jit(place_markers)
"""Function for Python that writes the states of markers to work.state."""
mass_at = jit(kernel.fill_mass)
"""Function for Python that fills `mass` (slots + 1,) with M(q)."""


@jit
def measure_at(tables, work, k):
    """Return measure k of markers that are placed."""
    return compute_measure(tables, work, k, work.grad)[0]


@jit
def assemble(tables, work, now, matrices, force, sides):
    """Place the markers and compute the terms of the equations of motion at the instant `now`.

    Fills force (n,) with f, and sides (3, r) with g, speed, change; where the speed of a drive has a kink, change is that after
    it. Rows of `matrices` (4, slots + 1) are -df/dlambda, C = -df/dv, K = -df/dq + d(G^T lambda)/dq, G with G^T; `matrices`
    with one row only gets G with G^T.
    """
    jacobian = np.zeros(tables.block_unknowns.size)
    kernel.compute_forces(tables, work, now, force)
    if matrices.shape[0] > 1:
        cross, damping, stiffness = matrices[0], matrices[1], matrices[2]
        kernel.compute_tangents(tables, work, now, cross, damping, stiffness)
    kernel.compute_rows(tables, work, now.time, sides[0], jacobian, sides[1])
    kernel.compute_changes(tables, work, now.time, JUST_AFTER, sides[2])
    kernel.write_rows(tables, jacobian, matrices[-1])


@jit
def update_stresses(tables, work, shift):
    """Update the stresses of strips, which are unknowns beside q (see `strips`), for a change `shift` (n,) of q in statics."""
    no_rates = np.zeros(shift.size)
    advance_stresses(tables, work, shift, no_rates, work.stress, work.stress_residual)


@jit
def accelerate(tables, order, work, q, x):
    """Solve [M G^T; G 0] (a, lambda) = (f, change) at q in the order of `Fronts`; x (n + r,) is right side, then solution."""
    r, values = tables.rows.shape[0], np.zeros(tables.mass.size)
    jacobian, unused = np.zeros(tables.block_unknowns.size), np.zeros((2, r))
    place_markers(tables, work, q, np.zeros(q.size))
    kernel.compute_rows(tables, work, 0.0, unused[0], jacobian, unused[1])  # only G is used, which does not depend on the time
    kernel.fill_saddle(tables, work, q, jacobian, values)
    last_front, swaps = order.fronts[-1], np.zeros(order.unknowns.size, np.int64)
    first_entry, size = last_front[FrontColumn.ENTRIES], last_front[FrontColumn.SIZE]
    factors = np.zeros(first_entry + size**2)  # entries of all fronts, one front after the other
    work_space = np.zeros(x.size)
    factor(order, values, factors, swaps, work_space)
    solve(order, factors, swaps, x, work_space)
