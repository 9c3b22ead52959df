"""Means with their standard errors, power laws by least squares, error against run time.

Run times are measured in rounds, in each of which every variant runs once, so that a busy machine slows all variants alike. The
ratio of two times is the median of the ratios within a round.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass
from math import nan, sqrt
from statistics import median
from time import process_time
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.validate import whole

from .parameters import StudyParameters
from .report import Metric, collect_provenance

Name = TypeVar("Name", bound=Hashable)


class Mean(NamedTuple):
    """Mean of independent values, its standard error (nan for a single value), and the number of values."""

    value: float
    error: float
    n: int

    def metric(self, unit: str) -> Metric:
        """Return a metric, with the relative standard error where there are several values."""
        return Metric(self.value, unit, error=self.error / abs(self.value) if self.n > 1 and self.value else None)


def mean(unit: str, values: Any) -> Metric:
    """Return the metric of the `Mean` of independent values."""
    x = np.asarray(values)
    n = len(x)
    return Mean(float(x.mean()) if n else nan, float(x.std(ddof=1)) / sqrt(n) if n > 1 else nan, n).metric(unit)


def exponent(x: Any, y: Any) -> float:
    """Fit the exponent n of y ~ x^n by least squares to the positive points; nan for fewer than two different x."""
    x, y = np.asarray(x), np.asarray(y)
    is_positive = (x > 0) & (y > 0)  # false for nan
    x, y = np.log(x[is_positive]), np.log(y[is_positive])
    return float((x - x.mean()) @ (y - y.mean()) / ((x - x.mean()) @ x)) if len(set(x)) > 1 else nan


def power_law(inputs: Array, output: Array) -> tuple[list[Metric], Metric]:
    """Fit y = c x1^s1 x2^s2 ... to an output, shape (n,), and inputs, shape (d, n), by least squares of logarithms; n > d + 1.

    Return the powers s with their standard errors, and the standard deviation of ln y about the law.
    """
    x, y = np.log(inputs), np.log(output)
    x, y = (x - x.mean(axis=1, keepdims=True)).T, y - y.mean()
    powers, *_ = np.linalg.lstsq(x, y, rcond=None)
    residual = y - x @ powers
    variance = residual @ residual / (len(y) - x.shape[1] - 1)  # powers and the factor c are fitted
    errors = np.sqrt(variance * np.diag(np.linalg.inv(x.T @ x)))
    pairs = zip(powers.tolist(), errors.tolist(), strict=True)
    found = [Metric(power, "1", error=abs(error / power) if power else None) for power, error in pairs]
    return found, Metric(float(np.sqrt(variance)), "1")


@dataclass(frozen=True)
class WorkPoint:
    """Error of a variant, in a unit common to all, or nan; processor time in each round [s]."""

    error: float
    times: tuple[float, ...]

    @property
    def time(self) -> float:
        """Median time [s]."""
        return median(self.times)

    def speedup(self, other: Self) -> float:
        """Compute the speed-up over another variant: median of the ratios of their times within a round."""
        return median(theirs / ours for ours, theirs in zip(self.times, other.times, strict=True))


def work_precision(
    variants: Mapping[Name, Callable[[], object]], errors: Mapping[Name, float], repeats: int = 5, *,
    progress: Callable[[list[Name]], Iterable[Name]] = iter,
) -> dict[Name, WorkPoint]:  # fmt: skip
    """Measure the processor time of every variant in rounds; a variant does the whole job from its input to its answer.

    `errors` come from first runs that are not timed. `progress` iterates over the names of the runs to make, and may show a bar.
    """
    whole("repeats", repeats, 1, 10**6)
    times: dict[Name, list[float]] = {name: [] for name in variants}
    for name in progress([*variants] * repeats):
        start = process_time()
        variants[name]()
        times[name].append(process_time() - start)
    return {name: WorkPoint(errors[name], tuple(spent)) for name, spent in times.items()}


def fastest(points: Iterable[WorkPoint], error: float) -> WorkPoint | None:
    """Find the fastest variant whose error is at most `error`; None if no variant is so accurate."""
    return min((p for p in points if p.error <= error), key=lambda p: p.time, default=None)


def footnote(parameters: StudyParameters) -> str:
    """Write repetitions, machine and versions below a table of run times."""
    origin = collect_provenance(parameters)
    versions = ", ".join(f"{name} {version}" for name, version in origin["versions"].items() if version)
    machine = f"{origin['machine']['cpu']}, {origin['machine']['cores']} cores"
    return f"Medians of {origin['parameters']['repeats']} rounds; {machine}; {versions}; commit {origin['commit']}."
