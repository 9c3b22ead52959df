"""Parameters that the studies of the striking slider-crank share, also those its paper does not give: gravity and motor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from buckler.mbs import Mechanism, Motor, Ramp
from buckler.mbs.geometry import Array

from ..kit.parameters import Gravity, integer, quantity

SLOWED = 1.2
"""Factor on the time of a run whose crank a motor turns: motors that explain the forces are slower by less."""


@dataclass(frozen=True)
class StrikeAssumptions(Gravity):
    """Gravity and motor of every study of the striking slider-crank."""

    motor: float = quantity(
        0.0, "N.m.s/rad", 0, 1e4, "DC motor at the crank: fall of its torque over speed; 0: speed prescribed", "left open"
    )
    motor_inertia: float = quantity(0.02, "kg.m^2", 0, 10, "of the motor's rotor at the crank", "left open")

    def under(self, made: Mechanism) -> Mechanism:
        """Put the mechanism under gravity, and let the motor turn its crank instead of the drive.

        The voltage is the one at which the motor without load has the drive's speed; it starts with that speed. The torque
        constant is 1 N m/A: only the slope of torque over speed matters, its square over the resistance.
        """
        if self.gravity:
            made = replace(made, gravity=self.pull)
        if not self.motor:
            return made
        speed: Any = made.drives[0].speed
        voltage, first = (lambda t: speed.speed(t), speed.speed(0.0)) if isinstance(speed, Ramp) else (speed, speed)
        motor = Motor("crank", voltage, resistance=1 / self.motor, constant=1.0, inertia=self.motor_inertia)
        return replace(made, drives=(), loads=(*made.loads, motor), velocities={"crank": float(first)})

    def lasts(self, duration: float) -> float:
        """Bound the time [s] in which the crank turns as far as it would at the speed without load in `duration` [s]."""
        return duration * (SLOWED if self.motor else 1.0)

    def describe(self) -> str:
        """State gravity and motor in one sentence."""
        drive = f"DC motor of {self.motor:g} N m s, {self.motor_inertia:g} kg m²" if self.motor else "speed prescribed"
        return f"Left open by the paper: gravity {self.down}; crank: {drive}"


@dataclass(frozen=True)
class StrikeParameters(StrikeAssumptions):
    """Gravity and motor, and how the strip is simulated."""

    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode (beam)", "strip")
    imperfection: float = quantity(
        1e-4, "1", -0.05, 0.05, "bow of the unloaded strip over its length, to the side its inertia bends it (beam)", "strip"
    )
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-9, 1e-3, "position error allowed a step, over the length", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a run may take", "numerics")


def crank_angle(signals: Mapping[str, Array]) -> Array:
    """Return the crank angle from 0 at the start [rad]: of the drive, or where a motor has turned the crank."""
    if "drive.position" in signals:
        return np.asarray(signals["drive.position"])
    return np.unwrap(np.arctan2(signals["crank.y"], signals["crank.x"]))
