"""Torsion springs with dampers between two links."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from ..declare import declared, field, names, quantity
from ..functions.fields import Function
from ..geometry import Array
from .element import GROUND, Parts, Push, Recorded
from .load import Elastic, Law, on_both
from .references import check_turning, turning
from .signal import Kind, Signal


@declared
class TorsionSpring(Elastic):
    """A torsion spring with a damper between two links, or a link and the ground.

    Examples
    --------
    >>> TorsionSpring("crank", "coupler", stiffness=0.02).key
    'torsion.crank-coupler'
    """

    title: ClassVar[str] = "torsion spring of '{first}' and '{second}'"
    label: ClassVar[str] = "torsion.{first:body}-{second:body}"

    first: str = names(
        doc="any link but a strut, or 'ground'; on a flexible one it acts at the joint of the two, or else at the start; "
        "'beam:B' names another of its points"
    )
    second: str = names(doc="the same of the other link")
    stiffness: float = quantity("N m/rad", doc="with a law it is not used and may be 0")
    damping: float = quantity("N m s/rad", low=0, doc="of the damper", default=0.0)
    free_angle: float | None = quantity(
        "rad", doc="angle without torque: what `second` has then turned against `first` since t = 0; 0 by default", default=None
    )
    law: Law | None = field(
        Function("x, v", "N m"),
        "torque instead, as a function of the angle less the free one, rad, and its rate, rad/s: that on `first`, against that "
        "on `second`; what it gives at rest is taken for elastic, the rest for damping",
        default=None,
    )

    def check(self, mechanism: Parts) -> None:
        """Two different bodies with an angle."""
        where = self.where
        bodies = [at.partition(":")[0] for at in (self.first, self.second)]
        if bodies[0] == bodies[1] and ":" not in self.first + self.second:
            raise ValueError(f"{where}: two different links, or a link and 'ground', are needed")
        for at, body in zip((self.first, self.second), bodies, strict=True):
            if body != GROUND:
                check_turning(mechanism, at, where)

    def ends(self, mechanism: Parts) -> tuple[str, str]:
        """Return the point references at which it acts."""
        bodies = {at.partition(":")[0] for at in (self.first, self.second)}
        shared = next((joint.point for joint in mechanism.joints if {joint.first, joint.second} == bodies), None)
        return turning(mechanism, self.first, shared), turning(mechanism, self.second, shared)

    def state(self, record: Recorded) -> tuple[Array, Array]:
        """Angle from the free one, rad, and its rate, rad/s, each (times,)."""
        (first, first_t), (second, second_t) = (record.turn(at) for at in self.ends(record.mechanism))
        return second - first - (self.free_angle or 0.0), second_t - first_t

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the torque on both."""
        none = np.zeros((len(record.time), 2))
        yield from on_both(self.ends(record.mechanism), none, self.tension(*self.state(record)))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque on the first, N m, and the angle from the free one, rad."""
        value, rate = self.state(record)
        yield Signal(f"{name}.torque", self.tension(value, rate), "N m", Kind.INTERNAL)
        yield Signal(f"{name}.angle", value, "rad", Kind.PLACE)
