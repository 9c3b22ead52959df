"""Lists of a mechanism's coordinates, markers, measures, constraints and forces, to which each element adds its own.

A marker is a point of a body with an angle; a measure is a length or an angle between two markers; a row is a constraint on
a sum of measures; a dof is the index of a coordinate in `q`. `packing` turns the lists into the arrays `Tables`.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from math import atan2
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..elements import Motion, Ramp
from ..elements.element import GROUND
from ..elements.load import Stateful
from ..functions import component_functions
from ..functions.values import has_user_code
from ..geometry import Array
from ..laws.compiled import function_pointer
from ..laws.contact import LawTable
from ..mechanism import Mechanism
from .tables import FORCE_NUMBERS, LAW_STATE, ForceKind, MarkerKind, MeasureKind, MotionKind, PushData

NO_LAW = -1
"""Index of the law of a force that has none: its numbers tell its value."""
Pair = tuple[float, float]
"""Coordinates (x, y) [m], or components of a direction."""


class Attached(NamedTuple):
    """Mass that elements attach to a link at a point; one with an inertia turns with the link."""

    point: str
    mass: float  # [kg]
    inertia: float  # [kg m^2]


class SeparateMass(NamedTuple):
    """Attached mass with coordinates of its own, as it cannot be added to its link's mass matrix: a point mass or a rotor."""

    dof: int  # its first coordinate
    link: str
    point: str
    is_rotor: bool = False


class MarkerRow(NamedTuple):
    """Marker, with the columns of `tables.Markers`; `add_marker` explains them by kind."""

    kind: int
    size: int  # number of modes or of basis functions
    first: int  # index of its first dof in `Builder.dofs`
    dof_count: int
    data: int  # index of its first number in `Builder.data`
    twin: int  # first marker on the same frame, or -1


class MeasureRow(NamedTuple):
    """Measure between markers a and b."""

    kind: int  # of `MeasureKind`
    a: int
    b: int
    direction: Pair
    factor: float  # in the sum that a constraint prescribes


class ConstraintRow(NamedTuple):
    """Constraint on the sum of consecutive measures, each times its factor."""

    name: str
    measures: range  # indices of the measures
    motion: int  # law of the drive's motion, or -1
    value: float | None  # prescribed value; None: that at t = 0


class ForceRow(NamedTuple):
    """Force between markers, with the columns of `tables.Forces` behind its name; an index that is absent is -1."""

    name: str
    kind: int  # of `ForceKind`: those before JOURNAL are along a measure, the others at markers
    a: int  # measure, or marker a
    b: int  # of kinds at markers: marker b; of friction along a face: the contact that presses
    law: int
    friction: int  # friction law
    row: int  # of friction in a guide: the constraint whose reaction presses
    numbers: int  # index of its first number in `Builder.data`


class BuiltBody(Protocol):
    """Body of a link, with its coordinates in the lists."""

    def marker(self, builder: Builder, point: str) -> int:
        """Return the marker of a point on the body."""


@dataclass
class Builder(LawTable):
    """Lists from which a mechanism's arrays are made; the columns of tuples are those of `tables`."""

    mechanism: Mechanism
    degree: int  # of the strips' polynomials
    bodies: dict[str, BuiltBody] = field(default_factory=dict)  # of each link, by name
    attached: dict[str, list[Attached]] = field(default_factory=dict)  # masses on each link, by name
    q: list[float] = field(default_factory=list)  # coordinates at t = 0
    masses: list[tuple[Array, Array]] = field(default_factory=list)  # blocks of the mass matrix: dofs, entries
    weights: list[tuple[Array, Array]] = field(default_factory=list)  # generalised forces of gravity: dofs, amounts
    modal: list[tuple[int, int, int]] = field(default_factory=list)  # columns of `Modal`
    strips: list[tuple[int, ...]] = field(default_factory=list)  # columns of `StripColumn`
    markers: list[MarkerRow] = field(default_factory=list)
    dofs: list[int] = field(default_factory=list)  # on which markers and strips depend
    measures: list[MeasureRow] = field(default_factory=list)
    rows: list[ConstraintRow] = field(default_factory=list)
    forces: list[ForceRow] = field(default_factory=list)
    data: list[float] = field(default_factory=list)  # numbers of markers, strips, modal links and forces, one after the other
    separate_masses: list[SeparateMass] = field(default_factory=list)
    state_rates: dict[int, float] = field(default_factory=dict)  # by dof whose rate is a law's state: this state at t = 0
    angles: set[int] = field(default_factory=set)  # dofs that are angles, with the unit 1 rad
    units: dict[int, float] = field(default_factory=dict)  # by dof, of modes and of states of laws
    elastic: list[tuple[int, ...]] = field(default_factory=list)  # columns of `Elastic`
    _marker_rows: dict[Hashable, int] = field(default_factory=dict)  # index of a marker by its columns and numbers
    _frames: dict[int, int] = field(default_factory=dict)  # by first dof of a frame: its first marker

    def add_coordinates(self, values: Sequence[float]) -> int:
        """Add coordinates with these values at t = 0; return the index of the first."""
        first = len(self.q)
        self.q += [float(x) for x in values]
        return first

    def add_mass(self, dofs: Sequence[int], block: Array) -> None:
        """Add a block to the mass matrix at these dofs."""
        self.masses.append((np.asarray(dofs, dtype=int), np.asarray(block, dtype=float)))

    def add_weight(self, dofs: Sequence[int], amounts: Array) -> None:
        """Add generalised forces of gravity at these dofs."""
        self.weights.append((np.asarray(dofs, dtype=int), np.asarray(amounts, dtype=float)))

    def add_numbers(self, *values: ArrayLike) -> int:
        """Append numbers to the data; return the index of the first."""
        first = len(self.data)
        for value in values:
            self.data += np.ravel(value).astype(float).tolist()
        return first

    def group_deformations(self, x: Sequence[int], y: Sequence[int] | None = None, chord: Sequence[int] = (-1,) * 4) -> None:
        """Group coordinates that are deformations of one body: single ones at the dofs x, or vectors at the dofs (x, y).

        The integrator scales their errors by a common unit, which grows with the largest deformation so far. The unit of a vector
        is for its component across the chord; its component along the chord keeps the unit of a length. `chord` has the dofs of
        x and y of the chord's start, then of its end; -1 stands for no chord, as single coordinates have none.
        """
        group = len(self.elastic)  # any number that no other group has
        self.elastic += [(int(i), int(j), group, *map(int, chord)) for i, j in zip(x, y or [-1] * len(x), strict=True)]

    def add_marker(self, kind: int, size: int, dofs: Sequence[int], numbers: ArrayLike) -> int:
        """Add a marker, or find an equal one; return its index.

        `size` is the number of modes or basis functions. The kind tells the order of `dofs` and of `numbers`:
        FRAME: dofs of the frame's x, y, angle and of the modes; place in the frame (2), added angle, mode shapes there (size, 3)
        in x, y, angle. The kernel computes cosine and sine of a frame once, for its first marker, which is the `twin` of others.
        LINEAR: dofs of the coordinates on which x, y, and the angle depend, `size` each; their factors (3, size).
        CURVE: dofs of the coefficients of x, then of y; values and derivatives of the basis functions (2, size).
        GROUND: no dofs; x, y and angle.
        """
        key = (kind, size, tuple(dofs), tuple(np.ravel(numbers).tolist()))
        if key in self._marker_rows:
            return self._marker_rows[key]
        index, twin = len(self.markers), -1
        if kind == MarkerKind.FRAME:
            twin = self._frames.get(dofs[0], -1)
            self._frames.setdefault(dofs[0], index)
        self.markers.append(MarkerRow(kind, size, len(self.dofs), len(dofs), self.add_numbers(numbers), twin))
        self.dofs += [int(p) for p in dofs]
        self._marker_rows[key] = index
        return index

    def add_ground(self, place: Pair = (0.0, 0.0)) -> int:
        """Add a marker fixed at a position [m], by default the origin; return its index."""
        return self.add_marker(MarkerKind.GROUND, 0, (), (*place, 0.0))

    def add_point(self, x: float, y: float, mass: float) -> int:
        """Add a point mass [kg] with coordinates of its own at (x, y) [m]; return its marker."""
        x_dof = self.add_coordinates((x, y))
        dofs = (x_dof, x_dof + 1)
        self.add_mass(dofs, mass * np.eye(2))
        self.add_weight(dofs, mass * np.array(self.mechanism.gravity))
        return self.add_marker(MarkerKind.LINEAR, 1, (*dofs, x_dof), [1.0, 1.0, 0.0])  # factor 0: the angle is 0

    def marker(self, link: str, point: str) -> int:
        """Return the marker of a point of a link, or of its position on the ground; '' is the link's start, or the origin."""
        if link == GROUND:
            return self.add_ground(self.mechanism.points[point]) if point else self.add_ground()
        return self.bodies[link].marker(self, point or self.mechanism.link(link).start)

    def angle_of(self, marker: int) -> float:
        """Compute the angle of a marker at t = 0 [rad]."""
        row = self.markers[marker]
        if row.kind == MarkerKind.GROUND:
            return self.data[row.data + 2]
        if row.kind == MarkerKind.FRAME:
            return self.q[self.dofs[row.first + 2]] + self.data[row.data + 2]  # the amplitudes of modes are 0 at t = 0

        def combine(component: int, factors: int) -> float:
            """Sum the coordinates of x, y or the angle (component 0, 1, 2) times the numbers of `data` from `factors` on."""
            first = row.first + component * row.size
            return sum(self.data[factors + i] * self.q[self.dofs[first + i]] for i in range(row.size))

        if row.kind == MarkerKind.LINEAR:
            return combine(2, row.data + 2 * row.size)
        slopes = row.data + row.size  # derivatives of the basis
        return atan2(combine(1, slopes), combine(0, slopes))

    def add_measure(self, kind: int, a: int, b: int, direction: Pair = (0.0, 0.0), factor: float = 1.0) -> int:
        """Add a measure of markers a and b, with its `factor` in the sum of a constraint; return its index."""
        if kind != MeasureKind.ANGLE:
            a = self._without_angle(a)
        if kind not in (MeasureKind.ANGLE, MeasureKind.TURNING):  # the direction of a TURNING measure turns with b
            b = self._without_angle(b)
        self.measures.append(MeasureRow(kind, a, b, direction, factor))
        return len(self.measures) - 1

    def _without_angle(self, marker: int) -> int:
        """Replace a marker on a Kirchhoff strip by one without angle, which depends on fewer coordinates."""
        row = self.markers[marker]
        if row.kind != MarkerKind.CURVE:
            return marker
        values = self.data[row.data : row.data + row.size]
        used = [i for i, value in enumerate(values) if abs(value) > 1e-15]  # basis functions that are not zero, up to rounding
        x, y = ([self.dofs[row.first + component * row.size + i] for i in used] for component in (0, 1))
        value, zeros = [values[i] for i in used], [0.0] * len(used)
        return self.add_marker(MarkerKind.LINEAR, len(used), [*x, *y, *x], [*value, *value, *zeros])  # the angle is always 0

    def add_row(self, name: str, measures: Sequence[int], motion: int = -1, value: float | None = None) -> None:
        """Constrain the sum of the last added `measures`, each times its factor, to a value plus a motion, the index of a law."""
        self.rows.append(ConstraintRow(name, range(measures[0], measures[0] + len(measures)), motion, value))

    def pin(self, name: str, a: int, b: int) -> None:
        """Constrain two markers to the same position."""
        if a != b:
            for direction in ((1.0, 0.0), (0.0, 1.0)):
                self.add_row(name, [self.add_measure(MeasureKind.FIXED, a, b, direction)], value=0.0)

    def add_motion(self, motion: Ramp | Motion, name: str) -> int:
        """Add the motion of a drive as a law: numbers of a ramp of its speed, or functions of time; return its index."""
        if isinstance(motion, Ramp):
            return self.add_law(None, MotionKind.RAMP, (motion.start, motion.end, motion.duration))
        functions = [function_pointer(component_functions(f, ["t"])[0], arguments=1) for f in (motion.position, motion.speed)]
        about = f"the motion of {name}" if has_user_code(motion) else ""  # only a user's function gets a note if it is slow
        return self.add_law(None, MotionKind.CALLED, (), functions, about)

    def add_stateful(self, name: str, load: Stateful, marker: int, column: int, offset: float) -> None:
        """Add a force or torque whose law has states. A state is the rate of a new coordinate of unit mass.

        `column` is the first column of the marker's state on which the load acts (`tables.State`): X for a force, which acts on X
        and Y, or ANGLE for a torque. `offset` is the value of this column at which the law's argument is 0. The laws of the
        load's components, then those of its states' rates, have consecutive indices. So have the markers of its states.
        """
        pointers = [function_pointer(each, len(load.variables)) for each in load.functions()]
        # the key None: laws are not shared; the kernel does not read their kind, as that of the force, STATEFUL, is enough
        laws = [self.add_law(None, ForceKind.LAW, (), [pointer], f"the function of {name}") for pointer in pointers]
        initial = load.states.initial  # type: ignore[union-attr]
        first = self.add_coordinates([0.0] * len(initial))
        dofs, group = range(first, first + len(initial)), len(self.elastic)  # any number that no other group has
        self.add_mass(dofs, np.eye(len(initial)))
        for i, state in zip(dofs, initial, strict=True):
            self.state_rates[i] = state
            self.units[i] = max(1.0, abs(state))  # until the state grows, see `radau.update_units`; 1: it may begin at 0
            self.elastic.append((i, LAW_STATE, group, -1, -1, -1, -1))  # LAW_STATE marks a rate that is a state; no chord
        states = [self.add_marker(MarkerKind.LINEAR, 1, (i,) * 3, (0.0, 0.0, 1.0)) for i in dofs]  # angle: the coordinate
        components = load.signature.size  # 2 of a force, 1 of a torque
        numbers = (column, components, len(initial), offset)
        self.add_force(name, ForceKind.STATEFUL, marker, states[0], law=laws[0], numbers=numbers)

    def add_force(
        self, name: str, kind: int, a: int, b: int = -1, *, law: int = NO_LAW, friction: int = NO_LAW, row: int = -1,
        numbers: Sequence[float] = (),
    ) -> int:  # fmt: skip
        """Add a force; return its index. Arguments are the fields of `ForceRow`, and `numbers` as its kind has them."""
        has_line = len(numbers) > PushData.HAS_LINE  # numbers from HAS_LINE on are given only with a fixed line of action
        if kind == ForceKind.POINT_FORCE and not has_line:
            a = self._without_angle(a)  # it has no moment, so the angle of its marker is not needed
        data = self.add_numbers(numbers, np.zeros(FORCE_NUMBERS - len(numbers)))
        self.forces.append(ForceRow(name, kind, a, b, law, friction, row, data))
        return len(self.forces) - 1
