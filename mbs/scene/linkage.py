"""Kinematics and masses of the mechanism with every link rigid, at one time or many.

Each link has the coordinates (x, y, theta) of its start point and direction. Elements contribute rows, scalar equations
C(q, t) = 0, from which drives subtract their travel, a function of time alone. With the Jacobian J = dC/dq, rates solve
J q_t = -C_t and second rates J q_tt = gamma - C_tt. The convective term gamma = -(d(J q_t)/dq) q_t is quadratic in velocities
(P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems, 1988, ch. 3).
"""

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..elements.element import GROUND, place
from ..elements.rows import Row
from ..geometry import Array
from ..mechanism import Mechanism
from .forms import Forms


class KinematicsError(ValueError):
    """The linkage cannot be assembled, or is singular (a dead centre) where it must not be."""


DEPENDENT = 1e-9
"""Singular value of a Jacobian below which rows count as dependent, relative to the largest singular value or entry, which
counts as 1 if it is smaller. The relative rounding error is about 1e-15."""
DISPLACEMENT = 1e-2
"""Largest change of a coordinate from t = 0 to the pose in general position, over the longest link or in rad: chosen."""


@dataclass(frozen=True)
class Linkage:
    """Loop closure of a mechanism with rigid links; speeds of drives are not evaluated after `last` [s], the end of a run."""

    mechanism: Mechanism
    last: float = np.inf

    def limit_drives(self, last: float) -> Self:
        """Return a copy that evaluates speeds of drives up to `last` [s] only; accelerations are differences of speeds."""
        limited = copy(self)  # with the cached rows
        object.__setattr__(limited, "last", last)
        return limited

    @cached_property
    def index(self) -> dict[str, int]:
        """Index of each link in the coordinate array."""
        return {link.name: i for i, link in enumerate(self.mechanism.links)}

    @cached_property
    def reference(self) -> Array:
        """Coordinates at t = 0, shape (links, 3)."""
        ends = [(self.mechanism.points[link.start], self.mechanism.points[link.end]) for link in self.mechanism.links]
        return np.array([(x0, y0, np.arctan2(y1 - y0, x1 - x0)) for (x0, y0), (x1, y1) in ends])

    @cached_property
    def size(self) -> float:
        """Length of the longest link [m]."""
        return max(self.mechanism.length(link.name) for link in self.mechanism.links)

    @cached_property
    def _named_rows(self) -> list[tuple[str, Row]]:
        return [(name, row) for name, element in self.mechanism.elements().items() for row in element.rows(self.mechanism)]

    @cached_property
    def rows(self) -> list[Row]:
        """Constraint equations of all elements."""
        return [row for _, row in self._named_rows]

    @cached_property
    def names(self) -> list[str]:
        """Name of the element of each row."""
        return [name for name, _ in self._named_rows]

    @cached_property
    def motions(self) -> dict[int, Any]:
        """Motion of each row that follows a drive, by the index of the row."""
        return {k: row.motion for k, row in enumerate(self.rows) if row.motion is not None}

    def carrying_link(self, body: str) -> str:
        """Return the link with which a body moves: for a guide's block, named by the guided point, the guided link."""
        return next((guide.link for guide in self.mechanism.guides if guide.point == body), body)

    @cached_property
    def _forms(self) -> Forms:
        return self.make_forms(self.rows)

    def make_forms(self, rows: Sequence[Row]) -> Forms:
        """Return the equations of rows, with arms from the starts of links, and from the origin for the ground."""
        starts = {name: (i, complex(*self.reference[i, :2])) for name, i in self.index.items()}
        starts[GROUND] = len(self.index), 0j
        return Forms(rows, len(self.index), self.mechanism.points, locate=lambda end: starts[end.body])

    def system(self, q: Array) -> tuple[Array, Array]:
        """Compute C (..., rows), before drives subtract their travel, and J (..., rows, 3 links) from q (..., links, 3)."""
        return self._forms.system(q - self.reference * (0.0, 0.0, 1.0))  # with angles since t = 0

    def jacobian(self, q: Array) -> Array:
        """Compute the Jacobian J (..., rows, 3 links) at coordinates q (..., links, 3)."""
        return self.system(q)[1]

    def convective(self, q: Array, q_t: Array) -> Array:
        """Compute the convective term gamma (..., rows), quadratic in the rates."""
        return self._forms.convective(q - self.reference * (0.0, 0.0, 1.0), q_t)  # with angles since t = 0

    def drive_travel(self, time: ArrayLike, order: int = 0) -> Array:
        """Return the travels (..., rows) of the drives of rows [m or rad], or derivatives of order 1 or 2; 0 without a drive."""
        time = np.asarray(time, dtype=float)
        values = np.zeros((*time.shape, len(self.names)))
        for k, motion in self.motions.items():
            evaluate = (motion.position, motion.speed, partial(motion.acceleration, last=self.last))[order]
            values[..., k] = np.reshape([evaluate(float(t)) for t in time.ravel()], time.shape)
        return values

    @cached_property
    def permanent_rows(self) -> Array:
        """Indices of the rows that hold throughout a run, not only at its start."""
        return np.flatnonzero([not row.start_only for row in self.rows])

    @cached_property
    def general_pose(self) -> Array:
        """Pose in general position (links, 3), near the pose at t = 0: all loops are closed, drives are free to move.

        Rows that are dependent at t = 0 only, such as those of a parallelogram in one line, are independent here. It is the best
        of four random poses, a chosen number. A linkage that cannot move has the pose at t = 0.
        """
        reference = self.reference
        rows = np.array([k for k in self.permanent_rows if k not in self.motions], dtype=int)
        if not len(rows):
            return reference
        unit = np.tile([self.size, self.size, 1.0], len(self.index))  # of the coordinates
        _, values, right = np.linalg.svd(self.jacobian(reference)[rows] * unit)
        independent = int((values > DEPENDENT * max(1.0, values[0])).sum())
        free = right[independent:].T  # small motions that the rows allow
        if not free.size:
            return reference
        directions = [free @ weights for weights in np.random.default_rng(seed=0).normal(size=(4, free.shape[1]))]
        steps = [DISPLACEMENT * direction / np.abs(direction).max() * unit for direction in directions]
        poses = [self._close(reference + step.reshape(reference.shape), rows, unit) for step in steps]
        closed = [pose for pose in poses if pose is not None]
        return max(closed, key=lambda pose: rank(self.jacobian(pose)[self.permanent_rows]), default=reference)

    def _close(self, q: Array, rows: Array, unit: Array) -> Array | None:
        """Close loops by the Gauss-Newton method from a nearby pose; return None if it does not converge or goes far away."""
        scale = max(1.0, self.size)  # of residuals: at least 1, as those of angles are in rad
        for _ in range(20):  # far more than a start so close needs
            residual, jacobian = self.system(q)
            if np.abs(residual[rows]).max() < 1e-13 * scale:
                break
            # singular values that vanish only at t = 0 are of the order DISPLACEMENT here; those of redundant rows are rounding
            inverse = np.linalg.pinv(jacobian[rows] * unit, rcond=1e-6)
            q = q - (unit * (inverse @ residual[rows])).reshape(q.shape)
        last_residual, _ = self.system(q)
        distance = np.abs((q - self.reference) / unit.reshape(q.shape)).max()
        has_closed = np.abs(last_residual[rows]).max() < 1e-11 * scale  # above 1e-13: rounding of an ill-conditioned Jacobian
        return q if has_closed and distance < 20 * DISPLACEMENT else None  # chosen: farther away it may be another assembly

    def count_free_motions(self) -> int:
        """Return the degrees of freedom at t = 0 with the drives locked: 0 for a fully driven linkage."""
        jacobian = self.jacobian(self.reference)  # of all rows, also of those that hold at t = 0 only
        return jacobian.shape[1] - rank(jacobian)


def invert(matrix: Array) -> Array:
    """Invert matrices, shape (..., m, n); those that are not square by the Moore-Penrose inverse."""
    is_square = matrix.shape[-2] == matrix.shape[-1]
    return np.linalg.inv(matrix) if is_square else np.linalg.pinv(matrix, rcond=DEPENDENT)


def rank(jacobian: Array) -> int:
    """Return the number of independent rows of a Jacobian: of singular values above `DEPENDENT` times its largest entry or 1."""
    least = DEPENDENT * max(1.0, np.abs(jacobian).max(initial=0.0))
    return int(np.linalg.matrix_rank(jacobian, tol=least)) if jacobian.size else 0


def independent_rows(matrix: Array) -> list[int]:
    """Find the rows that do not depend on rows before them, by Gram-Schmidt orthogonalisation, repeated against rounding."""
    independent: list[int] = []
    basis = np.empty((0, matrix.shape[1]))
    for k, row in enumerate(matrix):
        rest = row - basis.T @ (basis @ row)
        rest = rest - basis.T @ (basis @ rest)
        if float(np.linalg.norm(rest)) > DEPENDENT * max(1.0, float(np.linalg.norm(row))):
            basis = np.vstack([basis, rest / np.linalg.norm(rest)])
            independent.append(k)
    return independent


def involved_elements(names: list[str], weights: Array) -> list[str]:
    """Return the elements, each once, of rows whose weight, a residual or a coefficient in a sum of rows, is not zero."""
    least = 1e-6 * np.abs(weights).max(initial=1e-300)  # 1e-6: far above rounding; 1e-300: zeros are not involved
    return list(dict.fromkeys(name for name, weight in zip(names, weights, strict=True) if abs(weight) > least))


def turning_speed(mechanism: Mechanism, duration: float) -> float:
    """Return the largest speed [rad/s] of a driven link, sampled at each per cent of a duration [s]; 0 if no link is driven."""
    motions = [drive.motion for drive in mechanism.drives if drive.target not in mechanism.points]  # the target is a link
    times = [float(t) for t in np.linspace(0, duration, 101)]
    return max((abs(float(motion.speed(t))) for motion in motions for t in times), default=0.0)


def carried_masses(linkage: Linkage) -> Iterator[tuple[int, float, float, complex]]:
    """Yield the masses of links, blocks of guides, and elements on links; a block is a point mass of the guided link.

    Each has the index of its link, mass [kg], inertia about its centre [kg m^2], and the arm from the link's start at t = 0 [m].
    """
    mechanism = linkage.mechanism
    for link in mechanism.links:
        i = linkage.index[link.name]
        mass, inertia, centre = link.body.mass_properties(mechanism.length(link.name))
        yield i, mass, inertia, complex(*centre) * np.exp(1j * linkage.reference[i, 2])
    burdens = [(f"{guide.link}:{guide.point}", guide.mass, 0.0) for guide in mechanism.guides]
    for element in mechanism.elements().values():
        burdens += element.burdens(mechanism)
    for point_reference, mass, inertia in burdens:
        body, point = place(point_reference)  # splits "link:point"
        i = linkage.index[linkage.carrying_link(body)]
        yield i, mass, inertia, complex(*mechanism.points[point]) - complex(*linkage.reference[i, :2])


def mass_matrix(linkage: Linkage) -> Array:
    """Compute the mass matrix (3 n, 3 n) of n links at t = 0, for the rates (vx, vy, spin) of their start points."""
    n = len(linkage.index)
    matrix = np.zeros((n, 3, n, 3))
    for link, mass, inertia, arm in carried_masses(linkage):
        to_velocity = np.array([[1.0, 0.0, -arm.imag], [0.0, 1.0, arm.real]])  # from rates of the link to those of the mass
        matrix[link, :, link, :] += mass * to_velocity.T @ to_velocity
        matrix[link, 2, link, 2] += inertia
    return matrix.reshape(3 * n, 3 * n)
