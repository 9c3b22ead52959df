"""An ideal pin for the compiled solver: two constraints."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral.builder import Builder


def name_of(joint: Any) -> str:
    """Name of a joint's constraints."""
    return f"{joint.point}.{joint.first}-{joint.second}"


def add_revolute(builder: Builder, joint: Any) -> None:
    """Hold the two links' points together; a strut leans on its neighbour and needs no constraint."""
    a, b = builder.marker(joint.first, joint.point), builder.marker(joint.second, joint.point)
    builder.pin(name_of(joint), a, b)
