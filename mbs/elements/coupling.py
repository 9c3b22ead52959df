"""Couplings of bodies without a common point, each a linear constraint of places and angles: gears, racks, belts, ropes."""

from collections.abc import Iterator
from itertools import pairwise
from typing import ClassVar

from ..declare import Name, Several, declared, direction, field, flag, names, quantity
from ..geometry import Array
from .element import GROUND, Element, Parts, Place, Recorded, place
from .references import angle_reference, check_link, check_no_strut, check_reference, distance, holder_reference
from .rows import Along, Distance, Row, Turn
from .signal import Kind, Signal


class Coupling(Element):
    """Base of couplings. Angles, which a rope does not use, are relative to the carrier of the axles: a link or 'ground'."""

    title: ClassVar[str] = "{kind:lower} of '{first}' and '{second}'"
    label: ClassVar[str] = "{kind:lower}.{first:body}-{second:body}"
    first: str
    second: str
    carrier: str = GROUND

    def place_on_carrier(self, at: Place, direction: tuple[float, float]) -> Along:
        """Return the measure of a point's position relative to the carrier, along a direction that turns with the carrier."""
        return Along(at, Place(self.carrier, at.point), direction, turns=self.carrier != GROUND)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless bodies and carrier differ, have the points, and are no struts."""
        carrier = self.carrier
        if carrier != GROUND:
            check_link(mechanism, carrier, self.where)
        for at in (self.first, self.second):
            if not place(at).body:
                raise ValueError(f"{self.where}: '{at}': name link and point, such as 'wheel:A'")
            check_reference(mechanism, at, self.where)
        bodies = place(self.first).body, place(self.second).body
        if len({carrier, *bodies}) != 3:
            raise ValueError(f"{self.where}: two different bodies are needed, and another carrier")
        check_no_strut(mechanism, (carrier, *bodies), self.where)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the multiplier of the row. Multiplier times coefficient is the load on a measure's first body."""
        return {"effort": multipliers}


@declared
class Gear(Coupling):
    """Meshing gears: two links whose angles, seen from the carrier of their axles, keep a ratio.

    The teeth act at the pitch point, normal to the line of centres. The component of their force along this line, which loads the
    axles only, is left out. If both gears turn about one point, only a torque acts.

    >>> Gear("pinion:O", "wheel:P", ratio=-0.5).key
    'gear.pinion-wheel'
    """

    first: str = names(doc="a link and the centre of its gear, such as 'sun:O'; 'ground:O' is a fixed gear")
    second: str = names(doc="link and centre of the other gear")
    ratio: float = quantity("1", nonzero=True, doc="turns of the second per turn of the first; negative with outer teeth on both")
    carrier: str = names(doc="the link that carries both axles, or 'ground'", default=GROUND)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError for a ratio of 1 with two centres, which has no pitch point."""
        super().check(mechanism)
        if self.ratio == 1 and distance(mechanism, self.first, self.second) > 0:
            raise ValueError(f"{self.where}: ratio = 1: gears about two centres that turn alike have no pitch point")

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the row of equal speeds of both gears at the pitch point, along the tangent t of their pitch circles.

        The pitch point lies r from the centre c1 towards c2, the centres a apart. Relative to the carrier,
        t . c1 + r turn_1 = t . c2 - (a - r) turn_2. With turn_2 = ratio turn_1 this gives r = ratio a/(ratio - 1), which is
        negative or above a for inner teeth. The places t . c1 and t . c2 are zero unless the carrier bends.
        """
        first, second = place(self.first), place(self.second)
        base = place(angle_reference(mechanism, self.carrier))
        apart = distance(mechanism, self.first, self.second)
        if apart == 0:
            yield Row(((1.0, Turn(second, base)), (-self.ratio, Turn(first, base))))
            return
        (x1, y1), (x2, y2) = mechanism.points[first.point], mechanism.points[second.point]
        tangent = (y1 - y2) / apart, (x2 - x1) / apart
        radius = self.ratio * apart / (self.ratio - 1)
        yield Row((
            (1.0, self.place_on_carrier(first, tangent)), (radius, Turn(first, base)),
            (-1.0, self.place_on_carrier(second, tangent)), (apart - radius, Turn(second, base)),
        ))  # fmt: skip

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque of the teeth on the second gear about its centre [N m]."""
        apart = distance(record.mechanism, self.first, self.second)
        arm = 1.0 if apart == 0 else apart / (1 - self.ratio)  # coefficient of turn_2 in the row: 1, or a - r
        yield Signal(f"{name}.torque", arm * record.channel(name, "effort")[:, 0], "N m", Kind.REACTION)


@declared
class Rack(Coupling):
    """Rack and pinion: a link that travels along a line of the carrier by the pinion's radius times its angle.

    The teeth act along the line at the pitch point. The component of their force across the line, which loads axle and guide
    only, is left out. Guide and axle are separate joints.

    >>> Rack("pinion:O", "rack:A", radius=0.02).key
    'rack.pinion-rack'
    """

    first: str = names(doc="the pinion and its centre, such as 'pinion:O'")
    second: str = names(doc="the rack and a point of it, such as 'rack:A'")
    radius: float = quantity("m", above=0, doc="of the pinion's pitch circle")
    along: tuple[float, float] = direction(doc="of travel at t = 0 as the pinion turns to the left", default=(1.0, 0.0))
    carrier: str = names(doc="the link in which axle and line are fixed, or 'ground'", default=GROUND)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the row of equal speeds of rack and pinion along the line at the pitch point.

        Travel of the rack + lever * its turn = travel of the pinion's centre + radius * turn of the pinion. The pinion's centre
        travels only if the carrier bends.
        """
        pinion, rack = place(self.first), place(self.second)
        base = place(angle_reference(mechanism, self.carrier))
        dx, dy = self.along  # a unit vector: `direction` normalises
        (x1, y1), (x2, y2) = mechanism.points[pinion.point], mechanism.points[rack.point]
        pitch_x, pitch_y = x1 + self.radius * dy, y1 - self.radius * dx  # to the right of the line's direction
        lever = (pitch_x - x2) * dy - (pitch_y - y2) * dx  # (pitch point - rack's point) x direction: speed over turning rate
        yield Row((
            (1.0, self.place_on_carrier(rack, self.along)), (lever, Turn(rack, base)),
            (-1.0, self.place_on_carrier(pinion, self.along)), (-self.radius, Turn(pinion, base)),
        ))  # fmt: skip

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force of the teeth on the rack along the line [N]."""
        yield Signal(f"{name}.force", record.channel(name, "effort")[:, 0], "N", Kind.REACTION)


@declared
class Belt(Coupling):
    """An inextensible belt or chain round two pulleys that does not slip.

    Torques act on both pulleys and on the carrier of their axles. The load of the axles by the belt's pretension and the mass of
    the belt are left out.

    >>> Belt("motor:A", "drum:B", radius=0.01, other_radius=0.03).key
    'belt.motor-drum'
    """

    sense: ClassVar[float] = -1.0  # a positive multiplier turns the first pulley to the left; a positive force pulls it back

    first: str = names(doc="a pulley and its centre, such as 'motor:A'")
    second: str = names(doc="the other pulley and its centre")
    radius: float = quantity("m", above=0, doc="of the first pulley")
    other_radius: float = quantity("m", above=0, doc="of the second pulley")
    crossed: bool = flag(doc="whether the spans cross, so that the pulleys turn against each other", default=False)
    carrier: str = names(doc="the link that carries both axles, or 'ground'", default=GROUND)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the row of equal rim speeds: r_1 turn_1 - r_2 turn_2 = 0, or + for crossed spans."""
        base, sign = place(angle_reference(mechanism, self.carrier)), 1.0 if self.crossed else -1.0
        yield Row(((self.radius, Turn(place(self.first), base)), (sign * self.other_radius, Turn(place(self.second), base))))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the tension of the span that drives the second pulley as the first turns to the left, less the other's [N]."""
        yield Signal(f"{name}.force", self.sense * record.channel(name, "effort")[:, 0], "N", Kind.REACTION)


@declared
class Rope(Coupling):
    """An inextensible rope without mass from one point over pulleys to another; it stays taut.

    The pulleys are points without friction. A check reports negative tension, where a real rope goes slack. A wheel with inertia
    is a link, and each part of the rope on it a `Rack`.

    >>> Rope("A", "B", over=("P",)).key
    'rope.A-B'
    """

    sense: ClassVar[float] = -1.0  # a positive multiplier pushes the ends apart

    first: str = names(doc="a point reference: 'A', 'load:A' or 'ground:P'")
    second: str = names(doc="point reference of the other end")
    over: tuple[str, ...] = field(Several(Name(), least=1), "point references of the pulleys, in order from the first end")

    def path(self, mechanism: Parts) -> list[Place]:
        """Return the references of ends and pulleys in order, each on the body that carries the point."""
        path = [place(holder_reference(mechanism, at)) for at in (self.first, *self.over, self.second)]
        bodies = {GROUND, *(link.name for link in mechanism.links)}
        for body, point in path:
            if body not in bodies:  # a guide's block, to which the end of a strut is pinned
                raise ValueError(f"{self.where}: '{point}' is the end of a strut on a guide's block; name a link with mass")
        return path

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless all points are known, neighbours differ, and at least one point is not on the ground."""
        for at in (self.first, *self.over, self.second):
            check_reference(mechanism, at, self.where)
        if all(body == GROUND for body, _ in self.path(mechanism)):
            raise ValueError(f"{self.where}: all its points are on the ground")
        for a, b in pairwise((self.first, *self.over, self.second)):
            if distance(mechanism, a, b) == 0:
                raise ValueError(f"{self.where}: '{a}' and '{b}' coincide, so the rope between them has no direction")

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the row of a constant sum of lengths; a length between two points of one body counts as constant."""
        parts = pairwise(self.path(mechanism))
        yield Row(tuple((1.0, Distance(a, b)) for a, b in parts if a.body != b.body))

    def unilateral_forces(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield the name of the tension, which must not be negative, and '' in place of a contact's depth."""
        yield f"{name}.tension", ""

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the tension [N]."""
        yield Signal(f"{name}.tension", self.sense * record.channel(name, "effort")[:, 0], "N", Kind.REACTION)
