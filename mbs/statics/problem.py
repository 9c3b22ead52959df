"""The equations of rest of a mechanism, f(q) = G^T lambda and g(q) = 0, with one number p that can move loads or drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.spectral.scene import Place, Scene

Array = np.ndarray[Any, Any]
ITERATIONS = 25
LONGEST_STEP = 0.3
"""Largest change of a coordinate in one iteration, in its unit (the longest link's length, 1 rad)."""
CLOSE = 1e-10
"""A Newton step below this, in the same units, ends the iteration."""


class StaticsError(ValueError):
    """No equilibrium was found, or what is asked for is not in the mechanism."""


class Rest(NamedTuple):
    """A state of rest: coordinates (n,), multipliers (r,), parameter."""

    q: Array
    multipliers: Array
    parameter: float


@dataclass
class Problem:
    """A scene at rest, and what its parameter moves.

    Attributes
    ----------
    scene : Scene
    loads : sequence of int
        Forces whose factor is the parameter; the last factor is gravity's.
    row : int
        Constraint whose value the parameter is added to; -1 for none.
    """

    scene: Scene
    loads: Sequence[int] = ()
    row: int = -1

    def __post_init__(self) -> None:
        self.units = self.scene.units
        self.value = self.scene.tables.values[self.row] if self.row >= 0 else 0.0

    def set(self, parameter: float) -> None:
        """Move loads or the drive."""
        if self.row >= 0:
            self.scene.tables.values[self.row] = self.value + parameter
        self.scene.tables.factors[list(self.loads)] = parameter

    def residual(self, rest: Rest) -> tuple[Array, Array, Array, Array]:
        """Out-of-balance force f - G^T lambda, g, K and G."""
        self.set(rest.parameter)
        a = self.scene.assemble(rest.q, lam=rest.multipliers)
        return a.force - a.jacobian.T @ rest.multipliers, a.residual, a.stiffness, a.jacobian

    def slope(self, rest: Rest) -> Array:
        """Derivative of (f - G^T lambda, g) by the parameter, in which both are linear."""
        at = []
        for p in (rest.parameter + 1.0, rest.parameter):
            self.set(p)
            a = self.scene.assemble(rest.q, tangents=False)
            at.append(np.concatenate([a.force, a.residual]))
        return at[0] - at[1]

    def scaled(self, stiffness: Array, jacobian: Array) -> tuple[Array, float]:
        """The matrix [[K, G^T], [G, 0]] in units of the coordinates, and the force that goes with them."""
        n, r = len(stiffness), len(jacobian)
        k = stiffness * np.outer(self.units, self.units)
        scale = max(float(np.median(np.abs(np.diag(k)))), 1e-300)
        matrix = np.zeros((n + r, n + r))
        matrix[:n, :n] = k / scale
        matrix[n:, :n] = jacobian * self.units
        matrix[:n, n:] = matrix[n:, :n].T
        return matrix, scale

    def newton(self, rest: Rest, fixed: tuple[Array, float, float] | None = None) -> Rest:
        """Solve for rest at its parameter, or, given (normal (n + r + 1,), value, unit of p), on that plane.

        Raises
        ------
        StaticsError
            If it does not converge.
        """
        n, r = self.scene.size, len(rest.multipliers)
        for _ in range(ITERATIONS):
            force, gap, stiffness, jacobian = self.residual(rest)
            matrix, scale = self.scaled(stiffness, jacobian)
            right = np.concatenate([force * self.units / scale, -gap])
            change_p = 0.0
            if fixed is None:
                step = solve(matrix, right)
            else:
                normal, value, unit = fixed
                slope = self.slope(rest)
                column = -np.concatenate([slope[:n] * self.units / scale, -slope[n:]]) * unit
                bordered = np.block([[matrix, column[:, None]], [self._in_units(normal, scale, unit)[None]]])
                miss = value - float(normal @ self._vector(rest))
                step = solve(bordered, np.append(right, miss))
                change_p = float(step[-1]) * unit
            largest = float(np.abs(step[:n]).max(initial=0.0))
            damp = min(1.0, LONGEST_STEP / max(largest, 1e-300))
            if not np.isfinite(largest):
                break
            rest = Rest(
                rest.q + damp * step[:n] * self.units,
                rest.multipliers + damp * step[n : n + r] * scale,
                rest.parameter + damp * change_p,
            )
            if largest < CLOSE:
                return rest
        raise StaticsError(f"no equilibrium found near parameter {rest.parameter:.6g}: Newton's method does not converge")

    def _vector(self, rest: Rest) -> Array:
        return np.concatenate([rest.q, rest.multipliers, [rest.parameter]])

    def _in_units(self, normal: Array, scale: float, unit: float) -> Array:
        n = self.scene.size
        return np.concatenate([normal[:n] * self.units, normal[n:-1] * scale, [normal[-1] * unit]])

    def tangent(self, rest: Rest) -> Array:
        """Change of (q, lambda) for a unit change of the parameter."""
        n = self.scene.size
        slope = self.slope(rest)
        _, _, stiffness, jacobian = self.residual(rest)
        matrix, scale = self.scaled(stiffness, jacobian)
        out = solve(matrix, np.concatenate([slope[:n] * self.units / scale, -slope[n:]]))
        return np.concatenate([out[:n] * self.units, out[n:] * scale])

    def stability(self, rest: Rest, count: int = 1) -> tuple[Array, Array]:
        """Lowest eigenvalues of the tangent on what the constraints leave free, in units of the mass matrix: squared angular
        frequencies, 1/s^2; and their shapes (n, count).

        An equilibrium is stable where the lowest is positive.
        """
        _, _, stiffness, jacobian = self.residual(rest)
        return modes(stiffness, self.scene.mass_at(rest.q), jacobian, self.units, count)


def modes(stiffness: Array, mass: Array, jacobian: Array, units: Array, count: int) -> tuple[Array, Array]:
    """Lowest solutions of K z = omega^2 M z with G z = 0: omega^2 and shapes with z^T M z = 1."""
    free = null_space(jacobian, units)
    if not free.shape[1]:
        return np.empty(0), np.empty((len(mass), 0))
    k, m = free.T @ stiffness @ free, free.T @ mass @ free
    lower = np.linalg.cholesky(m)  # M = L L^T: the symmetric problem of L^-1 K L^-T
    values, vectors = np.linalg.eigh(np.linalg.solve(lower, np.linalg.solve(lower, (k + k.T) / 2).T))
    return values[:count], free @ np.linalg.solve(lower.T, vectors[:, :count])


def null_space(jacobian: Array, units: Array) -> Array:
    """Columns that span the z with G z = 0, each coordinate in its unit."""
    if not len(jacobian):
        return np.diag(units)
    _, s, vh = np.linalg.svd(jacobian * units)
    rank = int((s > 1e-10 * s[0]).sum())
    return np.asarray(units[:, None] * vh[rank:].T)


def solve(matrix: Array, right: Array) -> Array:
    """Solve; by least squares where the matrix is singular (redundant constraints, free motions)."""
    try:
        with np.errstate(all="ignore"):
            out = np.linalg.solve(matrix, right)  # near a limit point it is ill-conditioned: the residual decides
        if np.isfinite(out).all() and np.abs(matrix @ out - right).max() <= 1e-6 * max(np.abs(right).max(), 1e-300):
            return np.asarray(out)
    except np.linalg.LinAlgError:
        pass
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-12)[0])


def places(scene: Scene, q: Array, link: str, point: str) -> Place:
    """Where a point of a link is at coordinates q."""
    return scene.read(scene.marker(link, point), q)
