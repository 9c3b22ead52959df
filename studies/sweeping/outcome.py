"""What a sweep found, on the terminal and in files: table, figures, page; or how one part of it ended."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence

import numpy as np

from buckler.studies.kit.report import Metric, StudyResult
from buckler.studies.kit.running import told
from buckler.studies.kit.style import house_style
from buckler.studies.kit.words import program, wrong_input
from buckler.studies.sweeping.asked import Asked
from buckler.studies.sweeping.figure import figures
from buckler.studies.sweeping.report import Heading, page, summary, worst
from buckler.studies.sweeping.rows import Row
from buckler.studies.sweeping.table import Point, choose, points, table
from buckler.studies.sweeping.vary import Plan


def report(name: str, asked: Asked, rows: Sequence[Row], wall: float) -> int:
    """Print the table and write the files."""
    options, found = asked.options, points(asked.plan, rows)
    try:
        shown = choose(found, [word.strip() for word in options.metrics.split(",") if word.strip()])
    except ValueError as error:
        return wrong_input(error)
    units = asked.units
    counts = Counter(row.status for row in rows)
    numbers = {"cases": len(rows), "suspect": counts["SUSPECT"], "failed": len(rows) - counts["OK"] - counts["SUSPECT"]}
    result = StudyResult(
        parameters=asked.plan.cases[0],
        status=worst(rows),
        message=_message(rows, counts),
        metrics={key: Metric(float(n), "1") for key, n in numbers.items()},
        signals=_arrays(asked.plan, found, shown),
        work={"wall_s": wall, "vary": options.vary, "repeat": options.repeat, "store": str(asked.store)},
        tables=[table(asked.plan, found, shown, units)],
        pages={"report.html": page(_heading(name, asked, rows, found, wall), asked.plan, found, units, asked.folder)},
    )
    with house_style():
        drawn = figures(asked.plan, found, shown, dict(units))
    where = f"in {wall:.2g} s, written to {asked.folder}, cases in {asked.store}"
    return told(name, result, drawn, asked.folder, options, where)


def _heading(name: str, asked: Asked, rows: Sequence[Row], found: Sequence[Point], wall: float) -> Heading:
    """What the page says of the sweep as a whole."""
    facts = [("varied", text) for text in asked.options.vary] + [("store", str(asked.store)), ("workers", asked.workers.where)]
    return Heading(name, worst(rows), summary(found, wall), asked.alone, asked.places, facts, asked.folder / "reports")


def report_part(name: str, asked: Asked, rows: Sequence[Row], wall: float) -> int:
    """Say how a part ended, and what to do with it; tables and figures are made of all parts."""
    counts = Counter(row.status for row in rows)
    bad = len(rows) - counts["OK"] - (counts["SUSPECT"] if asked.options.trust else 0)
    part, folder = asked.part, asked.folder
    if part and not asked.options.quiet:
        ends = ", ".join(f"{n} {status}" for status, n in counts.items())
        print(f"{name}: part {part.number} of {part.of}, {len(rows)} cases ({ends}) in {wall:.2g} s, in {asked.store}")
        words = f"{folder / f'part-*-of-{part.of}.sqlite'} --out {folder / 'cases.sqlite'}"
        print(f"with all parts: {program()} merge {words}, then the same sweep without --part")
    if bad:
        print(f"{name}: {_message(rows, counts)}", file=sys.stderr)
    return 1 if bad else 0


def _message(rows: Sequence[Row], counts: Counter[str]) -> str:
    """How many ended how, and the first of them."""
    first = next((row for row in rows if row.status != "OK"), None)
    if first is None:
        return ""
    ends = ", ".join(f"{n} {status}" for status, n in counts.items() if status != "OK")
    return f"{ends} of {len(rows)} cases; the first is case {first.number}: {first.message}"


def _arrays(chosen: Plan, found: Sequence[Point], shown: dict[str, str]) -> dict[str, np.ndarray]:
    """What the figures show: values of each varied parameter, means and standard errors; one entry a point."""
    arrays = {name: np.array([point.values[i] for point in found]) for i, name in enumerate(chosen.names)}
    for name in shown:
        means = [point.mean(name) for point in found]
        arrays |= {f"{name}.mean": np.array([m.value for m in means]), f"{name}.error": np.array([m.error for m in means])}
    return arrays
