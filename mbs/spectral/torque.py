"""A torque on a link for the compiled solver."""

from __future__ import annotations

from typing import Any

from buckler.mbs.laws.compiled import function_pointer
from buckler.mbs.spectral.builder import GROUND, Builder
from buckler.mbs.spectral.reference import marker_of_link
from buckler.mbs.spectral.tables import ANGLE, GIVEN, LAW


def add_torque(builder: Builder, name: str, load: Any) -> None:
    """Add a torque: constant, or a function of time, angle since t = 0 and speed."""
    measure = builder.add_measure(ANGLE, marker_of_link(builder, load.link), marker_of_link(builder, GROUND))
    if not callable(load.torque):
        builder.add_force(name, GIVEN, measure, numbers=(float(load.torque),))
        return
    law = builder.add_law(None, LAW, (), [function_pointer(load.torque, 3)], f"the function of {name}")
    start = builder.angle_of(builder.measures[measure][1])
    builder.add_force(name, LAW, measure, law=law, numbers=(0.0, 0.0, start))
