"""One strike with the coupler a strip of sine modes: a theory of a few lines, to hold the simulated strike against.

The coupler from the crank's pin A to the slider B has bending stiffness E I, mass mu a length, axial stiffness E A, and no axial
inertia. Seen from its chord it is y = sum of a_n sin(n pi s/L), stress-free b_n. Bending shortens it, so that its compression is

    P = (E A/L) (L - l - sum of n^2 pi^2 (a_n^2 - b_n^2)/(4 L)),     l = |AB|,                                        (1)

    mu a_n'' = -E I k^4 (a_n - b_n + tau a_n') + P k^2 a_n + q_n,     k = n pi/L,                                     (2)

q_n the sine components of weight and of the chord's transverse acceleration, linear from A to B. The slider obeys
m x'' = -P cos(phi) + F - f sign(x'), F the stop's force. This is Hoff's column (`buckler.elastica.hoff`) with more modes, a mass
that is struck at its end, and a stop that gives way.

References
----------
N. J. Hoff, The dynamics of the buckling of elastic columns, J. Applied Mechanics 18 (1951) 68-74.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs import Section
from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.library import PAPER, PAPER_STOP

BEFORE = np.radians(3.0)
"""Crank angle before first contact at which it begins, rad."""
AFTER = np.radians(25.0)
"""Crank angle after first contact at which it ends, rad."""
REGULAR = 1e-3
"""Speed of the slider below which friction is linear, m/s."""


class SineStrike(NamedTuple):
    """Largest force on the stop in the first impact, and of the strip until it ends, N; deflection before it over the length."""

    peak: float
    compression: float
    bent: float


@dataclass(frozen=True)
class SineStrip:
    """A slider-crank whose coupler is such a strip, its crank at constant speed.

    Attributes
    ----------
    section : of the strip, without damping
    damping : damping ratio of the first mode
    bow : stress-free, half a sine, over the length, to the side to which its inertia bends the strip
    mass, friction : of the slider, kg, N
    stiffness, restitution : of the stop, N/m, 1
    speed : of the crank, rad/s
    gravity : m/s^2
    stop : m
    modes : how many
    """

    section: Section
    damping: float
    bow: float
    mass: float
    friction: float
    stiffness: float
    restitution: float
    speed: float
    gravity: tuple[float, float] = (0.0, 0.0)
    stop: float = PAPER_STOP
    lengths: SliderCrank = field(default=PAPER)
    modes: int = 10

    @cached_property
    def waves(self) -> Array:
        """1, 2, ... of the modes."""
        return np.arange(1, self.modes + 1)

    @cached_property
    def frequency(self) -> float:
        """First frequency, rad/s."""
        return self.section.first_frequency(self.lengths.coupler)

    @cached_property
    def free(self) -> Array:
        """Stress-free amplitudes, m: positive to the left of the way from A to B."""
        return np.where(self.waves == 1, -self.bow * self.lengths.coupler, 0.0)

    @cached_property
    def bend(self) -> Array:
        """E I k^4, N/m^2."""
        return np.asarray(self.section.bending_stiffness * (self.waves * np.pi / self.lengths.coupler) ** 4)

    @cached_property
    def onset(self) -> tuple[float, float]:
        """Speed at first contact, m/s, and hysteresis factor of the stop."""
        rate = float(self.lengths.slider_rate(self.lengths.contact_angle(self.stop)))
        return -rate * self.speed, float(CarvalhoMartins.hysteresis(self.restitution))

    @property
    def lasts(self) -> float:
        """Time after first contact in which the strip has given way and the slider has been thrown back, s."""
        slider, stop = np.sqrt(self.mass / self.stiffness), self.stiffness * self.onset[0]
        rate = stop / (self.section.euler_load(self.lengths.coupler) * self.frequency)
        return float(min(AFTER / self.speed, 2 * np.pi * slider + (3 + 6 / np.cbrt(rate)) / self.frequency))

    def strike(self) -> SineStrike:
        """Follow it from shortly before the first contact to the end of the impact, or some way on."""
        angle = float(self.lengths.contact_angle(self.stop))
        state, begins = self._start(angle - BEFORE), (angle - BEFORE) / self.speed

        def leaves(t: float, y: Array) -> float:
            return float(y[0] - self.stop)

        leaves.terminal, leaves.direction = True, 1.0  # type: ignore[attr-defined]
        longest = BEFORE / self.speed + self.lasts
        run = solve_ivp(
            self._rates, (begins, begins + longest), state, method="LSODA", rtol=1e-5, atol=1e-9, events=leaves,
            max_step=longest / 300,
        )  # fmt: skip
        forces = np.array([self._forces(t, y) for t, y in zip(run.t, run.y.T, strict=True)])
        touched = np.flatnonzero(forces[:, 1] > 0)
        if not touched.size:
            return SineStrike(np.nan, float(forces[:, 0].max()), np.nan)
        bent = float(np.abs(run.y[2, touched[0]]) / self.lengths.coupler)
        return SineStrike(float(forces[:, 1].max()), float(forces[touched[0] :, 0].max()), bent)

    def before(self) -> Array:
        """Amplitudes in equilibrium with what bends the strip on its way, at first contact, m."""
        return self._settled(float(self.lengths.contact_angle(self.stop)))[0]

    def _settled(self, angle: float) -> tuple[Array, float]:
        """Amplitudes, m, and compression, N, on a slider that moves as on a rigid coupler."""
        r, length = self.lengths
        lean = float(np.sqrt(1 - (r / length * np.sin(angle)) ** 2))
        moved = float(self.lengths.slider_second_rate(angle)) * self.speed**2
        load = (self.friction - self.mass * moved) / lean
        k, bend = self.waves * np.pi / length, self.bend
        pulled = self._across(angle, r * np.cos(angle) - lean * length, moved)
        least = 0.1 * bend[0]  # beyond four fifths of the Euler load the strip swings; no equilibrium is meant
        return (bend * self.free + pulled) / np.maximum(bend - load * k**2, least), load

    def _start(self, angle: float) -> Array:
        """Slider as on a rigid coupler, modes in equilibrium with what bends them there."""
        r, length = self.lengths
        a, load = self._settled(angle)
        short = load * length / self.section.axial_stiffness + self._shortening(a)
        x = r * np.cos(angle) - np.sqrt((length - short) ** 2 - (r * np.sin(angle)) ** 2)
        rate = float(self.lengths.slider_rate(angle))
        return np.concatenate([[x, rate * self.speed], a, np.zeros(self.modes)])

    def _shortening(self, a: Array) -> float:
        n = self.waves
        return float((n**2 * np.pi**2 * (a**2 - self.free**2)).sum() / (4 * self.lengths.coupler))

    def _across(self, angle: float, x: float, moved: float) -> Array:
        """q_n: weight less inertia of the chord, of a slider at x with an acceleration."""
        r, n = self.lengths.crank, self.waves
        pin = r * np.array([np.cos(angle), np.sin(angle)])
        along = np.array([x, 0.0]) - pin
        left = np.array([-along[1], along[0]]) / np.hypot(*along)
        first, last = -(self.speed**2) * (left @ pin) - left @ self.gravity, left[0] * moved - left @ self.gravity
        return np.asarray(-self.section.mass_per_length * 2 / (n * np.pi) * (first - (-1.0) ** n * last))

    def _forces(self, t: float, y: Array) -> tuple[float, float, float]:
        """Compression of the strip and force of the stop, N, and the cosine of the chord's lean."""
        r, length = self.lengths
        angle = self.speed * t
        dx, dy = y[0] - r * np.cos(angle), r * np.sin(angle)
        chord = np.hypot(dx, dy)
        load = self.section.axial_stiffness / length * (length - chord - self._shortening(y[2 : 2 + self.modes]))
        depth = self.stop - y[0]
        onset, chi = self.onset
        force = max(0.0, self.stiffness * depth * (1 - chi * y[1] / onset)) if depth > 0 else 0.0
        return float(load), float(force), float(-dx / chord)

    def _rates(self, t: float, y: Array) -> Array:
        m = self.modes
        load, force, lean = self._forces(t, y)
        rubbed = self.friction * min(max(y[1] / REGULAR, -1.0), 1.0)
        moved = (force - load * lean - rubbed) / self.mass
        k = self.waves * np.pi / self.lengths.coupler
        a, speed = y[2 : 2 + m], y[2 + m :]
        late = 2 * self.damping / self.frequency
        bend = self.bend * (a - self.free + late * speed)
        bent = (load * k**2 * a - bend + self._across(self.speed * t, y[0], moved)) / self.section.mass_per_length
        return np.concatenate([[y[1], moved], speed, bent])
