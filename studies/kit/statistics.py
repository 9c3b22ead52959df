"""Means with their standard errors, and power laws by least squares."""

from __future__ import annotations

from math import nan, sqrt
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.geometry import Array

from .report import Metric


class Mean(NamedTuple):
    """Mean of independent values, its standard error (nan for a single value), and their number."""

    value: float
    error: float
    n: int

    def metric(self, unit: str) -> Metric:
        """Return a metric, with the relative standard error where there are several values."""
        return Metric(self.value, unit, error=self.error / abs(self.value) if self.n > 1 and self.value else None)


def mean(unit: str, values: Any) -> Metric:
    """Return the mean of independent values as a metric, with its relative standard error where there are several."""
    x = np.asarray(values)
    n = len(x)
    return Mean(float(x.mean()) if n else nan, float(x.std(ddof=1)) / sqrt(n) if n > 1 else nan, n).metric(unit)


class PowerLaw(NamedTuple):
    """Power law by linear least squares in the logarithms of inputs and output.

    Attributes
    ----------
    slope, error : d ln y/d ln x and its standard error, shape (d,)
    explained : share of the variance that the fit explains
    scatter : standard deviation of ln y about it
    """

    slope: Array
    error: Array
    explained: float
    scatter: float

    def metrics(self) -> list[Metric]:
        """Return a metric for each slope, with its relative standard error where it is not 0."""
        pairs = zip(self.slope.tolist(), self.error.tolist(), strict=True)
        return [Metric(slope, "1", error=abs(error / slope) if slope else None) for slope, error in pairs]


def exponent(x: Any, y: Any) -> float:
    """Fit the exponent n of y ~ x^n to the points that are finite and positive; nan for fewer than two."""
    x, y = np.asarray(x), np.asarray(y)
    good = (x > 0) & (y > 0)  # false for nan
    x, y = np.log(x[good]), np.log(y[good])
    return float((x - x.mean()) @ (y - y.mean()) / ((x - x.mean()) @ x)) if len(set(x)) > 1 else nan


def power_law(inputs: Array, output: Array) -> PowerLaw:
    """Fit one output, shape (n,), to inputs of shape (d, n)."""
    x, y = np.log(inputs), np.log(output)
    x, y = (x - x.mean(axis=1, keepdims=True)).T, y - y.mean()
    slope, *_ = np.linalg.lstsq(x, y, rcond=None)
    left = y - x @ slope
    variance = left @ left / (len(y) - x.shape[1] - 1)
    error = np.sqrt(variance * np.diag(np.linalg.inv(x.T @ x)))
    share = float(1 - left @ left / (y @ y)) if y.any() else nan  # equal outputs have no spread to share
    return PowerLaw(slope, error, share, float(np.sqrt(variance)))
