"""Tables of a sweep: one line a point of the design, each number with its error; all cases as CSV or data frame."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from buckler.mbs.units import label_with_unit

from ..kit.report import Table
from ..kit.statistics import Mean
from .store import Row
from .vary import Plan

MOST_LINES = 100
"""Lines of the table in the terminal; the CSV has all."""
DEFAULT_SHOWN = 4
"""Metrics shown if none are named."""


@dataclass(frozen=True)
class Point:
    """Point of the design: its values, and its repeats that have ended."""

    values: tuple[Any, ...]
    rows: Sequence[Row]

    @property
    def status(self) -> str:
        """OK, or the number of repeats that ended otherwise."""
        if len(self.rows) == 1:
            return self.rows[0].status
        counts = Counter(row.status for row in self.rows if row.status != "OK")
        return ", ".join(f"{n} {status}" for status, n in counts.items()) or "OK"

    @property
    def valid(self) -> Sequence[Row]:
        """Rows that are OK; where there are none, those that are suspect."""
        return [row for row in self.rows if row.status == "OK"] or [row for row in self.rows if row.status == "SUSPECT"]

    @property
    def suspect(self) -> bool:
        """True if the numbers come from suspect cases."""
        return bool(self.valid) and self.valid[0].status == "SUSPECT"

    def mean(self, metric: str) -> Mean:
        """Mean over the used rows with its standard error; of a single one the value with the error that the study gives."""
        values = np.array([row.value(metric) for row in self.valid])
        found = Mean.of(values[np.isfinite(values)])
        if len(self.rows) > 1 or found.n == 0:
            return found
        off = self.valid[0].metrics[metric].off
        return Mean(found.value, np.nan if off is None else off, 1)


def points(plan: Plan, rows: Sequence[Row]) -> list[Point]:
    """Gather the repeats; rows are those of the plan's cases, in their order."""
    found = []
    for i in range(0, len(rows), plan.repeats):
        values = tuple(_unpack(getattr(plan.cases[i], name)) for name in plan.names)
        words = [value for value in values if isinstance(value, str)]
        found.append(Point(values, [_without(words, row) for row in rows[i : i + plan.repeats]]))
    return found


def _unpack(value: object) -> Any:
    """Take a value out of a tuple of one."""
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
    failing = any(point.status != "OK" for point in found)
    headers = [label_with_unit(name, units[name]) for name in plan.names] + [f"of {plan.repeats}"] * (plan.repeats > 1)
    headers += [label_with_unit(name, unit) for name, unit in shown.items()] + ["status"] * failing
    lines = [
        [*point.values, *[len(point.valid)] * (plan.repeats > 1), *(_cell(point.mean(name)) for name in shown)]
        + [point.status] * failing
        for point in found[:MOST_LINES]
    ]
    notes = ["mean ± standard error over the repeats that are OK; over the suspect ones where none is."] * (plan.repeats > 1)
    notes += [f"{len(found) - MOST_LINES} more lines: cases.csv has all of them."] * (len(found) > MOST_LINES)
    others = [name for name in _units(found) if name not in shown]
    return Table(headers, lines, notes="\n".join(notes + [f"--metrics takes also: {', '.join(others)}"] * bool(others)))


def _units(found: Sequence[Point]) -> dict[str, str]:
    """Units of every metric, in the order of appearance."""
    return {name: metric.unit for point in found for row in point.rows for name, metric in row.metrics.items()}


def _cell(mean: Mean) -> str | float | None:
    if not mean.n:
        return None
    return mean.value if np.isnan(mean.error) else f"{mean.value:.6g} ± {mean.error:.2g}"


# --- all cases ----------------------------------------------------------------------------------------------------------


def columns(rows: Sequence[Row], units: Mapping[str, str]) -> dict[str, list[Any]]:
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
