"""Linear equations, null spaces and eigenvalues, dense for few unknowns and sparse for many.

Lanczos's method gives the lowest eigenvalues of K z = -s^2 M z and those below zero (Ericsson and Ruhe 1980,
doi 10.1090/S0025-5718-1980-0583502-2). The number of negative pivots of K + c M = L D L^T is the number of eigenvalues -s^2 below
-c (Sylvester's law of inertia), which shows that none is missing.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TypeAlias

import numpy as np
from scipy.linalg import eig, eigh
from scipy.sparse import block_array, block_diag, csc_array, csr_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import ArpackError, LinearOperator, SuperLU, eigsh, splu

from ..geometry import Array
from ..spectral.linear import Factors, SingularError

EPS = float(np.finfo(float).eps)
LARGE = 220
"""Number of unknowns from which matrices are sparse: both solvers take the same time at it."""
MANY = 300
"""Number of coordinates from which only the lowest eigenvalues are computed."""
COUNT = 20
"""Number of lowest eigenvalues, by default."""
SPARE = 8
"""Number of additional eigenvalues, among which the largest gap is looked for."""
CONVERGED = 1e-8
"""Tolerance of Lanczos's method: residual of an eigenvector of the inverse, over its eigenvalue."""
CUT = 1e-9
"""Damping of sparse least squares, over the largest entry: singular values far below it count as zero."""
Matrix: TypeAlias = Array | csr_array
"""Matrix, dense for few unknowns, sparse for many."""


def solve(matrix: Matrix, right: Array) -> Array:
    """Solve linear equations; by least squares if singular (redundant constraints, free motions)."""
    try:
        with np.errstate(all="ignore"):  # near a limit point it is ill-conditioned: the residual decides
            out = np.linalg.solve(matrix, right) if isinstance(matrix, np.ndarray) else Factors(matrix).solve(right)
        if np.isfinite(out).all() and np.abs(matrix @ out - right).max(initial=0.0) <= 1e-6 * np.abs(right).max(initial=1e-300):
            return np.asarray(out)
    except (np.linalg.LinAlgError, SingularError):
        pass
    if not (np.isfinite(matrix.sum()) and np.isfinite(right).all()):
        return np.full(len(right), np.nan)
    return least_squares(matrix, right, 1e-12)


def least_squares(matrix: Matrix, right: Array, cut: float) -> Array:
    """Return the least-squares solution of least norm; singular values below the cut, over the largest, count as zero.

    A sparse matrix A is solved by [[d, A], [A^T, -d]] [y; x] = [b; 0] with a small d, and two iterations of refinement.
    """
    if isinstance(matrix, np.ndarray):
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=cut)[0])
    (m, n), small = matrix.shape, CUT * float(abs(matrix).max())
    factors = Factors(block_array([[small * eye_array(m), matrix], [matrix.T, -small * eye_array(n)]]))
    out = np.zeros(n)
    for _ in range(3):
        out += factors.solve(np.concatenate([right - matrix @ out, np.zeros(n)]))[m:]
    return out


def null_space(jacobian: Array, units: Array) -> Array:
    """Compute a basis of the null space of G, with scaled coordinates."""
    if not len(jacobian):
        return np.diag(units)
    _, s, vh = np.linalg.svd(jacobian * units)
    rank = int((s > 1e-10 * s[0]).sum())
    return np.asarray(units[:, None] * vh[rank:].T)


def sparse_null_space(jacobian: csr_array, units: Array) -> csr_array:
    """Compute a sparse null space of a sparse G, block by block of rows that share coordinates."""
    scaled = csr_array(jacobian * units)
    constrained = np.unique(scaled.indices)
    rows, free = scaled[:, constrained], np.setdiff1d(np.arange(len(units)), constrained)
    _, group = connected_components(rows.T @ rows, directed=False)
    order = np.argsort(group, kind="stable")
    blocks: list[object] = [eye_array(len(free))]
    for columns in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        block = rows[:, columns].toarray()
        blocks.append(null_space(block[block.any(axis=1)], np.ones(len(columns))))
    places = np.concatenate([free, constrained[order]])
    return csr_array(units[:, None] * csr_array(block_diag(blocks))[np.argsort(places)])


def _factors(m: csr_array, k: csr_array, value: float) -> tuple[SuperLU, int]:
    """Factorise K - value M; return factors and the number of eigenvalues below the value, by the signs of the pivots."""
    moved = csc_array(k - value * m)
    factors = splu(moved, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    if (factors.perm_r != factors.perm_c).any():
        raise ArithmeticError("a pivot on the diagonal is zero")
    return factors, int((factors.U.diagonal() < 0.0).sum())


def invert(theta: Array) -> Array:
    """Return 1/theta; a large finite number where theta is rounding."""
    least = EPS**2 * np.abs(theta).max(initial=1e-300)
    return np.asarray(1.0 / np.where(np.abs(theta) < least, least, theta))


def modes_of_unsymmetric(m: Array, k: Array, shift: float) -> tuple[Array, Array, Array]:
    """Compute -s^2, left and right vectors, from the inverse of K + shift M."""
    theta, left, right = eig(np.linalg.solve(k + shift * m, m), left=True)
    return invert(theta) - shift, np.linalg.solve((k + shift * m).T, left), right


def modes_of_symmetric(m: Array, k: Array, shift: float) -> tuple[Array, Array, Array]:
    """Compute -s^2, left and right vectors, of a symmetric K."""
    moved = k + shift * m
    try:
        theta, vectors = eigh(m, moved)
    except np.linalg.LinAlgError:  # more unstable than the shift
        low = np.linalg.cholesky(m)
        inner = low.T @ np.linalg.solve(moved, low)
        theta, vectors = eigh((inner + inner.T) / 2)
        vectors = np.linalg.solve(moved, low @ vectors)
    squared = invert(theta) - shift
    vectors = vectors / np.sqrt(np.abs(np.einsum("ij,ij->j", vectors, m @ vectors)))
    return squared, vectors, vectors


def lowest_modes(m: csr_array, k: csr_array, shift: float, count: int) -> tuple[Array, Array, Array]:
    """Compute at least `count` lowest -s^2 of sparse symmetric matrices, and all below minus the shift; vectors.

    Dense matrices give all if these are too many for Lanczos's method, one is missing, or a pivot is zero.
    """
    with suppress(ArithmeticError, ArpackError):
        factors, below = _factors(m, k, -shift)
        if 2 * (below + count + SPARE) <= m.shape[0]:
            inverse, start = LinearOperator(m.shape, factors.solve), np.cos(np.arange(m.shape[0]))  # any fixed vector
            sides = [
                eigsh(m, number, m, -shift, which=which, v0=start, OPinv=inverse, tol=CONVERGED)
                for which, number in (("SA", below), ("LA", count + SPARE))
                if number
            ]
            squared, vectors = (np.concatenate(part, axis=-1) for part in zip(*sides, strict=True))
            order = np.argsort(squared)
            squared, ends = squared[order], np.arange(below + count, len(squared))
            kept = int(ends[np.argmax(squared[ends] - squared[ends - 1])])
            if _factors(m, k, 0.5 * (squared[kept - 1] + squared[kept]))[1] == kept:
                return squared[:kept], vectors[:, order[:kept]], vectors[:, order[:kept]]
    return modes_of_symmetric(m.toarray(), k.toarray(), shift)


def has_entries(matrix: Matrix) -> bool:
    """Return True if an entry is not zero."""
    return bool(matrix.any() if isinstance(matrix, np.ndarray) else matrix.count_nonzero())


def is_symmetric(matrix: Matrix) -> bool:
    """Return True if a matrix is symmetric to rounding."""
    return bool(not min(matrix.shape) or abs(matrix - matrix.T).max() <= 1e3 * EPS * abs(matrix).max())
