"""Symbols of links, joints, guides and stops, and the table `SYMBOLS` of the symbols of all elements.

A symbol is a function (sheet, name, element) that yields marks. Numbers are proportions, over the size of a symbol
(`sheet.unit`), chosen by their look. Directions are angles from the x axis [rad]. Frames of `sheet.frame_at` (a body and a
point), `sheet.frame_of` (a point of any body) and `sheet.body_frame` turn with a body, those of `sheet.upright_frame` do not. At
t = 0 all have the axes of the ground. `sheet.place_on` gives coordinates in the frame of `sheet.body_frame`.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import atan2, cos, hypot, pi, sin

import numpy as np

from ..elements.clearance import Clearance
from ..elements.element import GROUND, Element, place
from ..elements.guide import Guide
from ..elements.joint import Joint, Slider, Slot, Weld
from ..elements.link import Link
from ..elements.motor import Motor
from ..elements.section import Section
from ..elements.stop import Stop
from ..imports import extensions
from ..scene.scene import Scene
from . import drawing, loads
from .drawing import MIDDLE, Arrow, Disc, Label, Mark, Outline, Pair, Sheet, StripMark, capsule, hatching, normalise, place_along

Symbol = Callable[..., Iterator[Mark]]


def draw_marks(sheet: Sheet) -> list[Mark]:
    """Return the marks of a mechanism, from back to front: bodies and symbols, arrows of forces, labels."""
    marks: list[Mark] = []
    for name, element in Scene.of(sheet.mechanism).elements.items():
        draw = symbol(element.body if isinstance(element, Link) else element)
        marks += draw(sheet, name, element)
        marks += _forces(sheet, name, element)
    marks += _gravity(sheet)
    joints = {joint.point for joint in sheet.mechanism.joints} | {guide.point for guide in sheet.mechanism.guides}
    for point in sheet.mechanism.points:
        frame = sheet.upright_frame(point)
        if point not in joints and any(point in link.points for link in sheet.mechanism.links):
            marks.append(Disc(frame, "pin", (0.0, 0.0), 0.16 * sheet.unit))
        marks.append(Label(frame, point, _free_side(sheet, point), "point"))
    order = {Label: 2, Arrow: 1}
    return sorted(marks, key=lambda mark: order.get(type(mark), 0))


def _free_side(sheet: Sheet, point: str) -> Pair:
    """Return the place of a point's name, from the point [m]: in the widest angle between its links, support and motor."""
    mechanism = sheet.mechanism
    x, y = mechanism.points[point]
    names = [name for link in mechanism.links if point in link.points for name in link.points]
    places = [mechanism.points[name] for name in names]
    occupied = [atan2(y2 - y, x2 - x) for x2, y2 in places if (x2, y2) != (x, y)]
    is_supported = any(joint.point == point and GROUND in (joint.first, joint.second) for joint in mechanism.joints)
    if is_supported or any(guide.point == point for guide in mechanism.guides):
        occupied.append(-pi / 2)  # the symbol of a support or guide is below
    if any(isinstance(load, Motor) and sheet.pivot(load.link) == point for load in mechanism.loads):
        occupied.append(0.75 * pi)  # the symbol of a motor is at the upper left
    occupied = sorted(occupied) or [-0.75 * pi]  # of a point alone the name is opposite, to the upper right
    gaps = [(after - before, before) for before, after in pairwise([*occupied, occupied[0] + 2 * pi])]
    width, before = max(gaps)
    angle = before + width / 2
    driven = {mechanism.link(drive.target).start for drive in mechanism.drives if drive.target not in mechanism.points}
    distance = (2.1 if point in driven else 1.2) * sheet.unit  # 2.1 is outside the arrow of a drive
    return distance * cos(angle), distance * sin(angle)


def symbol(element: object) -> Symbol:
    """Return the symbol of an element or of a link's body: by its class, by the nearest base class, or of an extension."""
    for kind in type(element).__mro__:
        if kind.__name__ in SYMBOLS:
            return SYMBOLS[kind.__name__]
    found: Symbol = extensions("buckler.symbols").get(type(element).__name__, draw_unknown)
    return found


def draw_bar(sheet: Sheet, name: str, link: Link) -> Iterator[Mark]:
    """Yield a rigid link to scale: a bar through its points, or a plate if they are not in line."""
    section, frame, ink = link.body.section, sheet.body_frame(name), sheet.inks[name]
    has_section = isinstance(section, Section)
    thickness, width = (section.thickness, section.width) if has_section else (0.5 * sheet.unit, 0.5 * sheet.unit)
    local = [sheet.place_on(name, point) for point in link.points]  # of start, end, further points; the start is the origin
    _, end, *_ = local
    length, along = hypot(*end), normalise(end)
    label = (sum(x for x, _ in local) / len(local), sum(y for _, y in local) / len(local))
    off_line = [abs(along[0] * y - along[1] * x) for x, y in local]
    if max(off_line) > thickness:
        from scipy.spatial import ConvexHull  # slow to load

        yield Outline(frame, ink, tuple(local[k] for k in ConvexHull(local).vertices), closed=True, width=width)
    else:
        reach = [along[0] * x + along[1] * y for x, y in local]
        a, b = min(reach), max(reach)
        outline = capsule((a * along[0], a * along[1]), (b * along[0], b * along[1]), thickness / 2)
        yield Outline(frame, ink, outline, closed=True, width=width)
        normal_x, normal_y = -along[1], along[0]  # the name stands beside the bar
        half_width, half_height = 0.2 * len(name) + 0.25, 0.5  # of the name, in symbols
        offset = 0.5 * thickness + sheet.unit * (half_height * abs(normal_y) + half_width * abs(normal_x))
        label = (label[0] + offset * normal_x, label[1] + offset * normal_y)
    if not has_section:  # its mass is given by numbers, and the bar does not show where
        _mass, _inertia, (x, y) = link.body.mass_properties(length)  # centre of mass in axes along and across the link
        centre = (along[0] * x - along[1] * y, along[1] * x + along[0] * y)
        yield Disc(frame, ink, centre, 0.32 * sheet.unit)
        yield Disc(frame, "mass", centre, 0.1 * sheet.unit)
    yield Label(frame, name, label, "link")


def draw_strip(sheet: Sheet, name: str, link: Link) -> Iterator[Mark]:
    """Yield a flexible link along its bent line."""
    yield StripMark(name, sheet.inks[name])
    middle_frame = MIDDLE + name  # name of the frame at the middle of the link
    yield Label(middle_frame, name, (0.0, 0.9 * sheet.unit), "link")


def draw_support(sheet: Sheet, joint: Joint) -> Iterator[Mark]:
    """Yield a triangle on the ground below a joint with the ground."""
    if GROUND in (joint.first, joint.second):
        u, frame = sheet.unit, sheet.frame_at(GROUND, joint.point)
        yield Outline(frame, "support", ((0.0, 0.0), (-0.85 * u, -1.4 * u), (0.85 * u, -1.4 * u)), closed=True)
        yield from hatching(frame, (-1.3 * u, -1.4 * u), (1.3 * u, -1.4 * u), u)


def draw_pin(sheet: Sheet, _name: str, joint: Joint) -> Iterator[Mark]:
    """Yield the pin of an ideal revolute joint."""
    yield from draw_support(sheet, joint)
    yield Disc(sheet.frame_at(_moving_body(joint), joint.point), "pin", (0.0, 0.0), 0.38 * sheet.unit)


def draw_bush(sheet: Sheet, _name: str, joint: Clearance) -> Iterator[Mark]:
    """Yield a pin in a bush, radii not to scale; the eccentricity is enlarged so that the drawn circles touch in contact."""
    yield from draw_support(sheet, joint)
    outer, inner, u = sheet.frame_at(joint.second, joint.point), sheet.frame_at(joint.first, joint.point), sheet.unit
    yield Disc(outer, "bush", (0.0, 0.0), 0.66 * u)
    drawn_clearance = 0.28 * u  # difference of the drawn radii
    enlargement = drawn_clearance / joint.gap  # `gap` is the clearance [m]
    yield Disc(sheet.enlarged_frame(outer, inner, enlargement), "pin", (0.0, 0.0), 0.38 * u)


def draw_weld(sheet: Sheet, _name: str, joint: Weld) -> Iterator[Mark]:
    """Yield a dark square for two bodies welded together."""
    yield from draw_support(sheet, joint)
    half, frame = 0.42 * sheet.unit, sheet.frame_at(_moving_body(joint), joint.point)
    yield Outline(frame, "mass", ((-half, -half), (half, -half), (half, half), (-half, half)), closed=True)


def draw_slot(sheet: Sheet, _name: str, joint: Slot) -> Iterator[Mark]:
    """Yield a pin of the first body in a slot of the second."""
    u, along = sheet.unit, normalise(joint.along)
    groove = capsule((-4.0 * u, 0.0), (4.0 * u, 0.0), 0.5 * u)
    outline = place_along(groove, along, origin=sheet.place_on(joint.second, joint.point))
    yield Outline(sheet.body_frame(joint.second), "rail", outline, closed=True)
    yield Disc(sheet.frame_at(joint.first, joint.point), "pin", (0.0, 0.0), 0.38 * u)


def draw_sleeve(sheet: Sheet, _name: str, joint: Slider) -> Iterator[Mark]:
    """Yield a block of the first body on a line of the second."""
    u, along = sheet.unit, normalise(joint.along)
    line = place_along(((-4.0, 0.0), (4.0, 0.0)), along, scale=u, origin=sheet.place_on(joint.second, joint.point))
    yield Outline(sheet.body_frame(joint.second), "rail", line)
    yield Outline(sheet.frame_at(joint.first, joint.point), "block", _block(along, u), closed=True)


def draw_guide(sheet: Sheet, _name: str, guide: Guide) -> Iterator[Mark]:
    """Yield a block on a rail that is as long as the block's travel in the run."""
    u, along = sheet.unit, guide.along
    travel = (sheet.record.point(guide.point)[0] - sheet.mechanism.points[guide.point]) @ np.array(along)
    travel = travel[np.isfinite(travel)]
    a, b = float(travel.min(initial=0.0)), float(travel.max(initial=0.0))
    frame = sheet.frame_at(GROUND, guide.point)
    start, end = place_along(((a - 1.8 * u, -0.62 * u), (b + 1.8 * u, -0.62 * u)), along)
    yield from hatching(frame, start, end, u, "rail")
    block = sheet.upright_frame(guide.point)
    yield Outline(block, "block", _block(along, u), closed=True)
    yield Disc(block, "pin", (0.0, 0.0), 0.3 * u)


HALF_BLOCK = (0.95, 0.58)
"""Half length and half height of a block, over the size of a symbol."""


def _block(along: Pair, size: float) -> tuple[Pair, ...]:
    """Return the outline of a block along a direction, for a size of symbols [m]."""
    x, y = HALF_BLOCK
    return place_along(((-x, -y), (x, -y), (x, y), (-x, y)), along, scale=size)


def draw_stop(sheet: Sheet, name: str, stop: Stop) -> Iterator[Mark]:
    """Yield a wall, moved back by the drawn size of the stop's point so that drawings touch in contact, and the force's arrow."""
    mechanism, u = sheet.mechanism, sheet.unit
    normal = stop.face_normal(mechanism)
    side = stop.side(mechanism)  # 1 if the normal leads from the stop's point at t = 0 to the face, else -1
    body, reference = place(stop.origin(mechanism))  # point of the body with the face, in whose frame the wall is fixed
    frame = sheet.frame_at(body, reference)
    (x, y), (x0, y0) = mechanism.points[stop.point], mechanism.points[reference]
    is_block = stop.point in {guide.point for guide in mechanism.guides}  # whether or not the face is normal to the guide
    # half size of the drawn point (a block meets a wall with its end) and half length of the wall
    size_of_point, half = (HALF_BLOCK[0] * u, 1.3 * u) if is_block else (0.2 * u, 1.8 * u)
    front = stop.distance_to_face(mechanism) + side * size_of_point  # coordinate from the stop's point along the normal, signed
    back = front + side * 0.6 * u
    wall = ((front, -half), (front, half), (back, half), (back, -half))
    yield Outline(frame, "stop", place_along(wall, normal, origin=(x - x0, y - y0)), closed=True)
    push = (-side * normal[0], -side * normal[1])  # the direction of the force on the point, fixed in the frame of the wall
    # a stop whose face is normal to the guide acts on the guide's block, which has no name as a body
    point = sheet.frame_of(stop.point) if stop.is_in_guide else sheet.frame_at(stop.body(mechanism), stop.point)
    yield Arrow(point, "force", (f"{name}.contact_force",), along=push, within=frame)


def draw_unknown(sheet: Sheet, name: str, element: Element) -> Iterator[Mark]:
    """Yield a neutral mark and the element's name, at the first point or link that a field of the element names."""
    for field in ("point", "at", "a", "first", "link", "target", "start"):
        reference = getattr(element, field, None)
        if isinstance(reference, str) and place(reference).point in sheet.mechanism.points:
            frame = sheet.frame_at(*place(reference))
        elif isinstance(reference, str) and reference in sheet.inks:
            frame = sheet.body_frame(reference)
        else:
            continue
        half = 0.8 * sheet.unit
        yield Outline(frame, "other", ((-half, 0.0), (0.0, -half), (half, 0.0), (0.0, half)), closed=True)
        yield Label(frame, name, (1.2 * half, -1.2 * half), "symbol")
        return


SYMBOLS: dict[str, Symbol] = {
    "Rigid": draw_bar, "Beam": draw_strip, "Cable": draw_strip, "Strut": draw_strip, "Modal": draw_strip,
    "Revolute": draw_pin, "Clearance": draw_bush, "Weld": draw_weld, "Slot": draw_slot, "Slider": draw_sleeve,
    "Guide": draw_guide, "Stop": draw_stop,
    "Spring": loads.draw_spring, "TorsionSpring": loads.draw_spiral, "Force": loads.draw_force, "Torque": loads.draw_torque,
    "LineLoad": loads.draw_line_load, "Motor": loads.draw_motor, "Drive": loads.draw_drive, "Mass": loads.draw_mass,
    "Gear": loads.draw_gear, "Rack": loads.draw_rack, "Belt": loads.draw_belt, "Rope": loads.draw_rope,
}  # fmt: skip
"""Symbol of each kind of element or body, by the name of its class; for others see `symbol`."""


def _forces(sheet: Sheet, name: str, element: Element) -> Iterator[Mark]:
    """Yield an arrow at an element's point for the signals `NAME.fx`, `NAME.fy`; report pages omit it if a run has none."""
    point = getattr(element, "point", None)
    if isinstance(point, str):
        body = getattr(element, "second", "")
        is_on_body = body not in ("", GROUND)  # a joint's point on the second body, where the force acts
        frame = sheet.frame_at(body, point) if is_on_body else sheet.frame_of(place(point).point)
        yield Arrow(frame, "force", (f"{name}.fx", f"{name}.fy"))


def _gravity(sheet: Sheet) -> Iterator[Mark]:
    """Yield an arrow in the direction of gravity, above and right of all points."""
    if any(sheet.mechanism.gravity):
        gx, gy = normalise(sheet.mechanism.gravity)
        places, u = np.array(list(sheet.mechanism.points.values())), sheet.unit
        corner = (float(places[:, 0].max()) + 3 * u, float(places[:, 1].max()) + 3 * u)
        tip = (corner[0] + 3 * u * gx, corner[1] + 3 * u * gy)
        ground = ""  # the frame's name
        yield from drawing.draw_arrow(ground, "other", corner, tip, 0.8 * u)
        yield Label(ground, "g", (corner[0] + 0.7 * u, corner[1]), "symbol")


def _moving_body(joint: Joint) -> str:
    return str(joint.second if joint.first == GROUND else joint.first)
