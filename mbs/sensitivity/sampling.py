"""Errors of readings of a result: by the difference of runs, or of chaotic motions by sampling.

Values of a chaotic motion at a time have no error, but its means, rms, peaks and impulses estimate those of all such motions.
Their sampling error follows from n batches of the run: turns of the drive, or equal parts. Let b_k be a reading of batch k and s
the standard deviation of all b_k. Let t be the 97.5 % quantile of Student's distribution of n - 1 degrees. The half-width of a
95 % interval is

    t s/sqrt(n)  of a mean or rms,    t s sqrt(n)  of an impulse,    t s  of a largest or smallest value.

Largest values of many turns follow Gumbel's distribution, whose width does not depend on the number of turns.

References
----------
A. M. Law, Simulation Modeling and Analysis, 5th ed., McGraw-Hill 2015, section 9.5: batch means.
E. J. Gumbel, Statistics of Extremes, Columbia University Press 1958.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from itertools import pairwise
from math import nan
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..record.result import Result
from .doubt import bound_error
from .reading import ARGUMENTS, measure, parse_reading, value_of

BATCHES = 20
"""Most batches, and their number where no drive turns: fewer hide the spread, more correlate with each other."""
FEWEST = 4
"""Least number of batches for a standard deviation."""
POWERS = {"mean": -0.5, "rms": -0.5, "impulse": 0.5, "max": 0.0, "min": 0.0, "peak": 0.0}
"""Exponent p of n: the spread of a reading of the whole run is that of a batch times n^p."""


class Reading(NamedTuple):
    """Number read off a result.

    Attributes
    ----------
    value : float
    error : float
        Error in the unit of the value: a bound by the difference of two runs, or the half-width of a 95 % interval by sampling;
        nan where it is not known.
    unit : str
    kind : str
        "difference", "sampling" or "unknown".
    """

    value: float
    error: float
    unit: str
    kind: str


def read(result: Result, text: str) -> Reading:
    """Read a formula of `buckler.mbs.sensitivity.reading` off a result, such as `rms(B.normal_force)`, with its error."""
    value, unit = measure(text, result.time, result.signals, result.units)
    if not result.error.known:
        return Reading(value, nan, unit, "unknown")
    if result.error.until >= result.time[-1] * (1 - 1e-9):
        return Reading(value, bound_error(text, result), unit, "difference")
    error = sampling_error(text, result)
    return Reading(value, error, unit, "sampling" if error >= 0 else "unknown")


def sampling_error(text: str, result: Result) -> float:
    """Estimate the half-width of a 95 % interval of a reading of a chaotic motion; nan of a value at a time, or of few turns."""
    tree, names = parse_reading(text, result.signals)
    signals = {short: result.signals[name] for short, name in names.items()}
    exact, total = value_of(tree, result.time, signals), 0.0
    for leaf in ast.walk(tree):
        if isinstance(leaf, ast.Call) and isinstance(leaf.func, ast.Name) and leaf.func.id in ARGUMENTS:
            off = _spread(leaf, leaf.func.id, result, signals)
            value = value_of(leaf, result.time, signals)
            ways = [value_of(tree, result.time, signals, given={leaf: value + d}) for d in (off, -off)]
            total += float(np.max(np.abs(np.subtract(ways, exact))))
    return float(total)


def _spread(leaf: ast.Call, reading: str, result: Result, signals: Mapping[str, Array]) -> float:
    """Estimate the half-width of the interval of one reading."""
    from scipy.stats import t  # it takes a while to load, and few need it

    edges = batches(result)
    if reading not in POWERS or len(edges) <= FEWEST:
        return nan
    found = []
    for begin, end in pairwise(edges):
        part = slice(int(np.searchsorted(result.time, begin)), int(np.searchsorted(result.time, end, side="right")))
        if part.stop - part.start > 1:
            found.append(float(value_of(leaf, result.time[part], {name: x[part] for name, x in signals.items()})))
    n = len(found)
    return float(t.ppf(0.975, n - 1) * np.std(found, ddof=1) * n ** POWERS[reading]) if n >= FEWEST else nan


def batches(result: Result) -> Array:
    """Return the edges of batches [s]: whole turns of the drive, at most `BATCHES` batches, else equal parts."""
    end, turn = float(result.time[-1]), result.error.turn
    if not turn > 0 or end < FEWEST * turn:
        return np.linspace(0.0, end, BATCHES + 1)
    turns = max(1, round(end / turn / BATCHES))
    return np.arange(0.0, end * (1 + 1e-9), turns * turn)
