"""Residuals of experiments, and their derivatives by the free numbers, which are scaled to the unit cube.

A residual is a predicted less a measured value, over the standard deviation of the measurement.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

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
from .reading import FAILURES, WrongReadingError, read_number
from .runs import run

Bounds = tuple[float, float]
"""Least and largest value of a free number, SI."""
SOLVER = Spectral(steps=Controlled(tolerance=1e-8), contact_tolerance=1e-4)
"""Default solver. Its tolerance of 1e-8 over `DIFFERENCE_WIDTH` gives errors of 1e-4 in derivatives by scaled numbers. The
`contact_tolerance` is chosen."""
DIFFERENCE_WIDTH = 1e-4
"""Width of the differences for derivatives, over the range of the number."""
FAILURE_RESIDUAL = 1e3
"""Residual of a run that fails, in standard deviations; chosen. In a search for a design it is the relative violation of a
constraint whose reading has no value."""
TIME_ZERO = "time_zero"
"""Name of the number that is the time of the data at which the run begins [s]; it is no number of the mechanism."""


@dataclass
class FitProblem:
    """Residuals as functions of a point of the unit cube, one coordinate for each free number between `low` and `high`.

    `errors` are standard deviations of signals. The user gave none for the signals `estimated`: a first fit weighs these by the
    spread of their data, then `estimate_errors` takes the errors from its residuals. `units` are those of numbers and, after a
    run, of signals. `failed` is the message of the first run that failed, `stopped` the reason why the search ended early.
    `blocked` has the numbers without a derivative, as runs on both sides fail, with the message of a run. `cached` is the latest
    point and its predictions.
    """

    make: Callable[[Mapping[str, float]], Mechanism]
    experiments: list[Experiment]
    names: list[str]
    low: Array
    high: Array
    errors: dict[str, float]
    estimated: list[str]
    units: dict[str, str]
    solver: Spectral
    failed: str = ""
    stopped: str = ""
    blocked: dict[str, str] = field(default_factory=dict)
    cached: tuple[Array, list[dict[str, Any]]] | None = None

    @classmethod
    def of(cls, mechanism: Source, experiments: list[Experiment], free: Mapping[str, Bounds], solver: Spectral | None) -> Self:
        """Check the input and scale the free numbers to the cube."""
        if not free:
            raise ValueError("free: no number; give {path: (low, high)}")
        check_ranges(free)
        settings = {name for experiment in experiments for name in experiment.settings}
        if both := sorted(settings & set(free)):
            raise ValueError(f"free['{both[0]}']: the experiments set it")
        varied = [name for name in (*free, *settings) if name != TIME_ZERO]
        family = Family.of(mechanism, varied)  # of mechanisms with other values of these numbers
        measured = gather_signals(experiments)
        if missing := [name for name, values in measured.items() if not values.size]:
            raise ValueError(f"data: {missing[0]} has no value at any time")
        # a constant signal has no spread and takes its value; one that is zero takes 1, as the weight must be finite
        spreads = {name: float(np.std(x)) or float(np.max(np.abs(x))) or 1.0 for name, x in measured.items()}
        given = {name: error for experiment in experiments for name, error in experiment.errors.items()}
        units = {name: (family.units | {TIME_ZERO: "s"})[name] for name in free}
        low, high = np.array(list(free.values()), dtype=float).T
        estimated = [name for name in measured if name not in given]
        return cls(family.make, experiments, list(free), low, high, spreads | given, estimated, units, solver or SOLVER)

    @property
    def count(self) -> int:
        """Number of residuals."""
        signals = [x for experiment in self.experiments for x in experiment.signals.values()]
        return sum(int(np.isfinite(x).sum()) for x in signals) + sum(len(each.readings) for each in self.experiments)

    @property
    def freedom(self) -> int:
        """Number of residuals less that of free numbers, at least 1."""
        return max(1, self.count - len(self.names))

    def values(self, x: Array) -> Array:
        """Compute the numbers at a point of the cube."""
        return np.asarray(self.low + x * (self.high - self.low))

    def predict(self, x: Array) -> list[dict[str, Any]]:
        """Run all experiments at a point of the cube; return the measured signals and readings of each run."""
        if self.cached is not None and np.array_equal(self.cached[0], x):
            return self.cached[1]
        numbers, predicted = dict(zip(self.names, self.values(x).tolist(), strict=True)), []
        time_zero = numbers.pop(TIME_ZERO, 0.0)
        for experiment in self.experiments:
            duration = experiment.span - time_zero  # to the end of the data
            ended = run(self.make(numbers | dict(experiment.settings)), duration, self.solver)
            self.units |= {name: ended.units[name] for name in experiment.signals if name in ended.units}
            predicted.append(predict_data(ended, experiment, time_zero))
        return predicted

    def compare(self, predicted: Sequence[Mapping[str, Any]]) -> Array:
        """Compute the residuals of predictions in standard deviations."""
        parts = []
        for experiment, values in zip(self.experiments, predicted, strict=True):
            for name, x in experiment.signals.items():
                error = experiment.errors.get(name, self.errors[name])
                parts.append(((values[name] - x) / error)[np.isfinite(x)])
            parts.append(np.array([measured.residual(values[text]) for text, measured in experiment.readings.items()]))
        residuals = np.concatenate(parts)
        return np.where(np.isfinite(residuals), residuals, FAILURE_RESIDUAL)

    def residuals(self, x: Array) -> Array:
        """Compute the residuals at a point; all are `FAILURE_RESIDUAL` if a run fails."""
        try:
            self.cached = x.copy(), self.predict(x)
        except WrongReadingError:  # wrong for every run
            raise
        except FAILURES as error:
            self.failed = self.failed or str(error)
            return np.full(self.count, FAILURE_RESIDUAL)
        return self.compare(self.cached[1])

    def sum_of_squares(self, x: Array) -> float:
        """Compute the sum of the squared residuals at a point; inf if a run fails there."""
        residuals = self.residuals(x)
        has_failed = np.all(residuals == FAILURE_RESIDUAL)
        return np.inf if has_failed else float(np.sum(residuals**2))

    def jacobian(self, x: Array) -> Array:
        """Compute derivatives of the residuals by the coordinates, (residuals, numbers); the run at the point must not fail."""
        residuals = self.compare(self.predict(x))
        return np.column_stack([self._slope(x, i, residuals) for i in range(len(x))])

    def _slope(self, x: Array, i: int, residuals: Array) -> Array:
        """Compute the difference quotient by one coordinate, towards the middle or, if a run fails, away from it; else 0."""
        axis = np.arange(len(x)) == i
        towards_middle = DIFFERENCE_WIDTH if x[i] < 0.5 else -DIFFERENCE_WIDTH
        for change in (towards_middle, -towards_middle):
            try:
                return (self.compare(self.predict(x + change * axis)) - residuals) / change
            except FAILURES as error:
                message = str(error)
        self.blocked[self.names[i]] = message
        return np.zeros(len(residuals))

    def residual_sizes(self, x: Array) -> dict[str, float]:
        """Compute the root mean square of predicted less measured values of each signal, in its unit."""
        differences: dict[str, list[Array]] = {}
        for experiment, predicted in zip(self.experiments, self.predict(x), strict=True):
            for name, values in experiment.signals.items():
                differences.setdefault(name, []).append((predicted[name] - values)[np.isfinite(values)])
        return {name: float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) for name, parts in differences.items()}

    def estimate_errors(self, x: Array) -> None:
        """Estimate missing standard deviations of signals by the residuals of a fit."""
        sizes = self.residual_sizes(x)
        for name in self.estimated:
            self.errors[name] = max(sizes[name], 1e-12 * self.errors[name])  # above 0 for data without noise

    def covariance(self, x: Array) -> Array:
        """Compute the covariance of the scaled numbers, variance (J^T J)^-1; very large in directions without influence."""
        _, s, vh = np.linalg.svd(self.jacobian(x), full_matrices=False)
        variance = self.sum_of_squares(x) / self.freedom if self.estimated else 1.0
        has_influence = s > 1e-9 * max(s[0], 1e-300)  # the data depend on the combination of numbers
        deviations = np.where(has_influence, 1 / np.maximum(s, 1e-300), 1e12)  # 1e12: beyond any range
        return np.asarray(variance * (vh.T * deviations**2) @ vh)


def check_ranges(free: Mapping[str, Bounds]) -> None:
    """Raise a ValueError unless each range has a low end below its high one."""
    for name, (low, high) in free.items():
        if not low < high:
            raise ValueError(f"free['{name}'] = ({low:g}, {high:g}): low must be less than high")


def predict_data(ended: Run, experiment: Experiment, time_zero: float) -> dict[str, Any]:
    """Return the signals, at the times of the data, and readings of a run that begins at `time_zero` of the data."""
    time, values, units = ended.record.time, ended.values, ended.units
    times = np.clip(experiment.time - time_zero, 0.0, time[-1])  # before the run begins its signals have their first values
    predicted: dict[str, Any] = {}
    for name in experiment.signals:
        if name not in values:
            raise WrongReadingError(str(unknown(name, list(values))))
        if (given := experiment.units.get(name)) and parse_unit(given).dimension != parse_unit(units[name]).dimension:
            raise WrongReadingError(f"data: {name} [{given}]: must be in {units[name]}")
        rate = ended.signals[name].rate  # name of the signal that is the time derivative, as `A.vx` for `A.x`
        slopes = values[rate] if rate in values else Smooth(time, values[name]).slopes
        predicted[name] = between(time, values[name], slopes, times)
    return predicted | {text: read_number(text, time, values, units, Smooth).value for text in experiment.readings}


def gather_signals(experiments: Sequence[Experiment]) -> dict[str, Array]:
    """Gather the measured values of each signal from all experiments, shape (values,)."""
    gathered: dict[str, Array] = {}
    for name, values in (pair for experiment in experiments for pair in experiment.signals.items()):
        gathered[name] = np.append(gathered.get(name, []), values[np.isfinite(values)])
    return gathered
