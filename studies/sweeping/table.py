"""Tables and figures of a sweep: each number with its error; all cases as CSV or data frame."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isnan, nan
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.units import label_with_unit

from ..kit.report import Table
from ..kit.style import COLOURS, Figure, subplots
from .store import Row
from .vary import Axis, Plan

MOST_LINES = 100
"""Lines of the table in the terminal; the CSV has all."""
DEFAULT_SHOWN = 4
"""Metrics shown if none are named."""
MARKS = "os^vDP*Xhd"
"""Marks of the lines of a family, in order."""
FEW = 6
"""Largest number of lines with colours of their own and a legend each; more take the colours of a scale."""
CONSTANT = 1e-9
"""Spread over size below which all values are one, as the rest is rounding."""


class Point(NamedTuple):
    """Point of the design: its values, and its case that has ended."""

    values: tuple[Any, ...]
    row: Row

    @property
    def valid(self) -> bool:
        """True if the case gives numbers."""
        return self.row.status in ("OK", "SUSPECT")

    @property
    def suspect(self) -> bool:
        """True if they are suspect."""
        return self.row.status == "SUSPECT"

    def read(self, metric: str) -> tuple[float, float]:
        """Return the value of a metric and its error; nan where it has none."""
        known = self.row.metrics.get(metric) if self.valid else None
        return (nan, nan) if known is None else (known.value, nan if known.off is None else known.off)


def points(plan: Plan, rows: Sequence[Row]) -> list[Point]:
    """Gather the points; rows are those of the plan's cases, in their order."""
    found = []
    for case, row in zip(plan.cases, rows, strict=True):
        values = tuple(axis.show(_unpack(getattr(case, axis.name))) for axis in plan.axes)
        found.append(Point(values, _without([value for value in values if isinstance(value, str)], row)))
    return found


def _unpack(value: object) -> Any:
    return value[0] if isinstance(value, tuple) else value


def _without(words: Sequence[str], row: Row) -> Row:
    """Drop a varied word in front of a metric: `strut.force` and `beam.force` are `force` of two models."""
    parts = {name: name.partition(".") for name in row.metrics}
    names = {name: rest if first in words and rest else name for name, (first, _, rest) in parts.items()}
    return replace(row, metrics={names[name]: metric for name, metric in row.metrics.items()})


def choose(found: Sequence[Point], wanted: Sequence[str]) -> dict[str, str]:
    """Choose the metrics to show, with their units; a ValueError for one that no case has."""
    known = _units(found)
    for name in wanted:
        if name not in known:
            raise ValueError(f"--metrics {name}: no such metric; there are: {', '.join(known) or 'none, no case has any'}")
    return {name: known[name] for name in wanted or list(known)[:DEFAULT_SHOWN]}


def table(plan: Plan, found: Sequence[Point], shown: Mapping[str, str], units: Mapping[str, str]) -> Table:
    """Tabulate one line a point of the design."""
    failing = any(point.row.status != "OK" for point in found)
    headers = [label_with_unit(axis.name, axis.label(units)) for axis in plan.axes]
    headers += [label_with_unit(name, unit) for name, unit in shown.items()] + ["status"] * failing
    lines = [
        [*point.values, *(_cell(*point.read(name)) for name in shown)] + [point.row.status] * failing
        for point in found[:MOST_LINES]
    ]
    notes = [f"{len(found) - MOST_LINES} more lines: cases.csv has all of them."] * (len(found) > MOST_LINES)
    others = [name for name in _units(found) if name not in shown]
    return Table(headers, lines, notes="\n".join(notes + [f"--metrics takes also: {', '.join(others)}"] * bool(others)))


def _units(found: Sequence[Point]) -> dict[str, str]:
    return {name: metric.unit for point in found for name, metric in point.row.metrics.items()}


def _cell(value: float, error: float) -> str | float | None:
    return None if isnan(value) else value if isnan(error) else f"{value:.6g} ± {error:.2g}"


# --- figures ------------------------------------------------------------------------------------------------------------


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


# --- all cases ----------------------------------------------------------------------------------------------------------


def columns(rows: Sequence[Row], units: Mapping[str, str]) -> dict[str, list[object]]:
    """Columns by their names with units: number, parameters, status, metrics each beside its relative error, provenance."""
    found: dict[str, list[Any]] = {"number": [row.number for row in rows]}
    for name in rows[0].parameters if rows else ():
        values = [row.parameters.get(name) for row in rows]
        found[label_with_unit(name, units.get(name, ""))] = [",".join(map(str, v)) if isinstance(v, list) else v for v in values]
    found |= {"status": [row.status for row in rows], "message": [row.message for row in rows]}
    for name, unit in {name: metric.unit for row in rows for name, metric in row.metrics.items()}.items():
        metrics = [row.metrics.get(name) for row in rows]
        found[label_with_unit(name, unit)] = [None if each is None else each.value for each in metrics]
        if any(each is not None and each.error is not None for each in metrics):
            found[f"{name} relative error"] = [None if each is None else each.error for each in metrics]
        if any(each is not None and each.absolute is not None for each in metrics):
            found[label_with_unit(f"{name} error", unit)] = [None if each is None else each.off for each in metrics]
    found["wall_s [s]"] = [row.wall_s for row in rows]
    return found | {name: [str(row.provenance.get(name, "")) for row in rows] for name in ("ended", "host", "sources")}


def to_csv(rows: Sequence[Row], units: Mapping[str, str]) -> str:
    """Write all cases as CSV, units in the headers; numbers keep every digit."""
    text, found = io.StringIO(), columns(rows, units)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(found)
    writer.writerows(zip(*found.values(), strict=True))
    return text.getvalue()


def to_dataframe(rows: Sequence[Row], units: Mapping[str, str]) -> Any:
    """Return all cases as a data frame; needs pandas, `pip install 'buckler[tables]'`."""
    import pandas  # an extra

    return pandas.DataFrame(columns(rows, units))
