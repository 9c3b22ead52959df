"""Stress-free shapes of a `buckler.elastica.strip.Strip`: the tangent angle as a function of arc length, from simple data.

Each is a function of s, arc length over L, 0 to 1, that gives the tangent angle in rad. The strip sets out from (0, 0); its
chord is the x axis for the arches here.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np
from numpy.polynomial import chebyshev

from buckler.elastica.collocation import Angle, Array, integration, require

Curve = Callable[[Array], tuple[Array, Array]]
"""x and y, in any unit of length, of an array of parameters from 0 to 1."""
TERMS = 128


def circle(half_angle: float) -> Angle:
    """Circular arc that rises from its chord at `half_angle` and comes down at the other end.

    Parameters
    ----------
    half_angle : float, half the angle that the arc subtends, rad, -pi to pi; positive bows to positive y. With the span S and the
        rise H it is 2 arctan(2 H/S); the arc's length is S half_angle/sin(half_angle).

    Raises
    ------
    ValueError
        If the angle is outside its range.
    """
    require("half_angle", half_angle, abs(half_angle) <= pi, "-pi to pi (rad)")
    return lambda s: half_angle * (1.0 - 2.0 * s)


def half_sine(rise: float) -> tuple[Angle, float]:
    """Half-sine over the chord, y0/S = rise sin(pi x/S), and its length over the span S.

    Parameters
    ----------
    rise : float, over the span, -1 to 1

    Raises
    ------
    ValueError
        If the rise is outside its range.
    """
    require("rise", rise, abs(rise) <= 1.0, "-1 to 1 (rise/span)")
    return along(lambda u: (u, rise * np.sin(pi * u)))


def along(curve: Curve, terms: int = TERMS) -> tuple[Angle, float]:
    """Tangent angle of any smooth curve, and its length in the curve's unit.

    The curve is expanded in Chebyshev polynomials of its parameter; the parameter that belongs to an arc length comes from
    Newton's method.

    Parameters
    ----------
    curve : function of an array of parameters from 0 to 1 that gives arrays x and y; smooth, and nowhere at rest
    terms : int, Chebyshev terms, 8 to 400

    Raises
    ------
    ValueError
        If a value is outside its range, the curve has a place that is no number, stands still, or is too rough for `terms`.
    """
    require("terms", terms, terms in range(8, 401), "a whole number from 8 to 400")
    u = integration(terms)[0]
    places = np.array(np.broadcast_arrays(*curve(u), u)[:2], dtype=float)
    require("curve", curve, bool(np.all(np.isfinite(places))), "finite from 0 to 1")
    fits = np.linalg.solve(chebyshev.chebvander(2.0 * u - 1.0, terms - 1), places.T)
    x, y = (chebyshev.Chebyshev(fit, domain=(0.0, 1.0)) for fit in fits.T)
    rough = float(np.max(np.abs(fits[-4:])) / np.max(np.abs(fits)))
    require(
        "curve", curve, rough < 1e-10, f"smooth: its {terms} Chebyshev terms end at {rough:.1e} of the largest, not below 1e-10"
    )
    dense, dx, dy = np.linspace(0.0, 1.0, 16 * terms), x.deriv(), y.deriv()
    require("curve", curve, float(np.min(np.hypot(dx(dense), dy(dense)))) > 0.0, "nowhere at rest")
    speed = chebyshev.Chebyshev.interpolate(lambda u: np.hypot(dx(u), dy(u)), 4 * terms, domain=(0.0, 1.0))
    length = speed.integ(lbnd=0.0)
    lengths, turned, whole = length(dense), np.unwrap(np.arctan2(dy(dense), dx(dense))), float(length(1.0))

    def angle(s: Array) -> Array:
        """Tangent angle [rad] at arc lengths over the whole."""
        s = np.asarray(s, dtype=float)
        u = np.interp(s * whole, lengths, dense)
        for _ in range(4):
            u = np.clip(u - (length(u) - s * whole) / speed(u), 0.0, 1.0)
        near, exact = np.interp(u, dense, turned), np.arctan2(dy(u), dx(u))
        return exact + 2.0 * pi * np.round((near - exact) / (2.0 * pi))

    return angle, whole
