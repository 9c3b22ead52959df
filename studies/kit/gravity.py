"""Gravity in the plane of a published mechanism, which its paper leaves open."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, pi, sin

from buckler.studies.kit.parameters import StudyParameters, quantity


@dataclass(frozen=True)
class Gravity(StudyParameters):
    """Its size and direction."""

    gravity: float = quantity(0.0, "m/s^2", 0, 100, "gravity in the plane; 0: none, or normal to it", "left open")
    gravity_angle: float = quantity(-pi / 2, "rad", -7, 7, "its direction from the frame: O-C, or the slider's line", "left open")

    @property
    def pull(self) -> tuple[float, float]:
        """As a vector, m/s^2."""
        return (self.gravity * cos(self.gravity_angle), self.gravity * sin(self.gravity_angle)) if self.gravity else (0.0, 0.0)

    @property
    def down(self) -> str:
        """In words."""
        return f"{self.gravity:g} m/s² at {degrees(self.gravity_angle):.4g} deg" if self.gravity else "none in the plane"
