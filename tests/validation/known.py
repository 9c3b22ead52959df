"""A known answer, its verdict, and the table of many."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from time import process_time
from typing import NamedTuple

import numpy as np

from buckler.studies.extremes.case import Verdict, decide

ROUNDING = 1e-9
"""Relative error that a reported error need not cover."""


class Answer(NamedTuple):
    """Number found and number that is right, in one unit.

    Attributes
    ----------
    allowed : error allowed of it, in its unit
    reported : error that the solver reports, in its unit, nan where it reports none: it must cover the true one
    status, message : of the run it comes from
    """

    found: float
    right: float
    allowed: float
    unit: str = "1"
    reported: float = float("nan")
    status: str = "OK"
    message: str = ""

    @property
    def error(self) -> float:
        """Error, in the unit of the answer."""
        return abs(self.found - self.right)

    @property
    def ratio(self) -> float:
        """Error over what is allowed, and over what is reported where that is less; infinite for no number."""
        covered = self.reported + ROUNDING * abs(self.right)
        return float(np.nan_to_num(self.error / np.fmin(self.allowed, covered), nan=np.inf))

    @property
    def verdict(self) -> Verdict:
        """Verdict on the answer; one without a reference has right = nan."""
        return decide(self.status, self.message, None if np.isnan(self.right) else self.ratio)


def relate(found: float, right: float, allowed: float, unit: str = "1", **more: float | str) -> Answer:
    """Make an answer whose allowed error is relative to what is right."""
    return Answer(float(found), float(right), allowed * abs(float(right)), unit, **more)  # type: ignore[arg-type]


class Known(NamedTuple):
    """Question, group (a row of the table), name and solution of a known answer.

    `accepted` are the verdicts that it may have, `still` is the one that it has though it should not.
    """

    question: str
    group: str
    name: str
    solve: Callable[[], Answer]
    slow: bool = False
    accepted: tuple[Verdict, ...] = (Verdict.RIGHT,)
    still: str = ""


class Solved(NamedTuple):
    """Known answer that has been solved, with its processor time [s]."""

    known: Known
    answer: Answer
    spent_s: float


def solve(known: Known) -> Solved:
    """Solve for a known answer and take the time."""
    begin = process_time()
    answer = known.solve()
    return Solved(known, answer, process_time() - begin)


HEADERS = ("answers", "number", "worst: found", "right", "error", "allowed", "verdicts", "processor time [s]")


def tabulate(solved: Iterable[Solved]) -> list[str]:
    """Write one Markdown table: a row a group, with its worst answer."""
    groups: dict[str, list[Solved]] = {}
    for each in solved:
        groups.setdefault(each.known.group, []).append(each)
    rows = [f"| {' | '.join(HEADERS)} |", "|---" * len(HEADERS) + "|"]
    for group, some in groups.items():
        compared = [each for each in some if each.answer.verdict is not Verdict.NO_REFERENCE] or some
        worst = max(compared, key=lambda each: each.answer.ratio)
        answer, count = worst.answer, Counter(each.answer.verdict for each in some)
        verdicts = ", ".join(f"{count[verdict]} {verdict}" for verdict in Verdict if count[verdict])
        unit = "" if answer.unit == "1" else f" {answer.unit}"
        name = f"{worst.known.name}: " if len(some) > 1 else ""
        numbers = f"{name}{answer.found:.9g}{unit} | {answer.right:.9g} | {answer.error:.1e} | {answer.allowed:.0e}"
        rows.append(f"| {group} | {len(some)} | {numbers} | {verdicts} | {sum(each.spent_s for each in some):.1f} |")
    return rows
