"""Springs for the compiled solver: between two points."""

from __future__ import annotations

from buckler.mbs.elements.references import held_at
from buckler.mbs.elements.spring import Spring
from buckler.mbs.elements.torsion_spring import TorsionSpring
from buckler.mbs.laws.compiled import function_pointer
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.reference import marker_at
from buckler.mbs.spectral.tables import DISTANCE, LAW, LINE_SPRING


def add_spring(builder: Builder, name: str, load: Spring) -> None:
    """Add a spring and damper between two points, linear or with a law."""
    a, b = (marker_at(builder, held_at(builder.mechanism, at)) for at in (load.a, load.b))
    add_line(builder, name, load, builder.add_measure(DISTANCE, a, b), load.free(builder.mechanism))


def add_line(builder: Builder, name: str, load: Spring | TorsionSpring, measure: int, free: float) -> None:
    """Add the force of a spring along a measure: -k (l - l0) - c l', or less that of its law of (l - l0, l')."""
    if load.law is None:
        builder.add_force(name, LINE_SPRING, measure, numbers=(load.stiffness, load.damping, free))
        return
    row = builder.add_law(None, LAW, (), [function_pointer(load.law, 2)], f"the law of {name}")
    builder.add_force(name, LAW, measure, law=row, numbers=(1.0, 0.0, free))
