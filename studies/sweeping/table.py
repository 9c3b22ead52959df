"""Tables of a sweep: one line a point of the design, each number with its error; all cases as CSV or data frame."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import isnan, nan
from typing import Any, NamedTuple

from buckler.mbs.units import label_with_unit

from ..kit.report import Table
from .store import Row
from .vary import Plan

MOST_LINES = 100
"""Lines of the table in the terminal; the CSV has all."""
DEFAULT_SHOWN = 4
"""Metrics shown if none are named."""


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
