"""A prismatic joint between two links for the compiled solver: a point stays on a line of the second, the angle is kept."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.revolute import name_of
from buckler.mbs.spectral.tables import ANGLE, TURNING


def add_slider(builder: Builder, joint: Any) -> None:
    """Hold a point of `first` on the line through it that is fixed in `second`, and keep the angle."""
    a, b = builder.marker(joint.first, joint.point), builder.marker(joint.second, joint.point)
    x, y = joint.along
    builder.add_row(name_of(joint), builder.add_measure(TURNING, a, b, (-y, x)), value=0.0)
    builder.add_row(name_of(joint), builder.add_measure(ANGLE, a, b))
