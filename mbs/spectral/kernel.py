"""The equations of motion, compiled: M(q) a = f(q, v, t) - G^T lambda, g(q, t) = 0, with analytic tangents.

K = -df/dq + d(G^T lambda)/dq and C = -df/dv; the mass matrix is constant but for modal links.
"""

from __future__ import annotations

import numpy as np

from .compiling import aside, close, copy, inner
from .forces import add_forces, bend_forces
from .lawtable import AFTER, motion, second_rate
from .markers import (
    add_entries,
    add_geometric,
    add_pair,
    bias_of,
    clear_block,
    curve,
    measure,
    place_markers,
    put_gradient,
)  # fmt: skip
from .strips import add_strips, bend_strips
from .tables import ANGLE, COUNT, KIND, LEAD, MEMBERS, MOTION_OF, SHARE, TERMS, WIDTH, A, B


@close
def _numbers(s, row):
    """Of a modal link: its first coordinate, that of its modes, their number; where radial, gram, gyration, stiffness begin."""
    o, m, d = s.modal[row, 0], s.modal[row, 1], s.modal[row, 2]
    return o, o + 3, m, d, d + m, d + m + m * m, d + m + 2 * m * m


@close
def _block(s, row):
    """Number of a modal link's block."""
    return s.rows.shape[0] + s.forces.shape[0] + s.strips.shape[0] + row


@inner
def _times(s, at, i, m, x, first):
    """Row i of the (m, m) numbers at a place, times the amplitudes in x."""
    total = 0.0
    for j in range(m):
        total += s.data[at + i * m + j] * x[first + j]
    return total


@inner
def add_modal(s, q, v, f):
    """Elastic, damping and gyroscopic forces of modal links (mean axes): see docs/theory-modal.md."""
    for row in range(s.modal.shape[0]):
        o, e, m, radial, gram, gyration, stiffness = _numbers(s, row)
        spin = v[o + 2]
        for i in range(m):
            wide, swirl = s.data[radial + i] + _times(s, gram, i, m, q, e), _times(s, gyration, i, m, v, e)
            f[o + 2] -= 2.0 * spin * wide * v[e + i]
            f[e + i] += spin * spin * wide + 2.0 * spin * swirl
            f[e + i] -= s.data[stiffness + i] * q[e + i] + s.data[stiffness + m + i] * v[e + i]


@aside
def bend_modal(s, w, q, v, damp, stiff):
    """Derivatives of the forces of modal links."""
    for row in range(s.modal.shape[0]):
        o, e, m, radial, gram, gyration, stiffness = _numbers(s, row)
        spin = v[o + 2]
        clear_block(s, w, _block(s, row))
        for i in range(m):
            wide, swirl = s.data[radial + i] + _times(s, gram, i, m, q, e), _times(s, gyration, i, m, v, e)
            for j in range(m):
                w.stiff[3 + i, 3 + j] -= spin * spin * s.data[gram + i * m + j]
                w.damp[3 + i, 3 + j] -= 2.0 * spin * s.data[gyration + i * m + j]
            w.stiff[2, 3 + i] += 2.0 * spin * _times(s, gram, i, m, v, e)
            w.damp[2, 2] += 2.0 * wide * v[e + i]
            w.damp[2, 3 + i] += 2.0 * spin * wide
            w.damp[3 + i, 2] -= 2.0 * spin * wide + 2.0 * swirl
            w.stiff[3 + i, 3 + i] += s.data[stiffness + i]
            w.damp[3 + i, 3 + i] += s.data[stiffness + m + i]
        add_entries(s, _block(s, row), w.stiff, stiff)
        add_entries(s, _block(s, row), w.damp, damp)


@aside
def mass_matrix(s, w, q, mass):
    """Fill mass with M(q)."""
    copy(s.mass, mass)
    add_modal_mass(s, w, q, mass)


@inner
def renew_mass(s, w, q, jacobian, mass):
    """Write anew what changes of M(q), G and G^T."""
    for row in range(s.modal.shape[0]):
        _, m, slot = s.blocks[_block(s, row)]
        for k in range(slot, slot + m * m):
            mass[s.slots[k]] = s.mass[s.slots[k]]
    add_modal_mass(s, w, q, mass)
    for r in range(s.rows.shape[0]):
        _, m, slot = s.blocks[r]
        for i in range(m - 1):
            mass[s.slots[slot + i * m + m - 1]] = 0.0
            mass[s.slots[slot + (m - 1) * m + i]] = 0.0
    add_rows(s, jacobian, mass)


@inner
def add_modal_mass(s, w, q, mass):
    """Add the part of M(q) that depends on q."""
    for row in range(s.modal.shape[0]):
        clear_block(s, w, _block(s, row))
        e, m = s.modal[row, 0] + 3, s.modal[row, 1]
        for i in range(m):
            wide, swirl = _coupling(s, row, q, i)
            w.stiff[2, 2] += wide * q[e + i]
            w.stiff[2, 3 + i] += swirl
            w.stiff[3 + i, 2] += swirl
        add_entries(s, _block(s, row), w.stiff, mass)


@inner
def _coupling(s, row, q, i):
    """Of mode i of a modal link: what its amplitude adds to the inertia, and mass between it and the frame's angle."""
    _, e, m, radial, gram, gyration, _ = _numbers(s, row)
    return 2.0 * s.data[radial + i] + _times(s, gram, i, m, q, e), -_times(s, gyration, i, m, q, e)


@inner
def mass_times(s, q, a, out):
    """Fill out with M(q) a."""
    for i in range(a.size):
        total = 0.0
        for k in range(s.mass_first[i], s.mass_first[i + 1]):
            total += s.mass_value[k] * a[s.mass_col[k]]
        out[i] = total
    for row in range(s.modal.shape[0]):
        o, e, m = s.modal[row, 0], s.modal[row, 0] + 3, s.modal[row, 1]
        for i in range(m):
            wide, swirl = _coupling(s, row, q, i)
            out[o + 2] += wide * q[e + i] * a[o + 2] + swirl * a[e + i]
            out[e + i] += swirl * a[o + 2]


@aside
def add_mass_slope(s, w, q, a, stiff):
    """Add d(M(q) a)/dq to stiff."""
    for row in range(s.modal.shape[0]):
        o, e, m, radial, gram, gyration, _ = _numbers(s, row)
        clear_block(s, w, _block(s, row))
        for i in range(m):
            wide, swirl = s.data[radial + i] + _times(s, gram, i, m, q, e), _times(s, gyration, i, m, a, e)
            for j in range(m):
                w.stiff[3 + i, 3 + j] -= s.data[gyration + i * m + j] * a[o + 2]
            w.stiff[2, 3 + i] += 2.0 * wide * a[o + 2] + swirl
        add_entries(s, _block(s, row), w.stiff, stiff)


@aside
def forces(s, w, t, q, v, lam, mem, since, f):
    """Fill f with all forces but the constraints', and place the markers."""
    place_markers(s, w, q, v)
    gravity = s.factors[-1]
    for i in range(f.size):
        f[i] = gravity * s.weight[i]
    add_strips(s, w, q, v, f)
    if s.modal.shape[0] > 0:
        add_modal(s, q, v, f)
    add_forces(s, w, t, lam, mem, since, f)


@aside
def tangents(s, w, t, q, v, lam, mem, since, mass, damp, stiff):
    """Of the forces that were filled in last: stiff = -df/dq, damp = -df/dv, and add -df/dlambda to mass."""
    stiff[:], damp[:] = 0.0, 0.0
    bend_strips(s, w, v, damp, stiff)
    if s.modal.shape[0] > 0:
        bend_modal(s, w, q, v, damp, stiff)
    bend_forces(s, w, t, q, lam, mem, since, mass, damp, stiff)


@close
def row_at(s, w, r, t, g, jacobian, speed):
    """Residual, row of the Jacobian and right side of G v = speed of constraint r. Markers are placed."""
    grad, at, total = w.grad, s.blocks[r, MEMBERS], 0.0
    first, drive, count = s.rows[r, LEAD], s.rows[r, MOTION_OF], s.rows[r, TERMS]
    travel, rate = 0.0, 0.0
    if drive >= 0:
        travel, rate = motion(s, drive, t)
    for k in range(first, first + count):
        value, _ = measure(s, w, k, grad)
        total += s.directions[k, SHARE] * value
        at = put_gradient(s, w, k, grad, s.directions[k, SHARE], jacobian, at)
    g[r], speed[r] = total - s.values[r] - travel, rate
    if count == 1 and s.measures[first, KIND] == ANGLE:
        g[r] -= 2.0 * np.pi * np.round(g[r] / (2.0 * np.pi))


@close
def change_at(s, w, r, t, side, change):
    """Right side of G a = change of constraint r; `side`: see `second_rate`. Markers are placed."""
    first, drive, grad = s.rows[r, LEAD], s.rows[r, MOTION_OF], w.grad
    change[r] = second_rate(s, drive, t, side) if drive >= 0 else 0.0
    for k in range(first, first + s.rows[r, TERMS]):
        measure(s, w, k, grad)
        change[r] -= s.directions[k, SHARE] * bias_of(s, w, k, grad, w.hess)


@aside
def rows_at(s, w, t, g, jacobian, speed):
    """The same of all constraints."""
    for r in range(s.rows.shape[0]):
        row_at(s, w, r, t, g, jacobian, speed)


@aside
def changes_at(s, w, t, side, change):
    """Right sides of G a = change. Markers are placed."""
    for r in range(s.rows.shape[0]):
        change_at(s, w, r, t, side, change)


@close
def constraint(s, w, r, t, g, jacobian, speed, change):
    """Residual, row of the Jacobian and right sides of constraint r; see `constraints`."""
    row_at(s, w, r, t, g, jacobian, speed)
    change_at(s, w, r, t, AFTER, change)


@aside
def constraints(s, w, t, jacobian, g, speed, change):
    """Residuals g, Jacobian G, and right sides of G v = speed, G a = change. Markers are placed.

    G's entries stand as the blocks' members do: those of row r from `blocks[r, 0]` on, its own multiplier's, the last, without
    meaning.
    """
    for r in range(s.rows.shape[0]):
        constraint(s, w, r, t, g, jacobian, speed, change)


@inner
def row_times(s, r, jacobian, v):
    """Row r of G times v."""
    first, total = s.blocks[r, MEMBERS], 0.0
    for i in range(first, first + s.blocks[r, WIDTH] - 1):
        total += jacobian[i] * v[s.members[i]]
    return total


@inner
def add_reactions(s, jacobian, lam, out):
    """Add G^T lambda to out."""
    for r in range(s.rows.shape[0]):
        first, push = s.blocks[r, MEMBERS], lam[r]
        for i in range(first, first + s.blocks[r, WIDTH] - 1):
            out[s.members[i]] += jacobian[i] * push


@inner
def add_rows(s, jacobian, values):
    """Add G and G^T to the entries of a matrix."""
    for r in range(s.rows.shape[0]):
        first, m, slot = s.blocks[r]
        for i in range(m - 1):
            values[s.slots[slot + i * m + m - 1]] += jacobian[first + i]
            values[s.slots[slot + (m - 1) * m + i]] += jacobian[first + i]


@aside
def add_multipliers(s, w, q, lam, stiff):
    """Add d(G^T lambda)/dq to stiff. Markers are placed."""
    grad, hess = w.grad, w.hess
    for r in range(s.rows.shape[0]):
        clear_block(s, w, r)
        at = 0
        for k in range(s.rows[r, LEAD], s.rows[r, LEAD] + s.rows[r, TERMS]):
            a, b, push = s.measures[k, A], s.measures[k, B], lam[r] * s.directions[k, SHARE]
            measure(s, w, k, grad)
            if curve(s, w, k, grad, hess):
                add_pair(s, w, a, b, hess, push, w.slope, w.stiff, at)
            add_geometric(s, w, a, q, push * grad[0], push * grad[1], push * grad[2], w.stiff, at)
            at += s.markers[a, COUNT]
            add_geometric(s, w, b, q, push * grad[3], push * grad[4], push * grad[5], w.stiff, at)
            at += s.markers[b, COUNT]
        add_entries(s, r, w.stiff, stiff)
