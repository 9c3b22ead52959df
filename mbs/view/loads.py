"""Symbols of springs, loads, masses, drives and couplings. Belts, ropes and pitch circles are drawn to scale.

Each function is a `symbols.Symbol`: it takes the sheet, the name of the element and the element. Numbers are proportions, over
the size of a symbol (`sheet.unit`), chosen by their look. Frames of `sheet.frame_at` and `sheet.body_frame` turn with a body,
those of `sheet.upright_frame` do not. At t = 0 all have the axes of the ground. Places in a frame are in m.
`place('crank:A')` splits a point reference into its `body` and its `point`.
"""

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
from .drawing import Disc, Label, Mark, Outline, Sheet, Span, arc_points, draw_arrow, draw_turn, hatching, normalise, place_along


def draw_spring(sheet: Sheet, _name: str, spring: Spring) -> Iterator[Mark]:
    """Yield a zigzag between the two ends of a spring."""
    ends = [sheet.frame_at(*place(ref)) for ref in (spring.a, spring.b)]
    u, half = sheet.unit, 0.5 * sheet.unit
    # points of a `Span`: fraction of the way from the first end to the other, offset to the left [m]
    inner = [(0.15 + 0.7 * (k + 0.5) / 14, half if k % 2 else -half) for k in range(14)]
    yield Span(ends[0], ends[1], "spring", ((0.0, 0.0), (0.15, 0.0), *inner, (0.85, 0.0), (1.0, 0.0)))
    for ref, frame in zip((spring.a, spring.b), ends, strict=True):
        yield Disc(frame, "pin", (0.0, 0.0), 0.2 * sheet.unit)
        if place(ref).body == GROUND:
            yield from hatching(frame, (-0.8 * u, -0.3 * u), (0.8 * u, -0.3 * u), 0.7 * u)


def draw_spiral(sheet: Sheet, _name: str, spring: TorsionSpring) -> Iterator[Mark]:
    """Yield a spiral about the point that the two bodies of the spring share."""
    link, other = (spring.second, spring.first) if spring.first == GROUND else (spring.first, spring.second)
    frame = sheet.upright_frame(sheet.pivot(link, other))
    angles = [2.25 * 2 * pi * k / 60 for k in range(61)]  # rad, 2.25 turns
    polar = [(sheet.unit * (0.45 + 0.07 * a), a) for a in angles]
    yield Outline(frame, "spring", tuple((r * cos(a), r * sin(a)) for r, a in polar))


def draw_force(sheet: Sheet, _name: str, load: Force) -> Iterator[Mark]:
    """Yield an arrow that ends at the loaded point, in the direction of the force at t = 0."""
    along = normalise(load.initial_force(sheet.mechanism))
    point = place(load.point).point
    frame, loaded = sheet.upright_frame(point), (0.0, 0.0)  # `loaded`: coordinates of the loaded point in the frame
    if load.follows:  # a link, or a point of a link, with which the force turns
        link = load.follows.partition(":")[0]
        frame, loaded = sheet.body_frame(link), sheet.place_on(link, point)
    tail, tip = place_along(((-4.0, 0.0), (-0.5, 0.0)), along, scale=sheet.unit, origin=loaded)
    yield from draw_arrow(frame, "load", tail, tip, sheet.unit)


def draw_line_load(sheet: Sheet, _name: str, load: LineLoad) -> Iterator[Mark]:
    """Yield arrows onto the ends of a strip for a distributed force, a turning arrow for a distributed moment."""
    link, u = sheet.mechanism.link(load.link), sheet.unit
    loaded_points = (link.start, link.end) if any(load.force) else ()
    for point in loaded_points:
        tail, tip = place_along(((-2.5, 0.0), (-0.5, 0.0)), normalise(load.force), scale=u)
        frame = sheet.frame_at(link.name, point) if load.turns else sheet.upright_frame(f"{link.name}:{point}")
        yield from draw_arrow(frame, "load", tail, tip, u)
    if load.moment:
        yield from draw_torque(sheet, _name, load)


def draw_torque(sheet: Sheet, _name: str, load: Torque | LineLoad) -> Iterator[Mark]:
    """Yield a turning arrow on the loaded link, at 0.3 of its length, beside the link's name."""
    x, y = sheet.place_on(load.link, sheet.mechanism.link(load.link).end)
    yield from draw_turn(sheet.body_frame(load.link), "load", 1.2 * sheet.unit, (0.3 * x, 0.3 * y))


def draw_motor(sheet: Sheet, _name: str, load: Motor) -> Iterator[Mark]:
    """Yield a circle with an M and a turning arrow at the joint in which the motor turns a link."""
    frame, u = sheet.upright_frame(sheet.pivot(load.link)), sheet.unit
    upper_left = (-1.6 * u, 1.6 * u)  # where no name of a point is drawn
    yield Disc(frame, "motor", upper_left, 0.85 * u)
    yield Label(frame, "M", upper_left, "symbol")
    yield from draw_turn(frame, "drive", 1.1 * u)


def draw_drive(sheet: Sheet, _name: str, drive: Drive) -> Iterator[Mark]:
    """Yield a turning arrow about the pivot of a driven link, or a straight arrow beside a driven point."""
    u = sheet.unit
    if drive.target not in sheet.mechanism.points:
        yield from draw_turn(sheet.upright_frame(sheet.pivot(drive.target)), "drive", 1.15 * u)
        return
    tail, tip = place_along(((-1.6, 1.2), (1.6, 1.2)), sheet.mechanism.guide(drive.target).along, scale=u)
    yield from draw_arrow(sheet.upright_frame(drive.target), "drive", tail, tip, 0.8 * u)


def draw_mass(sheet: Sheet, _name: str, mass: Mass) -> Iterator[Mark]:
    """Yield a dark disc at a point mass: on its link, or on any body that has the point."""
    frame = sheet.frame_at(mass.link, mass.point) if mass.link else sheet.frame_of(mass.point)
    yield Disc(frame, "mass", (0.0, 0.0), 0.55 * sheet.unit)


def draw_gear(sheet: Sheet, _name: str, gear: Gear) -> Iterator[Mark]:
    """Yield the pitch circles of two gears; coaxial gears have none and get two circles of the size of a symbol."""
    apart = distance(sheet.mechanism, gear.first, gear.second)
    radii = (1.5 * sheet.unit, 2.0 * sheet.unit)
    if apart:  # ratio: turns of the second gear per turn of the first, negative with outer teeth on both
        to_pitch_point = gear.ratio * apart / (gear.ratio - 1)  # from the first centre towards the second, see `Gear.rows`
        radii = (abs(to_pitch_point), abs(apart - to_pitch_point))
    yield _circle(sheet, gear.first, radii[0])
    yield _circle(sheet, gear.second, radii[1])


def draw_rack(sheet: Sheet, _name: str, rack: Rack) -> Iterator[Mark]:
    """Yield the pitch circle of a pinion and a piece of the pitch line of its rack."""
    yield _circle(sheet, rack.first, rack.radius)
    pinion_point, rack_body = place(rack.first).point, place(rack.second).body
    # 2 radii to either side of the pitch point, which lies to the right of the direction `along`, seen from the pinion's centre
    pitch_line = place_along(((-2.0, -1.0), (2.0, -1.0)), rack.along, rack.radius, sheet.place_on(rack_body, pinion_point))
    yield Outline(sheet.body_frame(rack_body), "coupling", pitch_line)


def draw_belt(sheet: Sheet, _name: str, belt: Belt) -> Iterator[Mark]:
    """Yield two pulleys and the two spans of belt between them, between diameters across the centre line: no exact tangents."""
    yield _circle(sheet, belt.first, belt.radius)
    yield _circle(sheet, belt.second, belt.other_radius)
    ends = [sheet.frame_at(*place(at)) for at in (belt.first, belt.second)]
    for side in (1, -1):
        other_side = -side if belt.crossed else side
        yield Span(ends[0], ends[1], "coupling", ((0.0, side * belt.radius), (1.0, other_side * belt.other_radius)))


def draw_rope(sheet: Sheet, _name: str, rope: Rope) -> Iterator[Mark]:
    """Yield the straight parts of a rope, and a disc at each pulley."""
    frames = [sheet.frame_at(*end) for end in rope.path(sheet.mechanism)]
    for first, second in pairwise(frames):
        yield Span(first, second, "coupling", ((0.0, 0.0), (1.0, 0.0)))
    for frame in frames[1:-1]:
        yield Disc(frame, "pin", (0.0, 0.0), 0.5 * sheet.unit)


def _circle(sheet: Sheet, at: str, radius: float) -> Outline:
    """Return a circle about a point of a body, and a spoke that shows its rotation."""
    circle = arc_points((0.0, 0.0), radius, 0.0, 2 * pi, 48)
    return Outline(sheet.frame_at(*place(at)), "coupling", ((0.0, 0.0), *circle))
