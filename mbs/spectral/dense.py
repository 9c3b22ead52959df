"""Runs of the explicit integrator between their steps: states at any times, and what acts then."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.record.lookup import quintic
from buckler.mbs.spectral.explicit import flight_for, look
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.tables import BRISTLE

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


def at_times(scene: Scene, out: Output, times: Array) -> Dense:
    """States at times within a run: polynomials of fifth degree through places, rates and second rates at both ends of a step."""
    return _seen(scene, np.asarray(times, dtype=float), *_states(out, times))


def refined(scene: Scene, out: Output, between: int) -> Output:
    """The same run with so many states more in each step, at equal distances, but for steps of next to no length."""
    long = np.diff(out.time) > BARE * out.time[-1]
    parts = np.arange(1, between + 1) / (between + 1)
    inner = out.time[:-1][long, None] + np.diff(out.time)[long, None] * parts
    times = np.sort(np.concatenate([out.time, inner.ravel()]))
    q, v, memory = _states(out, times)
    found = _seen(scene, times, q, v, memory)
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


def right_hand_side(scene: Scene) -> Callable[[float, Array], Array]:
    """Rates of (q, v) as a function for other integrators; contacts know no onset speed but the slowest."""
    n, memory = scene.size, scene.memory()[None]

    def rates(t: float, y: Array) -> Array:
        seen = _seen(scene, np.array([t]), y[None, :n], y[None, n:], memory)
        return np.concatenate([y[n:], seen.a[0]])

    return rates


def _seen(scene: Scene, time: Array, q: Array, v: Array, memory: Array) -> Dense:
    n, r, k = scene.size, len(scene.tables.rows), len(scene.tables.forces)
    room = flight_for(scene, scene.q0, np.zeros(n), np.zeros(r), scene.memory())
    a, lam, speed, reports = (np.empty((len(time), *shape)) for shape in ((n,), (r,), (r,), (k, 8)))
    memory = np.ascontiguousarray(memory)
    look(scene.tables, scene.heavy_fronts, scene.work, room, time, q, v, memory, a, lam, speed, reports)
    return Dense(time, q, v, a, lam, speed, reports)
