"""The planar floating frame: motion, energy and momentum of a modal link in the plane, independent of solvers.

Frame at the undeformed centre of mass, x along the link. A material point X is at r = R + A(theta) (X + sum phi_k q_k).
State vectors are (R_x, R_y, theta, q_1 ... q_m), theta the link's direction; arrays of them have shape (times, 3 + m).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..geometry import Array, cross, rotate, rotate_left

STATIONS = ("start", "end", "centre")


class FrameMotion(NamedTuple):
    """Motion of a station: position, velocity, acceleration (times, 2); angle, angular velocity and acceleration (times,)."""

    position: Array
    velocity: Array
    acceleration: Array
    angle: Array
    spin: Array
    spin_rate: Array


@dataclass(frozen=True, eq=False)
class PlanarModel:
    """A bar and m of its modes in the plane, mass-normalised in space.

    Attributes
    ----------
    length, mass, inertia : float
        m; kg; kg m^2 about the centre of mass.
    centre : array, shape (2,)
        Centre of mass from the start joint in link axes, m.
    numbers : array of int, shape (m,)
        Of the modes among all flexible ones.
    frequency, damping : arrays, shape (m,)
        Angular frequency, rad/s, and damping ratio.
    shapes : array, shape (3, 3, m)
        At the `STATIONS` (first index): phi_x, phi_y, 1/sqrt(kg), and the turn of the section, 1/(m sqrt(kg)).
    radial : array, shape (m,)
        Integrals of X . phi_i dm. Those of phi_i dm and of X x phi_i dm are zero, as modes are orthogonal to rigid motion.
    gram, gyration : arrays, shape (m, m)
        Integrals of phi_i . phi_j dm and of phi_i x phi_j dm, in-plane components. The modal masses are 1; the diagonal
        of `gram` is less by the lateral contraction out of the plane.
    line, line_shapes : arrays, shape (p, 2) and (p, 2, m)
        Points along the link from the centre of mass, m, and the modes there.
    """

    length: float
    mass: float
    inertia: float
    centre: Array
    numbers: Array
    frequency: Array
    damping: Array
    shapes: Array
    radial: Array
    gram: Array
    gyration: Array
    line: Array
    line_shapes: Array

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def stiffness(self) -> Array:
        """Modal stiffnesses, frequencies squared, as the modal masses are 1, shape (m,)."""
        return self.frequency**2

    def place(self, station: str) -> Array:
        """Undeformed place of a station from the centre of mass in link axes, m, shape (2,)."""
        return {"start": 0.0, "end": 1.0, "centre": 0.5}[station] * np.array([self.length, 0.0]) - self.centre

    def kinetic(self, q: Array, q_t: Array) -> Array:
        """Return the kinetic energy [J], shape (times,), about mean axes."""
        own, spin = self._spin_momentum(q, q_t), q_t[:, 2]
        swirl = np.einsum("ti,ij,tj->t", q[:, 3:], self.gyration, q_t[:, 3:])
        return 0.5 * (self.mass * (q_t[:, :2] ** 2).sum(axis=1) + spin * (own + swirl) + (q_t[:, 3:] ** 2).sum(axis=1))

    def strain(self, q: Array) -> Array:
        """Strain energy, J, shape (times,)."""
        return 0.5 * q[:, 3:] ** 2 @ self.stiffness

    def damping_power(self, q_t: Array) -> Array:
        """Power lost to modal damping, W, shape (times,)."""
        return q_t[:, 3:] ** 2 @ (2 * self.damping * self.frequency)

    def momentum(self, q: Array, q_t: Array) -> tuple[Array, Array]:
        """Linear momentum (times, 2), N s, and angular momentum about the origin (times,), N m s."""
        linear = self.mass * q_t[:, :2]
        return linear, cross(q[:, :2], linear) + self._spin_momentum(q, q_t)

    def _spin_momentum(self, q: Array, q_t: Array) -> Array:
        """Compute the angular momentum about the centre of mass, (inertia + 2 radial q + q gram q) theta_t + q gyration q_t."""
        amount = q[:, 3:]
        inertia = self.inertia + 2 * amount @ self.radial + np.einsum("ti,ij,tj->t", amount, self.gram, amount)
        return inertia * q_t[:, 2] + np.einsum("ti,ij,tj->t", amount, self.gyration, q_t[:, 3:])

    def motion(self, station: str, q: Array, q_t: Array | None = None, q_tt: Array | None = None) -> FrameMotion:
        """Motion of a station; rates that are not given count as zero."""
        shape = self.shapes[STATIONS.index(station)]
        rate = np.zeros_like(q) if q_t is None else q_t
        second = np.zeros_like(q) if q_tt is None else q_tt
        arm = self.place(station) + q[:, 3:] @ shape[:2].T
        arm_t, arm_tt = rate[:, 3:] @ shape[:2].T, second[:, 3:] @ shape[:2].T  # in link axes
        spin, spin_t = rate[:, 2:3], second[:, 2:3]
        return FrameMotion(
            q[:, :2] + rotate(q[:, 2], arm),
            rate[:, :2] + rotate(q[:, 2], arm_t + spin * rotate_left(arm)),
            second[:, :2] + rotate(q[:, 2], arm_tt + 2 * spin * rotate_left(arm_t) + spin_t * rotate_left(arm) - spin**2 * arm),
            q[:, 2] + q[:, 3:] @ shape[2],
            rate[:, 2] + rate[:, 3:] @ shape[2],
            second[:, 2] + second[:, 3:] @ shape[2],
        )

    def points(self, q: Array) -> Array:
        """Positions along the link, shape (times, p, 2)."""
        local = self.line + np.einsum("pam,tm->tpa", self.line_shapes, q[:, 3:])
        return q[:, None, :2] + rotate(q[:, 2:3], local)


class ModalStrain(NamedTuple):
    """Energy in the modes, J, and power lost to their damping, W, each of shape (times,)."""

    energy: Array
    power: Array


@dataclass(frozen=True, eq=False)
class ModalHistory:
    """A modal link with recorded coordinates (times, 3 + m) and their rates, with the interface of a beam's `Strip`.

    `stations` maps names of points to `STATIONS`; `direction` is that of the link at t = 0 [rad].
    """

    model: PlanarModel
    q: Array
    q_t: Array
    q_tt: Array | None = None
    stations: Mapping[str, str] = field(default_factory=dict)
    direction: float = 0.0

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.model.mass

    def point(self, name: str) -> tuple[Array, Array]:
        """Place and velocity of a point, each (times, 2)."""
        motion = self.motion(name)
        return motion.position, motion.velocity

    def turn(self, name: str) -> tuple[Array, Array]:
        """Angle turned there since t = 0 and its rate, each (times,)."""
        motion = self.motion(name)
        return motion.angle - self.direction, motion.spin

    def motion(self, point: str) -> FrameMotion:
        """Motion of a point at an end, or of the 'centre', half-way between the joints."""
        return self.model.motion(self.stations.get(point, point), self.q, self.q_t, self.q_tt)

    def centre(self) -> tuple[Array, Array, Array]:
        """Position, velocity and acceleration of the centre of mass, that of the frame, each (times, 2)."""
        q_tt = np.zeros_like(self.q) if self.q_tt is None else self.q_tt
        return self.q[:, :2], self.q_t[:, :2], q_tt[:, :2]

    def kinetic(self) -> Array:
        """Kinetic energy, J, shape (times,)."""
        return self.model.kinetic(self.q, self.q_t)

    def strains(self) -> list[ModalStrain]:
        """Strain energy and damping power."""
        return [ModalStrain(self.model.strain(self.q), self.model.damping_power(self.q_t))]

    def line(self, _per_element: int = 4) -> Array:
        """Return the positions of the model's p points from joint to joint, shape (times, p, 2); the argument is of beams."""
        return self.model.points(self.q)

    def deflection(self) -> Array:
        """Distance of the centre from the chord between the joints, m, positive to its left, shape (times,)."""
        shapes = self.model.shapes[:, 1]
        return self.q[:, 3:] @ (shapes[2] - (shapes[0] + shapes[1]) / 2)

    def foreshortening(self) -> Array:
        """Return the foreshortening of the chord by bending [m], shape (times,), which linear modes do not have."""
        x, w = self.model.line[:, 0], self.q[:, 3:] @ self.model.line_shapes[:, 1].T
        slopes = np.diff(w, axis=1) / np.diff(x)
        lift = (w[:, -1] - w[:, 0]) ** 2 / (x[-1] - x[0])
        return np.asarray((slopes**2 @ np.diff(x) - lift) / 2)

    def end_shortening(self) -> Array:
        """Length less the distance of the joints, m, shape (times,)."""
        return self.model.length - np.linalg.norm(self.motion("end").position - self.motion("start").position, axis=1)
