"""Loads along a strip."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.declare import Vector, declared, field, flag, names, quantity
from buckler.mbs.elements.element import Array, Energy, Kind, Parts, Recorded, Signal, known
from buckler.mbs.elements.load import Load, Push


@declared
class LineLoad(Load):
    """A constant force and moment per length along the whole of a Beam; the force may turn with its sections."""

    link: str = names(doc="a Beam")
    force: tuple[float, float] = field(
        Vector("N/m"), "per length of the stress-free strip, in the pose at t = 0", default=(0.0, 0.0)
    )
    moment: float = quantity("N m/m", doc="likewise, counter-clockwise", default=0.0)
    turns: bool = flag(doc="whether the force turns with the section it acts on", default=False)

    @property
    def where(self) -> str:
        """'load along' and its link."""
        return f"load along '{self.link}'"

    @property
    def key(self) -> str:
        """'line_load.strip'."""
        return f"line_load.{self.link}"

    def check(self, mechanism: Parts) -> None:
        """A Beam: a Cable has no sections that take moments, nothing else has sections."""
        known("link", self.link, {link.name for link in mechanism.links}, self.where)
        body = mechanism.link(self.link).body
        if not (body.meshed and body.turns):
            raise ValueError(f"{self.where}: it is a {type(body).__name__}; must be a Beam")

    def acting(self, turn: Array) -> Array:
        """Force per length, N/m, (times, stations, 2), where sections have turned, rad, (times, stations)."""
        fx, fy = self.force
        c, s = (np.cos(turn), np.sin(turn)) if self.turns else (np.ones_like(turn), np.zeros_like(turn))
        return np.stack([c * fx - s * fy, s * fx + c * fy], axis=-1)

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield the resultant at the strip's start, with its moment about it."""
        start = f"{self.link}:{record.mechanism.link(self.link).start}"
        lengths, fields, _ = record.links[self.link].stations_of()
        force = self.acting(fields[..., 2])
        arm = fields[..., :2] - record.point(start)[0][:, None]
        turning = arm[..., 0] * force[..., 1] - arm[..., 1] * force[..., 0] + self.moment
        yield Push(start, np.einsum("k,tkc->tc", lengths, force), turning @ lengths)

    def power(self, name: str, record: Recorded) -> Array:
        """Power it gives to the strip, W, (times,)."""
        lengths, fields, rates = record.links[self.link].stations_of()
        along = (self.acting(fields[..., 2]) * rates[..., :2]).sum(axis=-1)
        return np.asarray((along + self.moment * rates[..., 2]) @ lengths)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the components of the whole force, N."""
        for push in self.pushes(name, record):
            for letter, values in zip("xy", push.force.T, strict=True):
                yield Signal(f"{name}.f{letter}", values, "N", Kind.INTERNAL, name)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        if self.turns:
            yield Energy("given", "load", record.work(self.power(name, record)))
            return
        lengths, fields, _ = record.links[self.link].stations_of()
        yield Energy("given", "load", np.einsum("k,tkc,c->t", lengths, fields - fields[:1], [*self.force, self.moment]))
