"""Largest Lyapunov exponents of any mechanism on the compiled solver.

References
----------
G. Benettin, L. Galgani, J.-M. Strelcyn, Kolmogorov entropy and numerical experiments, Physical Review A 14 (1976) 2338-2345,
doi 10.1103/PhysRevA.14.2338.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..solvers import Controlled, Spectral
from ..validate import positive, whole
from .run import State, integrate, memory_at_end
from .scene import Scene
from .start import allowed
from .start import begin as settled
from .tables import TURN

T = TypeVar("T")


class Exponent(NamedTuple):
    """A largest Lyapunov exponent and its standard error, 1/s, and the growth in each interval."""

    value: float
    error: float
    growth: Array


def last_state(scene: Scene, state: State, end: float, solver: Spectral) -> State:
    """Compute the state at a later time.

    Raises
    ------
    RuntimeError
        If the run stops before.
    """
    out, failure, _ = integrate(scene, end, solver, state=state)
    if failure is not None:
        raise RuntimeError(f"{failure[0]}: {failure[1]}")
    return State(float(out.time[-1]), out.q[-1], out.v[-1], memory_at_end(out), scene.work.state[:, TURN].copy())


def lyapunov(
    mechanism: Mechanism, interval: float, count: int, *, settle: int = 1, size: float = 1e-9, seed: int = 0,
    solver: Spectral | None = None,
) -> Exponent:  # fmt: skip
    """Compute the largest Lyapunov exponent by Benettin's method.

    Two motions part for an interval; the second is drawn back along their offset to its first size; and so on.

    Parameters
    ----------
    mechanism : Mechanism
    interval : float
        s; a whole turn of the drive where there is one, as the rate depends on its angle.
    count : int
        Intervals in the mean.
    settle : int
        Intervals before, in which the offset finds its direction.
    size : float
        Of the offset, root of the sum of squares of its components in units of the longest link's length and 1 rad, rates times
        the fastest rate at the start. The units decide single intervals, not the mean of many.
    seed : int
        Draws the first direction.
    solver : Spectral, optional
        Its tolerance is well below the size of the offset: 1e-11 by default.

    Raises
    ------
    RuntimeError
        If a run stops before its time, or the offset grows to nothing or beyond the linear range.
    """
    positive("interval", interval, "s"), whole("count", count, 1, 10_000_000), whole("settle", settle, 0, 10_000_000)
    solver = solver or Spectral(Controlled(tolerance=1e-11))
    scene = Scene.of(mechanism, solver.degree)
    state = State(0.0, *settled(scene), scene.memory())
    pace = max(1.0 / interval, float(np.abs(state.v / scene.units).max()))
    units = np.concatenate([scene.units, scene.units * pace])
    n = scene.size

    def flow(state: State, k: int) -> State:
        return last_state(scene, state, (k + 1) * interval, solver)

    def moved(state: State, shift: Array) -> State:
        return state._replace(q=state.q + shift[:n], v=state.v + shift[n:])

    found = stretching(
        flow, state, settle + count, offset=size, scale=1 / units, seed=seed, read=lambda s: np.concatenate([s.q, s.v]),
        moved=moved, allowed=lambda state, shift: allowed(
            scene.assemble(state.q, state.v, state.time, tangents=False).jacobian, *np.split(shift, 2)
        ),
    )  # fmt: skip
    grown = size * np.exp(found)
    if grown.max() > 1e-2:
        k = int(grown.argmax())
        text = f"interval {k}: the offset of {size:g} became {grown[k]:g}; take shorter intervals, or another size"
        raise RuntimeError(text)
    rates = found[settle:] / interval
    error = float(rates.std(ddof=1) / np.sqrt(count)) if count > 1 else float("nan")
    return Exponent(float(rates.mean()), error, rates)


def stretching(
    flow: Callable[[T, int], T], state: T, steps: int, *, offset: float, scale: Array | float = 1.0, seed: int = 0,
    read: Callable[[T], Array] = np.asarray, moved: Callable[[T, Array], T] = np.add,  # type: ignore[assignment]
    allowed: Callable[[T, Array], Array] = lambda _, shift: shift,
) -> Array:  # fmt: skip
    """Compute the logarithm of a small offset's growth in each step, the offset drawn back to its size after each.

    The first few steps turn the offset into the direction of fastest growth: leave them out of a mean.

    Parameters
    ----------
    flow : callable
        `flow(state, k)` is the state after step k = 0, 1, ... of one that was `state` before it.
    state : anything
        `read(state)` are its numbers, shape (n,); `moved(state, shift)` is the state that a shift of these makes of it.
    steps : int
    offset : float
        Size of the offset, root of the sum of squares of its scaled components; large against the errors of `flow`, small
        against whatever bends it.
    scale : float or array, shape (n,)
        Each component is multiplied by it to compare like with like. It decides single steps, not the mean of many.
    seed : int
        Draws the first direction.
    allowed : callable
        (state, shift) -> the part of a shift that is allowed.

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
    apart, growth = np.random.default_rng(seed).standard_normal(len(read(state))), np.empty(steps)
    for k in range(steps):
        shift = allowed(state, apart / scale)
        shift = shift * (offset / np.linalg.norm(scale * shift))
        other, state = flow(moved(state, shift), k), flow(state, k)
        apart = scale * (read(other) - read(state))
        size = float(np.linalg.norm(apart))
        if not 0.0 < size < np.inf:
            raise ArithmeticError(f"step {k}: the offset of {offset:g} became {size:g}; a larger one, or shorter steps")
        growth[k] = np.log(size / offset)
    return growth
