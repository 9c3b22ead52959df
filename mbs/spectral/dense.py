"""States of a run between the steps of an integrator, and what acts then.

Places and rates are those of polynomials of fifth degree through places, rates and second rates at both ends of a step; second
rates and forces there come from the equations of motion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..record.lookup import quintic
from .explicit import look
from .output import DormandPrince, Output
from .scene import CompiledScene
from .start import dormand_prince_state
from .tables import BRISTLE

BARE = 1e-9
"""Length of a step, over the time of the run, below which rates between its ends drown in the rounding of its places."""


class Dense(NamedTuple):
    """States and what acts then.

    Attributes
    ----------
    time : array, shape (times,)
    q, v, a : arrays, shape (times, n)
    lam, speed : array, shape (times, r)
        Multipliers, and speeds of constraints that move.
    reports : array, shape (times, forces, 8)
        See `buckler.mbs.spectral.tables.Work`.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    lam: Array
    speed: Array
    reports: Array


def at_times(scene: CompiledScene, out: Output, times: Array) -> Dense:
    """States at times within a run: polynomials of fifth degree through places, rates and second rates at both ends of a step."""
    return _look_at(scene, np.asarray(times, dtype=float), *_states(out, times))


def refine_times(scene: CompiledScene, out: Output, between: int) -> Output:
    """The same run with so many states more in each step, at equal distances, but for steps of next to no length."""
    long = np.diff(out.time) > BARE * out.time[-1]
    parts = np.arange(1, between + 1) / (between + 1)
    inner = out.time[:-1][long, None] + np.diff(out.time)[long, None] * parts
    times = np.sort(np.concatenate([out.time, inner.ravel()]))
    q, v, memory = _states(out, times)
    found = _look_at(scene, times, q, v, memory)
    return Output(times, q, v, found.a, found.lam, memory)


def _states(out: Output, times: Array) -> tuple[Array, Array, Array]:
    """Places, rates and memories at times."""
    step = np.clip(np.searchsorted(out.time, times, side="right") - 1, 0, max(0, len(out.time) - 2))
    nxt = np.minimum(step + 1, len(out.time) - 1)
    h = out.time[nxt] - out.time[step]
    x = np.divide(times - out.time[step], h, out=np.zeros_like(h), where=h > 0)
    memory = out.memory[step].copy()
    memory[:, :, BRISTLE] += x[:, None] * (out.memory[nxt, :, BRISTLE] - memory[:, :, BRISTLE])
    places, way = quintic([(out.q[i], out.v[i], out.a[i]) for i in (step, nxt)], h[:, None], x[:, None])
    with np.errstate(divide="ignore", invalid="ignore"):
        return places, np.where(h[:, None] > 0, way / h[:, None], out.v[step]), memory


def _look_at(scene: CompiledScene, time: Array, q: Array, v: Array, memory: Array) -> Dense:
    n, r, k = scene.size, len(scene.tables.rows), len(scene.tables.forces)
    flight = dormand_prince_state(scene, scene.q0, np.zeros(n), np.zeros(r), scene.memory())
    a, lam, speed, reports = (np.empty((len(time), *shape)) for shape in ((n,), (r,), (r,), (k, 8)))
    time, q, v, memory = map(np.ascontiguousarray, (time, q, v, memory))
    out = Output(time, q, v, a, lam, memory)
    look(DormandPrince(scene.tables, scene.heavy_fronts, scene.work, flight), out, speed, reports)
    return Dense(time, q, v, a, lam, speed, reports)
