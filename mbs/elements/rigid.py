"""Rigid links."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from buckler.mbs.elements.body import Body
from buckler.mbs.elements.element import Recorded, Signal
from buckler.mbs.elements.section import Section
from buckler.mbs.validate import one_of, pair, positive


@dataclass(frozen=True)
class Inertia:
    """Mass, moment of inertia and centre of mass of a rigid link.

    Parameters
    ----------
    mass : float
        kg, positive.
    inertia : float
        About the centre of mass, kg m^2, positive.
    centre : (float, float), optional
        Centre of mass in the link's frame: from its start, x towards its end, m. Half-way between the ends by default.
    """

    mass: float
    inertia: float
    centre: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        positive("mass", self.mass, "kg")
        positive("inertia", self.inertia, "kg m^2")
        if self.centre is not None:
            object.__setattr__(self, "centre", pair("centre", self.centre, "m"))


@dataclass(frozen=True)
class Rigid(Body):
    """A rigid link: a uniform bar of a section, or one of given mass, inertia and centre of mass (`Rigid.of`).

    Parameters
    ----------
    section : Section or Inertia
    """

    section: Section | Inertia

    flexible: ClassVar[bool] = False
    carrying: ClassVar[tuple[str, ...]] = ("place", "fraction")

    def __post_init__(self) -> None:
        one_of("section", self.section, (Section, Inertia))

    @classmethod
    def of(cls, *, mass: float, inertia: float, centre: tuple[float, float] | None = None) -> Rigid:
        """Return a rigid link of given mass, kg, inertia about its centre of mass, kg m^2, and centre of mass; see `Inertia`."""
        return cls(Inertia(mass, inertia, centre))

    def inertia(self, length: float) -> tuple[float, float, tuple[float, float]]:
        """Mass, kg, inertia about the centre of mass, kg m^2, and that centre in the link's frame, m, of a link this long [m]."""
        if isinstance(self.section, Inertia):
            return self.section.mass, self.section.inertia, self.section.centre or (length / 2, 0.0)
        return self.section.bar(length)

    def signals(self, link: Any, record: Recorded) -> Iterator[Signal]:
        """Yield the angle turned since t = 0, rad, and its rate, rad/s."""
        angle, spin = record.turn(f"{link.name}:{link.start}")
        yield Signal(f"{link.name}.angle", angle, "rad")
        yield Signal(f"{link.name}.spin", spin, "rad/s")
