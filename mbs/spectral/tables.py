"""Tables of the compiled kernel: whole numbers and floats, one row a thing, and the numbers that stand for its kind.

Nothing here knows an element of a mechanism. Markers are points of bodies with an angle; measures are lengths and angles between
two markers; rows are constraints on measures; forces act along measures or at markers.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..geometry import Array


class MarkerKind(IntEnum):
    """Kinds of markers."""

    GROUND = 0  # fixed
    FRAME = 1  # on a body with a frame: rigid, or with modes
    LINEAR = 2  # linear in a strip's coordinates
    CURVE = 3  # likewise, but its angle is the direction of the strip's slope


MeasureKind = IntEnum("MeasureKind", "FIXED TURNING ANGLE DISTANCE", start=0)
"""Kinds of measures of markers a and b: d.(a - b) with d fixed, or turning with b; angle a - b; distance."""
StripKind = IntEnum("StripKind", "REISSNER KIRCHHOFF", start=0)
"""Kinds of strips: with shear, without."""
MotionKind = IntEnum("MotionKind", "STEADY RAMP CALLED", start=0)
"""Kinds of motions of a drive: zero, a ramp of the speed, two functions by address."""


class ForceKind(IntEnum):
    """Kinds of forces: along a measure, and from `JOURNAL` on at markers."""

    SPRING = 0  # spring and damper
    CONTACT = 1  # against a face
    FRICTION_FORCE = 2  # friction given as a force
    FRICTION = 3  # friction of a constraint's reaction or of a contact
    STRUT = 4  # post-buckled
    PRESCRIBED = 5  # function of time
    LAW = 6  # function of time, measure and rate
    MOTOR = 7  # DC motor
    JOURNAL = 8  # pin in a bush
    POINT_FORCE = 9  # at a marker, direction fixed or turning with another
    STATEFUL = 10  # force or torque at a marker whose law has states


class Markers(IntEnum):
    """Columns of markers."""

    KIND = 0
    OFFSET = 1  # first coordinate
    SIZE = 2  # modes, or members of the basis
    FIRST = 3  # where its places begin
    COUNT = 4  # number of its places
    DATA = 5  # where its numbers begin
    TWIN = 6  # first marker of the same frame, or -1


Measures = IntEnum("Measures", "KIND A B", start=0)
"""Columns of measures: kind and both markers."""
RowColumn = IntEnum("RowColumn", "FIRST MOTION TERMS", start=0)
"""Columns of rows: first measure, motion or -1, number of measures."""
BlockColumn = IntEnum("BlockColumn", "MEMBERS WIDTH ENTRIES", start=0)
"""Columns of blocks: where its unknowns begin, how many, where its slots begin."""


class Forces(IntEnum):
    """Columns of forces."""

    KIND = 0
    A = 1  # measure, or marker
    B = 2  # marker; contact whose friction it is
    LAW = 3
    FRICTION = 4  # friction law
    ROW = 5  # constraint whose reaction it rubs by
    NUMBERS = 6  # where its numbers begin


Directions = IntEnum("Directions", "X Y FACTOR", start=0)
"""Columns of directions: of the measure in its second marker's axes, and its coefficient in its constraint."""
StatefulData = IntEnum("StatefulData", "FIRST COUNT STATES OFFSET", start=0)
"""Numbers of a force whose law has states: first column of its marker, columns, states, offset of the first column at t = 0."""
Elastic = IntEnum("Elastic", "FIRST SECOND GROUP START_X START_Y END_X END_Y", start=0)
"""Columns of `elastic`: coordinate, second one of an (x, y) pair or -1, group, coordinates of both ends of the pair's chord."""
Modal = IntEnum("Modal", "OFFSET MODES DATA", start=0)
"""Columns of the table of modal links: first coordinate, number of modes, index of its first number in `data`."""
STATE = -2
"""Mark in place of an inner coordinate's second one: it is the integral of a law's state."""
State = IntEnum("State", "X Y ANGLE VX VY SPIN AX AY SPIN_BIAS COS SIN", start=0)
"""Columns of a marker's state: place, angle, rates, second rates at zero coordinate acceleration, direction of the frame."""


class Report(IntEnum):
    """Columns of a force's report."""

    VALUE = 0
    FRICTION = 1
    LENGTH = 2  # measure or depth
    RATE = 3
    SLIP = 4  # sliding speed
    BRISTLE = 5  # bristle
    FX = 6
    FY = 7


class Memory(IntEnum):
    """Columns of a force's memory, kept from step to step."""

    ONSET = 0  # onset speed of a contact [m/s]
    BRISTLE = 1  # deflection of a bristle at the last accepted step [m]
    SLIDING = 2  # sliding speed at the last accepted step [m/s]
    FASTEST = 3  # fastest onset so far [m/s]
    STEP_START = 3  # in rows of a run, instead of it: time of the last accepted step, from which bristles move on [s]


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
    time_factor: Array  # floats (1,): by how much faster all functions of time go
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
    jacobian: Array  # (3, places): derivatives of (x, y, angle) of a marker by its coordinates
    jacobian_rate: Array  # (3, places): derivatives of their rates by the coordinates
    grad: Array  # (6,): of one measure by (x, y, angle) of two markers
    hess: Array  # (6, 6)
    hess_rate: Array  # (6,): Hessian times the markers' rates
    by_place: Array  # (6, 6): derivatives of one force on two markers by their places
    by_rate: Array  # (6, 6): and by their rates
    scratch: Array  # one strip's coordinates, rates and forces
    block_stiffness: Array  # (m, m): one block's entries, m unknowns that the largest has
    block_damping: Array  # (m, m)
    strip_form: Array  # (1,): which forces of strips are asked for, see `strips`
    stress: Array  # (points, 3): stresses at all strips' Gauss points
    slack: Array  # (points, 3): what these lack
    b0: Array  # (points, 3, 4): gradients of the strains when tangents were last made
    arguments: Array  # (points, 4): arguments of the strains, from forces to tangents
    weighted_stress: Array  # (points, 3): weighted stresses, likewise
    reports: Array  # (forces, 8): columns of `Report`


def allocate_work(tables: Tables) -> Work:
    """Make room for these tables."""
    strip, points = int(tables.strips[:, 1].max(initial=1)), int(tables.strips[:, 2].sum())
    block = int(tables.blocks[:, 1].max(initial=1))
    markers, places, forces = len(tables.markers), len(tables.places), len(tables.forces)
    shapes: list[tuple[int, ...]] = [(markers, 11), (3, places), (3, places), (6,), (6, 6), (6,), (6, 6), (6, 6)]
    shapes += [(max(9 * strip, block),), (block, block), (block, block), (1,)]
    shapes += [(points, 3), (points, 3), (points, 3, 4), (points, 4), (points, 3), (forces, 8)]
    work = Work(*(np.zeros(shape) for shape in shapes))
    for i, (kind, _, size, first, _, data, _) in enumerate(tables.markers):
        if kind == MarkerKind.GROUND:
            work.state[i, :3] = tables.data[data : data + 3]
        elif kind == MarkerKind.FRAME:
            work.jacobian[[0, 1, 2], [first, first + 1, first + 2]] = 1.0
        elif kind == MarkerKind.LINEAR:
            for row in range(3):
                here = slice(row * size, (row + 1) * size)
                work.jacobian[row, first:][here] = tables.data[data:][here]
    return work
