"""One strike of a beam in dimensionless numbers: what decides the strip's push, and the borders of its regimes, in closed form.

P is the strip's Euler load, w1 its first frequency, g its radius of gyration, v the slider's speed at contact, phi the lean of
the chord there, K' the stop's stiffness with the strip's own behind it, a_n its deflection before contact in mode n.

    s = K' v/(P w1 cos phi)  rise of the compression in Euler loads over a radian of its first vibration;  b = a_1/g
    S = v sqrt(K m)/P        force of the slider's mass alone;  W = max (f - m x'')/(P cos phi) on the way: above 1 it buckles
    r = K'/(cos(phi)^2 E A/L), q = sqrt(K/m)/w1,  u = v T cos phi/L, the shortening asked for in a time T = pi/(q w1)

**Late buckling.** While the compression p = s tau rises, the n-th sine mode grows at

    sigma_n(p) = -z n^4 + sqrt(z^2 n^8 + n^2 (p - n^2)),                                                              (1)

z the damping ratio of the first, from its deflection a_n as a_n cosh G, G the integral of sigma_n over tau. Bending shortens the
strip by n^2 pi^2 a^2/(4 L); a light slider goes with it against the stop, a heavy one leaves it slack, which lessens p by
R n^2 (a^2 - a_n^2)/(4 g^2), R = r [1 + (2 sigma_n/q)^2], at most 1. The strip gives way when that rises as fast as s tau,

    sinh 2G = 4 s g^2/(R n^2 sigma_n a_n^2),     s G = integral of sigma_n from n^2 to p,                             (2)

at the least p of all n. Without damping, n free, that is p = 2 sqrt(A s): the square root of speed and stiffness. A bowed strip
gives way in its first mode: p = (3 A s/2)^(2/3), A the logarithm.

**Sagging.** A strip whose bow a_1 is not small against what the impact asks for is a spring that never reaches its Euler load,

    p = 1 - a_1/sqrt(a_1^2 + 4 L^2 u/pi^2).                                                                         (3)

**Plateau.** Else it pushes with its Euler load, and the peak is that of the massless strip (`buckler.mbs.laws.peak`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from buckler.mbs.geometry import Array
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.laws.peak import peak_factors
from buckler.mbs.library import PAPER, PAPER_STOP

from .sine_strip import L, SineStrip
from .slider_crank import CONTACT

LATE = 1.5
"""Compression over the Euler load above which buckling is late."""
SAGS = 0.95
"""Compression over the Euler load below which the strip sags."""
REGIMES = ("late buckling", "plateau", "sagging", "swing")


@dataclass(frozen=True)
class ImpactNumbers:
    """The numbers above: P [N], s, S, W, u, r, q, cos phi, f/P, a_n/g of every mode, z, chi of the stop, L/g."""

    euler: float
    rate: float
    strength: float
    way: float
    asked: float
    ratio: float
    slider: float
    lean: float
    friction: float
    seeds: Array
    damping: float
    chi: float
    span: float

    @classmethod
    def of(cls, strip: SineStrip) -> ImpactNumbers:
        """Compute the numbers of a strike."""
        p, frequency, speed = strip.case, strip.frequency, strip.onset
        lean, span = float(PAPER.lean_cosine(CONTACT, PAPER_STOP)), L * np.sqrt(12) / p.thickness
        euler, axial = p.section.euler_load(L), p.section.axial_stiffness / L
        stiffness = 1 / (1 / p.stop_stiffness + lean**2 / axial)
        way = max(strip.settle(float(angle))[1] for angle in np.linspace(0.0, CONTACT, 200)) / euler
        return cls(
            euler, stiffness * speed / (euler * frequency * lean), speed * np.sqrt(p.stop_stiffness * p.mass) / euler, way,
            speed * np.pi * np.sqrt(p.mass / p.stop_stiffness) * lean / L, min(stiffness / (lean**2 * axial), 1.0),
            float(np.sqrt(p.stop_stiffness / p.mass)) / frequency, lean, p.friction_force / euler,
            np.abs(strip.settle(CONTACT)[0]) * span / L, p.damping, float(CarvalhoMartins.hysteresis(p.restitution)), span,
        )  # fmt: skip

    def late(self) -> float:
        """Find the compression at which the strip gives way, over its Euler load: the least of all modes."""
        return min(self._gives_way(n, seed) for n, seed in enumerate(self.seeds, 1))

    def _gives_way(self, n: int, seed: float) -> float:
        """Solve equation (2) for the largest compression if only mode n grew."""

        def relief(p: float) -> tuple[float, float]:
            """Compute the ratio of stiffnesses and the logarithm of the growth at which the strip gives way."""
            growth = _growth(n, p, self.damping)
            ratio = min(1.0, self.ratio * (1 + (2 * growth / self.slider) ** 2))
            return ratio, 0.5 * float(np.arcsinh(4 * self.rate / (ratio * n**2 * growth * seed**2)))

        def lacking(p: float) -> float:
            """Compute the residual of equation (2)."""
            return _integrate_growth(n, p, self.damping) - self.rate * relief(p)[1]

        low, high = n**2 * (1 + 1e-6), n**2 + 1e5
        if lacking(low) >= 0 or lacking(high) <= 0:
            return float(low if lacking(low) >= 0 else high)
        p = float(brentq(lacking, low, high))
        ratio, grown = relief(p)
        return p - ratio * (n * seed * np.sinh(grown)) ** 2 / 4

    def compression(self) -> float:
        """Compute the largest compression of the strip over its Euler load: late, or by equation (3)."""
        late, bow = self.late(), self.seeds[0]
        return late if late > LATE else min(late, float(1 - bow / np.sqrt(bow**2 + 4 * self.span**2 * self.asked / np.pi**2)))

    def peak(self) -> float:
        """Compute the largest force on the stop over the Euler load, of the slider's mass and the push behind it.

        Late, the push is over when the mass has its say: the root of the sum of squares. Else it stays behind it.
        """
        c0, c1 = peak_factors(self.chi)
        late = self.compression() * self.lean - self.friction
        steady = c1 * (min(self.compression(), 1.0) * self.lean - self.friction)
        inertia = c0 * self.strength
        return float(max(np.hypot(late, inertia), steady + np.hypot(steady, inertia)))

    def regime(self) -> str:
        """Name the regime by the closed forms."""
        return regime(self.compression(), self.way > 1.0)


def regime(compression: float, early: bool) -> str:
    """Name the regime of a compression over the Euler load; `early`: the strip buckles before contact, or there is none."""
    if early or not np.isfinite(compression):
        return "swing"
    return "late buckling" if compression > LATE else "plateau" if compression > SAGS else "sagging"


def _growth(n: int, p: float, damping: float) -> float:
    """Evaluate equation (1)."""
    held = damping * n**4
    return float(-held + np.sqrt(held**2 + n**2 * (p - n**2)))


def _integrate_growth(n: int, p: float, damping: float) -> float:
    """Integrate (1) over p from n^2."""
    held = damping * n**4
    root = np.sqrt(held**2 + n**2 * (p - n**2))
    return float(-held * (p - n**2) + 2 * (root**3 - held**3) / (3 * n**2))
