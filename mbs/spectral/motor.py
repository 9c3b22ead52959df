"""A DC motor for the compiled solver: a torque that falls with the speed; its rotor's inertia is the link's."""

from __future__ import annotations

from buckler.mbs.elements.motor import CREEP, Motor
from buckler.mbs.laws.compiled import function_pointer
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.reference import marker_at
from buckler.mbs.spectral.tables import ANGLE, GIVEN, MOTOR


def add_motor(builder: Builder, name: str, load: Motor) -> None:
    """Add the torque of a `Motor`, its voltage constant or given in time."""
    marker = marker_at(builder, load.at(builder.mechanism))
    measure = builder.add_measure(ANGLE, marker, builder.ground((0.0, 0.0)))
    law, voltage = -1, 0.0
    if callable(load.voltage):
        law = builder.add_law(None, GIVEN, (), [function_pointer(load.voltage, 1)], f"the voltage of {name}")
    else:
        voltage = float(load.voltage)
    numbers = (voltage, load.resistance, load.constant, load.gear, load.friction, load.dead_band, CREEP)
    builder.add_force(name, MOTOR, measure, law=law, numbers=numbers)
