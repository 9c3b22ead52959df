"""Statistics of the crank-rocker with clearance: many runs from almost the same start, cycle by cycle.

Motion with rattling joints is chaotic: an offset of 1e-12 m grows to 1e-4 m within some 40 ms. Single trajectories then mean
nothing beyond that; means over cycles do, with their standard errors. Where joints stay closed the members agree, and the
standard error is small for that reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from buckler.mbs import Status
from buckler.mbs.validate import positive, whole
from buckler.studies.rattling.linkage import FourBar
from buckler.studies.rattling.turns import Run, ideal_state, simulate

Array = np.ndarray[Any, Any]
UNITS = {
    "impacts": "1", "closed": "1", "restitution": "1", "force": "N", "depth": "m", "peak_a": "m/s^2", "rms_a": "m/s^2",
    "contact": "J", "friction": "J", "modes": "J", "given": "J",
}  # fmt: skip
"""What is measured in each cycle; see `Ensemble`."""
RIGID = 8
"""Coordinates that are not modal."""


@dataclass(frozen=True)
class Ensemble:
    """Cycles of all members.

    Attributes
    ----------
    cycles : dict of str to array, shape (members, cycles, ...)
        `impacts` of each joint, the part of the time it is `closed`, its rebound over its onset speed, root mean square
        (`restitution`; nan without a rebound; not the law's, other joints strike in between), its largest `force` and
        penetration `depth`; largest and root-mean-square x-acceleration of coupler centre, rocker centre, rocker
        mid-point (`peak_a`, `rms_a`); energy lost in the `contact` and `friction` of each joint, in the rocker's `modes`,
        and `given` by the drive; then what `measure` of `ensemble` gave.
    outcomes : tuple of Status
        Of each member.
    balances : tuple of float
        Energy balance of each member, see `Run`.
    """

    fourbar: FourBar
    cycles: dict[str, Array]
    outcomes: tuple[Status, ...]
    balances: tuple[float, ...] = ()

    @property
    def ok(self) -> bool:
        """True if all members ended well."""
        return all(outcome is Status.OK for outcome in self.outcomes)

    def mean(self, name: str) -> Array:
        """Mean over members and cycles."""
        return _mean(self.cycles[name].reshape(-1, *self.cycles[name].shape[2:]))

    def error(self, name: str) -> Array:
        """Standard error of the mean: from the members' means, which are independent; of one member, from its cycles."""
        values = self.cycles[name]
        draws = np.stack([_mean(member) for member in values]) if len(values) > 1 else values[0]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(np.sqrt(_mean((draws - _mean(draws)) ** 2) / (np.isfinite(draws).sum(axis=0) - 1)))


def ensemble(
    fourbar: FourBar,
    cycles: int,
    seeds: Iterable[int],
    *,
    spread: float = 1e-9,
    settle: int = 1,
    tolerance: float = 1e-8,
    samples: int = 200,
    workers: int = 1,
    measure: Callable[[Run, int, int], dict[str, Array]] | None = None,
) -> Ensemble:
    """Run the four-bar once for each seed.

    Parameters
    ----------
    fourbar : FourBar
    cycles : int
        Turns of the crank to measure, after `settle` turns that are discarded.
    seeds : iterable of int
        One a member, for the offset of its initial state.
    spread : float
        Standard deviation of that offset, m and rad: of the bars' centres and directions. It must leave pins in their bushes.
    settle : int
        Turns discarded.
    tolerance : float
        See `simulate`.
    samples : int
        Of a turn; they matter for no result but those of `measure`: peaks and integrals are followed at every step.
    workers : int
        Threads; the compiled run does not hold the interpreter's lock.
    measure : callable, optional
        Further measures of a run, called and giving back as `by_cycle`.

    Raises
    ------
    RuntimeError
        If a member stops before its time.
    """
    whole("cycles", cycles, 1, 1_000_000), whole("settle", settle, 0, 1_000_000), whole("samples", samples, 1, 1_000_000)
    whole("workers", workers, 1, 1024), positive("spread", spread, "m")
    if not (seeds := tuple(seeds)):
        raise ValueError("seeds = (): must be one number or more, one for each member")
    if not fourbar.speed:
        raise ValueError("speed = 0 rad/s: cycles need a crank that turns")

    def member(seed: int) -> tuple[dict[str, Array], Status, float]:
        state = ideal_state(fourbar)
        state[:RIGID] += spread * np.random.default_rng(seed).standard_normal(RIGID)
        turns = settle + cycles
        run = simulate(fourbar, turns * fourbar.period, tolerance=tolerance, samples=samples * turns + 1, state=state)
        if len(run.time) <= samples * turns:
            raise RuntimeError(f"seed {seed}: {run.status}, {run.message}")
        more = measure(run, turns, settle) if measure else {}
        return by_cycle(run, turns, settle) | more, run.status, run.energy_balance

    with ThreadPoolExecutor(workers) as pool:
        measured, outcomes, balances = zip(*pool.map(member, seeds), strict=True)
    cycles_of = {name: np.stack([each[name] for each in measured]) for name in measured[0]}
    return Ensemble(fourbar, cycles_of, outcomes, balances)


def by_cycle(run: Run, turns: int, settle: int = 0) -> dict[str, Array]:
    """Measures of each turn after the first `settle`, arrays of shape (turns - settle, ...); samples must fit the turns."""
    samples = (len(run.time) - 1) // turns
    marks = np.arange(settle, turns + 1) * samples
    edges = run.time[marks]

    def change(integral: Array) -> Array:
        return np.diff(integral[marks], axis=0)

    def largest(peaks: Array) -> Array:
        return np.stack([peaks[a + 1 : b + 1].max(axis=0) for a, b in pairwise(marks)])

    return _impacts(run, edges) | {
        "force": largest(run.peak_force),
        "depth": largest(run.peak_depth),
        "peak_a": largest(run.peak_a),
        "rms_a": np.sqrt(change(run.squares) / np.diff(edges)[:, None]),
        "contact": change(run.taken_contact),
        "friction": change(run.taken_friction),
        "modes": change(run.taken_modes),
        "given": change(run.given),
    }


def _impacts(run: Run, edges: Array) -> dict[str, Array]:
    """Number of onsets, part of the time closed, and rebound over onset speed, each of shape (cycles, 4)."""
    joint, start, speed, end, rebound = run.impacts[:, :5].T
    end = np.where(np.isnan(end), run.time[-1], end)
    found = {name: np.full((len(edges) - 1, 4), np.nan) for name in ("impacts", "closed", "restitution")}
    for i, (a, b) in enumerate(pairwise(edges)):
        for j in range(4):
            mine, begun = joint == j, (joint == j) & (a <= start) & (start < b)
            over = begun & np.isfinite(rebound)
            found["impacts"][i, j] = begun.sum()
            found["closed"][i, j] = np.clip(np.minimum(end[mine], b) - np.maximum(start[mine], a), 0, None).sum() / (b - a)
            if over.any():
                found["restitution"][i, j] = np.sqrt((rebound[over] ** 2).sum() / (speed[over] ** 2).sum())
    return found


def _mean(values: Array) -> Array:
    """Mean over the first axis of what is finite; nan where nothing is."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.nansum(values, axis=0) / np.isfinite(values).sum(axis=0))
