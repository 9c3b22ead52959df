"""Rigid links, and masses fixed to links."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot
from typing import ClassVar

import numpy as np

from ..declare import Declared, declared, names, part, quantity, vector
from .element import GROUND, Body, Burden, Element, Linked, Parts, Recorded, place
from .references import check_known, holder, reaches
from .section import Section
from .signal import Energy, Kind, Signal


@declared
class Inertia(Declared):
    """Mass, moment of inertia and centre of mass of a rigid link."""

    mass: float = quantity("kg", above=0, doc="of the link")
    inertia: float = quantity("kg m^2", above=0, doc="about the centre of mass")
    centre: tuple[float, float] | None = vector(
        "m", doc="centre of mass from the link's start, x towards its end; half-way between the ends by default", default=None
    )


@declared
class Rigid(Body):
    """A rigid link: a uniform bar of a section, or one of given mass, inertia and centre of mass (`Rigid.of`).

    Examples
    --------
    >>> Rigid(Section(width=0.03, thickness=5e-3)).section.mass_per_length  # kg/m
    1.1775
    >>> Rigid.of(mass=0.2, inertia=1e-4).section.mass
    0.2
    """

    section: Section | Inertia = part(Section, Inertia, doc="a bar of this section, or mass and inertia")

    flexible: ClassVar[bool] = False
    carrying: ClassVar[tuple[str, ...]] = ("place", "fraction")

    inlined: ClassVar[Mapping[str, type]] = {"section": Inertia}

    @classmethod
    def of(cls, *, mass: float, inertia: float, centre: tuple[float, float] | None = None) -> Rigid:
        """Return a rigid link of given mass [kg], inertia about its centre of mass [kg m^2], and that centre [m].

        The centre is in the frame of the link, not in that of the drawing: (0, 0) is the link's first point, x points to its
        second one, y to the left of that. By default it is half-way between the two.
        """
        return cls(Inertia(mass, inertia, centre))

    def inertia(self, length: float) -> tuple[float, float, tuple[float, float]]:
        if isinstance(self.section, Inertia):
            return self.section.mass, self.section.inertia, self.section.centre or (length / 2, 0.0)
        return self.section.bar(length)

    def signals(self, link: Linked, record: Recorded) -> Iterator[Signal]:
        """Yield the angle turned since t = 0 [rad], the angle from the x axis [rad], and their rate [rad/s]."""
        angle, spin = record.turn(f"{link.name}:{link.start}")
        reach = np.subtract(record.mechanism.points[link.end], record.mechanism.points[link.start])
        drawn = np.arctan2(reach[1], reach[0])
        yield Signal(f"{link.name}.angle", angle, "rad", Kind.PLACE, rate=f"{link.name}.spin")
        yield Signal(f"{link.name}.direction", drawn + angle, "rad", Kind.PLACE, rate=f"{link.name}.spin")
        yield Signal(f"{link.name}.spin", spin, "rad/s", Kind.RATE)


@declared
class Mass(Element):
    """A mass fixed to a link, or to a guide's block, at a point.

    Examples
    --------
    >>> Mass("A", 0.2).key
    'mass.A'
    """

    title: ClassVar[str] = "mass at '{point}'"
    label: ClassVar[str] = "mass.{point}"

    point: str = names(doc="of a link; on the end of a strut it is fixed to what the strut is pinned to")
    mass: float = quantity("kg", above=0, doc="of what is fixed there")
    inertia: float = quantity("kg m^2", low=0, doc="about the point; a block, which does not turn, takes none", default=0.0)
    link: str | None = names(doc="which of the links at the point carries it; the first that has mass by default", default=None)

    def check(self, mechanism: Parts) -> None:
        where = self.where
        check_known("point", self.point, mechanism.points, where)
        if self.link is not None:
            reaches(mechanism, self.link, self.point, where)
        body = place(self.at(mechanism)).body
        if body == GROUND:
            raise ValueError(f"{where}: it lies on the ground; name a point of a link")
        if self.inertia and body not in {link.name for link in mechanism.links}:
            raise ValueError(f"{where}: inertia = {self.inertia:g} kg m^2: must be 0 on a guide's block, which does not turn")

    def at(self, mechanism: Parts) -> str:
        """Return the point reference at which it is fixed."""
        reference = self.point if self.link is None else f"{self.link}:{self.point}"
        return f"{holder(mechanism, reference)}:{self.point}"

    def burdens(self, mechanism: Parts) -> Iterator[Burden]:
        yield Burden(self.at(mechanism), self.mass, self.inertia)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        at, gravity = self.at(record.mechanism), record.mechanism.gravity
        (places, velocity), (_, spin) = record.point(at), record.turn(at)
        yield Energy("held", "kinetic", 0.5 * self.mass * (velocity**2).sum(axis=1) + 0.5 * self.inertia * spin**2)
        if hypot(*gravity) > 0:
            yield Energy("held", "weight", -self.mass * (places @ np.array(gravity)))
