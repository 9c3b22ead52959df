"""Accelerations, joint forces and powers of the crank-rocker with clearance: compiled, explicit, one pass.

Coordinates q = (crank x, y | coupler x, y, theta | rocker x, y, theta | modal coordinates of the rocker): centres in the
plane, m and rad. The state is (q, q_t, ledger). A joint with a gap is a contact: pin on the first body, bush on the second
(the other way round where it is TURNED), both pushed at the one point P = r_pin + R_p n. A joint without a gap is ideal, by
multipliers and stabilised (Baumgarte). The flexible rocker is a floating frame of reference. The equations are in
docs/theory-clearance.md.

What is compiled here calls nothing compiled elsewhere: laws come in as pointers. So laws can change without a new
compilation, and the cached machine code is out of date only if this file is. Within, arrays are bare pointers: y, dy of the
state, bar of the numbers, modes of the modal table (m columns), report of five rows of eight. Loads are gathered where the
accelerations will stand, from dy[n] on; those on the rocker in its own frame. Gravity, alike for all, is added last.
"""

from __future__ import annotations

import math

import numpy as np

from buckler.mbs.reference.compiled import MOTION, entry, jit, pointer

# Places in the table of numbers. Masses are those of crank, coupler, rocker, inertias those of coupler and rocker.
ANGLE, SPEED, GRAVITY, CRANK, COUPLER, ROCKER, FRAME, MASS, INERTIA, PIN, GAP, TURNED, BAUMGARTE, NUMBERS = (
    0, 1, 2, 4, 5, 6, 7, 8, 11, 13, 17, 21, 25, 26,
)  # fmt: skip
SHAPES, TRANSLATION, TURNING, RADIAL, MODAL_MASS, STIFFNESS, DAMPING, GYRATION = 0, 9, 11, 12, 13, 14, 15, 16
"""Rows of the modal table: shapes (x, y, turn) at start, end and centre, then the integrals; see `ModalData.table`."""
REPORT = (5, 8)
"""For each joint depth, rate, sliding speed, normal force, force x, y on its first body, contact point x, y; then accelerations
x, y of coupler centre, rocker centre, rocker mid-point."""
LEDGER = 13
"""Integrals: work of the drive | work on the contact, each joint | in friction, each joint | in the modes | three of a_x^2."""
WATCHED = 11
"""|force| of each joint | depth of each joint | |a_x| of coupler centre, rocker centre, rocker mid-point."""


# --- where things are -------------------------------------------------------------------------------------------------


@jit
def _poses(t, y, n, bar):
    """(x, y, cos, sin, x_t, y_t, theta_t) of ground, crank, coupler, rocker."""
    a, b, c = bar[ANGLE] + bar[SPEED] * t, y[4], y[7]
    return (
        (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0),
        (y[0], y[1], math.cos(a), math.sin(a), y[n], y[n + 1], bar[SPEED]),
        (y[2], y[3], math.cos(b), math.sin(b), y[n + 2], y[n + 3], y[n + 4]),
        (y[5], y[6], math.cos(c), math.sin(c), y[n + 5], y[n + 6], y[n + 7]),
    )


@jit
def _flex(station, y, n, modes, m):
    """Modal displacement (x, y), its rate and the rate of turn at the rocker's start (0), end (1) or centre (2); its frame."""
    row = m * (SHAPES + 3 * station)
    ux, uy, vx, vy, turn = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(m):
        q, v = y[8 + i], y[n + 8 + i]
        ux += modes[row + i] * q
        uy += modes[row + m + i] * q
        vx += modes[row + i] * v
        vy += modes[row + m + i] * v
        turn += modes[row + 2 * m + i] * v
    return ux, uy, vx, vy, turn


@jit
def _end(pose, along, flex):
    """Place, velocity, spin and velocity-dependent acceleration of a point on a body's axis; flex as from `_flex`."""
    x, y, c, s, vx, vy, w = pose
    px, py = along + flex[0], flex[1]
    ax, ay = c * px - s * py, s * px + c * py
    ux, uy = c * flex[2] - s * flex[3], s * flex[2] + c * flex[3]
    return (
        x + ax, y + ay, vx - w * ay + ux, vy + w * ax + uy, w + flex[4],
        -w * w * ax - 2.0 * w * uy, -w * w * ay + 2.0 * w * ux,
    )  # fmt: skip


@jit
def _ends(poses, y, n, bar, modes, m):
    """The pins' and the bushes' centres of O, A, B, C, as from `_end`."""
    ground, crank, coupler, rocker = poses
    stiff = (0.0, 0.0, 0.0, 0.0, 0.0)
    a, b, c = 0.5 * bar[CRANK], 0.5 * bar[COUPLER], 0.5 * bar[ROCKER]
    pins = (_end(ground, 0.0, stiff), _end(crank, a, stiff), _end(coupler, b, stiff), _end(ground, bar[FRAME], stiff))
    rocker_ends = _end(rocker, -c, _flex(0, y, n, modes, m)), _end(rocker, c, _flex(1, y, n, modes, m))
    bushes = (_end(crank, -a, stiff), _end(coupler, -b, stiff), rocker_ends[0], rocker_ends[1])
    return pins, bushes


# --- what acts on them ------------------------------------------------------------------------------------------------


@jit
def _touch(j, pin, bush, bar, onset, report, dy, ledger, normal, friction):
    """Fill joint j's row of the report, and the powers that go into contact and friction."""
    row, gap, radius = REPORT[1] * j, bar[GAP + j], bar[PIN + j]
    ex, ey = pin[0] - bush[0], pin[1] - bush[1]
    e = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / e, ey / e) if e > 0.0 else (1.0, 0.0)
    ux, uy = pin[2] - bush[2], pin[3] - bush[3]
    depth, rate = e - gap, nx * ux + ny * uy
    slide = nx * uy - ny * ux + radius * pin[4] - (e + radius) * bush[4]
    force, drag = 0.0, 0.0
    if depth > 0.0:
        force = normal(depth, rate, onset[j])
        drag = friction(slide) * force
        dy[ledger + 1 + j], dy[ledger + 5 + j] = force * rate, drag * slide
    report[row], report[row + 1], report[row + 2], report[row + 3] = depth, rate, slide, force
    report[row + 4], report[row + 5] = -force * nx + drag * ny, -force * ny - drag * nx
    report[row + 6], report[row + 7] = pin[0] + radius * nx, pin[1] + radius * ny


@jit
def _push(load, at, pose, fx, fy, px, py):
    """Add a force at (px, py) to the load on a body, whose x, y begin at load[at]; return its moment about the centre."""
    load[at] += fx
    load[at + 1] += fy
    return (px - pose[0]) * fy - (py - pose[1]) * fx


@jit
def _push_rocker(load, at, pose, fx, fy, px, py, end, station, modes, m):
    """Add a force on the rocker that acts on the section at its start (0) or end (1)."""
    gx, gy = pose[2] * fx + pose[3] * fy, -pose[3] * fx + pose[2] * fy
    load[at] += gx
    load[at + 1] += gy
    load[at + 2] += (px - pose[0]) * fy - (py - pose[1]) * fx
    twist, row = (px - end[0]) * fy - (py - end[1]) * fx, m * (SHAPES + 3 * station)
    for i in range(m):
        load[at + 3 + i] += modes[row + i] * gx + modes[row + m + i] * gy + modes[row + 2 * m + i] * twist


@jit
def _push_joint(j, load, at, poses, bush, fx, fy, px, py, modes, m):
    """Add a force on the pin of joint j, and its opposite on the bush, to the loads; return the moment on the crank."""
    if j == 0:
        return _push(load, at, poses[1], -fx, -fy, px, py)
    if j == 1:
        load[at + 4] += _push(load, at + 2, poses[2], -fx, -fy, px, py)
        return _push(load, at, poses[1], fx, fy, px, py)
    if j == 2:
        load[at + 4] += _push(load, at + 2, poses[2], fx, fy, px, py)
    _push_rocker(load, at + 5, poses[3], -fx, -fy, px, py, bush, j - 2, modes, m)
    return 0.0


# --- what they do about it --------------------------------------------------------------------------------------------


@jit
def _coupling(i, y, n, modes, m):
    """How mode i drags the rocker's frame in x, y and theta, how it stretches the rocker, and its Coriolis term."""
    drag, stretch, gyro = modes[m * TURNING + i], modes[m * RADIAL + i] + modes[m * MODAL_MASS + i] * y[8 + i], 0.0
    for j in range(m):
        across = modes[m * (GYRATION + j) + i]
        drag += across * y[8 + j]
        gyro += across * y[n + 8 + j]
    return modes[m * TRANSLATION + i], modes[m * (TRANSLATION + 1) + i], drag, stretch, gyro


@jit
def _rocker_frame(y, dy, n, bar, modes, m):
    """Add velocity and elastic terms to the rocker's loads; return its mass matrix for (x, y, theta): m, sx, sy, I."""
    w, inertia, px, py = y[n + 7], bar[INERTIA + 1], 0.0, 0.0
    for i in range(m):
        q, v = y[8 + i], y[n + 8 + i]
        sx, sy, _, stretch, gyro = _coupling(i, y, n, modes, m)
        px += sx * q
        py += sy * q
        inertia += (stretch + modes[m * RADIAL + i]) * q
        dy[n + 5] += w * (w * sx * q + 2.0 * sy * v)
        dy[n + 6] += w * (w * sy * q - 2.0 * sx * v)
        dy[n + 7] -= 2.0 * w * stretch * v
        dy[n + 8 + i] += w * (w * stretch - 2.0 * gyro) - modes[m * STIFFNESS + i] * q - modes[m * DAMPING + i] * v
    return bar[MASS + 2], px, py, inertia


@jit
def _rocker_free(y, dy, n, bar, modes, m):
    """Loads on the rocker to accelerations: the modes eliminated, then three equations for its frame."""
    mass, px, py, inertia = _rocker_frame(y, dy, n, bar, modes, m)
    xx, xy, yy, xt, yt, tt = mass, 0.0, mass, -py, px, inertia
    fx, fy, ft = dy[n + 5], dy[n + 6], dy[n + 7]
    for i in range(m):
        sx, sy, drag, _, _ = _coupling(i, y, n, modes, m)
        part = 1.0 / modes[m * MODAL_MASS + i]
        xx, xy, yy = xx - part * sx * sx, xy - part * sx * sy, yy - part * sy * sy
        xt, yt, tt = xt - part * sx * drag, yt - part * sy * drag, tt - part * drag * drag
        part *= dy[n + 8 + i]
        fx, fy, ft = fx - part * sx, fy - part * sy, ft - part * drag
    det = 1.0 / (xx * yy - xy * xy)
    gx, gy = det * (yy * xt - xy * yt), det * (xx * yt - xy * xt)
    turn = (ft - gx * fx - gy * fy) / (tt - gx * xt - gy * yt)
    ax, ay = det * (yy * fx - xy * fy) - gx * turn, det * (xx * fy - xy * fx) - gy * turn
    dy[n + 5], dy[n + 6], dy[n + 7] = ax, ay, turn
    for i in range(m):
        sx, sy, drag, _, _ = _coupling(i, y, n, modes, m)
        dy[n + 8 + i] = (dy[n + 8 + i] - sx * ax - sy * ay - drag * turn) / modes[m * MODAL_MASS + i]


@jit
def _mass_matrix(y, dy, n, bar, modes, m, matrix):
    """Fill the mass matrix of all coordinates, and complete the rocker's loads."""
    mass, px, py, inertia = _rocker_frame(y, dy, n, bar, modes, m)
    for i in range(2):
        matrix[i, i], matrix[2 + i, 2 + i], matrix[5 + i, 5 + i] = bar[MASS], bar[MASS + 1], mass
    matrix[4, 4], matrix[7, 7] = bar[INERTIA], inertia
    matrix[5, 7] = matrix[7, 5] = -py
    matrix[6, 7] = matrix[7, 6] = px
    for i in range(m):
        pull = _coupling(i, y, n, modes, m)
        matrix[8 + i, 8 + i] = modes[m * MODAL_MASS + i]
        for k in range(3):
            matrix[8 + i, 5 + k] = matrix[5 + k, 8 + i] = pull[k]


@jit
def _constrain(y, dy, n, poses, pins, bushes, bar, modes, m, report):
    """Loads to accelerations where some joints are ideal: M a - J' f = load, J a = what stabilisation asks for."""
    pull, rows = bar[BAUMGARTE], n
    system, right, spare = np.zeros((n + 8, n + 8)), np.zeros(n + 8), np.zeros(n)
    _mass_matrix(y, dy, n, bar, modes, m, system)
    for i in range(n):
        right[i] = dy[n + i]
    for j in range(4):
        for k in range(2):
            if bar[GAP + j] > 0.0:
                continue
            pin, bush = pins[j], bushes[j]
            spare[:] = 0.0
            _push_joint(j, spare, 0, poses, bush, 1.0 - k, float(k), bush[0], bush[1], modes, m)
            system[rows, :n], system[:n, rows] = spare, -spare
            right[rows] = bush[5 + k] - pin[5 + k] - pull * (2.0 * (pin[2 + k] - bush[2 + k]) + pull * (pin[k] - bush[k]))
            if j == 0 or j == 3:  # among bodies that fall freely the ground rises
                right[rows] += bar[GRAVITY + k]
            rows += 1
    found = np.linalg.solve(system[:rows, :rows].copy(), right[:rows])
    moment, rows = 0.0, n
    for j in range(4):
        if bar[GAP + j] <= 0.0:
            fx, fy = found[rows], found[rows + 1]
            report[REPORT[1] * j + 4], report[REPORT[1] * j + 5] = fx, fy
            moment += _push_joint(j, spare, 0, poses, bushes[j], fx, fy, bushes[j][0], bushes[j][1], modes, m)
            rows += 2
    for i in range(n):
        dy[n + i] = found[i]
    return moment


@jit
def _accelerate(y, dy, n, poses, pins, bushes, bar, modes, m, report):
    """Turn the loads into accelerations; return the moment that ideal joints exert on the crank."""
    moment = 0.0
    if min(bar[GAP], bar[GAP + 1], bar[GAP + 2], bar[GAP + 3]) <= 0.0:
        moment = _constrain(y, dy, n, poses, pins, bushes, bar, modes, m, report)
    else:
        for i in range(2):
            dy[n + i] /= bar[MASS]
            dy[n + 2 + i] /= bar[MASS + 1]
        dy[n + 4] /= bar[INERTIA]
        _rocker_free(y, dy, n, bar, modes, m)
    c, s, ax, ay = poses[3][2], poses[3][3], dy[n + 5], dy[n + 6]
    dy[n + 5], dy[n + 6] = c * ax - s * ay, s * ax + c * ay
    for i in range(2):
        dy[n + i] += bar[GRAVITY + i]
        dy[n + 2 + i] += bar[GRAVITY + i]
        dy[n + 5 + i] += bar[GRAVITY + i]
    return moment


@jit
def _middle(y, dy, n, rocker, modes, m):
    """Acceleration of the rocker's mid-point."""
    end = _end(rocker, 0.0, _flex(2, y, n, modes, m))
    bx, by, turn = 0.0, 0.0, dy[n + 7]
    for i in range(m):
        bx += modes[m * (SHAPES + 6) + i] * dy[n + 8 + i]
        by += modes[m * (SHAPES + 7) + i] * dy[n + 8 + i]
    return (
        dy[n + 5] + end[5] - turn * (end[1] - rocker[1]) + rocker[2] * bx - rocker[3] * by,
        dy[n + 6] + end[6] + turn * (end[0] - rocker[0]) + rocker[3] * bx + rocker[2] * by,
    )


@jit
def _watch(y, dy, n, modes, m, report, watch):
    """Fill what is integrated and watched besides the motion."""
    ledger, last = 2 * n, 4 * REPORT[1]
    for i in range(m):
        dy[ledger + 9] += modes[m * DAMPING + i] * y[n + 8 + i] ** 2
    for i in range(3):
        ax = report[last + 2 * i]
        dy[ledger + 10 + i], watch[8 + i] = ax**2, abs(ax)
    for j in range(4):
        row = REPORT[1] * j
        watch[j], watch[4 + j] = math.sqrt(report[row + 4] ** 2 + report[row + 5] ** 2), report[row]


@jit
def _move(t, y, dy, n, bar, modes, m, onset, report, watch, normal, friction):
    for i in range(n):
        dy[i] = y[n + i]
    for i in range(n, 2 * n + LEDGER):
        dy[i] = 0.0
    for i in range(REPORT[0] * REPORT[1]):
        report[i] = 0.0
    poses = _poses(t, y, n, bar)
    pins, bushes = _ends(poses, y, n, bar, modes, m)
    moment, last = 0.0, 4 * REPORT[1]
    for j in range(4):
        if bar[GAP + j] > 0.0:
            row = REPORT[1] * j
            if bar[TURNED + j] > 0.0:
                _touch(j, bushes[j], pins[j], bar, onset, report, dy, 2 * n, normal, friction)
                report[row + 4], report[row + 5] = -report[row + 4], -report[row + 5]
            else:
                _touch(j, pins[j], bushes[j], bar, onset, report, dy, 2 * n, normal, friction)
            if report[row + 3] != 0.0:  # not a number must be felt, too
                fx, fy, px, py = report[row + 4], report[row + 5], report[row + 6], report[row + 7]
                moment += _push_joint(j, dy, n, poses, bushes[j], fx, fy, px, py, modes, m)
    moment += _accelerate(y, dy, n, poses, pins, bushes, bar, modes, m, report)
    dy[2 * n] = -moment * bar[SPEED]
    report[last], report[last + 1], report[last + 2], report[last + 3] = dy[n + 2], dy[n + 3], dy[n + 5], dy[n + 6]
    report[last + 4], report[last + 5] = _middle(y, dy, n, poses[3], modes, m)
    _watch(y, dy, n, modes, m, report, watch)


@entry(MOTION.signature)
def motion(t, y, dy, bar, modes, onset, report, watch, normal, friction):
    """Rates of the state, and what there is to see.

    Parameters
    ----------
    t : float, s
    y, dy : array, shape (2 n + LEDGER,), n = 8 + m modes; the state and its rate, filled
    bar : array, shape (NUMBERS,)
    modes : array, shape (16 + m, m)
    onset : array, shape (4,), approach speed of each joint's last contact, m/s
    report : array, shape REPORT, filled
    watch : array, shape (WATCHED,), filled
    normal, friction : compiled laws
    """
    m = modes.shape[1]
    n = 8 + m
    _move(t, pointer(y), pointer(dy), n, pointer(bar), pointer(modes), m, pointer(onset), pointer(report), pointer(watch),
          normal, friction)  # fmt: skip
