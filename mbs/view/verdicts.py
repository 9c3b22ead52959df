"""Verdicts of the checks of a run, one row each, for pages and tables."""

from __future__ import annotations

import re
from typing import NamedTuple

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
"""Questions of the checks, by the word their sentences begin with."""
ORDER = ("failed", "no complaint", "not applicable", "not run")
UNKNOWN = "one run alone; with an accuracy, or without a solver, finer runs tell its error"
IDLE = "not_applicable"
"""Key of a result's provenance: the checks that had nothing to look at, and why."""


BEGINNING = re.compile(r"; (?=[A-Z_]{3,}: )")
"""Pattern of the beginning of the next check's sentence; a sentence may have semicolons of its own."""


class Verdict(NamedTuple):
    """One check: its name, what it asks, 'failed', 'no complaint', 'not applicable' or 'not run', and what it said."""

    name: str
    question: str
    verdict: str
    said: str


def verdicts(result: Result) -> list[Verdict]:
    """Return all checks of a result, those that failed first."""
    reasons: dict[str, list[str]] = {}
    for reason in BEGINNING.split(result.message) if result.status == "SUSPECT" and result.message else ():
        name, _, said = reason.partition(": ") if BEGINNING.match("; " + reason) else ("OTHER", "", reason)
        reasons.setdefault(name, []).append(said)
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
        said = idle[name] if verdict == "not applicable" else UNKNOWN if unknown else "; ".join(reasons.get(name, []))
        rows.append(Verdict(name, question, verdict, said))
    return sorted(rows, key=lambda row: ORDER.index(row.verdict))
