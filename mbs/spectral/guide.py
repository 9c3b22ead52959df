"""A guided block for the compiled solver: its mass is the link's, one constraint across the line, friction along it."""

from __future__ import annotations

from typing import Any

from buckler.mbs.laws import BristleLaw, FrictionLaw
from buckler.mbs.spectral import tables as k
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.laws import add_friction


def add_guide(builder: Builder, guide: Any) -> None:
    """Hold a link's point on a line of the ground."""
    a, b = builder.marker(guide.link, guide.point), builder.marker("ground", guide.point)
    x, y = guide.along
    name = f"guide {guide.point}"
    row = builder.add_row(name, builder.add_measure(k.FIXED, a, b, (-y, x)), value=0.0)
    friction = guide.friction
    if friction is None:
        return
    along = builder.add_measure(k.FIXED, a, b, (x, y))
    if isinstance(friction, FrictionLaw | BristleLaw):
        builder.add_force(name, k.SEAT, along, friction=add_friction(builder, friction), row=row)
        return
    numbers = (friction.dynamic, friction.static_offset, friction.viscous, friction.regularisation, friction.stribeck)
    builder.add_force(name, k.DRY, along, numbers=numbers)
