"""Constraints of elements as equations of rigid bodies at one time or many: residual, Jacobian and convective term.

A body has the coordinates (x, y, angle since t = 0) of one of its points; a place is a complex number x + i y. The same equations
close the loops of a linkage and constrain bodies in the engine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..elements.element import Place
from ..elements.rows import Distance, Row, Turn
from ..geometry import Array


class Ends(NamedTuple):
    """Functions of a place: number of its body, the last for the ground; arm from the body's point and place at t = 0 [m]."""

    number: Callable[[Place], int]
    arm: Callable[[Place], complex]
    place: Callable[[Place], complex]


class Terms(NamedTuple):
    """Terms of constraints as arrays, shape (terms,): index `at` among all terms, two bodies by number, the ground last.

    Arms lead from the points of the bodies' coordinates to the points of the term, at t = 0 [m]. The direction at t = 0 turns
    with the body `frame`. If `is_distance`, the term is the distance, and its direction leads from second to first point.
    """

    at: Array
    first: Array
    second: Array
    frame: Array
    arm_1: Array
    arm_2: Array
    direction: Array
    is_distance: Array


class Forms:
    """Constraints between a number of bodies and the ground; each row is a sum of terms with coefficients."""

    def __init__(self, rows: Sequence[Row], bodies: int, ends: Ends) -> None:
        self.bodies, self.count = bodies, len(rows)
        points: list[list[Any]] = []
        turns: list[list[Any]] = []
        terms = [(k, share, measure) for k, row in enumerate(rows) for share, measure in row.terms]
        for at, (_, _, measure) in enumerate(terms):
            first, second = ends.number(measure.first), ends.number(measure.second)
            if isinstance(measure, Turn):
                turns.append([at, first, second, bodies, 0, 0, 0, False])
                continue
            arms = [ends.arm(measure.first), ends.arm(measure.second)]
            if isinstance(measure, Distance):
                points.append([at, first, second, bodies, *arms, 0, True])
            else:
                frame = second if measure.turns else bodies
                points.append([at, first, second, frame, *arms, complex(*measure.direction), False])
        self.points, self.turns = _table(points), _table(turns)
        self.share = np.array([share for _, share, _ in terms])
        self.begin = np.searchsorted([k for k, _, _ in terms], np.arange(len(rows)))
        self.plain = len(terms) == len(rows) and bool((self.share == 1.0).all())
        self.start = self._sum_terms(self._at_start([measure for _, _, measure in terms], ends), -1)

    def _at_start(self, measures: list[Any], ends: Ends) -> Array:
        """Compute the values of all terms at t = 0; angles are counted from there."""
        start = np.zeros(len(measures))
        for k, measure in enumerate(measures):
            if not isinstance(measure, Turn):
                apart = ends.place(measure.first) - ends.place(measure.second)
                is_distance = isinstance(measure, Distance)
                start[k] = abs(apart) if is_distance else (np.conj(complex(*measure.direction)) * apart).real
        return start

    def _sum_terms(self, values: Array, axis: int) -> Array:
        """Sum the terms of each row, each times its coefficient."""
        if self.plain or not self.count:
            return values
        share = self.share.reshape(-1, *[1] * (-1 - axis))
        found: Array = np.add.reduceat(values * share, self.begin, axis=axis)
        return found

    def system(self, q: Array) -> tuple[Array, Array]:
        """Compute residual C (..., rows) and Jacobian J (..., rows, 3 bodies), without the travel of drives.

        The coordinates `q` (..., bodies, 3) are places [m] and angles since t = 0 [rad].
        """
        n, lead = self.bodies, q.shape[:-2]
        value, jacobian = np.zeros((*lead, len(self.share))), np.zeros((*lead, len(self.share), n + 1, 3))
        i, j, f, at = self.points.first, self.points.second, self.points.frame, self.points.at
        turned, arm_1, arm_2, apart, d = self._arms(q)
        value[..., at] = _dot(d, apart)
        for body, sign, arm in ((i, 1.0, arm_1), (j, -1.0, arm_2)):
            jacobian[..., at, body, 0] += sign * d.real
            jacobian[..., at, body, 1] += sign * d.imag
            jacobian[..., at, body, 2] += sign * _dot(d, 1j * arm)
        jacobian[..., at, f, 2] += _dot(1j * d, apart)
        at, i, j = self.turns.at, self.turns.first, self.turns.second
        value[..., at] = turned[..., i] - turned[..., j]
        jacobian[..., at, i, 2] += 1.0
        jacobian[..., at, j, 2] -= 1.0
        whole = self._sum_terms(jacobian, -3)[..., :n, :].reshape(*lead, self.count, 3 * n)
        return self._sum_terms(value, -1) - self.start, whole

    def convective(self, q: Array, q_t: Array) -> Array:
        """Compute the convective term gamma of J q_tt = gamma, quadratic in the rates, shape (..., rows)."""
        gamma = np.zeros((*q.shape[:-2], len(self.share)))
        if q_t.any():
            i, j, f = self.points.first, self.points.second, self.points.frame
            (v, w), (_, arm_1, arm_2, apart, d) = self._with_ground(q_t), self._arms(q)
            relative = v[..., i] - v[..., j] + 1j * (w[..., i] * arm_1 - w[..., j] * arm_2)  # velocity
            term = _dot(d, w[..., i] ** 2 * arm_1 - w[..., j] ** 2 * arm_2)
            term += -2 * w[..., f] * _dot(1j * d, relative) + w[..., f] ** 2 * _dot(d, apart)
            distances = self.points.is_distance
            if distances.any():
                term -= distances * _dot(1j * d, relative) ** 2 / np.where(distances, _dot(d, apart), 1.0)
            gamma[..., self.points.at] = term
        return self._sum_terms(gamma, -1)

    def _arms(self, q: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Compute the angles of all bodies, and for terms of points: both arms, vector from second to first place, direction."""
        rows, (z, turned) = self.points, self._with_ground(q)
        unit = np.exp(1j * turned)
        arm_1, arm_2 = rows.arm_1 * unit[..., rows.first], rows.arm_2 * unit[..., rows.second]
        apart, d = z[..., rows.first] + arm_1 - z[..., rows.second] - arm_2, rows.direction * unit[..., rows.frame]
        if rows.is_distance.any():
            d = np.where(rows.is_distance, apart / np.where(rows.is_distance, np.abs(apart), 1.0), d)
        return turned, arm_1, arm_2, apart, d

    def _with_ground(self, q: Array) -> tuple[Array, Array]:
        """Return complex places and angles, or their rates, each (..., bodies + 1), those of the ground last, zero."""
        n = self.bodies
        z, angle = np.zeros((*q.shape[:-2], n + 1), dtype=complex), np.zeros((*q.shape[:-2], n + 1))
        z.real[..., :n], z.imag[..., :n], angle[..., :n] = q[..., 0], q[..., 1], q[..., 2]
        return z, angle


def _table(table: list[list[Any]]) -> Terms:
    columns: list[Any] = list(zip(*table, strict=True)) if table else [()] * 8
    kinds = (int, int, int, int, complex, complex, complex, bool)
    return Terms(*(np.array(column, dtype=kind) for column, kind in zip(columns, kinds, strict=True)))


def _dot(a: Array, b: Array) -> Array:
    """Compute scalar products of vectors as complex numbers."""
    return a.real * b.real + a.imag * b.imag
