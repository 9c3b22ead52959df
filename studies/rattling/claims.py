"""Published claims about a flexible rocker, as numbers of each turn of the crank.

The paper on rattling joints shows x-velocities (Figs 5, 6), x-accelerations (7, 8) and x contact forces (9, 10) of one run.
It says that with the flexible rocker they fluctuate less, peak lower and run smoother. A run of rattling joints is one draw
of many, so a claim is decided by means over turns of many runs, rigid and flexible, with the standard error of their ratio.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from math import atan2, hypot, pi
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.stats import t as student

from buckler.mbs import Closure, Equal, Mechanism, simulate
from buckler.mbs.geometry import Array
from buckler.mbs.record.lookup import between

from ..kit.report import Metric
from ..kit.statistics import Mean
from .bars import PlayParameters
from .turns import Ensemble, Member, along, period, root_mean_squares

TURN = np.linspace(0, 1, 2001)
"""Times over that of a turn, 0.1 ms apart at 300 r/min, at which accelerations are drawn and the ideal motion is kept."""
HOLDS, FAILS, UNDECIDED = "holds", "does not hold", "undecided"
VERDICTS = {HOLDS: 1.0, UNDECIDED: 0.0, FAILS: -1.0}
"""Verdicts and their numbers in metrics.json."""
PLACES = {"coupler": 0, "rocker": 1, "rocker_middle": 2}
"""Columns of the centres of mass of coupler and rocker, and of the rocker's material point in the middle."""
LINKS = ("coupler", "rocker", "rocker")
"""Links whose ideal motion these places are compared with."""


class Claim(NamedTuple):
    """A number of a turn said to be smaller with the flexible rocker: words, measure and column in an ensemble, unit."""

    family: str
    place: str
    text: str
    measure: str
    column: int
    unit: str

    @property
    def name(self) -> str:
        """Name in metrics.json."""
        return f"{self.family}.{self.place}"


FAMILIES = {
    "velocity": ("velocity fluctuates less", "v_error", "m/s"),
    "acceleration": ("acceleration peaks are lower", "peak_a", "m/s^2"),
    "force": ("contact force peaks are lower", "force", "N"),
    "smooth_velocity": ("velocity curve is smoother", "a_error", "m/s^2"),
    "smooth_acceleration": ("acceleration curve is smoother", "travel_a", "m/s^2"),
}
"""Claims in words, and the measure of a turn that decides each: of `curves` or of `turns.by_turn`."""
WHERE = {
    "coupler": "coupler", "rocker": "rocker, centre of mass", "rocker_middle": "rocker, mid-point",
    "coupler_rocker": "coupler–rocker", "rocker_frame": "rocker–frame",
}  # fmt: skip
JOINT_COLUMNS = {"coupler_rocker": 2, "rocker_frame": 3}
"""Columns of the joints whose forces the paper shows."""
CLAIMS = tuple(
    Claim(family, place, f"{text}: {WHERE[place]}", measure, column, unit)
    for family, (text, measure, unit) in FAMILIES.items()
    for place, column in (JOINT_COLUMNS if family == "force" else PLACES).items()
)
"""All claims, a row of a table each."""


def curves(mechanism: Mechanism) -> Callable[[Member, int, int], dict[str, Array]]:
    """Return a function of (member, turns, settle) that measures curves, each (turns - settle, 3) for the `PLACES`.

    `v_error` [m/s] and `a_error` [m/s^2]: root mean squares over time of the x-velocity and the x-acceleration less those of
    rigid bars in ideal joints. The one tells how much the velocity fluctuates, the other how rough its curve is.
    `travel_a` [m/s^2]: sum of |changes| of the x-acceleration from sample to sample. It grows with peaks and their number, and
    depends on the samples, as a drawing does.
    """
    turn, (x, y), (x0, y0) = period(mechanism), mechanism.points["A"], mechanism.points["O"]
    begin, ideal = turn * atan2(y - y0, x - x0) / (2 * pi), ideal_motion(2 * pi / turn)

    def measure(member: Member, turns: int, settle: int = 0) -> dict[str, Array]:
        """Measure the turns of a member."""
        time, (v, a), edges = member.record.time, along(member.record), turn * np.arange(settle, turns + 1)
        angle = (time + begin) % turn
        drawn = np.stack([between(time, a, None, (k + TURN) * turn) for k in range(settle, turns)])
        return {
            "v_error": root_mean_squares(time, v - ideal["vx"](angle), edges),
            "a_error": root_mean_squares(time, a - ideal["ax"](angle), edges),
            "travel_a": np.abs(np.diff(drawn, axis=1)).sum(axis=1),
        }

    return measure


@lru_cache(maxsize=16)
def ideal_motion(speed: float) -> dict[str, CubicSpline]:
    """Compute x-velocities and x-accelerations of the `LINKS` with ideal joints, over the time since the crank's angle was 0."""
    made, times = PlayParameters().bars(gap=0.0, speed=speed), TURN * 2 * pi / speed
    plain = simulate(made, times[-1], solver=Closure(Equal(4000)))  # samples that splines join to 1e-6
    values = {x: np.stack([plain.at(f"{link}.{x}", times) for link in LINKS], axis=1) for x in ("vx", "ax")}
    return {x: CubicSpline(times, np.concatenate([v[:-1], v[:1]]), bc_type="periodic") for x, v in values.items()}


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
        """Return the half width of the interval whose one end the truth passes with this chance, by Student's distribution."""
        return float(student.isf(level, self.freedom)) * self.error if self.error else 0.0


def mean(found: Ensemble, claim: Claim) -> Mean:
    """Return the mean of a claim's number over members and turns."""
    value, error = found.mean(claim.measure)[claim.column], found.error(claim.measure)[claim.column]
    return Mean(float(value), float(error), len(found.outcomes))


def ratio(flexible: Mean, rigid: Mean) -> Ratio:
    """Divide two means from independent runs; errors to first order."""
    parts = [each.error / each.value for each in (flexible, rigid)]
    value, error = flexible.value / rigid.value, hypot(*parts)
    spread = sum(part**4 / (each.n - 1) for part, each in zip(parts, (flexible, rigid), strict=True))
    return Ratio(value, value * error, error**4 / spread if spread else float(rigid.n - 1))
