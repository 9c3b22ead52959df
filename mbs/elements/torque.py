"""Torques on links."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from buckler.mbs.callables import Function
from buckler.mbs.declare import Either, Quantity, declared, field, names
from buckler.mbs.elements.element import Array, Energy, Kind, Parts, Recorded, Signal
from buckler.mbs.elements.load import Load, Push, check_turning, sampled, turning
from buckler.mbs.functions import kinks


@declared
class Torque(Load):
    """A torque on a link: constant, or a function of time, angle and speed."""

    link: str = names(doc="any but a Strut; on a flexible one it acts at the start; 'beam:B' names another of its points")
    value: float | Callable[[float, float, float], float] = field(
        Either((Quantity("N m"), Function("t, angle, speed", "N m"))),
        "counter-clockwise, or a function of time, s, the angle turned there since t = 0, rad, and its rate, rad/s",
    )

    @property
    def where(self) -> str:
        """'torque on' and its link."""
        return f"torque on '{self.link}'"

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Points in a run of the tables it is made of."""
        return tuple(t for t in kinks(self.value) if 0 < t < duration)

    @property
    def key(self) -> str:
        """'torque.crank'."""
        return f"torque.{self.link.partition(':')[0]}"

    def check(self, mechanism: Parts) -> None:
        """A link with an angle."""
        check_turning(mechanism, self.link, self.where)

    def moments(self, mechanism: Parts) -> Iterator[str]:
        """Yield where it acts."""
        yield self.at(mechanism)

    def at(self, mechanism: Parts) -> str:
        """The point reference at which it acts."""
        return turning(mechanism, self.link)

    def acting(self, record: Recorded) -> Array:
        """The torque, N m, (times,)."""
        if callable(self.value):
            return sampled(self.value, record.time, *record.turn(self.at(record.mechanism)))
        return np.full_like(record.time, self.value)

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the torque."""
        yield Push(self.at(record.mechanism), np.zeros((len(record.time), 2)), self.acting(record))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque, N m."""
        yield Signal(f"{name}.torque", self.acting(record), "N m", Kind.INTERNAL)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if callable(self.value):
            yield Energy("given", "load", record.work(self.power(name, record)))
        else:
            yield Energy("given", "load", self.value * record.turn(self.at(record.mechanism))[0])
