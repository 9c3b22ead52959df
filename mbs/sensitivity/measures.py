"""Errors of readings of a result: by the difference of two runs, or, of a chaotic motion, sampling errors of its statistics.

The value of a chaotic motion at a time is not predictable, but means, rms, peaks and impulses are statistics of a sample of all
such motions. Their sampling errors follow by batch means (Law, Simulation Modeling and Analysis, 2015, section 9.5): the run is
divided into n batches, turns of the drive or equal parts, and the reading computed for each. With their standard deviation s and
the 97.5 % quantile t of Student's distribution of n - 1 degrees of freedom, the half-width of a 95 % interval is t s/sqrt(n) for
a mean or rms, t s sqrt(n) for an impulse, and t s for a largest or smallest value, as the width of the distribution of extremes
(Gumbel, Statistics of Extremes, 1958) does not depend on n.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from math import isfinite, nan
from typing import NamedTuple

import numpy as np

from ..accuracy.demand import STRIKE
from ..geometry import Array
from ..record.errors import LEVEL, Key, Norm, Status
from ..record.result import Result
from .curve import Smooth
from .reading import ARGUMENTS, measure, parse_reading, value_of

NORMS = {"impulse": Norm.IMPULSE, "mean": Norm.RMS, "rms": Norm.RMS, "begins": Norm.ONSET, "ends": Norm.ONSET}
"""Norm of a signal's error that bounds a reading; PEAK bounds the others."""
PEAKS = ("contact_force", "normal_force", "force", "torque", "current", "fx", "fy", "axial_force", "compression", "deflection",
         "end_shortening", "penetration")  # fmt: skip
"""Quantities, the last parts of signals' names, whose peaks are read by default."""
ENDED = (Status.TIMED_OUT, Status.INTERRUPTED)
"""Statuses of a run that was ended from outside."""
TIMED = re.compile(r"\bat\(")
"""Pattern of readings at a given time, which may lie after the end of an incomplete run."""
OF_CONTACTS = ("begins", "ends", "peak")
"""Readings of single contacts: errors are added only where the signal is not zero."""
BATCHES = 20
"""Most batches, and their number without a turning drive: with fewer s is uncertain, more are correlated."""
FEWEST = 4
"""Least number of batches for a standard deviation."""
POWERS = {"mean": -0.5, "rms": -0.5, "impulse": 0.5, "max": 0.0, "min": 0.0, "peak": 0.0}
"""Exponent p of n: the standard deviation of a reading of the whole run is that of one batch times n^p."""


class Reading(NamedTuple):
    """Number read off a result, with its error in the unit of the value, nan where it is not known.

    The error is by its `kind` a bound by two runs ("difference"), the half-width of a 95 % interval ("sampling"), or "unknown".
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
    tree, names = parse_reading(text, result.signals)
    signals = {short: result.signals[name] for short, name in names.items()}
    error = _propagate(tree, result.time, signals, lambda leaf, reading, _: _spread(leaf, reading, result, signals))
    return Reading(value, error, unit, "sampling" if error >= 0 else "unknown")


def bound_error(text: str, result: Result) -> float:
    """Bound the error of a reading, in its unit; nan where the error of a signal is not known to the end of the run.

    Errors of signals are propagated through each reading in the formula and added; so is the difference of linear and cubic
    interpolation.
    """
    tree, names = parse_reading(text, result.signals)
    signals, time = {short: result.signals[name] for short, name in names.items()}, result.time
    whole = result.error.until >= time[-1] * (1 - 1e-9)
    known = {(short, norm): result.error.absolute(name, norm) if whole else nan for short, name in names.items() for norm in Norm}
    with np.errstate(all="ignore"):
        interpolated = abs(value_of(tree, time, signals) - value_of(tree, time, signals, Smooth))
        found = _propagate(tree, time, signals, lambda leaf, reading, value: _change(leaf, reading, value, time, signals, known))
    return float(interpolated) + found


def _propagate(
    tree: ast.expr, time: Array, signals: Mapping[str, Array], change: Callable[[ast.Call, str, float], float]
) -> float:
    """Sum the changes of a formula's value due to changes, up and down, of each reading in it."""
    exact, total = value_of(tree, time, signals), 0.0
    for leaf in ast.walk(tree):
        if isinstance(leaf, ast.Call) and isinstance(leaf.func, ast.Name) and leaf.func.id in ARGUMENTS:
            value = value_of(leaf, time, signals)
            error = change(leaf, leaf.func.id, value)
            changed = [value_of(tree, time, signals, given={leaf: value + d}) for d in (error, -error)]
            total += float(np.max(np.abs(np.subtract(changed, exact))))
    return total


def _change(
    leaf: ast.Call, reading: str, value: float, time: Array, signals: dict[str, Array], known: Mapping[Key, float]
) -> float:
    """Bound the change of a reading by the errors of its signals."""
    change, norm = 0.0, NORMS.get(reading, Norm.PEAK)
    for short in {node.id for node in ast.walk(leaf.args[0]) if isinstance(node, ast.Name) and node.id in signals}:
        x, error = signals[short], known[short, norm]
        if norm is Norm.ONSET:
            change += error + float(np.interp(value, time[1:], np.diff(time)))  # onsets are times of samples
            continue
        error = error / float(time[-1]) if norm is Norm.IMPULSE else error
        shapes = (np.sign(x),) if reading in OF_CONTACTS else (np.sign(x), np.ones(len(x)))
        changed = [value_of(leaf, time, {**signals, short: x + side * error * shape}) for shape in shapes for side in (1, -1)]
        change += float(np.max(np.abs(np.subtract(changed, value))))
    return change


def _spread(leaf: ast.Call, reading: str, result: Result, signals: Mapping[str, Array]) -> float:
    """Estimate the half-width of the 95 % interval of one reading."""
    from scipy.stats import t  # slow to load

    edges = batches(result)
    if reading not in POWERS or len(edges) <= FEWEST:
        return nan
    found = []
    for begin, end in pairwise(edges):
        part = slice(int(np.searchsorted(result.time, begin)), int(np.searchsorted(result.time, end, side="right")))
        if part.stop - part.start > 1:
            found.append(float(value_of(leaf, result.time[part], {name: x[part] for name, x in signals.items()})))
    n = len(found)
    return float(t.ppf(0.5 + LEVEL / 2, n - 1) * np.std(found, ddof=1) * n ** POWERS[reading]) if n >= FEWEST else nan


def batches(result: Result) -> Array:
    """Return the edges of batches [s]: whole turns of the drive, at most `BATCHES` batches, else equal parts."""
    end, turn = float(result.time[-1]), result.error.turn
    if not turn > 0 or end < FEWEST * turn:
        return np.linspace(0.0, end, BATCHES + 1)
    turns = max(1, round(end / turn / BATCHES))
    return np.arange(0.0, end * (1 + 1e-9), turns * turn)


class Measure(NamedTuple):
    """Number read off a run by its formula, `name`, with `signals`; error in its unit, nan where it is not known.

    It is `beyond` the accuracy if its error is larger than requested, or not known in a run with an error estimate.
    """

    name: str
    value: float
    unit: str
    error: float
    beyond: bool
    signals: tuple[str, ...]

    @property
    def relative(self) -> float:
        """Relative error; nan if it is not known or not below 1."""
        return self.error / abs(self.value) if self.error < abs(self.value) else nan


def measures(result: Result, texts: Sequence[str] = ()) -> list[Measure]:
    """Read formulas off a run, by default the peaks of its forces, torques and deflections; none off a run that failed.

    A run that was ended from outside is read up to its end.
    """
    ended = result.status in ENDED and len(result.time) > 1
    wanted = [text for text in texts or peaks(result) if not (ended and TIMED.search(text))]
    return [_measure(result, text) for text in wanted] if ended or result.status.finished else []


def _measure(result: Result, text: str) -> Measure:
    """Read a formula and compare its error with the accuracy requested, or with `STRIKE`."""
    value, error, unit, _ = result.reading(text)
    known = parse_reading(text, result.signals)[1].values()
    names = [name for name in known if result.units.get(name) == unit]
    size = max([abs(value), *(float(np.abs(result.signals[name]).max(initial=0.0)) for name in names)])
    allowed = (result.asked if result.asked > 0 else STRIKE) * (abs(value) if error < abs(value) else size)
    return Measure(
        text, value, unit, error if isfinite(error) else nan, result.error.known and not error <= allowed, tuple(known)
    )


def peaks(result: Result) -> list[str]:
    """List the default readings: peaks of forces, torques and deflections, of their means where vibrations are not resolved."""
    names = [name for name in result.signals if name.rpartition(".")[2] in PEAKS]
    return [f"max(abs({name}{'.mean' if name in result.error.unresolved else ''}))" for name in names]
