"""Runs of the explicit integrator between their steps: states at any times, what acts then, and integrals over the steps.

Work on contacts, in friction and of drives, and squares of accelerations: each step is looked at in five states at equal
distances, on polynomials of fifth degree through places, rates and second rates at both ends; forces there come from the
equations of motion. Integrals are Boole's, of seventh order.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..record.lookup import hermite, quintic
from .explicit import look
from .integrators import DormandPrince, dormand_prince_state
from .output import Output
from .recording import follow_markers
from .scene import CompiledScene
from .tables import BRISTLE, FRICTION, LENGTH, RATE, SLIP, VALUE

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


def right_hand_side(scene: CompiledScene) -> Callable[[float, Array], Array]:
    """Rates of (q, v) as a function for other integrators; contacts know no onset speed but the slowest."""
    n, memory = scene.size, scene.memory()[None]

    def rates(t: float, y: Array) -> Array:
        """Return the rates of the state: speeds and accelerations."""
        seen = _look_at(scene, np.array([t]), y[None, :n], y[None, n:], memory)
        return np.concatenate([y[n:], seen.a[0]])

    return rates


def _look_at(scene: CompiledScene, time: Array, q: Array, v: Array, memory: Array) -> Dense:
    n, r, k = scene.size, len(scene.tables.rows), len(scene.tables.forces)
    flight = dormand_prince_state(scene, scene.q0, np.zeros(n), np.zeros(r), scene.memory())
    a, lam, speed, reports = (np.empty((len(time), *shape)) for shape in ((n,), (r,), (r,), (k, 8)))
    time, q, v, memory = map(np.ascontiguousarray, (time, q, v, memory))
    out = Output(time, q, v, a, lam, memory)
    look(DormandPrince(scene.tables, scene.heavy_fronts, scene.work, flight), out, speed, reports)
    return Dense(time, q, v, a, lam, speed, reports)


SHARES = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0
"""Boole's rule."""


class Ledger(NamedTuple):
    """Energies at the ends of a run's steps, the start first; n forces, r constraints, m watched markers.

    Attributes
    ----------
    time : array, shape (steps + 1,)
    reports : array, shape (steps + 1, n, 8)
        Of forces at the ends of steps; see `buckler.mbs.spectral.tables.Work`.
    power, work : array, shape (steps + 1, 2 n + r + 2 m + 1)
        Power and its integral since the start: on the contact of each force, in its friction; of each constraint's motion;
        squares of each marker's accelerations x, y; lost in modes.
    top : array, shape (steps + 1, 2 n + 2 m)
        Largest since the step's start: size of each force and its depth, size of each marker's accelerations x, y.
    """

    time: Array
    reports: Array
    power: Array
    work: Array
    top: Array

    def at(self, times: Array, columns: slice | Array = slice(None)) -> Array:
        """Some integrals at times: cubics through both ends of a step."""
        return hermite(self.time, self.work[:, columns], self.power[:, columns], times)[0]


def ledger(scene: CompiledScene, out: Output, watched: Sequence[int]) -> Ledger:
    """Compute the ledger of a run of the explicit integrator."""
    parts, steps = len(SHARES) - 1, np.diff(out.time)
    between = out.time[:-1, None] + steps[:, None] * np.arange(parts) / parts
    seen = at_times(scene, out, np.append(between, out.time[-1]))
    everywhere, _ = follow_markers(scene, Output(*seen[:5], np.tile(scene.memory(), (len(seen.time), 1, 1))))
    rush = everywhere[:, np.array(watched, dtype=int), 6:8].reshape(len(seen.time), -1)
    push, drag, depth = (seen.reports[:, :, column] for column in (VALUE, FRICTION, LENGTH))
    given = np.where(scene.tables.rows[:, 1] >= 0, -seen.lam * seen.speed, 0.0)
    power = np.hstack([push * seen.reports[:, :, RATE], drag * seen.reports[:, :, SLIP], given, rush**2, _lost(scene, seen)])
    sizes = np.maximum(0.0, np.hstack([np.hypot(push, drag), depth, np.abs(rush)]))
    step = parts * np.arange(len(steps))[:, None] + np.arange(parts + 1)
    work = np.cumsum(steps[:, None] * np.einsum("p,spc->sc", SHARES, power[step]), axis=0)
    first = np.zeros((1, power.shape[1]))
    return Ledger(
        out.time, seen.reports[::parts], power[::parts], np.vstack([first, work]), np.vstack([sizes[:1], sizes[step].max(axis=1)])
    )


def _lost(scene: CompiledScene, seen: Dense) -> Array:
    """Power lost in the modes of all links, W, (times, 1)."""
    lost = np.zeros((len(seen.time), 1))
    for first, modes, at in scene.tables.modal:
        damping = scene.tables.data[at + 2 * modes + 2 * modes**2 :][:modes]
        lost[:, 0] += seen.v[:, first + 3 : first + 3 + modes] ** 2 @ damping
    return lost
