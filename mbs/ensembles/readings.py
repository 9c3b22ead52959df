"""Readings of an ensemble: formulas of statistics of signals in a window of time.

max min mean rms end         of a signal in the window; mean and rms are weighted by time;
impulse(signal)              integral over the window;
share(signal)                share of the window in which it is above zero;
onsets(signal)               number of times that it rises above zero: the impacts of a contact force;
variation(signal)            total variation: sum of the magnitudes of its changes over 2000 equal parts of the window;
+ - * / ** abs sqrt sin cos  of statistics and of numbers; of signals within a statistic, as max(abs(rocker.ax)).
"""

import ast
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from ..functions.formulas import CONSTANTS
from ..geometry import Array
from ..sensitivity.reading import POINTWISE, TOKEN, parse_reading, unit_of_formula, value_of
from ..spectral.statistics import Accumulator, Statistic, add_rows

NO_TIMES = np.empty(0)
"""Empty array of times: `value_of` uses times only in functions over a whole run, which it never evaluates for ensembles."""
Reduction = Callable[[Array, Array], Array]
"""Function from accumulated sums (windows, kinds of sum) and lengths of windows [s] to a statistic, (windows,)."""
STATISTICS: dict[str, Reduction] = {
    "max": lambda sums, _: sums[..., Statistic.LARGEST],
    "min": lambda sums, _: sums[..., Statistic.SMALLEST],
    "mean": lambda sums, length: sums[..., Statistic.INTEGRAL] / length,
    "rms": lambda sums, length: np.sqrt(sums[..., Statistic.SQUARES] / length),
    "end": lambda sums, _: sums[..., Statistic.LAST],
    "impulse": lambda sums, _: sums[..., Statistic.INTEGRAL],
    "share": lambda sums, length: sums[..., Statistic.ABOVE] / length,
    "onsets": lambda sums, _: sums[..., Statistic.ONSETS],
    "variation": lambda sums, _: sums[..., Statistic.VARIATION],
}
"""Statistics by name."""
ALLOWED: dict[str, tuple[Any, int]] = dict.fromkeys((*STATISTICS, *POINTWISE), (None, 1))
"""Functions that the parser accepts, by name: a pair of usage in messages (None: without usage) and number of arguments (1)."""


@dataclass(frozen=True)
class StatisticReading:
    """Reading: a formula of statistics, as a syntax tree whose names are those of signals, though these have dots."""

    text: str
    tree: ast.expr

    @classmethod
    def of(cls, text: str) -> Self:
        """Parse a formula; raise a ValueError if it is not valid, or has a signal outside of a statistic."""
        try:
            names_with_dots = dict.fromkeys(TOKEN.findall(text))  # taken for signals: no run tells its signals yet
            tree, signals = parse_reading(text, names_with_dots, ALLOWED)
            for node in ast.walk(tree):
                if isinstance(node, ast.Name):  # _0, _1, ... stand for signals
                    node.id = signals.get(node.id, node.id)
            _check(tree)
        except ValueError as error:
            message = str(error).removeprefix(f"{text}: ")
            raise ValueError(f"{text}: {message}; statistics are {', '.join(STATISTICS)}, as rms(B.normal_force)") from None
        return cls(text, tree)

    @cached_property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals."""
        return tuple(dict.fromkeys(_signals(self.tree)))

    def unit(self, units: Mapping[str, str]) -> str:
        """Return the unit of the reading from those of signals; '' if it is not known."""
        known = all(name in units for name in self.signals)  # the user's curves, functions given as signals, have no unit
        return unit_of_formula(self.tree, units) if known else ""

    def value(self, sums: Array, order: Sequence[str], lengths: Array) -> Array:
        """Compute the reading in windows of `lengths` [s] from `sums` (windows, formulas in `order`, kinds of sum)."""
        with np.errstate(all="ignore"):  # nan is the value of a formula such as 0/0
            statistics: dict[ast.expr, Array] = {}
            for call in _statistics(self.tree):
                sums_of_formula = sums[..., order.index(ast.unparse(call.args[0])), :]
                statistics[call] = STATISTICS[ast.unparse(call.func)](sums_of_formula, lengths)
            value = value_of(self.tree, NO_TIMES, {}, given=statistics)  # no signals: all of them stand in statistics
        return np.broadcast_to(np.asarray(value, dtype=float), sums.shape[:-2])


def formulas_of(readings: Iterable[StatisticReading]) -> dict[str, ast.expr]:
    """Return the arguments of statistics in readings, as syntax trees by text; equal formulas have one text."""
    arguments = [call.args[0] for reading in readings for call in _statistics(reading.tree)]
    return {ast.unparse(argument): argument for argument in arguments}


def columns(formulas: Mapping[str, ast.expr], signals: Mapping[str, Array]) -> Array:
    """Compute formulas of signals at the rows of a run, shape (times, formulas)."""
    return np.column_stack([value_of(tree, NO_TIMES, signals) for tree in formulas.values()])


def values_of(readings: Sequence[StatisticReading], formulas: Iterable[str], sums: Accumulator) -> Array:
    """Compute readings from accumulated sums, shape (windows, readings)."""
    order, lengths = list(formulas), np.diff(sums.edges)
    # `found` has the sums, (windows, formulas, kinds of sum)
    return np.stack([reading.value(sums.found, order, lengths) for reading in readings], axis=-1)


def read_windows(texts: Iterable[str], time: Array, signals: Mapping[str, Array], edges: Array) -> Array:
    """Compute readings of recorded signals in the windows between edges [s], shape (windows, readings)."""
    readings = [StatisticReading.of(text) for text in texts]
    formulas = formulas_of(readings)
    sums = Accumulator.over(np.asarray(edges, dtype=float), len(formulas))
    add_rows(time, columns(formulas, signals), sums)
    return values_of(readings, formulas, sums)


def _statistics(node: ast.AST) -> Iterator[ast.Call]:
    calls = (call for call in ast.walk(node) if isinstance(call, ast.Call))
    return (call for call in calls if isinstance(call.func, ast.Name) and call.func.id in STATISTICS)


def _signals(node: ast.AST) -> Iterator[str]:
    return (name.id for name in ast.walk(node) if isinstance(name, ast.Name) and name.id not in {*CONSTANTS, *ALLOWED})


def _check(tree: ast.expr) -> None:
    """Raise a ValueError for a signal outside of a statistic, and for a statistic within another or without a signal."""
    for call in _statistics(tree):
        name, (argument,) = call.func.id, call.args  # type: ignore[attr-defined]
        if any(_statistics(argument)) or not any(_signals(argument)):
            raise ValueError(f"{name} takes a signal, or a formula of signals")
    within_statistics = Counter(name for call in _statistics(tree) for name in _signals(call))
    for name in Counter(_signals(tree)) - within_statistics:  # signals that stand more often in the whole formula
        raise ValueError(f"{name} stands by itself")
