"""A torque on a link for the compiled solver."""

from __future__ import annotations

from buckler.mbs.elements.torque import Torque
from buckler.mbs.laws.compiled import function_pointer
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.reference import marker_at
from buckler.mbs.spectral.tables import ANGLE, GIVEN, LAW, TURN


def add_torque(builder: Builder, name: str, load: Torque) -> None:
    """Add a torque: constant, or a function of time, angle since t = 0 and speed, and of states."""
    marker = marker_at(builder, load.at(builder.mechanism))
    if load.states is not None:
        builder.add_stateful(name, load, marker, TURN, builder.angle_of(marker))
        return
    measure = builder.add_measure(ANGLE, marker, builder.ground((0.0, 0.0)))
    if not callable(load.value):
        builder.add_force(name, GIVEN, measure, numbers=(float(load.value),))
        return
    law = builder.add_law(None, LAW, (), [function_pointer(load.value, 3)], f"the function of {name}")
    builder.add_force(name, LAW, measure, law=law, numbers=(0.0, 0.0, builder.angle_of(marker)))
