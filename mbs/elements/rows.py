"""Constraints as rows: sums of coefficient times measure that keep their value of t = 0, or follow a drive's motion.

A measure is the relative place, angle or distance of points of two bodies. Both solvers know these three.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

from .element import GROUND, Place
from .references import FIXED

ACROSS = ((1.0, 0.0), (0.0, 1.0))


@dataclass(frozen=True)
class Along:
    """Measure direction . (place of first - place of second) [m].

    The direction is that at t = 0; if `turns` is true, it turns with the second body.
    """

    first: Place
    second: Place
    direction: tuple[float, float]
    turns: bool = False


@dataclass(frozen=True)
class Turn:
    """Measure angle of first - angle of second [rad], each at a point of a body, as the angle of a strip varies along it."""

    first: Place
    second: Place = FIXED


@dataclass(frozen=True)
class Distance:
    """Measure distance of two places [m], which must not coincide."""

    first: Place
    second: Place


Measure = Along | Turn | Distance


@dataclass(frozen=True)
class Row:
    """One equation: the sum of coefficient times measure keeps its value of t = 0, or changes by a drive's motion.

    With `start_only` it holds at the start only, as for a pin that is centred in its bush.
    """

    terms: tuple[tuple[float, Measure], ...]
    motion: Any = None
    start_only: bool = False

    @property
    def bodies(self) -> set[str]:
        """Bodies that the equation constrains, the ground included."""
        return {end.body for _, measure in self.terms for end in (measure.first, measure.second)}

    def gradient(self, points: Mapping[str, tuple[float, float]]) -> Iterator[tuple[Place, tuple[float, float, float]]]:
        """Yield the derivatives by (x, y, angle) of each place at t = 0."""
        for coefficient, measure in self.terms:
            if isinstance(measure, Turn):
                yield measure.first, (0.0, 0.0, coefficient)
                yield measure.second, (0.0, 0.0, -coefficient)
                continue
            (x1, y1), (x2, y2) = points[measure.first.point], points[measure.second.point]
            ex, ey = x1 - x2, y1 - y2
            if isinstance(measure, Distance):
                (dx, dy), lever = (ex / hypot(ex, ey), ey / hypot(ex, ey)), 0.0
            else:
                (dx, dy), lever = measure.direction, 0.0
                if measure.turns:
                    lever = dx * ey - dy * ex
            yield measure.first, (coefficient * dx, coefficient * dy, 0.0)
            yield measure.second, (-coefficient * dx, -coefficient * dy, coefficient * lever)


def row(measure: Measure, motion: object = None, *, start_only: bool = False) -> Row:
    """Return the row of one measure."""
    return Row(((1.0, measure),), motion, start_only)


def meets(point: str, first: str, second: str, *, start_only: bool = False) -> Iterator[Row]:
    """Yield the two rows of a common point of two bodies: x, then y."""
    for direction in ACROSS:
        yield row(Along(Place(first, point), Place(second, point), direction), start_only=start_only)


def find_pin(rows: Sequence[Row]) -> Along | None:
    """Return the first measure of rows that are those of `meets` and possibly of angles; None for other rows."""
    measures = [measure for row in rows for _, measure in row.terms]
    plain = len(measures) == len(rows) and not any(row.motion or row.start_only or row.terms[0][0] != 1.0 for row in rows)
    if not plain or len(rows) < 2 or not all(isinstance(measure, Turn) for measure in measures[2:]):
        return None
    pin = measures[0]
    if not isinstance(pin, Along) or pin.first.point != pin.second.point:
        return None
    return pin if measures[:2] == [Along(pin.first, pin.second, axis) for axis in ACROSS] else None


def on_line(point: str, first: str, second: str, along: tuple[float, float]) -> Iterator[Row]:
    """Yield the row of a point of one body that stays on a line through it, fixed in another body."""
    normal = (-along[1], along[0])
    yield row(Along(Place(first, point), Place(second, point), normal, turns=second != GROUND))


def same_turn(point: str, first: str, second: str) -> Iterator[Row]:
    """Yield the row of a constant angle between two bodies at a point."""
    yield row(Turn(Place(first, point), Place(second, point)))
