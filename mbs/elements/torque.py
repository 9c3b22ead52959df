"""Torques on links."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from buckler.mbs.elements.element import Array, Energy, Recorded, Signal
from buckler.mbs.elements.load import Load, Push, check_turning, sampled, turning
from buckler.mbs.functions import kinks
from buckler.mbs.validate import function, number


@dataclass(frozen=True)
class Torque(Load):
    """A torque on a link: constant, or a function of time, angle and speed.

    Parameters
    ----------
    link : str
        Any but a Strut. On a flexible one it acts at the start; 'beam:B' names another of its points.
    value : float or callable
        N m, counter-clockwise, or a function (t, angle, speed) that returns it: s, rad turned there since t = 0, rad/s.
    """

    link: str
    value: float | Callable[[float, float, float], float]

    def __post_init__(self) -> None:
        where = f"value of the torque on '{self.link}'"
        if callable(self.value):
            number(f"{where} at t = 0", function(where, self.value, 0.0, 0.0, 0.0)(0.0, 0.0, 0.0), -inf, inf, "N m")
        else:
            number(where, self.value, -inf, inf, "N m")

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Points in a run of the tables it is made of."""
        return tuple(t for t in kinks(self.value) if 0 < t < duration)

    @property
    def key(self) -> str:
        """'torque.crank'."""
        return f"torque.{self.link.partition(':')[0]}"

    def check(self, mechanism: Any) -> None:
        """A link with an angle."""
        check_turning(mechanism, self.link, f"torque on '{self.link}'")

    def moments(self, mechanism: Any) -> Iterator[str]:
        """Yield where it acts."""
        yield self.at(mechanism)

    def at(self, mechanism: Any) -> str:
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
        yield Signal(f"{name}.torque", self.acting(record), "N m")

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if callable(self.value):
            yield Energy("given", "load", record.work(self.power(name, record)))
        else:
            yield Energy("given", "load", self.value * record.turn(self.at(record.mechanism))[0])
