"""Verdicts of the checks of a run, and tables of its errors, work and settings, for pages."""

import re
from collections.abc import Iterator
from math import isfinite, isnan
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
    "ACCURACY": "Is the error at most the one asked for, or without one, that allowed by convention?",
    "SOLVERS": "Does the other solver say the same?",
}
"""Questions that the checks answer. The message of a check begins with the name of the check, such as `ENERGY: `.

The errors allowed by convention are listed in `accuracy.demand`."""
ORDER = ("failed", "no complaint", "not applicable", "not run")
"""Verdicts in the order in which pages show them."""
NOT_APPLICABLE = "not_applicable"
"""Key of a result's provenance for a table: name of each check that did not apply, and the reason."""
NAME = r"[A-Z_]{3,}: "
"""Pattern of the name of a check, with which its message begins. After a semicolon within a message no name follows."""


class CheckVerdict(NamedTuple):
    """Verdict of a check, one of `ORDER`, with the check's name, question and message."""

    name: str
    question: str
    verdict: str
    message: str


def verdicts(result: Result) -> list[CheckVerdict]:
    """Return the verdicts of all checks of a run, in the order of `ORDER`."""
    reasons: dict[str, list[str]] = {}
    for reason in re.split(f"; (?={NAME})", result.message) if result.status == "SUSPECT" and result.message else ():
        name, _, message = reason.partition(": ") if re.match(NAME, reason) else ("OTHER", "", reason)
        reasons.setdefault(name, []).append(message)
    rows, not_applicable = [], result.provenance.get(NOT_APPLICABLE, {})
    # failed checks first, in the order of the message; OTHER has no question
    for name, question in (dict.fromkeys(reasons, "") | QUESTIONS).items():
        if name == "SOLVERS" and isnan(result.verified):  # no difference from the other solver: it did not run
            continue
        verdict, message = "no complaint", ""
        if name in reasons:
            verdict, message = "failed", "; ".join(reasons[name])
        elif name == "ACCURACY" and not result.error.known:
            # without a solver `simulate` chooses one and makes finer runs
            verdict, message = "not run", "one run alone; give an accuracy, or no solver, and finer runs tell its error"
        elif not result.status.finished:
            verdict = "not run"
        elif name in not_applicable:
            verdict, message = "not applicable", not_applicable[name]
        rows.append(CheckVerdict(name, question, verdict, message))
    return sorted(rows, key=lambda row: ORDER.index(row.verdict))


def summary(result: Result) -> str:
    """Summarise a run in one line: duration, steps, time of computing."""
    span = f"{result.time[-1]:.4g} s of motion" if len(result.time) else "no motion"
    return f"{span}, {result.work.get('steps', 0):,.0f} steps, {result.work.get('wall_s', 0):.3g} s of computing"


def facts(result: Result) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return tables of errors, work, settings and versions, each as its heading and its rows of name and value."""
    error = [("estimated error of the motion", "not asked for; simulate(..., accuracy=1e-3) tells it")]
    is_asked = result.asked > 0  # nan without an accuracy
    if is_asked or result.error.known:
        error = [("estimated error of the motion", write_percent(result.error.motion))]
        error += [("asked for", write_percent(result.asked))] if is_asked else []
    if result.error.kind:
        error.append(("estimated by", result.error.kind))
    if result.verified >= 0:
        error.append(("difference from the other solver", write_percent(result.verified)))
    if result.energy:
        error.append(("error of the energy balance", write_percent(result.energy_balance)))
    names = {name: "wall time [s]" if name == "wall_s" else name.replace("_", " ") for name in result.work}
    work = [(names[name], f"{value:.6g}") for name, value in result.work.items()]
    versions = [(name, str(value)) for name, value in result.provenance.items() if isinstance(value, str | int | float)]
    groups = [("Error", error), ("Work", work)]
    if notes := result.provenance.get("notes"):
        groups.insert(0, ("Notes", [("worth knowing", note) for note in notes]))
    for name, value in result.provenance.items():
        if isinstance(value, dict) and name != NOT_APPLICABLE:  # shown with the checks
            groups.append((name.capitalize(), list(flatten(value))))
    return [*groups, ("Run on", versions)]


def flatten(value: dict[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Yield the names and values of nested settings, as in `steps.max_step`, without those that are not set."""
    for name, inner in value.items():
        if name == "kind":  # the name of a class: of the solver or, below a name, of settings such as `steps`
            yield before.removesuffix(".") or "solver", str(inner)
        elif isinstance(inner, dict):
            yield from flatten(inner, f"{before}{name}.")
        elif inner is not None:
            yield before + name, f"{inner:.6g}" if isinstance(inner, float) else str(inner)


def write_percent(value: float) -> str:
    """Write a relative error."""
    return f"{100 * value:.2g} %" if isfinite(value) else "not known"
