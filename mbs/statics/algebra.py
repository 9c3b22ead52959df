"""Linear equations, null spaces and eigenvalues, with dense matrices for few unknowns and sparse ones for many.

G is the Jacobian of the constraints, M the mass matrix, K the tangent stiffness. Lanczos's method gives the lowest eigenvalues
mu = -s^2 of K z = mu M z (Ericsson and Ruhe 1980, doi 10.1090/S0025-5718-1980-0583502-2). A shift c > 0 [1/s^2] makes K + c M
regular. By Sylvester's law of inertia K + c M = L D L^T has as many negative pivots as there are eigenvalues below -c.
"""

from contextlib import suppress
from functools import partial
from typing import TypeAlias

import numpy as np
from scipy.linalg import eig, eigh
from scipy.sparse import block_array, block_diag, csc_array, csr_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import ArpackError, LinearOperator, SuperLU, eigsh, splu

from ..geometry import Array
from ..spectral.linear import Factors, SingularError

EPS = float(np.finfo(float).eps)
"""Relative rounding of floating-point numbers."""
SPARSE_COORDINATES = 300
"""Number of coordinates from which M and K are sparse, and only the lowest eigenvalues are computed: chosen."""
LOWEST_COUNT = 20
"""Default number of lowest eigenvalues."""
DEPENDENT = 1e-10
"""Singular value of a scaled Jacobian, over the largest, below which rows count as dependent: far above rounding."""
Matrix: TypeAlias = Array | csr_array
"""Matrix, dense for few unknowns, sparse for many."""


def solve(matrix: Matrix, right: Array) -> Array:
    """Solve linear equations, by least squares if the matrix is singular; return nan for invalid entries."""
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError, SingularError):
        out = np.linalg.solve(matrix, right) if isinstance(matrix, np.ndarray) else Factors(matrix).solve(right)
        largest_residual, largest = np.abs(matrix @ out - right).max(initial=0.0), np.abs(right).max(initial=1e-300)
        # a residual is about EPS times the condition number: 1e-6 allows one of 5e9, as near a limit point
        if np.isfinite(out).all() and largest_residual <= 1e-6 * largest:
            return np.asarray(out)
    if not (np.isfinite(matrix.sum()) and np.isfinite(right).all()):
        return np.full(len(right), np.nan)
    return least_squares(matrix, right, 1e-12)  # smaller singular values, over the largest, are rounding


def least_squares(matrix: Matrix, right: Array, cut: float) -> Array:
    """Return the least-squares solution of least norm.

    In a dense matrix singular values below the cut, over the largest, count as zero. A sparse matrix A has no such cut: solve
    [[d, A], [A^T, -d]] [y; x] = [b; 0] with a damping d of 1e-9 times the largest entry. Two more solutions, with b - A x for b,
    remove the effect of d on x.
    """
    if isinstance(matrix, np.ndarray):
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=cut)[0])
    (m, n), damping = matrix.shape, 1e-9 * float(abs(matrix).max())
    factors = Factors(block_array([[damping * eye_array(m), matrix], [matrix.T, -damping * eye_array(n)]]))
    out = np.zeros(n)
    for _ in range(3):
        out += factors.solve(np.concatenate([right - matrix @ out, np.zeros(n)]))[m:]
    return out


def null_space(jacobian: Array, units: Array) -> Array:
    """Compute a basis of the null space of G, (n, free), orthonormal in the units of the coordinates."""
    if not len(jacobian):
        return np.diag(units)
    _, values, right = np.linalg.svd(jacobian * units)
    rank = int((values > DEPENDENT * values[0]).sum())
    return np.asarray(units[:, None] * right[rank:].T)


def sparse_null_space(jacobian: csr_array, units: Array) -> csr_array:
    """Compute a basis of the null space of a sparse G, separately for each group of rows that share coordinates."""
    scaled = csr_array(jacobian * units)
    constrained = np.unique(scaled.indices)
    rows, free = scaled[:, constrained], np.setdiff1d(np.arange(len(units)), constrained)
    _, group = connected_components(rows.T @ rows, directed=False)
    order = np.argsort(group, kind="stable")
    blocks: list[object] = [eye_array(len(free))]
    for columns in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        block = rows[:, columns].toarray()
        blocks.append(null_space(block[block.any(axis=1)], np.ones(len(columns))))  # the rows are scaled already
    coordinates = np.concatenate([free, constrained[order]])  # of the rows of the block diagonal, which argsort puts in order
    return csr_array(units[:, None] * csr_array(block_diag(blocks))[np.argsort(coordinates)])


def _factorise(m: csr_array, k: csr_array, bound: float) -> tuple[SuperLU, int]:
    """Factorise K - bound M; return factors and the number of eigenvalues below the bound, by the signs of the pivots."""
    shifted = csc_array(k - bound * m)
    factors = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    if (factors.perm_r != factors.perm_c).any():
        raise ArithmeticError("a pivot on the diagonal is zero")
    return factors, int((factors.U.diagonal() < 0.0).sum())


def invert(values: Array) -> Array:
    """Return inverse values; a large finite number where a value is zero."""
    least = EPS**2 * np.abs(values).max(initial=1e-300)  # far below their rounding error: it only avoids a division by zero
    return np.asarray(1.0 / np.where(np.abs(values) < least, least, values))


def modes_of_unsymmetric(m: Array, k: Array, shift: float) -> tuple[Array, Array, Array]:
    """Compute eigenvalues mu, left and right vectors of K z = mu M z, by theta = 1/(shift + mu) of (K + shift M)^-1 M."""
    theta, left, right = eig(np.linalg.solve(k + shift * m, m), left=True)
    left = np.linalg.solve((k + shift * m).T, left)  # from y^H (K + shift M)^-1 M = theta y^H to left vectors of K and M
    return invert(theta) - shift, left, right


def modes_of_symmetric(m: Array, k: Array, shift: float) -> tuple[Array, Array, Array]:
    """Compute eigenvalues mu, left and right vectors of K z = mu M z with a symmetric K; the modal mass z^T M z is 1."""
    shifted = k + shift * m
    try:
        theta, vectors = eigh(m, shifted)
    except np.linalg.LinAlgError:  # an eigenvalue is below minus the shift: K + shift M is not definite
        factor = np.linalg.cholesky(m)  # M = L L^T: L^T (K + shift M)^-1 L y = theta y, and z = (K + shift M)^-1 L y
        inverse = factor.T @ np.linalg.solve(shifted, factor)
        theta, vectors = eigh((inverse + inverse.T) / 2)
        vectors = np.linalg.solve(shifted, factor @ vectors)
    mu = invert(theta) - shift
    modal_masses = np.einsum("ij,ij->j", vectors, m @ vectors)
    vectors = vectors / np.sqrt(np.abs(modal_masses))  # abs: rounding may give a mode without mass a negative one
    return mu, vectors, vectors


def lowest_modes(m: csr_array, k: csr_array, shift: float, count: int) -> tuple[Array, Array, Array]:
    """Compute the lowest eigenvalues mu of sparse symmetric matrices, and left and right vectors, by Lanczos's method.

    These are all mu below -shift and at least `count` above it. If the method misses one, if too many are wanted, or if a pivot
    is zero, compute all from dense matrices.
    """
    with suppress(ArithmeticError, ArpackError):
        factors, below = _factorise(m, k, -shift)
        wanted, spare = below + count, 8  # chosen: a result ends at the widest gap among the spare ones, where a count is certain
        if 2 * (wanted + spare) <= m.shape[0]:  # chosen: more than half are too many
            inverse, start = LinearOperator(m.shape, factors.solve), np.cos(np.arange(m.shape[0]))  # any fixed vector
            lanczos = partial(eigsh, m, M=m, sigma=-shift, v0=start, OPinv=inverse, tol=1e-8)  # of the first m the shape is read
            mu, vectors = lanczos(k=count + spare, which="LA")  # the largest 1/(mu + shift) belong to mu above -shift
            if below:
                mu_below, vectors_below = lanczos(k=below, which="SA")  # and the smallest to mu below it
                mu, vectors = np.append(mu_below, mu), np.hstack([vectors_below, vectors])
            order = np.argsort(mu)
            mu, vectors = mu[order], vectors[:, order]
            kept = wanted + int(np.argmax(np.diff(mu[wanted - 1 :])))  # number of eigenvalues below the largest gap
            middle = 0.5 * (mu[kept - 1] + mu[kept])  # farthest from eigenvalues, so that the count is certain
            _, count_below = _factorise(m, k, middle)
            if count_below == kept:
                return mu[:kept], vectors[:, :kept], vectors[:, :kept]
    return modes_of_symmetric(m.toarray(), k.toarray(), shift)


def has_entries(matrix: Matrix) -> bool:
    """Return True if an entry is not zero."""
    return bool(matrix.any() if isinstance(matrix, np.ndarray) else matrix.count_nonzero())


def is_symmetric(matrix: Matrix) -> bool:
    """Return True if a matrix is symmetric to rounding."""
    return bool(not min(matrix.shape) or abs(matrix - matrix.T).max() <= 1e3 * EPS * abs(matrix).max())
