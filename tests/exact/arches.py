"""Limit loads of arches under a dead load at mid-span in SI, by the boundary value problem of `strip_paths`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from buckler.elastica.strip import Load, Strip

from . import shapes
from .strip_paths import follow

MODULUS, POISSON, DENSITY = 210e9, 0.3, 7850.0
"""Steel, Pa, 1, kg/m^3."""
SPAN, RISE, WIDTH, THICKNESS = 0.2, 0.01, 0.01, 0.001
"""Arch [m]."""


class Snap(NamedTuple):
    """Both limit loads, N, downwards positive, and the load at which it first sways, N."""

    loads: tuple[float, float]
    sway: float


def snap(shape: str, ends: str, nodes: int = 40) -> Snap:
    """Snapping of a "circle" or "half-sine" arch between "pinned" or "clamped" ends; Cowper's shear factor."""
    if shape == "circle":
        half = 2.0 * np.arctan(2.0 * RISE / SPAN)
        angle, length = shapes.circle(half), SPAN * half / np.sin(half)
    else:
        angle, ratio = shapes.half_sine(RISE / SPAN)
        length = ratio * SPAN
    area = WIDTH * THICKNESS
    unit = MODULUS * WIDTH * THICKNESS**3 / 12.0 / length**2
    stiffness = 10.0 * (1.0 + POISSON) / (12.0 + 11.0 * POISSON) * MODULUS / (2.0 * (1.0 + POISSON)) * area
    strip = Strip(ends, ends, angle, MODULUS * area / unit, stiffness / unit, nodes=nodes)
    path = follow(strip, Load(inner=(0.0, -1.0)), 100.0)
    first, second = path.limits[:2]
    return Snap((first.factor * unit, second.factor * unit), path.branchings[0].factor * unit)
