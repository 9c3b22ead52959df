"""Published claims about a flexible rocker, as readings of each turn of the crank.

The paper on rattling joints shows x-velocities (Figs 5, 6), x-accelerations (7, 8) and x contact forces (9, 10) of one run.
It says that with the flexible rocker they fluctuate less, peak lower and run smoother. A run of rattling joints is one draw
of many. So a claim is decided by means over turns of many runs, rigid and flexible, with the standard error of their ratio.
"""

from __future__ import annotations

from functools import lru_cache
from math import hypot, pi
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.stats import t as student

from buckler.mbs import Closure, Equal, simulate

from ..kit.report import Metric
from ..kit.statistics import Mean
from .bars import PlayParameters
from .turns import FORCE

HOLDS, FAILS, UNDECIDED = "holds", "does not hold", "undecided"
VERDICTS = {HOLDS: 1.0, UNDECIDED: 0.0, FAILS: -1.0}
"""Verdicts and their numbers in metrics.json."""
SAMPLES = 2001
"""Times of a turn at which the ideal motion is kept, 0.1 ms apart at 300 r/min."""


class Claim(NamedTuple):
    """Number of a turn said to be smaller with the flexible rocker: words, reading of an ensemble, unit."""

    name: str
    text: str
    reading: str
    unit: str


FAMILIES = {
    "velocity": ("velocity fluctuates less", "rms({0}.vx - ideal.{1}_vx)", "m/s"),
    "acceleration": ("acceleration peaks are lower", "max(abs({0}.ax))", "m/s^2"),
    "force": ("contact force peaks are lower", FORCE, "N"),
    "smooth_velocity": ("velocity curve is smoother", "rms({0}.ax - ideal.{1}_ax)", "m/s^2"),
    "smooth_acceleration": ("acceleration curve is smoother", "variation({0}.ax)", "m/s^2"),
}
"""Claims in words, the reading that decides each, and its unit. Ideal are rigid bars in ideal joints: the distance of the
velocity says how much it fluctuates, that of the acceleration how rough its curve is.
"""
PLACES = {
    "coupler": ("coupler", "coupler", "coupler"),
    "rocker": ("rocker, centre of mass", "rocker", "rocker"),
    "rocker_middle": ("rocker, mid-point", "rocker.middle", "rocker"),
}
"""Places in words, their signals, and the links whose ideal motion they are compared with."""
FORCES = {"coupler_rocker": ("coupler–rocker", "B"), "rocker_frame": ("rocker–frame", "C")}
"""Joints whose forces the paper shows."""


CLAIMS = tuple(
    Claim(f"{family}.{name}", f"{text}: {place[0]}", reading.format(*place[1:]), unit)
    for family, (text, reading, unit) in FAMILIES.items()
    for name, place in (FORCES if family == "force" else PLACES).items()
)
"""All claims, a row of a table each."""
READINGS = tuple(claim.reading for claim in CLAIMS)


@lru_cache(maxsize=16)
def ideal_motion(speed: float) -> dict[str, CubicSpline]:
    """Compute x-velocities and x-accelerations of coupler and rocker with ideal joints, by the names that readings have.

    They are periodic functions of the time since the crank's angle was 0.
    """
    made, times = PlayParameters().bars(gap=0.0, speed=speed), np.linspace(0, 1, SAMPLES) * 2 * pi / speed
    plain = simulate(made, times[-1], solver=Closure(Equal(4000)))  # samples that splines join to 1e-6
    found = {}
    for link in ("coupler", "rocker"):
        for x in ("vx", "ax"):
            values = plain.at(f"{link}.{x}", times)
            found[f"ideal.{link}_{x}"] = CubicSpline(times, np.append(values[:-1], values[0]), bc_type="periodic")
    return found


class Ratio(NamedTuple):
    """Ratio of two means, its standard error, and the degrees of freedom of that (Welch and Satterthwaite)."""

    value: float
    error: float
    freedom: float

    @property
    def metric(self) -> Metric:
        """Metric with the relative standard error."""
        return Metric(self.value, "1", error=self.error / self.value)

    def reach(self, level: float) -> float:
        """Return the half width of the interval with this chance that the truth is beyond one given end (Student)."""
        return float(student.isf(level, self.freedom)) * self.error if self.error else 0.0


def ratio(flexible: Mean, rigid: Mean) -> Ratio:
    """Divide two means from independent runs; errors to first order."""
    parts = [each.error / each.value for each in (flexible, rigid)]
    value, error = flexible.value / rigid.value, hypot(*parts)
    spread = sum(part**4 / (each.n - 1) for part, each in zip(parts, (flexible, rigid), strict=True))
    return Ratio(value, value * error, error**4 / spread if spread else float(rigid.n - 1))
