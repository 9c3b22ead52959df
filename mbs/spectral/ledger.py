"""Integrals and largest values over the steps of an explicit run: work on contacts, in friction and of drives, squares of
accelerations.

Each step is looked at in five states at equal distances, on polynomials of fifth degree through places, rates and second rates at
both ends; forces there come from the equations of motion. Integrals are Boole's, of seventh order.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.spectral.compiling import aside, copy, inner, jit, lend
from buckler.mbs.spectral.explicit import flight_for, rates_at
from buckler.mbs.spectral.lawtable import motion
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.tables import AX, AY, BRISTLE, COUNT, FIRST, FRICTION, LENGTH, ONSET, RATE, SLIP, VALUE

Array = np.ndarray[Any, Any]
SHARES = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0
"""Boole's rule."""


class Ledger(NamedTuple):
    """Of the steps of a run, the start first; n forces, r constraints, m watched markers.

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

    def at(self, times: Array, columns: Any = slice(None)) -> Array:
        """Some integrals at times: cubics through both ends of a step."""
        i = np.clip(np.searchsorted(self.time, times, side="right") - 1, 0, len(self.time) - 2)
        h = (self.time[i + 1] - self.time[i])[:, None]
        x = (times - self.time[i])[:, None] / h
        first, last = self.work[i][:, columns], self.work[i + 1][:, columns]
        go, arrive = h * self.power[i][:, columns], h * self.power[i + 1][:, columns]
        bend, twist = 3 * (last - first) - 2 * go - arrive, 2 * (first - last) + go + arrive
        return np.asarray(first + x * (go + x * (bend + x * twist)))


def ledger(scene: Scene, out: Output, watched: list[int]) -> Ledger:
    """Of a run of the explicit integrator."""
    n, r, k, m = scene.size, len(scene.tables.rows), len(scene.tables.forces), len(watched)
    room = flight_for(scene, scene.q0, np.zeros(n), np.zeros(r), scene.memory())
    rows, columns = len(out.time), 2 * k + r + 2 * m + 1
    made = Ledger(
        out.time, np.zeros((rows, k, 8)), np.zeros((rows, columns)), np.zeros((rows, columns)), np.zeros((rows, 2 * k + 2 * m))
    )
    account(scene.tables, scene.heavy_fronts, scene.work, room, out, np.array(watched, dtype=np.int64), *made[1:])
    return made


@inner
def _state(out, i, x, part, memory):
    """Set x.trial to the state a part into step i, bristles by the line between its ends."""
    n, h = x.force.size, out.time[i + 1] - out.time[i]
    for c in range(n):
        q, v, a = out.q[i, c], h * out.v[i, c], 0.5 * h * h * out.a[i, c]
        place, rate, bend = out.q[i + 1, c] - q - v - a, h * out.v[i + 1, c] - v - 2.0 * a, h * h * out.a[i + 1, c] - 2.0 * a
        c3, c4 = 10.0 * place - 4.0 * rate + 0.5 * bend, -15.0 * place + 7.0 * rate - bend
        c5 = 6.0 * place - 3.0 * rate + 0.5 * bend
        x.trial[c] = q + part * (v + part * (a + part * (c3 + part * (c4 + part * c5))))
        x.trial[n + c] = (v + part * (2.0 * a + part * (3.0 * c3 + part * (4.0 * c4 + part * 5.0 * c5)))) / h
    for k in range(memory.shape[1]):
        x.memory[k, ONSET] = memory[i, k, ONSET]
        x.trial[2 * n + k] = memory[i, k, BRISTLE] + part * (memory[i + 1, k, BRISTLE] - memory[i, k, BRISTLE])


@inner
def _read(s, e, w, x, t, markers, power, top):
    """Powers at the state in x.trial, and raise what is largest."""
    n, r, count, m = x.force.size, x.lam.size, s.forces.shape[0], markers.size
    rates_at(s, e, w, x, t, x.trial, x.rates[1])
    for k in range(count):
        f = w.reports[k]
        power[k], power[count + k] = f[VALUE] * f[RATE], f[FRICTION] * f[SLIP]
        top[k], top[count + k] = (
            max(top[k], np.sqrt(f[VALUE] * f[VALUE] + f[FRICTION] * f[FRICTION])),
            max(top[count + k], f[LENGTH]),
        )
    for k in range(r):
        power[2 * count + k] = -x.lam[k] * motion(s, s.rows[k, 1], t)[1] if s.rows[k, 1] >= 0 else 0.0
    for k in range(m):
        marker = markers[k]
        first, at = s.markers[marker, FIRST], 2 * count + r + 2 * k
        ax, ay = w.state[marker, AX], w.state[marker, AY]
        for j in range(first, first + s.markers[marker, COUNT]):
            ax += w.slope[0, j] * x.rates[1, n + s.places[j]]
            ay += w.slope[1, j] * x.rates[1, n + s.places[j]]
        power[at], power[at + 1], at = ax * ax, ay * ay, 2 * count + 2 * k
        top[at], top[at + 1] = max(top[at], abs(ax)), max(top[at + 1], abs(ay))
    lost = 0.0
    for row in range(s.modal.shape[0]):
        o, size, d = s.modal[row, 0], s.modal[row, 1], s.modal[row, 2]
        for i in range(size):
            rate = x.trial[n + o + 3 + i]
            lost += s.data[d + 2 * size + 2 * size * size + i] * rate * rate
    power[2 * count + r + 2 * m] = lost


@jit
def account(s, e, w, x, out, markers, reports, power, work, top):
    """Fill the ledger's arrays; top begins with zeros."""
    _account(lend(s), lend(e), lend(w), lend(x), lend(out), markers, reports, power, work, top)


@aside
def _account(s, e, w, x, out, markers, reports, power, work, top):
    n, now, memory = x.force.size, np.zeros(power.shape[1]), out.memory
    for i in range(out.time.size):
        if i > 0:
            h = out.time[i] - out.time[i - 1]
            for c in range(now.size):
                work[i, c] = work[i - 1, c] + h * SHARES[0] * power[i - 1, c]
            for c in range(top.shape[1]):
                top[i, c] = 0.0
            for p in range(1, 4):
                _state(out, i - 1, x, 0.25 * p, memory)
                _read(s, e, w, x, out.time[i - 1] + 0.25 * p * h, markers, now, top[i])
                for c in range(now.size):
                    work[i, c] += h * SHARES[p] * now[c]
        for k in range(memory.shape[1]):
            x.memory[k, ONSET] = memory[i, k, ONSET]
            x.trial[2 * n + k] = memory[i, k, BRISTLE]
        for c in range(n):
            x.trial[c], x.trial[n + c] = out.q[i, c], out.v[i, c]
        _read(s, e, w, x, out.time[i], markers, power[i], top[i])
        copy(w.reports, reports[i])
        if i > 0:
            for c in range(now.size):
                work[i, c] += h * SHARES[4] * power[i, c]
