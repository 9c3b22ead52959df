"""Constraints of elements as equations of rigid bodies, at one time or many: residual, Jacobian and convective term.

A body has the coordinates (x, y, angle since t = 0) of one of its points, from which an arm leads to any other point. Vectors
are complex numbers, x + i y. A row is a sum of terms, each a coefficient times a measure: a place along a direction, an angle or
a distance. The same equations close the loops of a linkage and constrain bodies in Exudyn.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..elements.element import Place
from ..elements.rows import Distance, Row, Turn
from ..geometry import Array


class Ends(NamedTuple):
    """Functions of a `Place`: number of the body, the ground being the last; arm and position of the point at t = 0 [m]."""

    number: Callable[[Place], int]
    arm: Callable[[Place], complex]
    place: Callable[[Place], complex]


class Terms(NamedTuple):
    """Terms of constraints as arrays (terms,): number among all terms, numbers of two bodies and of a frame; ground is the last.

    Arms lead to the points of the term, at t = 0 [m]. The direction at t = 0 turns with the body `frame`. If `is_distance`, the
    term is the distance, and the direction leads from the second to the first point at any time.
    """

    number: Array
    first: Array
    second: Array
    frame: Array
    arm_1: Array
    arm_2: Array
    direction: Array
    is_distance: Array


class Forms:
    """Constraints between `bodies`, a number of bodies, and the ground, one row each."""

    def __init__(self, rows: Sequence[Row], bodies: int, ends: Ends) -> None:
        self.bodies, self.count = bodies, len(rows)
        points: list[list[Any]] = []  # each item has the fields of `Terms`
        turns: list[list[Any]] = []  # likewise, with zeros for arms and direction
        terms = [term for row in rows for term in row.terms]
        start = np.zeros(len(terms))  # measures at t = 0; angles since t = 0 are zero
        for number, (_, measure) in enumerate(terms):
            first, second = ends.number(measure.first), ends.number(measure.second)
            if isinstance(measure, Turn):
                turns.append([number, first, second, bodies, 0, 0, 0, False])
                continue
            arms = [ends.arm(measure.first), ends.arm(measure.second)]
            vector = ends.place(measure.first) - ends.place(measure.second)
            if isinstance(measure, Distance):
                start[number] = abs(vector)
                points.append([number, first, second, bodies, *arms, 0, True])
            else:
                frame, direction = second if measure.turns else bodies, complex(*measure.direction)
                start[number] = (np.conj(direction) * vector).real
                points.append([number, first, second, frame, *arms, direction, False])
        self.points, self.turns = _table(points), _table(turns)
        self.coefficients = np.array([coefficient for coefficient, _ in terms])
        self.first_terms = np.cumsum([0, *(len(row.terms) for row in rows)])[:-1]  # number of the first term of each row
        self.has_plain_rows = len(terms) == len(rows) and bool((self.coefficients == 1.0).all())  # one term, coefficient 1
        self.start = self._sum_terms(start, -1)

    def _sum_terms(self, values: Array, axis: int) -> Array:
        """Sum coefficients times values over the terms of each row; the terms lie along an axis of the values."""
        if self.has_plain_rows or not self.count:
            return values
        coefficients = self.coefficients.reshape(-1, *[1] * (-1 - axis))
        found: Array = np.add.reduceat(values * coefficients, self.first_terms, axis=axis)
        return found

    def system(self, q: Array) -> tuple[Array, Array]:
        """Compute residuals C (..., rows) and Jacobian J (..., rows, 3 bodies); the travel of drives is left out.

        The coordinates `q` (..., bodies, 3) are places [m] and angles since t = 0 [rad].
        """
        n, lead, count = self.bodies, q.shape[:-2], len(self.coefficients)
        measures, jacobian = np.zeros((*lead, count)), np.zeros((*lead, count, n + 1, 3))
        k, i, j, f = self.points.number, self.points.first, self.points.second, self.points.frame  # terms; bodies
        angles, arm_1, arm_2, vector, d = self._arms(q)
        measures[..., k] = _dot(d, vector)
        for body, sign, arm in ((i, 1.0, arm_1), (j, -1.0, arm_2)):
            jacobian[..., k, body, 0] += sign * d.real
            jacobian[..., k, body, 1] += sign * d.imag
            jacobian[..., k, body, 2] += sign * _dot(d, 1j * arm)
        jacobian[..., k, f, 2] += _dot(1j * d, vector)
        k, i, j = self.turns.number, self.turns.first, self.turns.second
        measures[..., k] = angles[..., i] - angles[..., j]
        jacobian[..., k, i, 2] += 1.0
        jacobian[..., k, j, 2] -= 1.0
        of_bodies = self._sum_terms(jacobian, -3)[..., :n, :]
        return self._sum_terms(measures, -1) - self.start, of_bodies.reshape(*lead, self.count, 3 * n)

    def convective(self, q: Array, q_t: Array) -> Array:
        """Compute the convective term gamma of J q_tt = gamma, quadratic in the rates, shape (..., rows)."""
        gamma = np.zeros((*q.shape[:-2], len(self.coefficients)))
        if q_t.any():
            i, j, f = self.points.first, self.points.second, self.points.frame
            (v, w), (_, arm_1, arm_2, vector, d) = self._with_ground(q_t), self._arms(q)
            velocity = v[..., i] - v[..., j] + 1j * (w[..., i] * arm_1 - w[..., j] * arm_2)  # rate of `vector`
            term = _dot(d, w[..., i] ** 2 * arm_1 - w[..., j] ** 2 * arm_2)
            term += -2 * w[..., f] * _dot(1j * d, velocity) + w[..., f] ** 2 * _dot(d, vector)
            distances = self.points.is_distance
            if distances.any():
                term -= distances * _dot(1j * d, velocity) ** 2 / np.where(distances, _dot(d, vector), 1.0)
            gamma[..., self.points.number] = term
        return self._sum_terms(gamma, -1)

    def _arms(self, q: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Compute angles of bodies; for terms of points both arms, vector from second to first point [m], unit vector d."""
        terms, (z, angles) = self.points, self._with_ground(q)
        rotation = np.exp(1j * angles)
        arm_1, arm_2 = terms.arm_1 * rotation[..., terms.first], terms.arm_2 * rotation[..., terms.second]
        vector, d = z[..., terms.first] + arm_1 - z[..., terms.second] - arm_2, terms.direction * rotation[..., terms.frame]
        if terms.is_distance.any():
            d = np.where(terms.is_distance, vector / np.where(terms.is_distance, np.abs(vector), 1.0), d)
        return angles, arm_1, arm_2, vector, d

    def _with_ground(self, q: Array) -> tuple[Array, Array]:
        """Return positions as complex numbers, and angles, or the rates of both, each (..., bodies + 1); the ground has zeros."""
        n = self.bodies
        z, angle = np.zeros((*q.shape[:-2], n + 1), dtype=complex), np.zeros((*q.shape[:-2], n + 1))
        z.real[..., :n], z.imag[..., :n], angle[..., :n] = q[..., 0], q[..., 1], q[..., 2]
        return z, angle


def _table(terms: list[list[Any]]) -> Terms:
    """Arrange the fields of terms in arrays."""
    columns: list[Any] = list(zip(*terms, strict=True)) if terms else [()] * 8
    kinds = (int, int, int, int, complex, complex, complex, bool)
    return Terms(*(np.array(column, dtype=kind) for column, kind in zip(columns, kinds, strict=True)))


def _dot(a: Array, b: Array) -> Array:
    """Compute scalar products of vectors that are complex numbers."""
    return a.real * b.real + a.imag * b.imag
