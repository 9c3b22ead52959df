"""Springs with dampers between two points."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from ..declare import declared, field, names, quantity
from ..functions.fields import Function
from ..geometry import Array, unit
from .element import GROUND, Parts, Push, Recorded
from .load import Elastic, Law, on_both
from .references import distance, holder, holder_reference, refers
from .signal import Kind, Signal


@declared
class Spring(Elastic):
    """A spring with a damper on the line between two points.

    Examples
    --------
    >>> Spring("A", "B", stiffness=120.0, damping=0.3).key
    'spring.A-B'
    """

    title: ClassVar[str] = "spring from '{a}' to '{b}'"
    label: ClassVar[str] = "spring.{a:point}-{b:point}"

    a: str = names(doc="a point reference: 'A', 'coupler:A' or 'ground:P'")
    b: str = names(doc="the same of its other end")
    stiffness: float = quantity("N/m", doc="with a law it is not used and may be 0")
    damping: float = quantity("N s/m", low=0, doc="of the damper", default=0.0)
    free_length: float | None = quantity("m", low=0, doc="distance without force; that at t = 0 by default", default=None)
    law: Law | None = field(
        Function("x, v", "N"),
        "tension instead, as a function of elongation (distance less free length), m, and its rate, m/s; what it gives at rest "
        "is taken for elastic, the rest for damping",
        default=None,
    )

    def check(self, mechanism: Parts) -> None:
        """Two points of different bodies, apart where the spring has a length."""
        where = self.where
        for at in (self.a, self.b):
            refers(mechanism, at, where)
        if holder(mechanism, self.a) == holder(mechanism, self.b) == GROUND:
            raise ValueError(f"{where}: both its ends are on the ground")
        if self.free(mechanism) > 0 and distance(mechanism, self.a, self.b) == 0:
            raise ValueError(f"{where}: its ends coincide, so it has no direction; only a free length of 0 can start there")

    def free(self, mechanism: Parts) -> float:
        """Free length, m."""
        return distance(mechanism, self.a, self.b) if self.free_length is None else self.free_length

    def stretch(self, record: Recorded) -> tuple[Array, Array, Array]:
        """Elongation, m, its rate, m/s, each (times,), and the direction from a to b, (times, 2)."""
        (a, a_t), (b, b_t) = (record.point(holder_reference(record.mechanism, at)) for at in (self.a, self.b))
        length, along = unit(b - a)
        return length - self.free(record.mechanism), ((b_t - a_t) * along).sum(axis=1), along

    def state(self, record: Recorded) -> tuple[Array, Array]:
        """Elongation, m, and its rate, m/s, each (times,)."""
        return self.stretch(record)[:2]

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the tension on both ends."""
        value, rate, along = self.stretch(record)
        ends = [holder_reference(record.mechanism, at) for at in (self.a, self.b)]
        yield from on_both(ends, self.tension(value, rate)[:, None] * along, np.zeros_like(value))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield tension, N, and elongation, m."""
        value, rate = self.state(record)
        yield Signal(f"{name}.force", self.tension(value, rate), "N", Kind.INTERNAL)
        yield Signal(f"{name}.elongation", value, "m", Kind.PLACE)
