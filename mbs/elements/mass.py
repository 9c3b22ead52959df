"""Masses on links."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot
from typing import Any

import numpy as np

from buckler.mbs.elements.element import GROUND, Burden, Element, Energy, Recorded, holder, known, place, reaches
from buckler.mbs.validate import non_negative, positive


@dataclass(frozen=True)
class Mass(Element):
    """A mass fixed to a link, or to a guide's block, at a point.

    Parameters
    ----------
    point : str
        A point of a link. On the end of a strut it is fixed to what the strut is pinned to.
    mass : float
        kg, positive.
    inertia : float
        About the point, kg m^2, not negative; it turns with the link. A block, which does not turn, takes none.
    link : str, optional
        Which of the links at the point carries it; by default the first that has mass.
    """

    point: str
    mass: float
    inertia: float = 0.0
    link: str | None = None

    def __post_init__(self) -> None:
        positive(f"mass at '{self.point}'", self.mass, "kg")
        non_negative(f"inertia of the mass at '{self.point}'", self.inertia, "kg m^2")

    @property
    def key(self) -> str:
        """'mass.A'."""
        return f"mass.{self.point}"

    def check(self, mechanism: Any) -> None:
        """A point of a body, one that turns if the mass has an inertia."""
        where = f"mass at '{self.point}'"
        known("point", self.point, mechanism.points, where)
        if self.link is not None:
            reaches(mechanism, self.link, self.point, where)
        body = place(self.at(mechanism)).body
        if body == GROUND:
            raise ValueError(f"{where}: it lies on the ground; name a point of a link")
        if self.inertia and body not in {link.name for link in mechanism.links}:
            raise ValueError(f"{where}: inertia = {self.inertia:g} kg m^2: must be 0 on a guide's block, which does not turn")

    def at(self, mechanism: Any) -> str:
        """The point reference at which it is fixed."""
        reference = self.point if self.link is None else f"{self.link}:{self.point}"
        return f"{holder(mechanism, reference)}:{self.point}"

    def burdens(self, mechanism: Any) -> Iterator[Burden]:
        """Yield itself."""
        yield Burden(self.at(mechanism), self.mass, self.inertia)

    def moments(self, mechanism: Any) -> Iterator[str]:
        """Yield where it is fixed, if it resists turning."""
        if self.inertia:
            yield self.at(mechanism)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield kinetic energy and weight."""
        at, gravity = self.at(record.mechanism), record.mechanism.gravity
        (places, velocity), (_, spin) = record.point(at), record.turn(at)
        yield Energy("held", "kinetic", 0.5 * self.mass * (velocity**2).sum(axis=1) + 0.5 * self.inertia * spin**2)
        if hypot(*gravity) > 0:
            yield Energy("held", "weight", -self.mass * (places @ np.array(gravity)))
