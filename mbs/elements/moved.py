"""What links and blocks did in a run, as elements see it: `buckler.mbs.record.motion` and `strips` have it so."""

from __future__ import annotations

from typing import Protocol

from buckler.mbs.geometry import Array


class Moved(Protocol):
    """What a link or block did, as its elements see it; places and rates each (times, 2), angles and energies (times,)."""

    @property
    def mass(self) -> float:
        """Mass, kg."""

    def point(self, name: str, /) -> tuple[Array, Array]:
        """Place and velocity of a point on it."""

    def turn(self, name: str, /) -> tuple[Array, Array]:
        """Angle turned since t = 0 there, rad, and its rate."""

    def centre(self) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of the centre of mass."""

    def kinetic(self) -> Array:
        """Kinetic energy, J."""


class Slid(Moved, Protocol):
    """What a guide's block did."""

    @property
    def travel(self) -> Array:
        """Way along the guide since t = 0, m."""

    @property
    def speed(self) -> Array:
        """Of the travel, m/s."""
