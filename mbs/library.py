"""Slider-cranks, with their closed form, and crank-rockers: functions that return their `Mechanism`."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .elements import Body, Clearance, Drive, Guide, GuideFriction, Link, Material, Motion, Ramp, Revolute, Rigid, Section, Stop
from .laws import Impact, NormalLaw
from .laws.pieces import Reals
from .mechanism import Mechanism
from .scene.linkage import KinematicsError


class SliderCrank(NamedTuple):
    """Slider-crank with a crank of length r, a coupler of length L [m] and a slider at negative x.

    The crank pin is at r (cos theta, sin theta), the slider on the x axis. At theta = pi the slider is farthest from the crank
    pivot. Numbers of equations refer to Demirel et al. 2008, doi 10.1115/IMECE2008-68796.
    """

    crank: float
    coupler: float

    def slider(self, theta: Reals) -> Reals:
        """Compute the slider position x = r cos theta - sqrt(L^2 - r^2 sin^2 theta) [m] (eqs 1-5)."""
        return self.crank * np.cos(theta) - np.sqrt(self.coupler**2 - (self.crank * np.sin(theta)) ** 2)

    def slider_rate(self, theta: Reals) -> Reals:
        """Compute dx/dtheta [m/rad], the slider's velocity over the crank speed."""
        s, c = np.sin(theta), np.cos(theta)
        return -self.crank * s + self.crank**2 * s * c / np.sqrt(self.coupler**2 - (self.crank * s) ** 2)

    def slider_second_rate(self, theta: Reals) -> Reals:
        """Compute d2x/dtheta2 [m/rad^2], the slider's acceleration over the square of a constant crank speed."""
        s, c = np.sin(theta), np.cos(theta)
        q = np.sqrt(self.coupler**2 - (self.crank * s) ** 2)
        return -self.crank * c + self.crank**2 * (c**2 - s**2) / q + (self.crank**2 * s * c) ** 2 / q**3

    def chord(self, theta: Reals, stop: Reals) -> Reals:
        """Compute the distance of the crank pin from a slider fixed at x = stop [m] (eq. 8)."""
        return np.hypot(self.crank * np.cos(theta) - stop, self.crank * np.sin(theta))

    def shortening(self, theta: Reals, stop: Reals) -> Reals:
        """Compute the end shortening over length, u = 1 - chord/L, of a coupler whose slider is fixed at x = stop (eqs 7-9)."""
        return 1 - self.chord(theta, stop) / self.coupler

    def lean_cosine(self, theta: Reals, stop: Reals) -> Reals:
        """Compute cos(phi), phi the angle between the coupler's chord and the x axis (eq. 10)."""
        return (self.crank * np.cos(theta) - stop) / self.chord(theta, stop)

    def push(self, load: Callable[[Reals], Reals], rigidity: float, theta: Reals, stop: Reals) -> Reals:
        """Compute the force with which a buckled coupler presses a slider against a stop at x = stop, p(u) E I/L^2 cos(phi) [N].

        It is positive towards negative x, away from the crank (eqs 7-13). `load` is a function from the end shortening over
        length to p = P L^2/(E I), `rigidity` is E I [N m^2]. Where the slider does not reach the stop, u = 0 is taken.
        """
        u = np.maximum(self.shortening(theta, stop), 0.0)
        return load(u) * rigidity / self.coupler**2 * self.lean_cosine(theta, stop)

    def contact_angle(self, stop: float) -> float:
        """Compute the crank angle in (0, pi) at which the slider reaches x = stop (cosine rule); raise a ValueError if never."""
        inner, outer = self.slider(0.0), self.slider(np.pi)
        if not outer <= stop <= inner:
            raise ValueError(f"stop = {stop:g} m: the slider moves only in [{outer:g}, {inner:g}] m")
        cosine = (stop**2 + self.crank**2 - self.coupler**2) / (2 * stop * self.crank)
        return float(np.arccos(np.clip(cosine, -1.0, 1.0)))


PAPER = SliderCrank(crank=0.140, coupler=0.310)
"""Lengths of the compliant slider-crank, m (Demirel et al. 2008, Table 1, doi 10.1115/IMECE2008-68796)."""
PAPER_STOP = float(PAPER.slider(np.radians(120)))
"""Place of its stopper, m: the rigid slider arrives at a crank angle of 120 degrees."""


def slider_crank(
    coupler: Body, *, law: NormalLaw | None, mass: float, speed: float | Ramp | Motion, friction: GuideFriction | None = None,
    stop: float = PAPER_STOP, lengths: SliderCrank = PAPER,
) -> Mechanism:  # fmt: skip
    """Return the compliant slider-crank at crank angle 0, its slider at negative x, on the far side of the crank pivot.

    `speed` [rad/s] is that of the crank. `coupler` is the body from the crank pin A to the slider B, whose `mass` [kg] slides in
    a guide with `friction`. `law` is that of the contact with the stopper at x = `stop` < 0 [m]; None leaves the stopper out.
    """
    crank = Rigid(Section(width=0.030, thickness=0.005))  # its speed is prescribed: its mass changes the torque only
    return Mechanism(
        points={"O": (0.0, 0.0), "A": (lengths.crank, 0.0), "B": (float(lengths.slider(0.0)), 0.0)},
        links=[Link("crank", "O", "A", crank), Link("coupler", "A", "B", coupler)],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler")],
        guides=[Guide("B", "coupler", mass=mass, friction=friction)],
        stops=[] if law is None else [Stop("B", at=stop, law=law)],
        drives=[Drive("crank", speed)],
    )


class CrankRocker(NamedTuple):
    """Lengths of a crank-rocker, m: crank O-A, coupler A-B, rocker C-B, frame O-C."""

    crank: float = 0.105
    coupler: float = 0.272
    rocker: float = 0.175
    frame: float = 0.225

    def places(self, angle: float) -> dict[str, tuple[float, float]]:
        """Return the points O, A, B, C at a crank angle, with B on the left of A-C: the open branch, not the crossed one."""
        a, c = self.crank * np.array([np.cos(angle), np.sin(angle)]), np.array([self.frame, 0.0])
        diagonal = float(np.hypot(*(c - a)))
        along = (self.coupler**2 - self.rocker**2 + diagonal**2) / (2 * diagonal)
        height_squared = self.coupler**2 - along**2  # of the triangle A B C over A-C
        if height_squared <= 0:
            raise KinematicsError(f"crank angle {angle:g} rad: coupler and rocker do not close, or are in line (dead centre)")
        u = (c - a) / diagonal
        b = a + along * u + np.sqrt(height_squared) * np.array([-u[1], u[0]])
        return {"O": (0.0, 0.0), "A": (float(a[0]), float(a[1])), "B": (float(b[0]), float(b[1])), "C": (self.frame, 0.0)}


BAR = Section(width=0.020, thickness=0.005, material=Material(modulus=207e9, density=7850.0, poisson=0.29))
"""Section of the crank-rocker's links: steel, 20 mm wide, 5 mm thick in the plane."""
STEEL_CRANK_ROCKER = CrankRocker()
"""Lengths of the crank-rocker of a paper whose authors are unknown [m]; see `docs/evidence-crank-rocker.md`."""
JOINT_STIFFNESS = 2.53e5 * 1e3**1.5
"""Contact stiffness K of the crank-rocker's joints in that paper, 2.53e5 N/mm^1.5, in N/m^1.5."""
RATTLING = Impact(JOINT_STIFFNESS, damping=253.0, damping_depth=1e-5)
"""Contact law of these joints, which rattle. The damping from 1e-5 m of depth on is 253, its unit uncertain: here N s/m."""
CLOSED = Impact(JOINT_STIFFNESS, damping=253e3, damping_depth=1e-5)
"""The same with the unit N s/mm: the joints stay closed."""


def crank_rocker(
    rocker: Body, *, speed: float | Ramp | Motion, play: Callable[[str, str, str], Clearance] | None = None,
    with_play: str = "OABC", section: Section = BAR, lengths: CrankRocker = STEEL_CRANK_ROCKER, angle: float = 0.5,
) -> Mechanism:  # fmt: skip
    """Return the crank-rocker with clearance in any of its joints, its journals centred at the start.

    `rocker` is the body from the frame C to the coupler's end B, `section` that of crank and coupler. The crank has the `speed`
    [rad/s] and starts at the `angle` [rad]. `play(point, first, second)` makes a joint with clearance, its pin on `first`, at the
    points in `with_play`: O (frame-crank), A (crank-coupler), B (coupler-rocker), C (frame-rocker). The others are ideal.
    """
    joints = [("O", "ground", "crank"), ("A", "crank", "coupler"), ("B", "coupler", "rocker"), ("C", "ground", "rocker")]
    bars = [Link("crank", "O", "A", Rigid(section)), Link("coupler", "A", "B", Rigid(section))]
    return Mechanism(
        points=lengths.places(angle),
        links=[*bars, Link("rocker", "C", "B", rocker)],
        joints=[play(*joint) if play and joint[0] in with_play else Revolute(*joint) for joint in joints],
        drives=[Drive("crank", speed)],
    )
