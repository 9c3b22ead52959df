"""Accelerations, joint forces and powers of the crank-rocker with play: compiled, explicit, one pass.

Coordinates q = (crank x, y | coupler x, y, theta | rocker x, y, theta | modal coordinates of the rocker): centres in the
plane, m and rad. The state is (q, q_t, ledger). A joint with a gap is a contact: pin on the first body, bush on the second,
both pushed at the one point P = r_pin + R_p n. A joint without a gap is ideal, by multipliers and stabilised (Baumgarte).
The flexible rocker is a floating frame of reference (docs/theory-clearance.md has the equations).

What is compiled here calls nothing compiled elsewhere: laws come in as pointers. So laws can change without a new
compilation, and the cached machine code is out of date only if this file is.
"""

from __future__ import annotations

import math

import numpy as np

from mbs.reference.compiled import MOTION, entry, jit

FIRST = (0, 1, 2, 0)
"""Whose pin it is, joints O, A, B, C; bodies: 0 ground, 1 crank, 2 coupler, 3 rocker."""
SECOND = (1, 2, 3, 3)
"""Whose bush."""
# Places in the table of numbers. Masses are those of crank, coupler, rocker, inertias those of coupler and rocker.
ANGLE, SPEED, GRAVITY, CRANK, COUPLER, ROCKER, FRAME, MASS, INERTIA, PIN, GAP, BAUMGARTE, NUMBERS = (
    0, 1, 2, 4, 5, 6, 7, 8, 11, 13, 17, 21, 22,
)  # fmt: skip
LEDGER = 13
"""Integrals: work of the drive | lost in contact, each joint | in friction, each joint | in the modes | three of a_x^2."""
WATCHED = 11
"""|force| of each joint | depth of each joint | |a_x| of coupler centre, rocker centre, rocker mid-point."""
SHAPES, TRANSLATION, TURNING, RADIAL, STIFFNESS, DAMPING, GYRATION = 0, 9, 11, 12, 13, 14, 15
"""Rows of the modal table: shapes (x, y, turn) at start, end and centre, then the integrals; see `ModalData.table`."""


@jit
def _station(modes, station, y):
    """Modal displacement (x, y), its rate and the rate of turn at the rocker's start (0), end (1) or centre (2); body frame."""
    m, row = modes.shape[1], SHAPES + 3 * station
    n = 8 + m
    ux, uy, vx, vy, turn = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(m):
        ux += modes[row, i] * y[8 + i]
        uy += modes[row + 1, i] * y[8 + i]
        vx += modes[row, i] * y[n + 8 + i]
        vy += modes[row + 1, i] * y[n + 8 + i]
        turn += modes[row + 2, i] * y[n + 8 + i]
    return ux, uy, vx, vy, turn


@jit
def _end(pose, along, flex):
    """Place, velocity, spin and velocity-dependent acceleration of a point on a body's axis; flex as from `_station`."""
    x, y, c, s, vx, vy, w = pose
    px, py = along + flex[0], flex[1]
    ax, ay = c * px - s * py, s * px + c * py
    ux, uy = c * flex[2] - s * flex[3], s * flex[2] + c * flex[3]
    return (
        x + ax, y + ay, vx - w * ay + ux, vy + w * ax + uy, w + flex[4],
        -w * w * ax - 2.0 * w * uy, -w * w * ay + 2.0 * w * ux,
    )  # fmt: skip


@jit
def _poses(t, y, n, bar):
    """(x, y, cos, sin, x_t, y_t, theta_t) of ground, crank, coupler, rocker."""
    a, b, d = bar[ANGLE] + bar[SPEED] * t, y[4], y[7]
    v = y[n : 2 * n]
    return (
        (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0),
        (y[0], y[1], math.cos(a), math.sin(a), v[0], v[1], bar[SPEED]),
        (y[2], y[3], math.cos(b), math.sin(b), v[2], v[3], v[4]),
        (y[5], y[6], math.cos(d), math.sin(d), v[5], v[6], v[7]),
    )


@jit
def _ends(poses, y, bar, modes):
    """The pins' and the bushes' centres of O, A, B, C, as from `_end`."""
    ground, crank, coupler, rocker = poses
    stiff = (0.0, 0.0, 0.0, 0.0, 0.0)
    half = (0.5 * bar[CRANK], 0.5 * bar[COUPLER], 0.5 * bar[ROCKER])
    pins = (
        _end(ground, 0.0, stiff), _end(crank, half[0], stiff), _end(coupler, half[1], stiff), _end(ground, bar[FRAME], stiff)
    )  # fmt: skip
    bushes = (
        _end(crank, -half[0], stiff), _end(coupler, -half[1], stiff),
        _end(rocker, -half[2], _station(modes, 0, y)), _end(rocker, half[2], _station(modes, 1, y)),
    )  # fmt: skip
    return pins, bushes


@jit
def _touch(pin, bush, radius, gap, onset, report, normal, elastic, friction):
    """Fill report with depth, rate, sliding speed, normal force, force on the pin; return P, and the two powers lost."""
    ex, ey = pin[0] - bush[0], pin[1] - bush[1]
    e = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / e, ey / e) if e > 0.0 else (1.0, 0.0)
    ux, uy = pin[2] - bush[2], pin[3] - bush[3]
    depth, rate = e - gap, nx * ux + ny * uy
    slide = nx * uy - ny * ux + radius * pin[4] - (e + radius) * bush[4]
    force, drag, lost = 0.0, 0.0, 0.0
    if depth > 0.0:
        force = normal(depth, rate, onset)
        drag = friction(slide) * force
        lost = (force - elastic(depth)) * rate
    report[0], report[1], report[2], report[3] = depth, rate, slide, force
    report[4], report[5] = -force * nx + drag * ny, -force * ny - drag * nx
    return pin[0] + radius * nx, pin[1] + radius * ny, lost, drag * slide


@jit
def _push(load, body, station, pose, end, fx, fy, px, py, modes):
    """Add force (fx, fy) at (px, py) to the load on a body, the rocker's in its own frame; return the moment on the crank."""
    moment = (px - pose[0]) * fy - (py - pose[1]) * fx
    if body == 1:
        load[0] += fx
        load[1] += fy
        return moment
    if body == 2:
        load[2] += fx
        load[3] += fy
        load[4] += moment
    elif body == 3:
        gx, gy = pose[2] * fx + pose[3] * fy, -pose[3] * fx + pose[2] * fy
        load[5] += gx
        load[6] += gy
        load[7] += moment
        twist = (px - end[0]) * fy - (py - end[1]) * fx
        for i in range(modes.shape[1]):
            row = SHAPES + 3 * station
            load[8 + i] += modes[row, i] * gx + modes[row + 1, i] * gy + modes[row + 2, i] * twist
    return 0.0


@jit
def _rocker_matrix(y, w, load, bar, modes):
    """Mass matrix of the flexible rocker in its own frame; its velocity and elastic terms go to load."""
    m = modes.shape[1]
    n, size = 8 + m, 3 + m
    q, v = y[8:n], y[n + 8 : 2 * n]
    matrix = np.zeros((size, size))
    matrix[0, 0] = matrix[1, 1] = bar[MASS + 2]
    matrix[2, 2] = bar[INERTIA + 1]
    for i in range(m):
        sx, sy, turning, stretch = modes[TRANSLATION, i], modes[TRANSLATION + 1, i], modes[TURNING, i], modes[RADIAL, i]
        gyro = 0.0
        for j in range(m):
            matrix[3 + i, 3 + j] = modes[GYRATION + m + j, i]
            turning += q[j] * modes[GYRATION + j, i]
            gyro += v[j] * modes[GYRATION + j, i]
            stretch += modes[GYRATION + m + j, i] * q[j]
        matrix[0, 2] -= sy * q[i]
        matrix[1, 2] += sx * q[i]
        matrix[2, 2] += (stretch + modes[RADIAL, i]) * q[i]
        matrix[0, 3 + i], matrix[1, 3 + i], matrix[2, 3 + i] = sx, sy, turning
        load[5] += w * (w * sx * q[i] + 2.0 * sy * v[i])
        load[6] += w * (w * sy * q[i] - 2.0 * sx * v[i])
        load[7] -= 2.0 * w * stretch * v[i]
        load[8 + i] += w * (w * stretch - 2.0 * gyro) - modes[STIFFNESS, i] * q[i] - modes[DAMPING, i] * v[i]
    for i in range(size):
        for j in range(i):
            matrix[i, j] = matrix[j, i]
    return matrix


@jit
def _weigh(load, rocker, y, bar, modes):
    """Add gravity."""
    gx, gy = bar[GRAVITY], bar[GRAVITY + 1]
    hx, hy = rocker[2] * gx + rocker[3] * gy, -rocker[3] * gx + rocker[2] * gy
    for i in range(modes.shape[1]):
        sx, sy = modes[TRANSLATION, i], modes[TRANSLATION + 1, i]
        load[8 + i] += sx * hx + sy * hy
        load[7] += y[8 + i] * (sx * hy - sy * hx)
    load[0] += bar[MASS] * gx
    load[1] += bar[MASS] * gy
    load[2] += bar[MASS + 1] * gx
    load[3] += bar[MASS + 1] * gy
    load[5] += bar[MASS + 2] * hx
    load[6] += bar[MASS + 2] * hy


@jit
def _solve(matrix, right):
    """Cholesky, in place: right becomes the solution."""
    n = right.size
    for j in range(n):
        for k in range(j):
            matrix[j, j] -= matrix[j, k] * matrix[j, k]
        matrix[j, j] = math.sqrt(matrix[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                matrix[i, j] -= matrix[i, k] * matrix[j, k]
            matrix[i, j] /= matrix[j, j]
    for i in range(n):
        for k in range(i):
            right[i] -= matrix[i, k] * right[k]
        right[i] /= matrix[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            right[i] -= matrix[k, i] * right[k]
        right[i] /= matrix[i, i]


@jit
def _constrain(load, poses, pins, bushes, block, bar, modes, contact):
    """Accelerations with some joints ideal: multipliers; load becomes the accelerations. Return the moment on the crank."""
    n, rows = load.size, 0
    jacobian = np.zeros((8, n))
    right = np.zeros(n + 8)
    for j in range(4):
        if bar[GAP + j] > 0.0:
            continue
        pin, bush, a = pins[j], bushes[j], bar[BAUMGARTE]
        for k in range(2):
            fx, fy = 1.0 - k, float(k)
            _push(jacobian[rows], FIRST[j], 0, poses[FIRST[j]], pin, fx, fy, pin[0], pin[1], modes)
            _push(jacobian[rows], SECOND[j], j - 2, poses[SECOND[j]], bush, -fx, -fy, bush[0], bush[1], modes)
            right[n + rows] = -(pin[5 + k] - bush[5 + k]) - 2.0 * a * (pin[2 + k] - bush[2 + k]) - a * a * (pin[k] - bush[k])
            rows += 1
    system = np.zeros((n + rows, n + rows))
    system[0, 0] = system[1, 1] = bar[MASS]
    system[2, 2] = system[3, 3] = bar[MASS + 1]
    system[4, 4] = bar[INERTIA]
    system[5:n, 5:n] = block
    for i in range(rows):
        for k in range(n):
            system[n + i, k] = jacobian[i, k]
            system[k, n + i] = -jacobian[i, k]
    right[:n] = load
    found = np.linalg.solve(system, right[: n + rows])
    load[:] = found[:n]
    moment, row = 0.0, n
    for j in range(4):
        if bar[GAP + j] > 0.0:
            continue
        fx, fy = found[row], found[row + 1]
        contact[j, 4], contact[j, 5] = fx, fy
        if j < 2:
            end, sign = (bushes[0], -1.0) if j == 0 else (pins[1], 1.0)
            moment += sign * ((end[0] - poses[1][0]) * fy - (end[1] - poses[1][1]) * fx)
        row += 2
    return moment


@jit
def _accelerate(y, dy, poses, pins, bushes, bar, modes, contact):
    """Turn the loads in dy into accelerations; return the moment that ideal joints exert on the crank."""
    n, rocker, moment = 8 + modes.shape[1], poses[3], 0.0
    load = dy[n : 2 * n]
    _weigh(load, rocker, y, bar, modes)
    ideal = bar[GAP : GAP + 4].min() <= 0.0
    if ideal or n > 8:
        block = _rocker_matrix(y, rocker[6], load, bar, modes)
        if ideal:
            moment = _constrain(load, poses, pins, bushes, block, bar, modes, contact)
        else:
            _solve(block, load[5:])
    else:
        load[5] /= bar[MASS + 2]
        load[6] /= bar[MASS + 2]
        load[7] /= bar[INERTIA + 1]
    if not ideal:
        for i in range(2):
            load[i] /= bar[MASS]
            load[2 + i] /= bar[MASS + 1]
        load[4] /= bar[INERTIA]
    load[5], load[6] = rocker[2] * load[5] - rocker[3] * load[6], rocker[3] * load[5] + rocker[2] * load[6]
    return moment


@jit
def _middle(y, acceleration, rocker, modes):
    """Acceleration of the rocker's mid-point."""
    end = _end(rocker, 0.0, _station(modes, 2, y))
    bx, by = 0.0, 0.0
    for i in range(modes.shape[1]):
        bx += modes[SHAPES + 6, i] * acceleration[8 + i]
        by += modes[SHAPES + 7, i] * acceleration[8 + i]
    turn = acceleration[7]
    return (
        acceleration[5] + end[5] - turn * (end[1] - rocker[1]) + rocker[2] * bx - rocker[3] * by,
        acceleration[6] + end[6] + turn * (end[0] - rocker[0]) + rocker[3] * bx + rocker[2] * by,
    )


@entry(MOTION.signature)
def motion(t, y, dy, bar, modes, onset, report, watch, normal, elastic, friction):
    """Rates of the state, and what there is to see.

    Parameters
    ----------
    t : float, s
    y, dy : array, shape (2 n + LEDGER,), n = 8 + modes; the state and its rate
    bar : array, shape (NUMBERS,)
    modes : array, shape (15 + 2 m, m)
    onset : array, shape (4,), approach speed of each joint's last contact, m/s
    report : array, shape (5, 6), filled: four times depth, rate, sliding speed, normal force, force x and y on the pin;
        and the accelerations x, y of coupler centre, rocker centre, rocker mid-point
    watch : array, shape (WATCHED,), filled
    normal, elastic, friction : compiled laws
    """
    n = 8 + modes.shape[1]
    dy[:n] = y[n : 2 * n]
    dy[n:] = 0.0
    load, ledger, moment = dy[n : 2 * n], dy[2 * n :], 0.0
    poses = _poses(t, y, n, bar)
    pins, bushes = _ends(poses, y, bar, modes)
    for j in range(4):
        pin, bush, seen = pins[j], bushes[j], report[j]
        if bar[GAP + j] <= 0.0:
            seen[:] = 0.0
            continue
        px, py, lost, rubbed = _touch(pin, bush, bar[PIN + j], bar[GAP + j], onset[j], seen, normal, elastic, friction)
        if seen[3] > 0.0:
            fx, fy = seen[4], seen[5]
            moment += _push(load, FIRST[j], 0, poses[FIRST[j]], pin, fx, fy, px, py, modes)
            moment += _push(load, SECOND[j], j - 2, poses[SECOND[j]], bush, -fx, -fy, px, py, modes)
        ledger[1 + j], ledger[5 + j] = lost, rubbed
    moment += _accelerate(y, dy, poses, pins, bushes, bar, modes, report)
    ledger[0] = -moment * bar[SPEED]
    for i in range(modes.shape[1]):
        ledger[9] += modes[DAMPING, i] * y[n + 8 + i] ** 2
    seen = report[4]
    seen[0], seen[1], seen[2], seen[3] = load[2], load[3], load[5], load[6]
    seen[4], seen[5] = _middle(y, load, poses[3], modes)
    for i in range(3):
        ledger[10 + i] = seen[2 * i] ** 2
        watch[8 + i] = abs(seen[2 * i])
    for j in range(4):
        watch[j], watch[4 + j] = math.hypot(report[j, 4], report[j, 5]), report[j, 0]
