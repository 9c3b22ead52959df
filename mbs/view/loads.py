"""Symbols of springs, loads, masses, drives and couplings; belts, ropes and pitch circles to scale."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import cos, pi, sin

from ..elements import Belt, Gear, Rack, Rope
from ..elements.drive import Drive
from ..elements.element import GROUND, place
from ..elements.force import Force, LineLoad, Torque
from ..elements.motor import Motor
from ..elements.references import distance
from ..elements.rigid import Mass
from ..elements.spring import Spring, TorsionSpring
from .drawing import FIXED, Disc, Label, Mark, Outline, Sheet, Span, arrow, hatching, place_along, turning, unit


def spring(sheet: Sheet, _name: str, spring: Spring) -> Iterator[Mark]:
    """Yield a zigzag between its two places."""
    ends = [sheet.at(*place(ref)) for ref in (spring.a, spring.b)]
    turns, h = 7, 0.5 * sheet.unit
    inner = [(0.15 + 0.7 * (k + 0.5) / (2 * turns), h if k % 2 else -h) for k in range(2 * turns)]
    yield Span(ends[0], ends[1], "spring", ((0.0, 0.0), (0.15, 0.0), *inner, (0.85, 0.0), (1.0, 0.0)))
    for ref, frame in zip((spring.a, spring.b), ends, strict=True):
        yield Disc(frame, "pin", (0.0, 0.0), 0.2 * sheet.unit)
        if place(ref).body == GROUND:
            u = sheet.unit
            yield from hatching(frame, (-0.8 * u, -0.3 * u), (0.8 * u, -0.3 * u), 0.7 * u)


def spiral(sheet: Sheet, _name: str, spring: TorsionSpring) -> Iterator[Mark]:
    """Yield a spiral about the point that its two bodies share."""
    frame = sheet.frame(FIXED + sheet.shared_point(spring.first, spring.second))
    u, turns = sheet.unit, [2.25 * 2 * pi * k / 60 for k in range(61)]
    yield Outline(frame, "spring", tuple((r * cos(a), r * sin(a)) for a in turns for r in [u * (0.45 + 0.07 * a)]))


def force(sheet: Sheet, _name: str, load: Force) -> Iterator[Mark]:
    """Yield an arrow that ends at its point, in the direction of the force at t = 0."""
    along = unit(load.initial_force(sheet.mechanism))
    follows = load.follows.partition(":")[0] if load.follows else None
    point = place(load.point).point
    frame = sheet.body(follows) if follows else sheet.frame(FIXED + point)
    start = sheet.local(follows, point) if follows else (0.0, 0.0)
    tail, tip = place_along(((-4.0, 0.0), (-0.5, 0.0)), along, sheet.unit, start)
    yield from arrow(frame, "load", tail, tip, sheet.unit)


def line_load(sheet: Sheet, _name: str, load: LineLoad) -> Iterator[Mark]:
    """Arrows onto a strip's ends, in the direction of the force; a turning arrow for moments."""
    link, u = sheet.mechanism.link(load.link), sheet.unit
    for point in (link.start, link.end) if any(load.force) else ():
        tail, tip = place_along(((-2.5, 0.0), (-0.5, 0.0)), unit(load.force), u, sheet.local(link.name, point))
        yield from arrow(sheet.body(link.name), "load", tail, tip, u)
    if load.moment:
        yield from torque(sheet, _name, load)


def torque(sheet: Sheet, _name: str, load: Torque | LineLoad) -> Iterator[Mark]:
    """Yield a turning arrow on its link, beside the link's name."""
    x, y = sheet.local(load.link, sheet.mechanism.link(load.link).end)
    yield from turning(sheet.body(load.link), "load", 1.2 * sheet.unit, (0.3 * x, 0.3 * y))


def motor(sheet: Sheet, _name: str, load: Motor) -> Iterator[Mark]:
    """Yield a circle with an M about the joint its link turns in."""
    frame = sheet.frame(FIXED + sheet.pivot(load.link))
    u = sheet.unit
    yield Disc(frame, "motor", (-1.6 * u, 1.6 * u), 0.85 * u)
    yield Label(frame, "M", (-1.6 * u, 1.6 * u), "symbol")
    yield from turning(frame, "drive", 1.1 * u)


def drive(sheet: Sheet, _name: str, drive: Drive) -> Iterator[Mark]:
    """Yield a turning arrow about the pivot of a driven link, a straight one at a driven point."""
    u = sheet.unit
    if drive.target not in sheet.mechanism.points:
        yield from turning(sheet.frame(FIXED + sheet.pivot(drive.target)), "drive", 1.15 * u)
        return
    guides = {guide.point: guide.along for guide in sheet.mechanism.guides}
    tail, tip = place_along(((-1.6, 1.2), (1.6, 1.2)), guides.get(drive.target, (1.0, 0.0)), u)
    yield from arrow(sheet.frame(FIXED + drive.target), "drive", tail, tip, 0.8 * u)


def mass(sheet: Sheet, _name: str, mass: Mass) -> Iterator[Mark]:
    """Yield a dark disc."""
    yield Disc(sheet.at(mass.link or "", mass.point), "mass", (0.0, 0.0), 0.55 * sheet.unit)


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
    yield Outline(sheet.body(other), "spring", tuple((middle[0] + k * r * dx, middle[1] + k * r * dy) for k in (-2, 2)), False)


def belt(sheet: Sheet, _name: str, belt: Belt) -> Iterator[Mark]:
    """Both pulleys and the spans between them."""
    yield _circle(sheet, belt.first, belt.radius)
    yield _circle(sheet, belt.second, belt.other_radius)
    ends = [sheet.at(*place(at)) for at in (belt.first, belt.second)]
    for side in (1, -1):
        across = -side if belt.crossed else side
        yield Span(ends[0], ends[1], "spring", ((0.0, side * belt.radius), (1.0, across * belt.other_radius)))


def rope(sheet: Sheet, _name: str, rope: Rope) -> Iterator[Mark]:
    """Yield its parts, and a disc at each pulley."""
    frames = [sheet.at(*each) for each in rope.path(sheet.mechanism)]
    for one, two in pairwise(frames):
        yield Span(one, two, "spring", ((0.0, 0.0), (1.0, 0.0)))
    for frame in frames[1:-1]:
        yield Disc(frame, "pin", (0.0, 0.0), 0.5 * sheet.unit)


def _circle(sheet: Sheet, at: str, radius: float) -> Outline:
    """Return a circle about a point of a body, and a spoke that shows its rotation."""
    angles = [2 * pi * k / 48 for k in range(49)]
    return Outline(sheet.at(*place(at)), "spring", ((0.0, 0.0), *((radius * cos(a), radius * sin(a)) for a in angles)), False)
