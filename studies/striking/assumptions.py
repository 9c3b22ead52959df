"""What the paper on the striking slider-crank leaves open, as parameters: gravity in its plane and the motor of its crank.

The paper's figures fit gravity normal to the plane and a crank of prescribed speed no better than others: see `identify`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, sin

import numpy as np

from buckler.mbs import Mechanism, Motor, Ramp
from buckler.mbs.elements import Motion
from buckler.studies.kit.parameters import StudyParameters, quantity

CONSTANT = 1.0
"""Torque constant of the motor, N m/A; only the slope of torque over speed matters, its square over the resistance."""


@dataclass(frozen=True)
class StrikeAssumptions(StudyParameters):
    """Gravity and motor of every study of the striking slider-crank."""

    gravity: float = quantity(0.0, "m/s^2", 0, 100, "gravity in the plane; 0: normal to it (strip and links)", "left open")
    gravity_angle: float = quantity(-pi / 2, "rad", -7, 7, "its direction from the slider's line", "left open")
    motor: float = quantity(
        0.0, "N.m.s/rad", 0, 1e4, "DC motor at the crank: fall of its torque over speed; 0: speed prescribed", "left open"
    )
    motor_inertia: float = quantity(0.02, "kg.m^2", 0, 10, "of the motor's rotor at the crank", "left open")

    @property
    def pull(self) -> tuple[float, float]:
        """Gravity as a vector, m/s^2."""
        if not self.gravity:
            return (0.0, 0.0)
        return (self.gravity * cos(self.gravity_angle), self.gravity * sin(self.gravity_angle))

    def under(self, made: Mechanism) -> Mechanism:
        """The same mechanism under gravity, and with its crank turned by the motor instead of driven at its speed.

        The voltage is the one at which the motor without load has that speed; it starts with it.
        """
        if self.gravity:
            made = replace(made, gravity=self.pull)
        if not self.motor:
            return made
        (drive,) = made.drives
        speed: float | Ramp | Motion = drive.speed
        law = speed if isinstance(speed, int | float) else (lambda t: CONSTANT * speed.speed(t))
        motor = Motor(
            "crank", CONSTANT * law if isinstance(law, int | float) else law, resistance=CONSTANT**2 / self.motor,
            constant=CONSTANT, inertia=self.motor_inertia,
        )  # fmt: skip
        first = float(speed) if isinstance(speed, int | float) else float(speed.speed(0.0))
        return replace(made, drives=(), loads=(*made.loads, motor), velocities={"crank": first})

    def stated(self) -> str:
        """One sentence for a table."""
        down = f"{self.gravity:g} m/s² at {np.degrees(self.gravity_angle):.4g} deg" if self.gravity else "none in the plane"
        drive = f"DC motor of {self.motor:g} N m s, {self.motor_inertia:g} kg m²" if self.motor else "speed prescribed"
        return f"Left open by the paper: gravity {down}; crank: {drive}"
