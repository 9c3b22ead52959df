"""Magnets for the compiled solver."""

from buckler.mbs.elements.references import holder_reference
from buckler.mbs.functions import Expression
from buckler.mbs.laws.compiled import function_pointer
from buckler.mbs.spectral.connect import marker_at
from buckler.mbs.spectral.tables import ForceKind, MeasureKind


def add(builder, name, magnet):
    """Add a force along the distance, as a law of it."""
    a, b = (marker_at(builder, holder_reference(builder.mechanism, at)) for at in (magnet.a, magnet.b))
    force = Expression(f"{magnet.strength!r}/x**2 + 0*v")
    row = builder.add_law(None, ForceKind.LAW, (), [function_pointer(force, 2)], name)
    builder.add_force(name, ForceKind.LAW, builder.add_measure(MeasureKind.DISTANCE, a, b), law=row, numbers=(1.0, 0.0, 0.0))
