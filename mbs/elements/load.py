"""What loads have in common: bodies they push, functions of their user, laws along a coordinate."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import hypot
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.elements.element import (
    GROUND,
    Array,
    Element,
    Parts,
    Recorded,
    holder,
    known,
    place,
    reaches,
    takes_moments,
)

Law = Callable[[float, float], float]
PIECES = 400
"""Pieces over which the force of a spring's law is integrated."""
SIDE = 1e-9
"""Of a run: how long before and after a sample a step sees a function."""


class Push(NamedTuple):
    """What a load does to a body at a point reference: a force, N, (times, 2), and a torque, N m, (times,)."""

    at: str
    force: Array
    torque: Array


class Load(Element):
    """A kind of load."""

    def pushes(self, name: str, record: Recorded) -> Iterator[Push]:
        """Yield what it does to each body, the ground left out."""
        raise NotImplementedError

    def power(self, name: str, record: Recorded) -> Array:
        """Power it gives to the bodies, W, (times,)."""
        return sum((given(push, record) for push in self.pushes(name, record)), np.zeros_like(record.time))


def given(push: Push, record: Recorded) -> Array:
    """Power that a push gives to its body, W, (times,)."""
    return np.asarray((push.force * record.point(push.at)[1]).sum(axis=1) + push.torque * record.turn(push.at)[1])


def worked(record: Recorded, push: Callable[[Array], Push], kinks: Sequence[float]) -> Array:
    """Work, J, of a push that is a function of time: a step sees no jump at its ends, so that each has the power inside.

    Parameters
    ----------
    record : Recorded
    push : callable
        What it is, the times of the samples given, s.
    kinks : sequence of float
        Times, s, at which it may jump.
    """
    power, last = given(push(record.time), record), float(record.time[-1])
    if not len(kinks):
        return record.work(power)
    before, after = (given(push(np.clip(record.time + side, 0.0, last)), record) for side in (-SIDE * last, SIDE * last))
    return record.work(power, (before, after))


def moment_of_loads(record: Recorded, link: str) -> Array:
    """Moment of all loads on a link about its centre of mass, N m, (times,)."""
    total, centre = np.zeros_like(record.time), record.links[link].centre()[0]
    for name, load in record.mechanism.elements().items():
        if not isinstance(load, Load):
            continue
        for push in load.pushes(name, record):
            if place(push.at).body == link:
                arm = record.point(push.at)[0] - centre
                total = total + arm[:, 0] * push.force[:, 1] - arm[:, 1] * push.force[:, 0] + push.torque
    return total


def held_at(mechanism: Parts, at: str) -> str:
    """The reference 'body:point' of what holds a point reference; see `holder`."""
    return f"{holder(mechanism, at)}:{place(at).point}"


def turning(mechanism: Parts, at: str, near: str | None = None) -> str:
    """The reference 'link:point' of what turns: 'crank' is that link at the point `near` if it has it, or else at its start."""
    if ":" in at:
        return at
    if at == GROUND:
        return f"{GROUND}:{GROUND}"
    link = mechanism.link(at)
    return f"{at}:{near if near in link.points else link.start}"


def check_turning(mechanism: Parts, at: str, where: str) -> None:
    """Raise a ValueError if a reference, 'crank' or 'beam:B', is not to a link that turns."""
    body, colon, point = at.partition(":")
    known("link", body, {link.name for link in mechanism.links}, where)
    if colon:
        reaches(mechanism, body, point, where)
    takes_moments(mechanism, (body,), where)


def sampled(function: Callable[..., Any], *columns: Array) -> Array:
    """Values of a user's function at many arguments, (times,) or (times, 2); nan where it raises."""
    found: list[Any] = []
    for arguments in zip(*(column.tolist() for column in columns), strict=True):
        try:
            found.append(np.asarray(function(*arguments), dtype=float))
        except Exception:
            found.append(np.array(np.nan))
    shape = max((value.shape for value in found), key=len)
    return np.array([np.broadcast_to(value, shape) for value in found])


def potential(law: Law, values: Array) -> Array:
    """Work of a law's force at rest, from 0 to each value, J: Gauss quadrature over the range the values span."""
    low, high = min(0.0, float(values.min())), max(0.0, float(values.max()))
    if not high > low:
        return np.zeros_like(values)
    grid = np.unique(np.concatenate([np.linspace(low, high, PIECES + 1), [0.0]]))
    nodes, weights = np.polynomial.legendre.leggauss(4)
    half = np.diff(grid)[:, None] / 2
    at = grid[:-1, None] + half + half * nodes
    force = sampled(law, at.ravel(), np.zeros(at.size)).reshape(at.shape)
    work = np.concatenate([[0.0], np.cumsum((force * weights * half).sum(axis=1))])
    k = np.clip(np.searchsorted(grid, values, side="right") - 1, 0, len(grid) - 2)
    rest = (values - grid[k])[:, None] / 2
    within = grid[k][:, None] + rest + rest * nodes
    tail = (sampled(law, within.ravel(), np.zeros(within.size)).reshape(within.shape) * weights * rest).sum(axis=1)
    total: Array = work[k] + tail - work[np.searchsorted(grid, 0.0)]
    return total


class Elastic:
    """A force along a coordinate, of a spring with a damper or of a law: 'force' of (value less free value, rate)."""

    stiffness: float
    damping: float
    law: Law | None

    def tension(self, value: Array, rate: Array) -> Array:
        """Force, N, or torque, N m, that pulls the value back, (times,)."""
        if self.law is None:
            return self.stiffness * value + self.damping * rate
        return sampled(self.law, value, rate)

    def stored(self, value: Array) -> Array:
        """Energy, J, (times,)."""
        if self.law is None:
            return 0.5 * self.stiffness * value**2
        return potential(self.law, value)

    def lost(self, value: Array, rate: Array) -> Array:
        """Power that damping takes, W, (times,)."""
        if self.law is None:
            return self.damping * rate**2
        return (sampled(self.law, value, rate) - sampled(self.law, value, np.zeros_like(rate))) * rate


def unit(vectors: Array) -> tuple[Array, Array]:
    """Lengths (times,) and directions (times, 2) of vectors; the direction of one without length is zero."""
    size = np.hypot(*vectors.T)
    return size, vectors / np.where(size > 0, size, 1.0)[:, None]


def distance(mechanism: Parts, a: str, b: str) -> float:
    """Distance of two point references at t = 0, m."""
    (x0, y0), (x1, y1) = (mechanism.points[place(at).point] for at in (a, b))
    return hypot(x1 - x0, y1 - y0)
