"""Torques on links."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from buckler.mbs.callables import Function
from buckler.mbs.declare import Either, Quantity, declared, field, names
from buckler.mbs.elements.element import Parts, Push, Recorded
from buckler.mbs.elements.load import Given, sampled
from buckler.mbs.elements.references import check_turning, turning
from buckler.mbs.elements.signal import Energy, Kind, Signal
from buckler.mbs.geometry import Array


@declared
class Torque(Given):
    """A torque on a link: constant, or a function of time, angle and speed."""

    title: ClassVar[str] = "torque on '{link}'"
    label: ClassVar[str] = "torque.{link:body}"

    link: str = names(doc="any but a Strut; on a flexible one it acts at the start; 'beam:B' names another of its points")
    value: float | Callable[[float, float, float], float] = field(
        Either((Quantity("N m"), Function("t, angle, speed", "N m"))),
        "counter-clockwise, or a function of time, s, the angle turned there since t = 0, rad, and its rate, rad/s",
    )

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

    def push(self, record: Recorded, times: Array) -> Push:
        """The torque."""
        return Push(self.at(record.mechanism), np.zeros((len(times), 2)), self.acting(record, times))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque, N m."""
        yield Signal(f"{name}.torque", self.acting(record, record.time), "N m", Kind.INTERNAL)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if callable(self.value):
            yield Energy("given", "load", self.worked(record))
        else:
            yield Energy("given", "load", self.value * record.turn(self.at(record.mechanism))[0])
