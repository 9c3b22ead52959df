"""One world of the crank-rocker with clearance: everything that the paper leaves open has one value; does the rocker buffer
in it?

Rigid and flexible rocker, each by an ensemble whose members differ in what is unknown: the crank's angle at the start, drawn
over the turn, and the journals' places, drawn over the clearance. `buffering-claims` sweeps it over many worlds.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from buckler.mbs.elements.element import Body

from ..kit.parameters import integer, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, judged, metrics_table
from ..kit.style import Figure, plain_ticks, subplots
from .assumptions import ModalAssumptions
from .bars import FourBarParameters, flexible
from .buffering_measures import CLAIMS, curves, mean, numbers, ratio, trouble
from .turns import Ensemble, ensemble

JOURNALS = 0.2
"""Standard deviation of the bars' places at the start, in clearances: journals then lie all over their bushes."""
LATEST = 2000
"""Members of which the seeds of one world are its own."""


@dataclass(frozen=True)
class Parameters(FourBarParameters, ModalAssumptions):
    """Parameters of one world."""

    tolerance: float = quantity(1e-6, "1", 1e-12, 1e-3, "of a step, of the longest bar and a radian", "numerics")
    members: int = integer(5, 2, LATEST, "runs of each rocker; their scatter gives the standard error", "statistics")
    cycles: int = integer(2, 1, 10_000, "turns measured of each run", "statistics")
    settle: int = integer(1, 0, 10_000, "turns before that", "statistics")
    seed: int = integer(0, 0, 2**30, "draws the starts", "statistics")

    def rockers(self) -> dict[str, Any]:
        """Bodies of either rocker."""
        return {"rigid": None, "flexible": flexible(self)}


def measured(p: Parameters, rocker: Body | None, seeds: Sequence[int]) -> Ensemble:
    """Run members from starts of their own and join their turns. The one call of a solver; another may stand here."""

    def member(seed: int) -> Ensemble:
        made = p.bars(rocker=rocker, angle=float(np.random.default_rng([seed, 1]).uniform(0, 2 * np.pi)))
        return ensemble(
            made, p.cycles, [seed], settle=p.settle, spread=JOURNALS * p.clearance, tolerance=p.tolerance, measure=curves(made)
        )

    with ThreadPoolExecutor(p.workers) as pool:
        return Ensemble.joined(list(pool.map(member, seeds)))


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run both rockers and hold every claim's number of the one against the other's."""
    found: dict[str, Ensemble] = {}
    for batch, (name, rocker) in enumerate(progress(list(p.rockers().items()), label="rockers")):
        first = LATEST * (2 * p.seed + batch)  # other seeds for each rocker and world: errors are independent
        found[name] = measured(p, rocker, range(first, first + p.members))
    metrics: dict[str, Metric] = {}
    wrong: list[str] = []
    for name, one in found.items():
        metrics |= numbers(name, one)
        metrics[f"{name}.depth_over_clearance"] = Metric(float(one.turns["depth"].max() / p.clearance), "1")
        wrong += trouble(name, one)
    for claim in CLAIMS:
        metrics[f"{claim.name}.ratio"] = ratio(*(mean(found[name], claim) for name in ("flexible", "rigid"))).metric
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics=metrics,
        work={"turns": 2 * p.members * (p.settle + p.cycles)},
        tables=[replace(metrics_table(metrics), notes=f"{p.stated()}.")],
    )


def figure(result: StudyResult) -> Figure:
    """Ratios of all claims with bars of two standard errors."""
    fig, ax = subplots(height=90)
    found: Any = [result.metrics[f"{claim.name}.ratio"] for claim in CLAIMS]
    value = np.array([m.value for m in found])
    places = np.arange(len(CLAIMS))[::-1]
    ax.errorbar(value, places, xerr=2 * value * np.array([m.error for m in found]), fmt="o", capsize=2)
    ax.axvline(1, color="#999999", linewidth=0.8)
    ax.set_yticks(places, [claim.text for claim in CLAIMS])
    ax.set(xscale="log", xlabel="flexible/rigid, ± two standard errors")
    plain_ticks(ax.xaxis)
    return fig
