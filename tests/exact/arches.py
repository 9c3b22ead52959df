"""Limit loads of a circular arch under a dead load at mid-span in SI, by the boundary value problem of `strip_paths`."""

from __future__ import annotations

import numpy as np

from buckler.elastica.strip import Load, Strip

from . import shapes
from .strip_paths import follow

MODULUS, POISSON, DENSITY = 210e9, 0.3, 7850.0
"""Steel, Pa, 1, kg/m^3."""
SPAN, RISE, WIDTH, THICKNESS = 0.2, 0.01, 0.01, 0.001
"""Arch [m]."""


def snap(ends: str) -> list[float]:
    """Compute both limit loads, N, of an arch between "pinned" or "clamped" ends, with Cowper's shear factor."""
    half = 2.0 * np.arctan(2.0 * RISE / SPAN)
    length, area = SPAN * half / np.sin(half), WIDTH * THICKNESS
    unit = MODULUS * WIDTH * THICKNESS**3 / 12.0 / length**2
    stiffness = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON) * MODULUS / (2.0 * (1.0 + POISSON)) * area
    strip = Strip(ends, ends, shapes.circle(half), MODULUS * area / unit, stiffness / unit, nodes=40)
    path = follow(strip, Load(inner=(0.0, -1.0)), 100.0)
    return [point.factor * unit for point in path.limits[:2]]
