"""Motion, energy and momentum of a modal link in the plane by the floating frame of reference, independent of solvers.

The frame's origin is the undeformed centre of mass, its x axis is along the link. R and theta are its position and angle,
phi_k modes and q_k modal coordinates. A point X of the undeformed link moves to r = R + A(theta) (X + sum phi_k(X) q_k).
Arrays `q` of coordinates (R_x, R_y, theta, q_1 ... q_m), `q_t` and `q_tt` of rates have the shape (times, 3 + m).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..geometry import Array, rotate, rotate_left

STATIONS = ("start", "end", "middle")
"""Cross-sections at the two joints and half-way between them, in the order of `PlanarModel.shapes`."""


class FrameMotion(NamedTuple):
    """Motion of a cross-section: position, velocity, acceleration (times, 2); its angle and angular rate (times,)."""

    position: Array
    velocity: Array
    acceleration: Array
    angle: Array
    spin: Array


@dataclass(frozen=True, eq=False)
class PlanarModel:
    """A link and m of its modes in the plane, normalised to modal masses of 1 in space.

    Integrals of phi_i dm and X x phi_i dm are zero: modes are orthogonal to rigid motions. Of a mode's modal mass 1 the diagonal
    of `gram` is the share of motions in the plane. The rest is lateral contraction, out of the plane.
    """

    length: float  # [m]
    mass: float  # [kg]
    inertia: float  # about the centre of mass [kg m^2]
    centre: Array  # centre of mass from the start joint in link axes [m], (2,)
    numbers: Array  # numbers of the modes among all flexible ones in space, from 1, (m,)
    frequency: Array  # angular frequencies [rad/s], (m,)
    damping: Array  # damping ratios, (m,)
    shapes: Array  # for each of `STATIONS` phi_x, phi_y [1/sqrt(kg)] and rotation of the section [1/(m sqrt(kg))], (3, 3, m)
    radial: Array  # integrals of X . phi_i dm, (m,)
    gram: Array  # integrals of phi_i . phi_j dm, of components in the plane, (m, m)
    gyration: Array  # integrals of phi_i x phi_j dm, likewise, (m, m)
    line: Array  # points along the link from the centre of mass [m], (p, 2)
    line_shapes: Array  # the modes at the points of `line` [1/sqrt(kg)], (p, 2, m)

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def stiffness(self) -> Array:
        """Modal stiffnesses [1/s^2], shape (m,): frequencies squared, as modal masses are 1."""
        return self.frequency**2

    def place(self, station: str) -> Array:
        """Return the undeformed place of a station from the centre of mass in link axes [m], shape (2,)."""
        return {"start": 0.0, "end": 1.0, "middle": 0.5}[station] * np.array([self.length, 0.0]) - self.centre

    def kinetic(self, q: Array, q_t: Array) -> Array:
        """Compute the kinetic energy [J], shape (times,)."""
        modal, modal_t, theta_t = q[:, 3:], q_t[:, 3:], q_t[:, 2]
        # moment of inertia of the deformed link [kg m^2], (times,)
        inertia = self.inertia + 2 * modal @ self.radial + np.einsum("ti,ij,tj->t", modal, self.gram, modal)
        gyration = np.einsum("ti,ij,tj->t", modal, self.gyration, modal_t)
        rotary = theta_t * (inertia * theta_t + 2 * gyration)
        return 0.5 * (self.mass * (q_t[:, :2] ** 2).sum(axis=1) + rotary + (modal_t**2).sum(axis=1))

    def strain(self, q: Array) -> Array:
        """Compute the strain energy [J], shape (times,)."""
        return 0.5 * q[:, 3:] ** 2 @ self.stiffness

    def damping_power(self, q_t: Array) -> Array:
        """Compute the power lost to modal damping [W], shape (times,)."""
        return q_t[:, 3:] ** 2 @ (2 * self.damping * self.frequency)

    def motion(self, station: str, q: Array, q_t: Array, q_tt: Array) -> FrameMotion:
        """Compute the motion of a station."""
        shape = self.shapes[STATIONS.index(station)]
        arm = self.place(station) + q[:, 3:] @ shape[:2].T
        arm_t, arm_tt = q_t[:, 3:] @ shape[:2].T, q_tt[:, 3:] @ shape[:2].T  # in link axes
        spin, spin_t = q_t[:, 2:3], q_tt[:, 2:3]
        return FrameMotion(
            q[:, :2] + rotate(q[:, 2], arm),
            q_t[:, :2] + rotate(q[:, 2], arm_t + spin * rotate_left(arm)),
            q_tt[:, :2] + rotate(q[:, 2], arm_tt + 2 * spin * rotate_left(arm_t) + spin_t * rotate_left(arm) - spin**2 * arm),
            q[:, 2] + q[:, 3:] @ shape[2],
            q_t[:, 2] + q_t[:, 3:] @ shape[2],
        )


class ModalStrain(NamedTuple):
    """Strain energy of the modes [J] and power lost to their damping [W], each (times,)."""

    energy: Array
    power: Array


@dataclass(frozen=True, eq=False)
class ModalHistory:
    """Recorded motion of a modal link, with the same methods as recorded strips.

    `stations` maps points of the mechanism to `STATIONS`; `direction` is the angle of the link at t = 0 [rad].
    """

    model: PlanarModel
    q: Array
    q_t: Array
    q_tt: Array
    stations: Mapping[str, str]
    direction: float

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return self.model.mass

    def point(self, name: str) -> tuple[Array, Array]:
        """Return position [m] and velocity [m/s] of a point, each (times, 2)."""
        motion = self.motion(name)
        return motion.position, motion.velocity

    def turn(self, name: str) -> tuple[Array, Array]:
        """Return the angle turned by the section at a point since t = 0 [rad], and its rate, each (times,)."""
        motion = self.motion(name)
        return motion.angle - self.direction, motion.spin

    def motion(self, point: str) -> FrameMotion:
        """Return the motion of the section at a point, or at the station 'middle'."""
        return self.model.motion(self.stations.get(point, point), self.q, self.q_t, self.q_tt)

    def centre(self) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration of the centre of mass, the origin of the frame, each (times, 2)."""
        return self.q[:, :2], self.q_t[:, :2], self.q_tt[:, :2]

    def kinetic(self) -> Array:
        """Compute the kinetic energy [J], shape (times,)."""
        return self.model.kinetic(self.q, self.q_t)

    def strains(self) -> list[ModalStrain]:
        """Return strain energy and damping power in a list, as strips do for each of their strains."""
        return [ModalStrain(self.model.strain(self.q), self.model.damping_power(self.q_t))]

    def line(self, _per_element: int = 4) -> Array:
        """Compute the positions [m] of the points of the model's `line`, (times, p, 2); only strips use the argument."""
        local = self.model.line + np.einsum("pam,tm->tpa", self.model.line_shapes, self.q[:, 3:])
        return self.q[:, None, :2] + rotate(self.q[:, 2:3], local)

    def deflection(self) -> Array:
        """Compute the distance of the middle from the chord of the joints [m], positive to its left, shape (times,)."""
        start, end, middle = self.model.shapes[:, 1]
        return self.q[:, 3:] @ (middle - (start + end) / 2)

    def foreshortening(self) -> Array:
        """Compute the shortening of the chord by bending [m], shape (times,): a second-order effect that the modes leave out."""
        x, w = self.model.line[:, 0], self.q[:, 3:] @ self.model.line_shapes[:, 1].T
        slopes = np.diff(w, axis=1) / np.diff(x)
        rigid = (w[:, -1] - w[:, 0]) ** 2 / (x[-1] - x[0])  # part of the integral of slope^2 by the rotation of the chord
        return np.asarray((slopes**2 @ np.diff(x) - rigid) / 2)

    def end_shortening(self) -> Array:
        """Compute the undeformed length less the distance of the joints [m], shape (times,)."""
        return self.model.length - np.linalg.norm(self.motion("end").position - self.motion("start").position, axis=1)
