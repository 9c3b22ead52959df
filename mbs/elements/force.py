"""Forces on points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from buckler.mbs.callables import Function
from buckler.mbs.declare import Either, Nothing, Vector, declared, field, names
from buckler.mbs.elements.element import GROUND, Parts, Push, Recorded, place
from buckler.mbs.elements.load import Given, sampled
from buckler.mbs.elements.references import check_turning, held_at, holder, refers, turning
from buckler.mbs.elements.signal import Energy, Kind, Signal, vector
from buckler.mbs.geometry import Array, cross, turned

Pair = tuple[float, float]


@declared
class Force(Given):
    """A force on a point of a link, or on a guide's block: constant, or a function of time."""

    title: ClassVar[str] = "force on '{point}'"
    label: ClassVar[str] = "force.{point:point}"

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
        return values if at is None else turned(record.turn(at)[0], values)

    def push(self, record: Recorded, times: Array) -> Push:
        """The force, and its moment where its line of action goes through a place."""
        at, force = held_at(record.mechanism, self.point), self.acting(record, times)
        if self.through is None:
            return Push(at, force, np.zeros_like(record.time))
        return Push(at, force, cross(np.array(self.through) - record.point(at)[0], force))

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield its components, N."""
        yield from vector(f"{name}.f", self.acting(record, record.time), "N", Kind.INTERNAL, name)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if callable(self.value) or self.follows is not None or self.through is not None:
            yield Energy("given", "load", self.worked(record))
            return
        path = record.point(held_at(record.mechanism, self.point))[0]
        yield Energy("given", "load", (path - path[0]) @ np.array(self.value))
