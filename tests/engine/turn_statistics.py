"""Means over turns of the crank-rocker with clearance, by both solvers, and the chance of their difference."""

from typing import NamedTuple

import numpy as np
from scipy.stats import ttest_ind

from buckler.mbs.geometry import Array
from buckler.studies.rattling import turns
from buckler.studies.rattling.turns import by_turn, ensemble, period

QUANTITIES = {
    "peak_force_coupler_rocker": "N", "peak_force_rocker_frame": "N", "rms_ax_coupler": "m/s^2", "rms_ax_rocker": "m/s^2",
    "lost": "J",
}  # fmt: skip
"""Of each turn: largest force of two joints, rms x-acceleration of two bars, energy lost in contact and friction; with units."""


class Comparison(NamedTuple):
    """Each member's means over its turns, (members, 5) by `QUANTITIES`, of both solvers; largest energy balance on the engine."""

    engine: Array
    compiled: Array
    balance: float

    @property
    def error(self) -> Array:
        """Standard errors of the differences of the means, (5,)."""
        return np.asarray(np.sqrt(sum(each.var(axis=0, ddof=1) / len(each) for each in (self.engine, self.compiled))))

    @property
    def apart(self) -> Array:
        """Difference of the means in standard errors, (5,)."""
        return np.asarray((self.engine.mean(axis=0) - self.compiled.mean(axis=0)) / self.error)

    @property
    def chance(self) -> float:
        """Chance of a difference as large in any of the five if there is none: Welch's t-test, times five (Bonferroni)."""
        return min(1.0, 5 * float(ttest_ind(self.engine, self.compiled, equal_var=False).pvalue.min()))


def compare(usual, compiled, members, cycles):
    """Run the engine at its default tolerance, the compiled solver four times as often; each member has a start of its own."""
    runs = [turns.on_engine(turns.another(usual, seed), cycles, 1) for seed in range(members)]
    engine = np.stack([columns(by_turn(run, period(usual), 1 + cycles, 1)).mean(axis=0) for run in runs])
    found = ensemble(compiled, cycles, range(4 * members)).turns
    return Comparison(engine, columns(found).mean(axis=1), max(run.energy_balance for run in runs))


def columns(found):
    """`QUANTITIES` among the measures of turns, shape (..., 5)."""
    force, a = found["force"], found["rms_a"]
    return np.stack([force[..., 2], force[..., 3], a[..., 0], a[..., 1], found["lost"]], axis=-1)
