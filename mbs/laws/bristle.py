"""Friction laws with a bristle as memory: LuGre, with which a stuck body creeps, and stiction, with which it does not."""

import numpy as np

from ..declare import Declared, declared, quantity
from .friction import stribeck_level
from .pieces import Reals, saturate


@declared
class _Bristled(Declared):
    """Base of laws of one bristle: parameters, the Stribeck level, stored energy."""

    static: float = quantity("1", low="dynamic", doc="mu_s")
    dynamic: float = quantity("1", above=0, doc="mu_d")
    v_stribeck: float = quantity("m/s", above=0, doc="speed over which friction falls from static to dynamic")
    bristle_stiffness: float = quantity("1/m", above=0, doc="s0: a stuck body moves by mu/s0", default=1e5)
    bristle_damping: float = quantity("s/m", low=0, doc="s1: damps the vibration of a stuck body", default=0.0)
    viscous: float = quantity("s/m", low=0, doc="beta", default=0.0)

    def limit(self, speed: Reals) -> Reals:
        """Return the coefficient [1] of sliding at a speed [m/s] without the viscous part, the largest of a stuck body."""
        return stribeck_level(speed, self.static, self.dynamic, self.v_stribeck, 2.0)

    def stored(self, bristle: Reals) -> Reals:
        """Energy of the bent bristle, s0 z^2 / 2, per unit of normal force [J/N]."""
        return 0.5 * self.bristle_stiffness * bristle**2

    def steady(self, speed: Reals) -> Reals:
        """Signed coefficient [1] of steady sliding at a speed [m/s]."""
        level = self.limit(speed)
        return level * np.sign(speed) + self.viscous * speed


@declared
class LuGre(_Bristled):
    """Bristles of deflection z: dz/dt = v - s0 |v| z/g(v), mu = s0 z + s1 dz/dt + beta v; g as in Stribeck.

    Below mu_s the bristles bend like a spring. The law is a ``BristleLaw`` with one state for each contact. ``steady`` is the
    coefficient of steady sliding. s0 and s1 are per unit normal force.

    References
    ----------
    C. Canudas de Wit, H. Olsson, K. J. Astrom, P. Lischinsky, "A new model for control of systems with friction", IEEE
    Transactions on Automatic Control 40 (1995) 419-425, doi 10.1109/9.376053.

    Examples
    --------
    >>> law = LuGre(static=0.3, dynamic=0.1, v_stribeck=0.01)
    >>> round(float(law.coefficient(0.0, 1e-6)), 3)  # a stuck bristle is a spring: s0 z
    0.1
    """

    def rate(self, bristle: Reals, speed: Reals) -> Reals:
        """dz/dt [m/s] at bristle deflection z [m] and speed [m/s]."""
        level = self.limit(speed)
        return speed - self.bristle_stiffness * abs(speed) * bristle / level

    def coefficient(self, speed: Reals, bristle: Reals) -> Reals:
        """Signed coefficient [1] at speed [m/s] and bristle deflection z [m]."""
        bending = self.bristle_stiffness * bristle + self.bristle_damping * self.rate(bristle, speed)
        return bending + self.viscous * speed

    def after(self, bristle: Reals, speed: Reals, time: Reals) -> Reals:
        """Bristle deflection [m] after a time [s] at constant speed [m/s]: the rate is linear in z, so this is exact."""
        level = self.limit(speed) / self.bristle_stiffness
        return bristle - np.expm1(-abs(speed) * time / level) * (level * np.sign(speed) - bristle)


@declared
class Stiction(_Bristled):
    """A bristle that bends elastically and then slips: |s0 z| <= g(v), mu = s0 z + s1 v clipped to [-g, g], plus beta v.

    Stuck, the bristle follows the displacement: dz/dt = v exactly, unlike LuGre's. A body at rest therefore does not drift,
    however long or often the load on it changes below the limit. It slips at g(v) = mu_d + (mu_s - mu_d) exp(-(v/v_str)^2), and
    comes to rest under any smaller force. A ``BristleLaw``. s0 and s1 are per unit normal force.

    References
    ----------
    P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, "Single state elastoplastic friction models", IEEE Transactions on
    Automatic Control 47 (2002) 787-792, doi 10.1109/TAC.2002.1000274: its bristle, here with break-away at the limit.

    Examples
    --------
    >>> law = Stiction(static=0.3, dynamic=0.1)
    >>> round(float(law.after(0.0, 1e-3, 1e-3)), 9)  # a stuck bristle follows the displacement
    1e-06
    """

    v_stribeck: float = quantity("m/s", above=0, doc="speed over which friction falls from static to dynamic", default=1e-2)

    def coefficient(self, speed: Reals, bristle: Reals) -> Reals:
        """Signed coefficient [1] at speed [m/s] and bristle deflection z [m]."""
        level = self.limit(speed)
        bending = self.bristle_stiffness * bristle + self.bristle_damping * speed
        return level * saturate(bending / level) + self.viscous * speed

    def after(self, bristle: Reals, speed: Reals, time: Reals) -> Reals:
        """Bristle deflection [m] after a time [s] at constant speed [m/s]."""
        level = self.limit(speed) / self.bristle_stiffness
        return level * saturate((bristle + speed * time) / level)
