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

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import hypot
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import t as student

from buckler.mbs import Status
from buckler.mbs.laws import AdamsFriction
from buckler.mbs.library import CLOSED, RATTLING
from buckler.studies.kit.parameters import choices, integer, quantities, quantity
from buckler.studies.kit.published import BAR_AREA
from buckler.studies.rattling.assumptions import Assumptions
from buckler.studies.rattling.cycles import Ensemble, ensemble
from buckler.studies.rattling.linkage import FourBar
from buckler.studies.rattling.turns import Run

Array = np.ndarray[Any, Any]
READINGS = {"N.s/m": RATTLING, "N.s/mm": CLOSED}
"""Contact laws by how the unit of the published c_max = 253 is read."""
SAMPLES = 2000
"""Of a turn, 0.1 ms apart at 300 r/min; what `curves` measures is read off them."""
SPREAD = 0.1
"""Standard deviation of the journals' places at the start, in clearances."""
BALANCED = 1e-3
"""Energy balance beyond which a run is suspect."""
HOLDS, FAILS, UNDECIDED = "holds", "does not", "undecided"
VERDICTS = {HOLDS: 1.0, UNDECIDED: 0.0, FAILS: -1.0}
"""What a case can come to, and as the number in metrics.json."""
PLACES = {"coupler": 0, "rocker": 1, "rocker_middle": 2}
"""Centre of mass of the coupler, of the rocker, and the rocker's mid-point: its material point there."""


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

    def fourbar(self, unit: str, depth: float, gap: float, modes: Any = None) -> FourBar:
        """Crank-rocker with clearance, in one reading of c_max, by its bars' side in the plane and clearance, m."""
        return FourBar(
            law=READINGS[unit], thickness=depth, width=BAR_AREA / depth, gap=gap, modes=modes, pin=self.pin, gravity=self.pull,
            friction=AdamsFriction(0.3, 0.1, *self.thresholds), turned=self.turned,
        )  # fmt: skip

    def check(self) -> None:
        """One body carries each pin."""
        self.turned  # noqa: B018 - refuses a joint named twice

    def ensemble(self, fourbar: FourBar, batch: int = 0) -> Ensemble:
        """Run all members; another batch has other seeds, so that its errors are its own."""
        first = self.seed + batch * self.members
        return ensemble(
            fourbar,
            self.cycles,
            range(first, first + self.members),
            settle=self.settle,
            spread=SPREAD * max(fourbar.gaps),
            tolerance=self.tolerance,
            samples=SAMPLES,
            workers=self.workers,
            measure=curves,
        )


# --- what is measured -------------------------------------------------------------------------------------------------


def velocities(run: Run) -> Array:
    """x-velocities of the `PLACES`, m/s, shape (samples, 3)."""
    middle = run.q_t[:, 5].copy()
    if run.fourbar.modes is not None:
        shape = run.fourbar.modes.planar(run.fourbar.rocker).shapes[2, :2].T
        moved, flow = run.q[:, 8:] @ shape, run.q_t[:, 8:] @ shape
        c, s = np.cos(run.q[:, 7]), np.sin(run.q[:, 7])
        middle += c * flow[:, 0] - s * flow[:, 1] - run.q_t[:, 7] * (s * moved[:, 0] + c * moved[:, 1])
    return np.stack([run.q_t[:, 2], run.q_t[:, 5], middle], axis=1)


def curves(run: Run, turns: int, settle: int = 0) -> dict[str, Array]:
    """Measures of the curves of each turn after the first `settle`, each of shape (turns - settle, 3) for the `PLACES`.

    Returns
    -------
    v_error : array
        Root mean square over time of the x-velocity less that of ideal joints, m/s.
    a_error : array
        The same of the x-acceleration, m/s^2: how rough the velocity curve is. The square of the acceleration was integrated
        along with the motion; its product with the smooth one of ideal joints is summed over changes of velocity.
    travel_a : array
        Sum of |changes| of the x-acceleration from sample to sample, m/s^2: how far a pen goes up and down that draws the
        acceleration curve, so it grows with peaks and with their number. It depends on the samples, as a drawing does.
    """
    ideal, places = run.fourbar.ideal(run.time), [1, 2, 2]
    v, a = velocities(run), np.stack([run.coupler_a[:, 0], run.rocker_a[:, 0], run.middle_a[:, 0]], axis=1)
    wanted, rush = ideal.velocity[:, places, 0], ideal.acceleration[:, places, 0]
    jumps, between = np.diff(v, axis=0), (rush[1:] + rush[:-1]) / 2
    samples = (len(run.time) - 1) // turns
    found: dict[str, list[Array]] = {"v_error": [], "a_error": [], "travel_a": []}
    for begin, end in pairwise(np.arange(settle, turns + 1) * samples):
        span, turn, after = run.time[end] - run.time[begin], slice(begin, end), slice(begin + 1, end + 1)
        square = (run.squares[end] - run.squares[begin] - 2 * (jumps[turn] * between[turn]).sum(axis=0)) / span
        found["v_error"].append(np.sqrt(((v - wanted)[after] ** 2).mean(axis=0)))
        found["a_error"].append(np.sqrt(np.maximum(square + (rush[after] ** 2).mean(axis=0), 0)))
        found["travel_a"].append(np.abs(np.diff(a[begin : end + 1], axis=0)).sum(axis=0))
    return {name: np.array(values) for name, values in found.items()}


# --- how it is judged -------------------------------------------------------------------------------------------------


class Mean(NamedTuple):
    """Of a number over members and turns, with its standard error and the number of members."""

    value: float
    error: float
    members: int


class Ratio(NamedTuple):
    """Of two means, with its standard error and the degrees of freedom of that (Welch and Satterthwaite)."""

    value: float
    error: float
    freedom: float

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


def ratio(flexible: Mean, rigid: Mean) -> Ratio:
    """Of two means from independent runs; errors to first order."""
    parts = [each.error / each.value for each in (flexible, rigid)]
    value, error = flexible.value / rigid.value, hypot(*parts)
    spread = sum(part**4 / (each.members - 1) for part, each in zip(parts, (flexible, rigid), strict=True))
    return Ratio(value, value * error, error**4 / spread if spread else float(rigid.members - 1))


def overall(verdicts: Sequence[str]) -> str:
    """What a claim comes to over all its cases."""
    holds, fails = HOLDS in verdicts, FAILS in verdicts
    if holds and fails:
        return "holds in part"
    if not holds and not fails:
        return UNDECIDED
    return ("holds" if holds else "does not hold") + (" where decided" if UNDECIDED in verdicts else "")


def trouble(name: str, found: Ensemble) -> list[str]:
    """Why a case is suspect, one line each: the energy balance of a member, or a pin deeper in its bush than the clearance."""
    lines = []
    if not max(found.balances) <= BALANCED:
        lines.append(f"{name}: ENERGY, balance {max(found.balances):.1e}, more than {BALANCED:g}")
    if not found.ok:
        deep, gap = found.cycles["depth"].max(), max(found.fourbar.gaps)
        many = sum(outcome is not Status.OK for outcome in found.outcomes)
        runs = f"{many} of {len(found.outcomes)} runs"
        lines.append(f"{name}: PENETRATION, {deep:.2g} m with {gap:.2g} m of clearance, in {runs}: no law holds there")
    return lines
