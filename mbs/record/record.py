"""What a solver leaves behind: plain arrays over time. Signals, energies, checks and files read nothing else."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from buckler.mbs.elements.element import GROUND, Array, place
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.motion import between
from buckler.mbs.record.quadrature import trapezoidal


@dataclass(frozen=True, eq=False)
class Record:
    """A run as arrays.

    Attributes
    ----------
    mechanism : Mechanism
    time : array, shape (times,)
        s.
    links : dict of str to motion
        Of each link that has coordinates of its own: `RigidMotion`, `StripMotion`, `ModalHistory`.
    blocks : dict of str to BlockMotion
        Of each guide, by its point.
    channels : dict of str to dict of str to array
        What was recorded of each element besides, by the element's name and the channel's, each (times, columns).
    rule : callable
        Integral over time that suits how the motion was found, as in `buckler.mbs.record.quadrature`.
    """

    mechanism: Mechanism
    time: Array
    links: Mapping[str, Any]
    blocks: Mapping[str, Any]
    channels: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    rule: Callable[[Array, Array], Array] = trapezoidal

    def channel(self, element: str, name: str) -> Array:
        """What was recorded of an element; no columns if nothing was."""
        found: Array = self.channels.get(element, {}).get(name, np.empty((len(self.time), 0)))
        return found

    def point(self, at: str) -> tuple[Array, Array]:
        """Place and velocity of a point reference, each (times, 2), from whatever body carries it; fixed if none does."""
        body, point = place(at)
        motion = self._carrier(body, point)
        if motion is not None:
            places: tuple[Array, Array] = motion.point(point)
            return places
        fixed = np.tile(self.mechanism.points[point], (len(self.time), 1))
        return fixed, np.zeros_like(fixed)

    def turn(self, at: str) -> tuple[Array, Array]:
        """Angle turned since t = 0 at a point reference, rad, and its rate, each (times,)."""
        body, point = place(at)
        motion = self._carrier(body, point)
        if motion is not None:
            angles: tuple[Array, Array] = motion.turn(point)
            return angles
        return np.zeros_like(self.time), np.zeros_like(self.time)

    def work(self, power: Array, sides: tuple[Array, Array] | None = None) -> Array:
        """Work, J, of a power, W, since t = 0, each (times,); `sides` are what it is just before and just after each sample."""
        if sides is None:
            return self.rule(self.time, power)
        before, after = sides
        jumped = np.diff(self.time) / 2 * (after[:-1] - power[:-1] + before[1:] - power[1:])
        return self.rule(self.time, power) + np.concatenate([[0.0], np.cumsum(jumped)])

    def at(self, times: Array) -> Record:
        """Places and velocities at other times, s, within the run; without channels.

        Raises
        ------
        ValueError
            If the record has fewer than two times.
        """
        if len(self.time) < 2:
            raise ValueError(f"a record of {len(self.time)} times has nothing between them")
        links = {name: between(motion, self.time, times) for name, motion in self.links.items()}
        blocks = {name: between(motion, self.time, times) for name, motion in self.blocks.items()}
        return Record(self.mechanism, times, links, blocks)

    def _carrier(self, body: str, point: str) -> Any:
        if body == GROUND:
            return None
        if body in self.links:
            return self.links[body]
        if body in self.blocks:
            return self.blocks[body]
        if point in self.blocks:
            return self.blocks[point]
        return next(
            (self.links[link.name] for link in self.mechanism.links if point in link.points and link.name in self.links), None
        )
