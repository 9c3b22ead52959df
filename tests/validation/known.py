"""Problem with a known answer, verdict on what a solver found, table of many.

A verdict is one of five: right, named, false alarm, silent, no reference; see docs/validation.md.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from time import process_time
from typing import NamedTuple

import numpy as np

from buckler.studies.extremes.case import Verdict, decide

ROUNDING = 1e-9
"""Relative error that a reported error need not cover, as it is rounding."""


class Answer(NamedTuple):
    """Number that a solver found, beside the right one; both, and all errors, have the unit `unit`."""

    found: float
    right: float  # nan without a reference
    allowed: float  # largest error of a right answer
    unit: str = "1"
    reported: float = float("nan")  # error that the solver reports, which must cover the true one; nan if it reports none
    status: str = "OK"  # of the run
    message: str = ""  # of the run

    @property
    def error(self) -> float:
        """True error."""
        return abs(self.found - self.right)

    @property
    def ratio(self) -> float:
        """True error over the smaller of the allowed and the reported one; infinite if there is no number."""
        covered = self.reported + ROUNDING * abs(self.right)
        limit = np.fmin(self.allowed, covered)
        return float(np.nan_to_num(self.error / limit, nan=np.inf)) if limit != 0 else (np.inf if self.error else 0.0)

    @property
    def verdict(self) -> Verdict:
        """Verdict on the answer."""
        return decide(self.status, self.message, None if np.isnan(self.right) else self.ratio)


def relate(found: float, right: float, allowed: float, unit: str = "1", **more: float | str) -> Answer:
    """Make an answer whose allowed error is relative to the right number."""
    return Answer(float(found), float(right), allowed * abs(float(right)), unit, **more)  # type: ignore[arg-type]


class Known(NamedTuple):
    """Problem with a known answer."""

    question: str  # key in `QUESTIONS`
    group: str  # row of the question's table
    name: str  # within the group
    solve: Callable[[], Answer]
    slow: bool = False
    accepted: tuple[Verdict, ...] = (Verdict.RIGHT,)  # verdicts that it may have
    still: str = ""  # verdict that it is known to have though it is not accepted


class Solved(NamedTuple):
    """Solved problem."""

    known: Known
    answer: Answer
    spent_s: float  # processor time [s]


def solve(known: Known) -> Solved:
    """Solve a problem and measure its processor time."""
    begin = process_time()
    answer = known.solve()
    return Solved(known, answer, process_time() - begin)


HEADERS = ("answers", "number", "worst: found", "right", "error", "allowed", "verdicts", "processor time [s]")


def tabulate(solved: Iterable[Solved]) -> list[str]:
    """Write a Markdown table with one row for each group, which shows its worst answer."""
    groups: dict[str, list[Solved]] = {}
    for each in solved:
        groups.setdefault(each.known.group, []).append(each)
    rows = [f"| {' | '.join(HEADERS)} |", "|---" * len(HEADERS) + "|"]
    for group, members in groups.items():
        compared = [each for each in members if each.answer.verdict is not Verdict.NO_REFERENCE] or members
        worst = max(compared, key=lambda each: each.answer.ratio)
        answer, count = worst.answer, Counter(each.answer.verdict for each in members)
        verdicts = ", ".join(f"{count[verdict]} {verdict}" for verdict in Verdict if count[verdict])
        unit = "" if answer.unit == "1" else f" {answer.unit}"
        name = f"{worst.known.name}: " if len(members) > 1 else ""
        numbers = f"{name}{answer.found:.9g}{unit} | {answer.right:.9g} | {answer.error:.1e} | {answer.allowed:.0e}"
        rows.append(f"| {group} | {len(members)} | {numbers} | {verdicts} | {sum(each.spent_s for each in members):.1f} |")
    return rows
