"""Stress-free shapes of a `buckler.elastica.strip.Strip`: the tangent angle as a function of arc length, from simple data.

Each is a function of s, arc length over L, 0 to 1, that gives the tangent angle in rad. The strip sets out from (0, 0); its
chord is the x axis for the arches here.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np
from numpy.polynomial import chebyshev

from buckler.elastica.collocation import Angle, Array, integration

Curve = Callable[[Array], tuple[Array, Array]]
"""x and y, in any unit of length, of an array of parameters from 0 to 1."""
TERMS = 128


def circle(half_angle: float) -> Angle:
    """Circular arc that rises from its chord at half the angle that it subtends, rad; positive bows to positive y.

    With the span S and the rise H the angle is 2 arctan(2 H/S); the arc's length is S half_angle/sin(half_angle).
    """
    return lambda s: half_angle * (1.0 - 2.0 * s)


def half_sine(rise: float) -> tuple[Angle, float]:
    """Half-sine over the chord, y0/S = rise sin(pi x/S), and its length over the span S."""
    return along(lambda u: (u, rise * np.sin(pi * u)))


def along(curve: Curve) -> tuple[Angle, float]:
    """Tangent angle of any smooth curve, nowhere at rest, and its length in the curve's unit.

    The curve is expanded in Chebyshev polynomials of its parameter; the parameter that belongs to an arc length comes from
    Newton's method.
    """
    u = integration(TERMS)[0]
    places = np.array(np.broadcast_arrays(*curve(u), u)[:2], dtype=float)
    fits = np.linalg.solve(chebyshev.chebvander(2.0 * u - 1.0, TERMS - 1), places.T)
    x, y = (chebyshev.Chebyshev(fit, domain=(0.0, 1.0)) for fit in fits.T)
    dense, dx, dy = np.linspace(0.0, 1.0, 16 * TERMS), x.deriv(), y.deriv()
    speed = chebyshev.Chebyshev.interpolate(lambda u: np.hypot(dx(u), dy(u)), 4 * TERMS, domain=(0.0, 1.0))
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
