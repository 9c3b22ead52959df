"""Joints of two bodies."""

from __future__ import annotations

from typing import ClassVar

from .element import GROUND, Joined, Parts
from .references import check_known, reaches


class Joint(Joined):
    """Joint of two bodies, links or the ground, at a point."""

    title: ClassVar[str] = "joint at '{point}'"
    label: ClassVar[str] = "{point}.{first}-{second}"

    def check(self, mechanism: Parts) -> None:
        """Two different bodies that reach the point, not joined there already."""
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
