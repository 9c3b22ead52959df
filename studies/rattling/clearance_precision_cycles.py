"""Statistics of rattling joints on the engine against the compiled solver: many starts, means over turns, standard errors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import atan2
from typing import Any

import numpy as np
from scipy.stats import ttest_ind

from buckler.mbs import Controlled, Exudyn, Mechanism, Result, simulate
from buckler.mbs.library import CrankRocker
from buckler.studies.rattling.clearance import FORCES, START_OFFSET, STEPS_A_TURN, joint_force
from buckler.studies.rattling.turns import ensemble, period

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
        rows.append(by_turn(result, 1 + cycles, turn).mean(axis=0))
        balances.append(result.energy_balance)
    found = ensemble(compiled, cycles, range(4 * members)).turns
    parts = [found["force"][..., 2], found["force"][..., 3], found["rms_a"][..., 0], found["rms_a"][..., 1], found["lost"]]
    return Comparison(np.stack(rows), np.stack(parts, axis=-1).mean(axis=1), max(balances))


def another(made: Mechanism, seed: int) -> Mechanism:
    """The same, its crank offset at the start by chance."""
    offset = START_OFFSET * float(np.random.default_rng(seed).standard_normal())
    (ax, ay), (cx, _) = made.points["A"], made.points["C"]
    crank, coupler, rocker = (made.length(link) for link in ("crank", "coupler", "rocker"))
    places = CrankRocker(crank, coupler, rocker, cx).places(atan2(ay, ax) + offset)
    return replace(made, points=places)


def by_turn(result: Result, turns: int, period: float) -> Array:
    """Measures of each turn but the first, shape (turns - 1, 5), integrals over the engine's own steps."""
    time, s, edges = result.time, result.signals, period * np.arange(1, turns + 1)
    force = [joint_force(result, joint) for joint in FORCES]
    columns = [[part[(time > a) & (time <= b)].max() for a, b in pairwise(edges)] for part in force]
    for bar in ("coupler", "rocker"):
        squares = s[f"{bar}.ax"] ** 2
        summed = np.concatenate([[0.0], np.cumsum(np.diff(time) * (squares[1:] + squares[:-1]) / 2)])
        columns.append(np.sqrt(np.diff(np.interp(edges, time, summed)) / period))
    lost = result.energy["taken_contact"] + result.energy["taken_friction"]
    return np.stack([*columns, np.diff(np.interp(edges, time, lost))], axis=1)
