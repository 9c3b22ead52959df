"""A pinned column whose ends approach at constant speed: Hoff's problem, its first mode, and its peak force.

The column of critical load P_E, first bending frequency w1, radius of gyration r and length L has the stress-free bow
a0 sin(pi x/L). Let a be its whole amplitude, tau = w1 t, and p = P/P_E the force in units of the critical load. Its
first mode obeys:

    a'' = (p - 1) a + a0,        p = s tau - (a^2 - a0^2)/(4 r^2),        s = v/(L w1 (pi r/L)^2),                           (1)

s the rise of the straight column's force, in critical loads, over a radian of its vibration. The force peaks where it stops
rising, (a^2)' = 4 r^2 s.

References
----------
N. J. Hoff, The dynamics of the buckling of elastic columns, J. Applied Mechanics 18 (1951) 68-74.
V. A. Kuzkin, M. M. Dannert, The maximum force in a column under constant speed compression, arXiv:1511.01358.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs.geometry import Array


class Peak(NamedTuple):
    """First maximum of the force: time tau = w1 t, and force over the critical load."""

    time: float
    force: float


@dataclass(frozen=True)
class Hoff:
    """First mode of the column: rate s, and bow over the radius of gyration, both positive."""

    rate: float
    bow: float

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"{name} = {value!r}: must be positive and finite")

    def peak(self) -> Peak:
        """Integrate (1) to the first maximum of the force."""

        def turns(tau: float, y: Array) -> float:
            """Compute the rate of the force, zero at its maximum."""
            return float(self.rate - y[0] * y[1] / 2)

        def rates(tau: float, y: Array) -> tuple[float, float]:
            return y[1], (self.force(tau, y[0]) - 1.0) * y[0] + self.bow

        turns.terminal, turns.direction = True, -1.0  # type: ignore[attr-defined]
        until = 2 / self.rate + 40 * self.rate ** (-1 / 3) + 20  # twice the time to the critical load, and some growth
        run = solve_ivp(rates, (0.0, until), (self.bow, 0.0), method="DOP853", events=turns, rtol=1e-10, atol=1e-12)
        if not len(run.t_events[0]):
            raise ValueError(f"rate = {self.rate:g}, bow = {self.bow:g}: the force does not peak before tau = {until:g}")
        tau, a = float(run.t_events[0][0]), float(run.y_events[0][0][0])
        return Peak(tau, self.force(tau, a))

    def force(self, tau: float, a: float) -> float:
        """Compute the force over the critical load at a time tau and an amplitude a/r."""
        return float(self.rate * tau - (a**2 - self.bow**2) / 4)
