"""Means with their standard errors, and power laws by least squares."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.stats import sem

from buckler.studies.kit.report import Metric

Array = np.ndarray[Any, Any]


def mean(unit: str, values: Any) -> Metric:
    """Mean of independent values, and its relative standard error where there are several."""
    found = float(np.mean(values))
    return Metric(found, unit, error=float(sem(values)) / abs(found) if np.size(values) > 1 and found else None)


class PowerLaw(NamedTuple):
    """Logarithms of an output as a linear function of those of the inputs, by least squares.

    Attributes
    ----------
    slope, error : array, shape (d,)
        d ln y/d ln x and its standard error.
    explained : float
        Share of the variance that the fit explains.
    scatter : float
        Standard deviation of ln y about it.
    """

    slope: Array
    error: Array
    explained: float
    scatter: float

    def metrics(self) -> list[Metric]:
        """Of each slope, with its relative standard error where it is not 0."""
        pairs = zip(self.slope.tolist(), self.error.tolist(), strict=True)
        return [Metric(slope, "1", error=abs(error / slope) if slope else None) for slope, error in pairs]


def power_law(inputs: Array, output: Array) -> PowerLaw:
    """Fit one output, shape (n,), to inputs of shape (d, n)."""
    x, y = np.log(inputs), np.log(output)
    x, y = (x - x.mean(axis=1, keepdims=True)).T, y - y.mean()
    slope, *_ = np.linalg.lstsq(x, y, rcond=None)
    left = y - x @ slope
    variance = left @ left / (len(y) - x.shape[1] - 1)
    error = np.sqrt(variance * np.diag(np.linalg.inv(x.T @ x)))
    return PowerLaw(slope, error, float(1 - left @ left / (y @ y)), float(np.sqrt(variance)))
