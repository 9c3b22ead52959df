"""Contact of a pin in a bush with clearance c: kinematics and forces, as functions of floats and arrays.

The pin of radius R belongs to the first body, the bush to the second. Let r_p and r_b be their centres, e = r_p - r_b,
n = e/|e| and t = (-n_y, n_x). The depth is d = |e| - c. The force on the pin is F = -F_N n - mu F_N t. F and its opposite act at
one point P = r_p + R n, on the surface of the pin, so that forces and moments balance to rounding. The signed friction
coefficient mu depends on the speed along t at which the pin's surface slides over the bush's surface at P.

`MEMORY` has values of the last accepted step. The onset speed of an open contact is the rate of its depth at that step. From the
bristle's deflection the law computes the present one: it has slid since that step at the mean of the sliding speeds then and now.

Both solvers have this contact: `laws.contact` compiles these functions for Exudyn, `spectral.forces` has its own.
"""

from collections import namedtuple
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from .pieces import Reals

Pair = tuple[Reals, Reals] | Array
"""Two components x and y, or two values, one of the pin and one of the bush."""

COLUMNS = ("normal", "tangential", "depth", "rate", "sliding", "bristle", "fx", "fy", "nx", "ny")
"""Columns of the report of a joint: two forces [N], depth [m], two speeds [m/s], bristle [m], force on the pin [N], n [1]."""
NORMAL, FX, FY, NX, NY = (COLUMNS.index(name) for name in ("normal", "fx", "fy", "nx", "ny"))
MEMORY = ("onset", "bristle", "sliding", "since")
"""Values of a joint at its last accepted step: onset speed [m/s], bristle [m], sliding speed [m/s], time of that step [s]."""
ONSET, BRISTLE, SLIDING, SINCE = range(len(MEMORY))
RADIUS = 8
"""Column of the pin's radius [m] in a joint's row of numbers, after place (x, y) and arm (x, y) of the pin, then of the bush."""
GAP = RADIUS + 1
"""Column of the clearance c [m] in a joint's row of numbers, the last one."""


@dataclass(frozen=True)
class End:
    """One side of a joint."""

    offset: int  # index at which the coordinates (x, y, theta) of its body begin; -1 for the ground
    place: tuple[float, float]  # of the body's node, or the point on the ground, at t = 0 [m]
    arm: tuple[float, float]  # from `place` to the joint's centre [m]


class Joints(NamedTuple):
    """Joints with clearance with the same laws."""

    offsets: Array  # integers (joints, 2): index of (x, y, theta) of the nodes of pin and bush in q; -1 for the ground
    numbers: Array  # (joints, 10): place and arm of the pin, then of the bush; pin's radius, clearance


EndState = namedtuple("EndState", "x y vx vy arm_x arm_y spin")
"""State of an end: centre [m] and its velocity [m/s], arm from the node to the centre [m], angular velocity [rad/s]."""


def _state(offset: int, numbers: Array, q: Array, v: Array) -> EndState:
    """Compute the state of an end from its place and arm at t = 0, `numbers` (4,), the changes q since then and their rates v."""
    x, y, ax, ay = numbers[0], numbers[1], numbers[2], numbers[3]
    if offset < 0:
        return EndState(x + ax, y + ay, 0.0, 0.0, ax, ay, 0.0)
    c, s = np.cos(q[offset + 2]), np.sin(q[offset + 2])
    bx, by, w = c * ax - s * ay, s * ax + c * ay, v[offset + 2]  # turned arm, angular velocity
    return EndState(x + q[offset] + bx, y + q[offset + 1] + by, v[offset] - w * by, v[offset + 1] + w * bx, bx, by, w)


def find_states(offsets: Array, numbers: Array, q: Array, v: Array) -> tuple[EndState, EndState]:
    """Compute the states of pin and bush from a joint's row of numbers, which begins with place and arm of both."""
    return _state(offsets[0], numbers[:4], q, v), _state(offsets[1], numbers[4:8], q, v)


def locate_contact(radius: float, gap: float, place: Pair, velocity: Pair, spins: Pair) -> tuple[Reals, ...]:
    """Return depth [m], its rate [m/s], sliding speed [m/s] and normal (n_x, n_y) of the contact, for floats or arrays."""
    (ex, ey), (ux, uy) = place, velocity  # of the pin's centre relative to the bush's centre [m], [m/s]
    distance = np.sqrt(ex * ex + ey * ey)
    divisor = distance + 1e-300  # so that a pin in the middle of its bush has n = 0 and not 0/0
    nx, ny = ex / divisor, ey / divisor
    # speeds of the surfaces at P, which lies R along n from the pin's centre and |e| + R from the bush's centre
    sliding = nx * uy - ny * ux + spins[0] * radius - spins[1] * (distance + radius)
    return distance - gap, nx * ux + ny * uy, sliding, nx, ny


def fill_forces(rows: Array, q: Array, v: Array, joints: Joints, out: Array) -> None:
    """Set `out` to the generalised forces, the sum over all joints; `rows` are the joints' `COLUMNS`."""
    offsets, numbers = joints.offsets, joints.numbers
    out[:] = 0.0
    for j in range(offsets.shape[0]):
        radius, row = numbers[j, RADIUS], rows[j]
        if row[NORMAL] == 0.0:  # no contact
            continue
        pin, bush = find_states(offsets[j], numbers[j], q, v)
        px, py = pin.x + radius * row[NX], pin.y + radius * row[NY]  # the common point P
        for side in range(2):
            k = offsets[j, side]
            if k < 0:
                continue
            end = pin if side == 0 else bush
            fx, fy = (row[FX], row[FY]) if side == 0 else (-row[FX], -row[FY])
            lx, ly = px - (end.x - end.arm_x), py - (end.y - end.arm_y)  # from the body's node to P
            out[k] += fx
            out[k + 1] += fy
            out[k + 2] += lx * fy - ly * fx
