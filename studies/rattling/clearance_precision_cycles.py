"""Statistics of rattling joints on the engine against the compiled solver: many starts, means over turns, standard errors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import atan2
from typing import Any

import numpy as np
from scipy.stats import ttest_ind

from buckler.mbs import Controlled, Exudyn, Mechanism, simulate
from buckler.mbs.library import CrankRocker
from buckler.studies.rattling.clearance import START_OFFSET, STEPS_A_TURN
from buckler.studies.rattling.turns import by_turn, ensemble, period

Array = np.ndarray[Any, Any]
QUANTITIES = {
    "peak_force_coupler_rocker": "N", "peak_force_rocker_frame": "N", "rms_ax_coupler": "m/s^2", "rms_ax_rocker": "m/s^2",
    "lost": "J",
}  # fmt: skip
"""Of each turn: largest force of two joints, rms x-acceleration of two bars, energy lost in contact and friction; with units."""


@dataclass(frozen=True)
class Comparison:
    """Means over all turns and members, by the order of `QUANTITIES`.

    Attributes
    ----------
    engine, compiled : array, shape (members, 5)
        Each member's mean over its turns.
    balance : float
        Largest energy balance of a run on the engine.
    """

    engine: Array
    compiled: Array
    balance: float

    @property
    def apart(self) -> Array:
        """Difference of the means in standard errors of the difference, shape (5,)."""
        return np.asarray((self.engine.mean(axis=0) - self.compiled.mean(axis=0)) / self._error)

    @property
    def _error(self) -> Array:
        return np.sqrt(sum(each.var(axis=0, ddof=1) / len(each) for each in (self.engine, self.compiled)))

    @property
    def relative_error(self) -> Array:
        """Standard error of the difference over the compiled solver's mean, shape (5,)."""
        return np.asarray(self._error / self.compiled.mean(axis=0))

    @property
    def chance(self) -> float:
        """Chance of a difference as large in any of the five if there is none: Welch's t-test, times five (Bonferroni)."""
        return min(1.0, 5 * float(ttest_ind(self.engine, self.compiled, equal_var=False).pvalue.min()))


def compare(usual: Mechanism, compiled: Mechanism, members: int, cycles: int, progress: Callable[..., Any] = iter) -> Comparison:
    """Run the engine at its default tolerance, the compiled solver four times as often; each member has a start of its own."""
    rows, balances, turn = [], [], period(usual)
    steps = Exudyn(Controlled(max_step=turn / STEPS_A_TURN))
    for seed in progress(range(members)):
        result = simulate(another(usual, seed), (1 + cycles) * turn, solver=steps, ledger=True, timeout=300)
        if result.time[-1] < (1 + cycles) * turn * (1 - 1e-9):
            raise RuntimeError(f"seed {seed}: {result.status}, {result.message}")
        rows.append(columns(by_turn(result, turn, 1 + cycles, 1)).mean(axis=0))
        balances.append(result.energy_balance)
    found = ensemble(compiled, cycles, range(4 * members)).turns
    return Comparison(np.stack(rows), columns(found).mean(axis=1), max(balances))


def columns(found: Mapping[str, Array]) -> Array:
    """`QUANTITIES` among the measures of turns, shape (..., 5)."""
    force, a = found["force"], found["rms_a"]
    return np.stack([force[..., 2], force[..., 3], a[..., 0], a[..., 1], found["lost"]], axis=-1)


def another(made: Mechanism, seed: int) -> Mechanism:
    """The same, its crank offset at the start by chance."""
    offset = START_OFFSET * float(np.random.default_rng(seed).standard_normal())
    (ax, ay), (cx, _) = made.points["A"], made.points["C"]
    crank, coupler, rocker = (made.length(link) for link in ("crank", "coupler", "rocker"))
    places = CrankRocker(crank, coupler, rocker, cx).places(atan2(ay, ax) + offset)
    return replace(made, points=places)
