"""Rows of the lists of a `Builder`; a dof is the index of a coordinate."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

Pair = tuple[float, float]
"""Coordinates (x, y) [m], or components of a direction."""


@dataclass(frozen=True)
class Attached:
    """Mass attached to a link at a point; one with an inertia turns with the link."""

    point: str
    mass: float  # [kg]
    inertia: float  # [kg m^2]


class SeparateMass(NamedTuple):
    """Attached mass that is no part of its link's mass block: a point mass or rotor with coordinates of its own."""

    dof: int  # its first coordinate
    link: str
    point: str
    is_rotor: bool = False


class MarkerRow(NamedTuple):
    """Marker, with the columns `Markers` as fields, where they are explained."""

    kind: int
    offset: int
    size: int
    first: int
    dof_count: int
    data: int
    twin: int


@dataclass
class MeasureRow:
    """Measure between markers a and b."""

    kind: int  # of `MeasureKind`
    a: int
    b: int
    direction: Pair
    factor: float = 1.0  # in the sum that a constraint prescribes


class MotionRow(NamedTuple):
    """Motion of a drive."""

    kind: int  # of `MotionKind`
    position: int = 0  # address of a function of time
    speed: int = 0  # address of a function of time
    ramp: tuple[float, float, float] = (0.0, 0.0, 1.0)  # speeds at start and end, duration; not read of other kinds


@dataclass
class ConstraintRow:
    """Constraint on the sum of consecutive measures, each times its factor."""

    name: str
    measures: range  # indices of the measures
    motion: int  # index of the drive's motion, or -1
    value: float | None  # prescribed value; None: that at t = 0


@dataclass
class ForceRow:
    """Force between markers, with the columns `Forces` as fields; an index that is absent is -1."""

    name: str
    kind: int  # of `ForceKind`
    a: int  # measure, or marker a
    b: int  # marker b, or the contact whose friction it is
    law: int
    friction: int  # friction law
    row: int  # constraint whose reaction is the normal force of its friction
    numbers: Sequence[float]  # in the order in which `lawtable` and `forces` read them for its kind
