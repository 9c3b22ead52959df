"""Normal contact laws without a prescribed restitution, and Hertzian stiffness from material and radii.

The depth d [m] is positive in contact, its rate d' [m/s] is positive when penetrating. The argument `onset` [m/s] > 0 is the
approach speed at the instant of onset. A force pushes the bodies apart or is zero: no law here ever pulls. STEP(x, x0, h0, x1,
h1) is a cubic with zero slopes from h0 at x0 to h1 at x1, constant outside.

Hertzian stiffness is K = (4/3) E* sqrt(R), with 1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2. Two convex bodies have 1/R = 1/R1 +
1/R2, a pin in a bush 1/R = 1/R_pin - 1/R_bush. This rule holds for spheres; studies of clearance joints use it for pins too.
A pin that nearly fills its bush has contact over a wide arc: K d^1.5 then fails (K. L. Johnson, Contact Mechanics, Cambridge
University Press (1985), doi 10.1017/CBO9781139171731).
"""

import math
from typing import ClassVar

from ..declare import Declared, declared, quantity
from ..units import Measured
from ..validate import number, positive
from .pieces import Reals, ramp, step
from .rebound import damping_ratio, require_given, restitution_linear


class PowerLaw:
    """Base of contact laws with the elastic part K d^n of the force."""

    stiffness: float
    exponent: float

    def agree(self) -> None:
        """Raise a ValueError if the stiffness was given in N/m^n with another n than the exponent; leave a plain float."""
        if isinstance(self.stiffness, Measured) and not self.stiffness.fits(f"N/m^{self.exponent:g}"):
            raise ValueError(
                f"stiffness = {self.stiffness.given}: must be in N/m^{self.exponent:g}, as exponent = {self.exponent:g}"
            )
        object.__setattr__(self, "stiffness", float(self.stiffness))

    def elastic(self, depth: Reals) -> Reals:
        """Return K d^n [N], 0 where depth <= 0."""
        return self.stiffness * ramp(depth) ** self.exponent

    def potential(self, depth: Reals) -> Reals:
        """Return K d^(n+1) / (n+1) [J], 0 where depth <= 0."""
        return self.stiffness * ramp(depth) ** (self.exponent + 1.0) / (self.exponent + 1.0)


@declared
class Hertz(PowerLaw, Declared):
    """F = K d^1.5: elastic, without losses (Hertz 1882, doi 10.1515/crll.1882.92.156).

    For K from material and radii see ``hertz_external`` and ``hertz_internal``.

    >>> round(Hertz(1e9).force(1e-6, 0.0, 1.0), 9)  # K d^1.5
    1.0
    """

    stiffness: float = quantity("N/m^1.5", above=0, doc="K")
    exponent: ClassVar[float] = 1.5  # type: ignore[misc]

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Return the contact force [N]; independent of rate and onset speed."""
        return self.elastic(depth)

    def delivered(self, mass: float | None = None, speed: float | None = None) -> float:
        """Return the restitution delivered: 1, for every mass [kg] and speed [m/s]."""
        return 1.0


@declared
class KelvinVoigt(PowerLaw, Declared):
    """F = max(0, k d + c d'): spring and dashpot that do not pull.

    The force jumps to c d' at onset. It returns to zero at a positive depth, from which the body leaves freely. So
    ``restitution_linear`` gives the restitution, which does not depend on the speed (doi 10.1007/s10035-007-0065-z).

    >>> law = KelvinVoigt.from_restitution(1e5, restitution=0.8, mass=0.2)
    >>> round(law.delivered(mass=0.2), 9)
    0.8
    """

    stiffness: float = quantity("N/m", above=0, doc="k")
    damping: float = quantity("N s/m", low=0, doc="c")
    exponent: ClassVar[float] = 1.0  # type: ignore[misc]

    @classmethod
    def from_restitution(cls, stiffness: float, restitution: float, mass: float) -> "KelvinVoigt":
        """Return the law that delivers a restitution, 0 < e <= 1, for one effective mass m1 m2 / (m1 + m2) [kg]."""
        stiffness, mass = positive("stiffness", stiffness, "N/m"), positive("mass", mass, "kg")
        return cls(stiffness, 2.0 * damping_ratio(restitution) * math.sqrt(stiffness * mass))

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Return the contact force [N] at depth [m] and rate [m/s]; independent of the onset speed."""
        return (depth > 0.0) * ramp(self.stiffness * depth + self.damping * rate)

    def delivered(self, mass: float | None = None, speed: float | None = None) -> float:
        """Return the restitution delivered [1] to an effective mass [kg], the same for every speed."""
        mass = require_given("mass", mass, "kg", self)
        return restitution_linear(0.5 * self.damping / math.sqrt(self.stiffness * mass))


@declared
class Impact(PowerLaw, Declared):
    """F = max(0, k d^n + STEP(d, 0, 0, d_max, c_max) d'): the ADAMS function IMPACT.

    The damping grows from zero with the depth, so the force starts at zero. The restitution has no closed form. So the class has
    no method for it, and the function ``buckler.mbs.laws.delivered`` integrates the impact. See the Adams/Solver documentation.

    >>> round(Impact(1e8, damping=100.0, damping_depth=1e-5, exponent=1.0).force(1e-5, 0.1, 0.1), 9)  # k d + c d'
    1010.0
    """

    stiffness: float = quantity("N/m^n", above=0, doc="k")
    damping: float = quantity("N s/m", low=0, doc="c_max")
    damping_depth: float = quantity("m", above=0, doc="depth d_max at which the damping is full")
    # the range is chosen
    exponent: float = quantity("1", low=1, high=3, doc="n; 1.5 for a Hertzian contact, 1 for a linear stop", default=1.5)

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Return the contact force [N] at depth [m] and rate [m/s]; independent of the onset speed."""
        damping = step(depth, 0.0, 0.0, self.damping_depth, self.damping)
        return ramp(self.elastic(depth) + damping * rate)


def effective_modulus(young1: float, poisson1: float, young2: float | None = None, poisson2: float | None = None) -> float:
    """Return E* [Pa] of two bodies, by default alike, from Young's moduli [Pa] and Poisson's ratios in [0, 0.5]."""
    young2, poisson2 = young1 if young2 is None else young2, poisson1 if poisson2 is None else poisson2
    young1, young2 = positive("young1", young1, "Pa"), positive("young2", young2, "Pa")
    poisson1, poisson2 = number("poisson1", poisson1, 0.0, 0.5, "1"), number("poisson2", poisson2, 0.0, 0.5, "1")
    return 1.0 / ((1.0 - poisson1**2) / young1 + (1.0 - poisson2**2) / young2)


def hertz_external(modulus: float, radius1: float, radius2: float) -> float:
    """Return the stiffness K [N/m^1.5] of two convex bodies, R = R1 R2/(R1 + R2), from E* [Pa] and the radii [m]."""
    modulus = positive("modulus", modulus, "Pa")
    radius1, radius2 = positive("radius1", radius1, "m"), positive("radius2", radius2, "m")
    return 4.0 / 3.0 * modulus * math.sqrt(radius1 * radius2 / (radius1 + radius2))


def hertz_internal(modulus: float, pin: float, bush: float) -> float:
    """Return the stiffness K [N/m^1.5] of a pin in a bush, R = R_pin R_bush/(R_bush - R_pin), from E* [Pa] and the radii [m]."""
    modulus, pin = positive("modulus", modulus, "Pa"), positive("pin", pin, "m")
    bush = number("bush", bush, pin, math.inf, "m", open_low=True)
    return 4.0 / 3.0 * modulus * math.sqrt(pin * bush / (bush - pin))
