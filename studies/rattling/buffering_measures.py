"""What a paper says a flexible rocker does, as numbers of each turn of the crank, and the rule that decides each claim.

The paper shows x-velocities (Figs 5, 6), x-accelerations (7, 8) and x contact forces (9, 10) of one run and says that with
the flexible rocker they fluctuate less, peak lower and run smoother. One run of rattling joints is one draw of many, so each
claim is held against means over turns of many runs, rigid and flexible, with the standard error of their ratio.

**Rule.** r = flexible/rigid, s its standard error; q the Student quantile beyond which chance goes once in N/level cases, N
being the number of verdicts in the table (Bonferroni): the chance that any verdict of the whole table is wrong is below
`level`. "Buffers" means a reduction by at least `margin` of the rigid rocker's number.

- does not: r - q s > 1 - margin. A reduction worth the name is excluded; r may be above 1, or equal to 1 for all one can see.
- holds: r + q s < 1, and not the former.
- undecided: neither. More turns would decide it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import hypot, isnan, nan
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.stats import t as student

from buckler.mbs import Mechanism, Result, Revolute, simulate
from buckler.mbs.elements.element import Body
from buckler.mbs.geometry import Array
from buckler.mbs.laws import AdamsFriction
from buckler.mbs.library import CLOSED, RATTLING
from buckler.mbs.record.lookup import between
from buckler.mbs.spectral.ensembles import Member

from ..kit.parameters import choices, integer, quantities, quantity
from ..kit.report import Metric
from ..kit.statistics import Mean
from .assumptions import BODIES, JOINTS, Assumptions
from .bars import bars
from .turns import Ensemble, along, ensemble, gap, period, root_mean_squares

READINGS = {"N.s/m": RATTLING, "N.s/mm": CLOSED}
"""Contact laws by how the unit of the published c_max = 253 is read."""
TURN = np.linspace(0, 1, 2001)
"""Times, over that of a turn, 0.1 ms apart at 300 r/min: what `curves` measures is read off them."""
SPREAD = 0.1
"""Standard deviation of the journals' places at the start, in clearances."""
HOLDS, FAILS, UNDECIDED = "holds", "does not", "undecided"
VERDICTS = {HOLDS: 1.0, UNDECIDED: 0.0, FAILS: -1.0}
"""What a case can come to, and as the number in metrics.json."""
PLACES = {"coupler": 0, "rocker": 1, "rocker_middle": 2}
"""Centre of mass of the coupler, of the rocker, and the rocker's mid-point: its material point there."""
LINKS = ("coupler", "rocker", "rocker")
"""Whose ideal motion they are held against."""


class Claim(NamedTuple):
    """That a number is smaller with the flexible rocker: what it is called, where the ensemble has it, its unit."""

    family: str
    place: str
    text: str
    measure: str
    column: int
    unit: str

    @property
    def name(self) -> str:
        """As in metrics.json."""
        return f"{self.family}.{self.place}"


class ClaimCase(NamedTuple):
    """One reading of c_max, side in the plane and, where that varies, clearance, m."""

    unit: str
    depth: float
    gap: float = nan

    @property
    def name(self) -> str:
        """As in metrics.json."""
        return f"c_max[{self.unit}].h{1e3 * self.depth:g}mm" + ("" if isnan(self.gap) else f".c{1e6 * self.gap:g}um")


FAMILIES = {
    "velocity": ("velocity fluctuates less", "v_error", "m/s"),
    "acceleration": ("acceleration peaks are lower", "peak_a", "m/s^2"),
    "force": ("contact force peaks are lower", "force", "N"),
    "smooth_velocity": ("velocity curve is smoother", "a_error", "m/s^2"),
    "smooth_acceleration": ("acceleration curve is smoother", "travel_a", "m/s^2"),
}
"""What is claimed, and by what number of a turn it is judged, see `curves`; peaks are seen at every step."""
WHERE = {
    "coupler": "coupler", "rocker": "rocker, centre of mass", "rocker_middle": "rocker, mid-point",
    "coupler_rocker": "coupler–rocker", "rocker_frame": "rocker–frame",
}  # fmt: skip
COLUMNS = {family: {"coupler_rocker": 2, "rocker_frame": 3} if family == "force" else PLACES for family in FAMILIES}
"""What each is claimed of, and its column in the ensemble's array."""
CLAIMS = tuple(
    Claim(family, place, f"{text}: {WHERE[place]}", measure, column, unit)
    for family, (text, measure, unit) in FAMILIES.items()
    for place, column in COLUMNS[family].items()
)
"""Every row of the table."""


@dataclass(frozen=True)
class EnsembleParameters(Assumptions):
    """What the studies of many runs share."""

    in_plane_depth: tuple[float, ...] = quantities(
        (20e-3, 5e-3), "m", 5e-3, 20e-3, "sides of the 20 mm x 5 mm bars in the plane", "bars"
    )
    damping_unit: tuple[str, ...] = choices(
        tuple(READINGS), tuple(READINGS), "how the published unit of c_max = 253 is read", "contact"
    )
    pin: float = quantity(5e-3, "m", 1e-3, 1e-2, "radius of the pins", "joints")
    members: int = integer(8, 2, 10_000, "runs of each case; their scatter gives the standard error", "statistics")
    cycles: int = integer(4, 1, 10_000, "turns measured of each run", "statistics")
    settle: int = integer(2, 0, 10_000, "turns before that", "statistics")
    seed: int = integer(0, 0, 2**30, "first of the seeds of the runs' starts", "statistics")
    level: float = quantity(0.05, "1", 1e-9, 0.5, "chance that any verdict of the table is wrong", "statistics")
    margin: float = quantity(0.05, "1", 0, 0.5, "least reduction that counts as buffering", "statistics")
    tolerance: float = quantity(1e-8, "1", 1e-12, 1e-4, "of a step, of the longest bar and a radian", "numerics")
    workers: int = integer(2, 1, 64, "threads", "numerics")

    def bars(self, unit: str, depth: float, gap: float, rocker: Body | None = None) -> Mechanism:
        """Crank-rocker with clearance, in one reading of c_max, by its bars' side in the plane and clearance, m."""
        friction = AdamsFriction(0.3, 0.1, *self.thresholds)
        return bars(
            READINGS[unit], friction, gap, depth=depth, pin=self.pin, rocker=rocker, turned=self.turned, gravity=self.pull
        )

    def check(self) -> None:
        """One body carries each pin."""
        super().check()
        self.turned  # noqa: B018 - refuses a joint named twice

    def ensemble(self, mechanism: Mechanism, batch: int = 0) -> Ensemble:
        """Run all members; another batch has other seeds, so that its errors are its own."""
        first = self.seed + batch * self.members
        return ensemble(
            mechanism,
            self.cycles,
            range(first, first + self.members),
            settle=self.settle,
            spread=SPREAD * gap(mechanism),
            tolerance=self.tolerance,
            workers=self.workers,
            measure=curves(mechanism),
        )


def curves(mechanism: Mechanism) -> Callable[[Member, int, int], dict[str, Array]]:
    """Measures of the curves of each turn after the first `settle`, each of shape (turns - settle, 3) for the `PLACES`.

    `v_error` and `a_error`: root mean square over time of the x-velocity, m/s, and x-acceleration, m/s^2, less those of rigid
    bars in ideal joints: how much the velocity fluctuates, and how rough its curve is.
    `travel_a`: sum of |changes| of the x-acceleration from sample to sample, m/s^2: how far a pen goes up and down that draws
    the acceleration curve, so it grows with peaks and with their number. It depends on the samples, as a drawing does.
    """
    turn, plain = period(mechanism), ideal_turn(mechanism)
    wanted = {x: np.stack([plain.at(f"{link}.{x}", TURN * turn) for link in LINKS], axis=1) for x in ("vx", "ax")}

    def measure(member: Member, turns: int, settle: int = 0) -> dict[str, Array]:
        time, (v, a), edges = member.record.time, along(member.record), turn * np.arange(settle, turns + 1)

        def off(values: Array, x: str) -> Array:
            smooth = CubicSpline(TURN * turn, np.concatenate([wanted[x][:-1], wanted[x][:1]]), bc_type="periodic")
            return root_mean_squares(time, values - smooth(time % turn), edges)

        drawn = np.stack([between(time, a, None, (k + TURN) * turn) for k in range(settle, turns)])
        return {"v_error": off(v, "vx"), "a_error": off(a, "ax"), "travel_a": np.abs(np.diff(drawn, axis=1)).sum(axis=1)}

    return measure


def ideal_turn(mechanism: Mechanism) -> Result:
    """One turn of the same bars, all rigid, in ideal joints."""
    joints = [Revolute(point, *BODIES[point]) for point in JOINTS]
    links = [replace(link, body=mechanism.link("crank").body) for link in mechanism.links]
    made = Mechanism(mechanism.points, links, joints, drives=mechanism.drives, gravity=mechanism.gravity)
    return simulate(made, period(mechanism))


class Ratio(NamedTuple):
    """Of two means, with its standard error and the degrees of freedom of that (Welch and Satterthwaite)."""

    value: float
    error: float
    freedom: float

    @property
    def metric(self) -> Metric:
        """With its relative standard error."""
        return Metric(self.value, "1", error=self.error / self.value)

    def reach(self, level: float) -> float:
        """Half width of the interval whose one end the truth passes with this chance."""
        return float(student.isf(level, self.freedom)) * self.error

    def verdict(self, level: float, margin: float) -> str:
        """What this case comes to, by the rule above; level is that of one verdict."""
        reach = self.reach(level)
        if self.value - reach > 1 - margin:
            return FAILS
        return HOLDS if self.value + reach < 1 else UNDECIDED


def mean(found: Ensemble, claim: Claim) -> Mean:
    """Of a claim's number."""
    value, error = found.mean(claim.measure)[claim.column], found.error(claim.measure)[claim.column]
    return Mean(float(value), float(error), len(found.outcomes))


def numbers(name: str, found: Ensemble) -> dict[str, Metric]:
    """What the claims are about, of one rocker, each with its relative standard error; and the energy balance."""
    means = {f"{name}.{claim.name}": mean(found, claim).metric(claim.unit) for claim in CLAIMS}
    return means | {f"{name}.energy_balance": Metric(max(found.balances), "1")}


def ratio(flexible: Mean, rigid: Mean) -> Ratio:
    """Of two means from independent runs; errors to first order."""
    parts = [each.error / each.value for each in (flexible, rigid)]
    value, error = flexible.value / rigid.value, hypot(*parts)
    spread = sum(part**4 / (each.n - 1) for part, each in zip(parts, (flexible, rigid), strict=True))
    return Ratio(value, value * error, error**4 / spread if spread else float(rigid.n - 1))


def overall(verdicts: Sequence[str]) -> str:
    """What a claim comes to over all its cases."""
    holds, fails = HOLDS in verdicts, FAILS in verdicts
    if holds and fails:
        return "holds in part"
    if not holds and not fails:
        return UNDECIDED
    return ("holds" if holds else "does not hold") + (" where decided" if UNDECIDED in verdicts else "")


def trouble(name: str, found: Ensemble) -> list[str]:
    """Why a case is suspect, one line each."""
    return [f"{name}: {note}" for note in found.notes]
