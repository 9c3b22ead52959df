"""Equilibrium paths of a `Strip` by pseudo-arclength: through limit points, with the branchings they pass.

A point of the path is (z, f), unknowns and load factor, with defect(z, f) = 0. Its tangent t spans the null space of the matrix
(d defect/dz, d defect/df); a step predicts along t and corrects by Newton on the plane t . (change) = step. Lengths are
measured with theta averaged along the strip and f over its scale, so that neither forces nor the number of points matter.

- A **limit point** is where the load factor turns, df/dstep = 0: found by a bracketing root search along the path, each try
  corrected by Newton. The load factor there is exact to the square of the error in place.
- A **branching** is where the determinant of the matrix bordered by t changes sign: another path crosses, such as the one on
  which a symmetric arch sways. The path goes straight on; an unsymmetric bow follows the other.

References
----------
H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in P. H. Rabinowitz (ed.), Applications of
Bifurcation Theory, 1977, pp. 359-384.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import exp
from typing import NamedTuple

import numpy as np
import scipy

from buckler.elastica.collocation import Array, NewtonDivergedError, newton
from buckler.elastica.strip import Load, Strip, StripEquilibrium

MOST_POINTS = 5000
"""Largest number of points of a path; a path that needs more is refused."""
LEAST_COSINE = 0.97
"""Least cosine between the tangents at both ends of a step. A step that bends more may pass two limit points at once."""
MOST_CORRECTION = 0.15
"""Largest correction by Newton over the length of the step. A step corrected by more may end on another path."""


@dataclass(frozen=True, eq=False)
class Path:
    """Equilibria in the order in which they are passed.

    Attributes
    ----------
    points : equilibria of the path
    limits : equilibria at which the load factor turns
    branchings : equilibria at which another path crosses
    """

    points: tuple[StripEquilibrium, ...]
    limits: tuple[StripEquilibrium, ...]
    branchings: tuple[StripEquilibrium, ...]

    @property
    def factor(self) -> Array:
        """Load factors of the points, shape (points,)."""
        return np.array([point.factor for point in self.points])

    @property
    def inner(self) -> Array:
        """Places of the point `Strip.at` over L, shape (points, 2)."""
        return np.array([point.inner for point in self.points])


def follow(strip: Strip, load: Load, to: float, *, step: float = 0.05) -> Path:
    """Follow the path from the stress-free shape until the load factor reaches `to`.
    `to` is a load factor; the path stops where it reaches it first. A step is at most so long in rad and in parts of the way.
    """
    track = _Track(strip, load, to)
    here = track.at(strip.stress_free(), 0.0)
    track = track._replace(reference=here.size)
    here = here if here.tangent[-1] * to > 0.0 else here.reverse()
    points, limits, branchings, length = [here], [], [], step
    while True:
        there = track.onward(here, length)
        if there is None or len(points) > MOST_POINTS:
            length /= 2.0
            if length < 1e-9 or len(points) > MOST_POINTS:
                raise NewtonDivergedError(
                    f"{to:g} was not reached: point {len(points)}, the last, is at load factor {here.factor:.9g}"
                )
            continue
        if (there.factor - to) * (here.factor - to) <= 0.0:
            points.append(track.where(here, length, lambda point: point.factor - to))
            break
        if here.tangent[-1] * there.tangent[-1] < 0.0:
            limits.append(track.where(here, length, lambda point: point.tangent[-1]))
        if here.sign * there.sign < 0.0:
            branchings.append(track.where(here, length, track.determinant, singular=True))
        points.append(there)
        here, length = there, min(1.3 * length, step)
    return Path(*(tuple(track.equilibrium(p) for p in group) for group in (points, limits, branchings)))


class _Point(NamedTuple):
    """Unknowns with the load factor last, unit tangent, and the bordered determinant: its sign, the logarithm of its size."""

    u: Array
    tangent: Array
    sign: float
    size: float

    @property
    def factor(self) -> float:
        """Load factor."""
        return float(self.u[-1])

    def reverse(self) -> _Point:
        """Return the point with its tangent the other way."""
        return self._replace(tangent=-self.tangent, sign=-self.sign)


class _Track(NamedTuple):
    """The path of one strip under one load, its load factors measured in `scale`."""

    strip: Strip
    load: Load
    scale: float
    reference: float = 0.0

    @property
    def weights(self) -> Array:
        """Weights of the squares of unknowns and load factor in a length along the path."""
        n = self.strip.nodes
        pieces = [np.full(n, part / n) for part in (self.strip.at, 1.0 - self.strip.at)]
        return np.concatenate((*pieces, np.zeros(3), (self.scale**-2,)))

    def at(self, unknowns: Array, factor: float, like: Array | None = None) -> _Point:
        """Return a point of the path with its tangent, which points as `like` does."""
        last = np.eye(1, unknowns.size + 1, unknowns.size)[0]
        row = self.weights * (last if like is None else like)
        bordered = np.vstack((self.strip.jacobian(self.load, factor, unknowns), row))
        sign, size = np.linalg.slogdet(bordered)
        # Exactly on a branching the matrix is singular; least squares leave the crossing path's direction alone.
        tangent = np.linalg.solve(bordered, last) if sign else np.linalg.lstsq(bordered, last, rcond=1e-9)[0]
        return _Point(np.append(unknowns, factor), tangent / np.sqrt(self.weights @ tangent**2), float(sign), float(size))

    def determinant(self, point: _Point) -> float:
        """Compute the bordered determinant over its size at the start of the path."""
        return point.sign * exp(min(point.size - self.reference, 600.0))

    def onward(self, here: _Point, length: float, *, within: bool = False, singular: bool = False) -> _Point | None:
        """Step along the path; return None where Newton diverges or the path bends too much within the step.

        Within a step that was taken nothing bends too much. Near a branching the equations are close to singular: least squares
        leave the crossing path's direction alone.
        """
        row, u0 = self.weights * here.tangent, here.u + length * here.tangent

        def step(u: Array) -> Array:
            """Solve the linearised equations."""
            matrix = np.vstack((self.strip.jacobian(self.load, u[-1], u[:-1]), row))
            defect = np.append(self.strip.defect(self.load, u[-1], u[:-1]), row @ (u - u0))
            return np.linalg.lstsq(matrix, defect, rcond=1e-9)[0] if singular else np.linalg.solve(matrix, defect)

        try:
            u = newton(step, u0)
            there = self.at(u[:-1], float(u[-1]), here.tangent)
        except (NewtonDivergedError, np.linalg.LinAlgError):
            return None
        off = np.sqrt(self.weights @ (there.u - u0) ** 2)
        return there if within or (row @ there.tangent > LEAST_COSINE and off < MOST_CORRECTION * length) else None

    def where(self, here: _Point, length: float, value: Callable[[_Point], float], singular: bool = False) -> _Point:
        """Find the point within one step at which a value is zero, by Brent's method."""

        def point_at(part: float) -> _Point:
            """Return the equilibrium at a length along the step."""
            point = self.onward(here, part, within=True, singular=singular)
            if point is None:
                raise NewtonDivergedError(
                    f"no equilibrium within a step from load factor {here.factor:.9g}, where both its ends are one"
                )
            return point

        return point_at(scipy.optimize.brentq(lambda part: value(point_at(part)), 0.0, length, xtol=1e-15, rtol=1e-14))

    def equilibrium(self, point: _Point) -> StripEquilibrium:
        """Return the strip's shape and forces at a point."""
        return self.strip.at_unknowns(self.load, point.factor, point.u[:-1])
