"""Markers (points with an angle) and measures (lengths and angles between two markers), compiled, with two derivatives.

work.jacobian has J, the derivatives of x, y and angle of all markers by their coordinates, with a column for each entry of
`Tables.dofs`: one marker after the other. Those of one marker begin in column `first`. work.jacobian_rate has J' = dJ/dt.
`allocate_work` wrote their constant entries. A bias is a second time derivative at zero second rates of the coordinates. The
columns AX, AY, SPIN_BIAS of a marker's state are the biases of x, y and angle.

Where markers are placed, m is a marker, p its state, d the index of its first number in tables.data. There j and dj are J and J',
c and sn cosine and sine. `tables` defines the kinds of markers and measures, and the blocks of which matrices are sums.
"""

import numpy as np

from .compiling import inline, kernel_function
from .tables import BlockColumn, MarkerKind, Markers, MeasureKind, MeasureNumber, Measures, State


@inline
def _place_frame(tables, work, m, q, v):
    """Compute a point of a body with a frame: r = R + A(theta)(l + sum phi_k eta_k), its rates and derivatives.

    (lx, ly) is the point in the frame, (rx, ry) its rate there, `turn` the rate of its angle in the frame; (px, py, pa) a mode
    shape phi_k. Along global axes (ax, ay) is r - R, (ux, uy) the velocity of the point relative to the frame.
    """
    size, first, d = tables.markers[m, Markers.SIZE], tables.markers[m, Markers.FIRST], tables.markers[m, Markers.DATA]
    o = tables.dofs[first]  # x of the frame; its y, its angle theta and the modes follow
    lx, ly, angle = tables.data[d], tables.data[d + 1], q[o + 2] + tables.data[d + 2]
    rx = ry = turn = 0.0
    for k in range(size):  # x, y, angle of each mode follow
        px, py, pa = tables.data[d + 3 + 3 * k], tables.data[d + 4 + 3 * k], tables.data[d + 5 + 3 * k]
        eta, rate = q[o + 3 + k], v[o + 3 + k]
        lx, ly, angle = lx + px * eta, ly + py * eta, angle + pa * eta
        rx, ry, turn = rx + px * rate, ry + py * rate, turn + pa * rate
    p, j, dj, spin = work.state[m], work.jacobian, work.jacobian_rate, v[o + 2]
    twin = tables.markers[m, Markers.TWIN]  # marker of the same frame, placed before this one; -1 for none
    if twin >= 0:
        p[State.COS], p[State.SIN] = work.state[twin, State.COS], work.state[twin, State.SIN]
    else:
        p[State.COS], p[State.SIN] = np.cos(q[o + 2]), np.sin(q[o + 2])
    c, sn = p[State.COS], p[State.SIN]
    ax, ay = c * lx - sn * ly, sn * lx + c * ly
    ux, uy = c * rx - sn * ry, sn * rx + c * ry
    p[State.X], p[State.Y], p[State.ANGLE] = q[o] + ax, q[o + 1] + ay, angle
    p[State.VX], p[State.VY], p[State.SPIN] = v[o] - spin * ay + ux, v[o + 1] + spin * ax + uy, spin + turn
    p[State.AX], p[State.AY] = -spin * spin * ax - 2.0 * spin * uy, -spin * spin * ay + 2.0 * spin * ux  # SPIN_BIAS stays 0
    j[0, first + 2], j[1, first + 2] = -ay, ax
    dj[0, first + 2], dj[1, first + 2] = -spin * ax - uy, -spin * ay + ux
    for k in range(size):
        px, py, i = tables.data[d + 3 + 3 * k], tables.data[d + 4 + 3 * k], first + 3 + k
        j[0, i], j[1, i], j[2, i] = c * px - sn * py, sn * px + c * py, tables.data[d + 5 + 3 * k]
        dj[0, i], dj[1, i] = -spin * j[1, i], spin * j[0, i]


@inline
def _place_linear(tables, work, m, q, v):
    """Compute x = sum N_i x_i, y and angle likewise, and their rates; their derivatives are constant."""
    size, first, d = tables.markers[m, Markers.SIZE], tables.markers[m, Markers.FIRST], tables.markers[m, Markers.DATA]
    for row in range(3):  # columns X, Y, ANGLE of the state, then VX, VY, SPIN
        value, rate = 0.0, 0.0
        for i in range(size):
            k, n = tables.dofs[first + row * size + i], tables.data[d + row * size + i]
            value, rate = value + n * q[k], rate + n * v[k]
        work.state[m, row], work.state[m, State.VX + row] = value, rate


@inline
def _place_curve(tables, work, m, q, v):
    """Compute x = sum N_i x_i, y likewise, and the angle of the tangent (x', y'), which goes on from its last value."""
    size, first, d = tables.markers[m, Markers.SIZE], tables.markers[m, Markers.FIRST], tables.markers[m, Markers.DATA]
    p, j, dj = work.state[m], work.jacobian, work.jacobian_rate
    x = y = vx = vy = tx = ty = rx = ry = 0.0  # (tx, ty): tangent, (rx, ry): its rate
    for i in range(size):
        x_dof, y_dof = tables.dofs[first + i], tables.dofs[first + size + i]
        n, dn = tables.data[d + i], tables.data[d + size + i]  # basis and its derivative
        x, y, vx, vy = x + n * q[x_dof], y + n * q[y_dof], vx + n * v[x_dof], vy + n * v[y_dof]
        tx, ty, rx, ry = tx + dn * q[x_dof], ty + dn * q[y_dof], rx + dn * v[x_dof], ry + dn * v[y_dof]
    square = tx * tx + ty * ty
    p[State.X], p[State.Y], p[State.VX], p[State.VY] = x, y, vx, vy
    angle = np.arctan2(ty, tx)
    p[State.ANGLE] = angle + 2.0 * np.pi * np.floor((p[State.ANGLE] - angle) / (2.0 * np.pi) + 0.5)  # whole turns as before
    p[State.SPIN] = (tx * ry - ty * rx) / square
    hxx, hxy = 2.0 * tx * ty / square**2, (ty * ty - tx * tx) / square**2  # second derivatives of the angle; hyy = -hxx
    p[State.SPIN_BIAS] = hxx * (rx * rx - ry * ry) + 2.0 * hxy * rx * ry
    for i in range(size):
        n, dn = tables.data[d + i], tables.data[d + size + i]
        j[0, first + i], j[1, first + size + i] = n, n
        j[2, first + i], j[2, first + size + i] = -ty / square * dn, tx / square * dn
        dj[2, first + i], dj[2, first + size + i] = (hxx * rx + hxy * ry) * dn, (hxy * rx - hxx * ry) * dn


@kernel_function
def place_markers(tables, work, q, v):
    """Compute the states of all markers at coordinates q and rates v, with J and J'; those of the ground are constant."""
    for m in range(tables.markers.shape[0]):
        kind = tables.markers[m, Markers.KIND]
        if kind == MarkerKind.FRAME:
            _place_frame(tables, work, m, q, v)
        elif kind == MarkerKind.LINEAR:
            _place_linear(tables, work, m, q, v)
        elif kind == MarkerKind.CURVE:
            _place_curve(tables, work, m, q, v)


@inline
def add_force(tables, work, m, push_x, push_y, torque, out):
    """Add the generalised force of a force (x, y) and a torque at marker m."""
    first = tables.markers[m, Markers.FIRST]
    for i in range(first, first + tables.markers[m, Markers.COUNT]):
        out[tables.dofs[i]] += push_x * work.jacobian[0, i] + push_y * work.jacobian[1, i] + torque * work.jacobian[2, i]


@kernel_function
def add_geometric(tables, work, m, q, push, out, start):
    """Add the Hessian of push . (x, y, angle) of marker m by its coordinates to `out`, from row and column `start` on."""
    fx, fy, torque = push
    kind, first, size = tables.markers[m, Markers.KIND], tables.markers[m, Markers.FIRST], tables.markers[m, Markers.SIZE]
    d = tables.markers[m, Markers.DATA]
    if kind == MarkerKind.FRAME:
        turn = start + 2  # row and column of the frame's angle: derivatives (dx, dy) of the point turn with it, by (-dy, dx)
        out[turn, turn] += -fx * work.jacobian[1, first + 2] + fy * work.jacobian[0, first + 2]
        for k in range(size):
            i = first + 3 + k
            h = -fx * work.jacobian[1, i] + fy * work.jacobian[0, i]
            out[turn, turn + 1 + k] += h
            out[turn + 1 + k, turn] += h
    elif kind == MarkerKind.CURVE and torque != 0.0:  # only its angle is not linear in the coordinates
        tx, ty = 0.0, 0.0  # tangent
        for i in range(size):
            dn = tables.data[d + size + i]
            tx, ty = tx + dn * q[tables.dofs[first + i]], ty + dn * q[tables.dofs[first + size + i]]
        square = tx * tx + ty * ty
        hxx, hxy = torque * 2.0 * tx * ty / square**2, torque * (ty * ty - tx * tx) / square**2
        for i in range(size):
            for k in range(size):
                dd = tables.data[d + size + i] * tables.data[d + size + k]
                out[start + i, start + k] += hxx * dd
                out[start + i, start + size + k] += hxy * dd
                out[start + size + i, start + k] += hxy * dd
                out[start + size + i, start + size + k] -= hxx * dd


@inline
def compute_measure(tables, work, k, grad):
    """Return measure k and its rate; fill its gradient by (x, y, angle) of markers a and b, shape (6,)."""
    kind, a, b = tables.measures[k, Measures.KIND], tables.measures[k, Measures.A], tables.measures[k, Measures.B]
    pa, pb = work.state[a], work.state[b]
    if kind == MeasureKind.ANGLE:
        grad[:] = 0.0
        grad[2], grad[5] = 1.0, -1.0
        return pa[State.ANGLE] - pb[State.ANGLE], pa[State.SPIN] - pb[State.SPIN]
    ex, ey = pa[State.X] - pb[State.X], pa[State.Y] - pb[State.Y]
    dx, dy = tables.measure_numbers[k, MeasureNumber.X], tables.measure_numbers[k, MeasureNumber.Y]
    grad[2], grad[5] = 0.0, 0.0
    if kind == MeasureKind.DISTANCE:  # the direction is that from b to a
        length = max(np.sqrt(ex * ex + ey * ey), 1e-300)  # 1e-300: points that coincide have a gradient of 0
        dx, dy = ex / length, ey / length
    elif kind == MeasureKind.TURNING:  # (dx, dy) are components in the axes of b; for FIXED, the last kind, in global axes
        c, sn = np.cos(pb[State.ANGLE]), np.sin(pb[State.ANGLE])
        dx, dy = c * dx - sn * dy, sn * dx + c * dy
        grad[5] = dx * ey - dy * ex
    grad[0], grad[1], grad[3], grad[4] = dx, dy, -dx, -dy
    return dx * ex + dy * ey, dx * (pa[State.VX] - pb[State.VX]) + dy * (pa[State.VY] - pb[State.VY]) + grad[5] * pb[State.SPIN]


@inline
def is_curved(tables, k):
    """Return True if measure k is not linear in (x, y, angle) of its markers."""
    kind = tables.measures[k, Measures.KIND]
    return kind == MeasureKind.DISTANCE or kind == MeasureKind.TURNING


@kernel_function
def compute_hessian(tables, work, k, grad, hess):
    """Fill the Hessian (6, 6) of measure k by (x, y, angle) of a, then b, from its gradient; not finite at a distance of 0."""
    kind, pa = tables.measures[k, Measures.KIND], work.state[tables.measures[k, Measures.A]]
    pb, dx, dy = work.state[tables.measures[k, Measures.B]], grad[0], grad[1]
    hess[:] = 0.0
    value = dx * (pa[State.X] - pb[State.X]) + dy * (pa[State.Y] - pb[State.Y])  # the measure, d . (a - b)
    if kind == MeasureKind.DISTANCE:
        hxx, hxy, hyy = dy * dy / value, -dx * dy / value, dx * dx / value
        for a in range(0, 6, 3):
            for b in range(0, 6, 3):
                sign = 1.0 if a == b else -1.0
                hess[a, b], hess[a, b + 1] = sign * hxx, sign * hxy
                hess[a + 1, b], hess[a + 1, b + 1] = sign * hxy, sign * hyy
    elif kind == MeasureKind.TURNING:
        hess[0, 5], hess[1, 5], hess[3, 5], hess[4, 5], hess[5, 5] = -dy, dx, dy, -dx, -value
        hess[5, 0], hess[5, 1], hess[5, 3], hess[5, 4] = -dy, dx, dy, -dx


@inline
def write_gradient(tables, work, k, grad, factor, out, index):
    """Write `factor` times the gradient of measure k by the coordinates of a, then b, to `out`; return the index after it."""
    for side in range(2):
        m = tables.measures[k, Measures.A + side]
        by_x, by_y, by_angle = factor * grad[3 * side], factor * grad[3 * side + 1], factor * grad[3 * side + 2]
        first = tables.markers[m, Markers.FIRST]
        for i in range(first, first + tables.markers[m, Markers.COUNT]):
            out[index] = by_x * work.jacobian[0, i] + by_y * work.jacobian[1, i] + by_angle * work.jacobian[2, i]
            index += 1
    return index


@kernel_function
def add_pair(tables, work, pair, matrix, factor, right, out):
    """Add factor J^T H R to `out`, the block of a force on two markers.

    `matrix` is H (6, 6), derivatives of the forces (x, y, torque) on a and b by (x, y, angle) of both, or by their rates. For a
    stiffness or damping `factor` is -1. `right` is R, J or J': forces by rates J v add H J' to the stiffness, as d(J v)/dq = J'.
    `pair` is marker a, marker b, and the row and column of `out` at which the coordinates of a begin. Those of b follow.
    """
    a, b, start = pair
    both, starts = (a, b), (start, start + tables.markers[a, Markers.COUNT])
    for i in range(2):
        first, rows = tables.markers[both[i], Markers.FIRST], tables.markers[both[i], Markers.COUNT]
        for j in range(2):
            first_right, columns = tables.markers[both[j], Markers.FIRST], tables.markers[both[j], Markers.COUNT]
            r, s = 3 * i, 3 * j  # row and column of this part of H, (3, 3)
            for row in range(rows):
                k = first + row
                jx, jy, ja = factor * work.jacobian[0, k], factor * work.jacobian[1, k], factor * work.jacobian[2, k]
                tx = jx * matrix[r, s] + jy * matrix[r + 1, s] + ja * matrix[r + 2, s]  # (tx, ty, ta): row of factor J^T H
                ty = jx * matrix[r, s + 1] + jy * matrix[r + 1, s + 1] + ja * matrix[r + 2, s + 1]
                ta = jx * matrix[r, s + 2] + jy * matrix[r + 1, s + 2] + ja * matrix[r + 2, s + 2]
                if tx != 0.0 or ty != 0.0 or ta != 0.0:
                    for column in range(columns):
                        m = first_right + column
                        term = tx * right[0, m] + ty * right[1, m] + ta * right[2, m]
                        out[starts[i] + row, starts[j] + column] += term


@kernel_function
def clear_block(tables, work, block):
    """Set the entries of a block of the stiffness K and the damping C, in the work arrays, to zero."""
    width = tables.blocks[block, BlockColumn.WIDTH]
    for i in range(width):
        for j in range(width):
            work.block_stiffness[i, j] = 0.0
            work.block_damping[i, j] = 0.0


@kernel_function
def add_entries(tables, block, entries, values):
    """Add a block to the nonzeros of the whole matrix, (slots + 1,); entries that are always zero go to the last, never read."""
    width, slot = tables.blocks[block, BlockColumn.WIDTH], tables.blocks[block, BlockColumn.ENTRIES]
    for i in range(width):
        for j in range(width):
            values[tables.slots[slot]] += entries[i, j]
            slot += 1


@inline
def get_rate(work, a, b, k):
    """Return component k of the six rates of markers a and b: of (x, y, angle) of a, then of b."""
    return work.state[a, State.VX + k] if k < 3 else work.state[b, State.VX + k - 3]


@inline
def compute_bias(tables, work, k, grad, hess):
    """Return the second time derivative of measure k, from its gradient, at zero second rates of the coordinates."""
    a, b, total = tables.measures[k, Measures.A], tables.measures[k, Measures.B], 0.0
    for i in range(3):
        total += grad[i] * work.state[a, State.AX + i] + grad[3 + i] * work.state[b, State.AX + i]
    if is_curved(tables, k):
        compute_hessian(tables, work, k, grad, hess)
        for i in range(6):
            for j in range(6):
                total += get_rate(work, a, b, i) * hess[i, j] * get_rate(work, a, b, j)
    return total
