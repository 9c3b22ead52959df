"""Drives: a prescribed angle or travel, by a constant speed, a ramp of the speed, or any motion with its derivative."""

from bisect import bisect
from collections.abc import Callable, Iterator
from functools import cached_property, partial
from itertools import pairwise
from math import inf
from typing import ClassVar

import numpy as np

from ..declare import Declared, Either, Part, Quantity, declared, field, names, quantity
from ..functions import Expression, Table, kinks
from ..functions.fields import Function
from ..geometry import Array
from ..validate import number, short
from .element import GROUND, Element, Parts, Place, Recorded
from .references import check_known
from .rows import Along, Row, Turn, row
from .signal import Energy, Kind, Signal

STEP = 1e-5
"""Longest step of differences [s]; a tenth of it loses a digit more to rounding, but has a smaller truncation error."""
SPEED_ERROR = 1e-3
"""Largest difference of a motion's speed from the derivative of its position, over the sum of both magnitudes; chosen."""


@declared
class Ramp(Declared):
    """Motion whose speed changes linearly for a time and is constant afterwards.

    >>> Ramp(0.0, 10.0, duration=0.5).position(0.5)  # rad or m
    2.5
    """

    start: float = quantity("rad/s or m/s", doc="speed at t = 0")
    end: float = quantity("rad/s or m/s", doc="speed from the end of the change on")
    duration: float = quantity("s", above=0, doc="duration of the change")

    def speed(self, t: float) -> float:
        """Return the speed at a time t >= 0 [s]."""
        return self.start + (self.end - self.start) * min(t, self.duration) / self.duration

    def position(self, t: float) -> float:
        """Return the angle or displacement since t = 0: the exact integral of `speed`."""
        s = min(t, self.duration)
        return self.start * s + (self.end - self.start) * s * s / (2 * self.duration) + self.end * (t - s)

    def acceleration(self, t: float, last: float = inf) -> float:
        """Return the derivative of the speed after the instant t >= 0; `last` is not used."""
        return (self.end - self.start) / self.duration if t < self.duration else 0.0

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which the acceleration jumps [s]."""
        return (self.duration,) if self.duration < duration and self.start != self.end else ()


@declared
class Motion(Declared):
    """Any motion, given by position and speed; if only the speed is known, give it to the drive as a formula or table.

    >>> from math import cos, sin
    >>> Motion(position=sin, speed=cos).speed(0.0)
    1.0
    """

    position: Callable[[float], float] = field(Function("t", "rad or m"), "angle or travel since t = 0, as a function of t, s")
    speed: Callable[[float], float] = field(Function("t", "rad/s or m/s"), "derivative of the position by t")

    def agree(self) -> None:
        """Raise a ValueError if the motion does not start at 0."""
        number("position(0)", self.position(0.0), -1e-12, 1e-12, "rad or m")  # 0 to rounding

    def check_run(self, duration: float, where: str) -> None:
        """Raise a ValueError if, within a run, `speed` is not the derivative of `position`, jumps, or is not finite."""
        times = [fraction * duration for fraction in (0.05, 0.1, 0.23, 0.5, 0.77, 0.95)]  # irregular: no periods of the motion
        step, kinks = min(STEP, 0.01 * duration), self.kinks(duration)
        ends = (0.0, *kinks, duration)
        times += [(a + b) / 2 for a, b in pairwise(ends)]  # it may rest at the others
        next_end = [bisect(ends, t) for t in times]
        times = [
            t for t, k in zip(times, next_end, strict=True) if ends[k - 1] + step < t < ends[k] - step
        ]  # no slope over a kink
        speed_at = partial(_evaluate, f"{where}: speed", self.speed)
        speeds = [speed_at(t) for t in times]
        slopes = [self._slope(t, speed, step, where) for t, speed in zip(times, speeds, strict=True)]
        largest = max(map(abs, slopes + speeds), default=0.0)
        near_zero = SPEED_ERROR**2 * largest + 1e-12  # allowed where the speed is near zero, chosen; 1e-12 for a motion at rest
        for t, slope, speed in zip(times, slopes, speeds, strict=True):
            if abs(slope - speed) > SPEED_ERROR * (abs(slope) + abs(speed)) + near_zero:
                raise ValueError(f"{where}: speed({t:g}) = {speed:g} is not the derivative of position: {slope:g}")
        for t in kinks:
            before, after = speed_at(t), speed_at(float(np.nextafter(t, inf)))  # `kinks` returns the last time before a jump
            if abs(after - before) > SPEED_ERROR * max(largest, abs(before), abs(after)):
                why = "all that it moves would take an impulse at once; let it change over a short time, as by a Table"
                raise ValueError(f"{where}: speed jumps from {before:g} to {after:g} at t = {t:g} s: {why}")

    def _slope(self, t: float, speed: float, step: float, where: str) -> float:
        """Return that of three central differences of the position, with different steps, which is closest to the speed."""
        position_at = partial(_evaluate, f"{where}: position", self.position)
        quotients = [(position_at(t + h) - position_at(t - h)) / (2 * h) for h in (step, step / 10, step / 100)]
        return min(quotients, key=lambda slope: abs(slope - speed))

    def acceleration(self, t: float, last: float = inf) -> float:
        """Compute the derivative of the speed by Richardson extrapolation of differences between kinks and within [0, last]."""
        kinks = self.kinks(last)
        start, end = max((k for k in kinks if k <= t), default=0.0), min((k for k in kinks if k > t), default=last)
        h = min(STEP, (end - start) / 4) if end > start else STEP  # one-sided quotients reach 2 h from t
        return (4 * self._rate(t, h / 2, start, end) - self._rate(t, h, start, end)) / 3

    def _rate(self, t: float, h: float, start: float, end: float) -> float:
        """Compute a difference quotient of second order of the speed, central or one-sided so as to stay in [start, end]."""
        if t - h < start:
            return (4 * self.speed(t + h) - 3 * self.speed(t) - self.speed(t + 2 * h)) / (2 * h)
        if t + h > end:
            return (3 * self.speed(t) - 4 * self.speed(t - h) + self.speed(t - 2 * h)) / (2 * h)
        return (self.speed(t + h) - self.speed(t - h)) / (2 * h)

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which the motion jumps, has a kink or changes quickly [s]."""
        return tuple(sorted({t for f in (self.position, self.speed) for t in kinks(f, duration) if 0 < t < duration}))


def _evaluate(name: str, function: Callable[[float], float], t: float) -> float:
    """Evaluate a position or speed; ValueError if the function raises an error or does not return a finite number."""
    try:
        value = function(t)
    except Exception as error:
        raise ValueError(f"{name}({t:g}) raises {type(error).__name__}: {error}") from error
    return number(f"{name}({t:g})", value, -inf, inf, "")


@declared
class Drive(Element):
    """Prescribed rotation of a link, or prescribed travel of a guided point along its guide.

    >>> Drive("crank", speed=Ramp(0.0, 10.0, duration=0.5)).target
    'crank'
    """

    title: ClassVar[str] = "drive of '{target}'"
    label: ClassVar[str] = "drive"

    target: str = names(doc="a rigid link, which turns, or a guided point, which travels along its guide")
    speed: float | Ramp | Motion | Expression | Table = field(
        Either((Quantity("rad/s or m/s"), Part((Ramp, Motion)), Function("t", "rad/s or m/s"))),
        "a constant, a Ramp, a Motion, or a formula or table of the speed over time",
    )

    def agree(self) -> None:
        """Raise a ValueError for a function without an integral."""
        if callable(self.speed) and not isinstance(self.speed, Expression | Table):
            raise ValueError(f"{self.where}: speed = {short(self.speed)}: must be a Motion, a Ramp, a formula or a Table")

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError unless the target is a rigid link or a guided point."""
        rigid = {link.name for link in mechanism.links if not link.body.flexible}
        check_known("rigid link or guided point", self.target, rigid | {guide.point for guide in mechanism.guides}, "drive")
        if sum(isinstance(drive, Drive) and drive.target == self.target for drive in mechanism.drives) > 1:
            raise ValueError(f"{self.where}: it is driven twice")

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which the acceleration jumps [s]."""
        return self.motion.kinks(duration)

    def rows(self, mechanism: Parts) -> Iterator[Row]:
        """Yield the row of the prescribed angle of the link or travel of the point."""
        if self.target in mechanism.points:
            guide = mechanism.guide(self.target)
            moving, start = Place(guide.link, self.target), Place(GROUND, self.target)
            yield row(Along(moving, start, direction=guide.along), self.motion)
        else:
            yield row(Turn(Place(self.target, mechanism.link(self.target).start), Place(GROUND, "")), self.motion)

    def reactions(self, multipliers: Array) -> dict[str, Array]:
        """Return the torque [N m] or force [N] of the drive."""
        return {"effort": multipliers}

    @cached_property
    def motion(self) -> Motion | Ramp:
        """Motion of the driven coordinate: angle [rad] or travel [m]."""
        if isinstance(self.speed, Ramp | Motion):
            return self.speed
        if isinstance(self.speed, Expression | Table):
            return Motion(self.speed.integral(), self.speed)
        return Ramp(start=self.speed, end=self.speed, duration=1.0)  # constant: any duration will do

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield torque [N m] or force [N] of the drive, and the angle [rad] or travel [m] since t = 0."""
        turns = self.target not in record.mechanism.points
        effort = record.channel(name, "effort")[:, 0]
        yield Signal(f"{name}.torque" if turns else f"{name}.force", effort, "N m" if turns else "N", Kind.REACTION)
        yield Signal(f"{name}.position", self._coordinate(record)[0], "rad" if turns else "m", Kind.PLACE)

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the work of the drive."""
        power = record.channel(name, "effort")[:, 0] * self._coordinate(record)[1]
        yield Energy("supplied", "drive", record.work(power))

    def _coordinate(self, record: Recorded) -> tuple[Array, Array]:
        """Return the driven coordinate [rad or m] since t = 0 and its rate, each (times,)."""
        if self.target in record.mechanism.points:
            block = record.blocks[self.target]
            return block.travel, block.speed
        return record.turn(f"{self.target}:{record.mechanism.link(self.target).start}")
