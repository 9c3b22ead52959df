"""Marks of a picture of a mechanism, each fixed in a moving frame. All kinds of pictures draw the same marks.

A frame has a place and an angle turned since t = 0. Lengths are in m, in the axes of the ground at t = 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, cos, hypot, pi, sin
from typing import Any, NamedTuple

import numpy as np

from ..elements.element import GROUND
from ..mechanism import Mechanism

Points = tuple[tuple[float, float], ...]


class Outline(NamedTuple):
    """A line, or a filled outline, fixed in a frame; `width` is its size normal to the plane, m, 0 for a symbol."""

    frame: str
    ink: str
    points: Points
    closed: bool = False
    width: float = 0.0


class Disc(NamedTuple):
    """A disc fixed in a frame."""

    frame: str
    ink: str
    centre: tuple[float, float]
    radius: float


class Span(NamedTuple):
    """A line stretched from one frame to another: (fraction of the distance, m to the left of it)."""

    frame: str
    other: str
    ink: str
    points: Points


class StripMark(NamedTuple):
    """A flexible link, by its name."""

    link: str
    ink: str


class Arrow(NamedTuple):
    """A force at a frame, by its signals: two components, or one along a direction fixed in the frame `within`."""

    frame: str
    ink: str
    signals: tuple[str, ...]
    along: tuple[float, float] = (0.0, 0.0)
    within: str = ""


class Label(NamedTuple):
    """A name beside a place fixed in a frame; `what` is 'point', 'link' or 'symbol'."""

    frame: str
    text: str
    place: tuple[float, float]
    what: str


Mark = Outline | Disc | Span | StripMark | Arrow | Label


class Ink(NamedTuple):
    """Colour of a line and of what it encloses ('' for none), width of the line, pt."""

    line: str
    fill: str
    width: float


LINKS = {
    "link0": Ink("#0072B2", "#BBD7EA", 1.2),
    "link1": Ink("#D55E00", "#F4CDB2", 1.2),
    "link2": Ink("#009E73", "#B5DFD1", 1.2),
    "link3": Ink("#A8508A", "#EACFE1", 1.2),
    "link4": Ink("#8A6D00", "#F0E0B0", 1.2),
    "link5": Ink("#2B7DA8", "#CDE6F5", 1.2),
}
"""Colours that links take in turn."""
INKS: dict[str, Ink] = {
    "ground": Ink("#5A6672", "", 1.0),
    "support": Ink("#39434D", "#DDE2E7", 1.0),
    "rail": Ink("#9AA5B0", "", 1.0),
    "pin": Ink("#1B2733", "#FFFFFF", 1.2),
    "bush": Ink("#1B2733", "#FFF3C9", 1.2),
    "block": Ink("#1B2733", "#E4E9EE", 1.2),
    "stop": Ink("#6B2D12", "#C98A6B", 1.2),
    "spring": Ink("#4B5560", "", 1.2),
    "load": Ink("#B3261E", "", 1.6),
    "drive": Ink("#1B5FAA", "", 1.6),
    "motor": Ink("#1B5FAA", "#E3EEFA", 1.4),
    "mass": Ink("#1B2733", "#1B2733", 0.8),
    "other": Ink("#6B7680", "#F1F3F5", 1.2),
    "force": Ink("#B3261E", "#B3261E", 1.6),
    **LINKS,
}
"""Colours by what a mark represents. Lines have a contrast of at least 3 : 1 to white."""


FIXED = "="
"""Prefix of the name of a frame that follows the point but does not turn."""
MIDDLE = "@"
"""Prefix of the name of the frame of the middle of a flexible link's line."""
UNIT = 0.027
"""Size of a symbol, of the mechanism's extent."""
Pair = tuple[float, float]


class Sheet:
    """Sheet of a picture: the mechanism, the size of a symbol, the frames that symbols need.

    The record says where the points are. `frames` has of each frame the point reference it follows and, for a pin drawn off its
    bush, the pin's and how far it is enlarged.
    """

    def __init__(self, mechanism: Mechanism, record: Any) -> None:
        self.mechanism, self.record = mechanism, record
        places = np.array(list(mechanism.points.values()))
        self.extent = float(max(np.ptp(places, axis=0).max(), 1e-9))
        self.unit = UNIT * self.extent
        self.frames: dict[str, tuple[str, str, float]] = {"": ("", "", 0.0)}
        self.inks = {link.name: f"link{k % len(LINKS)}" for k, link in enumerate(mechanism.links)}

    def at(self, body: str, point: str) -> str:
        """Frame of a point on a body, '' for any body that has it."""
        ref = f"{body}:{point}" if body == GROUND or body in self.record.links else point
        return self.frame(ref)

    def frame(self, ref: str) -> str:
        """Frame of a point reference."""
        self.frames.setdefault(ref, (ref.removeprefix(FIXED), "", 0.0))
        return ref

    def inside(self, bush: str, pin: str, factor: float) -> str:
        """Frame of a pin whose distance from its bush is drawn enlarged."""
        name = f"{bush}~{pin}"
        self.frames[name] = (bush, pin, factor)
        return name

    def body(self, name: str) -> str:
        """Frame of a link, '' for the ground."""
        return "" if name == GROUND else self.at(name, self.mechanism.link(name).start)

    def local(self, name: str, point: str) -> Pair:
        """Return the place of a point in the frame of a link, or of the ground, at t = 0."""
        points = self.mechanism.points
        (x, y), (x0, y0) = points[point], (0.0, 0.0) if name == GROUND else points[self.mechanism.link(name).start]
        return x - x0, y - y0

    def pivot(self, link: str) -> str:
        """Point at which a link is pinned to the ground, or its start."""
        grounded = [joint.point for joint in self.mechanism.joints if {joint.first, joint.second} == {GROUND, link}]
        return str(grounded[0]) if grounded else self.mechanism.link(link).start

    def shared_point(self, first: str, second: str) -> str:
        """Return the point that two bodies share: that of their joint, or one on both."""
        for joint in self.mechanism.joints:
            if {joint.first, joint.second} == {first, second}:
                return str(joint.point)
        return self.pivot(second if first == GROUND else first)


def unit(vector: Pair) -> Pair:
    """Return the unit vector of a vector, downward of zero."""
    size = hypot(*vector)
    return (vector[0] / size, vector[1] / size) if size else (0.0, -1.0)


def place_along(points: Sequence[Pair], along: Pair, scale: float = 1.0, origin: Pair = (0.0, 0.0)) -> Points:
    """Rotate the x axis of points onto a unit vector, scale and move them."""
    (ax, ay), (x0, y0) = along, origin
    return tuple((x0 + scale * (ax * x - ay * y), y0 + scale * (ay * x + ax * y)) for x, y in points)


def capsule(start: Pair, end: Pair, radius: float) -> Points:
    """Outline of a bar with round ends."""
    lean = atan2(end[1] - start[1], end[0] - start[0])
    half = [pi * k / 8 for k in range(9)]
    there = [(end[0] + radius * cos(lean - pi / 2 + a), end[1] + radius * sin(lean - pi / 2 + a)) for a in half]
    back = [(start[0] + radius * cos(lean + pi / 2 + a), start[1] + radius * sin(lean + pi / 2 + a)) for a in half]
    return (*there, *back)


def arrow(frame: str, ink: str, tail: Pair, tip: Pair, head: float) -> Iterator[Mark]:
    """Yield a line with a filled head."""
    along = unit((tip[0] - tail[0], tip[1] - tail[1]))
    yield Outline(frame, ink, (tail, tip))
    yield Outline(frame, ink, place_along(((-1.0, 0.45), (0.0, 0.0), (-1.0, -0.45)), along, head, tip))


def turning(frame: str, ink: str, radius: float, centre: Pair = (0.0, 0.0)) -> Iterator[Mark]:
    """Yield a counterclockwise arrow about a place."""
    angles = [-0.9 + 4.5 * k / 24 for k in range(25)]
    (x, y), bend = centre, tuple((radius * cos(a), radius * sin(a)) for a in angles)
    yield Outline(frame, ink, tuple((x + a, y + b) for a, b in bend))
    (a, b), along = bend[-1], (-sin(3.7), cos(3.7))
    yield Outline(frame, ink, place_along(((-1.0, 0.45), (0.0, 0.0), (-1.0, -0.45)), along, 0.55 * radius, (x + a, y + b)))


def hatching(frame: str, start: Pair, end: Pair, size: float, ink: str = "ground") -> Iterator[Mark]:
    """Yield a line with short strokes on its right: the ground."""
    length, along = hypot(end[0] - start[0], end[1] - start[1]), unit((end[0] - start[0], end[1] - start[1]))
    count = max(3, min(60, round(length / (0.8 * size))))
    comb = [(0.0, 0.0)]  # one line: along, down a stroke, back up
    for k in range(count):
        s = length * (k + 0.5) / count
        comb += [(s, 0.0), (s - 0.5 * size, -0.6 * size), (s, 0.0)]
    yield Outline(frame, ink, place_along([*comb, (length, 0.0)], along, 1.0, start))
