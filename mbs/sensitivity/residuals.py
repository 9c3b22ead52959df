"""Residuals of experiments over the unit cube of the free numbers, and their derivatives."""

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
from ..units import fits
from .curve import Smooth
from .data import Experiment
from .numbers import Family, Source
from .reading import RunFailedError, WrongReadingError, measure
from .runs import run

Bounds = tuple[float, float]
STEADY = Spectral(steps=Controlled(tolerance=1e-8), contact_tolerance=1e-4)
"""Default solver; its error over `WIDTH` is that of a derivative."""
WIDTH = 1e-4
"""Width of the differences for derivatives, over the range of a number."""
FAR = 1e3
"""Residual of a run that fails, in standard deviations."""
DEPENDENT = 1e-9
"""Singular value over the largest below which the data do not depend on a direction."""
CLOSE = 1e-7
"""Tolerance `ftol` of least squares: below a thousandth of a standard deviation."""
TIME_ZERO = "time_zero"
"""Name of the number that is the time of the data at which the run begins [s]; it is no number of the mechanism."""


@dataclass
class Problem:
    """Residuals over the unit cube of the free numbers.

    Attributes
    ----------
    make : callable
    experiments : list of Experiment
    names : list of str
        Names of the numbers; those of one experiment as `name [k]`.
    places : list of dict of str to int
        Numbers of each experiment, by the names that `make` knows.
    low, high : array
    errors : dict of str to float
        Standard deviations of signals.
    units : dict of str to str
        Units of the numbers, and of signals after a run.
    solver : Spectral
    failed : str
        Reason of the first run that failed.
    stopped : str
        Why the search ended before its end.
    blocked : dict of str to str
        Numbers beside which both runs fail, and why.
    """

    make: Callable[[Mapping[str, float]], Mechanism]
    experiments: list[Experiment]
    names: list[str]
    places: list[dict[str, int]]
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
        cls, mechanism: Source, experiments: list[Experiment], free: Mapping[str, Bounds], own: Mapping[str, Bounds],
        solver: Spectral | None,
    ) -> Problem:  # fmt: skip
        """Check what is asked for and number the free numbers."""
        if not free and not own:
            raise ValueError("free: no number; give {path: (low, high)}")
        ranges = {**free, **own}
        for name, (low, high) in ranges.items():
            if not low < high:
                raise ValueError(f"free['{name}'] = ({low:g}, {high:g}): low must be less than high")
        settings = {name for each in experiments for name in each.settings}
        if both := sorted(settings & set(ranges)):
            raise ValueError(f"free['{both[0]}']: the experiments set it")
        asked = [name for name in (*ranges, *settings) if name != TIME_ZERO]
        family = Family.of(mechanism, asked, dict.fromkeys(asked, 0.0))
        names, bounds = list(free), list(free.values())
        places = [{name: k for k, name in enumerate(free)} for _ in experiments]
        for k, place in enumerate(places):
            for name in own:
                place[name] = len(names)
                names.append(f"{name} [{k}]")
                bounds.append(own[name])
        for name in signals_of(experiments):
            if not gather(experiments, name).size:
                raise ValueError(f"data: {name} has no value at any time")
        units = {name: (family.units | {TIME_ZERO: "s"})[name.partition(" [")[0]] for name in names}
        guess = {name: _spread(gather(experiments, name)) for name in signals_of(experiments)}
        given = {name: each.errors[name] for each in experiments for name in each.errors}
        low, high = np.array(bounds, dtype=float).T
        return cls(family.make, experiments, names, places, low, high, guess | given, units, solver or STEADY)

    @property
    def has_errors(self) -> bool:
        """True if all standard deviations were given."""
        return set(signals_of(self.experiments)) <= {name for each in self.experiments for name in each.errors}

    @property
    def count(self) -> int:
        """Number of residuals."""
        return sum(size(each) for each in self.experiments)

    def values(self, x: Array) -> Array:
        """Compute the numbers at a point of the cube."""
        return np.asarray(self.low + x * (self.high - self.low))

    def predict(self, x: Array, k: int) -> dict[str, object]:
        """Run the k-th experiment at a point of the cube, and read what it measured."""
        each, values = self.experiments[k], self.values(x)
        numbers = {name: float(values[i]) for name, i in self.places[k].items()}
        zero = numbers.pop(TIME_ZERO, 0.0)
        found = run(self.make(numbers | dict(each.settings)), each.span - zero, self.solver)
        self.units |= {name: found.units[name] for name in each.signals if name in found.units}
        return read_run(found, each, zero)

    def predictions(self, x: Array) -> list[dict[str, object]]:
        """Predict all experiments at a point."""
        if self.cached is None or not np.array_equal(self.cached[0], x):
            self.cached = x.copy(), [self.predict(x, k) for k in range(len(self.experiments))]
        return self.cached[1]

    def residuals(self, x: Array) -> Array:
        """Compute the residuals in standard deviations."""
        try:
            said = self.predictions(x)
        except WrongReadingError:
            raise
        except (RunFailedError, ArithmeticError, ValueError) as error:
            self.failed = self.failed or str(error)
            return np.full(self.count, FAR)
        return np.concatenate([self.off(each, one) for each, one in zip(self.experiments, said, strict=True)])

    def off(self, each: Experiment, predicted: Mapping[str, Any]) -> Array:
        """Compute the residuals of one experiment."""
        parts = [((predicted[name] - values) / self.errors[name])[np.isfinite(values)] for name, values in each.signals.items()]
        parts.append(np.array([read.lacks(predicted[text]) for text, read in each.readings.items()]))
        found = np.concatenate(parts)
        return np.asarray(np.where(np.isfinite(found), found, FAR))

    def jacobian(self, x: Array) -> Array:
        """Compute derivatives of the residuals by the numbers over the cube, shape (residuals, numbers)."""
        here, rows = self.predictions(x), []
        for k, each in enumerate(self.experiments):
            block, start = np.zeros((size(each), len(self.names))), self.off(each, here[k])
            for i in self.places[k].values():
                block[:, i] = self.slope(x, k, i, start)
            rows.append(block)
        return np.concatenate(rows)

    def slope(self, x: Array, k: int, i: int, start: Array) -> Array:
        """Take the one-sided difference by one number, towards the middle of its range or, if a run fails, away; else zero."""
        axis, width = np.arange(len(x)) == i, WIDTH if x[i] < 0.5 else -WIDTH
        for change in (width, -width):
            try:
                return (self.off(self.experiments[k], self.predict(x + change * axis, k)) - start) / change
            except (RunFailedError, ArithmeticError, ValueError) as error:
                why = str(error)
        self.blocked[self.names[i]] = why
        return np.zeros(len(start))

    def residual_sizes(self, x: Array) -> dict[str, float]:
        """Compute the root mean square of each signal's residuals."""
        found: dict[str, list[Array]] = {}
        for each, said in zip(self.experiments, self.predictions(x), strict=True):
            for name, values in each.signals.items():
                found.setdefault(name, []).append((said[name] - values)[np.isfinite(values)])
        return {name: float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) for name, parts in found.items()}

    def weigh(self, x: Array) -> None:
        """Estimate missing standard deviations of signals by the residuals of a fit."""
        given, errors = {name for each in self.experiments for name in each.errors}, self.errors
        found = {name: value for name, value in self.residual_sizes(x).items() if name not in given}
        errors |= {name: max(value, 1e-12 * errors[name]) for name, value in found.items()}

    def covariance(self, x: Array) -> Array:
        """Compute the covariance of the numbers over the cube, s^2 (J^T J)^-1; very large in unseen directions."""
        j, r = self.jacobian(x), self.residuals(x)
        _, s, vh = np.linalg.svd(j, full_matrices=False)
        scale = 1.0 if self.has_errors else float(r @ r) / max(1, len(r) - len(x))
        spread = np.where(s > DEPENDENT * max(s[0], 1e-300), 1 / np.maximum(s, 1e-300), 1e12)
        return np.asarray(scale * (vh.T * spread**2) @ vh)


def read_run(found: Run, each: Experiment, zero: float = 0.0) -> dict[str, object]:
    """Read from a run what an experiment measured; its data begin at the time `zero`."""
    time, values, units = found.record.time, found.values, found.units
    said: dict[str, Any] = {}
    for name in each.signals:
        if name not in values:
            raise WrongReadingError(str(unknown(name, list(values))))
        if (given := each.units.get(name)) and not fits(given, units[name]):
            raise WrongReadingError(f"data: {name} [{given}]: must be in {units[name]}")
        rate = found.traits[name].rate
        slopes = values[rate] if rate in values else Smooth(time, values[name]).slopes
        said[name] = between(time, values[name], slopes, np.clip(each.time - zero, 0.0, time[-1]))
    return said | {text: measure(text, time, values, units, Smooth).value for text in each.readings}


def signals_of(experiments: Sequence[Experiment]) -> list[str]:
    """List the signals that any experiment has."""
    return list(dict.fromkeys(name for each in experiments for name in each.signals))


def gather(experiments: Sequence[Experiment], name: str) -> Array:
    """Gather all measured values of a signal, shape (values,)."""
    values = np.concatenate([each.signals[name] for each in experiments if name in each.signals])
    return values[np.isfinite(values)]


def _spread(values: Array) -> float:
    """Estimate the scale of the residuals of a signal before a fit."""
    return float(np.std(values)) or float(np.max(np.abs(values))) or 1.0


def size(each: Experiment) -> int:
    """Count the residuals of an experiment."""
    return sum(int(np.isfinite(values).sum()) for values in each.signals.values()) + len(each.readings)
