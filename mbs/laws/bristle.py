"""Friction laws with a bristle as memory: LuGre, with which a stuck body creeps, and stiction, with which it does not.

z is the deflection of the bristle [m], v the sliding speed [m/s]. The coefficient of steady sliding is
g(v) = mu_d + (mu_s - mu_d) exp(-(v/v_str)^2), plus beta v. Stiffness s0 and damping s1 are per unit of normal force.
"""

from typing import ClassVar

import numpy as np

from ..declare import Declared, declared, quantity
from .pieces import Reals, saturate, stribeck_level


@declared
class _Bristle(Declared):
    """Base of friction laws with one bristle: parameters, g(v) and stored energy."""

    static: float = quantity("1", low="dynamic", doc="mu_s")
    dynamic: float = quantity("1", above=0, doc="mu_d")
    v_stribeck: float = quantity("m/s", above=0, doc="speed over which friction falls from static to dynamic")
    bristle_stiffness: float = quantity("1/m", above=0, doc="s0: a stuck body moves by mu/s0", default=1e5)  # chosen: 3 um at 0.3
    bristle_damping: float = quantity("s/m", low=0, doc="s1: damps the vibration of a stuck body", default=0.0)
    viscous: float = quantity("s/m", low=0, doc="beta", default=0.0)

    exponent: ClassVar[float] = 2.0  # of g(v)

    def limit(self, speed: Reals) -> Reals:
        """Return g(v) [1] at a speed [m/s], the largest coefficient of a stuck body."""
        return stribeck_level(speed, self.static, self.dynamic, self.v_stribeck, self.exponent)

    def stored(self, bristle: Reals) -> Reals:
        """Return the elastic energy s0 z^2 / 2 per unit of normal force [J/N]."""
        return 0.5 * self.bristle_stiffness * bristle**2


@declared
class LuGre(_Bristle):
    """The LuGre law: dz/dt = v - s0 |v| z/g(v), mu = s0 z + s1 dz/dt + beta v (doi 10.1109/9.376053).

    Below mu_s the bristle bends like a spring. Each contact has one bristle.

    >>> law = LuGre(static=0.3, dynamic=0.1, v_stribeck=0.01)
    >>> round(float(law.coefficient(0.0, 1e-6)), 3)  # a stuck bristle is a spring: s0 z
    0.1
    """

    def rate(self, bristle: Reals, speed: Reals) -> Reals:
        """Return dz/dt [m/s] at a deflection [m] and a speed [m/s]."""
        return speed - self.bristle_stiffness * abs(speed) * bristle / self.limit(speed)

    def coefficient(self, speed: Reals, bristle: Reals) -> Reals:
        """Return the signed coefficient [1] at a speed [m/s] and a deflection [m]."""
        bending = self.bristle_stiffness * bristle + self.bristle_damping * self.rate(bristle, speed)
        return bending + self.viscous * speed

    def after(self, bristle: Reals, speed: Reals, time: Reals) -> Reals:
        """Return the deflection [m] after a time [s] at constant speed [m/s]; exact, as the rate is linear in z."""
        largest = self.limit(speed) / self.bristle_stiffness  # deflection in steady sliding [m]
        return bristle - np.expm1(-abs(speed) * time / largest) * (largest * np.sign(speed) - bristle)


@declared
class Stiction(_Bristle):
    """A bristle that bends elastically and then slips: |s0 z| <= g(v), mu = s0 z + s1 v clipped to [-g, g], plus beta v.

    While |s0 z| < g the bristle follows the displacement, dz/dt = v, unlike the bristle of LuGre. So a stuck body does not drift,
    however long or often the load changes below the limit g(0) = mu_s. A body that slides at v comes to rest under a load below
    g(v), as g grows while v falls. The elastic range of Dupont et al. 2002, doi 10.1109/TAC.2002.1000274, here reaches up to g.

    >>> law = Stiction(static=0.3, dynamic=0.1)
    >>> round(float(law.after(0.0, 1e-3, 1e-3)), 9)  # a stuck bristle follows the displacement
    1e-06
    """

    v_stribeck: float = quantity("m/s", above=0, doc="speed over which friction falls from static to dynamic", default=1e-2)

    def coefficient(self, speed: Reals, bristle: Reals) -> Reals:
        """Return the signed coefficient [1] at a speed [m/s] and a deflection [m]."""
        limit = self.limit(speed)
        bending = self.bristle_stiffness * bristle + self.bristle_damping * speed
        return limit * saturate(bending / limit) + self.viscous * speed  # bending clipped to [-limit, limit]

    def after(self, bristle: Reals, speed: Reals, time: Reals) -> Reals:
        """Return the deflection [m] after a time [s] at constant speed [m/s]."""
        largest = self.limit(speed) / self.bristle_stiffness
        return largest * saturate((bristle + speed * time) / largest)
