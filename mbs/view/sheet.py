"""What a picture is drawn on: frames that follow points, and how large a symbol is."""

from __future__ import annotations

from typing import Any

import numpy as np

from buckler.mbs.elements.element import GROUND
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.view.drawing import LINKS

FIXED = "="
"""Before a frame's name: it follows the point but does not turn."""
MIDDLE = "@"
"""Before a flexible link's name: the frame of the middle of its line."""
UNIT = 0.027
"""Size of a symbol, of the mechanism's extent."""
Pair = tuple[float, float]


class Sheet:
    """What a picture is drawn on: the mechanism, the size of a symbol, the frames that symbols asked for.

    Attributes
    ----------
    mechanism : Mechanism
    record : Record
        Where the points are, at the picture's times.
    unit : float
        Size of a symbol, m.
    frames : dict of str to (str, str, float)
        Of each frame the point reference it follows, and, for a pin drawn off its bush, the pin's and how far it is enlarged.
    """

    def __init__(self, mechanism: Mechanism, record: Any) -> None:
        self.mechanism, self.record = mechanism, record
        places = np.array(list(mechanism.points.values()))
        self.extent = float(max(np.ptp(places, axis=0).max(), 1e-9))
        self.unit = UNIT * self.extent
        self.frames: dict[str, tuple[str, str, float]] = {"": ("", "", 0.0)}
        self.inks = {link.name: f"link{k % len(LINKS)}" for k, link in enumerate(mechanism.links)}

    def at(self, body: str, point: str) -> str:
        """Frame of a point as part of a body, '' for whatever carries it."""
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
        """Where a point is in the frame of a link, or of the ground, at t = 0."""
        points = self.mechanism.points
        (x, y), (x0, y0) = points[point], (0.0, 0.0) if name == GROUND else points[self.mechanism.link(name).start]
        return x - x0, y - y0

    def pivot(self, link: str) -> str:
        """Point in which a link turns on the ground, or its start."""
        grounded = [joint.point for joint in self.mechanism.joints if {joint.first, joint.second} == {GROUND, link}]
        return str(grounded[0]) if grounded else self.mechanism.link(link).start

    def shared(self, first: str, second: str) -> str:
        """Point that two bodies share: that of their joint, or one both reach."""
        for joint in self.mechanism.joints:
            if {joint.first, joint.second} == {first, second}:
                return str(joint.point)
        return self.pivot(second if first == GROUND else first)

    def travel(self, point: str, along: Pair) -> tuple[float, float]:
        """Least and largest travel of a point in a direction since t = 0, m."""
        moved = (self.record.point(point)[0] - self.mechanism.points[point]) @ np.array(along)
        moved = moved[np.isfinite(moved)]
        return float(moved.min(initial=0.0)), float(moved.max(initial=0.0))
