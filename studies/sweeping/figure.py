"""The picture of a sweep: a family of lines, a heat map, or dots, by what varies; failed and suspect cases are marks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from buckler.mbs.geometry import Array
from buckler.mbs.units import labelled

from ..kit.style import COLOURS, Figure, subplots
from .table import Point
from .vary import Plan

FEW = 4
"""Up to so many values of the second number are lines of a family; more make a heat map."""
MARKS = "os^vDP*Xhd"
MARK = "#000000"


class _Picture:
    """One metric over the design."""

    def __init__(self, plan: Plan, found: Sequence[Point], metric: str, unit: str, units: Any) -> None:
        self.plan, self.found, self.metric, self.units = plan, found, metric, units
        self.label = labelled(metric, unit)
        self.values = {name: [point.values[i] for point in found] for i, name in enumerate(plan.names)}
        self.words = [name for name in plan.names if isinstance(self.values[name][0], str)]
        self.numbers = [name for name in plan.names if name not in self.words]
        means = [point.mean(metric) for point in found]
        self.mean = _settled(np.array([m.value for m in means]))
        self.error = np.array([m.error for m in means])
        self.suspect = np.array([point.suspect for point in found])
        self.failed = np.array([not point.used for point in found])

    def draw(self) -> Figure:
        """Choose the kind of picture."""
        numbers = self.numbers
        if len(numbers) == 2:
            few, many = sorted(numbers, key=lambda name: len(set(self.values[name])))
            sampled = bool(self.plan.sampled.intersection(numbers))
            if sampled or len(set(self.values[few])) > FEW:
                return self._maps(self._dots if sampled else self._heat)
            return self._curves([many], [*self.words, few])
        return self._curves(numbers, self.words, joined=len(numbers) == 1) if numbers else self._categories()

    def _families(self, names: Sequence[str]) -> list[tuple[str, Array]]:
        """Name of each combination of values, and which points have it."""
        options = [list(dict.fromkeys(self.values[name])) for name in names]
        found = []
        for combination in product(*options):
            chosen = [
                all(self.values[n][i] == v for n, v in zip(names, combination, strict=True)) for i in range(len(self.found))
            ]
            label = ", ".join(_named(n, v, self.units[n]) for n, v in zip(names, combination, strict=True))
            found.append((label, np.array(chosen)))
        return found

    def _curves(self, names: Sequence[str], families: Sequence[str], joined: bool = True) -> Figure:
        """The metric against each of some numbers."""
        columns = min(3, len(names))
        rows = math.ceil(len(names) / columns)
        height = 90 if len(names) == 1 else 20 + 60 * rows
        fig, axes = subplots(rows, columns, height=height, sharey=True, squeeze=False)
        for ax, name in zip(axes.flat, names, strict=False):
            x, lines = np.array(self.values[name], dtype=float), joined and name not in self.plan.sampled
            for i, (label, chosen) in enumerate(self._families(families)):
                self._family(ax, x, chosen, i, label or None, lines)
            self._mark_failed(ax, x)
            self._scale(ax, [name])
        self._legend(axes[0, 0])
        for ax in axes.flat[len(names) :]:
            ax.remove()
        for line in axes:
            line[0].set_ylabel(self.label)
        return fig

    def _family(self, ax: Any, x: Array, chosen: Array, i: int, label: str | None, joined: bool) -> None:
        """Marks with their errors, hollow where they are suspect."""
        colour, mark = COLOURS[i % len(COLOURS)], MARKS[i % len(MARKS)]
        order = np.flatnonzero(chosen)[np.argsort(x[chosen], kind="stable")]
        error = None if np.isnan(self.error[order]).all() else np.nan_to_num(self.error[order])
        style = {"fmt": f"{mark}-" if joined else mark, "color": colour, "capsize": 2, "elinewidth": 0.8}
        ax.errorbar(x[order], self.mean[order], error, label=label, **style)
        doubtful = chosen & self.suspect
        ax.plot(x[doubtful], self.mean[doubtful], mark, mfc="white", mec=colour, zorder=5)

    def _mark_failed(self, ax: Axes, x: Array) -> None:
        """Crosses along the bottom, where no value is."""
        x = np.asarray(x)[self.failed]
        if len(x):  # matplotlib lays figures out wrongly around an empty curve that is not clipped
            ax.plot(x, np.full(len(x), 0.03), "x", color=MARK, transform=ax.get_xaxis_transform(), clip_on=False, zorder=6)

    def _categories(self) -> Figure:
        """Words only, or nothing but repeats: one place a point."""
        fig, ax = subplots(height=80)
        x = np.arange(len(self.found))
        self._family(ax, x, np.ones(len(x), bool), 0, None, joined=False)
        for place, point in zip(x, self.found, strict=True):
            each = [row.value(self.metric) for row in point.used]
            if len(each) > 1:
                ax.plot(np.full(len(each), place - 0.1), each, ".", color=COLOURS[0], alpha=0.4, markersize=3)
        self._mark_failed(ax, x)
        ax.set_xticks(x, [", ".join(map(str, point.values)) or "all" for point in self.found])
        ax.set(xlim=(-0.5, len(x) - 0.5), xlabel=", ".join(self.plan.names), ylabel=self.label)
        self._legend(ax)
        return fig

    def _maps(self, draw: Any) -> Figure:
        """A panel for each combination of words, with a scale of colours in common."""
        families = self._families(self.words)
        columns = {1: 1, 2: 2, 4: 2}.get(len(families), 3)
        rows = math.ceil(len(families) / columns)
        height = 25 + (75 if columns == 1 else 60 if columns == 2 else 45) * rows
        fig, axes = subplots(rows, columns, height=height, sharex=True, sharey=True, squeeze=False)
        for ax in axes.flat[len(families) :]:
            ax.remove()
        panels = list(axes.flat[: len(families)])
        known = self.mean[np.isfinite(self.mean)]
        limits = {"vmin": known.min(), "vmax": known.max()} if len(known) else {"vmin": 0, "vmax": 1}
        x, y = (np.array(self.values[name], dtype=float) for name in self.numbers)
        for i, (ax, (label, chosen)) in enumerate(zip(panels, families, strict=True)):
            image = draw(ax, chosen, limits)
            for which, mark in ((self.failed, "x"), (self.suspect, "^")):
                ax.plot(x[chosen & which], y[chosen & which], mark, color=MARK, mfc="white", markersize=5, zorder=5)
            self._scale(ax, self.numbers)
            ax.set_title(label)
            ax.grid(False)
            ax.set_ylabel("" if i % columns else ax.get_ylabel())
            lowest = i + columns >= len(families)
            ax.tick_params(labelbottom=lowest)
            ax.set_xlabel(ax.get_xlabel() if lowest else "")
        fig.colorbar(image, ax=panels, label=self.label)
        self._legend(panels[0], fig, suspect="^", loc="outside upper right")
        return fig

    def _heat(self, ax: Any, chosen: Array, limits: Any) -> Any:
        columns, rows = (sorted(set(self.values[name])) for name in self.numbers)
        grid = np.full((len(rows), len(columns)), np.nan)
        for i in np.flatnonzero(chosen):
            x, y = (self.values[name][i] for name in self.numbers)
            grid[rows.index(y), columns.index(x)] = self.mean[i]
        edges = (_edges(v, name in self.plan.log) for v, name in zip((columns, rows), self.numbers, strict=True))
        ax.set_facecolor("#dddddd")
        return ax.pcolormesh(*edges, grid, **limits, rasterized=True)

    def _dots(self, ax: Any, chosen: Array, limits: Any) -> Any:
        x, y = (np.array(self.values[name], dtype=float)[chosen] for name in self.numbers)
        return ax.scatter(x, y, c=self.mean[chosen], s=14, **limits)

    def _scale(self, ax: Any, names: Sequence[str]) -> None:
        """Name the axes of varied numbers."""
        for axis, name in zip("xy", names, strict=False):
            ax.set(**{f"{axis}label": labelled(name.replace("_", " "), self.units[name])})
            if name in self.plan.log:
                ax.set(**{f"{axis}scale": "log"})
            else:
                getattr(ax, f"{axis}axis").set_major_formatter("{x:g}")  # 0.0004 and not 0.000400

    def _legend(self, ax: Any, where: Any = None, suspect: str = "o", **options: Any) -> None:
        """Name the curves, and the marks that occur."""
        handles, labels = ax.get_legend_handles_labels()
        for which, mark, text in ((self.failed, "x", "failed"), (self.suspect, suspect, "suspect")):
            if which.any():
                handles.append(Line2D([], [], marker=mark, color=MARK, mfc="white", linestyle=""))
                labels.append(text)
        if handles:
            (where or ax).legend(handles, labels, **options)


CONSTANT = 1e-9
"""Spread, relative to the size, below which values are one: what is left is rounding."""


def _settled(values: Array) -> Array:
    """Values, or their middle where they differ by rounding only."""
    known = values[np.isfinite(values)]
    if len(known) and np.ptp(known) <= CONSTANT * np.abs(known).max():
        return np.where(np.isfinite(values), np.median(known), values)
    return values


def _named(name: str, value: object, unit: str) -> str:
    """`beam`, or `speed = 6.58 rad/s`."""
    if isinstance(value, str):
        return value
    return f"{name.replace('_', ' ')} = {value:.4g}{f' {unit}' if unit not in ('', '1') else ''}"


def _edges(centres: Sequence[float], log: bool) -> Array:
    """Borders of cells around their centres."""
    x = np.log(centres) if log else np.array(centres, dtype=float)
    middle = (x[1:] + x[:-1]) / 2
    edges = np.concatenate([[x[0] - (x[1] - x[0]) / 2], middle, [x[-1] + (x[-1] - x[-2]) / 2]])
    return np.exp(edges) if log else edges


def figures(plan: Plan, found: Sequence[Point], shown: dict[str, str], units: dict[str, str]) -> dict[str, Figure]:
    """One figure a metric, under the metric's name."""
    return {metric.replace("/", "_per_"): _Picture(plan, found, metric, unit, units).draw() for metric, unit in shown.items()}
