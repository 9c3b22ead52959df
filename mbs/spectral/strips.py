"""Strips, compiled: Reissner's and Kirchhoff's, in polynomials, with analytic tangents.

At each Gauss point the strains eps, gamma, kappa are functions of four arguments z = A x, linear in the strip's coordinates x:
Reissner (x', y', theta, theta'), Kirchhoff (x', y', x'', y''). B = d strain/dz (3, 4) are the gradients of the strains;
stresses n = (N, Q, M) are axial force, shear force, moment, n = D (strains - free ones), D = diag(EA, GA, EI). In the mixed form
n are unknowns of Newton's method, and forces are -A^T (B^T n + B0^T residual), see (4) of docs/theory-spectral.md. The residual
is the n of the strains less the unknown n. B0, in work.kept_gradients, is the B at which Newton's matrices were last computed.

Local names: nb basis functions, ng Gauss points, g one of them, p its index among those of all strips; `lag`, damping times [s]
of N, Q, M. Dofs of a strip begin at index `first` of tables.dofs, its `StripData` at index d of tables.data. An argument is a sum
of nb functions: `block` has the index of its first coefficient among the strip's coordinates, `order` the derivative.
"""

import numpy as np

from .compiling import copy, inline, kernel_function
from .markers import add_entries, clear_block
from .tables import StripData, StripKind

PLAIN = 0.0
"""Value of work.strip_form, an array of floats as all of `Work`: stresses from the strains."""
MIXED = 1.0
"""Form with stresses as unknowns."""
RENEWED = 2.0
"""Form with stresses as unknowns, in which B0 is set to the gradients at this state: for new Newton matrices."""


@kernel_function
def _compute_strains(kind, z0, z1, z2, z3, gradients):
    """Return the strains at arguments z and write B to `gradients`, whose other entries are zero."""
    if kind == StripKind.REISSNER:
        c, s = np.cos(z2), np.sin(z2)
        axial, shear = c * z0 + s * z1, -s * z0 + c * z1
        gradients[0, 0], gradients[0, 1], gradients[0, 2] = c, s, shear
        gradients[1, 0], gradients[1, 1], gradients[1, 2], gradients[2, 3] = -s, c, -axial, 1.0
        return axial - 1.0, shear, z3
    w = 1.0 / (z0 * z0 + z1 * z1)  # 1/|r'|^2
    inverse_stretch, kappa = np.sqrt(w), (z0 * z3 - z1 * z2) * w
    gradients[0, 0], gradients[0, 1] = z0 * inverse_stretch, z1 * inverse_stretch
    gradients[2, 0], gradients[2, 1] = w * (z3 - 2.0 * kappa * z0), w * (-z2 - 2.0 * kappa * z1)
    gradients[2, 2], gradients[2, 3] = -z1 * w, z0 * w
    return 1.0 / inverse_stretch - 1.0, 0.0, kappa


@kernel_function
def _differentiate_gradients(kind, dx, dy, ddx, ddy, gradients, second):
    """Fill `second` (3, 4, 4) with second derivatives of the strains by z: Reissner's from B, Kirchhoff's from z."""
    second[:] = 0.0
    if kind == StripKind.REISSNER:
        c, s, shear, axial = gradients[0, 0], gradients[0, 1], gradients[0, 2], -gradients[1, 2]
        second[0, 0, 2] = second[0, 2, 0] = -s
        second[0, 1, 2] = second[0, 2, 1] = c
        second[0, 2, 2], second[1, 2, 2] = -axial, -shear
        second[1, 0, 2] = second[1, 2, 0] = -c
        second[1, 1, 2] = second[1, 2, 1] = -s
        return
    # strains |r'| - 1, 0, kappa = (dx ddy - dy ddx)/|r'|^2
    w = 1.0 / (dx * dx + dy * dy)  # 1/|r'|^2
    inverse_stretch, kappa, ww = np.sqrt(w), (dx * ddy - dy * ddx) * w, w * w
    second[0, 0, 0], second[0, 1, 1] = inverse_stretch * dy * dy * w, inverse_stretch * dx * dx * w
    second[0, 0, 1] = second[0, 1, 0] = -inverse_stretch * dx * dy * w
    second[2, 0, 0] = -4.0 * ww * ddy * dx - 2.0 * kappa * w + 8.0 * kappa * ww * dx * dx
    second[2, 1, 1] = 4.0 * ww * ddx * dy - 2.0 * kappa * w + 8.0 * kappa * ww * dy * dy
    second[2, 0, 1] = second[2, 1, 0] = 2.0 * ww * (ddx * dx - ddy * dy) + 8.0 * kappa * ww * dx * dy
    second[2, 0, 2] = second[2, 2, 0] = 2.0 * ww * dx * dy
    second[2, 1, 2] = second[2, 2, 1] = w * (2.0 * w * dy * dy - 1.0)
    second[2, 0, 3] = second[2, 3, 0] = w * (1.0 - 2.0 * w * dx * dx)
    second[2, 1, 3] = second[2, 3, 1] = -2.0 * ww * dx * dy


@kernel_function
def _index_fields(kind, count):
    """Return the number of a strip's coordinates, and `block` and `order` of its arguments, for `count` basis functions."""
    if kind == StripKind.REISSNER:
        return 3 * count, (0, count, 2 * count, 2 * count), (1, 1, 0, 1)
    return 2 * count, (0, count, 0, count), (1, 1, 2, 2)


@kernel_function
def _sum(data, m, x, first, count):
    """Sum `count` values of basis functions, from data[m] on, times their coefficients, from x[first] on."""
    total = 0.0
    for a in range(count):
        total += data[m + a] * x[first + a]
    return total


@inline
def _index_functions(order, functions, nb, ng, g):
    """Return, for each argument, the index in `data` of the first of its nb functions at point g.

    Three tables (ng, nb) follow each other from index `functions` on, of derivatives of order 0, 1 and 2.
    """
    return (
        functions + (order[0] * ng + g) * nb, functions + (order[1] * ng + g) * nb,
        functions + (order[2] * ng + g) * nb, functions + (order[3] * ng + g) * nb,
    )  # fmt: skip


@inline
def _compute_arguments(data, m, x, block, count):
    """Compute the four arguments z = A x at a Gauss point."""
    return (
        _sum(data, m[0], x, block[0], count), _sum(data, m[1], x, block[1], count),
        _sum(data, m[2], x, block[2], count), _sum(data, m[3], x, block[3], count),
    )  # fmt: skip


@inline
def _compute_stresses(data, d, free, strain, b, rate, lag):
    """Compute the stresses n = D (strain - free + lag B rate), with `rate` that of z; lag[1] = 0, as shear is undamped."""
    e0, e1, e2 = strain[0] - free[0], strain[1] - free[1], strain[2] - free[2]
    if lag[0] > 0.0 or lag[2] > 0.0:
        e0 += lag[0] * (b[0, 0] * rate[0] + b[0, 1] * rate[1] + b[0, 2] * rate[2])
        e2 += lag[2] * (b[2, 0] * rate[0] + b[2, 1] * rate[1] + b[2, 2] * rate[2] + b[2, 3] * rate[3])
    return data[d + StripData.EA] * e0, data[d + StripData.GA] * e1, data[d + StripData.EI] * e2


@inline
def _replace_stresses(work, p, gradients, n):
    """Return the unknown stresses and B0^T residual, the residual being the stresses n of the strains less the unknown ones."""
    if work.strip_form[0] == RENEWED:
        copy(gradients, work.kept_gradients[p])
    unknown, b0, residual = work.stress[p], work.kept_gradients[p], work.stress_residual[p]
    for j in range(3):
        residual[j] = n[j] - unknown[j]
    return (unknown[0], unknown[1], unknown[2]), (
        residual[0] * b0[0, 0] + residual[1] * b0[1, 0] + residual[2] * b0[2, 0],
        residual[0] * b0[0, 1] + residual[1] * b0[1, 1] + residual[2] * b0[2, 1],
        residual[0] * b0[0, 2] + residual[1] * b0[1, 2] + residual[2] * b0[2, 2],
        residual[2] * b0[2, 3],  # B[0, 3] = B[1, 3] = 0: only the curvature depends on z3
    )


@kernel_function
def _add_strip(tables, work, strip, q, v, gradients, out):
    """Add the forces of a strip, -A^T weight (B^T n + B0^T residual) at each Gauss point; PLAIN has no residual."""
    kind, nb, ng, first, d, first_point = tables.strips[strip]
    size, block, order = _index_fields(kind, nb)
    dofs = tables.dofs[first : first + size]
    x, rate, local = work.scratch[:size], work.scratch[size : 2 * size], work.scratch[2 * size : 3 * size]
    for a in range(size):
        x[a], rate[a], local[a] = q[dofs[a]], v[dofs[a]], 0.0
    lag = tables.data[d + StripData.AXIAL_TIME], 0.0, tables.data[d + StripData.BENDING_TIME]
    weights = d + StripData.WEIGHTS  # ng weights, 3 ng stress-free strains, then the functions
    free_strains, functions = weights + ng, weights + 4 * ng
    z_rate = 0.0, 0.0, 0.0, 0.0
    gradients[:] = 0.0
    for g in range(ng):
        p, weight = first_point + g, tables.data[weights + g]
        m = _index_functions(order, functions, nb, ng, g)
        z = _compute_arguments(tables.data, m, x, block, nb)
        strain = _compute_strains(kind, z[0], z[1], z[2], z[3], gradients)
        f = free_strains + g  # index of the first of the three stress-free strains, which are ng apart
        free = tables.data[f], tables.data[f + ng], tables.data[f + 2 * ng]
        # damping needs the rates of all arguments; or of z3 alone, if only Reissner's curvature, which is z3, is damped
        if lag[0] > 0.0 or (lag[2] > 0.0 and kind != StripKind.REISSNER):
            z_rate = _compute_arguments(tables.data, m, rate, block, nb)
        elif lag[2] > 0.0:
            z_rate = (0.0, 0.0, 0.0, _sum(tables.data, m[3], rate, block[3], nb))
        n = _compute_stresses(tables.data, d, free, strain, gradients, z_rate, lag)
        f0 = 0.0, 0.0, 0.0, 0.0
        if work.strip_form[0] != PLAIN:
            n, f0 = _replace_stresses(work, p, gradients, n)
        force = (
            weight * (f0[0] + n[0] * gradients[0, 0] + n[1] * gradients[1, 0] + n[2] * gradients[2, 0]),
            weight * (f0[1] + n[0] * gradients[0, 1] + n[1] * gradients[1, 1] + n[2] * gradients[2, 1]),
            weight * (f0[2] + n[0] * gradients[0, 2] + n[1] * gradients[1, 2] + n[2] * gradients[2, 2]),
            weight * (f0[3] + n[2] * gradients[2, 3]),
        )
        for i in range(4):  # local -= A^T force
            for a in range(nb):
                local[block[i] + a] -= tables.data[m[i] + a] * force[i]
        work.strain_arguments[p, 0], work.strain_arguments[p, 1], work.strain_arguments[p, 2], work.strain_arguments[p, 3] = z
        for j in range(3):
            work.weighted_stress[p, j] = weight * n[j]
    for a in range(size):
        out[dofs[a]] += local[a]


@kernel_function
def add_strips(tables, work, q, v, f):
    """Add elastic and damping forces of all strips to f."""
    gradients = np.zeros((3, 4))
    for strip in range(tables.strips.shape[0]):
        _add_strip(tables, work, strip, q, v, gradients, f)


@kernel_function
def add_strips_tangents(tables, work, v, damp, stiff):
    """Add -df/dq to stiff and -df/dv to damp of the strips' forces that were added last, PLAIN or RENEWED.

    In the form RENEWED the increments of the stresses are eliminated from Newton's equations. B0 has just been set to B, so both
    forms have the same tangents. They contain the change dB z_t of the damped rates B z_t, which `advance_stresses` neglects: the
    next residual of the stresses includes it.
    """
    for strip in range(tables.strips.shape[0]):
        _add_strip_tangents(tables, work, strip, v, damp, stiff)


@kernel_function
def _add_strip_tangents(tables, work, strip, v, damp, stiff):
    """Add a strip's tangents, sums of A^T H A over the Gauss points; its forces left what they need in `work`."""
    kind, nb, ng, first, d, first_point = tables.strips[strip]
    size, block, order = _index_fields(kind, nb)
    gradients, second = np.zeros((3, 4)), np.zeros((3, 4, 4))
    by_z, by_rate = np.zeros((4, 4)), np.zeros((4, 4))  # H of the stiffness and of the damping
    z_rate, lag = np.zeros(4), np.zeros(3)
    lag[0], lag[2] = tables.data[d + StripData.AXIAL_TIME], tables.data[d + StripData.BENDING_TIME]
    is_damped = lag[0] > 0.0 or lag[2] > 0.0
    weights, functions = d + StripData.WEIGHTS, d + StripData.WEIGHTS + 4 * ng
    rate = work.scratch[size : 2 * size]
    for a in range(size):
        rate[a] = v[tables.dofs[first + a]]
    matrix_block = tables.rows.shape[0] + tables.forces.shape[0] + strip  # blocks of strips follow those of rows and forces
    clear_block(tables, work, matrix_block)
    for g in range(ng):
        p, m = first_point + g, _index_functions(order, functions, nb, ng, g)
        z = work.strain_arguments[p]
        _compute_strains(kind, z[0], z[1], z[2], z[3], gradients)
        _differentiate_gradients(kind, z[0], z[1], z[2], z[3], gradients, second)
        by_z[:], by_rate[:] = 0.0, 0.0
        if is_damped:
            for i in range(4):
                z_rate[i] = _sum(tables.data, m[i], rate, block[i], nb)
        for j in range(3):
            stress = work.weighted_stress[p, j]
            stiffness = tables.data[weights + g] * tables.data[d + StripData.EA + j]  # EA, GA, EI
            for i in range(4):
                for k in range(4):
                    by_z[i, k] += stiffness * gradients[j, i] * gradients[j, k] + stress * second[j, i, k]
            if lag[j] > 0.0:  # the rates B z_t of the strains change by B dz_t + dB z_t
                for k in range(4):
                    row = second[j, k]
                    second_rate = row[0] * z_rate[0] + row[1] * z_rate[1] + row[2] * z_rate[2] + row[3] * z_rate[3]
                    for i in range(4):
                        by_z[i, k] += stiffness * lag[j] * gradients[j, i] * second_rate
                        by_rate[i, k] += stiffness * lag[j] * gradients[j, i] * gradients[j, k]
        _add_products(tables.data, m, block, nb, by_z, work.block_stiffness)
        if is_damped:
            _add_products(tables.data, m, block, nb, by_rate, work.block_damping)
    add_entries(tables, matrix_block, work.block_stiffness, stiff)
    if is_damped:
        add_entries(tables, matrix_block, work.block_damping, damp)


@kernel_function
def _add_products(data, m, block, count, h, out):
    """Add sum_ik A_i^T h_ik A_k to `out`, A_i the row of A of argument i, whose nonzeros begin at data[m[i]]."""
    for i in range(4):
        for k in range(4):
            if h[i, k] == 0.0:
                continue
            right = data[m[k] : m[k] + count]
            for a in range(count):
                factor, row = data[m[i] + a] * h[i, k], out[block[i] + a, block[k] : block[k] + count]
                for c in range(count):
                    row[c] += factor * right[c]


@kernel_function
def advance_stresses(tables, work, shift, rate_shift, stress, residual):
    """Add residual + D B0 (dz + lag dz_t) to the stresses; dz = A dq, dz_t = A dv, dq is `shift` and dv is `rate_shift`."""
    for strip in range(tables.strips.shape[0]):
        kind, nb, ng, first, d, first_point = tables.strips[strip]
        size, block, order = _index_fields(kind, nb)
        axial_time, bending_time = tables.data[d + StripData.AXIAL_TIME], tables.data[d + StripData.BENDING_TIME]
        dofs, functions = tables.dofs[first : first + size], d + StripData.WEIGHTS + 4 * ng
        x, axial, bending = work.scratch[:size], work.scratch[size : 2 * size], work.scratch[2 * size : 3 * size]
        for a in range(size):
            x[a], rate = shift[dofs[a]], rate_shift[dofs[a]]
            axial[a], bending[a] = x[a] + axial_time * rate, x[a] + bending_time * rate  # dq + lag dv, for N and for M
        for g in range(ng):
            p, m = first_point + g, _index_functions(order, functions, nb, ng, g)
            b0 = work.kept_gradients[p]
            for i in range(4):
                # dz + lag dz_t for N, Q, M: Q has no lag; a sum that would be multiplied by 0 is not computed
                for_n = for_q = for_m = _sum(tables.data, m[i], x, block[i], nb)
                if axial_time > 0.0 and b0[0, i] != 0.0:
                    for_n = _sum(tables.data, m[i], axial, block[i], nb)
                if bending_time > 0.0 and b0[2, i] != 0.0:
                    for_m = _sum(tables.data, m[i], bending, block[i], nb)
                stress[p, 0] += tables.data[d + StripData.EA] * b0[0, i] * for_n
                stress[p, 1] += tables.data[d + StripData.GA] * b0[1, i] * for_q
                stress[p, 2] += tables.data[d + StripData.EI] * b0[2, i] * for_m
            for j in range(3):
                stress[p, j] += residual[p, j]


@kernel_function
def compute_stresses(tables, work, q, v, stress):
    """Fill `stress` (points, 3) with the stresses of the strains. The form must be MIXED; work.stress is zero afterwards."""
    unused_force = np.zeros(q.size)
    work.stress[:] = 0.0  # so that the residual is the stresses of the strains
    add_strips(tables, work, q, v, unused_force)
    copy(work.stress_residual, stress)
