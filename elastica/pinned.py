"""The inextensible pinned-pinned strip on its first buckling branch, in closed form.

A straight, inextensible, unshearable strip of length L and bending stiffness E I is pressed between two
pins. Everything here is normalised by L and E I:

    u = end shortening / L,    p = P L^2 / (E I),    s = arc length / L.

Let alpha be the end angle, m = sin^2(alpha/2) the elliptic parameter and m1 = 1 - m. Then:

    p = 4 K(m)^2;                                                              (1)
    u = 2 - 2 E(m)/K(m) = 2 m D(m)/K(m);                                       (2)
    y_mid / L = sqrt(m)/K(m).                                                  (3)

Here B and D are the associate complete integrals: the quarter-period integrals of cos^2 (B) and sin^2 (D)
over sqrt(1 - m sin^2). So K = B + D. Written with B and D no formula below subtracts nearly equal numbers.
The unknown of both inversions is w = -ln(m1): it is u to leading order for a nearly straight strip, keeps
m1 to full relative precision for a nearly closed loop, and makes K and K/E almost linear.

Scalars in give a float, arrays give arrays of the broadcast shape. A shortening is end shortening over length, 0 to 1.7;
above 1 the ends of the strip have crossed. What lies outside its range, or is no number, raises ValueError.

References
----------
A. E. H. Love, A Treatise on the Mathematical Theory of Elasticity, 4th ed., arts. 262-263.
B. C. Carlson, Numerical computation of real or complex elliptic integrals, doi 10.1007/BF02198293.
NIST Digital Library of Mathematical Functions, 19.2, 19.25 (integrals) and 22.2, 22.16 (functions).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Reals = Any
"""A float for a float, an array for an array; NumPy has no type for both."""

Array = NDArray[np.float64]

LOAD_CRITICAL = float(np.pi**2)
"""Euler load, P L^2/(E I): the buckled branch starts here."""
LOAD_MAX = 180.0
"""Largest load that `shortening` takes, P L^2/(E I), a nearly closed loop: a little above load(1.7) = 177.8."""
SHORTENING_MAX = 1.7
"""Largest end shortening over length."""
_TINY, _HUGE = float(np.finfo(float).tiny), float(np.finfo(float).max)


class _Integrals(NamedTuple):
    """Complete elliptic integrals K and B at the parameter m, with m1 = 1 - m."""

    m: Array
    m1: Array
    K: Array
    B: Array

    @property
    def D(self) -> Array:
        """Associate integral D = K - B."""
        return self.K - self.B

    @property
    def shortening(self) -> Array:
        """End shortening over length, equation (2)."""
        return 2.0 * self.m * self.D / self.K


def load(shortening: ArrayLike) -> Reals:
    """Compute the axial load P L^2/(E I) that holds the buckled strip at an end shortening, pi^2 or more: equation (1)."""
    return _plain(4.0 * _at_shortening(shortening).K ** 2)


def shortening(load: ArrayLike) -> Reals:
    """Compute the end shortening of the buckled strip under an axial load P L^2/(E I), pi^2 (as `LOAD_CRITICAL`) to 180.

    It is the inverse of `load`. Below the Euler load the strip is straight and has no buckled branch, hence the lower limit.
    Just above it du/dp = 2/pi^2, so one rounding of the load moves the shortening by 4e-16, however small that is.
    """
    p = require_range("load", load, LOAD_CRITICAL, LOAD_MAX, "P L^2/(E I)")
    target = np.sqrt(p) / 2.0  # K(m), by equation (1)

    def step(w: Array) -> Array:
        """Compute Newton's step of w; dK/dw = B/2."""
        at = _integrals(w)
        return (at.K - target) / (at.B / 2.0)

    start = (target - np.pi / 2.0) * 8.0 / np.pi  # by the tangent at w = 0: above the root, as K is convex
    return _plain(_integrals(_newton(step, start)).shortening)


def stiffness(shortening: ArrayLike) -> Reals:
    """Compute the tangent stiffness dp/du, dP/dU times L^3/(E I), of the buckled strip; pi^2/2 at the onset of buckling.

    It is dp/dm = 4 K B/m1 over du/dm = 1 + (m/m1) (B/K)^2.
    """
    at = _at_shortening(shortening)
    return _plain(4.0 * at.K**3 * at.B / (at.m1 * at.K**2 + at.m * at.B**2))


def energy(shortening: ArrayLike) -> Reals:
    """Compute the bending energy times L/(E I), W = 8 m K B; the load is its derivative, dW/du = p."""
    at = _at_shortening(shortening)
    return _plain(8.0 * at.m * at.K * at.B)


def end_angle(shortening: ArrayLike) -> Reals:
    """Compute the angle alpha [rad], 0 to pi, between the strip's end tangent and its chord: tan^2(alpha/2) = m/m1."""
    at = _at_shortening(shortening)
    return _plain(2.0 * np.arctan2(np.sqrt(at.m), np.sqrt(at.m1)))


def mid_deflection(shortening: ArrayLike) -> Reals:
    """Compute the deflection of mid-span from the chord over length, equation (3); at most 0.40314, at u = 0.8053."""
    at = _at_shortening(shortening)
    return _plain(np.sqrt(at.m) / at.K)


def curvature_max(shortening: ArrayLike) -> Reals:
    """Compute the curvature at mid-span times length, 4 sqrt(m) K: the moment p y_mid, largest along the strip."""
    at = _at_shortening(shortening)
    return _plain(4.0 * np.sqrt(at.m) * at.K)


def surface_stress(shortening: ArrayLike, thickness: ArrayLike, length: ArrayLike, modulus: ArrayLike) -> Reals:
    """Compute the largest bending stress [Pa], E h kappa/2, at the surface of mid-span.

    Thickness and length [m] and Young's modulus [Pa] are positive. The direct stress P/A is left out with the extensibility that
    would go with it. It is smaller by the order of h/L, except just after buckling, where the bending stress is near zero.
    """
    h = require_range("thickness", thickness, _TINY, _HUGE, "m")
    L = require_range("length", length, _TINY, _HUGE, "m")
    E = require_range("modulus", modulus, _TINY, _HUGE, "Pa")
    return _plain(E * h / (2.0 * L) * curvature_max(shortening))


def shape(shortening: ArrayLike, s: ArrayLike) -> tuple[Reals, Reals, Reals]:
    """Compute the centreline of the buckled strip, bowed towards positive y over its chord from (0, 0) to (1 - u, 0).

    Jacobi's functions have the argument v = 2 K s and the parameter m; R_D is Carlson's:

        x = s - (m/K) (sn cd + sn^3 R_D(cn^2, dn^2, 1)/3),   y = sqrt(m m1) sd/K,   sin(theta/2) = sqrt(m) cd.

    They are evaluated from the nearer end, so that both ends are exact: the far half is the mirror image.

    The arc length over length `s`, 0 to 1, is broadcast against `shortening`. Returned are x and y over length, and the tangent
    angle theta to the chord [rad], +alpha at s = 0 and -alpha at s = 1.
    """
    from scipy import special  # it takes a while to load, and a force law does without

    arc = require_range("s", s, 0.0, 1.0, "arc length/L")
    m, m1, K, _ = at = _at_shortening(shortening)
    nearer = np.minimum(arc, 1.0 - arc)
    sn, cn, dn, _ = special.ellipj(2.0 * K * nearer, m)
    # R_D and not scipy's ellipeinc, which jumps by up to pi/4 at isolated amplitudes
    near = nearer - m / K * (sn * cn / dn + sn**3 * special.elliprd(cn**2, dn**2, 1.0) / 3.0)
    x = np.where(arc <= 0.5, near, 1.0 - at.shortening - near)
    y = np.sqrt(m * m1) * sn / (dn * K)
    theta = np.sign(0.5 - arc) * 2.0 * np.arcsin(np.sqrt(m) * cn / dn)
    return _plain(x), _plain(y), _plain(theta)


def _integrals(w: Array) -> _Integrals:
    """Compute the integrals at m1 = exp(-w), with B = (E - m1 K)/m = m1 R_D(0, 1, m1)/3 by DLMF 19.25.1."""
    from scipy import special

    m1 = np.exp(-w)
    return _Integrals(-np.expm1(-w), m1, special.ellipkm1(m1), m1 / 3.0 * special.elliprd(0.0, 1.0, m1))


def _at_shortening(shortening: ArrayLike) -> _Integrals:
    """Invert equation (2) for w by Newton on K/(2 E) = 1/(2 - u), whose slope is about 1/4 throughout."""
    target = require_range("shortening", shortening, 0.0, SHORTENING_MAX, "end shortening/L")

    def step(w: Array) -> Array:
        """Compute Newton's step of w."""
        at = _integrals(w)
        slope = at.m1 + at.m * (at.B / at.K) ** 2  # du/dw
        return (at.shortening - target) * (2.0 - at.shortening) / ((2.0 - target) * slope)

    return _integrals(_newton(step, 2.0 * target / (2.0 - target)))


def _newton(step: Callable[[Array], Array], w: Array) -> Array:
    """Subtract steps until the next one would be below rounding: they shrink quadratically."""
    for _ in range(10):
        change = step(w)
        w = w - change
        if np.all(np.abs(change) <= 1e-8 * w + 4e-15):  # 4e-15 is chosen, for w near 0
            return w
    raise ArithmeticError(f"Newton iteration for the elliptic parameter left a step of {np.max(np.abs(change)):.1e}")


def require_range(name: str, value: ArrayLike, low: float, high: float, unit: str) -> Array:
    """Return the value as an array; raise a ValueError with its first number outside a range."""
    array = np.asarray(value, dtype=float)
    wrong = ~((array >= low) & (array <= high))  # true for NaN as well
    if np.any(wrong):
        raise ValueError(f"{name} = {array[wrong].flat[0]} is outside {low:.17g} to {high:.17g} ({unit})")
    return array


def _plain(value: Reals) -> Reals:
    return float(value) if np.ndim(value) == 0 else value
