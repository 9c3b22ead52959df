"""Contact of a pin in a bush with clearance: kinematics and forces with exact moments, as functions of floats and arrays.

Pin on the first body, bush on the second; centres r_p, r_b; e = r_p - r_b, n = e/|e|, penetration depth d = |e| - c. Both
bodies feel the force at the one point P = r_p + R_p n, so force and moment balance hold to the last digit. The force on the
pin is F = -(F_N n + mu F_N t) with t = (-n_y, n_x). The friction coefficient mu belongs to v_t, the speed at which the pin's
surface slides over the bush's at P.

A contact has values of the last accepted step as `MEMORY`: a law takes its onset speed and its bristle from there. Since that
step the bristle has bent at the mean of the sliding speeds then and now.

Laws are functions of the joint's row of numbers and of floats: `contact` compiles this module once for all laws.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..geometry import Array
from .pieces import Reals

Both = tuple[Reals, Reals] | Array
Law = Callable[..., float]
"""Function of a joint's row of numbers and of its state."""

COLUMNS = ("normal", "tangential", "depth", "rate", "sliding", "bristle", "fx", "fy", "nx", "ny")
"""Columns of the report of a joint: [N], [N], [m], [m/s], [m/s], [m], force on the pin [N], normal of the contact."""
MEMORY = ("onset", "bristle", "sliding", "since")
"""Quantities of a joint at its last accepted step: speed at contact onset [m/s], bristle [m], sliding speed [m/s], time [s]."""
ONSET, BRISTLE, SLIDING, SINCE = range(len(MEMORY))
PIN = 8
"""Column of the pin's radius [m] in a joint's row of numbers, after places and arms of both ends."""
GAP = PIN + 1
"""Column of the clearance [m] in a joint's row of numbers."""
TINY = 1e-300
"""Distance [m] added to that of the centres, so that a pin in the middle of its bush has a normal of 0."""


@dataclass(frozen=True)
class End:
    """One side of a joint: index of its first coordinate, of (x, y, theta), or -1 for ground; reference configuration [m].

    `place` is that of the body's node, or of the point for ground; `arm` leads from the node to the joint's centre.
    """

    offset: int
    place: tuple[float, float]
    arm: tuple[float, float]


def _state(offset: int, x: float, y: float, ax: float, ay: float, q: Array, v: Array) -> tuple[float, ...]:
    """Return centre (x, y), its velocity, arm in the current configuration and angular velocity of one end."""
    if offset < 0:
        return x + ax, y + ay, 0.0, 0.0, ax, ay, 0.0
    c, s = np.cos(q[offset + 2]), np.sin(q[offset + 2])
    bx, by, w = c * ax - s * ay, s * ax + c * ay, v[offset + 2]
    return x + q[offset] + bx, y + q[offset + 1] + by, v[offset] - w * by, v[offset + 1] + w * bx, bx, by, w


def meet(radius: float, gap: float, place: Both, speed: Both, spins: Both) -> tuple[Reals, ...]:
    """Return depth [m], its rate [m/s], sliding speed [m/s] and normal (x, y) of the contact, for floats or arrays.

    Place [m] and speed [m/s] are those of the pin's centre in the bush, spins [rad/s] those of pin and bush.
    """
    (ex, ey), (ux, uy) = place, speed
    e = np.sqrt(ex * ex + ey * ey)
    size = e + TINY
    nx, ny = ex / size, ey / size
    # surface speeds at P: along the normal the pin's arm is R_p, the bush's e + R_p
    sliding = nx * uy - ny * ux + spins[0] * radius - spins[1] * (e + radius)
    return e - gap, nx * ux + ny * uy, sliding, nx, ny


def report_with(normal: Law, friction: Law, bend: Law) -> Callable[..., None]:
    """Make the function that fills out[joint] with the `COLUMNS`, for joints with these laws.

    The laws return normal force [N], friction coefficient and bristle [m] from a joint's row of numbers and its state.
    """

    def contact(numbers: Array, pin: tuple[float, ...], bush: tuple[float, ...], t: float, past: Array) -> tuple[float, ...]:
        """Compute forces, depth, rates and direction of one contact."""
        place, speed = (pin[0] - bush[0], pin[1] - bush[1]), (pin[2] - bush[2], pin[3] - bush[3])
        depth, rate, sliding, nx, ny = meet(numbers[PIN], numbers[GAP], place, speed, (pin[6], bush[6]))
        if depth <= 0.0:
            return 0.0, 0.0, depth, rate, sliding, 0.0, 0.0, 0.0, nx, ny
        force = normal(numbers, depth, rate, past[ONSET])
        bristle = bend(numbers, past[BRISTLE], 0.5 * (past[SLIDING] + sliding), t - past[SINCE])
        drag = friction(numbers, sliding, bristle) * force
        fx, fy = -force * nx + drag * ny, -force * ny - drag * nx
        return force, drag, depth, rate, sliding, bristle, fx, fy, nx, ny

    def report(t: float, q: Array, v: Array, memory: Array, places: Array, numbers: Array, out: Array) -> None:
        """Write the contact of each joint to a row of `out`."""
        for j in range(places.shape[0]):
            n = numbers[j]
            pin = _state(places[j, 0], n[0], n[1], n[2], n[3], q, v)
            bush = _state(places[j, 1], n[4], n[5], n[6], n[7], q, v)
            out[j] = contact(n, pin, bush, t, memory[j])

    return report


def spread(rows: Array, q: Array, v: Array, places: Array, numbers: Array, out: Array) -> None:
    """Compute generalised forces on the coordinates (x, y, theta of each node) from the report of the joints."""
    out[:] = 0.0
    for j in range(places.shape[0]):
        n, c = numbers[j], rows[j]
        if c[0] == 0.0:
            continue
        pin = _state(places[j, 0], n[0], n[1], n[2], n[3], q, v)
        bush = _state(places[j, 1], n[4], n[5], n[6], n[7], q, v)
        fx, fy = c[6], c[7]
        px, py = pin[0] + n[PIN] * c[8], pin[1] + n[PIN] * c[9]  # the common point P
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
