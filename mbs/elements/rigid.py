"""Rigid links, and masses fixed to links."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from typing import ClassVar

import numpy as np

from ..declare import declared, names, part, quantity, vector
from .element import GROUND, Body, Burden, Element, LinkBase, Parts, Recorded, place
from .references import check_known, check_point_of, holder_reference
from .section import Section
from .signal import Energy, Kind, Signal


@declared
class Rigid(Body):
    """A rigid link: a uniform bar of a section, or a body of given mass, inertia and centre of mass (`Rigid.of`).

    >>> round(Rigid(Section(width=0.03, thickness=5e-3)).mass_properties(0.2)[0], 4)  # kg
    0.2355
    """

    section: Section | None = part(Section, doc="of a uniform bar; omitted where mass and inertia are given", default=None)
    mass: float | None = quantity("kg", above=0, doc="of a link without a section", default=None)
    inertia: float | None = quantity("kg m^2", above=0, doc="moment of inertia about the centre of mass", default=None)
    centre: tuple[float, float] | None = vector("m", doc="of mass, in the link's frame; half-way by default", default=None)

    flexible: ClassVar[bool] = False
    carried_point_forms: ClassVar[tuple[str, ...]] = ("place", "fraction")  # in its frame, or of its length

    def agree(self) -> None:
        """Raise a ValueError unless either a section alone, or mass and inertia and possibly a centre are given."""
        has_section, has_mass, has_inertia = (each is not None for each in (self.section, self.mass, self.inertia))
        if has_mass == has_section or has_inertia == has_section or (self.centre and has_section):
            raise ValueError("needs either a section, or a mass and an inertia, and may have a centre with these two only")

    @classmethod
    def of(cls, *, mass: float, inertia: float, centre: tuple[float, float] | None = None) -> Rigid:
        """Return a link of given mass [kg], inertia about its centre [kg m^2] and centre of mass [m], by default half-way."""
        return cls(None, mass, inertia, centre)

    def mass_properties(self, length: float) -> tuple[float, float, tuple[float, float]]:
        """Return mass [kg], inertia about the centre of mass [kg m^2], and the centre of mass in the link's frame [m]."""
        if self.mass is None or self.inertia is None:  # then there is a section, as `agree` has checked
            return super().mass_properties(length)
        return self.mass, self.inertia, self.centre or (length / 2, 0.0)

    def signals(self, link: LinkBase, record: Recorded) -> Iterator[Signal]:
        """Yield the angle turned since t = 0 [rad], the angle from the x axis [rad], and their rate [rad/s]."""
        angle, spin = record.turn(f"{link.name}:{link.start}")
        x, y = np.subtract(record.mechanism.points[link.end], record.mechanism.points[link.start])  # the chord at t = 0
        yield Signal(f"{link.name}.angle", angle, "rad", Kind.PLACE, rate=f"{link.name}.spin")
        yield Signal(f"{link.name}.direction", np.arctan2(y, x) + angle, "rad", Kind.PLACE, rate=f"{link.name}.spin")
        yield Signal(f"{link.name}.spin", spin, "rad/s", Kind.RATE)


@declared
class Mass(Element):
    """A mass fixed to a link, or to a guide's block, at a point.

    >>> Mass("A", 0.2).key
    'mass.A'
    """

    title: ClassVar[str] = "mass at '{point}'"  # in messages
    label: ClassVar[str] = "mass.{point}"  # its name in the mechanism

    point: str = names(doc="of a link; at the end of a strut it is fixed to the body pinned to the strut")
    mass: float = quantity("kg", above=0, doc="fixed at the point")
    inertia: float = quantity("kg m^2", low=0, doc="about the point; 0 on a guide's block, which does not turn", default=0.0)
    link: str | None = names(doc="link at the point that carries the mass; by default the first that has mass", default=None)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the point is on a body, and on a link where there is an inertia."""
        where = self.where
        check_known("point", self.point, mechanism.points, where)
        if self.link is not None:
            check_point_of(mechanism, self.link, self.point, where)
        body = place(self.loaded_point(mechanism)).body  # `place` splits the reference 'body:point'
        if body == GROUND:
            raise ValueError(f"{where}: it lies on the ground; name a point of a link")
        if self.inertia and body not in {link.name for link in mechanism.links}:
            raise ValueError(f"{where}: inertia = {self.inertia:g} kg m^2: must be 0 on a guide's block, which does not turn")

    def loaded_point(self, mechanism: Parts) -> str:
        """Return the point reference 'body:point' on the body that carries the mass."""
        return holder_reference(mechanism, self.point if self.link is None else f"{self.link}:{self.point}")

    def burdens(self, mechanism: Parts) -> Iterator[Burden]:
        """Yield mass and inertia on the body that carries them."""
        yield Burden(self.loaded_point(mechanism), self.mass, self.inertia)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield kinetic energy, and potential energy of gravity."""
        at, gravity = self.loaded_point(record.mechanism), record.mechanism.gravity
        (places, velocity), (_, spin) = record.point(at), record.turn(at)
        yield Energy("stored", "kinetic", 0.5 * self.mass * (velocity**2).sum(axis=1) + 0.5 * self.inertia * spin**2)
        if hypot(*gravity) > 0:
            yield Energy("stored", "weight", -self.mass * (places @ np.array(gravity)))
