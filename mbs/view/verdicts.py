"""Verdicts of the checks of a run, one row each, and tables of its errors, work and settings, for pages."""

from __future__ import annotations

import re
from collections.abc import Iterator
from math import isfinite
from typing import Any, NamedTuple

from ..record.result import Result

QUESTIONS = {
    "NOT_FINITE": "Are all signals finite?",
    "TIME": "Does time increase?",
    "CONSTRAINTS": "Do joints, guides and couplings hold together?",
    "ENERGY": "Does the energy balance close, and does no law make energy?",
    "CONTACT": "Do contacts only push?",
    "PENETRATION": "Are contacts stiff enough for this motion?",
    "UNBUCKLED": "Did compressed strips buckle?",
    "CROSSED": "Did massless strips stay in the range of their law?",
    "BRANCH": "Does the linkage stay away from dead centres?",
    "LINEAR": "Do modal links stay in the range of linear theory?",
    "ACCURACY": "Is the error what was asked for, or what a run without settings may have?",
    "SOLVERS": "Does the other solver say the same?",
}
"""Questions of the checks, by the first word of their sentences."""
ORDER = ("failed", "no complaint", "not applicable", "not run")
UNKNOWN = "one run alone; with an accuracy, or without a solver, finer runs tell its error"
IDLE = "not_applicable"
"""Key of a result's provenance: the checks that did not apply, and why."""


BEGINNING = re.compile(r"; (?=[A-Z_]{3,}: )")
"""Pattern of the beginning of the next check's sentence; sentences may contain semicolons."""


class CheckVerdict(NamedTuple):
    """One check: its name, its question, 'failed', 'no complaint', 'not applicable' or 'not run', and its message."""

    name: str
    question: str
    verdict: str
    message: str


def verdicts(result: Result) -> list[CheckVerdict]:
    """Return all checks of a result, those that failed first."""
    reasons: dict[str, list[str]] = {}
    for reason in BEGINNING.split(result.message) if result.status == "SUSPECT" and result.message else ():
        name, _, message = reason.partition(": ") if BEGINNING.match("; " + reason) else ("OTHER", "", reason)
        reasons.setdefault(name, []).append(message)
    rows, idle = [], result.provenance.get(IDLE, {})
    finished = result.status.finished
    for name, question in ({name: "" for name in reasons} | QUESTIONS).items():
        if name == "SOLVERS" and not result.verified >= 0:
            continue
        unknown = name == "ACCURACY" and not result.error.known
        verdict = (
            "failed" if name in reasons else "not run" if unknown or not finished else "not applicable" if name in idle
            else "no complaint"
        )  # fmt: skip
        message = idle[name] if verdict == "not applicable" else UNKNOWN if unknown else "; ".join(reasons.get(name, []))
        rows.append(CheckVerdict(name, question, verdict, message))
    return sorted(rows, key=lambda row: ORDER.index(row.verdict))


def summary(result: Result) -> str:
    """Summarise the run in a line."""
    span = f"{result.time[-1]:.4g} s of motion" if len(result.time) else "no motion"
    return f"{span}, {result.work.get('steps', 0):,.0f} steps, {result.work.get('wall_s', 0):.3g} s of computing"


def facts(result: Result) -> list[tuple[str, list[tuple[str, str]]]]:
    """Tables of the page: heading, then rows of name and value."""
    error = [("estimated error of the motion", "not asked for; simulate(..., accuracy=1e-3) tells it")]
    if result.asked > 0 or result.error.known:
        error = [("estimated error of the motion", share(result.error.motion))]
        error += [("asked for", share(result.asked))] if result.asked > 0 else []
    if result.error.kind:
        error.append(("estimated by", result.error.kind))
    if result.verified >= 0:
        error.append(("difference from the other solver", share(result.verified)))
    if result.energy:
        error.append(("error of the energy balance", share(result.energy_balance)))
    spent = {**result.work, "share_of_the_run_shown": result.work["share"]} if "share" in result.work else result.work
    work = [
        (name.replace("_", " ").replace("wall s", "wall time [s]"), f"{value:.6g}")
        for name, value in spent.items()
        if name != "share"
    ]
    versions = [(name, str(value)) for name, value in result.provenance.items() if isinstance(value, str | int | float)]
    groups = [("Error", error), ("Work", work)]
    if notes := result.provenance.get("notes"):
        groups.insert(0, ("Notes", [("worth knowing", note) for note in notes]))
    for name, value in result.provenance.items():
        if isinstance(value, dict) and name != IDLE:  # shown with the checks
            groups.append((name.capitalize(), list(flat(value))))
    return [*groups, ("Run on", versions)]


def flat(value: dict[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Rows of nested settings without those that are not set."""
    for name, inner in value.items():
        if name == "kind":
            yield before.removesuffix(".") or "solver", str(inner)
        elif isinstance(inner, dict):
            yield from flat(inner, f"{before}{name}.")
        elif inner is not None:
            yield before + name, f"{inner:.6g}" if isinstance(inner, float) else str(inner)


def share(value: float) -> str:
    """Format a relative error."""
    return f"{100 * value:.2g} %" if isfinite(value) else "not known"
