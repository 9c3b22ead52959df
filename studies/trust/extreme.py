"""One case of the study `extremes`, for its sweep: a run, what it is held against, and the verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from buckler.elastica import pinned
from buckler.mbs import Beam, Cable, Section
from buckler.mbs.engine.pressed import pinned_strip
from buckler.mbs.library import PAPER

from ..kit.drawn import FAMILIES as DRAWN
from ..kit.parameters import StudyParameters, choice, integer, quantity
from ..kit.published import STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult
from . import extremes_listed
from .extremes_case import VERDICTS, Case, CaseOutcome, Finding, judge
from .extremes_truth import drawn_case, listed_case

FIXED = (
    "slider-crank, range", "slider-crank, steps", "slider-crank, mesh", "four-bar, ideal joints", "four-bar with clearance",
    "four-bar with clearance, flexible rocker", "static strip", "strip pressed in line", "wrong input",
)  # fmt: skip
"""Families of cases that stand in a list; a seed shuffles each."""
FAMILIES = (*DRAWN, *FIXED)


@cache
def everything() -> tuple[Case, ...]:
    """All cases that stand in a list."""
    return (*map(listed_case, extremes_listed.every()), *static_strips())


def static_strips() -> Iterator[Case]:
    """Meshes and shortenings, and thicknesses, of a strip at rest against the exact elastica."""
    meshes: dict[str, Callable[[Section], Beam | Cable]] = {
        **{f"{n} elements of 3 nodes": partial(Beam, elements=n) for n in (1, 2, 4, 8)},
        **{f"{n} elements of 2 nodes": partial(Beam, elements=n, nodes=2) for n in (4, 16)},
        **{f"{n} cables": partial(Cable, elements=n) for n in (1, 4, 16)},
    }
    paths = {"from 1e-6": (1e-6, 1e-5, 1e-4), "to 0.3": (1e-3, 0.1, 0.3), "to 0.95": (0.01, 0.5, 0.95), "to 1.5": (0.1, 1.0, 1.5)}
    rows = [(f"{mesh}, {name}", mesh, 3e-4, u) for mesh in meshes for name, u in paths.items()]
    rows += [(f"h = {1e3 * h:g} mm", "8 elements of 3 nodes", h, paths["to 0.95"]) for h in (1e-5, 5e-5, 2e-3, 5e-3)]

    def at_rest(body: Beam | Cable, u: tuple[float, ...], _timeout: float) -> CaseOutcome:
        states = pinned_strip(body, PAPER.coupler, u)
        return CaseOutcome(str(states.status), states.message, {"load": states.load})

    for name, mesh, thickness, u in rows:
        run = partial(at_rest, meshes[mesh](Section(STRIP_WIDTH, thickness)), u)
        yield Case("static strip", name, run, lambda u=u: {"load": pinned.load(np.array(u))})  # type: ignore[misc]


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


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run the case and its reference."""
    found = judge(p.case, p.timeout)
    metrics = {
        name: Metric(float(np.nan_to_num(value, nan=-1.0, posinf=1e300)), "1")
        for name, value in (("verdict", VERDICTS.index(found.verdict)), ("off", found.off), ("price", found.price))
    }
    said = "\n".join((found.family, found.name, found.worst, found.message))
    return StudyResult(parameters=p, status="OK", message=said, metrics=metrics)


def finding(row: Any) -> Finding:
    """Read a row of the sweep again."""
    family, name, worst, said = row.message.split("\n", 3)
    off, price = (np.nan if value < 0 else np.inf if value > 1e299 else value for value in map(row.value, ("off", "price")))
    return Finding(family, name, VERDICTS[int(row.value("verdict"))], off, worst, said, row.wall_s, price)
