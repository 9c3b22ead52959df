"""Errors of readings of a result: from the difference of two runs or, for a chaotic motion, as sampling errors of statistics.

Sampling errors follow by batch means (Law, Simulation Modeling and Analysis, 2015, section 9.5). The run is divided into n
batches, revolutions of the drive or equal parts, and the reading is computed for each. Let s be the standard deviation of these n
values, and t the 97.5 % quantile of Student's distribution of n - 1 degrees of freedom. The half-width of a 95 % interval is
t s/sqrt(n) for a mean or rms, t s sqrt(n) for an impulse, and t s for a largest or smallest value: the width of the distribution
of extremes does not depend on n (Gumbel, Statistics of Extremes, 1958).
"""

import ast
import re
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from math import isfinite, nan
from typing import NamedTuple

import numpy as np

from ..accuracy.demand import USUAL_ERROR
from ..geometry import Array
from ..record.errors import CONFIDENCE, Key, Norm, Status
from ..record.result import Result
from .curve import Smooth
from .reading import POINTWISE, parse_reading, read_number, value_of

NORMS = {"impulse": Norm.IMPULSE, "mean": Norm.RMS, "rms": Norm.RMS, "begins": Norm.ONSET, "ends": Norm.ONSET}
"""Norm of a signal's error that bounds the error of a reading; `Norm.PEAK` bounds all other readings."""
PEAKS = ("contact_force", "normal_force", "force", "torque", "current", "fx", "fy", "axial_force", "compression", "deflection",
         "end_shortening", "penetration")  # fmt: skip
"""Quantities, last parts of the names of signals, whose peaks are read by default."""
BATCHES = 20
"""Number of batches, chosen: fewer make s uncertain, more are correlated.

With N revolutions of a drive a batch has N/20 of them, rounded, at least 1. So there are 4 to 29 batches."""
LEAST_BATCHES = 4
"""Least number of batches for a standard deviation; chosen."""
POWERS = {"mean": -0.5, "rms": -0.5, "impulse": 0.5, "max": 0.0, "min": 0.0, "peak": 0.0}
"""Exponent p: the standard deviation of a reading of the whole run is n^p times that of a batch, with n batches."""


class Reading(NamedTuple):
    """Number read off a result with its error, in the unit of the value; nan if not known.

    The `kind` of the error is "difference" (bound from two runs), "sampling" (half-width of a 95 % interval) or "unknown".
    """

    value: float
    error: float
    unit: str
    kind: str


def read(result: Result, text: str) -> Reading:
    """Read a formula, such as `rms(B.normal_force)`, off a result, with its error."""
    value, unit = read_number(text, result.time, result.signals, result.units)
    if not result.error.known:
        return Reading(value, nan, unit, "unknown")
    if result.error.until >= result.time[-1] * (1 - 1e-9):  # else two runs separate before the end
        return Reading(value, bound_error(text, result), unit, "difference")
    tree, names = parse_reading(text, result.signals)  # names of signals by their short names _0, _1, ... in the tree
    signals = {short: result.signals[name] for short, name in names.items()}
    error = _propagate(tree, result.time, signals, lambda call, function, _: _sampling_error(call, function, result, signals))
    is_known = error >= 0  # False for nan
    return Reading(value, error, unit, "sampling" if is_known else "unknown")


def bound_error(text: str, result: Result) -> float:
    """Bound the error of a reading, in the reading's unit, in a run of which two solutions do not separate; nan if not known.

    The bound is the sum of the changes due to the errors of all signals, and of the difference of linear and cubic interpolation.
    """
    tree, names = parse_reading(text, result.signals)
    signals, time = {short: result.signals[name] for short, name in names.items()}, result.time
    errors = {(short, norm): result.error.absolute(name, norm) for short, name in names.items() for norm in Norm}
    with np.errstate(all="ignore"):
        interpolation = abs(value_of(tree, time, signals) - value_of(tree, time, signals, Smooth))
        change = _propagate(tree, time, signals, lambda call, function, x: _change(call, function, x, time, signals, errors))
    return float(interpolation) + change


def _propagate(
    tree: ast.expr, time: Array, signals: Mapping[str, Array], change: Callable[[ast.Call, str, float], float]
) -> float:
    """Sum the changes of a formula's value that errors of its readings cause, the larger of both signs of each error.

    A reading in the formula is a call of a function, such as max(x); `change(call, function, value)` returns its error.
    """
    exact, total = value_of(tree, time, signals), 0.0
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id not in POINTWISE:
            value = value_of(call, time, signals)
            error = change(call, call.func.id, value)
            changed = [value_of(tree, time, signals, given={call: value + shift}) for shift in (error, -error)]
            total += float(np.max(np.abs(np.subtract(changed, exact))))
    return total


def _change(
    call: ast.Call, function: str, value: float, time: Array, signals: dict[str, Array], errors: Mapping[Key, float]
) -> float:
    """Bound the change of a reading of a function by the errors of its signals.

    The time of a contact changes by the error of the signal's onsets and a step. For other readings the error is added
    in two shapes, with both signs: as a multiple of sign(x), which changes all sizes alike, and as a constant, which changes all
    signed values alike. The bound is the largest change of the reading. An error of the impulse is spread evenly over the run.
    """
    change, norm = 0.0, NORMS.get(function, Norm.PEAK)
    for short in {node.id for node in ast.walk(call.args[0]) if isinstance(node, ast.Name) and node.id in signals}:
        x, error = signals[short], errors[short, norm]
        if norm is Norm.ONSET:
            change += error + float(np.interp(value, time[1:], np.diff(time)))  # plus a step, as onsets are times of samples
            continue
        size = error / float(time[-1]) if norm is Norm.IMPULSE else error
        # no constant for `peak`, which finds the n-th contact by the signal's zeros between contacts
        shapes = [np.sign(x)] if function == "peak" else [np.sign(x), np.ones(len(x))]
        changed = [value_of(call, time, {**signals, short: x + side * size * shape}) for shape in shapes for side in (1, -1)]
        change += float(np.max(np.abs(np.subtract(changed, value))))
    return change


def _sampling_error(call: ast.Call, function: str, result: Result, signals: Mapping[str, Array]) -> float:
    """Estimate the half-width of the 95 % interval of a reading by batch means."""
    from scipy.stats import t  # slow to load

    edges = find_batch_edges(result)
    if function not in POWERS or len(edges) <= LEAST_BATCHES:
        return nan
    values = []
    for begin, end in pairwise(edges):
        part = slice(int(np.searchsorted(result.time, begin)), int(np.searchsorted(result.time, end, side="right")))
        if part.stop - part.start > 1:
            values.append(float(value_of(call, result.time[part], {name: x[part] for name, x in signals.items()})))
    n = len(values)
    if n < LEAST_BATCHES:
        return nan
    quantile = t.ppf(0.5 + CONFIDENCE / 2, n - 1)  # the 97.5 % quantile
    return float(quantile * np.std(values, ddof=1) * n ** POWERS[function])


def find_batch_edges(result: Result) -> Array:
    """Return the edges of batches [s]: of whole revolutions of the drive or, in a run of few revolutions, of equal parts."""
    end, period = float(result.time[-1]), result.error.drive_period  # 0 if nothing revolves
    if not period > 0 or end < LEAST_BATCHES * period:
        return np.linspace(0.0, end, BATCHES + 1)
    revolutions = max(1, round(end / period / BATCHES))
    return np.arange(0.0, end * (1 + 1e-9), revolutions * period)


class CheckedReading(NamedTuple):
    """Reading for report pages: `name` is its formula, `signals` are those in it, `error` is nan if it is not known.

    It is `beyond` the accuracy if its error is larger than requested, or not known in a run with an error estimate.
    """

    name: str
    value: float
    unit: str
    error: float
    beyond: bool
    signals: tuple[str, ...]
    relative: float  # error over the value; nan if it is not known or not below 1


def list_readings(result: Result, texts: Sequence[str] = ()) -> list[CheckedReading]:
    """List the readings of formulas, by default of `peaks`; none of a run that failed.

    A run that a time limit or the user ended is not read at given times, which may lie after its end.
    """
    is_cut_short = result.status in (Status.TIMED_OUT, Status.INTERRUPTED) and len(result.time) > 1
    readable = [text for text in texts or peaks(result) if not (is_cut_short and re.search(r"\bat\(", text))]
    return [_check_reading(result, text) for text in readable] if is_cut_short or result.status.finished else []


def _check_reading(result: Result, text: str) -> CheckedReading:
    """Read a formula, and compare its relative error with the accuracy requested or, without one, with `USUAL_ERROR`, 5 %.

    The error is relative to the value or, if it exceeds the value, to the largest value of signals of the same unit.
    """
    value, error, unit, _kind = result.reading(text)
    _tree, names = parse_reading(text, result.signals)
    signals = tuple(names.values())
    of_unit = [name for name in signals if result.units.get(name) == unit]
    largest = max([abs(value), *(float(np.abs(result.signals[name]).max(initial=0.0)) for name in of_unit)])
    relative, relative_to = (error / abs(value), abs(value)) if error < abs(value) else (nan, largest)
    accuracy = result.asked if result.asked > 0 else USUAL_ERROR
    beyond = result.error.known and not error <= accuracy * relative_to  # true also for nan
    return CheckedReading(text, value, unit, error if isfinite(error) else nan, beyond, signals, relative)


def peaks(result: Result) -> list[str]:
    """List peaks of forces, torques and deflections; of running means (signals `.mean`) where vibrations are not resolved."""
    names = [name for name in result.signals if name.rpartition(".")[2] in PEAKS]
    return [f"max(abs({name}{'.mean' if name in result.error.unresolved else ''}))" for name in names]
