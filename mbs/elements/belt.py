"""Belts and chains round two pulleys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from ..declare import declared, flag, names, quantity
from ..geometry import Array
from .coupling import Coupling
from .element import GROUND, Parts, Push, Recorded, place
from .load import on_both
from .references import carried_by
from .rows import Row, Turn
from .signal import Energy, Kind, Signal


@declared
class Belt(Coupling):
    """A belt or chain round two pulleys that does not slip: inextensible, or with stiffness.

    Torques act on both pulleys and on the carrier of their axles. What presses on the axles by how tight the belt is, is left
    out, and so is its mass.

    Examples
    --------
    >>> Belt("motor", "drum", radius=0.01, other_radius=0.03).key
    'belt.motor-drum'
    """

    sense: ClassVar[float] = -1.0

    first: str = names(doc="a pulley and its centre, such as 'motor:A'")
    second: str = names(doc="the same of the other")
    radius: float = quantity("m", above=0, doc="of the first pulley")
    other_radius: float = quantity("m", above=0, doc="of the second")
    crossed: bool = flag(doc="whether the spans cross, so that the pulleys turn against each other", default=False)
    stiffness: float | None = quantity(
        "N/m", above=0, doc="pull by the way one rim is ahead of the other, both spans together; inextensible by default",
        default=None,
    )  # fmt: skip
    damping: float = quantity("N s/m", low=0, doc="of a belt with stiffness; the inextensible one does not use it", default=0.0)
    carrier: str = names(doc="the link that carries both axles, or 'ground'", default=GROUND)

    def shares(self, mechanism: Parts) -> tuple[tuple[float, Turn], ...]:
        """Return the way by which the first rim is ahead of the second, m, as coefficients of the pulleys' turns."""
        base, back = carried_by(mechanism, self.carrier), self.other_radius if self.crossed else -self.other_radius
        return (self.radius, Turn(place(self.first), base)), (back, Turn(place(self.second), base))

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield that the rims go the same way; nothing of a belt with stiffness."""
        if self.stiffness is None:
            yield Row(self.shares(mechanism))

    def stretch(self, record: Recorded) -> tuple[Array, Array]:
        """Way by which the first rim is ahead, m, and its rate, m/s, each (times,)."""
        found = np.zeros((2, len(record.time)))
        for share, measure in self.shares(record.mechanism):
            for end, sign in ((measure.first, share), (measure.second, -share)):
                if end.body != GROUND:
                    found += sign * np.array(record.turn(f"{end.body}:{end.point}"))
        return found[0], found[1]

    def pull(self, name: str, record: Recorded) -> Array:
        """Tension of the span that pulls the second pulley after the first, less that of the other, N, (times,)."""
        if self.stiffness is None:
            found: Array = self.sense * record.channel(name, "effort")[:, 0]
            return found
        value, rate = self.stretch(record)
        return self.stiffness * value + self.damping * rate

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the torques of a belt with stiffness."""
        if self.stiffness is not None:
            pull, none = self.pull(name, record), np.zeros((len(record.time), 2))
            for share, measure in self.shares(record.mechanism):
                ends = [f"{end.body}:{end.point}" for end in (measure.first, measure.second)]
                yield from on_both(ends, none, -share * pull)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the pull, N, and of a belt with stiffness the way by which the first rim is ahead, m."""
        kind = Kind.REACTION if self.stiffness is None else Kind.INTERNAL
        yield Signal(f"{name}.force", self.pull(name, record), "N", kind)
        if self.stiffness is not None:
            yield Signal(f"{name}.elongation", self.stretch(record)[0], "m", Kind.STRETCH)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield what it stores, and what damping took."""
        if self.stiffness is not None:
            value, rate = self.stretch(record)
            yield Energy("held", "spring", 0.5 * self.stiffness * value**2)
            yield Energy("taken", "damping", record.work(self.damping * rate**2))
