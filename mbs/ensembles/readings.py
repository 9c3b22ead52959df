"""Readings of an ensemble: formulas of statistics of signals in a window of time.

max min mean rms end         of a signal in the window; mean and rms are weighted by time
impulse(signal)              its integral over the window
share(signal)                share of the window in which it is above zero
onsets(signal)               how often it rises above zero: the impacts of a contact force
+ - * / ** abs sqrt          of these and of numbers
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..functions.formulas import CONSTANTS, parse
from ..geometry import Array
from ..sensitivity.reading import OPERATORS, TOKEN
from ..spectral.statistics import ABOVE, LARGEST, LAST, ONSETS, SMALLEST, SQUARES, SUM

Statistic = Callable[[Array, float], Array]
STATISTICS: dict[str, Statistic] = {
    "max": lambda of, _: of[..., LARGEST],
    "min": lambda of, _: of[..., SMALLEST],
    "mean": lambda of, length: of[..., SUM] / length,
    "rms": lambda of, length: np.sqrt(of[..., SQUARES] / length),
    "end": lambda of, _: of[..., LAST],
    "impulse": lambda of, _: of[..., SUM],
    "share": lambda of, length: of[..., ABOVE] / length,
    "onsets": lambda of, _: of[..., ONSETS],
}
"""Statistics by name, of what a window of some length [s] accumulated."""
FUNCTIONS: dict[str, Callable[[Array], Array]] = {"abs": np.abs, "sqrt": np.sqrt}


@dataclass(frozen=True)
class Reading:
    """A formula of statistics.

    Attributes
    ----------
    text : str
    tree : ast.expr
        With short names in place of the signals'.
    signals : dict of str to str
        Signals by their short names.
    """

    text: str
    tree: ast.expr
    signals: Mapping[str, str]

    @classmethod
    def of(cls, text: str) -> Reading:
        """Read a formula.

        Raises
        ------
        ValueError
            If it is none, or takes a signal by itself, without a statistic.
        """
        keys = {name: f"_{k}" for k, name in enumerate(dict.fromkeys(TOKEN.findall(text)))}
        names = {key: name for name, key in keys.items()}
        short = TOKEN.sub(lambda match: keys[match[0]], text)
        allowed = {name: (None, 1) for name in (*STATISTICS, *FUNCTIONS)}
        try:
            tree = parse(short, names, allowed)  # type: ignore[arg-type]
            _check(tree, inside=False)
        except ValueError as error:
            said = str(error)
            for key, name in names.items():
                said = said.replace(key, name)
            raise ValueError(f"{text}: {said}; statistics are {', '.join(STATISTICS)}, as rms(B.normal_force)") from None
        return cls(text, tree, names)

    def value(self, found: Array, order: Sequence[str], length: float) -> Array:
        """Values in all windows.

        Parameters
        ----------
        found : array, shape (..., signals, 7)
            What windows of a length [s] accumulated of the signals in this order.
        """

        def at(node: ast.expr) -> Any:
            match node:
                case ast.Constant(value=value):
                    return value
                case ast.Name(id=name):
                    return CONSTANTS[name]
                case ast.UnaryOp(op=sign, operand=operand):
                    return -at(operand) if isinstance(sign, ast.USub) else at(operand)
                case ast.BinOp(op=operator, left=left, right=right):
                    return OPERATORS[type(operator)](at(left), at(right))
                case ast.Call(func=ast.Name(id=name), args=[ast.Name(id=signal)]) if name in STATISTICS:
                    return STATISTICS[name](found[..., order.index(self.signals[signal]), :], length)
                case ast.Call(func=ast.Name(id=name), args=[argument]):
                    return FUNCTIONS[name](at(argument))
            raise AssertionError(node)  # `of` lets nothing else through

        with np.errstate(all="ignore"):
            return np.broadcast_to(np.asarray(at(self.tree), dtype=float), found.shape[:-2])


def _check(node: ast.AST, inside: bool) -> None:
    """Raise a ValueError where a signal stands outside of a statistic, or something else inside of one."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in STATISTICS:
        if not (isinstance(node.args[0], ast.Name) and node.args[0].id not in CONSTANTS):
            raise ValueError(f"{node.func.id} takes one signal")
        return
    if isinstance(node, ast.Name) and node.id not in CONSTANTS and not inside:
        raise ValueError(f"{node.id} stands by itself")
    for child in ast.iter_child_nodes(node):
        if not (isinstance(node, ast.Call) and child is node.func):
            _check(child, inside)
