"""What a sweep found: repeats gathered, one line a point of the design, mean ± standard error."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from buckler.mbs.units import labelled

from ..kit.report import Metric, Table
from ..kit.statistics import Mean
from .rows import Row
from .vary import Plan

MOST_LINES = 100
"""Of the table in the terminal."""
DEFAULT_SHOWN = 4
"""Metrics shown if none are named."""


@dataclass(frozen=True)
class Point:
    """One point of the design: its values, and its repeats that have ended."""

    values: tuple[Any, ...]
    rows: Sequence[Row]

    @property
    def status(self) -> str:
        """OK, or how many ended how."""
        counts = Counter(row.status for row in self.rows if row.status != "OK")
        if len(self.rows) == 1:
            return self.rows[0].status
        return ", ".join(f"{n} {status}" for status, n in counts.items()) or "OK"

    @property
    def used(self) -> Sequence[Row]:
        """Those that are OK; where there are none, those that are suspect."""
        return [row for row in self.rows if row.status == "OK"] or [row for row in self.rows if row.status == "SUSPECT"]

    @property
    def suspect(self) -> bool:
        """Whether its numbers come from suspect cases."""
        return bool(self.used) and self.used[0].status == "SUSPECT"

    def mean(self, metric: str) -> Mean:
        """Mean over what counts and is finite."""
        found = np.array([row.value(metric) for row in self.used])
        return Mean.of(found[np.isfinite(found)])


def points(plan: Plan, rows: Sequence[Row]) -> list[Point]:
    """Gather the repeats; rows are those of the plan's cases, in their order."""
    step = plan.repeats
    found = []
    for i in range(0, len(rows), step):
        case = plan.cases[i]
        values = tuple(_plain(getattr(case, name)) for name in plan.names)
        words = [value for value in values if isinstance(value, str)]
        found.append(Point(values, [_comparable(row, words) for row in rows[i : i + step]]))
    return found


def _plain(value: object) -> Any:
    """A value that stands alone in a parameter for several."""
    return value[0] if isinstance(value, tuple) else value


def _comparable(row: Row, words: Sequence[str]) -> Row:
    """Drop a varied word in front of a metric: `strut.force` and `beam.force` are `force` of two models."""
    metrics: dict[str, Metric] = {}
    for name, metric in row.metrics.items():
        first, _, rest = name.partition(".")
        metrics[rest if first in words and rest else name] = metric
    return Row(row.number, row.parameters, row.status, row.message, metrics, row.work, row.wall_s, row.provenance)


def units_of(found: Sequence[Point]) -> dict[str, str]:
    """Every metric, in the order of appearance, with its unit."""
    return {name: metric.unit for point in found for row in point.rows for name, metric in row.metrics.items()}


def choose(found: Sequence[Point], wanted: Sequence[str]) -> dict[str, str]:
    """The metrics to show, with their units.

    Raises
    ------
    ValueError
        If one is wanted that no case has.
    """
    known = units_of(found)
    for name in wanted:
        if name not in known:
            raise ValueError(f"--metrics {name}: no such metric; there are: {', '.join(known) or 'none, no case has any'}")
    return {name: known[name] for name in wanted or list(known)[:DEFAULT_SHOWN]}


def table(plan: Plan, found: Sequence[Point], shown: Mapping[str, str], units: Mapping[str, str]) -> Table:
    """One line a point of the design."""
    statuses = [point.status for point in found]
    failing = any(status != "OK" for status in statuses)
    headers = [labelled(name, units[name]) for name in plan.names]
    headers += [f"of {plan.repeats}"] * (plan.repeats > 1) + [labelled(name, unit) for name, unit in shown.items()]
    lines = []
    for point, status in zip(found[:MOST_LINES], statuses, strict=False):
        line: list[Any] = [*point.values, *([len(point.used)] if plan.repeats > 1 else [])]
        line += [_cell(point.mean(name), plan.repeats) for name in shown]
        lines.append(line + ([status] if failing else []))
    return Table(headers + ["status"] * failing, lines, notes=_notes(plan, found, shown))


def _cell(mean: Mean, repeats: int) -> Any:
    if not mean.n:
        return None
    if repeats == 1:
        return mean.value
    return f"{mean.value:.6g} ± {mean.error:.2g}" if mean.n > 1 else f"{mean.value:.6g}"


def _notes(plan: Plan, found: Sequence[Point], shown: Mapping[str, str]) -> str:
    notes = []
    if plan.repeats > 1:
        notes.append("mean ± standard error over the repeats that are OK; over the suspect ones where none is.")
    if len(found) > MOST_LINES:
        notes.append(f"{len(found) - MOST_LINES} more lines: `python -m studies export` writes all of them.")
    others = [name for name in units_of(found) if name not in shown]
    if others:
        notes.append(f"--metrics takes also: {', '.join(others)}")
    return "\n".join(notes)
