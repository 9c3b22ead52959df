"""One case of the study `extremes`, for its sweep: a run, what it is held against, and the verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from buckler.studies.kit.parameters import StudyParameters, choice, integer, quantity
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult
from buckler.studies.trust import extremes_input, extremes_linkages, extremes_play, extremes_strips
from buckler.studies.trust.extremes_case import VERDICTS, Case, Finding, judge
from buckler.studies.trust.extremes_drawn import FAMILIES as DRAWN
from buckler.studies.trust.extremes_truth import drawn_case

FIXED = (
    "slider-crank, range", "slider-crank, steps", "slider-crank, mesh", "four-bar, ideal joints", "four-bar with clearance",
    "four-bar with clearance, flexible rocker", "static strip", "strip pressed in line", "wrong input",
)  # fmt: skip
"""Families of cases that stand in a list; a seed shuffles each."""
FAMILIES = (*DRAWN, *FIXED)
LISTS = (extremes_strips, extremes_linkages, extremes_play, extremes_input)


def everything() -> list[Case]:
    """All cases that stand in a list."""
    return [case for part in LISTS for case in part.every()]


def slug(family: str) -> str:
    """A family's name on the command line."""
    return family.replace(", ", "-").replace(" ", "-")


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of one case."""

    family: str = choice(slug(FAMILIES[0]), [slug(name) for name in FAMILIES], "family", "case")
    seed: int = integer(1, 0, 2**31 - 1, "draws the case", "case")
    number: int = integer(0, 0, 10**6, "place in its family", "case")
    timeout: float = quantity(60.0, "s", 0.1, 3600, "longest time of the run", "case")

    @property
    def case(self) -> Case:
        """What is run."""
        family = {slug(name): name for name in FAMILIES}[self.family]
        if family in DRAWN:
            return drawn_case(family, self.seed, self.number)
        listed = [case for case in everything() if case.family == family]
        order = np.random.default_rng([self.seed, FIXED.index(family)]).permutation(len(listed))
        if self.number >= len(listed):
            raise ValueError(f"number = {self.number}: the cases of '{family}' are 0 to {len(listed) - 1}")
        return listed[order[self.number]]


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run the case and its reference."""
    found = judge(parameters.case, parameters.timeout)
    metrics = {
        name: Metric(float(np.nan_to_num(value, nan=-1.0, posinf=1e300)), "1")
        for name, value in (("verdict", VERDICTS.index(found.verdict)), ("off", found.off), ("price", found.price))
    }
    said = "\n".join((found.family, found.name, found.worst, found.message))
    return StudyResult(parameters=parameters, status="OK", message=said, metrics=metrics)


def finding(message: str, verdict: float, off: float, price: float, wall_s: float) -> Finding:
    """Read a row of the sweep again."""
    family, name, worst, said = message.split("\n", 3)
    off, price = (np.nan if value < 0 else np.inf if value > 1e299 else value for value in (off, price))
    return Finding(family, name, VERDICTS[int(verdict)], off, worst, said, wall_s, price)
