"""What drives a mechanism: a constant speed, a ramp, or any motion with its derivative."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from typing import Any

from buckler.mbs.elements.element import Array, Element, Energy, Recorded, Signal, known, since_start
from buckler.mbs.elements.rigid import Rigid
from buckler.mbs.validate import function, number, one_of, positive


@dataclass(frozen=True)
class Ramp:
    """Speed that changes linearly from `start` to `end` (rad/s or m/s) over `duration` seconds, then stays."""

    start: float
    end: float
    duration: float

    def __post_init__(self) -> None:
        number("start", self.start, -inf, inf, "rad/s or m/s")
        number("end", self.end, -inf, inf, "rad/s or m/s")
        positive("duration", self.duration, "s")

    def speed(self, t: float) -> float:
        """Speed at time t >= 0."""
        return self.start + (self.end - self.start) * min(t, self.duration) / self.duration

    def position(self, t: float) -> float:
        """Angle or displacement since t = 0: the exact integral of `speed`."""
        s = min(t, self.duration)
        return self.start * s + (self.end - self.start) * s * s / (2 * self.duration) + self.end * (t - s)

    def acceleration(self, t: float) -> float:
        """Rate of the speed at time t >= 0."""
        return (self.end - self.start) / self.duration if t < self.duration else 0.0


@dataclass(frozen=True)
class Motion:
    """Any motion: `position(t)` (rad or m, zero at t = 0) with its derivative `speed(t)`."""

    position: Callable[[float], float]
    speed: Callable[[float], float]

    def __post_init__(self) -> None:
        function("position", self.position, 0.0)
        function("speed", self.speed, 0.0)
        number("position(0)", self.position(0.0), -1e-12, 1e-12, "rad or m")
        h = 1e-4
        for t in (0.1, 0.5):
            slope = (self.position(t + h) - self.position(t - h)) / (2 * h)
            if abs(slope - self.speed(t)) > 1e-3 * (abs(slope) + abs(self.speed(t))) + 1e-6:
                raise ValueError(f"speed({t:g}) = {self.speed(t):g} is not the derivative of position: {slope:g}")

    def acceleration(self, t: float) -> float:
        """Central difference of the speed over 2e-4 s; at the start to second order from times after it."""
        h = 1e-4
        if t < h:
            return (4 * self.speed(t + h) - 3 * self.speed(t) - self.speed(t + 2 * h)) / (2 * h)
        return (self.speed(t + h) - self.speed(t - h)) / (2 * h)


@dataclass(frozen=True)
class Drive(Element):
    """Prescribed rotation of a link, or prescribed travel of a guided point along its guide.

    Parameters
    ----------
    target : str
        Name of a rigid link (rotation, rad/s) or of a guided point (translation, m/s).
    speed : float, Ramp or Motion
    """

    target: str
    speed: float | Ramp | Motion

    def __post_init__(self) -> None:
        if not isinstance(self.speed, int | float) or isinstance(self.speed, bool):
            one_of(f"speed of the drive of '{self.target}'", self.speed, (float, Ramp, Motion))
        else:
            number("speed", self.speed, -inf, inf, "rad/s or m/s")

    @property
    def key(self) -> str:
        """'drive'."""
        return "drive"

    def check(self, mechanism: Any) -> None:
        """A rigid link or a guided point."""
        rigid = {link.name for link in mechanism.links if isinstance(link.body, Rigid)}
        known("rigid link or guided point", self.target, rigid | {guide.point for guide in mechanism.guides}, "drive")

    @property
    def motion(self) -> Motion | Ramp:
        """The drive as an object with position(t) and speed(t)."""
        if isinstance(self.speed, Ramp | Motion):
            return self.speed
        speed = float(self.speed)
        return Ramp(speed, speed, 1.0)

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield torque, N m, or force, N, of the drive, and the angle, rad, or travel, m, since t = 0."""
        turns = self.target not in record.mechanism.points
        effort = record.channel(name, "effort")[:, 0]
        yield Signal(f"{name}.torque" if turns else f"{name}.force", effort, "N m" if turns else "N")
        yield Signal(f"{name}.position", self._driven(record)[0], "rad" if turns else "m")

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work it gave."""
        power = record.channel(name, "effort")[:, 0] * self._driven(record)[1]
        yield Energy("given", "drive", since_start(record.time, power))

    def _driven(self, record: Recorded) -> tuple[Array, Array]:
        """The driven coordinate and its rate."""
        if self.target in record.mechanism.points:
            block = record.blocks[self.target]
            return block.travel, block.speed
        return record.turn(f"{self.target}:{record.mechanism.link(self.target).start}")
