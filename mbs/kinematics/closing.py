"""Loop closure of a linkage at given times, and the detection of singular poses."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..scene.linkage import Linkage, invert, solve_rates

MAX_ITERATIONS = 30
"""Largest number of Newton steps."""
ROUNDING = 2e-15
"""Residual at which loops are closed to rounding, over the longest link."""
CLOSED = 1e-9
"""Largest residual of redundant rows, over the longest link; beyond it they contradict the others."""


class Course(NamedTuple):
    """Motion of a linkage: start points and directions of links (times, links, 3), Jacobian (times, rows, 3 links)."""

    time: Array
    q: Array
    q_t: Array
    q_tt: Array
    jacobian: Array


def close_loops(linkage: Linkage, times: Array, q: Array) -> Course | None:
    """Close the loops at each time by Newton's method from a nearby guess, then find the rates; None if it fails at a time."""
    zero = np.zeros_like(q)
    travel, scale = linkage.travel(times), max(1.0, linkage.size)
    last = np.inf
    for _ in range(MAX_ITERATIONS):
        residual, jacobian, _ = linkage.system(q, zero)
        residual = residual - travel
        gap = float(np.abs(residual).max(initial=0.0))
        if not np.isfinite(gap) or gap > 1e3 * scale:
            return None
        if gap < ROUNDING * scale or (last < 1e-9 * scale and gap >= last):  # no further progress
            return _rates(linkage, times, q, jacobian) if gap < CLOSED * scale else None
        last = gap
        try:
            q = q - solve_rates(jacobian, residual).reshape(q.shape)
        except np.linalg.LinAlgError:
            return None
    return None


def _rates(linkage: Linkage, times: Array, q: Array, jacobian: Array) -> Course | None:
    try:
        inverse = invert(jacobian)
    except np.linalg.LinAlgError:
        return None
    q_t = (inverse @ linkage.speed(times)[..., None])[..., 0].reshape(q.shape)
    right = linkage.convective(q, q_t) + linkage.acceleration(times)
    q_tt = (inverse @ right[..., None])[..., 0].reshape(q.shape)
    return Course(times, q, q_t, q_tt, jacobian) if np.isfinite(q_tt).all() else None


def choose_independent_rows(jacobian: Array) -> Array:
    """Choose a well conditioned square set of rows, by QR with column pivoting (Businger and Golub, 1965)."""
    rows, columns = jacobian.shape
    if rows == columns:
        return np.arange(rows)
    from scipy.linalg import qr  # loading it takes longer than a rigid mechanism takes to run

    return np.sort(qr(jacobian.T, mode="r", pivoting=True)[1][:columns])


def passes_singularity(linkage: Linkage, before: Course, after: Course) -> bool:
    """Return True if a singular pose lies between two times, beyond which the motion is not determined.

    The determinant of independent rows changes its sign there. Redundant rows may still determine the motion.
    """
    rows = choose_independent_rows(before.jacobian[0])
    if np.prod([np.linalg.det(part.jacobian[0][rows]) for part in (before, after)]) > 0:
        return False
    distance = float(np.abs(after.q - before.q).max())
    return len(rows) == len(linkage.names) or has_other_branch(linkage, float(after.time[0]), after.q[0], distance)


def has_other_branch(linkage: Linkage, time: float, q: Array, distance: float) -> bool:
    """Return True if another pose closes the loops near a pose that is at most a distance from a singular one.

    It is searched in the direction of the least singular value of the Jacobian, from starts up to four distances away.
    """
    jacobian = linkage.system(q, np.zeros_like(q))[1]
    direction = np.linalg.svd(jacobian)[2][-1].reshape(q.shape)
    direction *= distance / np.abs(direction).max()
    for factor in (-4.0, -2.0, -1.0, 1.0, 2.0, 4.0):
        other = close_loops(linkage, np.array([time]), (q + factor * direction)[None])
        if other is not None and np.abs(other.q[0] - q).max() > 1e-3 * distance:
            return True
    return False
