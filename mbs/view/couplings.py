"""Symbols of gears, racks, belts and ropes: pitch circles to scale, belts and ropes from place to place."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import cos, pi, sin

from ..elements import Belt, Gear, Rack, Rope
from ..elements.element import place
from ..elements.references import distance
from .drawing import Disc, Mark, Path, Sheet, Span

INK = "spring"


def gear(sheet: Sheet, _name: str, gear: Gear) -> Iterator[Mark]:
    """Both pitch circles."""
    apart = distance(sheet.mechanism, gear.first, gear.second)
    radius = gear.ratio * apart / (gear.ratio - 1) if apart else 1.5 * sheet.unit
    yield _circle(sheet, gear.first, abs(radius))
    yield _circle(sheet, gear.second, abs(apart - radius) if apart else 2.0 * sheet.unit)


def rack(sheet: Sheet, _name: str, rack: Rack) -> Iterator[Mark]:
    """Yield the pinion's pitch circle and a piece of the rack's pitch line."""
    centre, other, r = place(rack.first).point, place(rack.second).body, rack.radius
    yield _circle(sheet, rack.first, r)
    (x, y), (dx, dy) = sheet.local(other, centre), rack.along
    middle = x + r * dy, y - r * dx
    yield Path(sheet.body(other), INK, tuple((middle[0] + k * r * dx, middle[1] + k * r * dy) for k in (-2, 2)), False)


def belt(sheet: Sheet, _name: str, belt: Belt) -> Iterator[Mark]:
    """Both pulleys and the spans between them."""
    yield _circle(sheet, belt.first, belt.radius)
    yield _circle(sheet, belt.second, belt.other_radius)
    ends = [sheet.at(*place(at)) for at in (belt.first, belt.second)]
    for side in (1, -1):
        across = -side if belt.crossed else side
        yield Span(ends[0], ends[1], INK, ((0.0, side * belt.radius), (1.0, across * belt.other_radius)))


def rope(sheet: Sheet, _name: str, rope: Rope) -> Iterator[Mark]:
    """Yield its parts, and a disc at each pulley."""
    frames = [sheet.at(*each) for each in rope.path(sheet.mechanism)]
    for one, two in pairwise(frames):
        yield Span(one, two, INK, ((0.0, 0.0), (1.0, 0.0)))
    for frame in frames[1:-1]:
        yield Disc(frame, "pin", (0.0, 0.0), 0.5 * sheet.unit)


def _circle(sheet: Sheet, at: str, radius: float) -> Path:
    """Return a circle about a point of a body, and a spoke, by which one sees it turn."""
    angles = [2 * pi * k / 48 for k in range(49)]
    return Path(sheet.at(*place(at)), INK, ((0.0, 0.0), *((radius * cos(a), radius * sin(a)) for a in angles)), False)
