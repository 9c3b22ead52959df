"""Sparse null spaces, and the lowest eigenvalues of sparse symmetric matrices.

Lanczos's method gives the lowest eigenvalues of K z = -s^2 M z and those below zero. A factorisation K + c M = L D L^T has as
many negative pivots as there are eigenvalues -s^2 below -c (Sylvester's law of inertia). The count shows that none is missing.

References
----------
T. Ericsson, A. Ruhe, The spectral transformation Lanczos method, Math. Comp. 35 (1980) 1251-1268,
doi 10.1090/S0025-5718-1980-0583502-2.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import block_diag, csc_array, csr_array, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import ArpackError, LinearOperator, SuperLU, eigsh, splu

from ..geometry import Array

EPS = float(np.finfo(float).eps)
LARGE = 220
"""Number of unknowns from which matrices are sparse: both solvers take the same time there."""
MANY = 300
"""Number of coordinates from which only the lowest eigenvalues are computed."""
COUNT = 20
"""Number of lowest eigenvalues, by default."""
SPARE = 8
"""Number of eigenvalues computed in addition."""
CONVERGED = 1e-8
"""Residual of an inverse's eigenvector, over its eigenvalue."""


def null_space(jacobian: Array, units: Array) -> Array:
    """Compute columns that span the z with G z = 0, each coordinate in its unit."""
    if not len(jacobian):
        return np.diag(units)
    _, s, vh = np.linalg.svd(jacobian * units)
    rank = int((s > 1e-10 * s[0]).sum())
    return np.asarray(units[:, None] * vh[rank:].T)


def sparse_null_space(jacobian: csr_array, units: Array) -> csr_array:
    """Compute a sparse null space of a sparse G, block by block of rows that share coordinates."""
    scaled = csr_array(jacobian * units)
    held = np.unique(scaled.indices)
    rows, at = scaled[:, held], np.setdiff1d(np.arange(len(units)), held)
    _, group = connected_components(rows.T @ rows, directed=False)
    order = np.argsort(group, kind="stable")
    spans: list[Any] = [eye_array(len(at))]
    for one in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        some = rows[:, one].toarray()
        spans.append(null_space(some[some.any(axis=1)], np.ones(len(one))))
    places = np.concatenate([at, held[order]])
    return csr_array(units[:, None] * csr_array(block_diag(spans))[np.argsort(places)])


def nearest(m: csr_array, k: csr_array, shift: float, count: int) -> tuple[Array, Array, Array] | None:
    """Compute at least `count` lowest -s^2 of sparse symmetric matrices, and all below minus the shift; vectors.

    Returns None where these are too many for Lanczos's method, or a pivot is zero.
    """
    size = m.shape[0]
    while 4 * (count + SPARE) < size:
        try:
            factors, below = _factors(m, k, -shift)
            if below + count + SPARE > size // 2:
                break
            squared, vectors = _lanczos(m, factors, shift, below, count + SPARE)
            ends = np.arange(below + count, len(squared))
            kept = int(ends[np.argmax(squared[ends] - squared[ends - 1])])
            if _factors(m, k, 0.5 * (squared[kept - 1] + squared[kept]))[1] == kept:
                return squared[:kept], vectors[:, :kept], vectors[:, :kept]
        except (ArithmeticError, ArpackError):
            break
        count *= 2
    return None


def _lanczos(m: csr_array, factors: SuperLU, shift: float, below: int, above: int) -> tuple[Array, Array]:
    """Compute the -s^2 nearest to minus the shift, ascending, on both sides, and vectors, by Lanczos's method."""
    inverse, start = LinearOperator(m.shape, factors.solve), np.cos(np.arange(m.shape[0]))  # any fixed vector
    sides = [
        eigsh(m, count, m, -shift, which=which, v0=start, OPinv=inverse, tol=CONVERGED)
        for which, count in (("SA", below), ("LA", above))
        if count
    ]
    squared, vectors = (np.concatenate(part, axis=-1) for part in zip(*sides, strict=True))
    order = np.argsort(squared)
    return squared[order], vectors[:, order]


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
