"""Joints that let a point slide along a line of another link: with its angle kept, or free."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from ..declare import declared, direction, names
from ..geometry import Array, rotate
from .element import GROUND, Parts, Recorded
from .joint import Joint
from .references import check_known, known_link, reaches, takes_moments
from .rows import Row, on_line, same_turn
from .signal import Kind, Signal


@declared
class Slot(Joint):
    """A pin in a straight slot: a point of the first body stays on a line of the second, and turns freely.

    Examples
    --------
    >>> Slot("P", "pin", "bar", along=(1, 0)).key
    'P.pin-bar'
    """

    title: ClassVar[str] = "{kind} at '{point}'"

    keeps_angle: ClassVar[bool] = False

    point: str = names(doc="a point of the first body; the line goes through its place at t = 0")
    first: str = names(doc="a link")
    second: str = names(doc="a link or 'ground'; a flexible one must reach the point: the line is fixed in its section there")
    along: tuple[float, float] = direction(doc="of the line at t = 0; need not be a unit vector", default=(1.0, 0.0))

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless its point is on the first body and a line can be fixed in the second."""
        where = self.where
        check_known("point", self.point, mechanism.points, where)
        if self.first == GROUND:
            raise ValueError(f"{where}: first = 'ground': the point must be a link's; swap the bodies")
        self.check_ends(mechanism)
        reaches(mechanism, self.first, self.point, where)
        if self.second != GROUND:
            known_link(mechanism, self.second, where)
            if mechanism.link(self.second).body.flexible:
                reaches(mechanism, self.second, self.point, where)
        takes_moments(mechanism, (self.first, self.second), where)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the row that keeps the point on the line."""
        yield from on_line(self.point, self.first, self.second, self.along)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return normal force, and moment if it keeps the angle, on the second body."""
        return {"effort": -multipliers}

    def travel(self, record: Recorded) -> Array:
        """Return the travel along the line since t = 0 [m], shape (times,)."""
        on = f"{self.second}:{self.point}"
        apart = record.point(f"{self.first}:{self.point}")[0] - record.point(on)[0]
        found: Array = (apart * rotate(record.turn(on)[0], self.along)).sum(axis=1)
        return found

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force on the second body to the left of the line, N, and the travel along it, m."""
        yield Signal(f"{name}.normal_force", record.channel(name, "effort")[:, 0], "N", Kind.REACTION)
        yield Signal(f"{name}.travel", self.travel(record), "m", Kind.PLACE)


@declared
class Slider(Slot):
    """A prismatic joint: a point of the first body stays on a line of the second, and the angle between them as it is.

    Examples
    --------
    >>> Slider("P", "block", "bar", along=(1, 0)).key
    'P.block-bar'
    """

    keeps_angle: ClassVar[bool] = True

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the rows that keep the point on the line and the angle."""
        yield from super().rows(mechanism)
        yield from same_turn(self.point, self.first, self.second)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield normal force, N, moment about the point on the second body, N m, and travel, m."""
        yield from super().signals(name, record)
        yield Signal(f"{name}.moment", record.channel(name, "effort")[:, 1], "N m", Kind.REACTION)
