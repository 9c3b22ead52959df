"""A rigid joint for the compiled solver: a pin that keeps the angle."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.revolute import name_of
from buckler.mbs.spectral.tables import ANGLE


def add_weld(builder: Builder, joint: Any) -> None:
    """Hold the two links' points together and keep the angle between them."""
    a, b = builder.marker(joint.first, joint.point), builder.marker(joint.second, joint.point)
    builder.pin(name_of(joint), a, b)
    builder.add_row(name_of(joint), builder.add_measure(ANGLE, a, b))
