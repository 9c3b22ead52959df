"""Lines that symbols are drawn of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, cos, hypot, pi, sin

from buckler.mbs.view.drawing import Mark, Path, Points

Pair = tuple[float, float]


def unit(vector: Pair) -> Pair:
    """The direction of a vector, downward of none."""
    size = hypot(*vector)
    return (vector[0] / size, vector[1] / size) if size else (0.0, -1.0)


def turned(points: Sequence[Pair], along: Pair, scale: float = 1.0, origin: Pair = (0.0, 0.0)) -> Points:
    """Points with their x axis laid along a unit vector, enlarged, moved."""
    (ax, ay), (x0, y0) = along, origin
    return tuple((x0 + scale * (ax * x - ay * y), y0 + scale * (ay * x + ax * y)) for x, y in points)


def capsule(start: Pair, end: Pair, radius: float) -> Points:
    """Outline of a bar with round ends."""
    lean = atan2(end[1] - start[1], end[0] - start[0])
    half = [pi * k / 8 for k in range(9)]
    there = [(end[0] + radius * cos(lean - pi / 2 + a), end[1] + radius * sin(lean - pi / 2 + a)) for a in half]
    back = [(start[0] + radius * cos(lean + pi / 2 + a), start[1] + radius * sin(lean + pi / 2 + a)) for a in half]
    return (*there, *back)


def arc(radius: float, first: float, last: float) -> Points:
    """Part of a circle, angles in rad."""
    angles = [first + (last - first) * k / 24 for k in range(25)]
    return tuple((radius * cos(a), radius * sin(a)) for a in angles)


def arrow(frame: str, ink: str, tail: Pair, tip: Pair, head: float) -> Iterator[Mark]:
    """A line with a filled head."""
    along = unit((tip[0] - tail[0], tip[1] - tail[1]))
    yield Path(frame, ink, (tail, tip))
    yield Path(frame, ink, turned(((-1.0, 0.45), (0.0, 0.0), (-1.0, -0.45)), along, head, tip))


def turning(frame: str, ink: str, radius: float, centre: Pair = (0.0, 0.0)) -> Iterator[Mark]:
    """An arrow that turns to the left about a place."""
    (x, y), bend = centre, arc(radius, -0.9, 3.6)
    yield Path(frame, ink, tuple((x + a, y + b) for a, b in bend))
    (a, b), along = bend[-1], (-sin(3.7), cos(3.7))
    yield Path(frame, ink, turned(((-1.0, 0.45), (0.0, 0.0), (-1.0, -0.45)), along, 0.55 * radius, (x + a, y + b)))


def hatching(frame: str, start: Pair, end: Pair, size: float, ink: str = "ground") -> Iterator[Mark]:
    """A line with short strokes on its right: the ground."""
    length, along = hypot(end[0] - start[0], end[1] - start[1]), unit((end[0] - start[0], end[1] - start[1]))
    count = max(3, min(60, round(length / (0.8 * size))))
    comb = [(0.0, 0.0)]  # one line: along, down a stroke, back up
    for k in range(count):
        s = length * (k + 0.5) / count
        comb += [(s, 0.0), (s - 0.5 * size, -0.6 * size), (s, 0.0)]
    yield Path(frame, ink, turned([*comb, (length, 0.0)], along, 1.0, start))


def hull(points: Sequence[Pair]) -> Points:
    """Convex hull of points that are not in line, counter-clockwise."""
    from scipy.spatial import ConvexHull  # only a plate needs it, and loading it takes longer than drawing

    return tuple(points[k] for k in ConvexHull(points).vertices)
