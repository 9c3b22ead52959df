"""How motions of the crank-rocker part that began almost alike: rates over the turn, and the largest Lyapunov exponent.

In a mechanism the rate depends on the crank's angle far more than on anything else, so means are taken over whole turns.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import nan
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Status
from buckler.mbs.spectral.chaos import lyapunov
from buckler.mbs.validate import whole
from buckler.studies.rattling.linkage import FourBar
from buckler.studies.rattling.turns import Model, Run, ideal_state, simulate, solver

Array = np.ndarray[Any, Any]
SPREAD = 1e-9
"""Standard deviation of a seed's offset at the start, m and rad: the same start for all errors, another motion soon."""


class Exponent(NamedTuple):
    """A largest Lyapunov exponent and its standard error, both 1/s."""

    value: float
    error: float


def turn_growth(
    fourbar: FourBar, state: Array, turns: int, seed: int, *, steps: int = 100, offset: float = 1e-9, tolerance: float = 1e-11
) -> Array:
    """Growth of a small offset of the four-bar in each part of each turn, from the angle `fourbar.start` on.

    Sizes are in m: angles count by their bar's half length, velocities by the crank's turn through 1/30 rad. The first turn
    is also that in which the offset finds its direction.

    Parameters
    ----------
    fourbar : FourBar
    state : array, shape (2 n,)
        Where it begins, see `settled`.
    turns : int
    seed : int
        Draws the first direction.
    steps : int
        Parts of a turn.
    offset : float
        m. It should not grow to the size of the clearance within a step.
    tolerance : float
        See `simulate`.

    Returns
    -------
    array, shape (turns, steps)
        ln(size after the part / offset).

    Raises
    ------
    ValueError
        If the crank stands still.
    RuntimeError
        If a run stops before its time.
    """
    whole("turns", turns, 1, 1_000_000), whole("steps", steps, 1, 1_000_000)
    if not fourbar.speed:
        raise ValueError("speed = 0 rad/s: turns need a crank that turns")
    model, interval = Model.of(fourbar), fourbar.period / steps
    lengths = np.ones(2 * model.scene.size)
    lengths[[*model.columns, *(model.columns + model.scene.size)]] = 1 / _scale(fourbar, len(model.columns))
    found = lyapunov(
        model.scene.mechanism, interval, steps * turns, settle=0, size=offset, seed=seed, solver=solver(fourbar, tolerance),
        state=model.state(state), lengths=lengths,
    )  # fmt: skip
    return (found.growth * interval).reshape(turns, steps)


def separation(fourbar: FourBar, state: Array, offset: float, seed: int, *, steps: int = 100) -> Array:
    """Size in m of an actual offset, never drawn back, after each part of one turn; shape (steps + 1,).

    Both motions at a tolerance of 1e-14, so that offsets from 1e-12 m on are seen. The first direction is that of `turn_growth`
    for this seed.
    """
    model, scale = Model.of(fourbar), _scale(fourbar, state.size // 2)
    drawn = np.random.default_rng(seed).standard_normal(2 * model.scene.size)
    direction = drawn[[*model.columns, *(model.columns + model.scene.size)]]
    other = state + offset * direction / np.linalg.norm(direction) / scale
    runs = [simulate(fourbar, fourbar.period, samples=steps + 1, state=start, tolerance=1e-14) for start in (state, other)]
    here, there = (np.hstack([run.q, run.q_t]) for run in runs)
    return np.asarray(np.linalg.norm(scale * (there - here), axis=1))


def turn_by_turn(fourbar: FourBar, state: Array, turns: int, tolerance: float) -> Iterator[Run]:
    """Runs of one turn each, one after the other.

    Raises
    ------
    RuntimeError
        If one stops before its time.
    """
    for _ in range(turns):
        run = simulate(fourbar, fourbar.period, samples=2, state=state, tolerance=tolerance)
        if run.status not in (Status.OK, Status.SUSPECT):
            raise RuntimeError(f"{run.status}: {run.message}")
        yield run
        state = last(run)


def last(run: Run) -> Array:
    """Coordinates and velocities at a run's end, angles as at its start's turn, shape (2 n,)."""
    return np.concatenate([run.q[-1], run.q_t[-1]])


def settled(fourbar: FourBar, turns: int, seed: int) -> Array:
    """State after some turns, from the ideal mechanism's offset by 1e-9 m and rad as the seed draws it; shape (2 n,)."""
    state = ideal_state(fourbar)
    state[: state.size // 2] += SPREAD * np.random.default_rng(seed).standard_normal(state.size // 2)
    for run in turn_by_turn(fourbar, state, turns, 1e-8):
        state = last(run)
    return state


def exponent(growth: Array, period: float) -> Exponent:
    """Exponent from growth, shape (..., turns, steps), of turns that last `period`, s; the error of one turn is nan.

    Turns are taken for independent: where joints rattle, nothing is left after one of how it began.
    """
    rates = np.asarray(growth).sum(axis=-1).ravel() / period
    error = float(rates.std(ddof=1) / np.sqrt(rates.size)) if rates.size > 1 else nan
    return Exponent(float(rates.mean()), error)


def _scale(fourbar: FourBar, coordinates: int) -> Array:
    """What makes lengths of the components of a state; shape (2 n,)."""
    lengths = np.ones(coordinates)
    lengths[[4, 7]] = fourbar.coupler / 2, fourbar.rocker / 2
    return np.concatenate([lengths, lengths / (30 * abs(fourbar.speed))])
