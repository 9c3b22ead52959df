"""Constraints of elements as equations of rigid bodies, at one time or many: residual, Jacobian and convective term.

A body has the coordinates (x, y, angle since t = 0) of one of its points, from which an arm leads to any other point. Vectors
are complex numbers, x + i y. A row is a sum of terms, each a coefficient times a measure between two bodies: a relative position
along a direction, a relative angle, or a distance. The ground has the index after the last body, and arms lead from the origin.
The same equations close the loops of a linkage and constrain bodies in Exudyn.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..elements.element import Place
from ..elements.rows import Distance, Row, Turn
from ..geometry import Array


class Terms(NamedTuple):
    """Positions and distances as arrays (terms,): number among all terms, and indices of the first and the second body.

    Arms lead to the points of the term, at t = 0 [m]. The direction at t = 0 turns with the body of index `frame`. If
    `is_distance`, the measure is the distance, and its direction leads from the second to the first point at any time.
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
    """Constraints between a number of bodies and the ground, one for each row, with `points` by name at t = 0 [m].

    `locate` is a function from a place to the index of its body and to the point from which arms of the body lead, at t = 0 [m].
    """

    def __init__(
        self, rows: Sequence[Row], body_count: int,
        points: Mapping[str, tuple[float, float]], locate: Callable[[Place], tuple[int, complex]],
    ) -> None:  # fmt: skip
        self.body_count, self.row_count, ground = body_count, len(rows), body_count
        point_terms: list[list[Any]] = []  # each item has the fields of `Terms`
        angle_terms: list[list[int]] = []  # number among all terms, and indices of both bodies
        terms = [term for row in rows for term in row.terms]
        start = np.zeros(len(terms))  # measures at t = 0; angles since t = 0 are zero
        for number, (_, measure) in enumerate(terms):
            (first, origin_1), (second, origin_2) = locate(measure.first), locate(measure.second)
            if isinstance(measure, Turn):
                angle_terms.append([number, first, second])
                continue
            point_1, point_2 = complex(*points[measure.first.point]), complex(*points[measure.second.point])
            arms, vector = [point_1 - origin_1, point_2 - origin_2], point_1 - point_2
            if isinstance(measure, Distance):
                start[number] = abs(vector)
                point_terms.append([number, first, second, ground, *arms, 0, True])
            else:
                frame = second if measure.turns else ground  # body with which the direction turns
                direction = complex(*measure.direction)
                start[number] = (np.conj(direction) * vector).real
                point_terms.append([number, first, second, frame, *arms, direction, False])
        columns: Any = zip(*point_terms, strict=True) if point_terms else [()] * 8
        self.point_terms = Terms(*map(np.array, columns, (int, int, int, int, complex, complex, complex, bool)))
        self.angle_terms = np.array(angle_terms, dtype=int).reshape(-1, 3).T
        self.coefficients = np.array([coefficient for coefficient, _ in terms])
        self.first_terms = np.cumsum([0, *(len(row.terms) for row in rows)])[:-1]  # number of the first term of each row
        self.start = self._sum_terms(self.coefficients * start, -1)

    def _sum_terms(self, values: Array, axis: int) -> Array:
        """Sum values over the terms of each row; the terms lie along `axis`."""
        if len(self.coefficients) == self.row_count:  # one term in each row
            return values
        return np.asarray(np.add.reduceat(values, self.first_terms, axis=axis))

    def system(self, q: Array) -> tuple[Array, Array]:
        """Compute the changes C (..., rows) of the rows since t = 0, and their Jacobian J (..., rows, 3 bodies).

        The coordinates `q` (..., bodies, 3) are places [m] and angles since t = 0 [rad]. The residual of a row with a drive is
        its change less the travel of the drive, which the caller subtracts.
        """
        n, lead, count = self.body_count, q.shape[:-2], len(self.coefficients)
        measures, jacobian = np.zeros((*lead, count)), np.zeros((*lead, count, n + 1, 3))
        terms, (arm_1, arm_2, between, d) = self.point_terms, self._turn_vectors(q)
        measures[..., terms.number] = _dot(d, between)
        for body, sign, arm in ((terms.first, 1.0, arm_1), (terms.second, -1.0, arm_2)):
            jacobian[..., terms.number, body, 0] += sign * d.real
            jacobian[..., terms.number, body, 1] += sign * d.imag
            jacobian[..., terms.number, body, 2] += sign * _dot(d, 1j * arm)
        jacobian[..., terms.number, terms.frame, 2] += _dot(1j * d, between)
        (number, first, second), (_, angles) = self.angle_terms, self._add_ground(q)
        measures[..., number] = angles[..., first] - angles[..., second]
        jacobian[..., number, first, 2] += 1.0
        jacobian[..., number, second, 2] -= 1.0
        changes = self._sum_terms(self.coefficients * measures, -1) - self.start
        by_bodies = self._sum_terms(self.coefficients[:, None, None] * jacobian, -3)[..., :n, :]  # without the ground
        return changes, by_bodies.reshape(*lead, self.row_count, 3 * n)

    def convective(self, q: Array, q_t: Array) -> Array:
        """Compute the convective term gamma of J q_tt = gamma, quadratic in the rates, shape (..., rows).

        It is minus the second derivative of d . b, b = between, without second rates. With d turning at the rate w,
        (d . b)'' = d . b'' + 2 w (i d) . b' - w^2 d . b; for a distance it is d . b'' + ((i d) . b')^2 / |b|.
        """
        gamma = np.zeros((*q.shape[:-2], len(self.coefficients)))
        if q_t.any():
            terms, (arm_1, arm_2, between, d) = self.point_terms, self._turn_vectors(q)
            velocity, spin = self._add_ground(q_t)
            spin_1, spin_2, spin_frame = spin[..., terms.first], spin[..., terms.second], spin[..., terms.frame]
            between_t = velocity[..., terms.first] - velocity[..., terms.second] + 1j * (spin_1 * arm_1 - spin_2 * arm_2)
            across = _dot(1j * d, between_t)
            term = _dot(d, spin_1**2 * arm_1 - spin_2**2 * arm_2)
            term += -2 * spin_frame * across + spin_frame**2 * _dot(d, between)
            if terms.is_distance.any():
                term -= terms.is_distance * across**2 / np.where(terms.is_distance, _dot(d, between), 1.0)
            gamma[..., terms.number] = term
        return self._sum_terms(self.coefficients * gamma, -1)

    def _turn_vectors(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Return both arms, the vector from the second to the first point [m] and the direction of each term between points."""
        terms, (z, angles) = self.point_terms, self._add_ground(q)
        rotation = np.exp(1j * angles)
        arm_1, arm_2 = terms.arm_1 * rotation[..., terms.first], terms.arm_2 * rotation[..., terms.second]
        between = z[..., terms.first] + arm_1 - z[..., terms.second] - arm_2
        direction = terms.direction * rotation[..., terms.frame]
        if terms.is_distance.any():
            distance = np.where(terms.is_distance, np.abs(between), 1.0)
            direction = np.where(terms.is_distance, between / distance, direction)
        return arm_1, arm_2, between, direction

    def _add_ground(self, q: Array) -> tuple[Array, Array]:
        """Return positions as complex numbers, and angles, or the rates of both, each (..., bodies + 1); the ground has zeros."""
        n = self.body_count
        z, angle = np.zeros((*q.shape[:-2], n + 1), dtype=complex), np.zeros((*q.shape[:-2], n + 1))
        z.real[..., :n], z.imag[..., :n], angle[..., :n] = q[..., 0], q[..., 1], q[..., 2]
        return z, angle


def _dot(a: Array, b: Array) -> Array:
    """Compute scalar products of vectors that are complex numbers."""
    return a.real * b.real + a.imag * b.imag
