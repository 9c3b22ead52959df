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
    """A mechanism for the kernel.

    Attributes
    ----------
    blocks, members, slots, row, col : arrays of int
        Where the matrices' entries stand, see `buckler.mbs.spectral.packing`: blocks of constraints, then of forces, strips,
        modal links, masses.
    mass : array, shape (slots + 1,)
        Constant part of the mass matrix; modal links add their own.
    mass_first, mass_col, mass_value : arrays, shape (n + 1,), (entries,), (entries,)
        The same, row by row.
    weight : array, shape (n,)
        Generalised forces of gravity.
    modal : array of int, shape (k, 3)
        First coordinate, number of modes m, where its numbers begin: radial (m), gram (m, m), gyration (m, m), stiffness (m),
        damping (m).
    strips : array of int, shape (k, 5)
        Kind, members of the basis, Gauss points, where its places (3 or 2 times members) and its numbers begin: EA, GA, EI, two
        damping times; weights, stress-free strains (3) of each point; N, N', N'' at each point.
    markers : array of int, shape (k, 7)
    places : array of int
        Coordinates of markers and strips.
    measures : array of int, shape (k, 3)
        Kind, marker a, marker b.
    directions : array, shape (k, 3)
        Of measures, and the coefficient of each in the constraint it is part of.
    rows : array of int, shape (r, 3)
        Constraints: first measure, motion or -1, number of measures whose sum it is.
    values : array, shape (r,)
        What that sum is held to, motion aside. Statics moves them.
    motions : array of int, shape (k, 3)
        Kind, address of position, of speed.
    ramps : array, shape (k, 3)
        Start, end, duration.
    forces : array of int, shape (k, 7)
    factors : array, shape (k + 1,)
        Each force is multiplied by its factor, gravity by the last. Statics moves them.
    pace : array, shape (1,)
        By how much faster all functions of time go. Frequency responses move it.
    elastic : array of int, shape (k, 7)
        Inner coordinates of strips and modes: one, or two that are a vector (else -1), the group that shares a unit, and for
        vectors the coordinates (x, y, x, y) of the two ends of the chord across which they deform. Integrals of laws' states,
        with `STATE` in the place of a second coordinate.
    laws : array of int, shape (k, 4)
        Kind, addresses.
    law_numbers : array, shape (k, 8)
    data : array
        Numbers of strips, markers, forces.
    """

    blocks: Array
    members: Array
    slots: Array
    row: Array
    col: Array
    mass: Array
    mass_first: Array
    mass_col: Array
    mass_value: Array
    weight: Array
    modal: Array
    strips: Array
    markers: Array
    places: Array
    measures: Array
    directions: Array
    rows: Array
    values: Array
    motions: Array
    ramps: Array
    forces: Array
    factors: Array
    pace: Array
    elastic: Array
    laws: Array
    law_numbers: Array
    data: Array


class Instant(NamedTuple):
    """State of which forces are functions.

    Attributes
    ----------
    time : float
        [s].
    since : float
        Time since the last accepted step, over which bristles bend; negative where bristles are states [s].
    q, v : arrays, shape (n,)
        Coordinates and rates.
    lam : array, shape (r,)
        Multipliers of the constraints.
    memory : array, shape (forces, 4)
    """

    time: float
    since: float
    q: Array
    v: Array
    lam: Array
    memory: Array


class Work(NamedTuple):
    """RadauState to work in, one for each thread; what of `slope` is constant is written once.

    Attributes
    ----------
    state : array, shape (markers, 11)
    slope : array, shape (3, places)
        Derivatives of (x, y, angle) of a marker by its coordinates.
    drift : array, shape (3, places)
        Derivatives of their rates by the coordinates.
    grad, hess, sway : arrays, shape (6,), (6, 6), (6,)
        Of one measure by (x, y, angle) of two markers: gradient, Hessian, and that times the markers' rates.
    by_place, by_rate : arrays, shape (6, 6)
        Derivatives of one force on two markers by their places and rates.
    element : array
        One strip's coordinates, rates and forces.
    stiff, damp : arrays, shape (m, m)
        One block's entries, m unknowns that the largest has.
    mixed : array, shape (1,)
        Which forces of strips are asked for, see `strips`.
    stress, slack : array, shape (points, 3)
        Stresses at all strips' Gauss points, and what these lack.
    held : array, shape (points, 3, 4)
        Gradients of the strains when tangents were last made.
    strain, force : array, shape (points, 4), (points, 3)
        Arguments of the strains and weighted stresses, from forces to tangents.
    reports : array, shape (forces, 8)
        Of each force, in the columns above.
    """

    state: Array
    slope: Array
    drift: Array
    grad: Array
    hess: Array
    sway: Array
    by_place: Array
    by_rate: Array
    element: Array
    stiff: Array
    damp: Array
    mixed: Array
    stress: Array
    slack: Array
    held: Array
    strain: Array
    force: Array
    reports: Array


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
