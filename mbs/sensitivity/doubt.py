"""First-order propagation of the errors of signals to a reading."""

from __future__ import annotations

import ast
from math import nan

import numpy as np

from ..geometry import Array
from ..record.errors import Key, Norm
from ..record.result import Result
from .curve import Smooth
from .reading import ARGUMENTS, parse_reading, value_of

NORMS = {"impulse": Norm.IMPULSE, "mean": Norm.RMS, "rms": Norm.RMS, "begins": Norm.ONSET, "ends": Norm.ONSET}
"""Norm of a signal's error that bounds a reading; PEAK bounds the others."""
APART = ("begins", "ends", "peak")
"""Readings of single contacts: an error of the force counts only while there is contact, as the force is zero between."""


def bound_error(text: str, result: Result) -> float:
    """Bound the error of a reading, in its unit; nan where the error of a signal is not known to the end of the run.

    Parameters
    ----------
    text : str
        Formula as in `measure`.
    result : Result
        Result of the run, whose errors of signals are propagated to each reading in the formula. The difference of linear and
        cubic interpolation is added.
    """
    tree, names = parse_reading(text, result.signals)
    signals = {short: result.signals[name] for short, name in names.items()}
    known = {(short, norm): _off(result, name, norm) for short, name in names.items() for norm in Norm}
    with np.errstate(all="ignore"):
        exact = value_of(tree, result.time, signals)
        total = abs(exact - value_of(tree, result.time, signals, Smooth))  # error of interpolation
        for leaf in ast.walk(tree):
            if isinstance(leaf, ast.Call) and isinstance(leaf.func, ast.Name) and leaf.func.id in ARGUMENTS:
                value, off = _reading(leaf, leaf.func.id, result.time, signals, known)
                ways = [value_of(tree, result.time, signals, given={leaf: value + d}) for d in (off, -off)]
                total += float(np.max(np.abs(np.subtract(ways, exact))))
    return float(total)


def _off(result: Result, name: str, norm: Norm) -> float:
    """Return the error of a signal in its unit; nan where it does not hold to the end of the run."""
    whole = result.error.until >= result.time[-1] * (1 - 1e-9)
    return result.error.absolute(name, norm) if whole else nan


def _reading(
    leaf: ast.Call, reading: str, time: Array, signals: dict[str, Array], known: dict[Key, float]
) -> tuple[float, float]:
    """Return a reading and a bound of its change by the errors of its signals."""
    value, change, norm = value_of(leaf, time, signals), 0.0, NORMS.get(reading, Norm.PEAK)
    for short in {node.id for node in ast.walk(leaf.args[0]) if isinstance(node, ast.Name) and node.id in signals}:
        x, off = signals[short], known[short, norm]
        if norm is Norm.ONSET:
            change += off + float(np.interp(value, time[1:], np.diff(time)))  # it is a sample
            continue
        off = off / float(time[-1]) if norm is Norm.IMPULSE else off
        ways = (np.sign(x),) if reading in APART else (np.sign(x), np.ones(len(x)))
        others = [value_of(leaf, time, {**signals, short: x + side * off * way}) for way in ways for side in (1, -1)]
        change += float(np.max(np.abs(np.subtract(others, value))))
    return value, change
