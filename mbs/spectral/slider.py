"""Joints that slide along a line of another body for the compiled solver: `Slider` keeps the angle, `Slot` does not."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.connect import connect


def add_slider(builder: Builder, name: str, joint: Any) -> None:
    """Add the constraints of a `Slider` or `Slot`."""
    connect(builder, name, joint)
