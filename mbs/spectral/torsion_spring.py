"""A torsion spring between two links for the compiled solver."""

from __future__ import annotations

from buckler.mbs.elements.torsion_spring import TorsionSpring
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.reference import marker_at
from buckler.mbs.spectral.spring import add_line
from buckler.mbs.spectral.tables import ANGLE


def add_torsion_spring(builder: Builder, name: str, load: TorsionSpring) -> None:
    """Add a spring and damper on the angle of `second` from `first`."""
    first, second = (marker_at(builder, at) for at in load.ends(builder.mechanism))
    free = builder.angle_of(second) - builder.angle_of(first) + (load.free_angle or 0.0)
    add_line(builder, name, load, builder.add_measure(ANGLE, second, first), free)
