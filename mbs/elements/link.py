"""A link: two points, what it is made of, and what else it carries."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

from buckler.mbs.elements.beam import Beam, Cable
from buckler.mbs.elements.body import Body
from buckler.mbs.elements.element import Element, Energy, Recorded, Signal, known
from buckler.mbs.elements.frozen import Frozen
from buckler.mbs.elements.modal import Modal
from buckler.mbs.elements.rigid import Rigid
from buckler.mbs.elements.strut import Strut
from buckler.mbs.validate import number, one_of, positive, sequence_of, short, word

BODIES = (Rigid, Strut, Beam, Cable, Modal)
"""Kinds of body, one line a kind."""


@dataclass(frozen=True)
class Link(Element):
    """A named link from one point to another.

    Parameters
    ----------
    name, start, end : str
        Its name, and the names of the points at its two ends.
    body : Rigid, Strut, Beam, Cable or Modal
        What it is made of, and so how it is modelled.
    carries : sequence of str, or mapping of str to float
        Further points of the link: names, their places among the mechanism's points (rigid links only), or names with the
        fraction of the length, in (0, 1), at which they lie (rigid links, beams and cables).
    """

    name: str
    start: str
    end: str
    body: Body
    carries: Sequence[str] | Mapping[str, float] = ()

    def __post_init__(self) -> None:
        for what in ("name", "start", "end"):
            word(f"{what} of a link", getattr(self, what))
        one_of(f"body of link '{self.name}'", self.body, BODIES)
        if isinstance(self.carries, str):
            raise ValueError(f"carries of link '{self.name}' = {short(self.carries)}: must be a sequence of names or a mapping")
        if not isinstance(self.carries, Mapping):
            names = sequence_of(f"carries of link '{self.name}'", self.carries, (str,))
        along = self.carries if isinstance(self.carries, Mapping) else dict.fromkeys(names)
        object.__setattr__(self, "carries", Frozen(along))
        for point, part in along.items():
            if part is not None:
                number(f"carries['{point}'] of link '{self.name}'", part, 0.0, 1.0, "1")
        kind = type(self.body).__name__
        if along and not self.body.carrying:
            raise ValueError(f"link '{self.name}': only Rigid links, beams and cables carry further points, not a {kind}")
        if None in along.values() and "place" not in self.body.carrying:
            raise ValueError(f"link '{self.name}': only a Rigid link carries points by name alone, not a {kind}; give fractions")

    @property
    def key(self) -> str:
        """Its name."""
        return self.name

    def check(self, mechanism: Any) -> None:
        """Known points, some distance apart."""
        for point in self.points:
            known("point", point, mechanism.points, f"link '{self.name}'")
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
            for letters, values in zip(("", "v", "a"), record.links[name].centre(), strict=True):
                unit = {"": "m", "v": "m/s", "a": "m/s^2"}[letters]
                for axis, letter in enumerate("xy"):
                    yield Signal(f"{name}.{letters}{letter}", values[:, axis], unit)
        yield from self.body.signals(self, record)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield kinetic energy, weight, and those of the body."""
        if name in record.links:
            motion = record.links[name]
            yield Energy("held", "kinetic", motion.kinetic())
            yield from weight(motion, record)
        yield from self.body.energies(self, record)


def weight(motion: Any, record: Recorded) -> Iterator[Energy]:
    """Yield the potential of gravity where it lies in the plane."""
    gravity = record.mechanism.gravity
    if hypot(*gravity) > 0:
        yield Energy("held", "weight", -motion.mass * (motion.centre()[0] @ gravity))
