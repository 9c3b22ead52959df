"""Joints that let a point slide along a line of another link: with its angle kept, or free."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

from buckler.mbs.elements.element import GROUND, Array, Joint, Recorded, Signal, known, reaches, takes_moments, turned
from buckler.mbs.elements.rows import Row, on_line, same_turn
from buckler.mbs.validate import direction


@dataclass(frozen=True)
class Slot(Joint):
    """A pin in a straight slot: a point of the first body stays on a line of the second, and turns freely.

    Parameters
    ----------
    point : str
        A point of the first body; the line goes through its place at t = 0.
    first, second : str
        The two bodies, links or 'ground'. A flexible second link must reach the point: the line is fixed in its section there.
    along : (float, float)
        Direction of the line at t = 0; need not be a unit vector.
    """

    point: str
    first: str
    second: str
    along: tuple[float, float] = (1.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "along", direction(f"{type(self).__name__} at '{self.point}': along", self.along))

    def check(self, mechanism: Any) -> None:
        """A point of the first body, and a second body in which a line can be fixed there."""
        where = f"{type(self).__name__} at '{self.point}'"
        known("point", self.point, mechanism.points, where)
        if self.first == GROUND:
            raise ValueError(f"{where}: first = 'ground': the point must be a link's; swap the bodies")
        self.apart(mechanism, where)
        reaches(mechanism, self.first, self.point, where)
        if self.second != GROUND:
            links = {link.name: link for link in mechanism.links}
            known("link", self.second, links, where)
            if links[self.second].body.flexible:
                reaches(mechanism, self.second, self.point, where)
        takes_moments(mechanism, (self.first, self.second), where)

    def rows(self, mechanism: Any) -> Iterator[Row]:
        """Yield that the point stays on the line."""
        yield from on_line(self.point, self.first, self.second, self.along)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return normal force, and moment if it keeps the angle, on the second body."""
        return {"effort": -multipliers}

    def travel(self, record: Recorded) -> Array:
        """Way along the line since t = 0, m, (times,)."""
        on = f"{self.second}:{self.point}"
        apart = record.point(f"{self.first}:{self.point}")[0] - record.point(on)[0]
        found: Array = (apart * turned(record.turn(on)[0], self.along)).sum(axis=1)
        return found

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force on the second body to the left of the line, N, and the travel along it, m."""
        yield Signal(f"{name}.normal_force", record.channel(name, "effort")[:, 0], "N")
        yield Signal(f"{name}.travel", self.travel(record), "m")


@dataclass(frozen=True)
class Slider(Slot):
    """A prismatic joint: a point of the first body stays on a line of the second, and the angle between them as it is.

    Parameters
    ----------
    point : str
        A point of the first body; the line goes through its place at t = 0.
    first, second : str
        The two bodies, links or 'ground'. A flexible second link must reach the point: the line is fixed in its section there.
    along : (float, float)
        Direction of the line at t = 0; need not be a unit vector.
    """

    keeps_angle: ClassVar[bool] = True

    def rows(self, mechanism: Any) -> Iterator[Row]:
        """Yield that the point stays on the line, and the angle as it is."""
        yield from super().rows(mechanism)
        yield from same_turn(self.point, self.first, self.second)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield normal force, N, moment about the point on the second body, N m, and travel, m."""
        yield from super().signals(name, record)
        yield Signal(f"{name}.moment", record.channel(name, "effort")[:, 1], "N m")
