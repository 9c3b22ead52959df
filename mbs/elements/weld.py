"""Clamped joints."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from buckler.mbs.elements.element import Array, Joint, Recorded, Signal, takes_moments
from buckler.mbs.elements.rows import Row, meets, same_turn


@dataclass(frozen=True)
class Weld(Joint):
    """A clamp: two bodies share a point and keep the angle they have there at t = 0.

    Parameters
    ----------
    point, first, second : str
        The point and the two bodies, links or 'ground'; a Strut has no moment to be clamped by.
    """

    keeps_angle: ClassVar[bool] = True

    point: str
    first: str
    second: str

    def check(self, mechanism: Any) -> None:
        """Two different bodies that reach the point and can take a moment there."""
        super().check(mechanism)
        takes_moments(mechanism, (self.first, self.second), f"weld at '{self.point}'")

    def rows(self, mechanism: Any) -> Iterator[Row]:
        """Yield that the points stay together, and the angle as it is."""
        yield from meets(self.point, self.first, self.second)
        yield from same_turn(self.point, self.first, self.second)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return force and moment on the second body."""
        return {"force": -multipliers[:, :2], "moment": -multipliers[:, 2:]}

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield force, N, and moment, N m, on the second body."""
        force, moment = record.channel(name, "force"), record.channel(name, "moment")
        yield Signal(f"{name}.fx", force[:, 0], "N")
        yield Signal(f"{name}.fy", force[:, 1], "N")
        yield Signal(f"{name}.moment", moment[:, 0], "N m")
