"""Motions of links and blocks, as plain arrays: rigid links and the blocks of guides. Strips are in `strips`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..geometry import Array, rotate, rotate_left
from .lookup import hermite


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """A rigid link of a mass [kg] and an inertia about its centre [kg m^2].

    `arms` go from the centre of mass to any point at t = 0 [m]. `q` has place [m] and angle turned since t = 0 [rad], (times, 3).
    """

    mass: float
    inertia: float
    arms: Mapping[str, Any]
    q: Array
    q_t: Array
    q_tt: Array

    def point(self, name: str) -> tuple[Array, Array]:
        """Place and velocity of a point fixed to the link, each (times, 2)."""
        arm = rotate(self.q[:, 2], self.arms[name])
        return self.q[:, :2] + arm, self.q_t[:, :2] + self.q_t[:, 2:3] * rotate_left(arm)

    def turn(self, _name: str = "") -> tuple[Array, Array]:
        """Angle turned since t = 0 and its rate, each (times,)."""
        return self.q[:, 2], self.q_t[:, 2]

    def centre(self) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of the centre of mass, each (times, 2)."""
        return self.q[:, :2], self.q_t[:, :2], self.q_tt[:, :2]

    def kinetic(self) -> Array:
        """Kinetic energy, J, (times,)."""
        return 0.5 * self.mass * (self.q_t[:, :2] ** 2).sum(axis=1) + 0.5 * self.inertia * self.q_t[:, 2] ** 2


@dataclass(frozen=True, eq=False)
class BlockMotion:
    """A guide's block: mass [kg], place at t = 0 [m], direction, and travel along the guide since then with its rates."""

    mass: float
    origin: tuple[float, float]
    along: tuple[float, float]
    q: Array
    q_t: Array
    q_tt: Array

    @property
    def travel(self) -> Array:
        """Way along the guide since t = 0, m, (times,)."""
        return self.q

    @property
    def speed(self) -> Array:
        """Rate of the travel, m/s, (times,)."""
        return self.q_t

    def point(self, _name: str = "") -> tuple[Array, Array]:
        """Place and velocity, each (times, 2)."""
        return self.origin + np.outer(self.q, self.along), np.outer(self.q_t, self.along)

    def turn(self, _name: str = "") -> tuple[Array, Array]:
        """It does not turn."""
        return np.zeros_like(self.q), np.zeros_like(self.q)

    def centre(self) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration, each (times, 2)."""
        return *self.point(), np.outer(self.q_tt, self.along)

    def kinetic(self) -> Array:
        """Kinetic energy, J, (times,)."""
        return 0.5 * self.mass * self.q_t**2


def select(motion: Any, rows: Any) -> Any:
    """Select some of the times of a motion, by index."""
    return replace(motion, q=motion.q[rows], q_t=motion.q_t[rows], q_tt=motion.q_tt[rows])


def between(motion: Any, time: Array, times: Array) -> Any:
    """Return the same motion at other times [s] within its own, by cubic Hermite interpolation; accelerations are left out."""
    q, q_t = hermite(time, motion.q, motion.q_t, times)
    return replace(motion, q=q, q_t=q_t, q_tt=np.zeros_like(q))
