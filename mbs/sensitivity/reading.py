"""Numbers read off a result: `max(B.contact_force)`, `mean(abs(drive.torque))`, `at(B.x, 0.5) - start(B.x)`.

    max min mean rms start end      of a signal over the run; mean and rms are over time;
    impulse(signal)                 integral of the signal over the run;
    settled(signal)                 mean of the signal over the last tenth of the run;
    at(signal, t)                   value of the signal at a time [s];
    when(signal, value, n)          time [s] at which the signal crosses a value for the n-th time, n = 1, 2, ...; else nan;
    begins(signal, n), ends(signal, n)  times [s] between which the signal is above zero for the n-th time, such as a contact
                                    force in the n-th contact; n = -1 is the last; nan if there is none;
    peak(signal, n)                 largest value of the signal between these times;
    abs sqrt sin cos + - * / **     of signals and of numbers;
    frequency(n)                    n-th natural frequency about the state of rest under the loads [Hz]; needs no run.

Signals have their names in the result.
"""

import ast
import re
from collections.abc import Callable, Mapping
from math import nan
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..functions.formulas import CONSTANTS, parse
from ..geometry import Array
from ..mechanism import Mechanism
from ..record.lookup import unknown
from .curve import Curve

POINTWISE: dict[str, Callable[[Any], Any]] = {"abs": np.abs, "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos}
"""Functions of signals at each time, and of numbers."""
ALLOWED: dict[str, tuple[str | None, int]] = {
    **dict.fromkeys(("max", "min", "mean", "rms", "start", "end", "impulse", "settled", *POINTWISE), (None, 1)),
    "at": ("at(signal, time)", 2),
    "when": ("when(signal, value, n), n = 1 for the first time", 3),
    "begins": ("begins(signal, n), n = 1 for the first contact", 2),
    "ends": ("ends(signal, n), n = 1 for the first contact", 2),
    "peak": ("peak(signal, n), n = 1 for the first contact; of the whole run max(signal)", 2),
}
"""Functions that the parser accepts: usage for messages, with several arguments, and number of arguments."""
OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.power,
}  # fmt: skip
TOKEN = re.compile(r"[^\W\d]\w*(?:[.\-]\w+)*\.\w+")
"""Pattern of the name of a signal in a formula, such as `crank-2.B.x`."""


class RunFailedError(RuntimeError):
    """Error of a run for a derivative, a fit or a design."""


FAILURES = (RunFailedError, ArithmeticError, ValueError)
"""Errors of a run, or of numbers with which no mechanism can be made. A WrongReadingError, also a ValueError, is no failure:
where it can arise, it is caught and raised again first."""


class WrongReadingError(ValueError):
    """Error of a reading that is wrong for every run: the signal does not exist, or a unit is of another kind."""


class ValueWithUnit(NamedTuple):
    """Number and its unit, '' if the formula mixes units."""

    value: float
    unit: str


def read_number(
    text: str, time: Array, signals: Mapping[str, Array], units: Mapping[str, str], curve: type[Curve] = Curve
) -> ValueWithUnit:
    """Read a number off the signals of a run; `curve` interpolates between samples.

    A ValueError says that the text is no formula, names a signal that does not exist, or has a series as its value.
    """
    tree, names = parse_reading(text, signals)
    with np.errstate(all="ignore"):
        value = value_of(tree, time, {short: signals[name] for short, name in names.items()}, curve)
    if np.ndim(value):
        raise ValueError(f"{text}: gives a series; write max({text}), mean({text}) or end({text})")
    return ValueWithUnit(float(value), unit_of_formula(tree, {short: units.get(name, "") for short, name in names.items()}))


def parse_frequency(text: str) -> int:
    """Return the number n of a text `frequency(n)`; 0 for other texts."""
    match = re.fullmatch(r"\s*frequency\(\s*([1-9]\d*)\s*\)\s*", text)
    return int(match[1]) if match else 0


def compute_frequency(mechanism: Mechanism, number: int) -> tuple[float, float]:
    """Compute a natural frequency [Hz] and its error; raise a RunFailedError if the state of rest is not stable."""
    from ..statics.vibration import frequencies  # loads the compiled solver

    answer = frequencies(mechanism, count=number)
    if not answer.stable:
        raise RunFailedError(f"frequency({number}): {answer.status}: {answer.message}")
    if len(answer.hertz) < number:
        return nan, 0.0
    return float(answer.hertz[number - 1]), float(answer.errors[number - 1])


def check_reading(text: str, signals: Mapping[str, object] | None = None) -> None:
    """Raise a ValueError if a text is no reading; without `signals` it may name any."""
    if parse_frequency(text):
        return
    names = TOKEN.findall(text) if signals is None else list(signals)
    # read off an invented run of two samples, in which all signals are 1
    read_number(text, np.array([0.0, 1.0]), dict.fromkeys(names, np.ones(2)), {})


def parse_reading(
    text: str, signals: Mapping[str, object], allowed: Mapping[str, tuple[str | None, int]] = ALLOWED
) -> tuple[ast.expr, dict[str, str]]:
    """Parse a formula; return its syntax tree, with names _0, _1, ... of signals, and the signals by these names."""
    names: dict[str, str] = {}
    short = {name: f"_{k}" for k, name in enumerate(signals)}
    shortened = text
    if signals:
        longest_first = sorted(map(re.escape, signals), key=len, reverse=True)
        pattern = rf"(?<![\w.])(?:{'|'.join(longest_first)})(?![\w.])"
        names = {short[name]: name for name in re.findall(pattern, text)}
        shortened = re.sub(pattern, lambda match: short[match[0]], text)
    if not_replaced := TOKEN.search(shortened):
        raise WrongReadingError(f"{text}: {unknown(not_replaced[0], list(signals))}")
    if "frequency" in shortened:  # names of signals are replaced in it
        raise ValueError(f"{text}: a frequency stands alone, as frequency(1), the first")
    try:
        tree = parse(shortened, names, allowed)
    except ValueError as error:
        message = re.sub(r"(?<!\w)_\d+", lambda match: names.get(match[0], match[0]), str(error))
        raise ValueError(f"{text}: {message}") from None
    counted = ("when", "begins", "ends", "peak")  # functions whose last argument is an ordinal number
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in counted:
            name, count = call.func.id, ast.unparse(call.args[-1])
            if not re.fullmatch(r"\+?[1-9]\d*" if name == "when" else r"[+-]?[1-9]\d*", count):
                last = "" if name == "when" else ", -1 the last"
                raise ValueError(f"{text}: {name} counts 1, 2, ...{last}; not {count}")
    return tree, names


def value_of(
    tree: ast.expr, time: Array, signals: Mapping[str, Array], curve: type[Curve] = Curve,
    given: Mapping[ast.expr, float | Array] = MappingProxyType({}),
) -> Any:  # fmt: skip
    """Evaluate a formula of signals by its syntax tree; `given` are known values of some nodes, such as statistics of a run."""

    def evaluate(node: ast.expr) -> Any:
        """Evaluate a node of the tree: a number or values at all times."""
        if node in given:
            return given[node]
        match node:
            case ast.Constant(value=value):
                return value
            case ast.Name(id=name):
                return signals[name] if name in signals else CONSTANTS[name]
            case ast.UnaryOp(op=sign, operand=operand):
                return -evaluate(operand) if isinstance(sign, ast.USub) else evaluate(operand)
            case ast.BinOp(op=operator, left=left, right=right):
                return OPERATORS[type(operator)](evaluate(left), evaluate(right))
            case ast.Call(func=ast.Name(id=name), args=arguments):
                series, *rest = map(evaluate, arguments)
                if name in POINTWISE:
                    return POINTWISE[name](series)
                return getattr(curve(time, np.broadcast_to(series, time.shape)), name)(*rest)
        raise AssertionError(node)  # `parse` accepts no other node

    return evaluate(tree)


def unit_of_formula(node: ast.expr, units: Mapping[str, str]) -> str:
    """Return the unit of a formula's value; '' if the formula mixes units or makes a new one, except a signal's impulse."""
    match node:
        case ast.Name(id=name) if name in units:
            return units[name]
        case ast.Constant() | ast.Name():
            return "1"
        case ast.UnaryOp(operand=operand):
            return unit_of_formula(operand, units)
        case ast.BinOp(op=operator, left=left, right=right):
            a, b = unit_of_formula(left, units), unit_of_formula(right, units)
            if isinstance(operator, ast.Add | ast.Sub):
                return a if a == b else ""
            if isinstance(operator, ast.Pow):
                return "1" if a == "1" else ""
            if b == "1":
                return a
            if isinstance(operator, ast.Mult):
                return b if a == "1" else ""
            return "1" if a == b != "" else ""  # of a quotient
        case ast.Call(func=ast.Name(id="when" | "begins" | "ends")):
            return "s"
        case ast.Call(func=ast.Name(id="sin" | "cos" | "share" | "onsets")):
            return "1"
        case ast.Call(func=ast.Name(id=name), args=arguments):
            inner = unit_of_formula(arguments[0], units)
            if name == "impulse":
                return "s" if inner == "1" else f"{inner} s" if inner else ""
            return inner if name != "sqrt" or inner == "1" else ""
    return ""
