"""Hierarchical polynomials of the spectral strips on [-1, 1]; the first two members are linear and carry the end values.

    N_0 = (1 - x)/2,    N_1 = (1 + x)/2,    N_k = (P_k - P_(k-2))/sqrt(2 (2 k - 1)),    k >= 2,

P_k the Legendre polynomials. From k = 2 on N_k is an integrated Legendre polynomial, zero at both ends, and the slopes N_k' are
orthonormal.

References
----------
B. Szabo, I. Babuska, Finite Element Analysis (1991), ch. 3 (ISBN 978-0-471-50273-9).
"""

from collections.abc import Callable
from functools import cache, lru_cache

import numpy as np
from numpy.polynomial import legendre

from ..geometry import Array


def basis(degree: int, x: Array, derivative: int = 0) -> Array:
    """Return N_0 ... N_degree at x, or their derivatives of order `derivative`; read-only, (points, degree + 1)."""
    return _members(degree, np.asarray(x, dtype=float).tobytes(), derivative)


@lru_cache(maxsize=4096)
def _members(degree: int, x: bytes, derivative: int) -> Array:
    """Evaluate the members; x is given as bytes, which the cache can compare: all mechanisms use the same points."""
    values: Array = legendre.legval(np.frombuffer(x), _series(degree, derivative)).T
    values.flags.writeable = False
    return values


@cache
def _series(degree: int, derivative: int) -> Array:
    """Return the Legendre coefficients of the members or of their derivatives, (terms, degree + 1); the degree is at least 1."""
    series = np.zeros((degree + 1, degree + 1))
    series[:2, :2] = [[0.5, 0.5], [-0.5, 0.5]]
    for k in range(2, degree + 1):
        series[[k, k - 2], k] = np.array([1.0, -1.0]) / np.sqrt(2 * (2 * k - 1))
    return legendre.legder(series, derivative)


@cache
def gauss(count: int) -> tuple[Array, Array]:
    """Return points and weights of Gauss's rule on [-1, 1], read-only."""
    points, weights = legendre.leggauss(count)
    points.flags.writeable = weights.flags.writeable = False
    return points, weights


def fit(degree: int, function: Callable[[Array], Array], ends: tuple[float, float]) -> Array:
    """Fit a function of x on [-1, 1] with the values `ends` at -1 and 1, its slope by least squares; coefficients (degree + 1,).

    The slopes of the members from k = 2 on are orthonormal. So their coefficients are the integrals of rest' N_k', where rest is
    the function less its linear part. By parts these are the integrals of -rest N_k''.
    """
    x, w = gauss(degree + 24)  # 24, chosen: at degree 8 the coefficients of a sine of 16 half waves are exact to rounding
    rest = function(x) - basis(1, x) @ np.array(ends)
    out = np.empty(degree + 1)
    out[:2] = ends
    if degree >= 2:
        out[2:] = -(basis(degree, x, 2)[:, 2:] * w[:, None]).T @ rest
    return out
