"""Forces on points."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from buckler.mbs.callables import Function
from buckler.mbs.declare import Either, Nothing, Vector, declared, field, names
from buckler.mbs.elements.element import GROUND, Array, Energy, Kind, Parts, Recorded, Signal, holder, place, refers
from buckler.mbs.elements.load import Load, Push, check_turning, held_at, sampled, turning, worked
from buckler.mbs.functions import kinks

Pair = tuple[float, float]


@declared
class Force(Load):
    """A force on a point of a link, or on a guide's block: constant, or a function of time."""

    point: str = names(doc="'A', or 'coupler:A' as part of that link; on the end of a strut it acts on what that is pinned to")
    value: Pair | Callable[[float], Pair] = field(
        Either((Vector("N"), Function("t", "N", size=2))),
        "the force, or a function of t, s, that returns it; its jumps, kinks and pulses are looked for every 1e-5 of a run",
    )
    follows: str | None = names(
        doc="a link with which it turns: then `value` is the force in the pose at t = 0; a flexible link's angle is that at the "
        "point if it reaches it, or else at its start; 'beam:B' names another point",
        default=None,
    )
    through: Pair | None = field(
        Either((Vector("m"), Nothing())),
        "a place through which its line of action goes wherever the point is (Reut's load): at the point it acts with a moment",
        default=None,
    )

    @property
    def where(self) -> str:
        """'force on' and its point."""
        return f"force on '{self.point}'"

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Times in a run at which it jumps, has a kink or changes quickly."""
        return kinks(self.value, duration)

    @property
    def key(self) -> str:
        """'force.A'."""
        return f"force.{place(self.point).point}"

    def check(self, mechanism: Parts) -> None:
        """A point of a body, and a link that turns."""
        where = self.where
        refers(mechanism, self.point, where)
        if holder(mechanism, self.point) == GROUND:
            raise ValueError(f"{where}: it acts on the ground; name a point of a link")
        if self.follows is not None:
            check_turning(mechanism, self.follows, where)
        if self.through is not None:
            check_turning(mechanism, held_at(mechanism, self.point), where)

    def turns_with(self, mechanism: Parts) -> str | None:
        """The point reference whose angle it follows."""
        return None if self.follows is None else turning(mechanism, self.follows, place(self.point).point)

    def acting(self, record: Recorded, times: Array) -> Array:
        """The force, N, (times, 2), at times that may lie a little beside the samples, s."""
        values = sampled(self.value, times) if callable(self.value) else np.tile(self.value, (len(times), 1))
        at = self.turns_with(record.mechanism)
        if at is None:
            return values
        angle = record.turn(at)[0]
        c, s = np.cos(angle), np.sin(angle)
        return np.column_stack([c * values[:, 0] - s * values[:, 1], s * values[:, 0] + c * values[:, 1]])

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the force."""
        yield self._push(record, record.time)

    def _push(self, record: Recorded, times: Array) -> Push:
        at, force = held_at(record.mechanism, self.point), self.acting(record, times)
        torque = np.zeros_like(record.time)
        if self.through is not None:
            arm = np.array(self.through) - record.point(at)[0]
            torque = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
        return Push(at, force, torque)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield its components, N."""
        for letter, values in zip("xy", self.acting(record, record.time).T, strict=True):
            yield Signal(f"{name}.f{letter}", values, "N", Kind.INTERNAL, name)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if callable(self.value) or self.follows is not None or self.through is not None:
            kinks = self.kinks(float(record.time[-1]))
            yield Energy("given", "load", worked(record, lambda times: self._push(record, times), kinks))
            return
        path = record.point(held_at(record.mechanism, self.point))[0]
        yield Energy("given", "load", (path - path[0]) @ np.array(self.value))
