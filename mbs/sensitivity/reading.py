"""Numbers read off a result: `max(B.contact_force)`, `mean(abs(drive.torque))`, `at(B.x, 0.5) - start(B.x)`.

    max min mean rms start end      of a signal over the run; mean and rms are weighted by time
    impulse(signal)                 its integral over the run
    settled(signal)                 its mean over the last tenth of the run
    at(signal, t)                   its value at a time, s
    when(signal, value, n)          time, s, at which it crosses a value for the n-th time, n = 1, 2, ...; nan if it does not
    begins(signal, n), ends(signal, n)  times, s, between which it is above zero for the n-th time, as a contact force is while
                                    its contact lasts; -1 is the last time; nan if it is not
    peak(signal, n)                 its largest value between them
    abs sqrt sin cos + - * / **     of signals and of numbers
    frequency(n)                    n-th natural frequency about the state of rest under the loads, Hz; needs no run

Signals are those of the result, by their names.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from math import nan
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from buckler.mbs.expressions import CONSTANTS, parse
from buckler.mbs.geometry import Array
from buckler.mbs.mechanism import Mechanism

KEEPS_UNIT = {"max", "min", "mean", "rms", "start", "end", "at", "abs", "settled", "peak"}
SETTLED = 0.1
"""Share of the run, at its end, over which `settled` takes the mean."""
OF_VALUES: dict[str, Callable[[Any], Any]] = {"abs": np.abs, "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos}
ARGUMENTS = {
    **dict.fromkeys(("max", "min", "mean", "rms", "start", "end", "impulse", "settled"), 1), "at": 2, "when": 3,
    **dict.fromkeys(("begins", "ends", "peak"), 2),
}  # fmt: skip
ALLOWED = {name: (None, count) for name, count in {**ARGUMENTS, **dict.fromkeys(OF_VALUES, 1)}.items()}
OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.power,
}  # fmt: skip
NONE: Mapping[ast.expr, float] = {}
NEAR = 5
"""Samples from which a slope is taken."""
MOMENT = 1e-11
"""Of the run: samples nearer than that stand before and after a jump."""
TOKEN = re.compile(r"[^\W\d]\w*(?:[.\-]\w+)*\.\w+")
"""What looks like a signal's name in a formula, where the names are not known."""


class Measured(NamedTuple):
    """A number and its unit; '' where the formula mixes units."""

    value: float
    unit: str


def spells(x: Array) -> Array:
    """Where samples are above zero: first and one past the last of each time that they are, shape (times, 2)."""
    above = np.concatenate([[False], x > 0, [False]])
    return np.flatnonzero(above[1:] != above[:-1]).reshape(-1, 2)


@dataclass(frozen=True)
class Curve:
    """A signal over a run, straight between its samples: what can be read off it. Methods are the words of a formula.

    Attributes
    ----------
    time, x : array, shape (samples,)
    """

    time: Array
    x: Array

    def integral(self) -> float:
        """Over the run."""
        return float(np.trapezoid(self.x, self.time))

    def max(self) -> float:
        """Largest sample."""
        return float(np.max(self.x))

    def at(self, when: float) -> float:
        """Value at a time, s."""
        return float(np.interp(when, self.time, self.x))

    def when(self, value: float, count: float) -> float:
        """Time of the `count`-th crossing of a value, s; nan if there is none."""
        off = self.x - value
        found = np.flatnonzero((off[:-1] < 0) != (off[1:] < 0))
        if not 1 <= count <= len(found):
            return nan
        return self._root(int(found[int(count) - 1]), value)

    def begins(self, count: float) -> float:
        """Time, s, from which it is above zero for the `count`-th time."""
        found = self._spell(count)
        return nan if found is None else self._edge(found.start, 1)

    def ends(self, count: float) -> float:
        """Time, s, until which it is."""
        found = self._spell(count)
        return nan if found is None else self._edge(found.stop - 1, -1)

    def peak(self, count: float) -> float:
        """Largest value between them."""
        found = self._spell(count)
        return nan if found is None else type(self)(self.time[found], self.x[found]).max()

    def _spell(self, count: float) -> slice | None:
        """Samples above zero for the `count`-th time, from the last on for -1, -2, ..., with those beside them."""
        parts = spells(self.x)
        k = int(count) - 1 if count > 0 else len(parts) + int(count)
        if not 0 <= k < len(parts):
            return None
        return slice(max(0, int(parts[k, 0]) - 1), min(len(self.x), int(parts[k, 1]) + 1))

    def _edge(self, k: int, step: int) -> float:
        """Time of the sample outside, the first or the last one, beside those above zero."""
        return float(self.time[k])

    def _root(self, k: int, value: float) -> float:
        """Where the k-th piece has a value that lies between those of its ends."""
        part = (value - self.x[k]) / (self.x[k + 1] - self.x[k])
        return float(self.time[k] + part * (self.time[k + 1] - self.time[k]))

    def min(self) -> float:
        """Least value."""
        return -type(self)(self.time, -self.x).max()

    def impulse(self) -> float:
        """Integral over the run."""
        return self.integral()

    def mean(self) -> float:
        """Weighted by time."""
        span = float(self.time[-1] - self.time[0])
        return self.integral() / span if span > 0 else float(self.x[-1])

    def rms(self) -> float:
        """Root of the mean square."""
        return float(type(self)(self.time, self.x**2).mean() ** 0.5)

    def settled(self) -> float:
        """Mean over the last tenth of the run."""
        first = self.time[-1] - SETTLED * (self.time[-1] - self.time[0])
        late = self.time > first
        times = np.concatenate([[first], self.time[late]])
        return type(self)(times, np.concatenate([[self.at(float(first))], self.x[late]])).mean()

    def start(self) -> float:
        """First value."""
        return float(self.x[0])

    def end(self) -> float:
        """Last value."""
        return float(self.x[-1])


class Smooth(Curve):
    """The same, by cubics between the samples (`record.lookup`), so that what is read off varies smoothly with the samples."""

    @cached_property
    def slopes(self) -> Array:
        """At the samples, shape (samples,)."""
        return self._slopes(np.arange(len(self.time)))

    @cached_property
    def _pieces(self) -> Array:
        """First samples of the pieces between jumps, and the number of samples."""
        jumps = np.flatnonzero(np.diff(self.time) < MOMENT * self.time[-1]) + 1
        return np.array([0, *jumps, len(self.time)])

    def _slopes(self, k: Array) -> Array:
        """At some samples: of the polynomials through five of them, of the fourth order, or through all of a shorter piece."""
        piece = np.searchsorted(self._pieces, k, side="right") - 1
        first, last, found = self._pieces[piece], self._pieces[piece + 1], np.zeros(len(k))
        size = np.minimum(last - first, NEAR)
        for m in {*size.tolist()} - {1}:
            some = size == m
            near = np.clip(k[some] - m // 2, first[some], last[some] - m)[:, None] + np.arange(m)
            apart = self.time[near] - self.time[k[some], None]
            scale = np.abs(apart).max(axis=1)
            powers = (apart / scale[:, None])[:, :, None] ** np.arange(m)
            found[some] = np.linalg.solve(powers, self.x[near][:, :, None])[:, 1, 0] / scale
        return found

    def integral(self) -> float:
        """Of the cubics."""
        h = np.diff(self.time)
        return super().integral() + float(h**2 @ (self.slopes[:-1] - self.slopes[1:])) / 12

    def max(self) -> float:
        """Of the cubics beside the largest sample."""
        k = int(np.argmax(self.x))
        best = float(self.x[k])
        for i in (k - 1, k):
            if 0 <= i < len(self.x) - 1:
                cubic = self._cubic(i)
                turns = cubic.deriv().roots()
                inside = turns.real[(np.abs(turns.imag) < 1e-12) & (turns.real > 0) & (turns.real < 1)]
                best = max([best, *map(float, cubic(inside))])
        return best

    def at(self, when: float) -> float:
        """Value at a time, s."""
        k = int(np.clip(np.searchsorted(self.time, when, side="right") - 1, 0, len(self.time) - 2))
        return float(self._cubic(k)((when - self.time[k]) / (self.time[k + 1] - self.time[k])))

    def _root(self, k: int, value: float) -> float:
        from scipy.optimize import brentq  # it takes a while to load, and few need it

        cubic = self._cubic(k)
        part = brentq(lambda y: float(cubic(y)) - value, 0.0, 1.0, xtol=1e-15)
        return float(self.time[k] + part * (self.time[k + 1] - self.time[k]))

    def _edge(self, k: int, step: int) -> float:
        """Where the samples beside the one outside come down to zero; its time where an event, or the run's end, is there."""
        inside, cuts = [k + i * step for i in (1, 2, 3)], self._pieces[1:-1]
        for i in (k, k + step):
            if {i, i + 1} & {*cuts.tolist()}:
                return float(self.time[i])
        if self.x[k] > 0 or not 0 <= k + 3 * step < len(self.x) or not self.x[inside].all():
            return float(self.time[k])
        if self.x[k] < 0:
            return self._root(min(k, k + step), 0.0)
        part = (self.time[inside] - self.time[k]) / (self.time[inside[0]] - self.time[k])
        roots = np.roots(np.polyfit(part, self.x[inside], 2))
        near = roots.real[(np.abs(roots.imag) < 1e-12) & (roots.real >= 0) & (roots.real <= 1)]
        return float(self.time[k] + near.max(initial=0.0) * (self.time[inside[0]] - self.time[k]))

    def _cubic(self, k: int) -> Polynomial:
        """The k-th piece over its part, 0 to 1."""
        h, step = self.time[k + 1] - self.time[k], self.x[k + 1] - self.x[k]
        before, after = h * self._slopes(np.array([k, k + 1]))
        return Polynomial([self.x[k], before, 3 * step - 2 * before - after, before + after - 2 * step])


def measure(
    text: str, time: Array, signals: Mapping[str, Array], units: Mapping[str, str], curve: type[Curve] = Curve
) -> Measured:
    """Read a number off the signals of a run; `curve` says what lies between their samples.

    Raises
    ------
    ValueError
        If the text is no formula, names a signal that is not there, or gives a series.
    """
    tree, names = parsed(text, signals)
    with np.errstate(all="ignore"):
        value = value_of(tree, time, {short: signals[name] for short, name in names.items()}, curve)
    if np.ndim(value):
        raise ValueError(f"--measure {text}: gives a series; write max({text}), mean({text}) or end({text})")
    return Measured(float(value), _unit(tree, {short: units.get(name, "") for short, name in names.items()}))


def statical(text: str) -> Callable[[Mechanism], float] | None:
    """A reading of the state of rest, by the mechanism; None of other texts."""
    found = re.fullmatch(r"\s*frequency\(\s*([1-9]\d*)\s*\)\s*", text)
    if found is None:
        return None
    number = int(found[1])

    def frequency(mechanism: Mechanism) -> float:
        from buckler.mbs.statics import frequencies

        found = frequencies(mechanism, count=number).hertz
        return float(found[number - 1]) if len(found) >= number else nan

    return frequency


def check(text: str, signals: Mapping[str, Any] | None = None) -> None:
    """Refuse what is no measure; without signals by its grammar only."""
    if statical(text):
        return
    found = TOKEN.findall(text) if signals is None else list(signals)
    time = np.array([0.0, 1.0])
    measure(text, time, dict.fromkeys(found, np.ones(2)), {})


def parsed(text: str, signals: Mapping[str, Any]) -> tuple[ast.expr, dict[str, str]]:
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


def value_of(
    node: ast.expr, time: Array, signals: Mapping[str, Array], curve: type[Curve] = Curve, given: Mapping[ast.expr, float] = NONE
) -> Any:
    """A formula's value; parts of it may be given."""
    if node in given:
        return given[node]
    match node:
        case ast.Constant(value=value):
            return value
        case ast.Name(id=name):
            return signals[name] if name in signals else CONSTANTS[name]
        case ast.UnaryOp(op=sign, operand=operand):
            inner = value_of(operand, time, signals, curve, given)
            return -inner if isinstance(sign, ast.USub) else inner
        case ast.BinOp(op=operator, left=left, right=right):
            return OPERATORS[type(operator)](*(value_of(part, time, signals, curve, given) for part in (left, right)))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            series, *rest = (value_of(argument, time, signals, curve, given) for argument in arguments)
            if name in OF_VALUES:
                return OF_VALUES[name](series)
            return getattr(curve(time, np.broadcast_to(series, time.shape)), name)(*rest)
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
            if name in ("when", "begins", "ends"):
                return "s"
            if name == "impulse":
                return "s" if inner == "1" else f"{inner} s" if inner else ""
            return inner if name in KEEPS_UNIT or inner == "1" else "1" if name in ("sin", "cos") else ""
    return ""


def _product(operator: ast.operator, a: str, b: str) -> str:
    """The unit of a product or quotient, where one of them is a plain number or both cancel."""
    if b == "1":
        return a
    if isinstance(operator, ast.Mult):
        return b if a == "1" else ""
    return "1" if a == b != "" else ""
