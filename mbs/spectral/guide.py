"""A guided block for the compiled solver: its mass is the link's, one constraint across the line, friction along it."""

from __future__ import annotations

from buckler.mbs.elements.guide import Guide
from buckler.mbs.laws import BristleLaw, FrictionLaw
from buckler.mbs.spectral import tables as k
from buckler.mbs.spectral.builder import GROUND, Builder
from buckler.mbs.spectral.connect import connect
from buckler.mbs.spectral.laws import add_friction


def add_guide(builder: Builder, name: str, guide: Guide) -> None:
    """Hold a link's point on a line of the ground."""
    row = len(builder.rows)
    connect(builder, name, guide)
    friction = guide.friction
    if friction is None:
        return
    a, b = builder.marker(guide.link, guide.point), builder.marker(GROUND, guide.point)
    along = builder.add_measure(k.FIXED, a, b, guide.along)
    if isinstance(friction, FrictionLaw | BristleLaw):
        builder.add_force(name, k.SEAT, along, friction=add_friction(builder, friction), row=row)
        return
    numbers = (friction.dynamic, friction.static_offset, friction.viscous, friction.regularisation, friction.stribeck)
    builder.add_force(name, k.DRY, along, numbers=numbers)
