"""An ideal pin for the compiled solver: two constraints."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.connect import connect


def add_revolute(builder: Builder, name: str, joint: Any) -> None:
    """Add the constraints of a `Revolute`."""
    connect(builder, name, joint)
