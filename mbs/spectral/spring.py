"""Springs for the compiled solver: between two points, and between two links' angles."""

from __future__ import annotations

from math import dist
from typing import Any

from buckler.mbs.laws.compiled import function_pointer, method_pointer
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.reference import marker_of, split
from buckler.mbs.spectral.tables import DISTANCE, LAW, LINE_SPRING


def add_spring(builder: Builder, name: str, load: Any) -> None:
    """Add a spring and damper between two points, linear or with a law."""
    places = [builder.mechanism.points[split(builder, p)[1]] for p in (load.a, load.b)]
    free = dist(*places) if load.free_length is None else load.free_length
    measure = builder.add_measure(DISTANCE, marker_of(builder, load.a), marker_of(builder, load.b))
    add_line(builder, load, name, measure, free)


def add_line(builder: Builder, load: Any, name: str, measure: int, free: float) -> None:
    """Add the force of a spring along a measure: -k (l - l0) - c l', or that of its law of (l - l0, l')."""
    if load.law is None:
        builder.add_force(name, LINE_SPRING, measure, numbers=(load.stiffness, load.damping, free))
        return
    law = load.law
    force = (lambda _t, x, r: -law(x, r)) if callable(law) else None
    pointer = function_pointer(force, 3) if force else method_pointer(law, "force", 3)
    row = builder.add_law(None, LAW, (), [pointer], f"the law of {name}")
    builder.add_force(name, LAW, measure, law=row, numbers=(0.0, 0.0, free))
