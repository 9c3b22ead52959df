"""Strips, compiled: Reissner's and Kirchhoff's, in polynomials, with analytic tangents.

Both have four arguments z a Gauss point, linear in the coordinates: Reissner (x', y', theta, theta'), Kirchhoff (x', y', x'',
y'').
The strains are functions of z,

    Reissner:   eps = c x' + s y' - 1,   gamma = -s x' + c y',   kappa = theta'                    (c, s of theta)
    Kirchhoff:  eps = |r'| - 1,          kappa = (x' y'' - y' x'')/|r'|^2, the rate of turn of r' along the arc,

less their stress-free values; the energy is 1/2 integral of EA eps^2 + GA gamma^2 + EI kappa^2, and Kelvin-Voigt damping adds
its time times the strain's rate to eps and kappa.

References
----------
E. Reissner, On one-dimensional finite-strain beam theory: the plane problem, ZAMP 23 (1972) 795-804, doi 10.1007/BF01602645.
"""

from __future__ import annotations

import numpy as np

from buckler.mbs.spectral.compiling import inner
from buckler.mbs.spectral.tables import REISSNER


@inner
def strains(kind, z, e, ez, ezz, second):
    """Strains (eps, gamma, kappa) in e, their gradients by z in ez (3, 4), Hessians in ezz (3, 4, 4) if asked for."""
    if second:
        ezz[:] = 0.0
    if kind == REISSNER:
        c, s = np.cos(z[2]), np.sin(z[2])
        axial, shear = c * z[0] + s * z[1], -s * z[0] + c * z[1]
        e[0], e[1], e[2] = axial - 1.0, shear, z[3]
        ez[0, 0], ez[0, 1], ez[0, 2], ez[1, 0], ez[1, 1], ez[1, 2], ez[2, 3] = c, s, shear, -s, c, -axial, 1.0
        if second:
            ezz[0, 0, 2] = ezz[0, 2, 0] = -s
            ezz[0, 1, 2] = ezz[0, 2, 1] = c
            ezz[0, 2, 2], ezz[1, 2, 2] = -axial, -shear
            ezz[1, 0, 2] = ezz[1, 2, 0] = -c
            ezz[1, 1, 2] = ezz[1, 2, 1] = -s
        return
    x, y, xx, yy = z[0], z[1], z[2], z[3]
    p = 1.0 / (x * x + y * y)
    r, cross = np.sqrt(p), x * yy - y * xx
    k = cross * p
    e[0], e[1], e[2] = 1.0 / r - 1.0, 0.0, k
    ez[0, 0], ez[0, 1] = x * r, y * r
    ez[2, 0], ez[2, 1], ez[2, 2], ez[2, 3] = p * (yy - 2.0 * k * x), p * (-xx - 2.0 * k * y), -y * p, x * p
    if second:
        ezz[0, 0, 0], ezz[0, 1, 1] = r * y * y * p, r * x * x * p
        ezz[0, 0, 1] = ezz[0, 1, 0] = -r * x * y * p
        q = p * p
        ezz[2, 0, 0] = -4.0 * q * yy * x - 2.0 * k * p + 8.0 * k * q * x * x
        ezz[2, 1, 1] = 4.0 * q * xx * y - 2.0 * k * p + 8.0 * k * q * y * y
        ezz[2, 0, 1] = ezz[2, 1, 0] = 2.0 * q * (xx * x - yy * y) + 8.0 * k * q * x * y
        ezz[2, 0, 2] = ezz[2, 2, 0] = 2.0 * q * x * y
        ezz[2, 1, 2] = ezz[2, 2, 1] = p * (2.0 * p * y * y - 1.0)
        ezz[2, 0, 3] = ezz[2, 3, 0] = p * (1.0 - 2.0 * p * x * x)
        ezz[2, 1, 3] = ezz[2, 3, 1] = -2.0 * q * x * y


@inner
def add_strips(s, w, q, v, f, stiff, damp, want):
    """Add elastic and damping forces of all strips to f; if asked for, -df/dq to stiff and -df/dv to damp."""
    z, r, e = np.zeros(4), np.zeros(4), np.zeros(3)
    ez, ezz, h, b = np.zeros((3, 4)), np.zeros((3, 4, 4)), np.zeros((4, 4)), np.zeros((4, 4))
    fz, modulus, lag = np.zeros(4), np.zeros(3), np.zeros(3)
    block, order = np.zeros(4, np.int64), np.zeros(4, np.int64)
    for strip in range(s.strips.shape[0]):
        kind, nb, ng, first, d = s.strips[strip]
        modulus[:] = s.data[d : d + 3]
        lag[0], lag[2] = s.data[d + 4], s.data[d + 3]
        block[1], order[0], order[1] = nb, 1, 1
        if kind == REISSNER:
            size = 3 * nb
            block[2], block[3], order[2], order[3] = 2 * nb, 2 * nb, 0, 1
        else:
            size = 2 * nb
            block[2], block[3], order[2], order[3] = 0, nb, 2, 2
        at, member = s.places[first : first + size], d + 5 + 4 * ng
        local = w.element[:size]
        local[:] = 0.0
        ke = w.element[size : size + size * size].reshape(size, size)
        ce = w.element[size + size * size : size + 2 * size * size].reshape(size, size)
        if want:
            ke[:], ce[:] = 0.0, 0.0
        damped = lag[0] > 0.0 or lag[2] > 0.0
        for g in range(ng):
            for i in range(4):
                m, value, rate = member + (order[i] * ng + g) * nb, 0.0, 0.0
                for a in range(nb):
                    k = at[block[i] + a]
                    value, rate = value + s.data[m + a] * q[k], rate + s.data[m + a] * v[k]
                z[i], r[i] = value, rate
            strains(kind, z, e, ez, ezz, want)
            weight = s.data[d + 5 + g]
            fz[:] = 0.0
            if want:
                h[:], b[:] = 0.0, 0.0
            for j in range(3):
                rate = ez[j, 0] * r[0] + ez[j, 1] * r[1] + ez[j, 2] * r[2] + ez[j, 3] * r[3]
                stress = weight * modulus[j] * (e[j] - s.data[d + 5 + (1 + j) * ng + g] + lag[j] * rate)
                for i in range(4):
                    fz[i] += stress * ez[j, i]
                if want:
                    stiffness = weight * modulus[j]
                    for i in range(4):
                        for k in range(4):
                            h[i, k] += stiffness * ez[j, i] * ez[j, k] + stress * ezz[j, i, k]
                    if lag[j] > 0.0:
                        for k in range(4):
                            bend = ezz[j, k, 0] * r[0] + ezz[j, k, 1] * r[1] + ezz[j, k, 2] * r[2] + ezz[j, k, 3] * r[3]
                            for i in range(4):
                                h[i, k] += stiffness * lag[j] * ez[j, i] * bend
                                b[i, k] += stiffness * lag[j] * ez[j, i] * ez[j, k]
            for i in range(4):
                m = member + (order[i] * ng + g) * nb
                for a in range(nb):
                    local[block[i] + a] -= s.data[m + a] * fz[i]
            if want:
                _spread(s.data, member, order, block, ng, g, nb, h, ke)
                if damped:
                    _spread(s.data, member, order, block, ng, g, nb, b, ce)
        for a in range(size):
            f[at[a]] += local[a]
        if want:
            for a in range(size):
                for c in range(size):
                    stiff[at[a], at[c]] += ke[a, c]
            if damped:
                for a in range(size):
                    for c in range(size):
                        damp[at[a], at[c]] += ce[a, c]


@inner
def _spread(data, member, order, block, ng, g, nb, h, out):
    """Add sum_ik A_i^T h_ik A_k to out, A_i the members (or their derivatives) at point g."""
    for i in range(4):
        mi = member + (order[i] * ng + g) * nb
        for k in range(4):
            if h[i, k] == 0.0:
                continue
            mk = member + (order[k] * ng + g) * nb
            right = data[mk : mk + nb]
            for a in range(nb):
                factor, row = data[mi + a] * h[i, k], out[block[i] + a, block[k] : block[k] + nb]
                for c in range(nb):
                    row[c] += factor * right[c]
