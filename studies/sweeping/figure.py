"""Picture of a sweep: each metric with its error over the numbers that vary; failed and suspect cases are marks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.units import label_with_unit

from ..kit.style import COLOURS, Figure, subplots
from .table import Point
from .vary import Axis, Plan

MARKS = "os^vDP*Xhd"
"""Marks of the lines of a family, in order."""
FEW = 6
"""Largest number of lines with colours of their own and a legend each; more take the colours of a scale."""
CONSTANT = 1e-9
"""Spread over size below which all values are one, as the rest is rounding."""


def figures(plan: Plan, found: Sequence[Point], shown: Mapping[str, str], units: Mapping[str, str]) -> dict[str, Figure]:
    """Draw one figure a metric, under the metric's name."""
    return {metric.replace("/", "_per_"): _draw(plan, found, metric, unit, units) for metric, unit in shown.items()}


def _draw(plan: Plan, found: Sequence[Point], metric: str, unit: str, units: Mapping[str, str]) -> Figure:
    """Draw lines over the number with most values, one for each combination of the others."""
    values = {axis: np.array([point.values[i] for point in found]) for i, axis in enumerate(plan.axes)}
    numbers = [axis for axis in plan.axes if values[axis].dtype.kind != "U"]
    across = max(numbers, key=lambda axis: len(axis.values), default=None)
    others = [axis for axis in plan.axes if axis is not across]
    labels = [", ".join(_label(axis, values[axis][i], axis.label(units)) for axis in others) for i in range(len(found))]
    mean, error = np.array([point.read(metric) for point in found]).T
    mean = _flatten(mean)
    fig, ax = subplots(height=90)
    if across is None:
        x = np.arange(len(found))
        ax.set_xticks(x, [label or "all" for label in labels])
    else:
        x = values[across].astype(float)
        _scale(ax, across, units)
    families = dict.fromkeys(labels if across else [""])
    for i, label in enumerate(families):
        chosen = np.array([across is None or each == label for each in labels])
        look = {"fmt": MARKS[i % len(MARKS)] + ("" if across is None else "-"), "color": _colour(i, len(families))}
        own = [point for point, c in zip(found, chosen, strict=True) if c]
        _family(ax, x[chosen], mean[chosen], error[chosen], own, label, look)
    ax.set_ylabel(label_with_unit(metric, unit))
    _legend(ax, found)
    return fig


def _family(ax: Any, x: Array, y: Array, error: Array, found: Sequence[Point], label: str, look: Mapping[str, Any]) -> None:
    """Draw marks with their errors, hollow where they are suspect, and crosses at the bottom for failed cases."""
    order = np.argsort(x, kind="stable")
    bars = None if np.isnan(error).all() else np.nan_to_num(error[order])
    ax.errorbar(x[order], y[order], bars, label=label or None, capsize=2, elinewidth=0.8, **look)
    suspect, failed = np.array([point.suspect for point in found]), np.array([not point.valid for point in found])
    ax.plot(x[suspect], y[suspect], look["fmt"][0], mfc="white", mec=look["color"], zorder=5)
    if failed.any():  # matplotlib lays figures out wrongly around an empty curve that is not clipped
        ax.plot(x[failed], np.full(failed.sum(), 0.03), "kx", transform=ax.get_xaxis_transform(), clip_on=False, zorder=6)


def _scale(ax: Any, axis: Axis, units: Mapping[str, str]) -> None:
    ax.set_xlabel(label_with_unit(axis.name.replace("_", " "), axis.label(units)))
    if axis.log:
        ax.set_xscale("log")
    else:
        ax.xaxis.set_major_formatter("{x:g}")  # 0.0004 and not 0.000400


def _legend(ax: Any, found: Sequence[Point]) -> None:
    """Name the curves, or the first and the last of many, and the marks that occur."""
    from matplotlib.lines import Line2D

    handles, labels = ax.get_legend_handles_labels()
    if len(handles) > FEW:
        handles, labels = handles[:: len(handles) - 1], labels[:: len(labels) - 1]
    for occurs, mark, text in (
        (any(not p.valid for p in found), "x", "failed"),
        (any(p.suspect for p in found), "o", "suspect"),
    ):
        if occurs:
            handles.append(Line2D([], [], marker=mark, color="k", mfc="white", linestyle=""))
            labels.append(text)
    if handles:
        ax.legend(handles, labels)


def _colour(i: int, count: int) -> Any:
    from matplotlib import colormaps

    return COLOURS[i % len(COLOURS)] if count <= FEW else colormaps["viridis"](i / (count - 1))


def _label(axis: Axis, value: object, unit: str) -> str:
    return (
        str(value)
        if isinstance(value, str)
        else f"{axis.name.replace('_', ' ')} = {value:.4g} {'' if unit == '1' else unit}".rstrip()
    )


def _flatten(values: Array) -> Array:
    """Return the values, or their median where they differ by rounding only."""
    known = values[np.isfinite(values)]
    flat = len(known) and np.ptp(known) <= CONSTANT * np.abs(known).max()
    return np.where(np.isfinite(values), np.median(known), values) if flat else values
