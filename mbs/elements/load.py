"""Base of loads: bodies they push, functions of their user, laws along a coordinate."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..functions import Argument, Called, kinks
from ..functions.breaks import evaluate, search
from ..geometry import Array
from .element import GROUND, Element, Push, Recorded, place
from .signal import Energy

Law = Callable[[float, float], float]
PIECES = 400
"""Pieces over which the force of a spring's law is integrated."""
SIDE = 1e-9
"""Time before and after a sample at which a step evaluates a function, relative to the run."""


class Load(Element):
    """A kind of load."""

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield what it does to each body, the ground left out."""
        raise NotImplementedError

    def power(self, name: str, record: Recorded) -> Array:
        """Power it gives to the bodies, W, (times,)."""
        return sum((push.power(record) for push in self.pushes(name, record)), np.zeros_like(record.time))


class Given(Load):
    """A load whose value is given: constant, or a function of time first of all."""

    value: Any

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Times in a run at which it jumps, has a kink or changes quickly."""
        return kinks(self.value, duration)

    def push(self, name: str, record: Recorded, times: Array) -> Push:
        """Return its push on its body, at times that may lie a little before or after the samples, s."""
        raise NotImplementedError

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield it."""
        yield self.push(name, record, record.time)

    def work_of(self, name: str, record: Recorded) -> Array:
        """Compute the work, J, each step with the power inside it where a function jumps."""
        power, last = self.push(name, record, record.time).power(record), float(record.time[-1])
        if not self.kinks(last):
            return record.work(power)
        beside = (np.clip(record.time + side, 0.0, last) for side in (-SIDE * last, SIDE * last))
        before, after = (self.push(name, record, times).power(record) for times in beside)
        return record.work(power, (before, after))


def on_both(ends: Sequence[str], force: Array, torque: Array) -> Iterator[Push]:
    """Yield a force and a torque on the first of two point references and their opposites on the other, the ground left out."""
    for at, sign in zip(ends, (1.0, -1.0), strict=True):
        if place(at).body != GROUND:
            yield Push(at, sign * force, sign * torque)


def sample(function: Callable[..., object], *columns: Array) -> Array:
    """Evaluate a user's function at many arguments, (times,) or (times, 2); nan where it raises."""
    found: list[Any] = []
    for arguments in zip(*(column.tolist() for column in columns), strict=True):
        try:
            found.append(np.asarray(function(*arguments), dtype=float))
        except Exception:
            found.append(np.array(np.nan))
    shape = max((value.shape for value in found), key=len)
    return np.array([np.broadcast_to(value, shape) for value in found])


def potential(law: Law, values: Array) -> Array:
    """Work of a law's force at rest, from 0 to each value, J: Gauss quadrature over the range the values span, between edges."""
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    if not high > low:
        return np.zeros_like(values)
    edges = low + np.array(search(lambda way: evaluate(law, low + way, np.zeros_like(way)), high - low).times)
    grid = np.unique(np.concatenate([np.linspace(low, high, PIECES + 1), [0.0], edges, np.nextafter(edges, np.inf)]))
    nodes, weights = np.polynomial.legendre.leggauss(4)
    half = np.diff(grid)[:, None] / 2
    at = grid[:-1, None] + half + half * nodes
    force = sample(law, at.ravel(), np.zeros(at.size)).reshape(at.shape)
    work = np.concatenate([[0.0], np.cumsum((force * weights * half).sum(axis=1))])
    k = np.clip(np.searchsorted(grid, values, side="right") - 1, 0, len(grid) - 2)
    rest = (values - grid[k])[:, None] / 2
    within = grid[k][:, None] + rest + rest * nodes
    tail = (sample(law, within.ravel(), np.zeros(within.size)).reshape(within.shape) * weights * rest).sum(axis=1)
    total: Array = work[k] + tail - work[np.searchsorted(grid, 0.0)]
    return total


class Elastic(Load):
    """A force along a coordinate, of a spring with a damper or of a law: 'force' of (value less free value, rate)."""

    stiffness: float
    damping: float
    law: Law | None

    def state(self, record: Recorded) -> tuple[Array, Array]:
        """Value of the coordinate less its free value, and its rate, each (times,)."""
        raise NotImplementedError

    def tension(self, value: Array, rate: Array) -> Array:
        """Force, N, or torque, N m, that pulls the value back, (times,)."""
        if self.law is None:
            return self.stiffness * value + self.damping * rate
        return sample(self.law, value, rate)

    def stored_energy(self, value: Array) -> Array:
        """Compute the stored energy, J, (times,)."""
        return 0.5 * self.stiffness * value**2 if self.law is None else potential(self.law, value)

    def lost(self, value: Array, rate: Array) -> Array:
        """Power that damping takes, W, (times,)."""
        if self.law is None:
            return self.damping * rate**2
        return (sample(self.law, value, rate) - sample(self.law, value, np.zeros_like(rate))) * rate

    def user_functions(self, name: str, record: Recorded) -> Iterator[Called]:
        """Yield its law as a function of time, value and rate."""
        law = self.law
        if law is not None:
            value, rate = self.state(record)
            yield (lambda _t, x, v: law(x, v)), (Argument(value, rate), Argument(rate))

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield what it stores, and what damping took."""
        value, rate = self.state(record)
        yield Energy("held", "spring", self.stored_energy(value))
        yield Energy("taken", "damping", record.work(self.lost(value, rate)))
