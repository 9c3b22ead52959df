"""Hertzian stiffness K of F = K d^1.5 from material and radii.

K = (4/3) E* sqrt(R), with 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2. Two convex bodies have 1/R = 1/R1 + 1/R2, a pin
in a bush 1/R = 1/R_pin - 1/R_bush. This is the rule for spheres; studies of clearance joints use it for pins too. It
holds for small contact patches. A pin that nearly fills its bush touches it over a wide arc: K d^1.5 then fails.

References
----------
H. Hertz, J. reine und angewandte Mathematik 92 (1882) 156-171, doi 10.1515/crll.1882.92.156.
K. L. Johnson, Contact Mechanics, Cambridge University Press (1985), doi 10.1017/CBO9781139171731.
"""

import math

from ..validate import number, positive


def effective_modulus(young1: float, poisson1: float, young2: float | None = None, poisson2: float | None = None) -> float:
    """Return the effective modulus E* [Pa] of two bodies in contact; the second is like the first unless given.

    Parameters
    ----------
    young1, young2 : float > 0, Pa
    poisson1, poisson2 : float, 1, 0 <= nu <= 0.5
    """
    compliance = 0.0
    second = (young1 if young2 is None else young2, poisson1 if poisson2 is None else poisson2)
    for body, (young, poisson) in ((1, (young1, poisson1)), (2, second)):
        young = positive(f"young{body}", young, "Pa")
        poisson = number(f"poisson{body}", poisson, 0.0, 0.5, "1")
        compliance += (1.0 - poisson**2) / young
    return 1.0 / compliance


def hertz_external(modulus: float, radius1: float, radius2: float) -> float:
    """Return the stiffness K [N/m^1.5] of two convex bodies: R = R1 R2/(R1 + R2).

    Parameters
    ----------
    modulus : float > 0, Pa, E* of ``effective_modulus``
    radius1, radius2 : float > 0, m
    """
    modulus = positive("modulus", modulus, "Pa")
    radius1, radius2 = positive("radius1", radius1, "m"), positive("radius2", radius2, "m")
    return 4.0 / 3.0 * modulus * math.sqrt(radius1 * radius2 / (radius1 + radius2))


def hertz_internal(modulus: float, pin: float, bush: float) -> float:
    """Return the stiffness K [N/m^1.5] of a pin in a bush: R = R_pin R_bush/(R_bush - R_pin).

    Parameters
    ----------
    modulus : float > 0, Pa, E* of ``effective_modulus``
    pin : float > 0, m, pin radius
    bush : float > pin, m, bush radius: the pin radius plus the radial clearance
    """
    modulus, pin = positive("modulus", modulus, "Pa"), positive("pin", pin, "m")
    bush = number("bush", bush, pin, math.inf, "m", open_low=True)
    return 4.0 / 3.0 * modulus * math.sqrt(pin * bush / (bush - pin))
