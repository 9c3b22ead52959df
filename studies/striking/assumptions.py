"""Parameters that the studies of the striking slider-crank share, among them what its paper leaves open: gravity and motor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from buckler.mbs import Mechanism, Motion, Motor, Ramp
from buckler.mbs.geometry import Array

from ..kit.parameters import Gravity, integer, quantity

SLOWED = 1.2
"""How much longer a run takes whose crank a motor turns."""
CONSTANT = 1.0
"""Torque constant of the motor, N m/A; only the slope of torque over speed matters, its square over the resistance."""


@dataclass(frozen=True)
class StrikeAssumptions(Gravity):
    """Gravity and motor of every study of the striking slider-crank."""

    motor: float = quantity(
        0.0, "N.m.s/rad", 0, 1e4, "DC motor at the crank: fall of its torque over speed; 0: speed prescribed", "left open"
    )
    motor_inertia: float = quantity(0.02, "kg.m^2", 0, 10, "of the motor's rotor at the crank", "left open")

    def under(self, made: Mechanism) -> Mechanism:
        """The same mechanism under gravity, and with its crank turned by the motor instead of driven at its speed.

        The voltage is the one at which the motor without load has that speed; it starts with it.
        """
        if self.gravity:
            made = replace(made, gravity=self.pull)
        if not self.motor:
            return made
        (drive,) = made.drives
        speed = drive.speed
        if isinstance(speed, int | float):
            voltage: Any = CONSTANT * speed
            first = voltage
        elif isinstance(speed, Ramp | Motion):
            voltage, first = (lambda t: CONSTANT * speed.speed(t)), CONSTANT * speed.speed(0.0)
        else:
            raise ValueError(f"drive = {speed!r}: a motor takes a speed, Ramp or Motion instead")
        motor = Motor("crank", voltage, resistance=CONSTANT**2 / self.motor, constant=CONSTANT, inertia=self.motor_inertia)
        return replace(made, drives=(), loads=(*made.loads, motor), velocities={"crank": float(first) / CONSTANT})

    def lasts(self, duration: float) -> float:
        """Time, s, in which the crank surely turns as far as it would at the speed without load in `duration`."""
        return duration * (SLOWED if self.motor else 1.0)

    def stated(self) -> str:
        """One sentence for a table."""
        drive = f"DC motor of {self.motor:g} N m s, {self.motor_inertia:g} kg m²" if self.motor else "speed prescribed"
        return f"Left open by the paper: gravity {self.down}; crank: {drive}"


@dataclass(frozen=True)
class StrikeParameters(StrikeAssumptions):
    """How the strip is simulated, too."""

    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode (beam)", "strip")
    imperfection: float = quantity(
        1e-4, "1", -0.05, 0.05, "bow of the unloaded strip over its length, to the side its inertia bends it (beam)", "strip"
    )
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-9, 1e-3, "position error allowed a step, over the length", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a run may take", "numerics")


def crank_angle(signals: Mapping[str, Array]) -> Array:
    """Crank angle from 0 at the start, rad: of the drive, or where a motor has turned the crank."""
    if "drive.position" in signals:
        return np.asarray(signals["drive.position"])
    return np.unwrap(np.arctan2(signals["crank.y"], signals["crank.x"]))
