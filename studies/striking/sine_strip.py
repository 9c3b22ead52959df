"""One strike of a coupler of sine modes: a simple theory, compared with the simulated strike.

The coupler from the crank's pin A to the slider B has bending stiffness E I, mass mu a length, axial stiffness E A, and no axial
inertia. Seen from its chord it is y = sum of a_n sin(n pi s/L), stress-free b_n. Bending shortens it. So its compression is:

    P = (E A/L) (L - l - sum of n^2 pi^2 (a_n^2 - b_n^2)/(4 L)),     l = |AB|;                                        (1)

    mu a_n'' = -E I k^4 (a_n - b_n + tau a_n') + P k^2 a_n + q_n,     k = n pi/L.                                     (2)

The q_n are the sine components of weight and of the chord's transverse acceleration, linear from A to B. The slider obeys
m x'' = -P cos(phi) + F - f sign(x'), F the stop's force. This is Hoff's column with more modes, a mass that is struck at its end,
and a stop that gives way.

References
----------
N. J. Hoff, The dynamics of the buckling of elastic columns, J. Applied Mechanics 18 (1951) 68-74.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs.geometry import Array
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.library import PAPER, PAPER_STOP

from .slider_crank import CONTACT, Parameters

BEFORE = np.radians(3.0)
"""Crank angle before first contact at which integration begins [rad]."""
AFTER = np.radians(25.0)
"""Crank angle after first contact at which integration ends [rad]."""
REGULAR = 1e-3
"""Speed of the slider below which friction is linear [m/s]."""
N = np.arange(1, 11)
"""Half waves of the modes."""
R, L = PAPER.crank, PAPER.coupler
K = N * np.pi / L
"""Wave numbers of the modes [1/m]."""


@dataclass(frozen=True)
class SineStrip:
    """The slider-crank of a case, its coupler such a strip and its crank at constant speed."""

    case: Parameters

    @cached_property
    def frequency(self) -> float:
        """First frequency [rad/s]."""
        return self.case.section.first_frequency(L)

    @cached_property
    def free(self) -> Array:
        """Stress-free amplitudes [m], positive to the left of the way from A to B."""
        return np.where(N == 1, -self.case.imperfection * L, 0.0)

    @cached_property
    def bend(self) -> Array:
        """Bending stiffness of the modes, E I k^4 [N/m^2]."""
        return np.asarray(self.case.section.bending_stiffness * K**4)

    @cached_property
    def onset(self) -> float:
        """Speed of the slider at first contact [m/s]."""
        return -float(PAPER.slider_rate(CONTACT)) * self.case.speed

    @property
    def lasts(self) -> float:
        """Time after first contact by which the strip has buckled and the slider has rebounded [s]."""
        p, rise = self.case, self.case.stop_stiffness * self.onset
        rate = rise / (p.section.euler_load(L) * self.frequency)
        slider = 2 * np.pi * np.sqrt(p.mass / p.stop_stiffness)
        return float(min(AFTER / p.speed, slider + (3 + 6 / np.cbrt(rate)) / self.frequency))

    def peak(self) -> float:
        """Integrate from shortly before the first contact to the end of the impact; largest force on the stop [N]."""
        begin, longest = (CONTACT - BEFORE) / self.case.speed, BEFORE / self.case.speed + self.lasts

        def leaves(t: float, y: Array) -> float:
            return float(y[0] - PAPER_STOP)

        leaves.terminal, leaves.direction = True, 1.0  # type: ignore[attr-defined]
        run = solve_ivp(
            self._rates, (begin, begin + longest), self._start(CONTACT - BEFORE), method="LSODA", rtol=1e-5, atol=1e-9,
            events=leaves, max_step=longest / 300,
        )  # fmt: skip
        largest = max(self._forces(t, y)[1] for t, y in zip(run.t, run.y.T, strict=True))
        return largest if largest > 0 else np.nan

    def settle(self, angle: float) -> tuple[Array, float]:
        """Compute amplitudes in equilibrium [m] and compression [N], the slider moving as on a rigid coupler."""
        p, lean = self.case, float(np.sqrt(1 - (R / L * np.sin(angle)) ** 2))
        moved = float(PAPER.slider_second_rate(angle)) * p.speed**2
        load = (p.friction_force - p.mass * moved) / lean
        pulled = self._across(angle, R * np.cos(angle) - lean * L, moved)
        least = 0.1 * self.bend[0]  # beyond four fifths of the Euler load the strip swings; no equilibrium is meant
        return (self.bend * self.free + pulled) / np.maximum(self.bend - load * K**2, least), load

    def _start(self, angle: float) -> Array:
        """Return the initial state: the slider moves as on a rigid coupler, the modes are in equilibrium."""
        a, load = self.settle(angle)
        short = load * L / self.case.section.axial_stiffness + self._shortening(a)
        x = R * np.cos(angle) - np.sqrt((L - short) ** 2 - (R * np.sin(angle)) ** 2)
        return np.concatenate([[x, float(PAPER.slider_rate(angle)) * self.case.speed], a, np.zeros(N.size)])

    def _shortening(self, a: Array) -> float:
        return float((N**2 * np.pi**2 * (a**2 - self.free**2)).sum() / (4 * L))

    def _across(self, angle: float, x: float, moved: float) -> Array:
        """Compute q_n: weight less inertia of the chord, of a slider at x with an acceleration."""
        pin = R * np.array([np.cos(angle), np.sin(angle)])
        along = np.array([x, 0.0]) - pin
        left = np.array([-along[1], along[0]]) / np.hypot(*along)
        weight = left @ self.case.pull
        first, last = -(self.case.speed**2) * (left @ pin) - weight, left[0] * moved - weight
        return np.asarray(-self.case.section.mass_per_length * 2 / (N * np.pi) * (first - (-1.0) ** N * last))

    def _forces(self, t: float, y: Array) -> tuple[float, float, float]:
        """Compute compression of the strip and force of the stop [N], and the cosine of the chord's lean."""
        p, angle = self.case, self.case.speed * t
        dx, dy, depth = y[0] - R * np.cos(angle), R * np.sin(angle), PAPER_STOP - y[0]
        chord = np.hypot(dx, dy)
        load = p.section.axial_stiffness / L * (L - chord - self._shortening(y[2 : 2 + N.size]))
        chi = float(CarvalhoMartins.hysteresis(p.restitution))
        force = max(0.0, p.stop_stiffness * depth * (1 - chi * y[1] / self.onset)) if depth > 0 else 0.0
        return float(load), float(force), float(-dx / chord)

    def _rates(self, t: float, y: Array) -> Array:
        load, force, lean = self._forces(t, y)
        rubbed = self.case.friction_force * min(max(y[1] / REGULAR, -1.0), 1.0)
        moved = (force - load * lean - rubbed) / self.case.mass
        a, speed = np.split(y[2:], 2)
        bend = self.bend * (a - self.free + 2 * self.case.damping / self.frequency * speed)
        bent = (load * K**2 * a - bend + self._across(self.case.speed * t, y[0], moved)) / self.case.section.mass_per_length
        return np.concatenate([[y[1], moved], speed, bent])
