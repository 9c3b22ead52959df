"""Collects a mechanism's coordinates, markers, constraints and forces, as elements of each kind add them; `packing` follows."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from math import atan2
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..elements import Motion, Ramp
from ..elements.load import Stateful
from ..functions import numbers_of
from ..functions.values import has_user_code
from ..geometry import Array
from ..laws.compiled import Pointer, function_pointer
from ..mechanism import Mechanism
from .tables import STATE, ForceKind, MarkerKind, MeasureKind, MotionKind

Pair = tuple[float, float]
GROUND = "ground"


class BuiltBody(Protocol):
    """Body of a link in the arrays."""

    def marker(self, builder: Builder, point: str) -> int:
        """Marker of a point on it."""


@dataclass(frozen=True)
class Attached:
    """A mass attached to a link at a point; one with an inertia turns with the link."""

    point: str
    mass: float
    inertia: float = 0.0


@dataclass
class ConstraintRow:
    """A constraint: name, first measure, drive or -1, prescribed value (None: that at t = 0), number of its measures."""

    name: str
    measure: int
    motion: int
    value: float | None
    count: int = 1

    @property
    def measures(self) -> range:
        """The measures whose sum it is."""
        return range(self.measure, self.measure + self.count)


@dataclass
class ForceRow:
    """A force: name, kind, markers (or a measure in `a`), laws, constraint whose reaction it follows, numbers."""

    name: str
    kind: int
    a: int
    b: int
    law: int
    friction: int
    row: int
    numbers: Sequence[float]


@dataclass
class Builder:
    """Lists from which a mechanism's arrays are made."""

    mechanism: Mechanism
    degree: int  # of the strips' polynomials
    bodies: dict[str, BuiltBody] = field(default_factory=dict)  # of each link, by name
    attached: dict[str, list[Attached]] = field(default_factory=dict)  # masses on each link, by name
    notes: list[str] = field(default_factory=list)  # sentences for the summary: what could not be compiled
    q: list[float] = field(default_factory=list)
    masses: list[tuple[Array, Array]] = field(default_factory=list)
    weights: list[tuple[Array, Array]] = field(default_factory=list)
    modal: list[tuple[int, int, int]] = field(default_factory=list)
    strips: list[tuple[int, int, int, int, int]] = field(default_factory=list)
    markers: list[tuple[int, int, int, int, int, int, int]] = field(default_factory=list)
    places: list[int] = field(default_factory=list)
    measures: list[tuple[int, int, int]] = field(default_factory=list)
    directions: list[tuple[float, float, float]] = field(default_factory=list)
    rows: list[ConstraintRow] = field(default_factory=list)
    motions: list[tuple[int, int, int]] = field(default_factory=list)
    ramps: list[tuple[float, float, float]] = field(default_factory=list)
    forces: list[ForceRow] = field(default_factory=list)
    laws: list[tuple[int, int, int, int]] = field(default_factory=list)
    law_numbers: list[list[float]] = field(default_factory=list)
    data: list[float] = field(default_factory=list)
    loose: list[tuple[int, str, str, bool]] = field(default_factory=list)
    rates: dict[int, float] = field(default_factory=dict)
    owners: list[Pointer] = field(default_factory=list)
    units: dict[int, float] = field(default_factory=dict)
    elastic: list[tuple[int, ...]] = field(default_factory=list)
    _law_rows: dict[Hashable, int] = field(default_factory=dict)
    _marker_rows: dict[Hashable, int] = field(default_factory=dict)
    _frames: dict[int, int] = field(default_factory=dict)

    # --- coordinates and masses ---------------------------------------------------------------------------------------

    def coordinates(self, values: Sequence[float]) -> int:
        """Add coordinates with these values at t = 0; returns the number of the first."""
        first = len(self.q)
        self.q += [float(x) for x in values]
        return first

    def angles(self, *places: int) -> None:
        """Mark coordinates as angles, whose unit is 1 rad; that of others is the mechanism's length."""
        self.units |= dict.fromkeys(places, 1.0)

    def mass(self, places: Sequence[int], block: Array) -> None:
        """Add a block of the mass matrix."""
        self.masses.append((np.asarray(places, dtype=int), np.asarray(block, dtype=float)))

    def weigh(self, places: Sequence[int], amounts: Array) -> None:
        """Add generalised weights."""
        self.weights.append((np.asarray(places, dtype=int), np.asarray(amounts, dtype=float)))

    def numbers(self, *values: ArrayLike) -> int:
        """Append numbers to the data; returns where they begin."""
        first = len(self.data)
        for value in values:
            self.data += np.ravel(value).astype(float).tolist()
        return first

    # --- markers and measures -----------------------------------------------------------------------------------------

    def deforms(self, one: Sequence[int], other: Sequence[int] | None = None, chord: Sequence[int] = (-1,) * 4) -> None:
        """Mark coordinates as deformations of one body, with a common unit: single, or (x, y) pairs, taken across a chord."""
        group = 1 + max((row[2] for row in self.elastic), default=-1)
        pairs = zip(one, other or [-1] * len(one), strict=True)
        self.elastic += [(int(i), int(j), group, *map(int, chord)) for i, j in pairs]

    def add_marker(self, kind: int, offset: int, size: int, places: Sequence[int], numbers: ArrayLike) -> int:
        """Add a marker, or find the same one."""
        key = (kind, offset, size, tuple(places), tuple(np.ravel(numbers).tolist()))
        if key not in self._marker_rows:
            first, data = len(self.places), self.numbers(numbers)
            self.places += [int(p) for p in places]
            here = len(self.markers)
            twin = self._frames.setdefault(offset, here) if kind == MarkerKind.FRAME else here
            self.markers.append((kind, offset, size, first, len(places), data, twin if twin < here else -1))
            self._marker_rows[key] = len(self.markers) - 1
        return self._marker_rows[key]

    def ground(self, place: Pair) -> int:
        """Add a marker fixed at a place."""
        return self.add_marker(MarkerKind.GROUND, 0, 0, (), (*place, 0.0))

    def point(self, x: float, y: float, mass: float) -> int:
        """Add a free point with mass; returns its marker."""
        o = self.coordinates((x, y))
        self.mass((o, o + 1), mass * np.eye(2))
        self.weigh((o, o + 1), mass * np.array(self.mechanism.gravity))
        return self.add_marker(MarkerKind.LINEAR, o, 1, (o, o + 1, o), [1.0, 1.0, 0.0])

    def marker(self, link: str, point: str) -> int:
        """Return the marker of a point of a link, or of its place on the ground."""
        return self.ground(self.mechanism.points[point]) if link == GROUND else self.bodies[link].marker(self, point)

    def angle_of(self, marker: int) -> float:
        """Angle of a marker at t = 0, rad."""
        kind, offset, size, first, _, data, _ = self.markers[marker]
        if kind == MarkerKind.GROUND:
            return self.data[data + 2]
        if kind == MarkerKind.FRAME:
            return self.q[offset + 2] + self.data[data + 2]
        fields = [self.places[first + i * size : first + (i + 1) * size] for i in range(3 if kind == MarkerKind.LINEAR else 2)]
        if kind == MarkerKind.LINEAR:
            return sum(self.data[data + 2 * size + i] * self.q[p] for i, p in enumerate(fields[2]))
        x, y = (sum(self.data[data + size + i] * self.q[p] for i, p in enumerate(field)) for field in fields)
        return atan2(y, x)

    def add_measure(self, kind: int, one: int, other: int, direction: Pair = (0.0, 0.0)) -> int:
        """Add a measure of markers a and b."""
        one = self._without_angle(one) if kind != MeasureKind.ANGLE else one
        other = self._without_angle(other) if kind in (MeasureKind.FIXED, MeasureKind.DISTANCE) else other
        self.measures.append((kind, one, other))
        self.directions.append((float(direction[0]), float(direction[1]), 1.0))
        return len(self.measures) - 1

    def _without_angle(self, marker: int) -> int:
        """Return a marker at the same place without angle, if its angle depends on more coordinates than the place."""
        kind, _, size, first, _, data, _ = self.markers[marker]
        if kind != MarkerKind.CURVE:
            return marker
        used = [i for i in range(size) if abs(self.data[data + i]) > 1e-15]
        x, y = ([self.places[first + field * size + i] for i in used] for field in (0, 1))
        value = [self.data[data + i] for i in used]
        return self.add_marker(MarkerKind.LINEAR, 0, len(used), [*x, *y, *x], [*value, *value, *[0.0] * len(used)])

    def add_row(self, name: str, terms: Sequence[tuple[float, int]], motion: int = -1, value: float | None = None) -> int:
        """Constrain a sum of coefficients times consecutive measures to a value (None: that at t = 0) plus a drive's motion."""
        for share, measure in terms:
            self.directions[measure] = (*self.directions[measure][:2], share)
        self.rows.append(ConstraintRow(name, terms[0][1], motion, value, len(terms)))
        return len(self.rows) - 1

    def pin(self, name: str, one: int, other: int) -> None:
        """Constrain two markers to one place."""
        if one != other:
            for direction in ((1.0, 0.0), (0.0, 1.0)):
                self.add_row(name, [(1.0, self.add_measure(MeasureKind.FIXED, one, other, direction))], value=0.0)

    # --- laws, drives, forces -----------------------------------------------------------------------------------------

    def add_law(
        self, key: Hashable, kind: int, numbers: Sequence[float], pointers: Sequence[Pointer] = (), about: str = ""
    ) -> int:
        """Add a row to the table of laws, or find the one with this key."""
        if key is not None and key in self._law_rows:
            return self._law_rows[key]
        addresses = [p.address for p in pointers]
        self.laws.append((kind, *addresses, *[0] * (3 - len(addresses))))  # type: ignore[arg-type]
        self.law_numbers.append([*map(float, numbers), *[0.0] * (8 - len(numbers))])
        self.owners += list(pointers)
        if not all(p.compiled for p in pointers):
            self.notes.append(f"{about} is not plain arithmetic: it is called back in Python, some fifty times slower")
        if key is not None:
            self._law_rows[key] = len(self.laws) - 1
        return len(self.laws) - 1

    def add_motion(self, motion: Ramp | Motion, name: str) -> int:
        """Add the motion of a drive: a ramp of its speed, or functions of time."""
        if isinstance(motion, Ramp):
            self.motions.append((MotionKind.RAMP, 0, 0))
            self.ramps.append((motion.start, motion.end, motion.duration))
        else:
            functions = [function_pointer(numbers_of(f, ["t"])[0], 1) for f in (motion.position, motion.speed)]
            if has_user_code(motion) and not all(p.compiled for p in functions):  # users cannot mend our integral
                self.notes.append(f"the motion of {name} is not plain arithmetic: it is called back in Python")
            self.owners += functions
            self.motions.append((MotionKind.CALLED, functions[0].address, functions[1].address))
            self.ramps.append((0.0, 0.0, 1.0))
        return len(self.motions) - 1

    def add_stateful(self, name: str, load: Stateful, marker: int, column: int, offset: float) -> None:
        """Add a force or torque whose law has states; `column` is the first of its marker's state on which it acts: X or TURN."""
        pointers = [function_pointer(each, len(load.variables)) for each in load.functions()]
        laws = [self.add_law(None, ForceKind.LAW, (), [pointer], f"the function of {name}") for pointer in pointers]
        initial = load.states.initial  # type: ignore[union-attr]
        first = self.coordinates([0.0] * len(initial))
        places = range(first, first + len(initial))
        self.mass(places, np.eye(len(initial)))
        self.rates |= dict(zip(places, initial, strict=True))
        self.units |= {i: max(1.0, abs(x)) for i, x in self.rates.items()}
        group = 1 + max((row[2] for row in self.elastic), default=-1)
        self.elastic += [(i, STATE, group, -1, -1, -1, -1) for i in places]
        states = [self.add_marker(MarkerKind.LINEAR, i, 1, (i, i, i), (0.0, 0.0, 1.0)) for i in places]
        numbers = (column, load.law.size, len(initial), offset)
        self.add_force(name, ForceKind.STATEFUL, marker, states[0], law=laws[0], numbers=numbers)

    def add_force(
        self, name: str, kind: int, one: int, other: int = -1, *, law: int = -1, friction: int = -1, row: int = -1,
        numbers: Sequence[float] = (),
    ) -> int:  # fmt: skip
        """Add a force; returns its row."""
        one = (
            self._without_angle(one) if kind == ForceKind.POINT_FORCE and len(numbers) == 3 else one
        )  # with a fixed line it turns, too
        self.forces.append(ForceRow(name, kind, one, other, law, friction, row, numbers))
        return len(self.forces) - 1
