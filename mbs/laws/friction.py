"""Friction laws: a signed coefficient of the sliding speed, or of the speed and a bristle state.

``coefficient(speed)`` is odd in the speed [m/s]. The friction force on the body sliding at that speed is
-coefficient(speed) * N, N the normal force [N]: it opposes the motion. Every law but LuGre is regularised: at rest it
holds nothing, and a body on a slope creeps.

References
----------
F. Marques, P. Flores, J. C. Pimenta Claro, H. M. Lankarani, "A survey and comparison of several friction force models
for dynamic analysis of multibody mechanical systems", Nonlinear Dynamics 86 (2016) 1407-1443,
doi 10.1007/s11071-016-2999-3.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from buckler.mbs.laws.pieces import Reals, keep, ramp, saturate, step


@runtime_checkable
class FrictionLaw(Protocol):
    """What a stop or a clearance joint needs to know of its friction."""

    def coefficient(self, speed: Reals) -> Reals:
        """Signed friction coefficient [1], odd in the sliding speed [m/s]; floats or arrays."""


@runtime_checkable
class BristleLaw(Protocol):
    """What a clearance joint needs to know of friction that remembers: it bends a bristle of deflection z [m]."""

    def coefficient(self, speed: Reals, bristle: Reals) -> Reals:
        """Signed friction coefficient [1] at a sliding speed [m/s] and a bristle [m]."""

    def after(self, bristle: Reals, speed: Reals, time: Reals) -> Reals:
        """Bristle [m] after a time [s] at constant speed [m/s]; the same bristle for time 0."""

    def stored(self, bristle: Reals) -> Reals:
        """Energy a bristle holds, per unit of normal force [J/N]."""


def stribeck_level(speed: Reals, static: float, dynamic: float, v_stribeck: float, exponent: float) -> Reals:
    """mu_d + (mu_s - mu_d) exp(-|v/v_str|^delta) [1]: from static at rest down to dynamic."""
    return dynamic + (static - dynamic) * np.exp(-((abs(speed) / v_stribeck) ** exponent))


@dataclass(frozen=True)
class NoFriction:
    """mu = 0."""

    def coefficient(self, speed: Reals) -> Reals:
        """Zero, in the shape of speed."""
        return 0.0 * speed


@dataclass(frozen=True)
class Coulomb:
    """mu(v) = mu_d v/v_reg for |v| < v_reg, mu_d sign(v) beyond; plus a viscous term beta v.

    Parameters
    ----------
    dynamic : float >= 0, 1, mu_d
    v_reg : float > 0, m/s, speed below which the jump at rest is replaced by a line
    viscous : float >= 0, s/m, beta

    References
    ----------
    Marques et al. (2016), doi 10.1007/s11071-016-2999-3.
    """

    dynamic: float
    v_reg: float = 1e-3
    viscous: float = 0.0

    def __post_init__(self) -> None:
        keep(self, "1", "dynamic")
        keep(self, "m/s", "v_reg", open_low=True)
        keep(self, "s/m", "viscous")

    def coefficient(self, speed: Reals) -> Reals:
        """Signed coefficient [1] at speed [m/s]."""
        return self.dynamic * saturate(speed / self.v_reg) + self.viscous * speed


@dataclass(frozen=True)
class AdamsFriction:
    """mu(v) = STEP(v, -v_s, -mu_s, v_s, mu_s) for |v| < v_s; sign(v) STEP(|v|, v_s, mu_s, v_d, mu_d) beyond.

    Friction of an ADAMS contact: rises to mu_s at v_s, falls to mu_d at v_d, with a continuous derivative throughout.

    Parameters
    ----------
    static : float >= dynamic, 1, mu_s
    dynamic : float >= 0, 1, mu_d
    v_s : float > 0, m/s, stiction transition speed
    v_d : float > v_s, m/s, friction transition speed

    References
    ----------
    MSC Software, Adams/Solver documentation, CONTACT (no DOI).
    """

    static: float
    dynamic: float
    v_s: float = 0.1
    v_d: float = 1.0

    def __post_init__(self) -> None:
        keep(self, "1", "dynamic")
        keep(self, "1", "static", low=self.dynamic)
        keep(self, "m/s", "v_s", open_low=True)
        keep(self, "m/s", "v_d", low=self.v_s, open_low=True)

    def coefficient(self, speed: Reals) -> Reals:
        """Signed coefficient [1] at speed [m/s]."""
        x = saturate(speed / self.v_s)
        direction = 0.5 * x * (3.0 - x * x)  # STEP from -1 at -v_s to 1 at v_s, in a form that is odd to the last bit
        return direction * step(abs(speed), self.v_s, self.static, self.v_d, self.dynamic)


@dataclass(frozen=True)
class Ambrosio:
    """mu(v) = 0 for |v| < v0, a line up to mu_d at v1, mu_d sign(v) beyond: no friction at all near rest.

    Parameters
    ----------
    dynamic : float >= 0, 1, mu_d
    v0 : float >= 0, m/s, speed below which there is no friction
    v1 : float > v0, m/s, speed from which friction is full

    References
    ----------
    J. A. C. Ambrosio, "Impact of rigid and flexible multibody systems: deformation description and contact models", in
    W. Schiehlen, M. Valasek (eds.), Virtual Nonlinear Multibody Systems, Kluwer (2003) 57-81; see also Marques et al.
    (2016), doi 10.1007/s11071-016-2999-3.
    """

    dynamic: float
    v0: float
    v1: float

    def __post_init__(self) -> None:
        keep(self, "1", "dynamic")
        keep(self, "m/s", "v0")
        keep(self, "m/s", "v1", low=self.v0, open_low=True)

    def coefficient(self, speed: Reals) -> Reals:
        """Signed coefficient [1] at speed [m/s]."""
        beyond = ramp(speed - self.v0) - ramp(-speed - self.v0)
        return self.dynamic * saturate(beyond / (self.v1 - self.v0))


@dataclass(frozen=True)
class Threlfall:
    """mu(v) = mu_d sign(v) [1 - exp(-3 |v|/v0)]: 95 % of mu_d at v0, smooth except for the curvature at rest.

    Parameters
    ----------
    dynamic : float >= 0, 1, mu_d
    v0 : float > 0, m/s, speed at which 1 - exp(-3) of the friction acts

    References
    ----------
    D. C. Threlfall, Mechanism and Machine Theory 13 (1978) 475-483, doi 10.1016/0094-114X(78)90020-4.
    """

    dynamic: float
    v0: float

    def __post_init__(self) -> None:
        keep(self, "1", "dynamic")
        keep(self, "m/s", "v0", open_low=True)

    def coefficient(self, speed: Reals) -> Reals:
        """Signed coefficient [1] at speed [m/s]."""
        return -self.dynamic * np.sign(speed) * np.expm1(-3.0 * abs(speed) / self.v0)


@dataclass(frozen=True)
class Stribeck:
    """mu(v) = [mu_d + (mu_s - mu_d) exp(-|v/v_str|^delta)] times a line below v_reg, sign(v) beyond; plus beta v.

    Parameters
    ----------
    static : float >= dynamic, 1, mu_s
    dynamic : float >= 0, 1, mu_d
    v_stribeck : float > 0, m/s, speed over which friction falls from static to dynamic
    exponent : float > 0, 1, delta; 2 is usual, 0.5 to 1 for some materials
    v_reg : float > 0, m/s, speed below which the jump at rest is replaced by a line; well below v_stribeck
    viscous : float >= 0, s/m, beta

    References
    ----------
    B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, Automatica 30 (1994) 1083-1138,
    doi 10.1016/0005-1098(94)90209-7.
    """

    static: float
    dynamic: float
    v_stribeck: float
    exponent: float = 2.0
    v_reg: float = 1e-3
    viscous: float = 0.0

    def __post_init__(self) -> None:
        keep(self, "1", "dynamic")
        keep(self, "1", "static", low=self.dynamic)
        keep(self, "m/s", "v_stribeck", "v_reg", open_low=True)
        keep(self, "1", "exponent", open_low=True)
        keep(self, "s/m", "viscous")

    def coefficient(self, speed: Reals) -> Reals:
        """Signed coefficient [1] at speed [m/s]."""
        level = stribeck_level(speed, self.static, self.dynamic, self.v_stribeck, self.exponent)
        return level * saturate(speed / self.v_reg) + self.viscous * speed
