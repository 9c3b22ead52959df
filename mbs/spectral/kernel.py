"""The equations of motion, compiled: M(q) a = f(q, v, t) - G^T lambda, g(q, t) = 0, with analytic tangents.

K = -df/dq + d(G^T lambda)/dq and C = -df/dv; the mass matrix is constant but for modal links.
"""

from __future__ import annotations

import numpy as np

from buckler.mbs.spectral.compiling import aside, close, copy, inner, jit
from buckler.mbs.spectral.forces import add_forces, bend_forces
from buckler.mbs.spectral.lawtable import AFTER, motion, second_rate
from buckler.mbs.spectral.markers import add_geometric, add_gradient, add_pair, bias_of, curve, measure, place_markers
from buckler.mbs.spectral.strips import add_strips, bend_strips
from buckler.mbs.spectral.tables import ANGLE, KIND


@inner
def add_modal(s, q, v, f):
    """Elastic, damping and gyroscopic forces of modal links (mean axes): see docs/theory-modal.md."""
    for row in range(s.modal.shape[0]):
        o, m, d = s.modal[row, 0], s.modal[row, 1], s.modal[row, 2]
        g, c = d + m, d + m + m * m
        k, r, spin, e = d + m + 2 * m * m, d + 2 * m + 2 * m * m, v[o + 2], o + 3
        for i in range(m):
            gram, swirl = s.data[d + i], 0.0
            for j in range(m):
                gram += s.data[g + i * m + j] * q[e + j]
                swirl += s.data[c + i * m + j] * v[e + j]
            f[o + 2] -= 2.0 * spin * gram * v[e + i]
            f[e + i] += spin * spin * gram + 2.0 * spin * swirl - s.data[k + i] * q[e + i] - s.data[r + i] * v[e + i]


@aside
def bend_modal(s, q, v, stiff, damp):
    """Derivatives of the forces of modal links."""
    for row in range(s.modal.shape[0]):
        o, m, d = s.modal[row, 0], s.modal[row, 1], s.modal[row, 2]
        g, c = d + m, d + m + m * m
        k, r, spin, e = d + m + 2 * m * m, d + 2 * m + 2 * m * m, v[o + 2], o + 3
        for i in range(m):
            gram, rate, swirl = s.data[d + i], 0.0, 0.0
            for j in range(m):
                gram += s.data[g + i * m + j] * q[e + j]
                rate += s.data[g + i * m + j] * v[e + j]
                swirl += s.data[c + i * m + j] * v[e + j]
                stiff[e + i, e + j] -= spin * spin * s.data[g + i * m + j]
                damp[e + i, e + j] -= 2.0 * spin * s.data[c + i * m + j]
            stiff[o + 2, e + i] += 2.0 * spin * rate
            damp[o + 2, o + 2] += 2.0 * gram * v[e + i]
            damp[o + 2, e + i] += 2.0 * spin * gram
            damp[e + i, o + 2] -= 2.0 * spin * gram + 2.0 * swirl
            stiff[e + i, e + i] += s.data[k + i]
            damp[e + i, e + i] += s.data[r + i]


@jit
def mass_matrix(s, q, mass):
    """Fill mass with M(q)."""
    copy(s.mass, mass)
    for row in range(s.modal.shape[0]):
        o, m, d = s.modal[row]
        for i in range(m):
            gram, swirl = 2.0 * s.data[d + i], 0.0
            for j in range(m):
                gram += s.data[d + m + i * m + j] * q[o + 3 + j]
                swirl -= s.data[d + m + m * m + i * m + j] * q[o + 3 + j]
            mass[o + 2, o + 2] += gram * q[o + 3 + i]
            mass[o + 2, o + 3 + i] += swirl
            mass[o + 3 + i, o + 2] += swirl


@jit
def add_mass_slope(s, q, a, stiff):
    """Add d(M(q) a)/dq to stiff."""
    for row in range(s.modal.shape[0]):
        o, m, d = s.modal[row]
        for i in range(m):
            gram, swirl = s.data[d + i], 0.0
            for j in range(m):
                gram += s.data[d + m + i * m + j] * q[o + 3 + j]
                cij = s.data[d + m + m * m + i * m + j]
                swirl += cij * a[o + 3 + j]
                stiff[o + 3 + i, o + 3 + j] -= cij * a[o + 2]
            stiff[o + 2, o + 3 + i] += 2.0 * gram * a[o + 2] + swirl


@jit
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


@jit
def tangents(s, w, t, q, v, lam, mem, since, stiff, damp, cross):
    """Of the forces that were filled in last: stiff = -df/dq, damp = -df/dv, cross[r] = df/dlambda_r."""
    stiff[:], damp[:], cross[:] = 0.0, 0.0, 0.0
    bend_strips(s, w, v, stiff, damp)
    if s.modal.shape[0] > 0:
        bend_modal(s, q, v, stiff, damp)
    bend_forces(s, w, t, q, lam, mem, since, stiff, damp, cross)


@close
def row_at(s, w, r, t, g, jacobian, speed):
    """Residual, row of the Jacobian and right side of G v = speed of constraint r. Markers are placed."""
    grad = w.small[6]
    k, drive = s.rows[r, 0], s.rows[r, 1]
    value, _ = measure(s, w, k, grad)
    travel, rate = 0.0, 0.0
    if drive >= 0:
        travel, rate = motion(s, drive, t)
    g[r], speed[r] = value - s.values[r] - travel, rate
    if s.measures[k, KIND] == ANGLE:
        g[r] -= 2.0 * np.pi * np.round(g[r] / (2.0 * np.pi))
    for i in range(jacobian.shape[1]):
        jacobian[r, i] = 0.0
    add_gradient(s, w, k, grad, 1.0, jacobian[r])


@close
def change_at(s, w, r, t, side, change):
    """Right side of G a = change of constraint r, whose gradient is at hand; `side`: see `second_rate`."""
    k, drive = s.rows[r, 0], s.rows[r, 1]
    change[r] = (second_rate(s, drive, t, side) if drive >= 0 else 0.0) - bias_of(s, w, k, w.small[6], w.small[:6])


@aside
def rows_at(s, w, t, g, jacobian, speed):
    """The same of all constraints."""
    for r in range(s.rows.shape[0]):
        row_at(s, w, r, t, g, jacobian, speed)


@aside
def changes_at(s, w, t, side, change):
    """Right sides of G a = change. Markers are placed."""
    for r in range(s.rows.shape[0]):
        measure(s, w, s.rows[r, 0], w.small[6])
        change_at(s, w, r, t, side, change)


@close
def constraint(s, w, r, t, g, jacobian, speed, change):
    """Residual, row of the Jacobian and right sides of constraint r; see `constraints`."""
    row_at(s, w, r, t, g, jacobian, speed)
    change_at(s, w, r, t, AFTER, change)


@jit
def constraints(s, w, t, g, jacobian, speed, change):
    """Residuals g, Jacobian G, and right sides of G v = speed, G a = change. Markers are placed."""
    for r in range(s.rows.shape[0]):
        constraint(s, w, r, t, g, jacobian, speed, change)


@jit
def add_multipliers(s, w, q, lam, stiff):
    """Add d(G^T lambda)/dq to stiff. Markers are placed."""
    grad, hess = w.small[6], w.small[:6]
    for r in range(s.rows.shape[0]):
        k = s.rows[r, 0]
        a, b = s.measures[k, 1], s.measures[k, 2]
        measure(s, w, k, grad)
        if curve(s, w, k, grad, hess):
            add_pair(s, w, a, b, hess, lam[r], stiff)
        add_geometric(s, w, a, q, lam[r] * grad[0], lam[r] * grad[1], lam[r] * grad[2], stiff)
        add_geometric(s, w, b, q, lam[r] * grad[3], lam[r] * grad[4], lam[r] * grad[5], stiff)


@jit
def invert_modal(s, q, inverse):
    """Renew the blocks of modal links in the inverse of the mass matrix, whose other blocks are constant.

    Modes couple with the frame's angle only: of [J, c^T; c, D] with D diagonal the inverse follows from J - c^T D^-1 c.
    """
    for row in range(s.modal.shape[0]):
        o, m, d = s.modal[row, 0], s.modal[row, 1], s.modal[row, 2]
        turn, e = o + 2, o + 3
        rest = s.mass[turn, turn]
        for i in range(m):
            gram, swirl = 2.0 * s.data[d + i], 0.0
            for j in range(m):
                gram += s.data[d + m + i * m + j] * q[e + j]
                swirl -= s.data[d + m + m * m + i * m + j] * q[e + j]
            share = swirl / s.mass[e + i, e + i]
            rest += gram * q[e + i] - swirl * share
            inverse[turn, e + i] = -share
        inverse[turn, turn] = 1.0 / rest
        for i in range(m):
            share = inverse[turn, e + i]
            for j in range(m):
                inverse[e + i, e + j] = share * inverse[turn, e + j] / rest if j != i else 0.0
            inverse[e + i, e + i] = 1.0 / s.mass[e + i, e + i] + share * share / rest
        for i in range(m):
            inverse[turn, e + i] /= rest
            inverse[e + i, turn] = inverse[turn, e + i]


@inner
def solve_small(a, b, n):
    """Solve a x = b in place by Gauss elimination with pivots, n unknowns; a pivot of rounding gives nothing."""
    least = 0.0
    for c in range(n):
        least = max(least, 1e-13 * abs(a[c, c]))
    for c in range(n):
        p = c
        for i in range(c + 1, n):
            if abs(a[i, c]) > abs(a[p, c]):
                p = i
        if p != c:
            for j in range(c, n):
                a[c, j], a[p, j] = a[p, j], a[c, j]
            b[c], b[p] = b[p], b[c]
        if abs(a[c, c]) <= least:
            continue
        for i in range(c + 1, n):
            factor = a[i, c] / a[c, c]
            if factor != 0.0:
                for j in range(c, n):
                    a[i, j] -= factor * a[c, j]
                b[i] -= factor * b[c]
    for c in range(n - 1, -1, -1):
        total = b[c]
        for j in range(c + 1, n):
            total -= a[c, j] * b[j]
        b[c] = total / a[c, c] if abs(a[c, c]) > least else 0.0


@inner
def spread_rows(jacobian, inverse, spread, schur):
    """Fill spread with G M^-1 and schur with G M^-1 G^T."""
    r, n = jacobian.shape
    for k in range(r):
        for i in range(n):
            spread[k, i] = 0.0
        for j in range(n):
            factor = jacobian[k, j]
            if factor != 0.0:
                row, weights = spread[k], inverse[j]
                for i in range(n):
                    row[i] += factor * weights[i]
    for k in range(r):
        for m in range(k + 1):
            total, row, other = 0.0, spread[k], jacobian[m]
            for i in range(n):
                total += row[i] * other[i]
            schur[k, m] = schur[m, k] = total
