"""Tables of the compiled kernel: arrays with one row for each marker, measure, constraint or force, and names of their columns.

A marker is a point of a body with an angle. A measure is a length or an angle between two markers a and b. A constraint holds a
sum of measures to a value. A force acts along a measure or at markers. A dof is the index of a coordinate. Numbers whose count
varies are in one array, `data`; a column of the row has the index of the first.

A matrix of the mechanism is a sum of blocks, small matrices of one constraint, force, strip, ... each. A slot is a nonzero of
the sum. Entries of blocks that are always zero have no slot of their own: arrays over the slots have one entry more, which takes
them and is never read.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..geometry import Array


class MarkerKind(IntEnum):
    """Kinds of markers."""

    GROUND = 0  # fixed
    FRAME = 1  # on a body with a frame: rigid, or with modes
    LINEAR = 2  # x, y, angle are sums over `SIZE` coordinates each, with factors: on a Reissner strip, or a point mass;
    # a rotor and a law's state (`stateful`) have one coordinate, the angle: its factors in x and y are 0
    CURVE = 3  # on a Kirchhoff strip: its angle is the direction of the tangent


MeasureKind = IntEnum("MeasureKind", "FIXED TURNING ANGLE DISTANCE", start=0)
"""Kinds of measures: d.(a - b) with a direction d that is fixed, or turns with b; angle of a less that of b; distance."""
StripKind = IntEnum("StripKind", "REISSNER KIRCHHOFF", start=0)
"""Kinds of strips: with shear, and without."""
StripColumn = IntEnum("StripColumn", "KIND FUNCTIONS POINTS FIRST NUMBERS FIRST_POINT", start=0)
"""Columns of strips: KIND; count of basis FUNCTIONS, of Gauss POINTS; index of the FIRST dof in `dofs`, of NUMBERS in `data`;
FIRST_POINT, index of its first Gauss point among those of all strips."""
StripData = IntEnum("StripData", "EA GA EI BENDING_TIME AXIAL_TIME WEIGHTS", start=0)
"""Indices of a strip's numbers, from its first on: stiffnesses EA, GA, EI; damping times [s]; weights (ng,). Behind the weights
are, for nb basis functions at ng Gauss points, the stress-free strains (3, ng), and values, first and second derivatives of the
functions, (3, ng, nb)."""
MotionKind = IntEnum("MotionKind", "RAMP CALLED", start=0)
"""Kinds of motions of a drive, laws whose numbers are speed at start and end of a RAMP, and its duration; or whose functions of
time, CALLED at their addresses, are position and speed."""


class ForceKind(IntEnum):
    """Kinds of forces: along a measure, and from `JOURNAL` on at markers."""

    SPRING = 0  # linear spring and damper
    CONTACT = 1  # of a point with a face
    GUIDE_FRICTION = 2  # of a `GuideFriction`: function of the sliding speed alone
    FRICTION = 3  # coefficient of friction times the normal force of a constraint or of a contact
    STRUT = 4  # post-buckled strip without mass
    PRESCRIBED = 5  # constant, or a function of time
    LAW = 6  # function of time, measure and rate
    MOTOR = 7  # DC motor
    JOURNAL = 8  # contact of a pin in a bush
    POINT_FORCE = 9  # at marker a, in a fixed direction or one that turns with marker b
    STATEFUL = 10  # force or torque at a marker whose law has states


class Markers(IntEnum):
    """Columns of markers."""

    KIND = 0
    SIZE = 1  # number of modes, or of basis functions
    FIRST = 2  # index of its first dof in `dofs`
    COUNT = 3  # number of its dofs
    DATA = 4  # index of its first number
    TWIN = 5  # first marker on the same frame, whose cosine and sine are copied; -1 in this marker itself


Measures = IntEnum("Measures", "KIND A B", start=0)
"""Columns of measures: kind, markers a and b."""
RowColumn = IntEnum("RowColumn", "FIRST MOTION TERMS", start=0)
"""Columns of rows: first measure, law of a drive's motion or -1, number of measures whose sum is constrained."""
BlockColumn = IntEnum("BlockColumn", "FIRST WIDTH ENTRIES", start=0)
"""Columns of blocks: FIRST index in `block_unknowns`; WIDTH, number of unknowns; index of its ENTRIES in `slots`."""


class Forces(IntEnum):
    """Columns of forces."""

    KIND = 0
    A = 1  # measure, or marker a
    B = 2  # marker b, or the contact whose friction it is
    LAW = 3  # index of its law, or -1
    FRICTION = 4  # index of its friction law, or -1
    ROW = 5  # constraint whose reaction is the normal force of its friction, or -1
    NUMBERS = 6  # index of its first number


MeasureNumber = IntEnum("MeasureNumber", "X Y FACTOR", start=0)
"""Columns of `measure_numbers`: direction d of a measure, and its coefficient in the constraint that it is part of."""
FORCE_NUMBERS = 7
"""Numbers of each force in `data`, the unused ones zero; `MOTOR` has the most. Those of forces along a measure are read in
`lawtable.evaluate_along`; of others they are `forces.JournalData` and the two below."""
PushData = IntEnum("PushData", "X Y ANGLE HAS_LINE LINE_X LINE_Y", start=0)
"""Numbers of a POINT_FORCE: its components; angle of marker b at t = 0; 1 if its line of action goes through a fixed point, else
0; this point."""
StatefulData = IntEnum("StatefulData", "FIRST COUNT STATES OFFSET", start=0)
"""Numbers of a force whose law has states: FIRST, State.X for a force (x, y), State.ANGLE for a torque; COUNT of components, 2 or
1; count of STATES; OFFSET, subtracted from the first argument: the angle at t = 0, or 0 for a force."""
Elastic = IntEnum("Elastic", "FIRST SECOND GROUP START_X START_Y END_X END_Y", start=0)
"""Columns of `elastic`, deformations to which the error control gives units of their own (`radau.update_units`). A row is one
coordinate, of dof FIRST, with SECOND = -1; or a vector, of dofs FIRST in x and SECOND in y, of a strip's piece. Rows of a GROUP
have a common unit. START_X to END_Y are the dofs of the ends of the piece, between which its chord lies; else -1."""
Modal = IntEnum("Modal", "OFFSET MODES DATA", start=0)
"""Columns of modal links: first dof, number of modes, index of the first number."""
LAW_STATE = -2
"""Mark in the column `Elastic.SECOND`: the rate of coordinate FIRST is a law's state, as equations are of second order."""
State = IntEnum("State", "X Y ANGLE VX VY SPIN AX AY SPIN_BIAS COS SIN", start=0)
"""Columns of a marker's state: position and angle; their rates; AX, AY, SPIN_BIAS, the part of their second rates that is due to
the coordinates' rates v alone (quadratic in v); cosine and sine of the frame's angle."""


class Report(IntEnum):
    """Columns of a force's report."""

    VALUE = 0  # force along the measure or normal force, magnitude of others [N or N m]
    FRICTION = 1  # friction force of a pin in its bush [N]
    LENGTH = 2  # measure, or depth of a pin in its bush [m or rad]
    RATE = 3  # rate of the measure or depth
    SLIP = 4  # sliding speed [m/s]
    BRISTLE = 5  # deflection of the bristle [m]
    FX = 6  # force at a marker [N]; of a pin the direction of the normal
    FY = 7


class Memory(IntEnum):
    """Columns of a force's memory, which a step leaves to the next; rows of `Output` have `STEP_START` as the last column."""

    ONSET = 0  # onset speed of a contact [m/s]
    BRISTLE = 1  # deflection of a bristle at the last accepted step [m]
    SLIDING = 2  # sliding speed at the last accepted step [m/s]
    FASTEST = 3  # fastest onset so far [m/s]


STEP_START = 3
"""Column of memories in `Output` in place of `Memory.FASTEST`: time of BRISTLE and SLIDING, the start of the step [s]."""


class Tables(NamedTuple):
    """Mechanism for the kernel, with n coordinates and r rows of constraints: integers, but where floats are named.

    Numbers of a strip are `StripData`. Those of a modal link of m modes are the integrals radial (m) of X . phi_i dm, gram (m, m)
    of phi_i . phi_j dm, gyration (m, m) of phi_i x phi_j dm; then stiffness (m) and damping (m). X is the position in the frame,
    phi_i a mode shape. Statics changes `values`, `factors` and the time factor.
    """

    blocks: Array  # (k, 3): columns of `BlockColumn`; blocks of constraints, forces, strips, modal links, masses, in this order
    block_unknowns: Array  # (sum of widths,): unknowns of all blocks, one block after the other
    slots: Array  # (sum of squares of widths,): slot of each entry of all blocks, in a block row by row
    row: Array  # (slots,): row of each slot in the matrix of all unknowns
    col: Array  # (slots,): column of each slot
    mass: Array  # floats (slots + 1,): constant part of the mass matrix
    mass_first: Array  # (n + 1,): the same as compressed sparse rows: index of each row's first entry
    mass_col: Array  # columns of the entries
    mass_value: Array  # floats: entries
    weight: Array  # floats (n,): generalised forces of gravity
    modal: Array  # (k, 3): columns of `Modal`
    strips: Array  # (k, 6): columns of `StripColumn`
    markers: Array  # (k, 6): columns of `Markers`
    dofs: Array  # dofs on which markers and strips depend; of a strip those of x, of y and, if it shears, of the angle
    measures: Array  # (k, 3): columns of `Measures`
    measure_numbers: Array  # floats (k, 3): columns of `MeasureNumber`, one row for each measure
    rows: Array  # (r, 3): columns of `RowColumn`
    values: Array  # floats (r,): value at which each sum is held; the travel of a drive comes on top
    forces: Array  # (k, 7): columns of `Forces`
    factors: Array  # floats (k + 1,): factors of the forces, then that of gravity
    time_factor: Array  # floats (1,): functions of time are taken at time_factor * t
    elastic: Array  # (k, 7): columns of `Elastic`; inner coordinates of strips and modes, integrals of laws' states
    laws: Array  # (k, 3): columns of `laws.table.LawColumn`: laws of forces, motions of drives
    law_numbers: Array  # floats (k, 8): parameters of laws in the order of their kind
    edges: Array  # floats (k, 2): force, and a value of its measure at which its law has a jump or kink
    data: Array  # floats: numbers of strips, modal links, markers, forces


class Instant(NamedTuple):
    """Arguments of the forces at one instant."""

    time: float  # [s]
    since: float  # time since the instant of `memory`, over which bristles deflect; -1 if they are integrated as states [s]
    q: Array  # coordinates, (n,)
    v: Array  # rates, (n,)
    lam: Array  # multipliers of the constraints, (r,)
    memory: Array  # (forces, 4): columns of `Memory`


class Work(NamedTuple):
    """Work arrays of the kernel, one set for each thread; constant entries of `jacobian` are written once, by `allocate_work`."""

    state: Array  # (markers, 11): columns of `State`
    jacobian: Array  # (3, dofs): derivatives of (x, y, angle) of a marker by its coordinates
    jacobian_rate: Array  # (3, dofs): derivatives of their rates by the coordinates
    grad: Array  # (6,): gradient of one measure by (x, y, angle) of markers a and b
    hess: Array  # (6, 6): its Hessian
    hess_rate: Array  # (6,): this Hessian times the markers' rates
    by_place: Array  # (6, 6): derivatives of one force on two markers by their (x, y, angle)
    by_rate: Array  # (6, 6): derivatives of the same force by the rates of these
    scratch: Array  # temporary: coordinates, rates, forces of one strip; or arguments of a law, couplings of modes, a gradient
    block_stiffness: Array  # (m, m): entries of one block of K, m the unknowns of the largest block
    block_damping: Array  # (m, m): entries of the same block of C
    strip_form: Array  # (1,): how `strips` computes forces: `strips.PLAIN`, MIXED or RENEWED
    stress: Array  # (points, 3): N, Q, M at the Gauss points of all strips; in the mixed form, unknowns of Newton's method
    stress_residual: Array  # (points, 3): stresses that the strains give, less `stress`
    # (points, 3, 4): derivatives of strains by their arguments when Newton's matrices were last computed
    kept_gradients: Array
    # (points, 4): arguments of strains, x', y' and of Reissner theta, theta', of Kirchhoff x'', y''; kept from forces to tangents
    strain_arguments: Array
    weighted_stress: Array  # (points, 3): weights of quadrature times stresses, kept from forces to tangents
    reports: Array  # (forces, 8): columns of `Report`


def allocate_work(tables: Tables) -> Work:
    """Allocate the work arrays for these tables."""
    functions = int(tables.strips[:, StripColumn.FUNCTIONS].max(initial=1))
    points = int(tables.strips[:, StripColumn.POINTS].sum())
    block = int(tables.blocks[:, BlockColumn.WIDTH].max(initial=1))
    dofs, z = len(tables.dofs), np.zeros
    of_strip = 3 * 3 * functions  # coordinates, rates, forces of up to three fields
    work = Work(
        state=z((len(tables.markers), len(State))), jacobian=z((3, dofs)), jacobian_rate=z((3, dofs)),
        grad=z(6), hess=z((6, 6)), hess_rate=z(6), by_place=z((6, 6)), by_rate=z((6, 6)), scratch=z(max(of_strip, block)),
        block_stiffness=z((block, block)), block_damping=z((block, block)), strip_form=z(1), stress=z((points, 3)),
        stress_residual=z((points, 3)), kept_gradients=z((points, 3, 4)), strain_arguments=z((points, 4)),
        weighted_stress=z((points, 3)), reports=z((len(tables.forces), len(Report))),
    )  # fmt: skip
    for i, (kind, size, first, _count, data, _twin) in enumerate(tables.markers):
        if kind == MarkerKind.GROUND:
            work.state[i, :3] = tables.data[data : data + 3]
        elif kind == MarkerKind.FRAME:
            work.jacobian[:, first : first + 3] = np.eye(3)  # by x, y and angle of the frame
        elif kind == MarkerKind.LINEAR:
            for row in range(3):
                columns = slice(row * size, (row + 1) * size)
                work.jacobian[row, first:][columns] = tables.data[data:][columns]
    return work
