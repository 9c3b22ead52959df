"""Stops: what a point must not pass."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs.elements.element import Array, Depth, Element, Energy, Recorded, Signal, known, since_start
from buckler.mbs.laws import NormalLaw
from buckler.mbs.validate import follows, number

PIERCED = 0.05
"""Depth in a stop, relative to the mechanism's size, beyond which its contact law does not hold."""


@dataclass(frozen=True)
class Stop(Element):
    """A stopper in the way of a guided point.

    Parameters
    ----------
    point : str
        A guided point.
    at : float
        Place of the stopper's face along the guide: the dot product of its position with the guide's direction, m. The point
        starts on one side of it and is kept there.
    law : NormalLaw
        Contact law of `buckler.mbs.laws`.
    """

    point: str
    at: float
    law: NormalLaw

    def __post_init__(self) -> None:
        number("at", self.at, -1e6, 1e6, "m")
        follows(f"stop at '{self.point}': law", self.law, NormalLaw, "CarvalhoMartins(...)")

    @property
    def key(self) -> str:
        """Its point."""
        return self.point

    def check(self, mechanism: Any) -> None:
        """A guided point."""
        known("guided point", self.point, {guide.point for guide in mechanism.guides}, "stop")

    def side(self, mechanism: Any) -> float:
        """+1 if the face lies ahead of the start in the guide's direction, -1 if behind."""
        return 1.0 if self.at > self._start(mechanism) else -1.0

    def face(self, mechanism: Any) -> float:
        """Travel along the guide at which the point touches, m.

        Raises
        ------
        ValueError
            If the point starts on the stop's face, so that its side is undefined.
        """
        start = self._start(mechanism)
        if self.at == start:
            raise ValueError(f"stop at '{self.point}': at = {self.at:g} m is where the point starts; it must lie to one side")
        return self.at - start

    def _start(self, mechanism: Any) -> float:
        return float(np.dot(mechanism.guide(self.point).along, mechanism.points[self.point]))

    def depth(self, record: Recorded) -> Array:
        """Penetration depth, m, positive in contact, (times,)."""
        return self.side(record.mechanism) * (record.blocks[self.point].travel - self.face(record.mechanism))

    def pushes(self, name: str, record: Recorded) -> Iterator[tuple[str, Array, Array]]:
        """Yield its force on the guided point."""
        guide = record.mechanism.guide(self.point)
        size = -self.side(record.mechanism) * record.channel(name, "force")[:, 0]
        yield f"{guide.link}:{self.point}", np.outer(size, guide.along), np.zeros_like(size)

    def depths(self, name: str, mechanism: Any) -> Iterator[Depth]:
        """Yield its depth and a share of the mechanism's size."""
        size = max(mechanism.length(link.name) for link in mechanism.links)
        yield Depth(f"{name}.penetration", PIERCED * size, f"'{name}'", "inside its stop; the stop is too soft for this motion")

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield contact force, N, and penetration depth, m."""
        yield Signal(f"{name}.contact_force", record.channel(name, "force")[:, 0], "N")
        yield Signal(f"{name}.penetration", np.maximum(self.depth(record), 0.0), "m")

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the elastic potential, and what damping took."""
        potential = self.law.potential(self.depth(record))
        rate = self.side(record.mechanism) * record.blocks[self.point].speed
        work = since_start(record.time, record.channel(name, "force")[:, 0] * rate)
        yield Energy("held", "contact", potential)
        yield Energy("taken", "contact", work - (potential - potential[0]))
