"""Integrals and largest values over the steps of an explicit run: work on contacts, in friction and of drives, squares of
accelerations.

Each step is looked at in five states at equal distances, on polynomials of fifth degree through places, rates and second rates at
both ends; forces there come from the equations of motion. Integrals are Boole's, of seventh order.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.record.lookup import hermite
from buckler.mbs.spectral.dense import Dense, at_times
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.recording import followed
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.tables import FRICTION, LENGTH, RATE, SLIP, VALUE

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

    def at(self, times: Array, columns: slice | Array = slice(None)) -> Array:
        """Some integrals at times: cubics through both ends of a step."""
        return hermite(self.time, self.work[:, columns], self.power[:, columns], times)[0]


def ledger(scene: Scene, out: Output, watched: Sequence[int]) -> Ledger:
    """Of a run of the explicit integrator."""
    parts, steps = len(SHARES) - 1, np.diff(out.time)
    between = out.time[:-1, None] + steps[:, None] * np.arange(parts) / parts
    seen = at_times(scene, out, np.append(between, out.time[-1]))
    everywhere, _ = followed(scene, Output(*seen[:5], np.tile(scene.memory(), (len(seen.time), 1, 1))))
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


def _lost(scene: Scene, seen: Dense) -> Array:
    """Power lost in the modes of all links, W, (times, 1)."""
    lost = np.zeros((len(seen.time), 1))
    for first, modes, at in scene.tables.modal:
        damping = scene.tables.data[at + 2 * modes + 2 * modes**2 :][:modes]
        lost[:, 0] += seen.v[:, first + 3 : first + 3 + modes] ** 2 @ damping
    return lost
