"""Search for a design: minimise a reading by SLSQP (Kraft 1988), or meet constraints alone by least squares.

The free numbers are scaled to the unit cube: a point x of it has one coordinate, 0 to 1, for each number. A constraint says that
a reading lies in an interval; the interval is narrow if it stands for a value with a tolerance.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, isfinite
from typing import NamedTuple, cast

import numpy as np
from scipy.optimize import least_squares, minimize

from ..geometry import Array
from ..solvers import Spectral
from ..statics.answer import DEGREE_STEP
from ..units import Measured, measured
from .numbers import Family
from .reading import FAILURES, WrongReadingError
from .residuals import DIFFERENCE_WIDTH, FAILURE_RESIDUAL
from .runs import Reading, needs_run, scale_tolerances
from .runs import read as read_run

EXACT = 1e-3
"""Default tolerance of a constraint `reading = value`, relative to the value. A convention. It is also the distance
from an end of a wide interval, relative to the end, in which the residual of a constraint falls from 1 to 0: chosen."""
MET = 1e-6
"""Largest relative violation with which a constraint counts as met: the accuracy of a search."""
BINDS = 1e-3
"""Relative distance from an end of its interval up to which a constraint is binding. A convention."""
BEST_STARTS = 3
"""Number of the best starts from which a minimum is sought; chosen."""
SAME_POINT = 1e-7
"""Spacing of the grid in the cube to which points are rounded: readings of closer points differ by noise only."""
CONSTRAINT = re.compile(
    r"\s*(?P<reading>.+?)\s*(?P<sign><=|>=|=)\s*(?P<value>[^=±]+?)\s*(?:(?:±|\+-|\+/-)\s*(?P<tolerance>.+?))?\s*"
)
"""Pattern of a constraint: a reading with a bound, or with a value and perhaps a tolerance."""
Point = tuple[float, ...]
"""Rounded point of the unit cube."""


class EnoughError(Exception):
    """Exception that ends a search: the budget of runs is used up or, with nothing to minimise, constraints are met."""


class IntervalEnd(NamedTuple):
    """Finite end of the interval of a constraint: `side` is 1 for the low end, -1 for the high one, `scale` its magnitude."""

    side: float
    value: float
    scale: float

    def excess(self, reading: float) -> float:
        """Return the distance by which a reading lies outside, relative to the scale; negative inside."""
        return self.side * (self.value - reading) / self.scale


class Constraint(NamedTuple):
    """Constraint: a `reading` lies in an interval; `written` is the user's value as text if it has a unit, else ''."""

    text: str
    reading: str
    low: float
    high: float
    written: str = ""

    @property
    def ends(self) -> list[IntervalEnd]:
        """Finite ends of the interval. An end of zero has the scale of the other end, or 1."""
        sizes = [abs(end) for end in (self.low, self.high) if isfinite(end) and end]
        pairs = [(1.0, self.low), (-1.0, self.high)]
        return [IntervalEnd(side, end, abs(end) or min(sizes, default=1.0)) for side, end in pairs if isfinite(end)]

    @property
    def is_narrow(self) -> bool:
        """True if the width of the interval is at most a tenth of its larger end, as for a value ± 5 %; chosen."""
        width = self.high - self.low
        return isfinite(width) and width <= 0.1 * max(abs(self.low), abs(self.high))

    def violation(self, value: float) -> float:
        """Compute the relative violation by a value; 0 inside the interval."""
        return max(0.0, *(end.excess(value) for end in self.ends)) if isfinite(value) else FAILURE_RESIDUAL

    def residual(self, value: float) -> tuple[float, float]:
        """Compute the residual of a value for least squares, and its derivative.

        In a narrow interval the residual is the distance from the middle over half the width: 1 at an end. In a wide one it is
        1 + e/`EXACT`, where e is the larger excess over the two ends. This is 1 at an end, and 0 farther than `EXACT` inside.
        """
        if not isfinite(value):
            return FAILURE_RESIDUAL, 0.0
        if self.is_narrow:
            slope = 2.0 / max(self.high - self.low, MET * self.ends[0].scale)  # the second prevents a division by 0
            return (value - 0.5 * (self.low + self.high)) * slope, slope
        end = max(self.ends, key=lambda end: end.excess(value))
        excess = end.excess(value) / EXACT
        return (1.0 + excess, -end.side / (end.scale * EXACT)) if excess > -1.0 else (0.0, 0.0)

    def is_binding(self, value: float) -> bool:
        """Return True if a value lies at an end of the interval, or the interval is narrow."""
        return self.is_narrow or any(abs(end.excess(value)) <= BINDS for end in self.ends)


def parse_constraint(given: str | tuple[str, float, float]) -> Constraint:
    """Parse a constraint, such as 'max(B.contact_force) = 1.5 N ± 1 %', or raise a ValueError."""
    if not isinstance(given, str):
        name, low, high = given
        return Constraint(f"{low:g} <= {name} <= {high:g}", name, float(low), float(high))
    match = CONSTRAINT.fullmatch(given)
    try:
        if match is None:
            raise ValueError("has none of =, <=, >= with a value behind it")
        value = measured(match["value"])
        tolerance, percent, _ = (match["tolerance"] or f"{100 * EXACT} %").partition("%")
        if match["tolerance"] and match["sign"] != "=":
            raise ValueError(f"a tolerance is that of a value, not of {match['sign']}")
        width = float(tolerance) / 100 * abs(value) if percent else float(measured(tolerance))
        if width < 0:
            raise ValueError("a tolerance is positive")
    except ValueError as error:
        raise ValueError(f"subject_to '{given}': {error}; write for instance 'max(B.contact_force) = 1.5 N ± 1 %'") from None
    low, high = {"=": (value - width, value + width), ">=": (value, inf), "<=": (-inf, value)}[match["sign"]]
    return Constraint(given.strip(), match["reading"], float(low), float(high), getattr(value, "given", ""))


@dataclass
class Search:
    """Readings as functions of a point x of the unit cube.

    `objective` names the reading to minimise, '' if there is none. `failed` is the message of the first run, if it failed, and
    `stopped` the reason why the search ended early. `units` are those of numbers and readings, empty before a run has ended.
    `offset` corrects all readings: those of a finer run less those of the search, at the best point so far. `cache` maps rounded
    points to readings without the offset.
    """

    family: Family
    readings: Mapping[str, Reading]
    objective: str
    constraints: list[Constraint]
    ranges: dict[str, tuple[float, float]]
    duration: float | None  # [s]; None for readings that need no run
    solver: Spectral
    budget: int  # largest number of runs
    runs: int = 0
    stopped: str = ""
    failed: str = "readings have no value there"  # message if the first run ends, but all its readings are nan
    units: dict[str, str] = field(default_factory=dict)
    offset: float | Array = 0.0
    cache: dict[Point, Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.row = {name: k for k, name in enumerate(self.readings)}

    def values(self, x: Array | Point) -> dict[str, float]:
        """Compute the numbers at a point of the cube."""
        return {name: low + float(u) * (high - low) for u, (name, (low, high)) in zip(x, self.ranges.items(), strict=True)}

    def read(self, x: Array, solver: Spectral) -> Array:
        """Compute the readings at a point, nan where the run fails; set the units, and compare them with those of constraints."""
        self.runs += 1
        try:
            found = read_run(self.readings, self.family.make(self.values(x)), self.duration, solver)
        except WrongReadingError:  # wrong for every run
            raise
        except FAILURES as error:
            self.failed = str(error) if self.runs == 1 else self.failed
            return np.full(len(self.readings), np.nan)
        self.units = self.family.units | dict(zip(self.readings, found.units, strict=True))
        for each in self.constraints:
            unit = self.units[each.reading]
            if unit and each.written and not cast(Measured, measured(each.written)).fits(unit):
                raise WrongReadingError(f"subject_to '{each.text}': {each.reading} is in {unit}")
        return found.values

    def evaluate(self, x: Array) -> Array:
        """Compute the readings at a point, or look them up, and add the offset; an EnoughError ends the search."""
        key = tuple((np.round(x / SAME_POINT) * SAME_POINT).tolist())
        if key not in self.cache:
            if self.runs >= self.budget:
                raise EnoughError
            self.cache[key] = self.read(np.array(key), self.solver)
            # a residual is 1 at the end of an interval. 0.5 is chosen: with 0.05 and with 1 the tests meet their constraints, too
            if not self.objective and np.all(np.abs(self.residuals(self.cache[key] + self.offset)) <= 0.5):
                raise EnoughError
        return self.cache[key] + self.offset

    def slopes(self, x: Array, width: float = DIFFERENCE_WIDTH) -> Array:
        """Compute derivatives of the readings by central differences over the cube, shape (readings, numbers).

        At a face of the cube, and where a run fails on one side, differences are one-sided; 0 where a reading has no value.
        """
        readings, columns = self.evaluate(x), []
        for axis in np.eye(len(x)):
            sides = [x + width * side * axis for side in (-1.0, 1.0)]
            pairs = [(point, self.evaluate(point)) for point in sides if 0.0 <= point @ axis <= 1.0]
            pairs = [(point, found) for point, found in pairs if np.isfinite(found).any()]
            pairs = pairs if len(pairs) == 2 else [*pairs, (x, readings)]
            (first, before), (last, after) = pairs[0], pairs[-1]
            columns.append((after - before) / ((last - first) @ axis or 1.0))  # 1: both sides failed, all are the point itself
        return np.nan_to_num(np.array(columns).T, posinf=0.0, neginf=0.0)

    def pair_constraints(self, readings: Array) -> list[tuple[Constraint, float]]:
        """Pair each constraint with the value of its reading."""
        return [(constraint, float(readings[self.row[constraint.reading]])) for constraint in self.constraints]

    def residuals(self, readings: Array) -> Array:
        """Compute the residuals of the constraints."""
        return np.array([constraint.residual(value)[0] for constraint, value in self.pair_constraints(readings)])

    def jacobian(self, x: Array, width: float) -> Array:
        """Compute derivatives of the residuals over the cube, shape (constraints, numbers)."""
        pairs, slopes = self.pair_constraints(self.evaluate(x)), self.slopes(x, width)
        return np.array([constraint.residual(value)[1] * slopes[self.row[constraint.reading]] for constraint, value in pairs])

    def list_violated(self, readings: Array) -> list[Constraint]:
        """List the constraints that readings violate."""
        return [constraint for constraint, value in self.pair_constraints(readings) if constraint.violation(value) > MET]

    def merit(self, readings: Array) -> tuple[float, float]:
        """Return the sum of violations and the reading to minimise; the better of two designs has the smaller pair."""
        violations = [each.violation(value) for each, value in self.pair_constraints(readings)]
        violation = sum(violations) if max(violations, default=0.0) > MET else 0.0
        objective = float(readings[self.row[self.objective]]) if self.objective else 0.0
        return violation, objective if isfinite(objective) else inf

    def find_best(self) -> Point | None:
        """Find the best point that was run; None if no run has a value."""
        has_value = np.all if self.objective else np.any  # without an objective, a missing reading is a violation
        points = [point for point, readings in self.cache.items() if has_value(np.isfinite(readings))]
        return min(points, key=lambda point: self.merit(self.cache[point] + self.offset), default=None)

    def descend_from_starts(self, starts: Sequence[Array]) -> None:
        """Minimise from the first start, the user's or the middle, then from the `BEST_STARTS` best of the others."""
        for group in (starts[:1], starts[1:]):
            ranked = sorted((self.merit(self.evaluate(x)), k) for k, x in enumerate(group))
            for (_, objective), k in ranked[:BEST_STARTS]:
                if isfinite(objective):
                    self.descend(group[k])

    def descend(self, x: Array) -> None:
        """Minimise from a point or, with nothing to minimise, meet the constraints by least squares, wide differences first."""
        if self.objective:
            self.minimise(x)
            return
        for width in (0.02, DIFFERENCE_WIDTH):  # 0.02: over it, ripples of a reading, as of an impact force, are averaged
            # ftol and max_nfev are chosen: an EnoughError ends most searches before
            x = least_squares(lambda x: self.residuals(self.evaluate(x)), x, lambda x, width=width: self.jacobian(x, width),
                              bounds=(0.0, 1.0), method="dogbox", xtol=SAME_POINT, ftol=1e-2, max_nfev=15).x  # fmt: skip

    def minimise(self, x: Array) -> None:
        """Minimise the objective subject to the constraints by SLSQP."""
        _, objective = self.merit(self.evaluate(x))
        row, scale = self.row[self.objective], abs(objective) or 1.0  # the minimised reading is scaled by its first value
        ends = [(self.row[constraint.reading], end) for constraint in self.constraints for end in constraint.ends]
        margins = {
            "type": "ineq",
            "fun": lambda x: np.nan_to_num([-end.excess(self.evaluate(x)[k]) for k, end in ends], nan=-FAILURE_RESIDUAL),
            "jac": lambda x: np.array([end.side * self.slopes(x)[k] / end.scale for k, end in ends]),
        }
        minimize(  # `ftol`, of the scaled reading, is a tenth of the runs' default tolerance; `maxiter` is chosen
            lambda x: float(np.nan_to_num(self.evaluate(x)[row] / scale, nan=FAILURE_RESIDUAL)), x,
            jac=lambda x: self.slopes(x)[row] / scale, method="SLSQP", bounds=[(0.0, 1.0)] * len(x),
            options={"maxiter": 60, "ftol": 1e-9}, constraints=[margins] if ends else (),
        )  # fmt: skip

    def read_finer(self, point: Point) -> Array:
        """Compute the readings at a point by a finer run; equilibria and functions have no run, and keep their values."""
        if not any(map(needs_run, self.readings.values())):
            return self.cache[point]
        finer = scale_tolerances(self.solver, 1 / 32, DEGREE_STEP)  # chosen: with ten times as much a test misses its constraint
        return self.read(np.array(point), finer)
