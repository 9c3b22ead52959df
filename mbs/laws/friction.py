"""Friction laws: a signed coefficient of the sliding speed, or of the speed and a bristle state.

``coefficient(speed)`` is odd in the speed [m/s]. The friction force on the body sliding at that speed is
-coefficient(speed) * N, with the normal force N [N]: it opposes the motion. All laws without a bristle are regularised: their
force at rest is zero, so that a body on a slope creeps. The static coefficient is mu_s, the dynamic one mu_d, the speed v.
STEP(x, x0, h0, x1, h1) is a cubic with zero slopes from h0 at x0 to h1 at x1, constant outside. In the code saturate(x) is x
clipped to [-1, 1], and ramp(x) is max(0, x).

F. Marques et al., Nonlinear Dynamics 86 (2016) 1407-1443, doi 10.1007/s11071-016-2999-3, compare friction laws.
"""

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from ..declare import Declared, declared, quantity
from .pieces import Reals, ramp, saturate, step, stribeck_level


@runtime_checkable
class FrictionLaw(Protocol):
    """Protocol of friction laws for stops and clearance joints."""

    def coefficient(self, speed: Reals) -> Reals:
        """Return the signed friction coefficient [1], odd in the sliding speed [m/s]; floats or arrays."""


@runtime_checkable
class BristleLaw(Protocol):
    """Protocol of friction laws with a state, the deflection z [m] of a bristle, for clearance joints and guides."""

    def coefficient(self, speed: Reals, bristle: Reals) -> Reals:
        """Return the signed friction coefficient [1] at a sliding speed [m/s] and a deflection [m]."""

    def after(self, bristle: Reals, speed: Reals, time: Reals) -> Reals:
        """Return the deflection [m] after a time [s] at constant speed [m/s]; time 0 does not change it."""

    def stored(self, bristle: Reals) -> Reals:
        """Return the energy stored in a bristle, per unit of normal force [J/N]."""


class WithoutMemory(NamedTuple):
    """Friction law of the speed alone in the form of a `BristleLaw`, with a deflection of 0."""

    law: FrictionLaw

    def coefficient(self, speed: Reals, _bristle: Reals) -> Reals:
        """Return the signed friction coefficient [1] of the speed."""
        return self.law.coefficient(speed)

    def after(self, bristle: Reals, _speed: Reals, _time: Reals) -> Reals:
        """Return the deflection 0 [m]."""
        return 0.0 * bristle

    def stored(self, bristle: Reals) -> Reals:
        """Return the energy 0 [J/N]."""
        return 0.0 * bristle


def as_bristle_law(friction: FrictionLaw | BristleLaw) -> BristleLaw:
    """Return a friction law as it is if it has a bristle, and as `WithoutMemory` otherwise."""
    return friction if isinstance(friction, BristleLaw) else WithoutMemory(friction)


@declared
class NoFriction(Declared):
    """No friction, mu = 0.

    >>> NoFriction().coefficient(0.5)
    0.0
    """

    def coefficient(self, speed: Reals) -> Reals:
        """Return the coefficient 0 [1] in the shape of the speed."""
        return 0.0 * speed


@declared
class Coulomb(Declared):
    """mu(v) = mu_d v/v_reg for |v| < v_reg, mu_d sign(v) beyond; plus a viscous term beta v.

    >>> Coulomb(0.1, v_reg=1e-3).coefficient(-0.5)
    -0.1
    """

    dynamic: float = quantity("1", low=0, doc="mu_d")
    v_reg: float = quantity("m/s", above=0, doc="speed below which the jump at rest is replaced by a line", default=1e-3)
    viscous: float = quantity("s/m", low=0, doc="beta", default=0.0)

    def coefficient(self, speed: Reals) -> Reals:
        """Return the signed coefficient [1] at a speed [m/s]."""
        return self.dynamic * saturate(speed / self.v_reg) + self.viscous * speed


@declared
class AdamsFriction(Declared):
    """mu(v) = STEP(v, -v_s, -mu_s, v_s, mu_s) for |v| < v_s; sign(v) STEP(|v|, v_s, mu_s, v_d, mu_d) beyond.

    Friction of an ADAMS contact (MSC Software, Adams/Solver documentation, CONTACT). It rises to mu_s at v_s and falls to mu_d at
    v_d, with a continuous derivative.

    >>> law = AdamsFriction(static=0.3, dynamic=0.1)
    >>> law.coefficient(0.1), law.coefficient(1.0)
    (0.3, 0.1)
    """

    static: float = quantity("1", low="dynamic", doc="mu_s")
    dynamic: float = quantity("1", low=0, doc="mu_d")
    v_s: float = quantity("m/s", above=0, doc="stiction transition speed", default=0.1)
    v_d: float = quantity("m/s", above="v_s", doc="friction transition speed", default=1.0)

    def coefficient(self, speed: Reals) -> Reals:
        """Return the signed coefficient [1] at a speed [m/s]."""
        x = saturate(speed / self.v_s)
        direction = 0.5 * x * (3.0 - x * x)  # STEP from -1 at -v_s to 1 at v_s, in a form that is odd to the last bit
        return direction * step(abs(speed), self.v_s, self.static, self.v_d, self.dynamic)


@declared
class Ambrosio(Declared):
    """mu(v) = 0 for |v| < v0, a line up to mu_d at v1, mu_d sign(v) beyond: no friction at all near rest.

    J. A. C. Ambrosio, in Virtual Nonlinear Multibody Systems, Kluwer (2003) 57-81; see also doi 10.1007/s11071-016-2999-3.

    >>> law = Ambrosio(0.1, v0=1e-3, v1=1e-2)
    >>> law.coefficient(5e-4), law.coefficient(1e-2)
    (0.0, 0.1)
    """

    dynamic: float = quantity("1", low=0, doc="mu_d")
    v0: float = quantity("m/s", low=0, doc="speed below which there is no friction")
    v1: float = quantity("m/s", above="v0", doc="speed from which friction is full")

    def coefficient(self, speed: Reals) -> Reals:
        """Return the signed coefficient [1] at a speed [m/s]."""
        beyond = ramp(speed - self.v0) - ramp(-speed - self.v0)
        return self.dynamic * saturate(beyond / (self.v1 - self.v0))


@declared
class Threlfall(Declared):
    """mu(v) = mu_d sign(v) [1 - exp(-3 |v|/v0)]: 95 % of mu_d at v0 (Threlfall 1978, doi 10.1016/0094-114X(78)90020-4).

    >>> round(float(Threlfall(0.1, v0=1e-2).coefficient(1e-2)), 3)  # 0.1 (1 - exp(-3))
    0.095
    """

    dynamic: float = quantity("1", low=0, doc="mu_d")
    v0: float = quantity("m/s", above=0, doc="speed at which 95 % of the friction acts")

    def coefficient(self, speed: Reals) -> Reals:
        """Return the signed coefficient [1] at a speed [m/s]."""
        return -self.dynamic * np.sign(speed) * np.expm1(-3.0 * abs(speed) / self.v0)


@declared
class Stribeck(Declared):
    """mu(v) = [mu_d + (mu_s - mu_d) exp(-|v/v_str|^delta)] times a line below v_reg, sign(v) beyond; plus beta v.

    B. Armstrong-Helouvry et al., Automatica 30 (1994) 1083-1138, doi 10.1016/0005-1098(94)90209-7.

    >>> law = Stribeck(static=0.3, dynamic=0.1, v_stribeck=0.01)
    >>> round(float(law.coefficient(1e-3)), 3), round(float(law.coefficient(1.0)), 3)
    (0.298, 0.1)
    """

    static: float = quantity("1", low="dynamic", doc="mu_s")
    dynamic: float = quantity("1", low=0, doc="mu_d")
    v_stribeck: float = quantity("m/s", above=0, doc="speed over which friction falls from static to dynamic")
    exponent: float = quantity("1", above=0, doc="delta; 2 is usual, 0.5 to 1 for some materials", default=2.0)
    v_reg: float = quantity("m/s", above=0, doc="speed, well below v_stribeck, below which mu is linear", default=1e-3)
    viscous: float = quantity("s/m", low=0, doc="beta", default=0.0)

    def coefficient(self, speed: Reals) -> Reals:
        """Return the signed coefficient [1] at a speed [m/s]."""
        level = stribeck_level(speed, self.static, self.dynamic, self.v_stribeck, self.exponent)
        return level * saturate(speed / self.v_reg) + self.viscous * speed
