"""Kinematics of the ideal mechanism, every link rigid: loop closure for any linkage, closed form for the slider-crank.

Each link has the coordinates (x, y, theta) of its start point and direction. A joint, guide or drive contributes rows
C(q, t) = 0; then J q_t = -C_t and J q_tt = gamma, J the Jacobian dC/dq (e.g. Nikravesh, Computer-Aided Analysis of
Mechanical Systems, 1988, ch. 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.elements.drive import Drive
from buckler.mbs.elements.element import GROUND
from buckler.mbs.elements.revolute import Revolute
from buckler.mbs.elements.rigid import Rigid
from buckler.mbs.mechanism import Mechanism

Array = np.ndarray[Any, Any]
MAX_ITERATIONS = 50


class KinematicsError(ValueError):
    """The linkage cannot be assembled, or is singular (a dead centre) where it must not be."""


class State(NamedTuple):
    """Coordinates, velocities and accelerations of all links, each of shape (number of links, 3): x, y, theta of the start."""

    q: Array
    q_t: Array
    q_tt: Array


@dataclass(frozen=True)
class Closure:
    """Loop closure of a mechanism whose links are all taken as rigid."""

    mechanism: Mechanism

    @cached_property
    def index(self) -> dict[str, int]:
        """Place of each link in the coordinate array."""
        return {link.name: i for i, link in enumerate(self.mechanism.links)}

    @cached_property
    def reference(self) -> Array:
        """Coordinates at t = 0, shape (links, 3)."""
        rows = []
        for link in self.mechanism.links:
            (x0, y0), (x1, y1) = self.mechanism.points[link.start], self.mechanism.points[link.end]
            rows.append((x0, y0, np.arctan2(y1 - y0, x1 - x0)))
        return np.array(rows)

    @property
    def _drive(self) -> Drive | None:
        return self.mechanism.drives[0] if self.mechanism.drives else None

    def _arm(self, link: str, point: str, theta: float) -> Array:
        """Vector from a link's start to one of its points, turned to direction theta."""
        x0, y0, theta0 = self.reference[self.index[link]]
        dx, dy = np.subtract(self.mechanism.points[point], (x0, y0))
        c, s = np.cos(theta - theta0), np.sin(theta - theta0)
        return np.array([c * dx - s * dy, s * dx + c * dy])

    def position(self, link: str, point: str, q: Array) -> Array:
        """Position of a point of a link (or of ground), m."""
        if link == GROUND:
            return np.array(self.mechanism.points[point])
        x, y, theta = q[self.index[link]]
        return np.array([x, y]) + self._arm(link, point, theta)

    def velocity(self, link: str, point: str, q: Array, q_t: Array) -> Array:
        """Velocity of a point of a link, m/s."""
        if link == GROUND:
            return np.zeros(2)
        i = self.index[link]
        ax, ay = self._arm(link, point, q[i, 2])
        return q_t[i, :2] + q_t[i, 2] * np.array([-ay, ax])

    def rows(self) -> list[tuple[list[tuple[str, str, float]], Array, str]]:
        """Constraint rows of points: sum of sign * direction . position(link, point) = its value at t = 0 (+ drive)."""
        ex, ey = np.array([1.0, 0.0]), np.array([0.0, 1.0])
        rows = []
        for joint in self.mechanism.joints:
            ends = [(joint.first, joint.point, 1.0), (joint.second, joint.point, -1.0)]
            rows += [(ends, ex, ""), (ends, ey, "")]
        for guide in self.mechanism.guides:
            ax, ay = guide.along
            rows.append(([(guide.link, guide.point, 1.0)], np.array([-ay, ax]), ""))
        drive = self._drive
        if drive is not None and drive.target not in self.index:
            guide = self.mechanism.guide(drive.target)
            rows.append(([(guide.link, guide.point, 1.0)], np.array(guide.along), "drive"))
        return rows

    def system(self, q: Array, q_t: Array, travel: float) -> tuple[Array, Array, Array]:
        """Residual C (rows,), Jacobian J (rows, 3 links) and convective term gamma (rows,), drive part excluded from gamma."""
        n = len(self.index)
        residual, jacobian, gamma = [], [], []
        for ends, direction, kind in self.rows():
            row, value, convective = np.zeros((n, 3)), np.array(-travel if kind else 0.0), 0.0
            for link, point, sign in ends:
                value += sign * direction @ (self.position(link, point, q) - self.mechanism.points[point])
                if link == GROUND:
                    continue
                i = self.index[link]
                ax, ay = self._arm(link, point, q[i, 2])
                row[i] += sign * np.array([*direction, direction @ (-ay, ax)])
                convective += sign * q_t[i, 2] ** 2 * direction @ (ax, ay)
            residual.append(value)
            jacobian.append(row.ravel())
            gamma.append(convective)
        drive = self._drive
        if drive is not None and drive.target in self.index:
            i = self.index[drive.target]
            residual.append(q[i, 2] - self.reference[i, 2] - travel)
            jacobian.append(np.eye(3 * n)[3 * i + 2])
            gamma.append(0.0)
        return np.array(residual), np.array(jacobian).reshape(-1, 3 * n), np.array(gamma)

    def mobility(self) -> int:
        """Degrees of freedom left at t = 0 with the drive locked: 0 for a fully driven linkage."""
        _, jacobian, _ = self.system(self.reference, np.zeros_like(self.reference), 0.0)
        return jacobian.shape[1] - int(np.linalg.matrix_rank(jacobian, tol=1e-9)) if jacobian.size else 3 * len(self.index)

    def solve(self, t: float = 0.0, guess: Array | None = None) -> State:
        """Positions, velocities and accelerations at time t by Newton's method.

        Parameters
        ----------
        t : float
            Time, s.
        guess : array, shape (links, 3), optional
            Coordinates close to the answer; those of t = 0 by default.

        Raises
        ------
        KinematicsError
            If Newton's method does not close the loops: out of reach, or at a dead centre.
        """
        q = (self.reference if guess is None else guess).copy()
        drive = self._drive
        motion = drive.motion if drive is not None else None
        travel, speed, change = (motion.position(t), motion.speed(t), motion.acceleration(t)) if motion else (0.0, 0.0, 0.0)
        scale = max(self.mechanism.length(link.name) for link in self.mechanism.links)
        zero = np.zeros_like(q)
        for _ in range(MAX_ITERATIONS):
            residual, jacobian, _ = self.system(q, zero, travel)
            if np.abs(residual).max(initial=0.0) < 1e-14 * max(1.0, scale):
                break
            q -= np.linalg.lstsq(jacobian, residual, rcond=1e-12)[0].reshape(q.shape)
        residual, jacobian, _ = self.system(q, zero, travel)
        if np.abs(residual).max(initial=0.0) > 1e-12 * max(1.0, scale):
            raise KinematicsError(
                f"loops do not close at t = {t:g} s (gap {np.abs(residual).max():.3g} m): out of reach, or at a dead centre"
            )
        driven = self._driven(len(residual))
        q_t = self._rates(jacobian, driven * speed, "velocities", t)
        gamma = self.system(q, q_t, travel)[2]
        return State(q, q_t, self._rates(jacobian, gamma + driven * change, "accelerations", t))

    def start(self) -> Array:
        """Velocities at t = 0, shape (links, 3); unlike `solve` it needs no accelerations.

        Raises
        ------
        KinematicsError
            If the drive's velocity is impossible there: a dead centre.
        """
        drive = self._drive
        residual, jacobian, _ = self.system(self.reference, np.zeros_like(self.reference), 0.0)
        speed = drive.motion.speed(0.0) if drive is not None else 0.0
        return self._rates(jacobian, self._driven(len(residual)) * speed, "velocities", 0.0)

    def _driven(self, rows: int) -> Array:
        """True for the drive's row."""
        kinds = [kind == "drive" for *_, kind in self.rows()]
        return np.array(kinds + [True] * (rows - len(kinds)))

    def _rates(self, jacobian: Array, right: Array, what: str, t: float) -> Array:
        """Least-norm solution of J rate = right; free degrees of freedom stay at rest."""
        rate = np.linalg.lstsq(jacobian, right, rcond=1e-10)[0] if jacobian.size else np.zeros(jacobian.shape[1])
        gap = np.abs(jacobian @ rate - right).max(initial=0.0)
        if gap > 1e-9 * max(1.0, np.abs(right).max(initial=0.0)):
            raise KinematicsError(f"{what} at t = {t:g} s do not exist (gap {gap:.3g}): the linkage is at a dead centre")
        return rate.reshape(-1, 3)


# --- the slider-crank in closed form ----------------------------------------------------------------------------------


class SliderCrank(NamedTuple):
    """The slider on the far side of the crank pivot: crank pin r (cos, sin) theta, slider on the x axis at negative x.

    theta = pi is the outer dead centre (Demirel et al. 2008, eqs 1-5, doi 10.1115/IMECE2008-68796).
    """

    crank: float
    coupler: float

    def slider(self, theta: Any) -> Any:
        """Slider position x = r cos theta - sqrt(L^2 - r^2 sin^2 theta), m."""
        return self.crank * np.cos(theta) - np.sqrt(self.coupler**2 - (self.crank * np.sin(theta)) ** 2)

    def slider_rate(self, theta: Any) -> Any:
        """dx/dtheta, m/rad; times the crank speed it is the slider's velocity."""
        s, c = np.sin(theta), np.cos(theta)
        return -self.crank * s + self.crank**2 * s * c / np.sqrt(self.coupler**2 - (self.crank * s) ** 2)

    def chord(self, theta: Any, stop: float) -> Any:
        """Distance of crank pin and a slider held at x = stop, m (eq. 8)."""
        return np.hypot(self.crank * np.cos(theta) - stop, self.crank * np.sin(theta))

    def shortening(self, theta: Any, stop: float) -> Any:
        """Normalised end shortening u = 1 - chord/L of a coupler whose slider is held at x = stop (eqs 7-9)."""
        return 1 - self.chord(theta, stop) / self.coupler

    def lean_cosine(self, theta: Any, stop: float) -> Any:
        """cos(phi) of the chord against the slider's line (eq. 10)."""
        return (self.crank * np.cos(theta) - stop) / self.chord(theta, stop)

    def contact_angle(self, stop: float) -> float:
        """Crank angle in (0, pi) at which the rigid slider reaches x = stop: the cosine rule.

        Raises
        ------
        ValueError
            If the slider never gets there.
        """
        inner, outer = self.slider(0.0), self.slider(np.pi)
        if not outer <= stop <= inner:
            raise ValueError(f"stop = {stop:g} m: the slider moves only in [{outer:g}, {inner:g}] m")
        cosine = (stop**2 + self.crank**2 - self.coupler**2) / (2 * stop * self.crank)
        return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


def determined(mechanism: Mechanism) -> bool:
    """True if joints, guides and drive alone decide where the links are: as many constraints as coordinates."""
    rigid = all(isinstance(link.body, Rigid) for link in mechanism.links)
    ideal = all(isinstance(joint, Revolute) for joint in mechanism.joints)
    if len(mechanism.drives) != 1 or not rigid or not ideal:
        return False
    return 2 * len(mechanism.joints) + len(mechanism.guides) + 1 == 3 * len(mechanism.links)


def turning_speed(mechanism: Mechanism, duration: float) -> float:
    """Largest speed of the driven link within a duration [s], rad/s; 0 where a point is driven, or nothing."""
    drive = mechanism.drives[0] if mechanism.drives else None
    if drive is None or drive.target in mechanism.points:
        return 0.0
    return max(abs(drive.motion.speed(float(t))) for t in np.linspace(0, duration, 101))
