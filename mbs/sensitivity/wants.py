"""What a design is asked for: readings over the unit cube of its numbers, and how far they are from what is wanted."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite, nan
from typing import NamedTuple, cast

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..solvers import Controlled, Spectral
from ..units import Measured, measured
from .derivatives import Reading, read
from .numbers import Family
from .reading import WrongReadingError, statical
from .runs import RunFailedError, finer

STEADY = Spectral(steps=Controlled(tolerance=1e-8), degree=8, contact_tolerance=1e-4)
"""Solver by default: its error over `WIDTH` is that of a derivative."""
WIDTH = 1e-4
"""Width of the differences that make derivatives, over a number's range."""
FINER, DEGREES = 32.0, 4
"""Factor by which the finer run's tolerance is smaller, and the degree by which its strips' is higher."""
EXACT = 1e-3
"""Share by which a value that is asked for without a tolerance may be missed."""
FAR = 1e3
"""What a design is off whose run fails, relative."""
SAME = 1e-7
"""Of a range: points that are nearer are the same one, as between them there is the noise of runs."""
INSET, HALF = 0.05, 0.5
"""Share of its width by which a search keeps off the ends of what is wanted, as a finer run differs; share of half the width
within which nothing more is sought."""
WANTED = re.compile(r"\s*(?P<reading>.+?)\s*(?P<sign><=|>=|=)\s*(?P<value>[^=±]+?)\s*(?:(?:±|\+-|\+/-)\s*(?P<off>.+?))?\s*")


class Want(NamedTuple):
    """A reading between two values.

    Attributes
    ----------
    text : str
    name : str
        Of the reading.
    low, high : float
    given : str
        A value with its unit, as it was given; '' where it had none.
    """

    text: str
    name: str
    low: float
    high: float
    given: str = ""

    @property
    def scale(self) -> float:
        """What a large miss is."""
        ends = [abs(each) for each in (self.low, self.high) if isfinite(each)]
        return max(ends) or 1.0

    @property
    def band(self) -> bool:
        """Whether it has two ends."""
        return isfinite(self.high - self.low)

    def misses(self, value: float) -> float:
        """How far a value is outside, relative; 0 within."""
        return max(self.low - value, value - self.high, 0.0) / self.scale if isfinite(value) else FAR

    def told(self, value: float, unit: str) -> str:
        """A value that is outside, in words."""
        return f"{value:.6g}{unit}, {100 * self.misses(value):.2g} % off" if isfinite(value) else "it has no value there"

    def held_against(self, unit: str) -> None:
        """Raise a WrongReadingError if it asks for another kind of unit than its reading has."""
        if unit and self.given and not cast(Measured, measured(self.given)).fits(unit):
            raise WrongReadingError(f"subject_to '{self.text}': {self.name} is in {unit}")

    def residual(self, value: float) -> tuple[float, float]:
        """How far it is from the middle, of half the width, or from inside its end, and the derivative by the value."""
        if not isfinite(value):
            return FAR / EXACT, 0.0
        if self.band:
            slope = 2.0 / max(self.high - self.low, SAME * self.scale)
            return (value - 0.5 * (self.low + self.high)) * slope, slope
        side, end = (1.0, self.high) if isfinite(self.high) else (-1.0, self.low)
        slope = side / (EXACT * self.scale)
        far = (value - end) * slope + INSET
        return (far, slope) if far > 0.0 else (0.0, 0.0)


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
            raise ValueError("has none of =, <=, >= with a value behind it")
        value, off = measured(found["value"]), found["off"]
        width = EXACT * abs(value) if off is None else _width(off, value)
        if width < 0:
            raise ValueError("a tolerance is positive")
    except ValueError as error:
        raise ValueError(f"subject_to '{given}': {error}; write for instance 'max(B.contact_force) = 1.5 N ± 1 %'") from None
    sign = found["sign"]
    low, high = (value - width if sign != "<=" else -inf), (value + width if sign != ">=" else inf)
    if sign != "=":
        low, high = (value, inf) if sign == ">=" else (-inf, value)
    return Want(given.strip(), found["reading"], float(low), float(high), getattr(value, "given", ""))


def _width(text: str, value: float) -> float:
    """A tolerance, absolute or in per cent of the value."""
    number, percent, _ = text.partition("%")
    return float(number) / 100 * abs(value) if percent else float(measured(text))


class EnoughError(Exception):
    """A search is over: it has what is asked for, or no more runs."""


@dataclass
class Task:
    """What is asked for, with the values that lists have.

    Points of the unit cube that were run are in `cache`, with their readings. `offset` is by how much those of a finer run
    differ.
    `failed` is why the first run did that did; `units` are those of numbers and readings.
    """

    family: Family
    readings: Mapping[str, Reading]
    aims: list[str]
    wants: list[Want]
    ranges: dict[str, tuple[float, float]]
    held: dict[str, float]
    duration: float | Callable[[Mechanism], float] | None
    solver: Spectral | None
    first: Array
    starts: int
    seed: int
    budget: int
    runs: int = 0
    failed: str = "readings have no value there"
    units: dict[str, str] = field(default_factory=dict)
    offset: float | Array = 0.0
    cache: dict[tuple[float, ...], Array] = field(default_factory=dict)
    known: dict[tuple[float, ...], Array] = field(default_factory=dict)

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

    def read(self, x: Array, *, fine: bool = False) -> Array:
        """Readings at a point, of a finer run where wanted; nan where the run fails."""
        self.runs += 1
        try:
            made = self.family.make(self.values(x))
            span, solver = self.span(made), finer(self.solver or STEADY, FINER, DEGREES) if fine else self.solver or STEADY
            found = read(self.readings, made, span, solver)
            self._told(found.units)
            return found.values
        except WrongReadingError:
            raise
        except (RunFailedError, ArithmeticError, ValueError) as error:
            self.failed = str(error) if self.runs == 1 else self.failed
            return np.full(len(self.readings), np.nan)

    def _told(self, units: Sequence[str]) -> None:
        """Take note of the readings' units, and hold what is wanted against them."""
        if self.units.keys() >= self.readings.keys():
            return
        self.units = self.family.units | dict(zip(self.readings, units, strict=True))
        for want in self.wants:
            want.held_against(self.units[want.name])

    def evaluate(self, x: Array) -> Array:
        """Readings at a point, as a finer run would have them.

        Raises
        ------
        EnoughError
            If the runs are used up, or nothing is minimised and all is as it is wanted.
        """
        key = rounded(x)
        if key not in self.cache:
            self.spend()
            self.cache[key] = self.read(np.array(key))
            if not self.aims and self.settled(self.cache[key] + self.offset):
                raise EnoughError
        return self.cache[key] + self.offset

    def spend(self) -> None:
        """Stop a search that has no more runs."""
        if self.runs >= self.budget:
            raise EnoughError

    def slopes(self, x: Array) -> Array:
        """Derivatives of the readings over the cube, shape (readings, numbers)."""
        key = rounded(x)
        if key not in self.known:
            start = self.evaluate(x)
            self.known[key] = np.zeros((len(start), len(x)))
            for i, d in enumerate(np.where(np.array(key) < 0.5, WIDTH, -WIDTH)):
                self.spend()
                moved = self.read(np.array(key) + d * (np.arange(len(x)) == i)) + self.offset
                self.known[key][:, i] = np.nan_to_num((moved - start) / d)
        return self.known[key]

    def residuals(self, x: Array) -> Array:
        """How far all wants are from the middle of what is allowed, by half of that."""
        return np.array([want.residual(value)[0] for want, value in self.of(self.evaluate(x))])

    def missing(self, x: Array) -> Array:
        """The same, nan where a reading has no value."""
        return np.array([want.residual(value)[0] if isfinite(value) else nan for want, value in self.of(self.evaluate(x))])

    def steepness(self, x: Array) -> Array:
        """Their derivatives over the cube."""
        found, slopes = self.evaluate(x), self.slopes(x)
        return np.array([want.residual(value)[1] * slopes[self.row(want.name)] for want, value in self.of(found)])

    def valued(self, found: Array) -> bool:
        """Whether readings have values from which a search can go on: some of what is wanted, all with what is minimised."""
        return bool((np.all if self.aims else np.any)(np.isfinite(found)))

    def best(self, other: Array | None = None) -> Array | None:
        """The best point that was run; another one if no run ended."""
        ended = [np.array(key) for key, found in self.cache.items() if self.valued(found)]
        return min(ended, key=self.better) if ended else other

    def row(self, name: str) -> int:
        """Place of a reading."""
        return list(self.readings).index(name)

    def of(self, found: Array) -> list[tuple[Want, float]]:
        """Each want and its reading."""
        return [(want, float(found[self.row(want.name)])) for want in self.wants]

    def settled(self, found: Array) -> bool:
        """Whether all wants are kept, by half of what is allowed."""
        return all(abs(want.residual(value)[0]) <= (HALF if want.band else 0.0) for want, value in self.of(found))

    def broken(self, found: Array) -> list[Want]:
        """Wants that are not kept."""
        return [want for want, value in self.of(found) if want.misses(value) > 0.01 * EXACT]

    def missed(self, found: Array) -> float:
        """How far the constraints are missed, together."""
        return float(sum(want.misses(value) for want, value in self.of(found)))

    def aim(self, found: Array) -> float:
        """What is minimised."""
        if not self.aims:
            return float(sum(want.residual(value)[0] ** 2 for want, value in self.of(found)))
        value = float(found[self.row(self.aims[0])])
        return value if isfinite(value) else inf

    def rank(self, found: Array) -> tuple[float, float]:
        """By which readings are compared: constraints first, up to a hundredth of what a value may be missed by."""
        return (self.missed(found) if self.broken(found) else 0.0), self.aim(found)

    def better(self, x: Array) -> tuple[float, float]:
        """By which points that were run are."""
        return self.rank(self.cache[rounded(x)] + self.offset)


def rounded(x: Array) -> tuple[float, ...]:
    """The point that stands for those near one."""
    return tuple((np.round(x / SAME) * SAME).tolist())
