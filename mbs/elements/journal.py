"""A pin in a bush with clearance: where they touch and what they exert, moment-exact, as plain functions of floats and arrays.

Pin on the first body, bush on the second; centres r_p, r_b; e = r_p - r_b, n = e/|e|, penetration depth d = |e| - c. Both
bodies feel the force at the one point P = r_p + R_p n, so force and moment balance hold to the last digit:
F = -(F_N n + mu F_N t) on the pin, t = (-n_y, n_x), mu the friction at v_t, the sliding speed of the pin's surface at P over
the bush's.

Neither need be round: the clearance is c(phi) = c_0 + b(phi - theta_b) + p(phi - theta_p), phi the direction of e, b and p the
profiles of bush and pin in their bodies. The normal force is that of a potential of d, F_N grad d: along m, the normal of the
curve |e| = c, which leans by c'/|e| from n, at P = r_p + R_p m - p'/s (-m_y, m_x), s = sqrt(1 + (c'/|e|)^2). So energy balances
whatever the slopes; friction counts with F_N, where F_N s acts.

What a contact remembers of the last accepted step, `MEMORY`, gives a law its onset speed and its bristle: since then the
bristle has bent at the mean of the sliding speed then and now.

The laws come as functions of the joint's row of numbers and of floats, so that Numba can compile all of it once for all laws:
`buckler.mbs.engine.compiled`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..geometry import Array
from ..laws.pieces import Reals

Both = tuple[Reals, Reals] | Array
Law = Callable[..., float]
"""Of a joint's row of numbers and of its state."""

COLUMNS = ("normal", "tangential", "depth", "rate", "sliding", "bristle", "fx", "fy", "nx", "ny", "shift")
"""What the kernel reports of each joint: N, N, m, m/s, m/s, m, force on the pin, direction of contact, p'/s in m."""
MEMORY = ("onset", "bristle", "sliding", "since")
"""What is known of each joint's last accepted step: speed at contact onset, m/s; bristle, m; sliding speed, m/s; its time, s."""
ONSET, BRISTLE, SLIDING, SINCE = range(len(MEMORY))
HARMONICS = 8
"""Harmonics of a profile at most."""
PIN, GAP, ROUND, PROFILES = range(8, 12)
"""In a joint's row of numbers, after places and arms of both ends: radius, clearance, whether both are round; harmonics of the
bush, then of the pin."""
TINY = 1e-300
"""What a distance of 0 is divided by."""
GEOMETRY = PROFILES + 4 * HARMONICS
"""Numbers before those of the laws."""


@dataclass(frozen=True)
class End:
    """One side of a joint: which coordinates move it.

    Attributes
    ----------
    offset : int
        First of its coordinates (x, y, theta), or -1 for ground.
    place : (float, float)
        Reference position of the body's node, or of the point for ground, m.
    arm : (float, float)
        From the node to the joint's centre in the reference configuration, m.
    """

    offset: int
    place: tuple[float, float]
    arm: tuple[float, float]


def _state(offset: int, x: float, y: float, ax: float, ay: float, q: Array, v: Array) -> tuple[float, ...]:
    """Centre (x, y), its velocity, arm in the current configuration, angular velocity and angle of one end."""
    if offset < 0:
        return x + ax, y + ay, 0.0, 0.0, ax, ay, 0.0, 0.0
    c, s = np.cos(q[offset + 2]), np.sin(q[offset + 2])
    bx, by, w = c * ax - s * ay, s * ax + c * ay, v[offset + 2]
    return x + q[offset] + bx, y + q[offset + 1] + by, v[offset] - w * by, v[offset + 1] + w * bx, bx, by, w, q[offset + 2]


def profile(numbers: Array, first: int, angle: Reals) -> tuple[Reals, Reals]:
    """Sum of harmonics, whose cosine and sine amplitudes begin at a place among numbers, and its derivative by the angle."""
    value, slope = 0.0 * angle, 0.0 * angle
    c1, s1 = np.cos(angle), np.sin(angle)
    c, s = c1, s1
    for k in range(1, HARMONICS + 1):
        a, b = numbers[first + 2 * k - 2], numbers[first + 2 * k - 1]
        value = value + a * c + b * s
        slope = slope + k * (b * c - a * s)
        c, s = c * c1 - s * s1, s * c1 + c * s1
    return value, slope


def meet(radius: float, gap: float, profiles: Array | None, place: Both, speed: Both, pin: Both, bush: Both) -> tuple[Reals, ...]:
    """Depth, its rate, sliding speed, normal of the contact (x, y), s and way p'/s along the pin, of floats or arrays alike.

    Parameters
    ----------
    profiles : array, or None where both are round
        Harmonics of the bush, then of the pin.
    place, speed : pair
        Of the pin's centre in the bush, m, and its rate, m/s.
    pin, bush : pair
        Spin, rad/s, and angle, rad.
    """
    (ex, ey), (ux, uy) = place, speed
    e = np.sqrt(ex * ex + ey * ey)
    size = e + TINY
    nx, ny = ex / size, ey / size
    depth, rate, s, shift = e - gap, nx * ux + ny * uy, 1.0 + 0.0 * e, 0.0 * e
    if profiles is not None:
        phi = np.arctan2(ny, nx)
        b, b_slope = profile(profiles, 0, phi - bush[1])
        p, p_slope = profile(profiles, 2 * HARMONICS, phi - pin[1])
        lean = (e > 0.0) * ((b_slope + p_slope) / size)  # none where the direction is not known
        depth = depth - b - p
        rate = rate + b_slope * bush[0] + p_slope * pin[0] - lean * (nx * uy - ny * ux)
        s = np.sqrt(1.0 + lean * lean)
        nx, ny, shift = (nx + lean * ny) / s, (ny - lean * nx) / s, p_slope / s
    # surface speeds at P: along the normal the pin's arm is R_p, the bush's e/s + R_p
    sliding = nx * uy - ny * ux + pin[0] * radius - bush[0] * (e / s + radius)
    return depth, rate, sliding, nx, ny, s, shift


def _contact(
    normal: Law, friction: Law, bend: Law, numbers: Array, pin: tuple[float, ...], bush: tuple[float, ...],
    t: float, past: Array,
) -> tuple[float, ...]:  # fmt: skip
    """What `COLUMNS` names, for one joint with its row of numbers, whose ends have these states and whose memory is `past`."""
    place, speed = (pin[0] - bush[0], pin[1] - bush[1]), (pin[2] - bush[2], pin[3] - bush[3])
    ends = (pin[6], pin[7]), (bush[6], bush[7])
    if numbers[ROUND] == 0.0:
        met = meet(numbers[PIN], numbers[GAP], numbers[PROFILES:], place, speed, ends[0], ends[1])
    else:
        met = meet(numbers[PIN], numbers[GAP], None, place, speed, ends[0], ends[1])
    depth, rate, sliding, nx, ny, s, shift = met
    if depth <= 0.0:
        return 0.0, 0.0, depth, rate, sliding, 0.0, 0.0, 0.0, nx, ny, shift
    force = normal(numbers, depth, rate, past[ONSET])
    bristle = bend(numbers, past[BRISTLE], 0.5 * (past[SLIDING] + sliding), t - past[SINCE])
    drag = friction(numbers, sliding, bristle) * force
    fx, fy = -force * s * nx + drag * ny, -force * s * ny - drag * nx
    return force, drag, depth, rate, sliding, bristle, fx, fy, nx, ny, shift


def report(
    normal: Law, friction: Law, bend: Law, t: float, q: Array, v: Array, memory: Array, places: Array, numbers: Array, out: Array
) -> None:
    """Fill out[joint] with what `COLUMNS` names."""
    for j in range(places.shape[0]):
        n = numbers[j]
        pin = _state(places[j, 0], n[0], n[1], n[2], n[3], q, v)
        bush = _state(places[j, 1], n[4], n[5], n[6], n[7], q, v)
        out[j] = _contact(normal, friction, bend, n, pin, bush, t, memory[j])


def forces(
    normal: Law, friction: Law, bend: Law, t: float, q: Array, v: Array, memory: Array, places: Array, numbers: Array, out: Array
) -> None:
    """Fill out with generalised forces on the coordinates (x, y, theta of each node)."""
    out[:] = 0.0
    for j in range(places.shape[0]):
        n = numbers[j]
        pin = _state(places[j, 0], n[0], n[1], n[2], n[3], q, v)
        bush = _state(places[j, 1], n[4], n[5], n[6], n[7], q, v)
        c = _contact(normal, friction, bend, n, pin, bush, t, memory[j])
        if c[0] == 0.0:
            continue
        fx, fy = c[6], c[7]
        px, py = pin[0] + n[PIN] * c[8] + c[10] * c[9], pin[1] + n[PIN] * c[9] - c[10] * c[8]  # the common point P
        for side in range(2):
            k = places[j, side]
            if k < 0:
                continue
            sign = 1.0 if side == 0 else -1.0
            end = pin if side == 0 else bush
            lx, ly = px - (end[0] - end[4]), py - (end[1] - end[5])  # from the body's node to P
            out[k] += sign * fx
            out[k + 1] += sign * fy
            out[k + 2] += sign * (lx * fy - ly * fx)
