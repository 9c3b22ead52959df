"""Normal contact: what a normal law is, and the laws that ask for a damper rather than for a restitution.

Depth [m] is positive in contact, rate [m/s] positive when penetrating, onset [m/s] > 0 is the approach speed at contact
onset. A force pushes the bodies apart or is zero: no law here ever pulls.
"""

import math
from dataclasses import dataclass, field

from buckler.mbs.laws.pieces import Reals, keep, ramp, step
from buckler.mbs.laws.rebound import damping_ratio, needed, restitution_linear
from buckler.mbs.validate import positive


class PowerLaw:
    """The elastic part K d^n, shared by every law here."""

    stiffness: float
    exponent: float

    def elastic(self, depth: Reals) -> Reals:
        """K d^n [N], 0 where depth <= 0."""
        return self.stiffness * ramp(depth) ** self.exponent

    def potential(self, depth: Reals) -> Reals:
        """K d^(n+1) / (n+1) [J], 0 where depth <= 0."""
        return self.stiffness * ramp(depth) ** (self.exponent + 1.0) / (self.exponent + 1.0)


def kelvin_voigt_force(depth: Reals, rate: Reals, stiffness: float, damping: float) -> Reals:
    """max(0, k d + c d') [N], 0 where d <= 0."""
    return (depth > 0.0) * ramp(stiffness * depth + damping * rate)


def impact_force(depth: Reals, rate: Reals, stiffness: float, exponent: float, damping: float, damping_depth: float) -> Reals:
    """max(0, k d^n + STEP(d, 0, 0, d_max, c_max) d') [N], 0 where d <= 0."""
    return ramp(stiffness * ramp(depth) ** exponent + step(depth, 0.0, 0.0, damping_depth, damping) * rate)


@dataclass(frozen=True)
class Hertz(PowerLaw):
    """F = K d^1.5: elastic, gives back all it takes.

    For K from material and radii see ``hertz_external`` and ``hertz_internal``.

    Parameters
    ----------
    stiffness : float > 0, N/m^1.5, K

    References
    ----------
    H. Hertz, J. reine und angewandte Mathematik 92 (1882) 156-171, doi 10.1515/crll.1882.92.156.
    """

    stiffness: float
    exponent: float = field(default=1.5, init=False)

    def __post_init__(self) -> None:
        keep(self, "N/m^1.5", "stiffness", open_low=True)

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Contact force [N]; neither rate nor onset matters."""
        return self.elastic(depth)

    def delivered(self, mass: float | None = None, speed: float | None = None) -> float:
        """Restitution delivered: 1."""
        return 1.0


@dataclass(frozen=True)
class KelvinVoigt(PowerLaw):
    """F = max(0, k d + c d'): spring and dashpot, allowed to push only.

    The force jumps to c d' at onset. It is back at zero while the body is still inside; from there the body leaves
    freely, so the restitution is that of ``restitution_linear``: it depends on the mass, and not on the speed.

    Parameters
    ----------
    stiffness : float > 0, N/m, k
    damping : float >= 0, N s/m, c

    References
    ----------
    T. Schwager, T. Poeschel, Granular Matter 9 (2007) 465-469, doi 10.1007/s10035-007-0065-z.
    """

    stiffness: float
    damping: float
    exponent: float = field(default=1.0, init=False)

    def __post_init__(self) -> None:
        keep(self, "N/m", "stiffness", open_low=True)
        keep(self, "N s/m", "damping")

    @classmethod
    def from_restitution(cls, stiffness: float, restitution: float, mass: float) -> "KelvinVoigt":
        """The law that delivers a restitution, 0 < e <= 1, for one effective mass m1 m2 / (m1 + m2) [kg]."""
        stiffness = positive("stiffness", stiffness, "N/m")
        mass = positive("mass", mass, "kg")
        return cls(stiffness, 2.0 * damping_ratio(restitution) * math.sqrt(stiffness * mass))

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Contact force [N] at depth [m] and rate [m/s]; onset does not matter."""
        return kelvin_voigt_force(depth, rate, self.stiffness, self.damping)

    def delivered(self, mass: float | None = None, speed: float | None = None) -> float:
        """Restitution delivered [1] to an effective mass [kg], the same for every speed."""
        mass = needed("mass", mass, "kg", self)
        return restitution_linear(0.5 * self.damping / math.sqrt(self.stiffness * mass))


@dataclass(frozen=True)
class Impact(PowerLaw):
    """F = max(0, k d^n + STEP(d, 0, 0, d_max, c_max) d'): the ADAMS function IMPACT.

    The damping grows from zero with the depth, so the force starts at zero. Restitution depends on mass and speed.

    Parameters
    ----------
    stiffness : float > 0, N/m^n, k
    damping : float >= 0, N s/m, c_max
    damping_depth : float > 0, m, depth d_max at which the damping is full
    exponent : float, 1, n in [1, 3]

    References
    ----------
    MSC Software, Adams/Solver documentation, functions IMPACT and STEP (no DOI).
    """

    stiffness: float
    damping: float
    damping_depth: float
    exponent: float = 1.5

    def __post_init__(self) -> None:
        keep(self, "N/m^n", "stiffness", open_low=True)
        keep(self, "N s/m", "damping")
        keep(self, "m", "damping_depth", open_low=True)
        keep(self, "1", "exponent", low=1.0, high=3.0)

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Contact force [N] at depth [m] and rate [m/s]; onset does not matter."""
        return impact_force(depth, rate, self.stiffness, self.exponent, self.damping, self.damping_depth)
