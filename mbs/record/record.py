"""Record of a run: arrays over time from a solver, of motions of links and blocks, and channels of elements.

Signals, energies, checks and files are computed from the record alone. In motions q, q_t and q_tt are coordinates, velocities
and accelerations. A channel is a named array that only its element can interpret.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..elements.element import Pair, Recorded
from ..functions import Called
from ..geometry import Array
from ..mechanism import Mechanism
from ..scene.scene import Scene
from .lookup import hermite, trapezoidal


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """Motion of a rigid link."""

    mass: float  # [kg]
    inertia: float  # about the centre of mass [kg m^2]
    arms: Mapping[str, Pair | Array]  # from the centre of mass to each point at t = 0 [m], (x, y)
    q: Array  # x and y of the centre of mass [m], angle since t = 0 [rad], (times, 3)
    q_t: Array
    q_tt: Array

    @cached_property
    def _rotation(self) -> tuple[Array, Array]:
        return np.cos(self.q[:, 2]), np.sin(self.q[:, 2])

    def point(self, name: str) -> tuple[Array, Array]:
        """Return place and velocity of a point fixed to the link, each (times, 2)."""
        (c, s), (x, y), spin = self._rotation, self.arms[name], self.q_t[:, 2]
        arm_x, arm_y = c * x - s * y, s * x + c * y
        place = np.stack([self.q[:, 0] + arm_x, self.q[:, 1] + arm_y])
        return place.T, np.stack([self.q_t[:, 0] - spin * arm_y, self.q_t[:, 1] + spin * arm_x]).T

    def turn(self, _name: str = "") -> tuple[Array, Array]:
        """Return the angle since t = 0 and its rate, each (times,)."""
        return self.q[:, 2], self.q_t[:, 2]

    def centre(self) -> tuple[Array, Array, Array]:
        """Return place, velocity and acceleration of the centre of mass, each (times, 2)."""
        return self.q[:, :2], self.q_t[:, :2], self.q_tt[:, :2]

    def kinetic(self) -> Array:
        """Return the kinetic energy, J, (times,)."""
        return 0.5 * self.mass * (self.q_t[:, :2] ** 2).sum(axis=1) + 0.5 * self.inertia * self.q_t[:, 2] ** 2


@dataclass(frozen=True, eq=False)
class BlockMotion:
    """Motion of a guide's block: mass [kg], place at t = 0 [m], direction of the guide, travel q along it [m], (times,)."""

    mass: float
    origin: tuple[float, float]
    along: tuple[float, float]
    q: Array
    q_t: Array
    q_tt: Array

    @property
    def travel(self) -> Array:
        """Travel along the guide since t = 0, m, (times,)."""
        return self.q

    @property
    def speed(self) -> Array:
        """Rate of the travel, m/s, (times,)."""
        return self.q_t

    def point(self, _name: str = "") -> tuple[Array, Array]:
        """Return place and velocity, each (times, 2)."""
        return self.origin + np.outer(self.q, self.along), np.outer(self.q_t, self.along)

    def turn(self, _name: str = "") -> tuple[Array, Array]:
        """Return zeros: a block does not turn."""
        return np.zeros_like(self.q), np.zeros_like(self.q)

    def centre(self) -> tuple[Array, Array, Array]:
        """Return place, velocity and acceleration, each (times, 2)."""
        return *self.point(), np.outer(self.q_tt, self.along)

    def kinetic(self) -> Array:
        """Return the kinetic energy, J, (times,)."""
        return 0.5 * self.mass * self.q_t**2


def select(motion: Any, rows: Any) -> Any:
    """Select some of the times of a motion, by index."""
    return replace(motion, q=motion.q[rows], q_t=motion.q_t[rows], q_tt=motion.q_tt[rows])


def between(motion: Any, time: Array, times: Array) -> Any:
    """Interpolate a motion for drawing, at other times [s], by cubic Hermite polynomials; accelerations are not needed: zero."""
    q, q_t = hermite(time, motion.q, motion.q_t, times)
    return replace(motion, q=q, q_t=q_t, q_tt=np.zeros_like(q))


@dataclass(frozen=True, eq=False)
class Record(Recorded):
    """Arrays of a run, with the fields `time`, `links` and `blocks` of `Recorded`.

    Motions of links are `RigidMotion`, `StripMotion` or `ModalHistory`. `rule` integrates over time to the order of the solver.
    No equation determines the forces of the elements `undetermined`.
    """

    mechanism: Mechanism
    channels: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)  # by element, then by name of the channel
    rule: Callable[[Array, Array], Array] = trapezoidal
    undetermined: Sequence[str] = ()

    def work(self, power: Array, sides: tuple[Array, Array] | None = None) -> Array:
        """Return the work since t = 0 [J] of a power [W], each (times,).

        If the power jumps at samples, `sides` are the powers just before and just after each sample. Their differences from
        `power` are integrated by the trapezoidal rule.
        """
        if sides is None:
            return self.rule(self.time, power)
        before, after = sides
        at_start, at_end = after[:-1] - power[:-1], before[1:] - power[1:]  # differences in each step
        corrections = np.diff(self.time) / 2 * (at_start + at_end)
        return self.rule(self.time, power) + np.append(0.0, np.cumsum(corrections))

    def user_functions(self) -> Iterator[tuple[str, Called]]:
        """Yield the user's functions of states with their arguments over the run, each with the name of its element."""
        for name, element in Scene.of(self.mechanism).elements.items():
            for called in element.user_functions(name, self):
                yield name, called

    def at(self, times: Array) -> Record:
        """Interpolate the motions at other times [s] within the run, for drawing; raise a ValueError for one sample."""
        if len(self.time) < 2:
            raise ValueError(f"a record of {len(self.time)} times cannot be interpolated; two are needed")
        links = {name: between(motion, self.time, times) for name, motion in self.links.items()}
        blocks = {name: between(motion, self.time, times) for name, motion in self.blocks.items()}
        return Record(mechanism=self.mechanism, time=times, links=links, blocks=blocks)
