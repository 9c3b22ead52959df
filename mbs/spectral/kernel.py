"""Equations of motion, compiled: M(q) a = f(q, v, lambda, t) - G^T lambda, g(q, t) = 0, with analytic tangents.

The friction of guides makes f depend on lambda. The tangents are K = -df/dq + d(G^T lambda)/dq and C = -df/dv. Matrices are sums
of blocks: small matrices of constraints, forces, strips, modal links and masses, in this order. `tables.block_unknowns` lists the
unknowns of all blocks, `tables.slots` the slots of their entries in the whole matrix. Of one block `first` is the index of its
first unknown, `width` the number of unknowns and `entry` the index of its first entry in `tables.slots`. The last unknown of a
constraint's block is its multiplier; the other entries of this last row are those of G. `jacobian` stores G in the order of
`block_unknowns`; its entries for multipliers are not used. Residuals g, G and the right sides of G v = speed and G a = change
need markers that are placed.

The mass matrix is constant but for modal links (docs/theory-modal.md). Their modes phi_i have amplitudes eta (m,) and mass 1.
Integrals of components in the plane, X being the position in the frame: `radial` (m,) of X . phi_i dm, `gram` (m, m) of phi_i .
phi_j dm, `gyration` (m, m) of phi_i x phi_j dm. Modes of a solid also move out of the plane, along z: entry (i, i) of `gram` is 1
minus the integral of phi_iz^2 dm. The frame is at the centre of mass, and modes have neither linear nor, about the undeformed
link, angular momentum. The frame's inertia is I + 2 radial^T eta + eta^T gram eta. Only its angle is coupled with the modes, by
gyration^T eta = -gyration eta, as gyration is skew-symmetric. Rows of a modal link's block are x, y and angle of the frame, 0 to
2, then the amplitudes, from 3 on. Local names: o is the index in q of the frame's x, e that of the first amplitude.
"""

import numpy as np

from . import markers
from .compiling import copy, inline, kernel_function
from .forces import add_forces, add_forces_tangents
from .lawtable import evaluate_acceleration, evaluate_motion
from .strips import add_strips, add_strips_tangents
from .tables import BlockColumn, Markers, MeasureKind, MeasureNumber, Measures, Modal, RowColumn


@inline
def _find_indices(tables, row):
    """Return o, e, m of a modal link, and where its radial, gram, gyration, stiffness (m,) begin in the data; damping follows."""
    o, m, radial = tables.modal[row, Modal.OFFSET], tables.modal[row, Modal.MODES], tables.modal[row, Modal.DATA]
    gram = radial + m
    gyration = gram + m * m
    return o, o + 3, m, radial, gram, gyration, gyration + m * m


@inline
def _find_block(tables, row):
    """Return the index of a modal link's block among all blocks."""
    return tables.rows.shape[0] + tables.forces.shape[0] + tables.strips.shape[0] + row


@kernel_function
def _multiply_matrix_row(tables, at, i, m, x, first):
    """Multiply row i of the (m, m) matrix that begins at `at` by the m values of x from `first`."""
    total = 0.0
    for j in range(m):
        total += tables.data[at + i * m + j] * x[first + j]
    return total


@kernel_function
def add_modal(tables, q, v, f):
    """Add elastic, damping and gyroscopic forces of modal links to f."""
    for row in range(tables.modal.shape[0]):
        o, e, m, radial, gram, gyration, stiffness = _find_indices(tables, row)
        spin, half_inertia_rate = v[o + 2], 0.0
        for i in range(m):
            half_slope = tables.data[radial + i] + _multiply_matrix_row(tables, gram, i, m, q, e)  # d(inertia)/d(eta_i)/2
            coriolis = _multiply_matrix_row(tables, gyration, i, m, v, e)
            half_inertia_rate += half_slope * v[e + i]
            f[e + i] += spin * (spin * half_slope + 2.0 * coriolis)
            f[e + i] -= tables.data[stiffness + i] * q[e + i] + tables.data[stiffness + m + i] * v[e + i]
        f[o + 2] -= 2.0 * spin * half_inertia_rate


@kernel_function
def add_modal_tangents(tables, work, q, v, damp, stiff):
    """Add -df/dq to stiff and -df/dv to damp of the forces of modal links."""
    for row in range(tables.modal.shape[0]):
        o, e, m, radial, gram, gyration, stiffness = _find_indices(tables, row)
        spin = v[o + 2]
        markers.clear_block(tables, work, _find_block(tables, row))
        for i in range(m):
            half_slope = tables.data[radial + i] + _multiply_matrix_row(tables, gram, i, m, q, e)  # d(inertia)/d(eta_i)/2
            coriolis = _multiply_matrix_row(tables, gyration, i, m, v, e)
            for j in range(m):
                work.block_stiffness[3 + i, 3 + j] -= spin * spin * tables.data[gram + i * m + j]
                work.block_damping[3 + i, 3 + j] -= 2.0 * spin * tables.data[gyration + i * m + j]
            work.block_stiffness[2, 3 + i] += 2.0 * spin * _multiply_matrix_row(tables, gram, i, m, v, e)
            work.block_damping[2, 2] += 2.0 * half_slope * v[e + i]
            work.block_damping[2, 3 + i] += 2.0 * spin * half_slope
            work.block_damping[3 + i, 2] -= 2.0 * spin * half_slope + 2.0 * coriolis
            work.block_stiffness[3 + i, 3 + i] += tables.data[stiffness + i]
            work.block_damping[3 + i, 3 + i] += tables.data[stiffness + m + i]
        markers.add_entries(tables, _find_block(tables, row), work.block_stiffness, stiff)
        markers.add_entries(tables, _find_block(tables, row), work.block_damping, damp)


@kernel_function
def fill_mass(tables, work, q, mass):
    """Fill mass with the entries of M(q): a constant part, and a part of modal links that depends on q."""
    copy(tables.mass, mass)
    block = work.block_stiffness  # used for masses here
    for row in range(tables.modal.shape[0]):
        markers.clear_block(tables, work, _find_block(tables, row))
        e, m = tables.modal[row, Modal.OFFSET] + 3, tables.modal[row, Modal.MODES]
        for i in range(m):
            inertia_factor, coupling = _compute_modal_mass(tables, row, q, i)
            block[2, 2] += inertia_factor * q[e + i]
            block[2, 3 + i] += coupling
            block[3 + i, 2] += coupling
        markers.add_entries(tables, _find_block(tables, row), block, mass)


@kernel_function
def fill_saddle(tables, work, q, jacobian, saddle):
    """Fill the saddle-point matrix [M G^T; G 0]."""
    fill_mass(tables, work, q, saddle)
    write_rows(tables, jacobian, saddle)


@kernel_function
def _compute_modal_mass(tables, row, q, i):
    """Return (2 radial + gram eta)_i, which times eta_i is inertia of the frame, and the coupling -(gyration eta)_i of mode i."""
    _, e, m, radial, gram, gyration, _ = _find_indices(tables, row)
    inertia_factor = 2.0 * tables.data[radial + i] + _multiply_matrix_row(tables, gram, i, m, q, e)
    return inertia_factor, -_multiply_matrix_row(tables, gyration, i, m, q, e)


@kernel_function
def couple_modes(tables, work, q, a):
    """Change M_0^-1 f to M(q)^-1 f in the accelerations a of all modal links, on none of which a constraint may act.

    M(q) differs from the constant M_0 in the frame's inertia, and couples the frame's angle with the modes, whose mass is 1. The
    angle's acceleration follows from the Schur complement of the modes: `moment` over `inertia`.
    """
    for row in range(tables.modal.shape[0]):
        o, e, m = tables.modal[row, Modal.OFFSET], tables.modal[row, Modal.OFFSET] + 3, tables.modal[row, Modal.MODES]
        _, width, entry = tables.blocks[_find_block(tables, row)]
        inertia = tables.mass[tables.slots[entry + 2 * width + 2]]  # entry (2, 2) of the block, of the frame's angle
        moment = inertia * a[o + 2]
        for i in range(m):
            inertia_factor, coupling = _compute_modal_mass(tables, row, q, i)
            moment -= coupling * a[e + i]
            inertia += inertia_factor * q[e + i] - coupling * coupling
            work.scratch[i] = coupling
        a[o + 2] = moment / inertia
        for i in range(m):
            a[e + i] -= work.scratch[i] * a[o + 2]


@kernel_function
def multiply_mass(tables, q, a, out):
    """Fill out with M(q) a."""
    for i in range(a.size):
        total = 0.0
        for k in range(tables.mass_first[i], tables.mass_first[i + 1]):
            total += tables.mass_value[k] * a[tables.mass_col[k]]
        out[i] = total
    for row in range(tables.modal.shape[0]):
        o, e, m = tables.modal[row, Modal.OFFSET], tables.modal[row, Modal.OFFSET] + 3, tables.modal[row, Modal.MODES]
        for i in range(m):
            inertia_factor, coupling = _compute_modal_mass(tables, row, q, i)
            out[o + 2] += inertia_factor * q[e + i] * a[o + 2] + coupling * a[e + i]
            out[e + i] += coupling * a[o + 2]


@kernel_function
def add_inertia_stiffness(tables, work, q, a, stiff):
    """Add d(M(q) a)/dq to stiff."""
    for row in range(tables.modal.shape[0]):
        o, e, m, radial, gram, gyration, _ = _find_indices(tables, row)
        markers.clear_block(tables, work, _find_block(tables, row))
        for i in range(m):
            half_slope = tables.data[radial + i] + _multiply_matrix_row(tables, gram, i, m, q, e)  # d(inertia)/d(eta_i)/2
            coupling_slope = _multiply_matrix_row(tables, gyration, i, m, a, e)  # d(-a^T gyration eta)/d(eta_i)
            for j in range(m):
                work.block_stiffness[3 + i, 3 + j] -= tables.data[gyration + i * m + j] * a[o + 2]
            work.block_stiffness[2, 3 + i] += 2.0 * half_slope * a[o + 2] + coupling_slope
        markers.add_entries(tables, _find_block(tables, row), work.block_stiffness, stiff)


@inline
def compute_forces(tables, work, now, f):
    """Place the markers, and fill f with all forces but those of constraints; inlined, as rattling runs call it most."""
    markers.place_markers(tables, work, now.q, now.v)
    gravity = tables.factors[-1]  # factor of gravity
    for i in range(f.size):
        f[i] = gravity * tables.weight[i]
    if tables.strips.shape[0] > 0:  # else a rigid mechanism would allocate their work arrays at each call
        add_strips(tables, work, now.q, now.v, f)
    if tables.modal.shape[0] > 0:  # else a call for nothing
        add_modal(tables, now.q, now.v, f)
    add_forces(tables, work, now, f)


@kernel_function
def compute_tangents(tables, work, now, saddle, damp, stiff):
    """Compute K and C (stiff, damp) of the last `compute_forces`; add -df/dlambda to `saddle`, [M G^T; G 0]."""
    stiff[:], damp[:] = 0.0, 0.0
    add_strips_tangents(tables, work, now.v, damp, stiff)
    add_modal_tangents(tables, work, now.q, now.v, damp, stiff)
    add_forces_tangents(tables, work, now, saddle, damp, stiff)
    _add_multiplier_stiffness(tables, work, now.q, now.lam, stiff)


@inline
def compute_rows(tables, work, t, residual, jacobian, speed):
    """Compute residuals g, entries of G and right sides of G v = speed of all constraints at time t."""
    grad = work.grad  # (6,): by (x, y, angle) of marker a, then of marker b
    for r in range(tables.rows.shape[0]):
        total = 0.0
        next_entry = tables.blocks[r, BlockColumn.FIRST]  # index of the next entry of G in `jacobian`
        first, motion, count = tables.rows[r, RowColumn.FIRST], tables.rows[r, RowColumn.MOTION], tables.rows[r, RowColumn.TERMS]
        travel, rate = evaluate_motion(tables, motion, t) if motion >= 0 else (0.0, 0.0)  # motion of a drive
        for k in range(first, first + count):
            value, _ = markers.compute_measure(tables, work, k, grad)
            factor = tables.measure_numbers[k, MeasureNumber.FACTOR]
            next_entry = markers.write_gradient(tables, work, k, grad, factor, jacobian, next_entry)
            total += factor * value
        residual[r], speed[r] = total - tables.values[r] - travel, rate  # `values`: the sum required if no drive moves it
        if count == 1 and tables.measures[first, Measures.KIND] == MeasureKind.ANGLE:
            residual[r] -= 2.0 * np.pi * np.round(residual[r] / (2.0 * np.pi))  # whole turns of a single angle do not count


@inline
def compute_changes(tables, work, t, side, change):
    """Compute the right sides of G a = change of all constraints at time t, on the `side` JUST_AFTER or JUST_BEFORE it."""
    for r in range(tables.rows.shape[0]):
        first, motion, grad = tables.rows[r, RowColumn.FIRST], tables.rows[r, RowColumn.MOTION], work.grad
        change[r] = evaluate_acceleration(tables, motion, t, side) if motion >= 0 else 0.0
        for k in range(first, first + tables.rows[r, RowColumn.TERMS]):
            markers.compute_measure(tables, work, k, grad)  # for its gradient; the bias is the part of d2g/dt2 without a
            change[r] -= tables.measure_numbers[k, MeasureNumber.FACTOR] * markers.compute_bias(tables, work, k, grad, work.hess)


@kernel_function
def multiply_row(tables, r, jacobian, v):
    """Multiply row r of G by v."""
    first, total = tables.blocks[r, BlockColumn.FIRST], 0.0
    for i in range(first, first + tables.blocks[r, BlockColumn.WIDTH] - 1):
        total += jacobian[i] * v[tables.block_unknowns[i]]
    return total


@kernel_function
def add_reactions(tables, jacobian, lam, out):
    """Add G^T lambda to out."""
    for r in range(tables.rows.shape[0]):
        first = tables.blocks[r, BlockColumn.FIRST]
        for i in range(first, first + tables.blocks[r, BlockColumn.WIDTH] - 1):
            out[tables.block_unknowns[i]] += jacobian[i] * lam[r]


@kernel_function
def write_rows(tables, jacobian, saddle):
    """Overwrite G and G^T in the saddle-point matrix [M G^T; G 0]."""
    for r in range(tables.rows.shape[0]):
        first, width, entry = tables.blocks[r]
        last = width - 1  # row and column of the multiplier
        for i in range(last):
            saddle[tables.slots[entry + i * width + last]] = 0.0
            saddle[tables.slots[entry + last * width + i]] = 0.0
        for i in range(last):  # markers of one body have coordinates in common: their entries add up
            saddle[tables.slots[entry + i * width + last]] += jacobian[first + i]
            saddle[tables.slots[entry + last * width + i]] += jacobian[first + i]


@kernel_function
def _add_multiplier_stiffness(tables, work, q, lam, stiff):
    """Add d(G^T lambda)/dq to stiff. Markers must be placed; `work.jacobian` (3, dofs) is that of one marker, not G."""
    grad, hess = work.grad, work.hess  # (6,), (6, 6): of a measure by (x, y, angle) of markers a and b
    for r in range(tables.rows.shape[0]):
        markers.clear_block(tables, work, r)
        at, first = 0, tables.rows[r, RowColumn.FIRST]  # at: row and column of the block at which a marker's coordinates begin
        for k in range(first, first + tables.rows[r, RowColumn.TERMS]):
            a, b = tables.measures[k, Measures.A], tables.measures[k, Measures.B]
            push = lam[r] * tables.measure_numbers[k, MeasureNumber.FACTOR]
            markers.compute_measure(tables, work, k, grad)
            if markers.is_curved(tables, k):
                markers.compute_hessian(tables, work, k, grad, hess)
                markers.add_pair(tables, work, (a, b, at), hess, push, work.jacobian, work.block_stiffness)
            markers.add_geometric(tables, work, a, q, (push * grad[0], push * grad[1], push * grad[2]), work.block_stiffness, at)
            at += tables.markers[a, Markers.COUNT]
            markers.add_geometric(tables, work, b, q, (push * grad[3], push * grad[4], push * grad[5]), work.block_stiffness, at)
            at += tables.markers[b, Markers.COUNT]
        markers.add_entries(tables, r, work.block_stiffness, stiff)
