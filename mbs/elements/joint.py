"""Joints of two bodies: ideal pins, clamps, slots and prismatic joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

from ..declare import declared, direction, names
from ..geometry import Array, rotate
from .element import GROUND, Joined, Parts, Recorded
from .references import check_known, known_link, reaches, takes_moments
from .rows import Row, meets, on_line, same_turn
from .signal import Kind, Signal, vector


class Joint(Joined):
    """Joint of two bodies, links or the ground, at a point."""

    title: ClassVar[str] = "joint at '{point}'"
    label: ClassVar[str] = "{point}.{first}-{second}"

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless both bodies have the point and are not joined there already."""
        check_known("point", self.point, mechanism.points, self.where)
        self.check_ends(mechanism)
        for name in (self.first, self.second):
            if name != GROUND:
                reaches(mechanism, name, self.point, self.where)

    def check_ends(self, mechanism: Parts) -> None:
        """Raise a ValueError if it joins a body to itself, or two that are joined at the point already."""
        if self.first == self.second:
            raise ValueError(f"{self.where}: joins '{self.first}' to itself")
        ends = {self.first, self.second}
        if sum(joint.point == self.point and {joint.first, joint.second} == ends for joint in mechanism.joints) > 1:
            raise ValueError(f"{self.where}: joins {' and '.join(sorted(ends))} twice")


@declared
class Revolute(Joint):
    """An ideal pin at a point between two links, or a link and 'ground'.

    Examples
    --------
    >>> Revolute("O", "ground", "crank").key
    'O.ground-crank'
    """

    point: str = names(doc="where they meet")
    first: str = names(doc="a link or 'ground'")
    second: str = names(doc="a link or 'ground'")

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the rows of a common point of both bodies."""
        return meets(self.point, self.first, self.second)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the force on the second body."""
        return {"force": -multipliers}

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force on the second body [N]; none for the pin of a strut, whose end is a point of its neighbour."""
        force = record.channel(name, "force")
        if force.size:
            yield from vector(f"{name}.f", force, "N", Kind.REACTION, name)


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
        """Raise a ValueError unless both bodies have the point and can take a moment."""
        super().check(mechanism)
        takes_moments(mechanism, (self.first, self.second), self.where)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the rows of a common point and of a constant angle."""
        yield from meets(self.point, self.first, self.second)
        yield from same_turn(self.point, self.first, self.second)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return force and moment on the second body."""
        return {"force": -multipliers[:, :2], "moment": -multipliers[:, 2:]}

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield force, N, and moment, N m, on the second body."""
        yield from vector(f"{name}.f", record.channel(name, "force"), "N", Kind.REACTION)
        yield Signal(f"{name}.moment", record.channel(name, "moment")[:, 0], "N m", Kind.REACTION)


@declared
class Slot(Joint):
    """A pin in a straight slot: a point of the first body stays on a line of the second; the angle is free.

    Examples
    --------
    >>> Slot("P", "pin", "bar", along=(1, 0)).key
    'P.pin-bar'
    """

    title: ClassVar[str] = "{kind} at '{point}'"

    keeps_angle: ClassVar[bool] = False

    point: str = names(doc="a point of the first body; the line goes through its place at t = 0")
    first: str = names(doc="a link")
    second: str = names(doc="a link or 'ground'; a flexible link must have the point: the line is fixed in its section there")
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
        """Return the effort on the second body, (times, rows): normal force [N], and moment [N m] if it keeps the angle."""
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
    """A prismatic joint: a point of the first body stays on a line of the second; the angle between them is constant.

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
