"""Published claims that a flexible rocker reduces motions and forces, each as a reading of one turn of the crank.

The paper on the crank-rocker, of unknown authors (`buckler.studies.kit.published`), shows x-velocities (Figs 5, 6),
x-accelerations (7, 8) and x contact forces (9, 10) of one run. It claims that with a flexible rocker these fluctuate less, have
lower peaks and smoother curves. Rattling is chaotic, so that one run shows little. So a claim is tested by means over the turns
of many runs: by their ratio, flexible over rigid rocker, with its standard error. Each study has its own test of the ratio.
"""

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
"""Numbers of the verdicts in metrics.json."""


class Claim(NamedTuple):
    """Claim, with name and text, that a reading of a turn is smaller with the flexible rocker; the reading and its unit."""

    name: str
    text: str
    reading: str
    unit: str


FAMILIES = {
    "velocity": ("velocity fluctuates less", "rms({place}.vx - ideal.{link}_vx)", "m/s"),
    "acceleration": ("acceleration peaks are lower", "max(abs({place}.ax))", "m/s^2"),
    "force": ("contact force peaks are lower", FORCE, "N"),  # largest size of the force vector in the joint {place}
    # the roughness of a velocity is read off its derivative, the acceleration
    "smooth_velocity": ("velocity curve is smoother", "rms({place}.ax - ideal.{link}_ax)", "m/s^2"),
    "smooth_acceleration": ("acceleration curve is smoother", "variation({place}.ax)", "m/s^2"),
}
"""Text, reading and unit of each family of claims. `ideal` is the motion of the link with rigid bars and ideal joints.

The fluctuation of a velocity is its rms difference from the ideal velocity. Its roughness is the rms difference of the
acceleration from the ideal one. The roughness of an acceleration is its total variation, the sum of the sizes of its changes."""
PLACES = {
    "coupler": ("coupler", {"place": "coupler", "link": "coupler"}),
    "rocker": ("rocker, centre of mass", {"place": "rocker", "link": "rocker"}),
    "rocker_middle": ("rocker, mid-point", {"place": "rocker.middle", "link": "rocker"}),
}
"""Text of each place on a link, and its names in readings. The middle of an ideal rocker is its centre of mass."""
FORCES = {"coupler_rocker": ("coupler–rocker", {"place": "B"}), "rocker_frame": ("rocker–frame", {"place": "C"})}
"""Text of the joints whose forces the paper shows, and their points in readings."""
CLAIMS = tuple(
    Claim(f"{family}.{name}", f"{text}: {place}", reading.format(**names), unit)
    for family, (text, reading, unit) in FAMILIES.items()
    for name, (place, names) in (FORCES if family == "force" else PLACES).items()
)
"""All claims, in the order of the tables' rows."""
READINGS = tuple(claim.reading for claim in CLAIMS)
"""Readings of the claims, in their order."""


@lru_cache(maxsize=16)
def ideal_motion(speed: float) -> dict[str, CubicSpline]:
    """Compute x-velocities and x-accelerations of coupler and rocker with ideal joints at a crank speed [rad/s], by their names.

    They are periodic cubic splines over the time since the crank's angle was 0, of 2001 samples, 0.1 ms apart at 300 r/min.
    """
    mechanism, times = PlayParameters().bars(gap=0.0, speed=speed), np.linspace(0, 1, 2001) * 2 * pi / speed
    result = simulate(mechanism, times[-1], solver=Closure(Equal(4000)))  # two steps between neighbouring samples
    splines = {}
    for link in ("coupler", "rocker"):
        for signal in ("vx", "ax"):
            values = result.at(f"{link}.{signal}", times)
            splines[f"ideal.{link}_{signal}"] = CubicSpline(times, np.append(values[:-1], values[0]), bc_type="periodic")
    return splines


class Ratio(NamedTuple):
    """Ratio of two means, its standard error, and the degrees of freedom of that error (Welch and Satterthwaite)."""

    value: float
    error: float
    freedom: float

    @property
    def metric(self) -> Metric:
        """Metric with the relative standard error."""
        return Metric(self.value, "1", error=self.error / self.value)

    def half_width(self, one_end: float) -> float:
        """Return the half width of Student's confidence interval; `one_end` is the probability beyond each end."""
        return float(student.isf(one_end, self.freedom)) * self.error if self.error else 0.0


def ratio(flexible: Mean, rigid: Mean) -> Ratio:
    """Divide two means from independent runs; errors propagate to first order.

    With relative errors e of n runs, the degrees of freedom are (e1^2 + e2^2)^2/(e1^4/(n1 - 1) + e2^4/(n2 - 1)), or 1 if e is 0.
    """
    e1, e2 = (each.error / each.value for each in (flexible, rigid))
    value, relative_error = flexible.value / rigid.value, hypot(e1, e2)
    denominator = e1**4 / (flexible.n - 1) + e2**4 / (rigid.n - 1)
    return Ratio(value, value * relative_error, relative_error**4 / denominator if denominator else 1.0)
