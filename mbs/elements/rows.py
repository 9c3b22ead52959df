"""Constraints as rows, from which solvers build their constraints: sums of coefficients times measures of two bodies."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from .element import GROUND, Place


@dataclass(frozen=True)
class Along:
    """Relative position along a direction, direction . (r1 - r2) [m], of the points `first` at r1 and `second` at r2."""

    first: Place
    second: Place
    direction: tuple[float, float]  # at t = 0
    turns: bool = False  # True if the direction turns with the second body


@dataclass(frozen=True)
class Turn:
    """Relative angle: angle of first - angle of second [rad], each at a point, as the angle of a strip varies along it."""

    first: Place
    second: Place  # the angle of the ground is zero at any point, and at none


@dataclass(frozen=True)
class Distance:
    """Distance of two points [m], which must not coincide."""

    first: Place
    second: Place


Measure = Along | Turn | Distance


@dataclass(frozen=True)
class Row:
    """One equation: a sum of coefficients times measures is constant, or follows the motion of a drive."""

    terms: tuple[tuple[float, Measure], ...]  # each a coefficient and its measure
    motion: Any = None  # `Motion` or `Ramp` of the drive
    start_only: bool = False  # True if it holds at t = 0 only, as for a pin that is centred in its bush at the start

    @property
    def bodies(self) -> set[str]:
        """Bodies that the equation constrains, the ground included."""
        return {end.body for _, measure in self.terms for end in (measure.first, measure.second)}


def row(measure: Measure, motion: object = None, *, start_only: bool = False) -> Row:
    """Return the row of a single measure with coefficient 1."""
    return Row(((1.0, measure),), motion, start_only)


def yield_pin(point: str, first: str, second: str, *, start_only: bool = False) -> Iterator[Row]:
    """Yield the two rows of a pin: two bodies share a point, in x and in y."""
    for direction in ((1.0, 0.0), (0.0, 1.0)):
        yield row(Along(Place(first, point), Place(second, point), direction), start_only=start_only)


def find_pin(rows: Sequence[Row]) -> Along | None:
    """Return the first measure of rows that are a pin, or a pin and constant angles, for which Exudyn has joints; else None."""
    pin = next((measure for row in rows for _, measure in row.terms), None)
    if not isinstance(pin, Along) or pin.first.point != pin.second.point:
        return None
    turns = [measure for row in rows[2:] for _, measure in row.terms if isinstance(measure, Turn)]
    expected = [*yield_pin(pin.first.point, pin.first.body, pin.second.body), *map(row, turns)]
    return pin if list(rows) == expected else None


def yield_line(point: str, first: str, second: str, along: tuple[float, float]) -> Iterator[Row]:
    """Yield the row of a slot: a point of the first body stays on a line fixed in the second, through the point at t = 0."""
    normal = (-along[1], along[0])
    yield row(Along(Place(first, point), Place(second, point), normal, turns=second != GROUND))


def yield_angle(point: str, first: str, second: str) -> Iterator[Row]:
    """Yield the row of a constant angle between two bodies at their common point."""
    yield row(Turn(Place(first, point), Place(second, point)))
