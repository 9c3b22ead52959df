"""Torques on links."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from buckler.mbs.callables import Function
from buckler.mbs.declare import Either, Quantity, declared, field, names
from buckler.mbs.elements.element import Array, Energy, Kind, Parts, Recorded, Signal
from buckler.mbs.elements.load import Load, Push, check_turning, sampled, turning, worked
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
        """Times in a run at which it jumps, has a kink or changes quickly."""
        return kinks(self.value, duration)

    @property
    def key(self) -> str:
        """'torque.crank'."""
        return f"torque.{self.link.partition(':')[0]}"

    def check(self, mechanism: Parts) -> None:
        """A link with an angle."""
        check_turning(mechanism, self.link, self.where)

    def at(self, mechanism: Parts) -> str:
        """The point reference at which it acts."""
        return turning(mechanism, self.link)

    def acting(self, record: Recorded, times: Array) -> Array:
        """The torque, N m, (times,), at times that may lie a little beside the samples, s."""
        if callable(self.value):
            return sampled(self.value, times, *record.turn(self.at(record.mechanism)))
        return np.full_like(times, self.value)

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the torque."""
        yield self._push(record, record.time)

    def _push(self, record: Recorded, times: Array) -> Push:
        return Push(self.at(record.mechanism), np.zeros((len(times), 2)), self.acting(record, times))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque, N m."""
        yield Signal(f"{name}.torque", self.acting(record, record.time), "N m", Kind.INTERNAL)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if callable(self.value):
            kinks = self.kinks(float(record.time[-1]))
            yield Energy("given", "load", worked(record, lambda times: self._push(record, times), kinks))
        else:
            yield Energy("given", "load", self.value * record.turn(self.at(record.mechanism))[0])
