"""The crank-rocker with clearance as numbers: its mechanism, and its ideal motion in closed form."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Clearance, Material, Mechanism, Modal, Rigid, Section, crank_rocker
from buckler.mbs.laws import AdamsFriction, FrictionLaw, NormalLaw
from buckler.mbs.library import RATTLING, CrankRocker
from buckler.mbs.validate import non_negative, number, positive

Array = np.ndarray[Any, Any]
JOINTS = ("O", "A", "B", "C")
"""Crank-frame, crank-coupler, coupler-rocker, rocker-frame. The pin is the former's; at O and C it is the frame's."""
BODIES = {"O": ("ground", "crank"), "A": ("crank", "coupler"), "B": ("coupler", "rocker"), "C": ("ground", "rocker")}
"""Of each joint: the body that carries the pin by default, then the one that carries the bush."""


class IdealMotion(NamedTuple):
    """Crank, coupler and rocker of the ideal mechanism: centres x, y and direction theta, each array of shape (..., 3, 3).

    The rocker points from C to B, as the link does.
    """

    place: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True)
class FourBar:
    """Crank-rocker of uniform bars, turned at constant speed, with clearance in its joints.

    O = (0, 0) joins frame and crank, A crank and coupler, B coupler and rocker, C = (frame, 0) rocker and frame; B lies to
    the left of the line from A to C (open branch). Bars point O to A, A to B, C to B. The rotation of the crank is
    prescribed; with clearance at O its centre is free.

    Parameters
    ----------
    crank, coupler, rocker, frame : float
        Between joint centres, m.
    width, thickness : float
        Of the bars, out of the plane and in it, m. The inertia of a bar is m (L^2 + thickness^2)/12.
    density : float
        kg/m^3.
    speed : float
        Of the crank, rad/s.
    start : float
        Crank angle at t = 0, rad. At the default 0 the linkage is regular (transmission angle 18.6 degrees, its smallest).
    pin : float
        Pin radius, m; one for all joints.
    gap : float or four floats
        Radial clearance at O, A, B, C, m; 0 makes a joint ideal, inf leaves it out.
    law, friction : NormalLaw, FrictionLaw
        Of every joint with clearance.
    turned : str
        Joints whose pin is on the body that by default carries the bush, such as "BC"; see `BODIES`.
    gravity : (float, float)
        In the plane, m/s^2.
    modes : Modal, optional
        A flexible rocker; its mass and moment of inertia then are those of its modes.

    Raises
    ------
    ValueError
        Naming parameter, value, range and unit.
    """

    crank: float = 0.105
    coupler: float = 0.272
    rocker: float = 0.175
    frame: float = 0.225
    width: float = 0.005
    thickness: float = 0.020
    density: float = 7850.0
    speed: float = 10 * pi
    start: float = 0.0
    pin: float = 5e-3
    gap: float | tuple[float, float, float, float] = 0.25e-3
    law: NormalLaw = RATTLING
    friction: FrictionLaw = field(default_factory=lambda: AdamsFriction(static=0.3, dynamic=0.1))
    turned: str = ""
    gravity: tuple[float, float] = (0.0, 0.0)
    modes: Modal | None = None

    def __post_init__(self) -> None:
        for name in ("crank", "coupler", "rocker", "frame", "width", "thickness", "pin"):
            positive(name, getattr(self, name), "m")
        positive("density", self.density, "kg/m^3")
        for name, unit in (("speed", "rad/s"), ("start", "rad")):
            number(name, getattr(self, name), -inf, inf, unit)
        if len(self.gaps) != len(JOINTS):
            raise ValueError(f"gap = {self.gap!r} m: must be one number or four, for {', '.join(JOINTS)}")
        for joint, gap in zip(JOINTS, self.gaps, strict=True):
            if gap != inf:
                non_negative(f"gap at {joint}", gap, "m")
        if set(self.turned) - set(JOINTS) or len(set(self.turned)) < len(self.turned):
            raise ValueError(f"turned = {self.turned!r}: must name some of {', '.join(JOINTS)}, none of them twice")
        for component in self.gravity:
            number("gravity", component, -inf, inf, "m/s^2")
        self._check_branch()

    def _check_branch(self) -> None:
        """All crank angles must close the loop, with room to spare."""
        near, far = abs(self.frame - self.crank), self.frame + self.crank
        low, high = abs(self.coupler - self.rocker), self.coupler + self.rocker
        if not (low < near and far < high):
            raise ValueError(
                f"crank = {self.crank!r} m: cannot turn: A to C spans [{near:g}, {far:g}] m, "
                f"coupler and rocker together only ({low:g}, {high:g}) m"
            )

    @property
    def gaps(self) -> tuple[float, ...]:
        """Radial clearance of each joint, m."""
        return tuple(self.gap) if isinstance(self.gap, tuple | list) else (self.gap,) * 4

    @property
    def lengths(self) -> Array:
        """Of crank, coupler and rocker, m."""
        return np.array([self.crank, self.coupler, self.rocker])

    @property
    def masses(self) -> Array:
        """Of crank, coupler and rocker, kg."""
        masses = self.density * self.width * self.thickness * self.lengths
        if self.modes is not None:
            masses[2] = self.modes.planar(self.rocker).mass
        return masses

    @property
    def inertias(self) -> Array:
        """Of the same about their centres, kg m^2."""
        inertias = self.masses * (self.lengths**2 + self.thickness**2) / 12
        if self.modes is not None:
            inertias[2] = self.modes.planar(self.rocker).inertia
        return inertias

    @property
    def section(self) -> Section:
        """Of all bars."""
        return Section(self.width, self.thickness, Material(modulus=207e9, density=self.density, poisson=0.29))

    def joint(self, point: str, first: str, second: str) -> Clearance:
        """Joint with clearance at a point."""
        if point in self.turned:
            first, second = second, first
        return Clearance(point, first, second, self.pin, self.gaps[JOINTS.index(point)], self.law, self.friction)

    def mechanism(self) -> Mechanism:
        """The same as a mechanism, at its start."""
        gaps = dict(zip(JOINTS, self.gaps, strict=True))
        made = crank_rocker(
            self.modes or Rigid(self.section),
            speed=self.speed,
            play=self.joint,
            with_play="".join(point for point, gap in gaps.items() if 0 < gap < inf),
            section=self.section,
            lengths=CrankRocker(self.crank, self.coupler, self.rocker, self.frame),
            angle=self.start,
        )
        return replace(made, gravity=self.gravity, joints=[j for j in made.joints if gaps[j.point] < inf])

    @property
    def period(self) -> float:
        """Of the crank, s."""
        return 2 * pi / abs(self.speed) if self.speed else inf

    def ideal(self, t: Any) -> IdealMotion:
        """Motion without clearance at times t, shape (...): loop closure in closed form, in complex numbers."""
        angle = self.start + self.speed * np.asarray(t, dtype=float)
        a = self.crank * np.exp(1j * angle)
        chord = self.frame - a
        d = np.abs(chord)
        corner = np.arccos((self.coupler**2 + d**2 - self.rocker**2) / (2 * self.coupler * d))
        b = self.coupler * np.exp(1j * (np.angle(chord) + corner))
        c = chord - b
        w = self.speed
        # i (wb b + wc c) = -i w a, then b and c for the angular accelerations; cross(b, c) is never 0
        cross = _cross(b, c)  # 0 only where coupler and rocker are in line, which a crank that turns excludes
        wb, wc = -w * _cross(a, c) / cross, w * _cross(a, b) / cross
        rest = w**2 * a + wb**2 * b + wc**2 * c
        tb, tc = _cross(1j * c, rest) / -cross, _cross(1j * b, rest) / cross
        end, speed, change = np.zeros((3, *a.shape), dtype=complex)  # of the bar's first end
        place, velocity, acceleration = [], [], []
        for bar, direction, spin, turn in ((a, angle, w, 0.0), (b, np.angle(b), wb, tb), (c, np.angle(-c), wc, tc)):
            flow, rush = 1j * spin * bar, (1j * turn - spin**2) * bar
            place.append(_planar(end + bar / 2, direction))
            velocity.append(_planar(speed + flow / 2, spin))
            acceleration.append(_planar(change + rush / 2, turn))
            end, speed, change = end + bar, speed + flow, change + rush
        return IdealMotion(np.stack(place, axis=-2), np.stack(velocity, axis=-2), np.stack(acceleration, axis=-2))


def _planar(z: Array, angle: Any) -> Array:
    return np.stack([z.real, z.imag, np.broadcast_to(angle, z.shape)], axis=-1)


def _cross(a: Array, b: Array) -> Array:
    return (np.conj(a) * b).imag
