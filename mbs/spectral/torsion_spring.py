"""A torsion spring between two links for the compiled solver."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.reference import marker_of_link
from buckler.mbs.spectral.spring import add_line
from buckler.mbs.spectral.tables import ANGLE


def add_torsion_spring(builder: Builder, name: str, load: Any) -> None:
    """Add a spring and damper on the angle of `second` from `first`."""
    a, b = marker_of_link(builder, load.second), marker_of_link(builder, load.first)
    measure = builder.add_measure(ANGLE, a, b)
    start = builder.angle_of(a) - builder.angle_of(b)
    free = start if load.free_angle is None else start + load.free_angle
    add_line(builder, load, name, measure, free)
