"""The page of a sweep: one file, no network; a table, maps over any two parameters, the numbers of each case."""

from __future__ import annotations

import math
import os
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from buckler.mbs.view.shell import filled

from ..kit.parameters import StudyParameters, specs
from ..kit.versions import versions
from ..kit.words import program
from .rows import Row, report_name
from .table import Point, points, units_of
from .vary import Plan

MOST = 20_000
"""Points a page holds."""


@dataclass(frozen=True)
class Heading:
    """What the page says of the sweep as a whole.

    Attributes
    ----------
    title, status, summary : str
    command : what runs one case, but for the values that vary
    places : whether these are places of a mechanism's file, for `--set`; else parameters of a study
    facts : how it was made
    folder : where reports of single cases are, by `report_name`
    """

    title: str
    status: str
    summary: str
    command: str
    places: bool
    facts: Sequence[tuple[str, str]]
    folder: Path | None = None


def study_page(name: str, study: str, cases: Sequence[StudyParameters], names: Sequence[str], rows: Sequence[Row]) -> str:
    """The page of a study that sweeps another one, as text: cases of the other, the same but for the parameters `names`."""
    plan, known = Plan(cases, tuple(names), frozenset(), frozenset(), 1), specs(type(cases[0]))
    found = points(plan, rows)
    heading = Heading(name, worst(rows), summary(found, math.nan), _alone(study, cases[0], names), False, [("sweeps", study)])
    return page(heading, plan, found, {key: spec.unit for key, spec in known.items()}, Path())


def worst(rows: Sequence[Row]) -> str:
    """How a sweep ended: FAILED if any case did, else SUSPECT if any is."""
    ends = {row.status if row.status in ("OK", "SUSPECT") else "FAILED" for row in rows}
    return next((end for end in ("FAILED", "SUSPECT") if end in ends), "OK")


def _alone(study: str, case: StudyParameters, names: Sequence[str]) -> str:
    """The command that runs one case, with what is not at its default and does not vary."""
    words = [program(), "run", study]
    usual = type(case)()
    for name, spec in specs(type(case)).items():
        value = getattr(case, name)
        if name not in names and value != getattr(usual, name):
            words += [f"--{name.replace('_', '-')}", shlex.quote(spec.show(value).replace(f" {spec.unit}", ""))]
    return " ".join(words)


def page(heading: Heading, plan: Plan, found: Sequence[Point], units: Mapping[str, str], beside: Path) -> str:
    """The whole page as text; reports of single cases are linked from the folder `beside`."""
    shown, more = units_of(found), len(found) - MOST
    left_out = [("left out", f"{more} points; the store has them")] if more > 0 else []
    content = {
        "title": heading.title,
        "status": heading.status,
        "summary": heading.summary,
        "command": heading.command,
        "places": heading.places,
        "repeats": plan.repeats,
        "parameters": [
            {"name": name, "unit": units.get(name, ""), "word": any(isinstance(point.values[i], str) for point in found),
             "log": name in plan.log, "sampled": name in plan.sampled}
            for i, name in enumerate(plan.names)
        ],
        "metrics": [{"name": name, "unit": unit} for name, unit in shown.items()],
        "rows": [_row(point, list(shown), plan, heading.folder, beside) for point in found[:MOST]],
        "facts": [*heading.facts, *versions().items(), *left_out],
    }  # fmt: skip
    return filled(__package__, "sweep", content)


def summary(found: Sequence[Point], wall: float) -> str:
    """How many cases there are, how they ended, how long they took."""
    counts = Counter(row.status for point in found for row in point.rows)
    ends = ", ".join(f"{n} {status}" for status, n in counts.items())
    computed = sum(row.wall_s for point in found for row in point.rows if math.isfinite(row.wall_s))
    took = f", {wall:.3g} s for this command" if math.isfinite(wall) else ""
    return f"{sum(counts.values())} cases: {ends}; {computed:.3g} s of computing{took}"


def _row(point: Point, names: Sequence[str], plan: Plan, folder: Path | None, beside: Path) -> dict[str, Any]:
    """One point: number, values, status, why, means, standard errors, run time, its report."""
    first, means = point.rows[0], [point.mean(name) for name in names]
    why = next((row.message for row in point.rows if row.status != "OK"), "")
    row: dict[str, Any] = {"k": first.number, "v": point.values, "s": point.status, "w": why, "t": _fine(first.wall_s)}
    row["m"] = [_fine(m.value) for m in means]
    if plan.repeats > 1:
        row |= {"e": [_fine(m.error) for m in means], "seed": first.parameters["seed"]}
    report = folder / report_name(first.parameters) if folder else None
    if report is not None and report.exists():
        row["p"] = Path(os.path.relpath(report, beside)).as_posix()
    return row


def _fine(value: float) -> float | None:
    return float(f"{value:.7g}") if math.isfinite(value) else None
