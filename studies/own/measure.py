"""Numbers read off a result: `max(B.contact_force)`, `mean(abs(drive.torque))`, `at(B.x, 0.5) - start(B.x)`.

    max min mean rms start end      of a signal over the run; mean and rms are weighted by time
    at(signal, t)                   its value at a time, s
    abs sqrt sin cos + - * / **     of signals and of numbers

Signals are those of the result, by their names.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.expressions import CONSTANTS, parse

Array = np.ndarray[Any, Any]
KEEPS_UNIT = {"max", "min", "mean", "rms", "start", "end", "at", "abs"}
OF_RUN: dict[str, Callable[[Array, Array], float]] = {
    "max": lambda _t, x: float(np.max(x)),
    "min": lambda _t, x: float(np.min(x)),
    "mean": lambda t, x: _mean(t, x),
    "rms": lambda t, x: _mean(t, x**2) ** 0.5,
    "start": lambda _t, x: float(x[0]),
    "end": lambda _t, x: float(x[-1]),
}
OF_VALUES: dict[str, Callable[[Any], Any]] = {"abs": np.abs, "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos}
ALLOWED = {**dict.fromkeys([*OF_RUN, *OF_VALUES], (None, 1)), "at": (None, 2)}
OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.power,
}  # fmt: skip
TOKEN = re.compile(r"[^\W\d]\w*(?:[.\-]\w+)*\.\w+")
"""What looks like a signal's name in a formula, where the names are not known."""


class Measured(NamedTuple):
    """A number and its unit; '' where the formula mixes units."""

    value: float
    unit: str


def measure(text: str, time: Array, signals: Mapping[str, Array], units: Mapping[str, str]) -> Measured:
    """Read a number off the signals of a run.

    Raises
    ------
    ValueError
        If the text is no formula, names a signal that is not there, or gives a series.
    """
    tree, names = _tree(text, signals)
    with np.errstate(all="ignore"):
        value = _value(tree, time, {short: signals[name] for short, name in names.items()})
    if np.ndim(value):
        raise ValueError(f"--measure {text}: gives a series; write max({text}), mean({text}) or end({text})")
    return Measured(float(value), _unit(tree, {short: units.get(name, "") for short, name in names.items()}))


def check(text: str, signals: Mapping[str, Any] | None = None) -> None:
    """Refuse what is no measure; without signals by its grammar only."""
    found = TOKEN.findall(text) if signals is None else list(signals)
    time = np.array([0.0, 1.0])
    measure(text, time, dict.fromkeys(found, np.ones(2)), {})


def _tree(text: str, signals: Mapping[str, Any]) -> tuple[ast.expr, dict[str, str]]:
    """The formula with short names in place of the signals', and what these stand for."""
    names: dict[str, str] = {}
    short = {name: f"_{k}" for k, name in enumerate(signals)}

    def replace(match: re.Match[str]) -> str:
        names[short[match[0]]] = match[0]
        return short[match[0]]

    left = text
    if signals:
        longest = sorted(map(re.escape, signals), key=len, reverse=True)
        left = re.sub(rf"(?<![\w.])(?:{'|'.join(longest)})(?![\w.])", replace, text)
    for name in TOKEN.findall(left):
        close = get_close_matches(name, list(signals), n=1)
        hint = f"did you mean {close[0]}?" if close else f"there are: {', '.join(signals)}"
        raise ValueError(f"--measure {text}: no signal '{name}'; {hint}")
    try:
        return parse(left, names, ALLOWED), names
    except ValueError as error:
        raise ValueError(f"--measure {text}: {error}") from None


def _value(node: ast.expr, time: Array, signals: Mapping[str, Array]) -> Any:
    match node:
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name):
            return signals[name] if name in signals else CONSTANTS[name]
        case ast.UnaryOp(op=sign, operand=operand):
            inner = _value(operand, time, signals)
            return -inner if isinstance(sign, ast.USub) else inner
        case ast.BinOp(op=operator, left=left, right=right):
            return OPERATORS[type(operator)](_value(left, time, signals), _value(right, time, signals))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            values = [_value(argument, time, signals) for argument in arguments]
            if name in OF_VALUES:
                return OF_VALUES[name](values[0])
            series = np.broadcast_to(values[0], time.shape)
            return float(np.interp(values[1], time, series)) if name == "at" else OF_RUN[name](time, series)
    raise AssertionError(node)  # parse lets nothing else through


def _unit(node: ast.expr, units: Mapping[str, str]) -> str:
    """The unit of sums, peaks and means of one kind of signal, or of its multiples; '' otherwise."""
    match node:
        case ast.Name(id=name) if name in units:
            return units[name]
        case ast.Constant() | ast.Name():
            return "1"
        case ast.UnaryOp(operand=operand):
            return _unit(operand, units)
        case ast.BinOp(op=operator, left=left, right=right):
            a, b = _unit(left, units), _unit(right, units)
            if isinstance(operator, ast.Add | ast.Sub):
                return a if a == b else ""
            if isinstance(operator, ast.Mult | ast.Div):
                return _product(operator, a, b)
            return "1" if a == "1" else ""
        case ast.Call(func=ast.Name(id=name), args=arguments):
            inner = _unit(arguments[0], units)
            return inner if name in KEEPS_UNIT or inner == "1" else "1" if name in ("sin", "cos") else ""
    return ""


def _product(operator: ast.operator, a: str, b: str) -> str:
    """The unit of a product or quotient, where one of them is a plain number or both cancel."""
    if b == "1":
        return a
    if isinstance(operator, ast.Mult):
        return b if a == "1" else ""
    return "1" if a == b != "" else ""


def _mean(time: Array, x: Array) -> float:
    span = time[-1] - time[0]
    return float(np.trapezoid(x, time) / span) if span > 0 else float(x[-1])
