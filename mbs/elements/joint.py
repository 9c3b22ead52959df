"""Joints of two bodies: ideal pins, clamps, slots and prismatic joints."""

from collections.abc import Iterator
from typing import ClassVar

from ..declare import declared, direction, names
from ..geometry import Array, rotate
from .element import GROUND, JointBase, Parts, Recorded
from .references import check_known, check_link, check_no_strut, check_point_of
from .rows import Row, yield_angle, yield_line, yield_pin
from .signal import Kind, Signal, vector


class Joint(JointBase):
    """Joint of two bodies, links or the ground, at a point."""

    title: ClassVar[str] = "joint at '{point}'"
    label: ClassVar[str] = "{point}.{first}-{second}"

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless two different bodies have the point and are not joined there already."""
        check_known("point", self.point, mechanism.points, self.where)
        if self.first == self.second:
            raise ValueError(f"{self.where}: joins '{self.first}' to itself")
        ends = {self.first, self.second}
        if sum(joint.point == self.point and {joint.first, joint.second} == ends for joint in mechanism.joints) > 1:
            raise ValueError(f"{self.where}: joins {' and '.join(sorted(ends))} twice")
        for name in (self.first, self.second):
            if name != GROUND:
                self.check_body(mechanism, name)

    def check_body(self, mechanism: Parts, name: str) -> None:
        """Raise a ValueError unless a link has the point."""
        check_point_of(mechanism, name, self.point, self.where)


@declared
class Revolute(Joint):
    """An ideal pin at a point between two links, or a link and 'ground'.

    >>> Revolute("O", "ground", "crank").key
    'O.ground-crank'
    """

    point: str = names(doc="common point of the two bodies")
    first: str = names(doc="a link or 'ground'")
    second: str = names(doc="a link or 'ground'")

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the two rows of a pin."""
        return yield_pin(self.point, self.first, self.second)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the force on the second body [N], (times, 2); multipliers are the force on the first (`Element.reactions`)."""
        return {"force": -multipliers}

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the force on the second body [N]; none at the end of a strut, which has no coordinates to constrain."""
        force = record.channel(name, "force")
        if force.size:
            yield from vector(f"{name}.f", force, "N", Kind.REACTION)


@declared
class Weld(Joint):
    """A clamp: two bodies share a point and keep the angle they have there at t = 0.

    >>> Weld("B", "coupler", "rocker").key
    'B.coupler-rocker'
    """

    title: ClassVar[str] = "weld at '{point}'"

    point: str = names(doc="common point of the two bodies")
    first: str = names(doc="a link or 'ground'")
    second: str = names(doc="a link or 'ground'; a Strut has no moment to be clamped by")

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless both bodies have the point and neither is a strut."""
        super().check(mechanism)
        check_no_strut(mechanism, (self.first, self.second), self.where)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the rows of a common point and of a constant angle."""
        yield from yield_pin(self.point, self.first, self.second)
        yield from yield_angle(self.point, self.first, self.second)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return force [N] and moment [N m] on the second body, from the rows x, y and angle."""
        return {"force": -multipliers[:, :2], "moment": -multipliers[:, 2:]}

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield force [N] and moment [N m] on the second body."""
        yield from vector(f"{name}.f", record.channel(name, "force"), "N", Kind.REACTION)
        yield Signal(f"{name}.moment", record.channel(name, "moment")[:, 0], "N m", Kind.REACTION)


@declared
class Slot(Joint):
    """A pin in a straight slot: a point of the first body stays on a line of the second; the angle is free.

    >>> Slot("P", "pin", "bar", along=(1, 0)).key
    'P.pin-bar'
    """

    title: ClassVar[str] = "{kind} at '{point}'"  # kind: name of the class

    point: str = names(doc="a point of the first body; the line goes through its place at t = 0")
    first: str = names(doc="a link")
    second: str = names(doc="a link or 'ground'; a flexible link must have the point: the line is fixed in its section there")
    along: tuple[float, float] = direction(doc="of the line at t = 0; need not be a unit vector", default=(1.0, 0.0))

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the first body has the point, the second can have the line, and neither is a strut."""
        if self.first == GROUND:
            raise ValueError(f"{self.where}: first = 'ground': the point must be a link's; swap the bodies")
        super().check(mechanism)
        check_no_strut(mechanism, (self.first, self.second), self.where)

    def check_body(self, mechanism: Parts, name: str) -> None:
        """Raise a ValueError unless a link is known, and has the point if it is the first or flexible."""
        check_link(mechanism, name, self.where)
        if name == self.first or mechanism.link(name).body.flexible:
            super().check_body(mechanism, name)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the row that keeps the point on the line."""
        yield from yield_line(self.point, self.first, self.second, self.along)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the load on the second body: force to the left of `along` [N]; of a `Slider` also the moment [N m]."""
        return {"effort": -multipliers}

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the component of the force on the second body to the left of `along` [N], and the travel since t = 0 [m]."""
        yield Signal(f"{name}.normal_force", record.channel(name, "effort")[:, 0], "N", Kind.REACTION)
        start = f"{self.second}:{self.point}"  # the place of the point at t = 0, which moves with the second body
        (position, _), (origin, _), (angle, _) = (
            record.point(f"{self.first}:{self.point}"),
            record.point(start),
            record.turn(start),  # angle of the line since t = 0
        )
        travel = ((position - origin) * rotate(angle, self.along)).sum(axis=1)  # `direction` has normalised `along`
        yield Signal(f"{name}.travel", travel, "m", Kind.PLACE)


@declared
class Slider(Slot):
    """A prismatic joint: a point of the first body stays on a line of the second; the angle between them is constant.

    >>> Slider("P", "block", "bar", along=(1, 0)).key
    'P.block-bar'
    """

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the rows that keep the point on the line and the angle."""
        yield from super().rows(mechanism)
        yield from yield_angle(self.point, self.first, self.second)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield normal force [N], moment on the second body about the point [N m], and travel [m]."""
        yield from super().signals(name, record)
        yield Signal(f"{name}.moment", record.channel(name, "effort")[:, 1], "N m", Kind.REACTION)
