"""Clamped joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from ..declare import declared, names
from ..geometry import Array
from .element import Parts, Recorded
from .joint import Joint
from .references import takes_moments
from .rows import Row, meets, same_turn
from .signal import Kind, Signal, vector


@declared
class Weld(Joint):
    """A clamp: two bodies share a point and keep the angle they have there at t = 0.

    Examples
    --------
    >>> Weld("B", "coupler", "rocker").key
    'B.coupler-rocker'
    """

    title: ClassVar[str] = "weld at '{point}'"

    point: str = names(doc="where they meet")
    first: str = names(doc="a link or 'ground'")
    second: str = names(doc="a link or 'ground'; a Strut has no moment to be clamped by")

    def check(self, mechanism: Parts) -> None:
        """Two different bodies that reach the point and can take a moment there."""
        super().check(mechanism)
        takes_moments(mechanism, (self.first, self.second), self.where)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield that the points stay together, and the angle as it is."""
        yield from meets(self.point, self.first, self.second)
        yield from same_turn(self.point, self.first, self.second)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return force and moment on the second body."""
        return {"force": -multipliers[:, :2], "moment": -multipliers[:, 2:]}

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield force, N, and moment, N m, on the second body."""
        yield from vector(f"{name}.f", record.channel(name, "force"), "N", Kind.REACTION)
        yield Signal(f"{name}.moment", record.channel(name, "moment")[:, 0], "N m", Kind.REACTION)
