"""Cases of a sweep from the texts of `--vary`; their table and figures, each number with its error; all cases as CSV.

Texts are `thickness=0.1mm:0.5mm:9`, `tolerance=1e-5:1e-3:7:log`, `speed=0.75,1.25`. Each combination of values is a case.
"""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import cycle, product
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.declare import Declaration
from buckler.mbs.geometry import Array
from buckler.mbs.units import label_with_unit, measured, parse_quantity, written_unit

from ..kit.parameters import StudyParameters
from ..kit.registry import hint
from ..kit.report import Metric, Table
from ..kit.running import CaseMaker
from ..kit.style import COLOURS, Figure, subplots
from .store import Row

DIGITS = 12
"""Significant digits of values inside a range and of shown values: 0.1mm:0.5mm:9 contains 0.15 mm, without a rounding error."""
MOST_CASES = 1_000_000
"""Largest number of cases: a larger one is probably a typing error."""
VALID = ("OK", "SUSPECT")
"""Status of cases whose metrics are shown."""


class Axis(NamedTuple):
    """Varied parameter of a sweep."""

    name: str
    values: tuple[Any, ...]  # in SI
    log: bool  # the values are equally spaced in the logarithm
    unit: str  # in which tables and figures show the values
    factor: float  # this unit in SI

    def show(self, value: Any) -> Any:
        """Return a value in the unit of tables and figures."""
        return float(f"{value / self.factor:.{DIGITS}g}") if isinstance(value, float) and self.factor != 1.0 else value

    def label(self, value: object) -> str:
        """Write a shown value with name and unit; a word alone."""
        unit = "" if self.unit == "1" else self.unit
        return value if isinstance(value, str) else f"{self.name.replace('_', ' ')} = {value:.4g} {unit}".rstrip()


def parse(text: str, known: Mapping[str, Declaration]) -> Axis:
    """Read one text `NAME=VALUES` of `--vary`; `known` declares the parameters that may vary."""
    name, equals, values = text.partition("=")
    name = name.strip() if name.strip() in known else name.strip().replace("-", "_")
    if name not in known:
        raise ValueError(f"--vary {text}: unknown parameter '{name}'; {hint(name, known) or 'see --help'}")
    if not equals or not values.strip():
        raise ValueError(f"--vary {text}: no values; write {name}=START:STOP:COUNT or {name}=A,B,C")
    try:
        if ":" in values:
            items = _range(name, values, known[name])
        else:
            items = [_value(name, part, known[name]) for part in values.split(",")]
            if len(set(items)) < len(items):
                raise ValueError("one of them given twice")
        unit, factor = known[name].spec.unit, 1.0
        if isinstance(items[0], float) and (written := written_unit(re.split("[:,]", values)[0])):  # the unit of the first value
            one = f"1 {written}"  # `measured` reads any unit, for a parameter without a declared one
            unit, factor = written, parse_quantity(one, unit) if unit else float(measured(one))
        return Axis(name, tuple(items), values.endswith(":log"), unit, factor)
    except ValueError as reason:
        raise ValueError(f"--vary {text}: {reason}") from None


def _value(name: str, text: str, spec: Declaration) -> Any:
    """Read one value; for a parameter that is a list, the only item."""
    value = spec.spec.read(name, text)
    return value[0] if isinstance(value, tuple) else value


def _range(name: str, text: str, spec: Declaration) -> list[Any]:
    """Read the values of START:STOP:COUNT or START:STOP:COUNT:log."""
    start, stop, *rest = text.split(":")
    log = rest[-1:] == ["log"]
    low, high = _value(name, start, spec), _value(name, stop, spec)
    if isinstance(low, str):
        raise ValueError(f"words have no range; write {name}={start},{stop}")
    if low == high:
        raise ValueError("start and stop are the same")
    if log and min(low, high) <= 0:
        raise ValueError("log needs start and stop above 0")
    counts = rest[:-1] if log else rest
    if not counts:
        raise ValueError("no count; write START:STOP:COUNT")
    if len(counts) > 1 or not counts[0].strip().isdecimal() or not 2 <= int(counts[0]) <= MOST_CASES:
        raise ValueError(f"'{':'.join(counts)}' is no count; allowed: 2 to {MOST_CASES}, and `:log` behind it")
    spaced = (np.geomspace if log else np.linspace)(low, high, int(counts[0]))
    inner: list[Any] = [float(f"{x:.{DIGITS}g}") + 0.0 for x in spaced[1:-1]]  # + 0.0 makes -0.0 to 0.0
    if isinstance(low, int):
        if fractions := [x for x in inner if not x.is_integer()]:
            raise ValueError(f"gives {fractions[0]:g}, which is not a whole number; choose another count or list them")
        inner = [int(x) for x in inner]
    return [low, *inner, high]


def make_cases(maker: CaseMaker, axes: Sequence[Axis]) -> list[StudyParameters]:
    """Make a case for each combination of values of the axes, with the other parameters that all cases share."""
    names = [axis.name for axis in axes]
    for i, name in enumerate(names):
        if name in names[:i]:
            raise ValueError(f"--vary {name}: given twice")
        if name in maker.shared:
            raise ValueError(f"--vary {name}: also given as --{name.replace('_', '-')}")
    total = math.prod(len(axis.values) for axis in axes)
    if total > MOST_CASES:
        raise ValueError(f"{total} cases; allowed: up to {MOST_CASES}")
    cases: list[StudyParameters] = []
    for values in product(*(axis.values for axis in axes)):
        varied = dict(zip(names, values, strict=True))
        try:
            cases.append(maker.make(**{**maker.shared, **varied}))
        except ValueError as error:
            shown = ", ".join(f"{name} = {maker.known[name].show(value)}" for name, value in varied.items())
            raise ValueError(f"{shown}: {error}") from None
    return cases


class DesignPoint(NamedTuple):
    """Point of the sweep: its values of the varied parameters in the order of the axes, and the row of its case."""

    values: tuple[Any, ...]
    row: Row

    def metric(self, name: str) -> Metric | None:
        """Return a metric of the case; None if it failed or has no such metric."""
        return self.row.metrics.get(name) if self.row.status in VALID else None


def points(axes: Sequence[Axis], rows: Sequence[Row]) -> list[DesignPoint]:
    """Combine the cases of a sweep with their rows.

    A metric's prefix that is a varied value of its case is cut off, so that all cases have the same metrics: where `models`
    varies, `strut.force` of the case "strut" becomes `force`.
    """
    found = []
    for values, row in zip(product(*(map(axis.show, axis.values) for axis in axes)), rows, strict=True):
        metrics = {}
        for name, metric in row.metrics.items():
            prefix, _, rest = name.partition(".")
            metrics[rest if rest and prefix in values else name] = metric
        found.append(DesignPoint(values, replace(row, metrics=metrics)))
    return found


def choose(found: Sequence[DesignPoint], wanted: Sequence[str]) -> dict[str, str]:
    """Return the metrics to show, by default the first four, with their units; a ValueError for one that no case has."""
    known = _units([point.row for point in found])
    for name in wanted:
        if name not in known:
            raise ValueError(f"--metrics {name}: no such metric; there are: {', '.join(known) or 'none, no case has any'}")
    return {name: known[name] for name in wanted or list(known)[:4]}


def table(axes: Sequence[Axis], found: Sequence[DesignPoint], shown: Mapping[str, str]) -> Table:
    """Tabulate the metrics `shown`, a name with its unit, at the points of the sweep, and `status` where not all are OK."""
    most = 100  # lines in the terminal; the CSV has all
    headers = [label_with_unit(axis.name, axis.unit) for axis in axes]
    headers += [label_with_unit(name, unit) for name, unit in shown.items()]
    lines = [[*point.values, *(_cell(point.metric(name)) for name in shown)] for point in found[:most]]
    if any(point.row.status != "OK" for point in found):
        headers.append("status")
        lines = [[*line, point.row.status] for line, point in zip(lines, found, strict=False)]
    notes = []
    if len(found) > most:
        notes.append(f"{len(found) - most} more lines: cases.csv has all of them.")
    if others := [name for name in _units([point.row for point in found]) if name not in shown]:
        notes.append(f"--metrics takes also: {', '.join(others)}")
    return Table(headers, lines, notes="\n".join(notes))


def _units(rows: Sequence[Row]) -> dict[str, str]:
    return {name: metric.unit for row in rows for name, metric in row.metrics.items()}


def _cell(metric: Metric | None) -> str | float | None:
    if metric is None or math.isnan(metric.value):
        return None
    error = metric.error_in_unit
    return metric.value if error is None or math.isnan(error) else metric.format(".6g")


def figures(axes: Sequence[Axis], found: Sequence[DesignPoint], shown: Mapping[str, str]) -> dict[str, Figure]:
    """Draw a figure for each metric, by its name."""
    return {metric.replace("/", "_per_"): _draw(axes, found, metric, unit) for metric, unit in shown.items()}


def _draw(axes: Sequence[Axis], found: Sequence[DesignPoint], metric: str, unit: str) -> Figure:
    """Draw a metric over the numeric parameter with most values, or over the cases; the others give a curve each."""
    numbers = [axis for axis in axes if not isinstance(axis.values[0], str)]
    across = max(numbers, key=lambda axis: len(axis.values), default=None)
    others = [(i, axis) for i, axis in enumerate(axes) if axis is not across]
    labels = np.array([", ".join(axis.label(point.values[i]) for i, axis in others) for point in found])
    y, error = _values(found, metric)
    fig, ax = subplots(height=90)
    ax.set_ylabel(label_with_unit(metric, unit))
    if across is None:
        x = np.arange(len(found))
        ax.set_xticks(x, [label or "all" for label in labels])
        labels[:] = ""  # a single series without a legend
    else:
        x = np.array([point.values[axes.index(across)] for point in found], float)
        ax.set_xlabel(label_with_unit(across.name.replace("_", " "), across.unit))
        if across.log:
            ax.set_xscale("log")
        else:
            ax.xaxis.set_major_formatter("{x:g}")  # 0.0004 and not 0.000400
    status = np.array([point.row.status for point in found])
    line = "" if across is None else "-"
    for label, mark, colour in zip(dict.fromkeys(labels.tolist()), cycle("os^vDP*Xhd"), cycle(COLOURS), strict=False):
        curve = np.flatnonzero(labels == label)
        curve = curve[np.argsort(x[curve], kind="stable")]
        bars = None if np.isnan(error[curve]).all() else np.nan_to_num(error[curve])
        ax.errorbar(x[curve], y[curve], bars, label=label or None, fmt=f"{mark}{line}", color=colour, capsize=2, elinewidth=0.8)
        suspect = curve[status[curve] == "SUSPECT"]
        ax.plot(x[suspect], y[suspect], mark, mfc="white", mec=colour, zorder=5)
    failed = x[~np.isin(status, VALID)]
    if failed.size:  # an empty curve that is not clipped would spoil the layout of matplotlib
        low = np.full(failed.size, 0.03)  # of the height of the axes
        ax.plot(failed, low, "kx", transform=ax.get_xaxis_transform(), clip_on=False, zorder=6, label="failed")
    if "SUSPECT" in status:
        ax.plot([], [], "ko", mfc="white", label="suspect")
    if names := ax.get_legend_handles_labels()[1]:
        ax.legend(ncols=1 + len(names) // 9)  # about nine lines a column
    return fig


def _values(found: Sequence[DesignPoint], metric: str) -> Array:
    """Return values and absolute errors of a metric, nan where unknown; values that differ by rounding errors are made equal."""
    metrics = (point.metric(metric) for point in found)
    y, error = np.array([(each.value, each.error_in_unit) if each else (None, None) for each in metrics], float).T  # None: nan
    is_known = np.isfinite(y)
    if is_known.any() and np.ptp(y[is_known]) <= 1e-9 * np.abs(y[is_known]).max():
        y[is_known] = np.median(y[is_known])
    return np.array([y, error])


def columns(rows: Sequence[Row], units: Mapping[str, str]) -> dict[str, list[object]]:
    """Make the columns of all cases, by name and unit: number, parameters, status, metrics with errors, host.

    `units` are those of the parameters. Errors are relative. If any case has an absolute error of a metric, those of
    all cases are a further column.
    """
    found: dict[str, list[Any]] = {"number": [row.number for row in rows]}
    for name in rows[0].parameters if rows else ():
        values = (row.parameters.get(name) for row in rows)
        found[label_with_unit(name, units.get(name, ""))] = [",".join(map(str, v)) if isinstance(v, list) else v for v in values]
    found |= {"status": [row.status for row in rows], "message": [row.message for row in rows]}
    for name, unit in _units(rows).items():
        metrics = [row.metrics.get(name) for row in rows]
        found[label_with_unit(name, unit)] = [None if each is None else each.value for each in metrics]
        if any(each is not None and each.error is not None for each in metrics):
            found[f"{name} relative error"] = [None if each is None else each.error for each in metrics]
        if any(each is not None and each.absolute is not None for each in metrics):
            found[label_with_unit(f"{name} error", unit)] = [None if each is None else each.error_in_unit for each in metrics]
    found["wall_s [s]"] = [row.wall_s for row in rows]
    return found | {name: [str(row.provenance.get(name, "")) for row in rows] for name in ("ended", "host", "sources")}


def to_csv(rows: Sequence[Row], units: Mapping[str, str]) -> str:
    """Write all cases as CSV, with units in the headers and all digits of the numbers."""
    text, found = io.StringIO(), columns(rows, units)
    csv.writer(text, lineterminator="\n").writerows([found, *zip(*found.values(), strict=True)])
    return text.getvalue()


def to_dataframe(rows: Sequence[Row], units: Mapping[str, str]) -> Any:
    """Return all cases as a data frame of pandas, which `pip install 'buckler[tables]'` installs."""
    import pandas

    return pandas.DataFrame(columns(rows, units))
