"""A link: two points, what it is made of, and what else it carries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import hypot
from typing import Any

from buckler.mbs.declare import Either, Name, Named, Nothing, Quantity, Several, Spec, declared, field, names, part
from buckler.mbs.declare.compound import any_of, is_list
from buckler.mbs.declare.spec import Schema
from buckler.mbs.elements.body import Body
from buckler.mbs.elements.element import Array, Element, Energy, Kind, Recorded, Signal, known
from buckler.mbs.elements.frozen import Frozen
from buckler.mbs.validate import positive


class Carried(Spec):
    """Names of points, or names with the fraction of the length at which they lie."""

    words = "a sequence of names or a mapping of names to fractions"

    def read(self, name: str, given: Any) -> Frozen:
        """Return a mapping; None where a name stands alone."""
        if isinstance(given, Mapping):
            fraction = Either((Quantity("1", 0.0, 1.0), Nothing()))
            return Frozen({point: fraction.read(f"{name}.{point}", along) for point, along in given.items()})
        if isinstance(given, str) or not is_list(given):
            raise self.refused(name, given)
        return Frozen(dict.fromkeys(Several(Name()).read(name, given)))

    def written(self, name: str, value: Any) -> Any:
        """A list where nothing is said of each."""
        return list(value) if all(each is None for each in value.values()) else dict(value)

    def schema(self) -> Schema:
        """A list or a table."""
        return any_of([Several(Name()).schema(), Named(Quantity("1", 0.0, 1.0)).schema()])


@declared
class Link(Element):
    """A named link from one point to another."""

    name: str = names(doc="of the link")
    start: str = names(doc="the point at one end")
    end: str = names(doc="the point at the other end")
    body: Body = part(Body, doc="what it is made of, and so how it is modelled")
    carries: Sequence[str] | Mapping[str, float] = field(
        Carried(),
        "further points of the link: names, their places among the mechanism's points (rigid links only), or names with the "
        "fraction of the length, in (0, 1), at which they lie (rigid links, beams and cables)",
        default=(),
    )

    @property
    def where(self) -> str:
        """'link' and its name."""
        return f"link '{self.name}'"

    def agree(self) -> None:
        """Only points that its body can carry."""
        along: Any = self.carries
        kind = type(self.body).__name__
        if along and not self.body.carrying:
            raise ValueError(f"{self.where}: only Rigid links, beams and cables carry further points, not a {kind}")
        if None in along.values() and "place" not in self.body.carrying:
            raise ValueError(f"{self.where}: only a Rigid link carries points by name alone, not a {kind}; give fractions")

    @property
    def key(self) -> str:
        """Its name."""
        return self.name

    def check(self, mechanism: Any) -> None:
        """Known points, some distance apart."""
        for point in self.points:
            known("point", point, mechanism.points, self.where)
        length = positive(f"length of link '{self.name}'", mechanism.length(self.name), "m")
        thickness = self.body.section.thickness if self.body.flexible else 0.0
        if thickness >= length:
            what = f"thickness of flexible link '{self.name}' = {thickness:g} m"
            raise ValueError(f"{what}: must be below its length, {length:g} m; it is no strip")

    @property
    def points(self) -> tuple[str, ...]:
        """All points on the link: start, end, carried."""
        return (self.start, self.end, *self.carries)

    def inner(self, start: tuple[float, float], end: tuple[float, float]) -> dict[str, tuple[float, float]]:
        """Places, m, of the points carried at a fraction of the length, for places of its ends."""
        fractions = {point: part for point, part in self.carries.items() if part is not None}  # type: ignore[union-attr]
        chord = hypot(end[0] - start[0], end[1] - start[1])
        if not fractions or chord == 0:
            return {}
        ax, ay = (end[0] - start[0]) / chord, (end[1] - start[1]) / chord
        local = {point: self.body.along(chord, part) for point, part in fractions.items()}
        return {point: (start[0] + ax * x - ay * y, start[1] + ay * x + ax * y) for point, (x, y) in local.items()}

    def mass(self, length: float) -> float:
        """Mass of the link, kg, for a distance of its ends, m; a strut's is that of its strip, which its model leaves out."""
        return self.body.inertia(length)[0]

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield those of the centre of mass, m, m/s, m/s^2, then those of the body."""
        if name in record.links:
            yield from moving(name, *record.links[name].centre())
        yield from self.body.signals(self, record)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield kinetic energy, weight, and those of the body."""
        if name in record.links:
            motion = record.links[name]
            yield Energy("held", "kinetic", motion.kinetic())
            yield from weight(motion, record)
        yield from self.body.energies(self, record)


def moving(name: str, *motion: Array) -> Iterator[Signal]:
    """Yield place, velocity and acceleration, each (times, 2), as signals: as many of them as there are."""
    letters, units, kinds = ("", "v", "a"), ("m", "m/s", "m/s^2"), (Kind.PLACE, Kind.RATE, Kind.ACCELERATION)
    for order, (letter, unit, kind, values) in enumerate(zip(letters, units, kinds, motion, strict=False)):
        for axis, along in enumerate("xy"):
            rate = f"{name}.{letters[order + 1]}{along}" if order + 1 < len(motion) else ""
            yield Signal(f"{name}.{letter}{along}", values[:, axis], unit, kind, f"{name}.{letter}", rate)


def weight(motion: Any, record: Recorded) -> Iterator[Energy]:
    """Yield the potential of gravity where it lies in the plane."""
    gravity = record.mechanism.gravity
    if hypot(*gravity) > 0:
        yield Energy("held", "weight", -motion.mass * (motion.centre()[0] @ gravity))
