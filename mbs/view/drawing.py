"""Marks of a picture of a mechanism: lines, discs and labels, each fixed in a frame that moves with a body.

Pictures by matplotlib, the report page and ParaView files draw the same marks. A frame has a position [m] and the angle turned
since t = 0 [rad]; at t = 0 its axes are those of the ground, whose frame is ''. Lengths of marks are in m. An `ink` is a key of
`INKS`. Numbers without a name are proportions of symbols, chosen by their look.
"""

from collections.abc import Iterator, Sequence
from math import atan2, cos, hypot, pi, sin
from typing import Any, NamedTuple

import numpy as np

from ..elements.element import GROUND
from ..mechanism import Mechanism

Pair = tuple[float, float]
Points = tuple[Pair, ...]


class Outline(NamedTuple):
    """A line, or if `closed` a filled outline, fixed in a frame; `width` [m] is normal to the plane, 0 for a symbol."""

    frame: str
    ink: str
    points: Points
    closed: bool = False
    width: float = 0.0


class Disc(NamedTuple):
    """A disc fixed in a frame."""

    frame: str
    ink: str
    centre: Pair
    radius: float


class Span(NamedTuple):
    """A line stretched between two frames; its points are (fraction of the way to `other`, offset to the left [m])."""

    frame: str
    other: str
    ink: str
    points: Points


class StripMark(NamedTuple):
    """The bent line of a flexible link, by the link's name."""

    link: str
    ink: str


class Arrow(NamedTuple):
    """A force at a frame, drawn by a report page from its `signals`: components along x and y of the ground, or one `along`.

    The direction `along` (x, y) is fixed in the frame `within`.
    """

    frame: str
    ink: str
    signals: tuple[str, ...]
    along: Pair = (0.0, 0.0)
    within: str = ""


class Label(NamedTuple):
    """A text centred at a place in a frame. It names a 'point' or a 'link', or is part of a 'symbol': one of these is `what`."""

    frame: str
    text: str
    place: Pair
    what: str


Mark = Outline | Disc | Span | StripMark | Arrow | Label


class Ink(NamedTuple):
    """Colour of a line, colour of the area it encloses ('' for none), and width of the line [pt]."""

    line: str
    fill: str
    width: float


LINKS = {
    f"link{k}": Ink(line, fill, 1.2)
    for k, (line, fill) in enumerate((("#0072B2", "#BBD7EA"), ("#D55E00", "#F4CDB2"), ("#009E73", "#B5DFD1"),
                                      ("#A8508A", "#EACFE1"), ("#8A6D00", "#F0E0B0"), ("#2B7DA8", "#CDE6F5")))
}  # fmt: skip
"""Colours of links: link number k takes number k modulo 6."""
INKS: dict[str, Ink] = {
    "ground": Ink("#5A6672", "", 1.0),
    "support": Ink("#39434D", "#DDE2E7", 1.0),
    "rail": Ink("#9AA5B0", "", 1.0),
    "pin": Ink("#1B2733", "#FFFFFF", 1.2),
    "bush": Ink("#1B2733", "#FFF3C9", 1.2),
    "block": Ink("#1B2733", "#E4E9EE", 1.2),
    "stop": Ink("#6B2D12", "#C98A6B", 1.2),
    "spring": Ink("#4B5560", "", 1.2),
    "coupling": Ink("#4B5560", "", 1.2),
    "load": Ink("#B3261E", "", 1.6),
    "drive": Ink("#1B5FAA", "", 1.6),
    "motor": Ink("#1B5FAA", "#E3EEFA", 1.4),
    "mass": Ink("#1B2733", "#1B2733", 0.8),
    "other": Ink("#6B7680", "#F1F3F5", 1.2),
    "force": Ink("#B3261E", "#B3261E", 1.6),
    **LINKS,
}
"""Colours by the kind of thing a mark represents. Lines have a contrast of at least 3 : 1 to white."""
MIDDLE = "@"
"""Prefix of a link's name in the name of a frame: at the middle of a flexible link, with the directions of the ground's axes."""


class FrameSource(NamedTuple):
    """Point reference that a frame follows, '' for the ground; unless it `turns`, its axes stay parallel to the ground's.

    With a `pin`, also a point reference, the frame lies on the line from the reference to the pin, at `factor` times their
    distance: it enlarges the clearance of a joint.
    """

    reference: str
    turns: bool = True
    pin: str = ""
    factor: float = 1.0


class Sheet:
    """Data from which symbols are drawn: a mechanism, its motion in `record`, and the frames that symbols need, by name.

    `unit` is the size of a symbol [m], a fraction of the mechanism's extent. `inks` are the colours of links by their names.
    Methods that return the name of a frame add the frame to `frames`.
    """

    def __init__(self, mechanism: Mechanism, record: Any) -> None:
        self.mechanism, self.record = mechanism, record
        extent = np.ptp(list(mechanism.points.values()), axis=0).max()
        self.unit = 0.027 * float(max(extent, 1e-9))
        self.frames = {"": FrameSource("")}
        self.inks = {link.name: f"link{k % len(LINKS)}" for k, link in enumerate(mechanism.links)}

    def frame_at(self, body: str, point: str) -> str:
        """Return the frame of a point on a body; if the body, as a strut, has no recorded motion, on any link with the point."""
        has_motion = body == GROUND or body in self.record.links
        return self.frame_of(f"{body}:{point}" if has_motion else point)

    def frame_of(self, ref: str) -> str:
        """Return the frame of a point reference: it turns with the crank for 'crank:A', with any body that has A for 'A'."""
        self.frames[ref] = FrameSource(ref)
        return ref

    def upright_frame(self, ref: str) -> str:
        """Return the frame that follows a point reference without turning."""
        self.frames[f"={ref}"] = FrameSource(ref, turns=False)
        return f"={ref}"

    def enlarged_frame(self, bush: str, pin: str, factor: float) -> str:
        """Return the frame of a pin whose distance from the centre of its bush is drawn larger by a factor."""
        name = f"{bush}~{pin}"
        self.frames[name] = FrameSource(bush, pin=pin, factor=factor)
        return name

    def body_frame(self, name: str) -> str:
        """Return the frame of a link, at its start; of the ground, at the origin."""
        return "" if name == GROUND else self.frame_at(name, self.mechanism.link(name).start)

    def place_on(self, name: str, point: str) -> Pair:
        """Return the coordinates [m] of a point in the frame of a link or of the ground."""
        points = self.mechanism.points
        (x, y), (x0, y0) = points[point], (0.0, 0.0) if name == GROUND else points[self.mechanism.link(name).start]
        return x - x0, y - y0

    def pivot(self, link: str, other: str = GROUND) -> str:
        """Return the point at which a link is joined to another body, or else to the ground, or else the link's start."""
        for body in (other, GROUND):
            for joint in self.mechanism.joints:
                if {joint.first, joint.second} == {body, link}:
                    return str(joint.point)
        return self.mechanism.link(link).start


def normalise(vector: Pair) -> Pair:
    """Return the unit vector of a vector; of the zero vector, one that points down."""
    size = hypot(*vector)
    return (vector[0] / size, vector[1] / size) if size else (0.0, -1.0)


def place_along(points: Sequence[Pair], along: Pair, scale: float = 1.0, origin: Pair = (0.0, 0.0)) -> Points:
    """Rotate points so that their x axis falls on a unit vector, scale them, and move them to an origin."""
    (ax, ay), (x0, y0) = along, origin
    return tuple((x0 + scale * (ax * x - ay * y), y0 + scale * (ay * x + ax * y)) for x, y in points)


def capsule(start: Pair, end: Pair, radius: float) -> Points:
    """Return the outline of a bar with round ends."""
    right = atan2(end[1] - start[1], end[0] - start[0]) - pi / 2  # direction to the right of the bar
    return (*arc_points(end, radius, right, right + pi, 8), *arc_points(start, radius, right + pi, right + 2 * pi, 8))


def arc_points(centre: Pair, radius: float, first: float, last: float, intervals: int) -> Points:
    """Return points on an arc between two directions [rad]."""
    angles = [first + (last - first) * k / intervals for k in range(intervals + 1)]
    return tuple((centre[0] + radius * cos(a), centre[1] + radius * sin(a)) for a in angles)


def draw_arrow(frame: str, ink: str, tail: Pair, tip: Pair, head: float) -> Iterator[Mark]:
    """Yield an arrow of fixed length: a line, and a head of a length [m]."""
    yield Outline(frame, ink, (tail, tip))
    yield _head(frame, ink, normalise((tip[0] - tail[0], tip[1] - tail[1])), head, tip)


def _head(frame: str, ink: str, along: Pair, length: float, tip: Pair) -> Outline:
    return Outline(frame, ink, place_along(((-1.0, 0.45), (0.0, 0.0), (-1.0, -0.45)), along, length, tip))


def draw_turn(frame: str, ink: str, radius: float, centre: Pair = (0.0, 0.0)) -> Iterator[Mark]:
    """Yield a counter-clockwise arrow on three quarters of a circle."""
    first, last = -0.9, 3.6  # rad
    arc = arc_points(centre, radius, first, last, 24)
    yield Outline(frame, ink, arc)
    tangent = (-sin(last + 0.1), cos(last + 0.1))  # 0.1 rad: the head points a little inwards
    yield _head(frame, ink, tangent, 0.55 * radius, arc[-1])


def hatching(frame: str, start: Pair, end: Pair, size: float, ink: str = "ground") -> Iterator[Mark]:
    """Yield the symbol of the ground: a line with short oblique strokes on its right."""
    length, along = hypot(end[0] - start[0], end[1] - start[1]), normalise((end[0] - start[0], end[1] - start[1]))
    count = max(3, min(60, round(length / (0.8 * size))))
    comb = [(0.0, 0.0)]  # one line that goes down each stroke and back up
    for k in range(count):
        s = length * (k + 0.5) / count
        comb += [(s, 0.0), (s - 0.5 * size, -0.6 * size), (s, 0.0)]
    yield Outline(frame, ink, place_along([*comb, (length, 0.0)], along, 1.0, start))
