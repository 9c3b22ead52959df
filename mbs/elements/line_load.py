"""Loads along a strip."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np

from ..declare import Vector, declared, field, flag, names, quantity
from ..geometry import Array, cross, rotate
from .element import Parts, Push, Recorded
from .load import Load
from .references import known_link
from .signal import Energy, Kind, Signal, vector


@declared
class LineLoad(Load):
    """A constant force and moment per length along the whole of a Beam; the force may turn with its sections.

    Examples
    --------
    >>> LineLoad("strip", force=(0.0, -0.5)).key  # N/m
    'line_load.strip'
    """

    title: ClassVar[str] = "load along '{link}'"
    label: ClassVar[str] = "line_load.{link}"

    link: str = names(doc="a Beam")
    force: tuple[float, float] = field(
        Vector("N/m"), "per length of the stress-free strip, in the pose at t = 0", default=(0.0, 0.0)
    )
    moment: float = quantity("N m/m", doc="likewise, counter-clockwise", default=0.0)
    turns: bool = flag(doc="whether the force turns with the section it acts on", default=False)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless its link is a Beam: other bodies have no sections that take moments."""
        known_link(mechanism, self.link, self.where)
        body = mechanism.link(self.link).body
        if not (body.meshed and body.turns):
            raise ValueError(f"{self.where}: it is a {type(body).__name__}; must be a Beam")

    def acting(self, turn: Array) -> Array:
        """Force per length, N/m, (times, stations, 2), where sections have turned, rad, (times, stations)."""
        return rotate(turn * self.turns, self.force)

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the resultant at the strip's start, with its moment about it."""
        start = f"{self.link}:{record.mechanism.link(self.link).start}"
        lengths, fields, _ = record.links[self.link].stations_of()
        force = self.acting(fields[..., 2])
        turning = cross(fields[..., :2] - record.point(start)[0][:, None], force) + self.moment
        yield Push(start, np.einsum("k,tkc->tc", lengths, force), turning @ lengths)

    def power(self, name: str, record: Recorded) -> Array:
        """Power it gives to the strip, W, (times,)."""
        lengths, fields, rates = record.links[self.link].stations_of()
        along = (self.acting(fields[..., 2]) * rates[..., :2]).sum(axis=-1)
        return np.asarray((along + self.moment * rates[..., 2]) @ lengths)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the components of the whole force, N."""
        for push in self.pushes(name, record):
            yield from vector(f"{name}.f", push.force, "N", Kind.INTERNAL, name)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if self.turns:
            yield Energy("given", "load", record.work(self.power(name, record)))
            return
        lengths, fields, _ = record.links[self.link].stations_of()
        yield Energy("given", "load", np.einsum("k,tkc,c->t", lengths, fields - fields[:1], [*self.force, self.moment]))
