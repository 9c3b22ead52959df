"""Readings of an ensemble: formulas of statistics of signals in a window of time.

max min mean rms end         of a signal in the window; mean and rms are weighted by time;
impulse(signal)              integral over the window;
share(signal)                share of the window in which it is above zero;
onsets(signal)               number of times that it rises above zero: the impacts of a contact force;
variation(signal)            total variation: sum of the magnitudes of its changes, between 2000 equal parts of the window;
+ - * / ** abs sqrt sin cos  of statistics and of numbers; of signals within a statistic, as max(abs(rocker.ax)).
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..functions.formulas import CONSTANTS, parse
from ..geometry import Array
from ..sensitivity.reading import OF_VALUES, OPERATORS, TOKEN
from ..spectral.statistics import Accumulator, Statistic

Reduction = Callable[[Array, Array], Array]
STATISTICS: dict[str, Reduction] = {
    "max": lambda of, _: of[..., Statistic.LARGEST],
    "min": lambda of, _: of[..., Statistic.SMALLEST],
    "mean": lambda of, length: of[..., Statistic.INTEGRAL] / length,
    "rms": lambda of, length: np.sqrt(of[..., Statistic.SQUARES] / length),
    "end": lambda of, _: of[..., Statistic.LAST],
    "impulse": lambda of, _: of[..., Statistic.INTEGRAL],
    "share": lambda of, length: of[..., Statistic.ABOVE] / length,
    "onsets": lambda of, _: of[..., Statistic.ONSETS],
    "variation": lambda of, _: of[..., Statistic.VARIATION],
}
"""Statistics by name, as functions of the accumulated sums of windows and their lengths [s]."""
ALLOWED: dict[str, tuple[Any, int]] = {name: (None, 1) for name in (*STATISTICS, *OF_VALUES)}


@dataclass(frozen=True)
class Formula:
    """Formula of signals within a statistic."""

    text: str  # the same for equal formulas
    tree: ast.expr

    def values(self, signals: Mapping[str, Array]) -> Array:
        """Compute the formula at the rows of a run from the signals' values, shape (times,)."""
        return np.asarray(_value(self.tree, lambda name: signals[name], lambda name, of: OF_VALUES[name](of)))


@dataclass(frozen=True)
class StatisticReading:
    """Formula of statistics."""

    text: str
    tree: ast.expr  # with signals as names

    @classmethod
    def of(cls, text: str) -> StatisticReading:
        """Parse a formula; a ValueError if it is not valid, or has a signal outside of a statistic."""
        keys = {name: f"_{k}" for k, name in enumerate(dict.fromkeys(TOKEN.findall(text)))}
        names = {key: name for name, key in keys.items()}
        short = TOKEN.sub(lambda match: keys[match[0]], text)
        try:
            tree = parse(short, names, ALLOWED)
            for node in ast.walk(tree):
                if isinstance(node, ast.Name):
                    node.id = names.get(node.id, node.id)
            _check(tree)
        except ValueError as error:
            message = str(error)
            for key, name in names.items():
                message = message.replace(key, name)
            raise ValueError(f"{text}: {message}; statistics are {', '.join(STATISTICS)}, as rms(B.normal_force)") from None
        return cls(text, tree)

    @cached_property
    def formulas(self) -> tuple[Formula, ...]:
        """Formulas of signals within the statistics."""
        return tuple(Formula(ast.unparse(call.args[0]), call.args[0]) for call in _statistics(self.tree))

    @cached_property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals."""
        return tuple(dict.fromkeys(_signals(self.tree)))

    def value(self, sums: Array, order: Sequence[str], lengths: Array) -> Array:
        """Compute values in windows of some lengths [s] from their accumulated sums, (windows, formulas in order, 8)."""

        def statistic(name: str, of: Any) -> Any:
            """Compute a statistic of the sums of a formula, by its number, or a function of values."""
            return STATISTICS[name](sums[..., of, :], lengths) if name in STATISTICS else OF_VALUES[name](of)

        def at(node: ast.expr) -> Any:
            """Replace a formula by its number in the order."""
            return ast.Constant(order.index(ast.unparse(node)))

        with np.errstate(all="ignore"):
            return np.broadcast_to(np.asarray(_value(self.tree, str, statistic, at), dtype=float), sums.shape[:-2])


def formulas_of(readings: Iterable[StatisticReading]) -> dict[str, Formula]:
    """Return the formulas of signals in some readings, by their texts."""
    return {each.text: each for reading in readings for each in reading.formulas}


def columns(formulas: Mapping[str, Formula], signals: Mapping[str, Array]) -> Array:
    """Compute the formulas' values at the rows of a run, shape (times, formulas)."""
    return np.column_stack([each.values(signals) for each in formulas.values()])


def values_of(readings: Sequence[StatisticReading], formulas: Mapping[str, Formula], found: Accumulator) -> Array:
    """Compute readings from accumulated sums, shape (windows, readings)."""
    return np.stack([each.value(found.found, list(formulas), np.diff(found.edges)) for each in readings], axis=-1)


def read_windows(of: Iterable[str], time: Array, signals: Mapping[str, Array], edges: Array) -> Array:
    """Compute readings of recorded signals in the windows between edges [s], shape (windows, readings)."""
    readings = [StatisticReading.of(text) for text in of]
    formulas = formulas_of(readings)
    found = Accumulator.over(np.asarray(edges, dtype=float), len(formulas))
    found.add(time, columns(formulas, signals))
    return values_of(readings, formulas, found)


def _value(node: ast.expr, signal: Callable[[str], Any], call: Callable[[str, Any], Any], inner: Any = None) -> Any:
    """Evaluate a formula; `inner` replaces the arguments of statistics first."""

    def at(node: ast.expr) -> Any:
        """Return the value of a node of the syntax tree."""
        match node:
            case ast.Constant(value=value):
                return value
            case ast.Name(id=name):
                return CONSTANTS[name] if name in CONSTANTS else signal(name)
            case ast.UnaryOp(op=sign, operand=operand):
                return -at(operand) if isinstance(sign, ast.USub) else at(operand)
            case ast.BinOp(op=operator, left=left, right=right):
                return OPERATORS[type(operator)](at(left), at(right))
            case ast.Call(func=ast.Name(id=name), args=[argument]):
                return call(name, at(inner(argument) if inner and name in STATISTICS else argument))
        raise AssertionError(node)  # `StatisticReading.of` lets nothing else through

    return at(node)


def _statistics(node: ast.AST) -> Iterator[ast.Call]:
    """Yield the statistics in a formula."""
    found = (call for call in ast.walk(node) if isinstance(call, ast.Call) and isinstance(call.func, ast.Name))
    return (call for call in found if isinstance(call.func, ast.Name) and call.func.id in STATISTICS)


def _signals(node: ast.AST) -> Iterator[str]:
    """Yield the names of signals in a formula."""
    return (name.id for name in ast.walk(node) if isinstance(name, ast.Name) and name.id not in {*CONSTANTS, *ALLOWED})


def _check(tree: ast.expr) -> None:
    """Raise a ValueError for a signal outside of a statistic, and for a statistic within another or without a signal."""
    for call in _statistics(tree):
        name, (argument,) = call.func.id, call.args  # type: ignore[attr-defined]
        if not any(_signals(argument)) or any(_statistics(argument)):
            raise ValueError(f"{name} takes a signal, or a formula of signals")
    inside = [name for call in _statistics(tree) for name in _signals(call)]
    for name in _signals(tree):
        if name not in inside:
            raise ValueError(f"{name} stands by itself")
        inside.remove(name)
