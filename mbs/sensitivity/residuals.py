"""Residuals of experiments and their derivatives as functions of the free numbers, scaled to the unit cube."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..record.lookup import between, unknown
from ..record.run import Run
from ..solvers import Controlled, Spectral
from ..units import parse_unit
from .curve import Smooth
from .data import Experiment
from .numbers import Family, Source
from .reading import FAILURES, WrongReadingError, measure
from .runs import run

Bounds = tuple[float, float]
STEADY = Spectral(steps=Controlled(tolerance=1e-8), contact_tolerance=1e-4)
"""Default solver; errors of derivatives are its error over `WIDTH`."""
WIDTH = 1e-4
"""Width of the differences for derivatives, over the range of a number."""
FAR = 1e3
"""Residual of a run that fails, in standard deviations; violation by a reading without a value."""
DEPENDENT = 1e-9
"""Singular value, over the largest, below which the data do not depend on its combination of numbers."""
CLOSE = 1e-7
"""Tolerance `ftol` of least squares: below a thousandth of a standard deviation."""
TIME_ZERO = "time_zero"
"""Name of the number that is the time of the data at which the run begins [s]; it is no number of the mechanism."""


@dataclass
class FitProblem:
    """Residuals as functions of the free numbers, scaled to the unit cube.

    `errors` are standard deviations of signals; `units` those of numbers, and of signals after a run. `failed` is why the first
    failed run did, `stopped` why the search ended early, `blocked` why numbers have no derivative: runs on both sides fail.
    """

    make: Callable[[Mapping[str, float]], Mechanism]
    experiments: list[Experiment]
    names: list[str]
    low: Array
    high: Array
    errors: dict[str, float]
    units: dict[str, str]
    solver: Spectral
    failed: str = ""
    stopped: str = ""
    blocked: dict[str, str] = field(default_factory=dict)
    cached: tuple[Array, list[dict[str, Any]]] | None = None

    @classmethod
    def of(
        cls, mechanism: Source, experiments: list[Experiment], free: Mapping[str, Bounds], solver: Spectral | None
    ) -> FitProblem:
        """Check the input and scale the free numbers to the cube."""
        if not free:
            raise ValueError("free: no number; give {path: (low, high)}")
        check_ranges(free)
        settings = {name for each in experiments for name in each.settings}
        if both := sorted(settings & set(free)):
            raise ValueError(f"free['{both[0]}']: the experiments set it")
        varied = [name for name in (*free, *settings) if name != TIME_ZERO]
        family = Family.of(mechanism, varied, dict.fromkeys(varied, 0.0))
        measured = {name: gather(experiments, name) for name in signals_of(experiments)}
        if missing := [name for name, values in measured.items() if not values.size]:
            raise ValueError(f"data: {missing[0]} has no value at any time")
        guess = {name: float(np.std(x)) or float(np.max(np.abs(x))) or 1.0 for name, x in measured.items()}
        given = {name: each.errors[name] for each in experiments for name in each.errors}
        units = {name: (family.units | {TIME_ZERO: "s"})[name] for name in free}
        low, high = np.array(list(free.values()), dtype=float).T
        return cls(family.make, experiments, list(free), low, high, guess | given, units, solver or STEADY)

    @property
    def has_errors(self) -> bool:
        """True if all standard deviations were given."""
        return set(signals_of(self.experiments)) <= {name for each in self.experiments for name in each.errors}

    @property
    def count(self) -> int:
        """Number of residuals."""
        return sum(sum(map(np.count_nonzero, map(np.isfinite, x.signals.values()))) + len(x.readings) for x in self.experiments)

    def values(self, x: Array) -> Array:
        """Compute the numbers at a point of the cube."""
        return np.asarray(self.low + x * (self.high - self.low))

    def predict(self, x: Array) -> list[dict[str, Any]]:
        """Run all experiments at a point of the cube, and read what they measured."""
        if self.cached is not None and np.array_equal(self.cached[0], x):
            return self.cached[1]
        numbers, found = dict(zip(self.names, self.values(x).tolist(), strict=True)), []
        zero = numbers.pop(TIME_ZERO, 0.0)
        for each in self.experiments:
            ended = run(self.make(numbers | dict(each.settings)), each.span - zero, self.solver)
            self.units |= {name: ended.units[name] for name in each.signals if name in ended.units}
            found.append(read_run(ended, each, zero))
        return found

    def compare(self, predicted: Sequence[Mapping[str, Any]]) -> Array:
        """Compute the residuals of predictions in standard deviations."""
        parts = []
        for each, own in zip(self.experiments, predicted, strict=True):
            parts += [((own[name] - x) / self.errors[name])[np.isfinite(x)] for name, x in each.signals.items()]
            parts.append(np.array([read.residual(own[text]) for text, read in each.readings.items()]))
        found = np.concatenate(parts)
        return np.where(np.isfinite(found), found, FAR)

    def residuals(self, x: Array) -> Array:
        """Compute the residuals at a point, `FAR` of a run that fails."""
        try:
            self.cached = x.copy(), self.predict(x)
        except WrongReadingError:
            raise
        except FAILURES as error:
            self.failed = self.failed or str(error)
            return np.full(self.count, FAR)
        return self.compare(self.cached[1])

    def jacobian(self, x: Array) -> Array:
        """Compute derivatives of the residuals by the numbers over the cube, shape (residuals, numbers)."""
        start = self.compare(self.predict(x))
        return np.column_stack([self._slope(x, i, start) for i in range(len(x))])

    def _slope(self, x: Array, i: int, start: Array) -> Array:
        """Compute the difference quotient by one number, towards the middle of its range or, if a run fails, away; else zero."""
        axis, width = np.arange(len(x)) == i, WIDTH if x[i] < 0.5 else -WIDTH
        for change in (width, -width):
            try:
                return (self.compare(self.predict(x + change * axis)) - start) / change
            except FAILURES as error:
                why = str(error)
        self.blocked[self.names[i]] = why
        return np.zeros(len(start))

    def residual_sizes(self, x: Array) -> dict[str, float]:
        """Compute the root mean square of each signal's residuals."""
        found: dict[str, list[Array]] = {}
        for each, predicted in zip(self.experiments, self.predict(x), strict=True):
            for name, values in each.signals.items():
                found.setdefault(name, []).append((predicted[name] - values)[np.isfinite(values)])
        return {name: float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) for name, parts in found.items()}

    def weigh(self, x: Array) -> None:
        """Estimate missing standard deviations of signals by the residuals of a fit."""
        given = {name for each in self.experiments for name in each.errors}
        for name, value in self.residual_sizes(x).items():
            if name not in given:
                self.errors[name] = max(value, 1e-12 * self.errors[name])

    def covariance(self, x: Array) -> Array:
        """Compute the covariance of the scaled numbers, s^2 (J^T J)^-1; very large in directions without influence."""
        j, r = self.jacobian(x), self.residuals(x)
        _, s, vh = np.linalg.svd(j, full_matrices=False)
        scale = 1.0 if self.has_errors else float(r @ r) / max(1, len(r) - len(x))
        spread = np.where(s > DEPENDENT * max(s[0], 1e-300), 1 / np.maximum(s, 1e-300), 1e12)
        return np.asarray(scale * (vh.T * spread**2) @ vh)


def check_ranges(free: Mapping[str, Bounds]) -> None:
    """Raise a ValueError unless each range has a low end below its high one."""
    for name, (low, high) in free.items():
        if not low < high:
            raise ValueError(f"free['{name}'] = ({low:g}, {high:g}): low must be less than high")


def read_run(found: Run, each: Experiment, zero: float) -> dict[str, Any]:
    """Read off a run what an experiment measured; the run begins at the time `zero` of its data."""
    time, values, units = found.record.time, found.values, found.units
    predicted: dict[str, Any] = {}
    for name in each.signals:
        if name not in values:
            raise WrongReadingError(str(unknown(name, list(values))))
        if (given := each.units.get(name)) and parse_unit(given).dimension != parse_unit(units[name]).dimension:
            raise WrongReadingError(f"data: {name} [{given}]: must be in {units[name]}")
        rate = found.traits[name].rate
        slopes = values[rate] if rate in values else Smooth(time, values[name]).slopes
        predicted[name] = between(time, values[name], slopes, np.clip(each.time - zero, 0.0, time[-1]))
    return predicted | {text: measure(text, time, values, units, Smooth).value for text in each.readings}


def signals_of(experiments: Sequence[Experiment]) -> list[str]:
    """List the signals that any experiment has."""
    return list(dict.fromkeys(name for each in experiments for name in each.signals))


def gather(experiments: Sequence[Experiment], name: str) -> Array:
    """Gather all measured values of a signal, shape (values,)."""
    values = np.concatenate([each.signals[name] for each in experiments if name in each.signals])
    return values[np.isfinite(values)]
