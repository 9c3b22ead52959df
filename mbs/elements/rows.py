"""Primitive constraints: what joints, guides and drives ask of the bodies' places. Kinematics knows nothing else of them.

Each is one equation. What it compares keeps its value at t = 0, or follows a drive's motion from there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from buckler.mbs.elements.element import GROUND, Place

ACROSS = ((1.0, 0.0), (0.0, 1.0))
FIXED = Place(GROUND, "")


@dataclass(frozen=True)
class Along:
    """direction . (place of first - place of second).

    Parameters
    ----------
    first, second : Place
        A body, a link's name or 'ground', and the point of it.
    direction : (float, float)
        At t = 0; it turns with a body where `frame` names one.
    frame : Place
        The body that the direction is fixed in, at a point; the ground by default.
    motion : Ramp or Motion, optional
        What the value follows, m.
    start_only : bool
        True if it holds at the start only, as a pin that is centred in its bush.
    """

    first: Place
    second: Place
    direction: tuple[float, float]
    frame: Place = FIXED
    motion: Any = None
    start_only: bool = False


@dataclass(frozen=True)
class Turn:
    """Angle of first - angle of second.

    Parameters
    ----------
    first, second : Place
        Bodies, each at one of its points: a strip has another angle at each.
    motion : Ramp or Motion, optional
        What the value follows, rad.
    """

    first: Place
    second: Place = FIXED
    motion: Any = None
    start_only: bool = False


Row = Along | Turn


def meets(point: str, first: str, second: str, *, start_only: bool = False) -> Iterator[Row]:
    """Yield the two rows of a point of one body that stays on the same point of another: x, then y."""
    for direction in ACROSS:
        yield Along(Place(first, point), Place(second, point), direction, start_only=start_only)


def on_line(point: str, first: str, second: str, along: tuple[float, float]) -> Iterator[Row]:
    """Yield the row of a point of one body that stays on a line through it, fixed in another body."""
    normal = (-along[1], along[0])
    yield Along(Place(first, point), Place(second, point), normal, Place(second, point))


def same_turn(point: str, first: str, second: str) -> Iterator[Row]:
    """Yield the row of two bodies that keep their angle to each other at a point."""
    yield Turn(Place(first, point), Place(second, point))
