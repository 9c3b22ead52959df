"""Plane rigid bodies joined at points, in absolute coordinates: index-1 equations by scipy's DOP853, projected after every
stretch.

Coordinates of a body are its centre of mass and angle, (x, y, a). Bodies are named; "ground" needs no body. Nothing is shared
with the project: this is a second way to the published benchmarks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

Array = np.ndarray[Any, Any]
Point = tuple[float, float]


@dataclass
class Body:
    """Mass, kg, inertia about the centre of mass, kg m^2, centre of mass, m, and angle, rad, at the start."""

    mass: float
    inertia: float
    centre: Point
    angle: float = 0.0


@dataclass
class Linkage:
    """Bodies joined by pins, with springs and torques from the ground.

    Attributes
    ----------
    bodies : name -> Body
    pins : (place at the start, first, second)
    springs : (place on a body at the start, body, place on the ground, stiffness, N/m, free length, m)
    torques : body -> N m, constant
    gravity : (x, y), m/s^2
    """

    bodies: dict[str, Body]
    pins: Sequence[tuple[Point, str, str]]
    springs: Sequence[tuple[Point, str, Point, float, float]] = ()
    torques: dict[str, float] = field(default_factory=dict)
    gravity: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        self.names = list(self.bodies)
        self.start = np.array([(*body.centre, body.angle) for body in self.bodies.values()]).ravel()
        masses = np.array([(body.mass, body.mass, body.inertia) for body in self.bodies.values()])
        self.mass = masses.ravel()

    def _local(self, place: Point, name: str) -> Array:
        body = self.bodies[name]
        c, s = np.cos(body.angle), np.sin(body.angle)
        return np.array(((c, s), (-s, c))) @ np.subtract(place, body.centre)

    def _arm(self, place: Point, name: str, q: Array) -> tuple[Array, int]:
        k = 3 * self.names.index(name)
        c, s = np.cos(q[k + 2]), np.sin(q[k + 2])
        return np.array(((c, -s), (s, c))) @ self._local(place, name), k

    def point(self, place: Point, name: str, q: Array) -> Array:
        """Where the point of a body that was at `place` at the start is, m."""
        arm, k = self._arm(place, name, q)
        return q[k : k + 2] + arm

    def constraints(self, q: Array, v: Array) -> tuple[Array, Array, Array]:
        """Gaps of the pins, their Jacobian, and the accelerations of the gaps that velocities alone cause."""
        gaps, rows, bends = [], [], []
        for place, first, second in self.pins:
            gap, row, bend = np.zeros(2), np.zeros((2, q.size)), np.zeros(2)
            for name, sign in ((first, -1.0), (second, 1.0)):
                if name == "ground":
                    gap += sign * np.asarray(place)
                    continue
                arm, k = self._arm(place, name, q)
                gap += sign * (q[k : k + 2] + arm)
                row[:, k : k + 2] += sign * np.eye(2)
                row[:, k + 2] += sign * np.array((-arm[1], arm[0]))
                bend -= sign * arm * v[k + 2] ** 2
            gaps.append(gap)
            rows.append(row)
            bends.append(bend)
        return np.concatenate(gaps), np.vstack(rows), np.concatenate(bends)

    def forces(self, q: Array) -> Array:
        """Applied forces, N, and torques, N m, of all coordinates."""
        f = self.mass * np.tile((*self.gravity, 0.0), len(self.names))
        for name, torque in self.torques.items():
            f[3 * self.names.index(name) + 2] += torque
        for place, name, anchor, stiffness, free in self.springs:
            arm, k = self._arm(place, name, q)
            line = q[k : k + 2] + arm - np.asarray(anchor)
            length = np.hypot(*line)
            pull = -stiffness * (length - free) / length * line
            f[k : k + 2] += pull
            f[k + 2] += arm[0] * pull[1] - arm[1] * pull[0]
        return f

    def accelerations(self, q: Array, v: Array) -> Array:
        """Accelerations of all coordinates; redundant pins are allowed."""
        _, rows, bends = self.constraints(q, v)
        weighted = rows / self.mass
        free = self.forces(q) / self.mass
        multipliers = np.linalg.lstsq(weighted @ rows.T, -bends - rows @ free, rcond=1e-11)[0]
        return free + weighted.T @ multipliers

    def project(self, q: Array, v: Array) -> tuple[Array, Array]:
        """The nearest pose, in the metric of the masses, in which the pins meet, and velocities that keep them so."""
        for _ in range(6):
            gaps, rows, _ = self.constraints(q, v)
            weighted = rows / self.mass
            q = q - weighted.T @ np.linalg.lstsq(weighted @ rows.T, gaps, rcond=1e-11)[0]
        _, rows, _ = self.constraints(q, v)
        weighted = rows / self.mass
        return q, v - weighted.T @ np.linalg.lstsq(weighted @ rows.T, rows @ v, rcond=1e-11)[0]

    def run(self, end: float, v: Array, stretches: int, tolerance: float = 1e-12) -> tuple[Array, Array]:
        """Coordinates and velocities at time `end`, s, from velocities `v` at the start."""
        n = self.start.size

        def rates(_: float, state: Array) -> Array:
            return np.concatenate((state[n:], self.accelerations(state[:n], state[n:])))

        q, v = self.project(self.start, v)
        for t0, t1 in zip(np.linspace(0.0, end, stretches + 1)[:-1], np.linspace(0.0, end, stretches + 1)[1:], strict=True):
            done = solve_ivp(rates, (t0, t1), np.concatenate((q, v)), method="DOP853", rtol=tolerance, atol=tolerance)
            assert done.success, done.message
            q, v = self.project(done.y[:n, -1], done.y[n:, -1])
        return q, v
