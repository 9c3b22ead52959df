"""What a design is asked for: readings over the unit cube of its numbers, and how far they are from what is wanted."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import NamedTuple

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.sensitivity.derivatives import Level, Reading
from buckler.mbs.sensitivity.frozen import RunFailedError, Steps
from buckler.mbs.sensitivity.numbers import Family
from buckler.mbs.sensitivity.reading import statical
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.units import measured

WIDTH, COARSE = 1e-6, 1e-4
"""Of the differences that make derivatives, relative to a number's range: of runs that share their steps, and of others."""
EXACT = 1e-3
"""Share by which a value that is asked for without a tolerance may be missed."""
FAR = 1e3
"""What a design is off whose run fails, relative."""
WANTED = re.compile(r"\s*(?P<reading>.+?)\s*(?P<sign><=|>=|=)\s*(?P<value>[^=±]+?)\s*(?:(?:±|\+-|\+/-)\s*(?P<off>.+?))?\s*")


class Want(NamedTuple):
    """A reading between two values.

    Attributes
    ----------
    text : str
    name : str
        Of the reading.
    low, high : float
    """

    text: str
    name: str
    low: float
    high: float

    @property
    def scale(self) -> float:
        """What a large miss is."""
        ends = [abs(each) for each in (self.low, self.high) if isfinite(each)]
        return max(ends) or 1.0

    def misses(self, value: float) -> float:
        """How far a value is outside, relative; 0 within."""
        return max(self.low - value, value - self.high, 0.0) / self.scale if isfinite(value) else FAR


def wanted(given: str | tuple[str, float, float]) -> Want:
    """Read one constraint.

    Raises
    ------
    ValueError
        If it is none.
    """
    if not isinstance(given, str):
        name, low, high = given
        return Want(f"{low:g} <= {name} <= {high:g}", name, float(low), float(high))
    found = WANTED.fullmatch(given)
    try:
        if found is None:
            raise ValueError("it is none")
        value, off = measured(found["value"]), found["off"]
        width = EXACT * abs(value) if off is None else _width(off, value)
    except ValueError as error:
        raise ValueError(f"subject_to '{given}': {error}; write for instance 'max(B.contact_force) = 1.5 N ± 1 %'") from None
    sign = found["sign"]
    low, high = (value - width if sign != "<=" else -inf), (value + width if sign != ">=" else inf)
    if sign != "=":
        low, high = (value, inf) if sign == ">=" else (-inf, value)
    return Want(given.strip(), found["reading"], float(low), float(high))


def _width(text: str, value: float) -> float:
    """A tolerance, absolute or in per cent of the value."""
    number, percent, _ = text.partition("%")
    return float(number) / 100 * abs(value) if percent else abs(float(measured(text)))


@dataclass
class Task:
    """What is asked for, with the values that lists have."""

    family: Family
    readings: Mapping[str, Reading]
    aims: list[str]
    wants: list[Want]
    ranges: dict[str, tuple[float, float]]
    held: dict[str, float]
    duration: float | Callable[[Mechanism], float] | None
    solver: Spectral | None
    starts: int
    seed: int
    runs: int = 0
    cache: dict[bytes, tuple[Array, Steps | None]] = field(default_factory=dict)

    @property
    def moving(self) -> bool:
        """Whether a reading needs a run."""
        return any(isinstance(each, str) and not statical(each) for each in self.readings.values())

    def span(self, made: Mechanism) -> float | None:
        """Length of the run of a mechanism, s."""
        return self.duration(made) if callable(self.duration) else self.duration

    def values(self, x: Array) -> dict[str, float]:
        """Numbers at a point of the unit cube."""
        found = {name: low + float(u) * (high - low) for u, (name, (low, high)) in zip(x, self.ranges.items(), strict=True)}
        return self.held | found

    def evaluate(self, x: Array) -> tuple[Array, Steps | None]:
        """Readings at a point, nan where the run fails, and the steps of its run."""
        key = x.tobytes()
        if key not in self.cache:
            self.runs += 1
            steps = None
            try:
                made = self.family.make(self.values(x))
                span = self.span(made)
                if self.moving and span is not None:
                    steps = Steps.of(made, span, self.solver or Spectral())
                found = Level(self.readings, steps)(made, span)[0]
            except (RunFailedError, ArithmeticError, ValueError):
                found = np.full(len(self.readings), np.nan)
            self.cache[key] = found, steps
        return self.cache[key]

    def slopes(self, x: Array) -> Array:
        """Derivatives of the readings over the cube, shape (readings, numbers)."""
        start, steps = self.evaluate(x)
        out = np.zeros((len(start), len(x)))
        width = WIDTH if steps is not None and all(isinstance(each, str) for each in self.readings.values()) else COARSE
        for i in range(len(x)):
            d = width if x[i] < 0.5 else -width
            self.runs += 1
            try:
                made = self.family.make(self.values(x + d * (np.arange(len(x)) == i)))
                out[:, i] = (Level(self.readings, steps)(made, self.span(made))[0] - start) / d
            except (RunFailedError, ArithmeticError, ValueError):
                pass
        return np.nan_to_num(out)

    def row(self, name: str) -> int:
        """Place of a reading."""
        return list(self.readings).index(name)

    def missed(self, found: Array) -> float:
        """How far the constraints are missed, together."""
        return float(sum(want.misses(float(found[self.row(want.name)])) for want in self.wants))

    def aim(self, found: Array) -> float:
        """What is minimised."""
        if not self.aims:
            return 0.0
        value = float(found[self.row(self.aims[0])])
        return value if isfinite(value) else inf

    def better(self, x: Array) -> tuple[float, float]:
        """By which points are compared: constraints first, up to a hundredth of what a value may be missed by."""
        found, _ = self.evaluate(x)
        missed = self.missed(found)
        return (missed if missed > 0.01 * EXACT else 0.0), self.aim(found)
