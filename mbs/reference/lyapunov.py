"""Largest Lyapunov exponent by two trajectories: let them part for a while, draw the second back along the offset, repeat.

The mean rate at which they part is the exponent. In a mechanism the rate depends on the crank's angle far more than on
anything else, so means are taken over whole turns.

References
----------
G. Benettin, L. Galgani, J.-M. Strelcyn, Kolmogorov entropy and numerical experiments, Physical Review A 14 (1976)
2338-2345, doi 10.1103/PhysRevA.14.2338.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf, nan
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.laws import HysteresisLaw
from buckler.mbs.reference.fourbar import FourBar
from buckler.mbs.reference.run import Outcome, Run, ideal_state, simulate
from buckler.mbs.validate import positive, whole

Array = np.ndarray[Any, Any]
FAILED = (Outcome.STEP_UNDERFLOW, Outcome.NOT_FINITE, Outcome.TOO_MANY_STEPS)
SPREAD = 1e-9
"""Standard deviation of a seed's offset at the start, m and rad: the same start for all errors, another motion soon."""


class Exponent(NamedTuple):
    """A largest Lyapunov exponent and its standard error, both 1/s."""

    value: float
    error: float


def stretching(
    flow: Callable[[Array, int], Array], state: Array, steps: int, *, offset: float, scale: Array | float = 1.0, seed: int = 0
) -> Array:
    """Logarithm of how much a small offset grows in each step, the offset drawn back to its size after each.

    The first few steps turn the offset into the direction of fastest growth: leave them out of a mean.

    Parameters
    ----------
    flow : callable
        `flow(state, k)` is the state after step k = 0, 1, ... of one that was `state` before it.
    state : array, shape (n,)
    steps : int
    offset : float
        Size of the offset, root of the sum of squares of its scaled components; large against the errors of `flow`, small
        against whatever bends it.
    scale : float or array, shape (n,)
        Each component is multiplied by it to compare like with like. It decides single steps, not the mean of many.
    seed : int
        Draws the first direction.

    Returns
    -------
    array, shape (steps,)
        ln(size after the step / offset).

    Raises
    ------
    ArithmeticError
        If the two become the same, or not finite.
    """
    positive("offset", offset, "1"), whole("steps", steps, 1, 10_000_000)
    direction, growth = _direction(state, seed), np.empty(steps)
    for k in range(steps):
        other = flow(state + offset * direction / scale, k)
        state = flow(state, k)
        apart = scale * (other - state)
        size = float(np.linalg.norm(apart))
        if not 0.0 < size < inf:
            raise ArithmeticError(f"step {k}: the offset of {offset:g} became {size:g}; a larger one, or shorter steps")
        growth[k], direction = np.log(size / offset), apart / size
    return growth


def turn_growth(
    fourbar: FourBar, state: Array, turns: int, seed: int, *, steps: int = 100, offset: float = 1e-9, rtol: float = 1e-10
) -> Array:
    """Growth of a small offset of the four-bar in each part of each turn, from the angle `fourbar.start` on.

    Sizes are in m: angles count by their bar's half length, velocities by the crank's turn through 1/30 rad. The first turn
    is also that in which the offset finds its direction.

    Parameters
    ----------
    fourbar : FourBar
        Its law must not remember the onset of a contact, which a restart in the middle of one would lose.
    state : array, shape (2 n,)
        Where it begins, see `settled`.
    turns : int
    seed : int
        Draws the first direction.
    steps : int
        Parts of a turn.
    offset : float
        m; see `stretching`. It should not grow to the size of the clearance within a step.
    rtol : float
        See `simulate`; the absolute tolerance is a hundredth of it.

    Returns
    -------
    array, shape (turns, steps)

    Raises
    ------
    ValueError
        If the law remembers the onset, or the crank stands still.
    RuntimeError
        If a run stops before its time.
    """
    whole("turns", turns, 1, 1_000_000), whole("steps", steps, 1, 1_000_000)
    if isinstance(fourbar.law, HysteresisLaw):
        raise ValueError(f"{type(fourbar.law).__name__}: remembers the onset of a contact, which a restart loses; use Impact")
    if not fourbar.speed:
        raise ValueError("speed = 0 rad/s: turns need a crank that turns")
    interval = fourbar.period / steps

    def flow(state: Array, k: int) -> Array:
        turned = replace(fourbar, start=fourbar.start + fourbar.speed * interval * (k % steps))
        return _last(_run(turned, interval, 2, state, rtol))

    growth = stretching(flow, state, steps * turns, offset=offset, scale=_scale(fourbar), seed=seed)
    return growth.reshape(turns, steps)


def separation(fourbar: FourBar, state: Array, offset: float, seed: int, *, steps: int = 100) -> Array:
    """Size in m of an actual offset, never drawn back, after each part of one turn; shape (steps + 1,).

    Both motions at a tolerance of 1e-12, so that offsets from 1e-12 m on are seen. Arguments as in `turn_growth`, whose
    first direction for this seed is the same.
    """
    scale, duration = _scale(fourbar), fourbar.period
    other = state + offset * _direction(state, seed) / scale
    runs = [_run(fourbar, duration, steps + 1, start, 1e-12) for start in (state, other)]
    here, there = (np.hstack([run.q, run.q_t]) for run in runs)
    return np.asarray(np.linalg.norm(scale * (there - here), axis=1))


def settled(fourbar: FourBar, turns: int, seed: int) -> Array:
    """State after some turns, from the ideal mechanism's offset by 1e-9 m and rad as the seed draws it; shape (2 n,)."""
    state = ideal_state(fourbar)
    state[: state.size // 2] += SPREAD * np.random.default_rng(seed).standard_normal(state.size // 2)
    return _last(_run(fourbar, turns * fourbar.period, 2, state, 1e-7, 1e-7)) if turns else state


def exponent(growth: Array, period: float) -> Exponent:
    """Exponent from growth, shape (..., turns, steps), of turns that last `period`, s; the error of one turn is nan.

    Turns are taken for independent: where joints rattle, nothing is left after one of how it began.
    """
    rates = np.asarray(growth).sum(axis=-1).ravel() / period
    error = float(rates.std(ddof=1) / np.sqrt(rates.size)) if rates.size > 1 else nan
    return Exponent(float(rates.mean()), error)


def _direction(state: Array, seed: int) -> Array:
    direction = np.random.default_rng(seed).standard_normal(np.shape(state))
    return np.asarray(direction / np.linalg.norm(direction))


def _run(fourbar: FourBar, duration: float, samples: int, state: Array, rtol: float, atol: float | None = None) -> Run:
    run = simulate(fourbar, duration, samples=samples, state=state, rtol=rtol, atol=0.01 * rtol if atol is None else atol)
    if run.status in FAILED:
        raise RuntimeError(f"{run.status}: {run.message}")
    return run


def _last(run: Run) -> Array:
    return np.concatenate([run.q[-1], run.q_t[-1]])


def _scale(fourbar: FourBar) -> Array:
    """What makes lengths of the components of a state; shape (2 n,)."""
    modes = 0 if fourbar.modes is None else len(fourbar.modes)
    lengths = np.array([1, 1, 1, 1, fourbar.coupler / 2, 1, 1, fourbar.rocker / 2, *np.ones(modes)])
    return np.concatenate([lengths, lengths / (30 * abs(fourbar.speed))])
