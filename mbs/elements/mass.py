"""Masses on links."""

from __future__ import annotations

from collections.abc import Iterator
from math import hypot
from typing import ClassVar

import numpy as np

from ..declare import declared, names, quantity
from .element import GROUND, Burden, Element, Parts, Recorded, place
from .references import check_known, holder, reaches
from .signal import Energy


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
