"""A force at a point for the compiled solver."""

from __future__ import annotations

from buckler.mbs.elements.force import Force
from buckler.mbs.elements.references import held_at
from buckler.mbs.functions import numbers_of
from buckler.mbs.laws.compiled import function_pointer
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.reference import marker_at
from buckler.mbs.spectral.tables import GIVEN, PUSH, X


def add_force(builder: Builder, name: str, load: Force) -> None:
    """Add a force, constant or given in time; its direction is fixed, or turns with a link; its line may be fixed, too."""
    turns = load.turns_with(builder.mechanism)
    a = marker_at(builder, held_at(builder.mechanism, load.point))
    if load.states is not None:
        builder.add_stateful(name, load, a, X, 0.0)
        return
    b = builder.ground((0.0, 0.0)) if turns is None else marker_at(builder, turns)
    line = [] if load.through is None else [1.0, *load.through]
    law, numbers = -1, [0.0, 0.0]
    if callable(load.value):
        parts = [function_pointer(each, 1) for each in numbers_of(load.value, ["t"], 2)]
        law = builder.add_law(None, GIVEN, (), parts, f"the function of {name}")
    else:
        numbers = [float(x) for x in load.value]
    builder.add_force(name, PUSH, a, b, law=law, numbers=[*numbers, 0.0 if turns is None else builder.angle_of(b), *line])
