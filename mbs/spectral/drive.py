"""A drive for the compiled solver: a constraint that moves with time."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.connect import connect


def add_drive(builder: Builder, name: str, drive: Any) -> None:
    """Prescribe a link's angle, or a guided point's travel."""
    connect(builder, name, drive)
