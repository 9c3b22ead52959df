"""Largest force of an impact on a linear stop with hysteresis, free or with a constant force on the body.

A mass m meets the stop F = K d (1 + chi d'/v0) at speed v0. Let S = v0 sqrt(K m), the depth be d = x v0 sqrt(m/K), the speed
d' = w v0 and the force F = f S. Then

    x dx = -w dw/(1 + chi w),     f = x (1 + chi w).                                (1)

The force is largest where df = 0, at w = chi x^2. The integral of (1) from w = 1 is x^2 = 2 E(w), with E(w) the integral of
s/(1 + chi s) ds from w to 1. With y = 1 + chi w these two equations give

    3 y/2 - ln y = 3/2 + chi - ln(1 + chi).                                         (2)

The left side is convex, so Newton's method from y = 1 + chi falls onto the root. A constant force Q on the mass, towards the
stop, adds (Q/S) dx/(1 + chi w) to the right side of (1). To first order in Q it increases x^2/2 by I Q/S, with I the
integral of s/((1 + chi s)^2 x(s)) ds from w to 1. As f is stationary in w, the largest force follows from x and y at the peak:

    F = c0 S + c1 Q,     c0 = x y,     c1 = y I/x.                                  (3)

For Q = 0 this is exact; for chi = 0 it is F = Q + sqrt(Q^2 + S^2). Equation (4) has both limits and equals (3) to first order:

    F = c1 Q + sqrt[(c1 Q)^2 + (c0 S)^2].                                           (4)

It errs by 0.2 % up to Q = 0.3 S and by 0.6 % up to 0.5 S, if the law delivers a restitution of 0.2 or more. The law is that of
Hunt and Crossley, doi 10.1115/1.3423596.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Array

_ELASTIC = 1e-8
"""Factor chi below which w = chi is used for the root of (2), with an error of chi^2."""
_GAUSS = [((node + 1.0) / 2.0, weight / 2.0) for node, weight in zip(*np.polynomial.legendre.leggauss(12), strict=True)]
"""Nodes and weights of Gauss quadrature on [0, 1]; c0 and c1 have relative errors below 1e-12 for chi of 0 to 1000."""


def peak_factors(chi: ArrayLike) -> tuple[Any, Any]:
    """Return c0 and c1 of equation (4) for the largest force on a linear stop, for chi >= 0 [1]; ValueError for others."""
    chi = np.asarray(chi, dtype=float)
    if not np.all((chi >= 0.0) & (chi < np.inf)):
        raise ValueError(f"chi = {chi[~((chi >= 0.0) & (chi < np.inf))].flat[0]}: must lie in [0, inf) (hysteresis factor)")
    y, right_side = 1.0 + chi, 1.5 + chi - np.log1p(chi)
    for _ in range(8):  # each doubles the number of right digits; six are enough for chi of 0 to 1e15
        y = y - (1.5 * y - np.log(y) - right_side) / (1.5 - 1.0 / y)
    w = np.where(chi > _ELASTIC, (y - 1.0) / np.maximum(chi, _ELASTIC), chi)
    x = _depth(w, chi)
    c0, c1 = x * (1.0 + chi * w), (1.0 + chi * w) * _load_integral(w, chi) / x
    return (float(c0), float(c1)) if chi.ndim == 0 else (c0, c1)


def _depth(w: Array, chi: Array) -> Array:
    """Compute x(w) = sqrt(2 E(w)) without the force Q by Gauss quadrature; the closed form of E would be 0/0 for chi = 0."""
    total = np.zeros_like(w)
    for node, weight in _GAUSS:
        s = w + (1.0 - w) * node
        total += weight * s / (1.0 + chi * s)
    return np.sqrt(2.0 * (1.0 - w) * total)


def _load_integral(w: Array, chi: Array) -> Array:
    """Compute the integral I by Gauss quadrature in t, with s = 1 - (1 - w) t^2, which removes the pole of 1/x at s = 1."""
    total = np.zeros_like(w)
    for node, weight in _GAUSS:
        s = 1.0 - (1.0 - w) * node**2
        total += weight * 2.0 * node * s / ((1.0 + chi * s) ** 2 * _depth(s, chi))
    return (1.0 - w) * total
