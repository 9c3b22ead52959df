"""Self-check of driven linkages: do rigid links in ideal joints move as loop closure says?

It says so of all recorded times at once, from places alone: J q_t = -C_t, J q_tt = gamma (see `mbs.kinematics.closure`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.elements.element import GROUND
from buckler.mbs.kinematics.closure import Closure, determined
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.record import Record

Array = np.ndarray[Any, Any]
SINGULAR = 1e-3
"""Determinant of the constraints, relative to its largest, below which a linkage is at a dead centre."""
CLOSURE = 0.035
"""Error of a speed or an acceleration, relative to the largest of the run, beyond which a run is suspect."""
JUMP, SETTLED = 0.2, 20
"""A drive's acceleration that changes by this share of its largest within a step has jumped; so many steps later that is over."""


def closures(record: Record) -> Iterator[str]:
    """Yield what a driven linkage does that it cannot, in words; nothing where constraints alone do not decide its motion.

    The determinant of the constraints keeps its sign: it is zero at a dead centre only, where the motion is not determined, and
    beyond which lies the other way of assembling the linkage.
    """
    mechanism = record.mechanism
    if not determined(mechanism):
        return
    jacobian, pulls = linkage(mechanism, record.time, _places(record))
    size = np.linalg.det(jacobian)
    reached = size * np.sign(size[0])
    low = ~(reached > SINGULAR * np.abs(size).max())
    if low.any():
        k = int(np.argmax(low))
        yield f"BRANCH: at t = {record.time[k]:.4g} s the linkage meets a dead centre: what follows is not determined"
        return
    speed = np.linalg.solve(jacobian, pulls.speed[..., None])[..., 0]
    acceleration = np.linalg.solve(jacobian, pulls.acceleration(speed)[..., None])[..., 0]
    steady = ~_after_jumps(pulls.driven)
    for what, found, right in (
        ("speed", _turning(record, "q_t"), speed),
        ("acceleration", _turning(record, "q_tt"), acceleration),
    ):
        off, scale = _apart(mechanism, found, right, speed)
        off[~steady] = 0.0
        if off.max() > CLOSURE * scale:
            k = int(np.argmax(off))
            share = f"{off[k] / scale:.2g} of the largest in the run"
            yield f"CLOSURE: at t = {record.time[k]:.4g} s loop closure gives another {what}, by {share}: lower max_step"


def _apart(mechanism: Mechanism, found: Array, right: Array, speed: Array) -> tuple[Array, float]:
    """Distance of the turning found from the right one, times length, shape (times,), and its scale.

    That is the largest there is of all links' starts and turns; of accelerations, of those towards the centre of a turn and of
    speed^2 over length too.
    """
    lengths = np.array([mechanism.length(link.name) for link in mechanism.links])
    off = (np.abs(found - right[:, 2::3]) * lengths).max(axis=1)

    def largest(rates: Array) -> float:
        return float(np.abs(np.stack([rates[:, 0::3], rates[:, 1::3], rates[:, 2::3] * lengths])).max())

    if right is speed:
        return off, largest(right)
    around = float((speed[:, 2::3] ** 2 * lengths).max())
    return off, max(largest(right), around, largest(speed) ** 2 / float(lengths.max()))


def _turning(record: Record, rate: str) -> Array:
    """Rates of all links' angles, shape (times, links)."""
    return np.column_stack([getattr(record.links[link.name], rate)[:, 2] for link in record.mechanism.links])


def _after_jumps(driven: Array) -> Array:
    """True for samples about and shortly after a jump of the drive's acceleration, which no integrator follows at once."""
    change = np.abs(np.diff(driven.sum(axis=1)))
    jumps = np.flatnonzero(change > JUMP * np.abs(driven).max())
    after = np.zeros(len(driven), dtype=bool)
    after[:SETTLED] = np.any(driven[0])  # the engine does not know it until the first step is over
    for k in jumps:
        after[max(0, k - 1) : k + SETTLED] = True
    return after


class Pulls(NamedTuple):
    """Right-hand sides of loop closure, shape (times, rows): of the speeds, and what makes that of the accelerations.

    Attributes
    ----------
    speed : array
        -C_t: the drive's speed in its row.
    driven : array
        The drive's acceleration in its row.
    bends : array, shape (times, rows, links)
        Times omega^2 of each link, summed over links: the convective part of gamma.
    """

    speed: Array
    driven: Array
    bends: Array

    def acceleration(self, speed: Array) -> Array:
        """Of the accelerations, once the speeds (times, 3 links) are known."""
        return self.driven + np.einsum("trl,tl->tr", self.bends, speed[:, 2::3] ** 2)


def linkage(mechanism: Mechanism, time: Array, places: Array) -> tuple[Array, Pulls]:
    """Jacobian of joints, guides and drive at many places, and what it is to be solved for.

    Parameters
    ----------
    time : array, shape (times,)
        s.
    places : array, shape (times, links, 3)
        x, y of the links' starts, m, and their directions, rad.

    Returns
    -------
    jacobian : array, shape (times, rows, 3 links)
    pulls : Pulls
    """
    closure, count = Closure(mechanism), places.shape[1]
    (drive,) = mechanism.drives
    rows = closure.rows()
    turns = drive.target in closure.index
    size = len(rows) + turns
    jacobian, bends = np.zeros((len(time), size, 3 * count)), np.zeros((len(time), size, count))
    at = size - 1
    for k, (ends, direction, kind) in enumerate(rows):
        at = k if kind else at
        for link, point, sign in ends:
            if link == GROUND:
                continue
            i = closure.index[link]
            arm = _arms(closure, link, point, places[:, i, 2])
            jacobian[:, k, 3 * i : 3 * i + 2] += sign * direction
            jacobian[:, k, 3 * i + 2] += sign * (direction[1] * arm[:, 0] - direction[0] * arm[:, 1])
            bends[:, k, i] += sign * arm @ direction
    if turns:
        jacobian[:, -1, 3 * closure.index[drive.target] + 2] = 1.0
    speed, driven = np.zeros((2, len(time), size))
    speed[:, at] = [drive.motion.speed(t) for t in time]
    driven[:, at] = [drive.motion.acceleration(t) for t in time]
    return jacobian, Pulls(speed, driven, bends)


def _arms(closure: Closure, link: str, point: str, directions: Array) -> Array:
    """From a link's start to one of its points, at many directions, shape (times, 2)."""
    x0, y0, theta0 = closure.reference[closure.index[link]]
    dx, dy = np.subtract(closure.mechanism.points[point], (x0, y0))
    c, s = np.cos(directions - theta0), np.sin(directions - theta0)
    return np.column_stack([c * dx - s * dy, s * dx + c * dy])


def _places(record: Record) -> Array:
    """Places of all links' starts and their directions, shape (times, links, 3)."""
    start = Closure(record.mechanism).reference
    rows = [
        np.column_stack([record.links[link.name].point(link.start)[0], record.links[link.name].turn()[0] + at[2]])
        for link, at in zip(record.mechanism.links, start, strict=True)
    ]
    return np.stack(rows, axis=1)
