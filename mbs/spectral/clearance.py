"""A pin in a bush with clearance for the compiled solver: a force between two markers, no constraint."""

from __future__ import annotations

from buckler.mbs.elements.clearance import Clearance
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.laws import add_friction, add_normal
from buckler.mbs.spectral.tables import JOURNAL


def add_clearance(builder: Builder, name: str, joint: Clearance) -> None:
    """Add the contact of the first body's pin in the second's bush; at the start they are concentric."""
    if not joint.round:
        raise ValueError(f"clearance at '{joint.point}': the compiled solver knows round pins and bushes only")
    a, b = builder.marker(joint.first, joint.point), builder.marker(joint.second, joint.point)
    law, friction = add_normal(builder, joint.law), add_friction(builder, joint.friction)
    builder.add_force(name, JOURNAL, a, b, law=law, friction=friction, numbers=(joint.pin, joint.gap))
