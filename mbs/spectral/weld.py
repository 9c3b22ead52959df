"""A rigid joint for the compiled solver: a pin that keeps the angle."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.connect import connect


def add_weld(builder: Builder, name: str, joint: Any) -> None:
    """Add the constraints of a `Weld`."""
    connect(builder, name, joint)
