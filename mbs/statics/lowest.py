"""What statics of many unknowns need: sparse null spaces, and the lowest eigenvalues of sparse symmetric matrices.

Lanczos's method gives the lowest eigenvalues of K z = -s^2 M z and those below zero. A
factorisation K + c M = L D L^T has as many negative pivots as there are eigenvalues -s^2 below -c (Sylvester's law of inertia):
that tells how many grow, and that none is missing.

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
"""Unknowns from which on matrices are sparse: there both ways take as long."""
MANY = 300
"""Coordinates from which on the lowest eigenvalues of sparse matrices are found alone."""
COUNT = 20
"""How many of them, where nothing else is asked."""
SPARE = 8
"""How many more are sought than are asked for."""
CONVERGED = 1e-8
"""Residual of an inverse's eigenvector, over its eigenvalue."""


def null_space(jacobian: Array, units: Array) -> Array:
    """Columns that span the z with G z = 0, each coordinate in its unit."""
    if not len(jacobian):
        return np.diag(units)
    _, s, vh = np.linalg.svd(jacobian * units)
    rank = int((s > 1e-10 * s[0]).sum())
    return np.asarray(units[:, None] * vh[rank:].T)


def sparse_null_space(jacobian: csr_array, units: Array) -> csr_array:
    """The same of a sparse G, sparse: rows that hold no coordinate in common are looked at apart."""
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
    """At least so many of the lowest -s^2 of sparse symmetric matrices, and all below the shift's negative; vectors.

    None where these are too many for it, or a pivot is zero.
    """
    size = m.shape[0]
    while 4 * (count + SPARE) < size:
        try:
            factors, below = _factors(m, k, -shift)
            if below + count + SPARE > size // 2:
                break
            squared, vectors = _beside(m, factors, shift, below, count + SPARE)
            ends = np.arange(below + count, len(squared))
            kept = int(ends[np.argmax(squared[ends] - squared[ends - 1])])
            if _factors(m, k, 0.5 * (squared[kept - 1] + squared[kept]))[1] == kept:
                return squared[:kept], vectors[:, :kept], vectors[:, :kept]
        except (ArithmeticError, ArpackError):
            break
        count *= 2
    return None


def _beside(m: csr_array, factors: SuperLU, shift: float, below: int, above: int) -> tuple[Array, Array]:
    """The -s^2 nearest to the negative of a shift, ascending, so many on each side, and vectors, by Lanczos's method."""
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
    """Factors of K - value M, and how many eigenvalues are below the value: as many as pivots on the diagonal are negative."""
    moved = csc_array(k - value * m)
    factors = splu(moved, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    if (factors.perm_r != factors.perm_c).any():
        raise ArithmeticError("a pivot on the diagonal is zero")
    return factors, int((factors.U.diagonal() < 0.0).sum())


def turned_over(theta: Array) -> Array:
    """1/theta; finite, far above all that is known, where theta is rounding."""
    least = EPS**2 * np.abs(theta).max(initial=1e-300)
    return np.asarray(1.0 / np.where(np.abs(theta) < least, least, theta))
