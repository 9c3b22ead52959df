"""Protocol of normal contact laws, and elementary functions for laws.

The functions use nothing but arithmetic, ``abs`` and ``exp``. So a law made of them takes a float or an array of any shape, and
can be compiled.
"""

from typing import Any, Protocol, TypeAlias, runtime_checkable

import numpy as np

Reals: TypeAlias = Any
"""Argument and value of a law: a float or an array (arrays broadcast). Any, because abs(float | array) has no type."""


def ramp(x: Reals) -> Reals:
    """Return max(0, x)."""
    return 0.5 * (x + abs(x))


def saturate(x: Reals) -> Reals:
    """Return x / max(1, |x|): x clipped to [-1, 1], beyond that range to one rounding error."""
    return x / (1.0 + ramp(abs(x) - 1.0))


def step(x: Reals, x0: float, h0: float, x1: float, h1: float) -> Reals:
    """Return the ADAMS function STEP: h0 + (h1 - h0) D^2 (3 - 2 D) with D = (x - x0) / (x1 - x0) clipped to [0, 1]."""
    fraction = saturate(ramp((x - x0) / (x1 - x0)))
    return h0 + (h1 - h0) * fraction * fraction * (3.0 - 2.0 * fraction)


def stribeck_level(speed: Reals, static: float, dynamic: float, v_stribeck: float, exponent: float) -> Reals:
    """Return mu_d + (mu_s - mu_d) exp(-|v/v_str|^delta) [1], which falls from static at rest to dynamic friction."""
    return dynamic + (static - dynamic) * np.exp(-((abs(speed) / v_stribeck) ** exponent))


@runtime_checkable
class NormalLaw(Protocol):
    """Protocol of normal contact laws for stops and clearance joints; methods take floats, or arrays that broadcast."""

    @property
    def stiffness(self) -> float:
        """Stiffness K of the elastic part K d^n [N/m^n]."""

    @property
    def exponent(self) -> float:
        """Exponent n of the elastic part K d^n [1]."""

    def force(self, depth: Reals, rate: Reals, onset: Reals) -> Reals:
        """Return the contact force [N] >= 0: 0 where the depth [m] <= 0; `rate` of the depth, approach speed at `onset` [m/s]."""

    def elastic(self, depth: Reals) -> Reals:
        """Return the elastic part of the force [N]."""

    def potential(self, depth: Reals) -> Reals:
        """Return the energy of the elastic part [J]: the integral of ``elastic`` from 0 to depth."""
