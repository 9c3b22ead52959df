"""Ropes over pulleys."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import ClassVar

from ..declare import Name, Several, declared, field, names
from .coupling import Coupling
from .element import GROUND, Parts, Place, Recorded
from .references import distance, holder, holder_place, refers
from .rows import Distance, Row
from .signal import Kind, Signal


@declared
class Rope(Coupling):
    """An inextensible rope without mass from one point over pulleys to another; it stays taut.

    The pulleys are points: small, and without friction. A run in which the rope would have to push is not to be trusted, as a
    rope goes slack; a check says so. A wheel with inertia is a link, and each part of the rope on it a `Rack`.

    Examples
    --------
    >>> Rope("A", "B", over=("P",)).key
    'rope.A-B'
    """

    sense: ClassVar[float] = -1.0

    first: str = names(doc="a point reference: 'A', 'load:A' or 'ground:P'")
    second: str = names(doc="the same of its other end")
    over: tuple[str, ...] = field(Several(Name(), least=1), "point references of the pulleys, in order from the first end")

    def path(self, mechanism: Parts) -> list[Place]:
        """Places of ends and pulleys in order, each on the link that holds it."""
        return [holder_place(mechanism, at, self.where) for at in (self.first, *self.over, self.second)]

    def turning(self) -> Iterator[str]:
        """Yield nothing: it turns no link."""
        yield from ()

    def check(self, mechanism: Parts) -> None:
        """Points of bodies that are apart, not all of them on the ground."""
        for at in (self.first, *self.over, self.second):
            refers(mechanism, at, self.where)
        if all(holder(mechanism, at) == GROUND for at in (self.first, *self.over, self.second)):
            raise ValueError(f"{self.where}: all its points are on the ground")
        for one, two in pairwise((self.first, *self.over, self.second)):
            if distance(mechanism, one, two) == 0:
                raise ValueError(f"{self.where}: '{one}' and '{two}' coincide, so the rope between them has no direction")
        self.path(mechanism)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield that the sum of its parts' lengths stays."""
        parts = pairwise(self.path(mechanism))
        yield Row(tuple((1.0, Distance(one, two)) for one, two in parts if one.body != two.body))

    def one_sided(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield its tension."""
        yield f"{name}.tension", ""

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield its tension, N."""
        yield Signal(f"{name}.tension", self.sense * record.channel(name, "effort")[:, 0], "N", Kind.REACTION)
