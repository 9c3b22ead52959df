"""Torques on links."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from ..declare import Either, Quantity, declared, field, names, part
from ..functions.fields import Law
from ..geometry import Array
from .element import Parts, Push, Recorded
from .references import check_turning, turning
from .signal import Energy, Kind, Signal
from .states import Stateful, States


@declared
class Torque(Stateful):
    """A torque on a link: constant, or a function of time, angle and speed, and of states of its own.

    Examples
    --------
    >>> Torque("crank", lambda time, angle, speed: -0.01 * speed).key
    'torque.crank'
    """

    title: ClassVar[str] = "torque on '{link}'"
    label: ClassVar[str] = "torque.{link:body}"
    law: ClassVar[Law] = Law("t, angle, speed", "N m")
    measured: ClassVar[str] = law.of

    link: str = names(doc="any but a Strut; on a flexible one it acts at the start; 'beam:B' names another of its points")
    value: float | Callable[..., float] = field(
        Either((Quantity("N m"), law)),
        "counter-clockwise, or a function of time, s, the angle turned there since t = 0, rad, and its rate, rad/s",
    )
    states: States | None = part(States, doc="states of the law: `value` is then a function of them, too", default=None)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless its link has an angle."""
        check_turning(mechanism, self.link, self.where)
        self.check_states(mechanism)

    def initial(self, mechanism: Parts) -> list[float]:
        """Time, angle turned, and the speed that is not known yet."""
        return [0.0, 0.0, 0.0]

    def measures(self, record: Recorded) -> tuple[Array, ...]:
        """Angle and speed."""
        return record.turn(self.at(record.mechanism))

    def at(self, mechanism: Parts) -> str:
        """Return the point reference at which it acts."""
        return turning(mechanism, self.link)

    def acting(self, name: str, record: Recorded, times: Array) -> Array:
        """Return the torque, N m, (times,), at times that may lie a little beside the samples, s."""
        return self.evaluate(name, record, times) if callable(self.value) else np.full_like(times, self.value)

    def push(self, name: str, record: Recorded, times: Array) -> Push:
        """Return the torque."""
        return Push(self.at(record.mechanism), np.zeros((len(times), 2)), self.acting(name, record, times))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the torque, N m, and its states."""
        yield Signal(f"{name}.torque", self.acting(name, record, record.time), "N m", Kind.INTERNAL)
        yield from self.state_signals(name, record)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if callable(self.value):
            yield Energy("given", "load", self.work_of(name, record))
        else:
            yield Energy("given", "load", self.value * record.turn(self.at(record.mechanism))[0])
