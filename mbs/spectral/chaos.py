"""Largest Lyapunov exponents and Poincare sections of any mechanism on the compiled solver.

References
----------
G. Benettin, L. Galgani, J.-M. Strelcyn, Kolmogorov entropy and numerical experiments, Physical Review A 14 (1976) 2338-2345,
doi 10.1103/PhysRevA.14.2338.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.engine.settings import Controlled
from buckler.mbs.spectral.run import State, integrate
from buckler.mbs.spectral.scene import SLOWEST_ONSET, Scene
from buckler.mbs.spectral.solver import Spectral
from buckler.mbs.spectral.tables import FASTEST, ONSET
from buckler.mbs.validate import positive, whole

Array = np.ndarray[Any, Any]


class Exponent(NamedTuple):
    """A largest Lyapunov exponent and its standard error, 1/s, and the growth in each interval."""

    value: float
    error: float
    growth: Array


def last_state(scene: Scene, state: State, end: float, solver: Spectral) -> State:
    """The state at a later time.

    Raises
    ------
    RuntimeError
        If the run stops before.
    """
    out, failure, _ = integrate(scene, end, solver, state=state)
    if failure is not None:
        raise RuntimeError(f"{failure[0]}: {failure[1]}")
    memory = out.memory[-1].copy()
    memory[:, FASTEST] = np.maximum(memory[:, ONSET], SLOWEST_ONSET)
    return State(float(out.time[-1]), out.q[-1], out.v[-1], memory)


def lyapunov(
    mechanism: Any, interval: float, count: int, *, settle: int = 1, size: float = 1e-9, seed: int = 0,
    solver: Spectral | None = None,
) -> Exponent:  # fmt: skip
    """Largest Lyapunov exponent: let two motions part for an interval, draw the second back along the offset, repeat.

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
        Of the offset, in the longest link's length and rad.
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
    solver = solver or _fine()
    scene = Scene.of(mechanism, solver.degree)
    state = State(0.0, scene.q0, scene.v0, scene.memory())
    pace = max(1.0 / interval, float(np.abs(state.v / scene.units).max()))
    units = np.concatenate([scene.units, scene.units * pace])
    direction = np.random.default_rng(seed).standard_normal(2 * scene.size)
    growth = []
    for k in range(settle + count):
        shift = _allowed(scene, state, units * direction)
        shift *= size / np.linalg.norm(shift / units)
        n = scene.size
        other = state._replace(q=state.q + shift[:n], v=state.v + shift[n:])
        end = (k + 1) * interval
        state, other = last_state(scene, state, end, solver), last_state(scene, other, end, solver)
        apart = np.concatenate([other.q - state.q, other.v - state.v]) / units
        grown = float(np.linalg.norm(apart))
        if not 0.0 < grown < 1e-2:
            raise RuntimeError(f"interval {k}: the offset of {size:g} became {grown:g}; take shorter intervals, or another size")
        direction = apart / grown
        if k >= settle:
            growth.append(np.log(grown / size) / interval)
    found = np.array(growth)
    error = float(found.std(ddof=1) / np.sqrt(count)) if count > 1 else float("nan")
    return Exponent(float(found.mean()), error, found)


def poincare(
    mechanism: Any, interval: float, count: int, *, settle: int = 0, solver: Spectral | None = None
) -> tuple[Array, Array]:
    """Coordinates and rates at equal intervals of time (a turn of the drive): each (count, n), after `settle` intervals.

    Raises
    ------
    RuntimeError
        If a run stops before its time.
    """
    positive("interval", interval, "s"), whole("count", count, 1, 10_000_000), whole("settle", settle, 0, 10_000_000)
    solver = solver or Spectral()
    scene = Scene.of(mechanism, solver.degree)
    state, q, v = State(0.0, scene.q0, scene.v0, scene.memory()), [], []
    for k in range(settle + count):
        state = last_state(scene, state, (k + 1) * interval, solver)
        if k >= settle:
            q.append(state.q)
            v.append(state.v)
    return np.array(q), np.array(v)


def _fine() -> Spectral:
    return Spectral(Controlled(tolerance=1e-11))


def _allowed(scene: Scene, state: State, shift: Array) -> Array:
    """The part of a change of (q, v) that constraints allow, to first order."""
    rows = scene.assemble(state.q, state.v, state.time, tangents=False).jacobian
    if not len(rows):
        return shift
    back = np.linalg.pinv(rows, rcond=1e-10)
    q, v = np.split(shift, 2)
    return np.concatenate([q - back @ (rows @ q), v - back @ (rows @ v)])
