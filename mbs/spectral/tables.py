"""Tables of the compiled kernel: whole numbers and floats, one row a thing, and the numbers that stand for its kind.

Nothing here knows an element of a mechanism. Markers are points of bodies with an angle; measures are lengths and angles between
two markers; rows are constraints on measures; forces act along measures or at markers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry import Array

# --- kinds ------------------------------------------------------------------------------------------------------------
GROUND, FRAME, LINEAR, CURVE = range(4)
"""Markers: fixed; on a body with a frame (rigid, or with modes); linear in a strip's coordinates; likewise, but its angle is the
direction of the strip's slope."""
FIXED, TURNING, ANGLE, DISTANCE = range(4)
"""Measures of markers a, b: d.(a - b) with d fixed, d turning with b, angle a - b, distance."""
REISSNER, KIRCHHOFF = range(2)
"""Strips."""
STEADY, RAMP, CALLED = range(3)
"""Motions of a drive: zero, a ramp of the speed, two functions by address."""
LINE_SPRING, CONTACT, DRY, SEAT, STRUT, GIVEN, LAW, MOTOR, JOURNAL, PUSH, STATEFUL = range(11)
"""Forces along a measure: spring and damper; contact against a face; friction given as a force; friction of a constraint's
reaction or of a contact; post-buckled strut; given in time; function of (time, measure, rate); DC motor. Forces of markers: pin
in a bush; a force at a marker, direction fixed or turning with another; a force or torque at a marker whose law has states."""

# --- columns ----------------------------------------------------------------------------------------------------------
KIND, OFFSET, SIZE, FIRST, COUNT, DATA, TWIN = range(7)
"""Columns of markers: first coordinate, modes or members of the basis, where its places begin and how many, where its numbers
begin; the first marker of the same frame, or -1."""
LEAD, MOTION_OF, TERMS = range(3)
"""Columns of rows: first measure, motion or -1, number of measures."""
MEMBERS, WIDTH, ENTRIES = range(3)
"""Columns of blocks: where its unknowns begin, how many, where its slots begin."""
_, CALL, CALL_TOO = range(3)
"""Columns of laws and motions, after the kind: addresses of functions."""
SHARE = 2
"""Column of directions: the measure's coefficient in its constraint."""
_, A, B, LAW_OF, FRICTION_OF, ROW_OF, NUMBERS = range(7)
"""Columns of measures and forces, after the kind: markers; for forces along a measure, A is the measure, and B of friction of a
face its contact. Of forces: law rows, a constraint row, where its numbers begin."""
X, Y, TURN, VX, VY, SPIN, AX, AY, TURNING_BIAS, COS, SIN = range(11)
"""Columns of a marker's state: place, angle, rates, second rates at zero coordinate acceleration, direction of the frame."""
VALUE, FRICTION, LENGTH, RATE, SLIP, BENT, FX, FY = range(8)
"""Columns of a force's report: value, a second one (friction), measure or depth, its rate, sliding speed, bristle; components."""
STATES = 2
"""Number of states among the numbers of a force whose law has states, after the first column of its marker and how many it
pushes; what the first one is at t = 0 follows."""
STATE = -2
"""Mark in place of an inner coordinate's second one: it is the integral of a law's state."""
ONSET, BRISTLE, SLIDING, FASTEST = range(4)
"""Columns of a force's memory: onset speed, bristle, sliding speed at the last accepted step, fastest onset so far."""


class Tables(NamedTuple):
    """A mechanism for the kernel: n coordinates, r rows of constraints; whole numbers but where floats are named.

    Numbers of a modal link with m modes: radial (m), gram (m, m), gyration (m, m), stiffness (m), damping (m). Of a strip: EA,
    GA, EI, two damping times; weights, stress-free strains (3) of each Gauss point; N, N', N'' at each point. Statics moves
    values and factors, frequency responses the pace.
    """

    blocks: Array  # where the matrices' entries stand, see `packing`: blocks of constraints, forces, strips, modal links, masses
    members: Array
    slots: Array
    row: Array
    col: Array
    mass: Array  # floats (slots + 1,): constant part of the mass matrix; modal links add their own
    mass_first: Array  # (n + 1,): the same, row by row
    mass_col: Array
    mass_value: Array  # floats
    weight: Array  # floats (n,): generalised forces of gravity
    modal: Array  # (k, 3): first coordinate, number of modes, where its numbers begin
    strips: Array  # (k, 5): kind, members of the basis, Gauss points, where its places (3 or 2 times members), numbers begin
    markers: Array  # (k, 7)
    places: Array  # coordinates of markers and strips
    measures: Array  # (k, 3): kind, marker a, marker b
    directions: Array  # floats (k, 3): of measures, and the coefficient of each in the constraint it is part of
    rows: Array  # (r, 3): first measure, motion or -1, number of measures whose sum it is
    values: Array  # floats (r,): what that sum is held to, motion aside
    motions: Array  # (k, 3): kind, address of position, of speed
    ramps: Array  # floats (k, 3): start, end, duration
    forces: Array  # (k, 7)
    factors: Array  # floats (k + 1,): each force is multiplied by its factor, gravity by the last
    pace: Array  # floats (1,): by how much faster all functions of time go
    elastic: Array
    """Inner coordinates of strips and modes, (k, 7): one, or two that are a vector (else -1), the group that shares a unit, and
    for vectors the coordinates (x, y, x, y) of the two ends of the chord across which they deform. Integrals of laws' states,
    with `STATE` in the place of a second coordinate."""
    laws: Array  # (k, 4): kind, addresses
    law_numbers: Array  # floats (k, 8)
    edges: Array  # floats (k, 2): force, and a value of its measure at which its law has a jump or kink
    data: Array  # floats: numbers of strips, markers, forces


class Instant(NamedTuple):
    """State of which forces are functions."""

    time: float  # [s]
    since: float  # time since the last accepted step, over which bristles bend; negative where they are states [s]
    q: Array  # (n,)
    v: Array  # (n,)
    lam: Array  # (r,): multipliers of the constraints
    memory: Array  # (forces, 4)


class Work(NamedTuple):
    """State to work in, one for each thread; what of `slope` is constant is written once."""

    state: Array  # (markers, 11)
    slope: Array  # (3, places): derivatives of (x, y, angle) of a marker by its coordinates
    drift: Array  # (3, places): derivatives of their rates by the coordinates
    grad: Array  # (6,): of one measure by (x, y, angle) of two markers
    hess: Array  # (6, 6)
    sway: Array  # (6,): Hessian times the markers' rates
    by_place: Array  # (6, 6): derivatives of one force on two markers by their places
    by_rate: Array  # (6, 6): and by their rates
    element: Array  # one strip's coordinates, rates and forces
    stiff: Array  # (m, m): one block's entries, m unknowns that the largest has
    damp: Array  # (m, m)
    mixed: Array  # (1,): which forces of strips are asked for, see `strips`
    stress: Array  # (points, 3): stresses at all strips' Gauss points
    slack: Array  # (points, 3): what these lack
    held: Array  # (points, 3, 4): gradients of the strains when tangents were last made
    strain: Array  # (points, 4): arguments of the strains, from forces to tangents
    force: Array  # (points, 3): weighted stresses, likewise
    reports: Array  # (forces, 8): of each force, in the columns above


def work_for(tables: Tables) -> Work:
    """Make room for these tables."""
    strip, points = int(tables.strips[:, 1].max(initial=1)), int(tables.strips[:, 2].sum())
    block = int(tables.blocks[:, 1].max(initial=1))
    markers, places, forces = len(tables.markers), len(tables.places), len(tables.forces)
    shapes: list[tuple[int, ...]] = [(markers, 11), (3, places), (3, places), (6,), (6, 6), (6,), (6, 6), (6, 6)]
    shapes += [(max(9 * strip, block),), (block, block), (block, block), (1,)]
    shapes += [(points, 3), (points, 3), (points, 3, 4), (points, 4), (points, 3), (forces, 8)]
    work = Work(*(np.zeros(shape) for shape in shapes))
    for i, (kind, _, size, first, _, data, _) in enumerate(tables.markers):
        if kind == GROUND:
            work.state[i, :3] = tables.data[data : data + 3]
        elif kind == FRAME:
            work.slope[[0, 1, 2], [first, first + 1, first + 2]] = 1.0
        elif kind == LINEAR:
            for row in range(3):
                here = slice(row * size, (row + 1) * size)
                work.slope[row, first:][here] = tables.data[data:][here]
    return work
