"""A torque on a link for the compiled solver."""

from __future__ import annotations

from typing import Any

from buckler.mbs.laws.compiled import function_pointer
from buckler.mbs.spectral.builder import GROUND, Builder
from buckler.mbs.spectral.reference import marker_of_link, numbered
from buckler.mbs.spectral.tables import ANGLE, GIVEN, LAW


def add_torque(builder: Builder, load: Any) -> None:
    """Add a torque: constant, or a function of time, angle since t = 0 and speed."""
    measure = builder.add_measure(ANGLE, marker_of_link(builder, load.link), marker_of_link(builder, GROUND))
    name = numbered(builder, f"torque.{load.link}")
    if not callable(load.value):
        builder.add_force(name, GIVEN, measure, numbers=(float(load.value),))
        return
    law = builder.add_law(None, LAW, (), [function_pointer(load.value, 3)], f"the function of {name}")
    start = builder.angle_of(builder.measures[measure][1])
    builder.add_force(name, LAW, measure, law=law, numbers=(0.0, 0.0, start))
