"""Small motions about a state: eigenvalues of the equations of motion, linearised there, with their rounding errors.

Small motions are solutions z exp(s t) of M z'' + C z' + K z + (G - X)^T l = 0, G z = 0. M is the mass, C the damping, K the
tangent stiffness, G (r, n) the Jacobian of the constraints, l (r,) the changes of their multipliers. X (r, n) belongs to friction
that follows constraint forces: X^T l is the change of the friction forces. Follower forces make K unsymmetric (Bolotin 1963,
ch. 1), and C need not be symmetric. A state is unstable if an s has a positive real part.

Without damping mu = -s^2 are the eigenvalues of K and M. In a thin strip the highest mu has a larger rounding error than the
lowest mu itself. Therefore eigenvalues of (K + shift M)^-1 M are computed, theta = 1/(shift + mu). Left and right vectors are y
and z. The condition number of s is |y|^T (|s^2 M|+|s C|+|K|) |z| / |y^H (2 s M + C) z|, by Tisseur and Meerbergen 2001
(doi 10.1137/S0036144500381988). Eigenvalues below their rounding error count as zero.
"""

from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.linalg import solve  # SciPy's triangular solves are twenty times slower if threads share a core
from scipy.linalg import eig, eigh
from scipy.sparse import csc_array, diags_array, issparse
from scipy.sparse.linalg import splu

from ..geometry import Array
from ..spectral.linear import Matrix
from ..spectral.scene import CompiledScene
from . import algebra
from .algebra import EPS, LOWEST_COUNT, SPARSE_COORDINATES, has_entries, invert, is_symmetric, null_space, sparse_null_space

ROUNDING = 16 * EPS
"""Relative error of a matrix entry: a sum of some dozen products, each with a rounding error."""


@dataclass(frozen=True)
class Tangent:
    """Equations of small motions on the free coordinates x, z = free x; matrices are sparse for many coordinates.

    `free` (n, f) spans the motions that the constraints allow. `test` (n, f) spans those on which constraint forces and the
    friction that follows them do no work. `summands` (n, n) bound the summands of each entry of K, which cancel in part.
    """

    mass: Any
    damping: Any
    stiffness: Any
    free: Any
    test: Any
    summands: Any

    @classmethod
    def at(cls, scene: CompiledScene, q: Array, lam: Array) -> Self:
        """Assemble the tangent of a scene at rest at coordinates q, with multipliers lam."""
        sparse = len(q) >= SPARSE_COORDINATES
        a = scene.assemble(q, lam=lam, sparse=sparse)
        needs_dense = has_entries(a.cross) or has_entries(a.damping) or not is_symmetric(a.stiffness)
        if sparse and needs_dense:  # Lanczos's method is for symmetric matrices without damping
            sparse, a = False, scene.assemble(q, lam=lam)
        basis = sparse_null_space if sparse else null_space
        free = basis(a.jacobian, scene.units)
        test = basis(a.jacobian - a.cross, scene.units) if has_entries(a.cross) else free  # `a.cross` is X
        bounds = abs(a.stiffness).diagonal().copy()  # of the summands on the diagonal of K
        for piece in (piece for strip in scene.strips for piece in strip.pieces):
            # the stiffness across a strip is a difference of numbers as large as its axial stiffness: both get the larger entry
            x, y = piece.dofs[:2]
            bounds[x] = bounds[y] = np.maximum(bounds[x], bounds[y])
        summands = abs(a.stiffness) + (diags_array(bounds) if sparse else np.diag(bounds))
        return cls(scene.mass_at(q, sparse), a.damping, a.stiffness, free, test, summands)

    @property
    def conservative(self) -> bool:
        """True if K alone determines stability: it is symmetric, and C is symmetric and dissipates energy."""
        k, c = self.reduce(self.stiffness), self.reduce(self.damping)
        symmetric = is_symmetric(k) and is_symmetric(c)
        rounding = 1e3 * EPS * abs(c).max() if has_entries(c) else 0.0  # 1e3: a margin
        return symmetric and not (has_entries(c) and np.linalg.eigvalsh(c).min() < -rounding)

    @property
    def definite(self) -> bool:
        """True if the energy is shown to have a minimum: then nothing grows (Kelvin, Tait, Chetaev). Sparse K are not tested."""
        k = self.reduce(self.stiffness)
        if not issparse(k) and self.conservative:
            with suppress(np.linalg.LinAlgError):
                np.linalg.cholesky(k)
                return True
        return False

    def reduce(self, matrix: Matrix) -> Matrix:
        """Project a matrix onto the free coordinates."""
        return self.test.T @ matrix @ self.free


@dataclass(frozen=True)
class Spectrum:
    """Eigenvalues s (m,) [1/s] and shapes (n, m), lowest |s| first; those that decay without oscillation come last.

    Of conjugate eigenvalues the one with Im s > 0 is given, of s and -s without damping the growing one. `rounding` (m,) is
    their error [1/s], `shift` the shift with which they were computed [1/s^2].
    """

    values: Array
    shapes: Array
    rounding: Array
    shift: float = 0.0

    @property
    def neutral(self) -> Array:
        """True for eigenvalues that are zero to rounding: rigid motions, or at critical points."""
        size = np.abs(self.values)
        return (size <= self.rounding) & (size**2 <= self.shift)  # above the shift such a value is inaccurate, not zero

    @property
    def growth(self) -> Array:
        """Growth rates [1/s], real parts of s, zero below the rounding error."""
        real = self.values.real
        return np.where(np.abs(real) > self.rounding, real, 0.0)

    @property
    def stable(self) -> bool:
        """True if no small motion grows."""
        return not (self.growth > 0.0).any()


def spectrum(tangent: Tangent, known_shift: float = 0.0, count: int = LOWEST_COUNT) -> Spectrum:
    """Compute the eigenvalues of a tangent: of sparse matrices those with mu below zero and the `count` lowest above it.

    `known_shift` is the shift at a nearby state, 0 if unknown.
    """
    m, c, k = (tangent.reduce(x) for x in (tangent.mass, tangent.damping, tangent.stiffness))
    if not m.shape[0]:
        return Spectrum(np.empty(0, complex), np.empty((tangent.mass.shape[0], 0), complex), np.empty(0))
    modes = _damped_modes(tangent, m, c, k) if has_entries(c) else _undamped_modes(tangent, m, k, known_shift, count)
    values, left, right, errors_of_inverse, shift = modes
    rounding = np.maximum(errors_of_inverse, _errors_by_condition(tangent, values, tangent.test @ left, tangent.free @ right))
    decays = (values.imag == 0.0) & (values.real < -rounding)  # a damped strip has many near -1/(retardation time)
    order = np.lexsort((np.abs(values), decays))
    return Spectrum(values[order], (tangent.free @ right)[:, order], rounding[order], shift)


def _errors_by_condition(tangent: Tangent, values: Array, left: Array, right: Array) -> Array:
    """Estimate rounding errors of eigenvalues s by their condition numbers; for double ones by the square root of the rounding.

    `slope` is the derivative of y^H (s^2 M + s C + K) z by s, `mass` half the second one.
    Rounding is bounded by the same products with absolute values.
    """
    mass, damping = (np.einsum("ij,ij->j", left.conj(), matrix @ right) for matrix in (tangent.mass, tangent.damping))
    slope, error = damping + 2.0 * values * mass, np.zeros(len(values))
    for power, matrix in enumerate((tangent.summands, tangent.damping, tangent.mass)):
        error += ROUNDING * np.abs(values) ** power * np.einsum("ij,ij->j", np.abs(left), abs(matrix) @ np.abs(right))
    with np.errstate(all="ignore"):
        return np.minimum(error / np.maximum(np.abs(slope), 1e-300), np.sqrt(error / np.maximum(np.abs(mass), 1e-300)))


def _undamped_modes(tangent: Tangent, m: Matrix, k: Matrix, known: float, count: int) -> tuple[Array, Array, Array, Array, float]:
    """Solve s^2 M z + K z = 0; return s, one of s and -s, left and right vectors, errors of s, and the shift.

    The first shift is `known` or an estimate. It is changed until no mu is near -shift, where K + shift M is singular, and until
    the lowest |mu| above zero is at most 100 times the shift. The relative error of mu is about `ROUNDING` mu/shift if there are
    rigid motions, which have the largest theta, 1/shift.
    """
    symmetric = is_symmetric(k)
    k, m, next_shift = (k + k.T) / 2 if symmetric else k, (m + m.T) / 2, known or _first_shift(m, k)
    dense = algebra.modes_of_symmetric if symmetric else algebra.modes_of_unsymmetric
    find = partial(algebra.lowest_modes, count=count) if issparse(k) else dense
    for _ in range(4):  # shifts, a chosen number; the last result is taken in any case
        shift = next_shift
        mu, left, right = find(m, k, shift)
        lowest = _lowest(tangent, m, mu, left, right, shift)
        if known:  # a known shift may exceed the lowest |mu|, so that only mu near -shift counts; 0.2 is chosen
            is_away = float(np.abs(mu + shift).min()) >= 0.2 * shift
        else:
            is_away = lowest >= 1.5 * shift  # 1.5: a chosen margin
        if is_away and lowest <= 100.0 * shift:  # 100: chosen
            break
        # if a mu is near minus a known shift, go towards zero by the chosen 0.6; otherwise to half the lowest |mu|
        next_shift = 0.6 * shift if known and not is_away else 0.5 * lowest
    theta = 1.0 / np.where(mu == -shift, EPS, mu + shift)  # EPS: any small number, as 1/theta was lost in mu
    errors = _errors_of_inverse(theta, left, m @ right)  # of M (K + shift M)^-1, whose left and right vectors are y and M z
    if symmetric:
        mu, errors, right = _use_quotients(m, k, right, mu, errors, right)
        if not (issparse(k) or (errors <= 1e-4 * np.abs(mu)).all()):  # 1e-4, chosen: compute all modes once more
            order = np.argsort(mu)  # as `eigh` does; its vectors are computed from M and K, not from the inverse
            mu, errors, right = _use_quotients(m, k, eigh(k, m)[1], mu[order], errors[order], right[:, order])
        left = right
        values = np.sqrt(np.abs(mu)) * np.where(mu > 0.0, 1j, 1.0)
    else:
        values = np.sqrt(-np.asarray(mu, dtype=complex))
        values = np.where(values.imag < 0.0, -values, values)
    errors_of_s = np.minimum(errors / (2 * np.abs(values) + 1e-300), np.sqrt(errors))  # the root where s is near zero
    return values, left, right, errors_of_s, shift


def _use_quotients(
    m: Matrix, k: Matrix, trial: Array, mu: Array, errors: Array, vectors: Array
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Replace mu, errors and vectors by those of trial vectors (z^T M z = 1) where these have the smaller error.

    Their mu are Rayleigh quotients, whose errors follow from residuals.
    """
    solve_mass = splu(csc_array(m)).solve if issparse(m) else partial(solve, m)
    quotient = np.einsum("ij,ij->j", trial, k @ trial)
    residual = k @ trial - m @ trial * quotient
    error = np.sqrt(np.abs(np.einsum("ij,ij->j", residual, solve_mass(residual))))
    is_better = error < errors
    return np.where(is_better, quotient, mu), np.where(is_better, error, errors), np.where(is_better, trial, vectors)


def _errors_of_inverse(theta: Array, left: Array, right: Array) -> Array:
    """Estimate errors of 1/theta: an eigenvalue theta has the rounding of the largest times its condition |y| |z| / |y^H z|."""
    product = np.abs(np.einsum("ij,ij->j", left.conj(), right))
    condition = np.linalg.norm(left, axis=0) * np.linalg.norm(right, axis=0) / np.maximum(product, 1e-300)
    with np.errstate(all="ignore"):
        return np.asarray(ROUNDING * np.abs(theta).max() * condition / np.abs(theta) ** 2)


def _lowest(tangent: Tangent, m: Matrix, mu: Array, left: Array, right: Array, shift: float) -> float:
    """Return the smallest |mu| that is above its rounding error; the shift if there is none."""
    modal_mass, size = np.abs(np.einsum("ij,ij->j", left.conj(), m @ right)), np.abs(mu)
    rounding = ROUNDING * np.einsum("ij,ij->j", np.abs(tangent.test @ left), tangent.summands @ np.abs(tangent.free @ right))
    with np.errstate(all="ignore"):
        return float(min(size[(size * modal_mass > rounding) & np.isfinite(size)], default=shift))


def _damped_modes(tangent: Tangent, m: Array, c: Array, k: Array) -> tuple[Array, Array, Array, Array, float]:
    """Solve s^2 M z + s C z + K z = 0 by the inverse at a real shift; return s with Im s >= 0, vectors, errors, shift^2.

    With h = shift, x = (z, z'/h) has x' = A x. From (A - h) x = (b1, b2) follow the rows of the inverse, whose eigenvalues
    are theta = 1/(s - h): (K + h C + h^2 M) z = -(C + h M) b1 - h M b2 and z'/h = z + b1/h.
    """
    n, least = len(m), float(np.sqrt(_first_shift(m, k)))
    next_shift = least
    for _ in range(3):  # shifts, a chosen number; the last result is taken in any case
        shift = next_shift
        place_rows = solve(k + shift * c + shift**2 * m, np.hstack([-(c + shift * m), -shift * m]))
        rate_rows = place_rows.copy()
        rate_rows[:, :n] += np.eye(n) / shift
        theta, left, right = eig(np.vstack([place_rows, rate_rows]), left=True)
        values = shift + invert(theta)
        upper = values.imag >= 0.0
        errors = _errors_of_inverse(theta, left, right)[upper]
        # the lower half of a left vector of A is M y up to a factor, if y^H (s^2 M + s C + K) = 0
        values, left, right = values[upper], solve(m, left[n:, upper]), right[:n, upper]
        lowest = np.sqrt(_lowest(tangent, m, np.abs(values) ** 2, left, right, shift**2))
        is_near = 1.5 * shift <= lowest <= 10.0 * shift  # below the lowest |s|, by a margin, but not far
        if is_near or (shift == least and lowest <= 2.0 * least):  # the next shift would be `least` again
            break
        next_shift = max(least, 0.5 * lowest)
    return values, left, right, errors, shift**2


def _first_shift(m: Matrix, k: Matrix) -> float:
    """Estimate a first shift [1/s^2]: a thousand roundings of the highest eigenvalue, so that K + shift M is regular."""
    highest = float(np.max(np.abs(k.diagonal()) / m.diagonal()))
    return max(1e3 * EPS * highest, 1e-12)  # 1e-12: any, for a mechanism without stiffness
