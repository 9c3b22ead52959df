"""A pinned column whose ends approach at constant speed: Hoff's problem, its first mode, and its peak force.

The column of critical load P_E, first bending frequency w1, radius of gyration r and length L has the stress-free bow
a0 sin(pi x/L). With a its whole amplitude, tau = w1 t and the force p = P/P_E in units of the critical load, its
first mode obeys

    a'' = (p - 1) a + a0,        p = s tau - (a^2 - a0^2)/(4 r^2),        s = v/(L w1 (pi r/L)^2),                           (1)

s the rise of the straight column's force, in critical loads, over a radian of its vibration. While the shortening by
bending is small, p = s tau and (1) is Airy's equation with a forcing in z = s^(1/3) (tau - 1/s),

    a_zz = z a + a0 s^(-2/3),                                                                                             (2)

whose solution at rest on its bow is known; the force peaks where it stops rising, (a^2)' = 4 r^2 s. That is the
estimate `peak_airy`. A perfect column that is bent by a0 at the start and at rest obeys the same without the forcing,
and p = s tau + (a0^2 - a^2)/(4 r^2).

References
----------
N. J. Hoff, The dynamics of the buckling of elastic columns, J. Applied Mechanics 18 (1951) 68-74.
V. A. Kuzkin, M. M. Dannert, The maximum force in a column under constant speed compression, arXiv:1511.01358.
V. A. Kuzkin, Structural model for the dynamic buckling of a column under constant rate compression, arXiv:1506.00427.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import airy

from .collocation import Array
from .pinned import Reals


class Peak(NamedTuple):
    """First maximum of the force: time tau = w1 t, and force over the critical load."""

    time: float
    force: float


@dataclass(frozen=True)
class Hoff:
    """The column's first mode.

    Parameters
    ----------
    rate : float
        s, positive: rise of the straight column's force in critical loads over a radian of its first vibration.
    bow : float
        a0/r, positive: stress-free bow, or initial deflection, over the radius of gyration.
    perfect : bool
        Whether the column is straight when free of stress, and `bow` a deflection at the start.

    Raises
    ------
    ValueError
        If a value is outside its range.
    """

    rate: float
    bow: float
    perfect: bool = False

    def __post_init__(self) -> None:
        for name in ("rate", "bow"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value!r}: must be positive and finite")

    def motion(self, until: float, samples: int = 2001) -> tuple[Array, Array, Array]:
        """Times tau, amplitudes a/r and forces p from the equations (1), each (samples,), by an integrator of eighth order."""
        tau = np.linspace(0.0, until, samples)
        run = solve_ivp(self._rates, (0.0, until), (self.bow, 0.0), method="DOP853", t_eval=tau, rtol=1e-10, atol=1e-12)
        return tau, run.y[0], self._force(tau, run.y[0])

    def peak(self) -> Peak:
        """First maximum of the force, by the equations (1)."""
        until = self._until()

        def turns(tau: float, y: Array) -> float:
            return float(self.rate - y[0] * y[1] / 2)

        turns.terminal, turns.direction = True, -1.0  # type: ignore[attr-defined]
        run = solve_ivp(self._rates, (0.0, until), (self.bow, 0.0), method="DOP853", events=turns, rtol=1e-10, atol=1e-12)
        if not len(run.t_events[0]):
            raise ValueError(f"rate = {self.rate:g}, bow = {self.bow:g}: the force does not peak before tau = {until:g}")
        tau, a = float(run.t_events[0][0]), float(run.y_events[0][0][0])
        return Peak(tau, float(self._force(tau, a)))

    def peak_airy(self) -> Peak:
        """The same by the Airy functions of (2): the deflection while it does not yet lower the force."""
        start, scale = -(self.rate ** (-2 / 3)), self.rate ** (1 / 3)

        def excess(z: float) -> float:
            a, slope = self._airy(z, start)
            return 1.0 - a * slope * scale / (2 * self.rate)

        high = start
        while excess(high) > 0:
            high += 0.25
        z = float(brentq(excess, high - 0.25, high, xtol=1e-12))
        tau = z / scale + 1 / self.rate
        return Peak(tau, float(self._force(tau, self._airy(z, start)[0])))

    def _airy(self, z: float, start: float) -> tuple[float, float]:
        """a/r and its slope in z from rest at `start`: variation of constants with the Wronskian Ai Bi' - Ai' Bi = 1/pi."""
        ai, ai1, bi, bi1 = (float(part) for part in airy(z))
        ai10, bi10 = (float(airy(start)[part]) for part in (1, 3))
        c = np.pi * self.bow * np.array([bi10, -ai10])  # from a = bow, a_z = 0 at the start
        if not self.perfect:
            forcing = np.pi * self.bow * self.rate ** (-2 / 3)
            of_ai, of_bi = _integrals(start, z)
            c += forcing * np.array([-of_bi, of_ai])
        return c[0] * ai + c[1] * bi, c[0] * ai1 + c[1] * bi1

    def _rates(self, tau: float, y: Array) -> tuple[float, float]:
        a, speed = y
        return speed, (self._force(tau, a) - 1.0) * a + (0.0 if self.perfect else self.bow)

    def _force(self, tau: Reals, a: Reals) -> Reals:
        return self.rate * tau - (a**2 - self.bow**2) / 4

    def _until(self) -> float:
        """A time by which the force has peaked: twice that of reaching the critical load, and some growth."""
        return 2 / self.rate + 40 * self.rate ** (-1 / 3) + 20


NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)


def _integrals(start: float, end: float) -> tuple[float, float]:
    """Integrals of Ai and Bi, by Gauss quadrature on pieces shorter than a radian of their oscillation."""
    edges = np.linspace(start, end, 1 + int(np.ceil((end - start) * (1 + np.sqrt(abs(start))))))
    half = np.diff(edges)[:, None] / 2
    ai, _, bi, _ = airy(edges[:-1, None] + half * (1 + NODES))
    return float((ai * WEIGHTS * half).sum()), float((bi * WEIGHTS * half).sum())
