"""Two solvers that share the elements and none of the equations, on the same mechanisms: is their difference what both estimate?

Exudyn with an accuracy asked for, and the compiled solver with a known error, run the ready mechanisms, published problems
and mechanisms drawn at random. The difference of the two must stay within the sum of their estimates, and they must report the
same forces.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Beam, Cable, Clearance, Exudyn, Rigid, Section, Spectral, Status, Strut
from buckler.mbs.accuracy.deliver import LEAST, Climb, Delivery, deliver, disagreement
from buckler.mbs.accuracy.goal import Asked
from buckler.mbs.accuracy.ladder import ladder_of
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, Impact
from buckler.mbs.library import BAR, PAPER, crank_rocker, slider_crank
from buckler.mbs.spectral.run import once

from ..kit.drawn import EVERYTHING, Draw, draw
from ..kit.parameters import StudyParameters, integer, quantity
from ..kit.published import STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Figure, subplots
from . import benchmark_problems as problems
from .accuracy_truth import runner

BEYOND = 3.0
"""Difference over the sum of the estimates from which the two contradict each other."""
ROUNDING = 1e-7
"""Sum of the estimates at least."""
READY = 11
"""Ready mechanisms and published problems."""
NOTES = """\
difference: of the two runs, of all signals with signs, of the one that is farthest beyond both estimates; estimate: what each
solver says the error of that signal is. A case counts where both have ended with an estimate."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    cases: int = integer(23, 1, 10_000, "mechanisms: the 11 ready ones and published problems first, then random ones", "scenes")
    seed: int = integer(0, 0, 2**31 - 1, "draws the random mechanisms", "scenes")
    accuracy: float = quantity(1e-2, "1", 1e-5, 0.1, "asked of both solvers", "numerics")
    timeout: float = quantity(8.0, "s", 0.1, 3600, "longest time a solver may take for a case", "numerics")


class Compared(NamedTuple):
    """What two solvers made of one mechanism, in the signal that is farthest beyond both estimates; `alone` is how one of them
    failed, not for want of time, where the other ended.
    """

    name: str
    difference: float
    where: str
    engine: float
    compiled: float
    engine_s: float
    compiled_s: float
    said: str
    alone: str = ""
    allowed: float = 1.0

    @property
    def ratio(self) -> float:
        """Difference over the sum of the estimates; nan where one has none."""
        return self.difference / self.allowed


def known() -> Iterator[Draw]:
    """The ready mechanisms and the published problems, over short times."""
    strip = Section(STRIP_WIDTH, 2e-3).damped(0.01, PAPER.coupler)

    def play(point: str, pin: str, bush: str) -> Clearance:
        return Clearance(point, pin, bush, 5e-3, 1e-4, Impact(1e8, 1e3, 1e-4), AdamsFriction(0.3, 0.2))

    def slider(coupler: Any, speed: float = 20.0, law: Any = None) -> Any:
        return slider_crank(coupler, law=law, mass=0.3, speed=speed)

    struck = slider(Strut(Section(STRIP_WIDTH, 3e-4)), 6.0, CarvalhoMartins(1e5, 0.5, exponent=1.0))
    yield Draw("slider-crank, strut, stop", struck, 0.5)
    yield Draw("slider-crank, beam", slider(Beam(strip)), 0.2)
    yield Draw("slider-crank, cable", slider(Cable(strip, imperfection=1e-3)), 0.2)
    yield Draw("crank-rocker", crank_rocker(Rigid(BAR), speed=30.0), 0.2)
    yield Draw("Andrews", problems.andrews(), 0.01)
    yield Draw("crank-rocker, clearance", crank_rocker(Rigid(BAR), speed=30.0, play=play), 0.01)
    yield Draw("crank-rocker, clearance, beam", crank_rocker(Beam(BAR), speed=30.0, play=play), 0.01)
    yield Draw("four-bars", problems.four_bars(2), 1.0)
    yield Draw("Simeon", problems.simeon(), 0.02)
    yield Draw("double pendulum", problems.double_pendulum(), 1.0)
    yield Draw("Princeton", problems.princeton(8.896), 0.05)


def pairs(p: Parameters) -> Iterator[Draw]:
    """The ready mechanisms first, then those drawn of the whole grammar."""
    yield from islice(known(), p.cases)
    for k in range(p.cases - READY):
        yield draw(p.seed, k, EVERYTHING)


def compare(pair: Draw, p: Parameters) -> Compared:
    """Run both solvers."""
    ours, engine_s = _known(pair, p, Exudyn())
    once(pair.mechanism, 1e-6 * pair.duration, Spectral())  # compiles the mechanism's own functions
    other, compiled_s = _known(pair, p, Spectral())
    said = [_said(each, p) for each in (ours, other)]
    ended = [each.run.failure is None and each.errors.known for each in (ours, other)]
    if not all(ended):
        failed = [each.run.failure for each in (ours, other) if each.run.failure]
        alone = f"{failed[0][0]}: {failed[0][1]}" if len(failed) == 1 and failed[0][0] is not Status.TIMED_OUT else ""
        nan = float("nan")
        return Compared(pair.name, nan, "", nan, nan, engine_s, compiled_s, "; ".join(filter(None, said)), alone)
    _, found = disagreement(ours.run, other.run, ours.errors, other.errors, LEAST * p.accuracy)
    engine, compiled = (each.errors.signals.get(found.name, 0.0) for each in (ours, other))
    notes = "; ".join(filter(None, said))
    return Compared(pair.name, found.error, found.name, engine, compiled, engine_s, compiled_s, notes, allowed=found.allowed)


def _known(pair: Draw, p: Parameters, solver: Exudyn | Spectral) -> tuple[Delivery, float]:
    """A solver's run with its errors, and its time."""
    begin = perf_counter()
    climb = Climb(ladder_of(pair.mechanism, pair.duration, p.accuracy, solver), runner(p.timeout))
    return deliver(climb, Asked(p.accuracy)), perf_counter() - begin


def _said(found: Delivery, p: Parameters) -> str:
    """What a solver says of its own run: how it failed, or by how much it misses."""
    name = type(found.run.solver).__name__
    if found.run.failure:
        return f"{name} {found.run.failure[0]}: {found.run.failure[1]}"
    missed = found.missed(Asked(p.accuracy))
    return f"{name} {missed}" if missed else ""


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run both solvers on each mechanism."""
    jobs = list(pairs(p))
    found = [compare(pair, p) for pair in progress(jobs, label="mechanisms")]
    counted = [c for c in found if np.isfinite(c.ratio)]
    beyond = [c for c in counted if c.ratio > BEYOND]
    times = [c.engine_s / c.compiled_s for c in counted]
    median = float(np.median(times)) if times else float("nan")
    metrics = {
        "cases": Metric(float(len(found)), "1"),
        "compared": Metric(float(len(counted)), "1"),
        "within_estimates": Metric(float(np.mean([c.ratio <= 1 for c in counted])) if counted else float("nan"), "1"),
        "beyond_three": Metric(float(len(beyond)), "1"),
        "median_ratio": Metric(median, "1"),
    }
    wrong = [f"{c.name}: {c.difference:.1e} apart in {c.where}, estimates {c.engine:.1e} and {c.compiled:.1e}" for c in beyond]
    wrong += [f"{c.name}: only one solver ended, {c.alone}" for c in found if c.alone]
    told = f"{len(counted)} of {len(found)} mechanisms compared, {len(counted) - len(beyond)} no farther apart than 3 estimates"
    names = ("difference", "engine", "compiled", "engine_s", "compiled_s", "ratio")
    return StudyResult(
        parameters=p,
        **judged(wrong or [told] * (not counted), told),
        metrics=metrics,
        signals={name: np.array([getattr(c, name) for c in found]) for name in names},
        tables=[_table(found)],
    )


def _table(found: list[Compared]) -> Table:
    def shown(value: float) -> str:
        return f"{value:.2g}"

    rows = [
        [c.name, shown(c.difference), c.where, shown(c.engine), shown(c.compiled), shown(c.ratio),
         f"{1e3 * c.engine_s:.3g}", f"{1e3 * c.compiled_s:.3g}", c.said]
        for c in found
    ]  # fmt: skip
    estimates = ["Exudyn's estimate", "compiled's", "difference/sum"]
    headers = ["mechanism", "difference", "of", *estimates, "Exudyn [ms]", "compiled [ms]", "note"]
    return Table(headers, rows, "Two solvers of the same mechanisms", NOTES)


def figure(result: StudyResult) -> Figure:
    """Difference over the sum of the estimates, a mark a mechanism."""
    s = result.signals
    fig, ax = subplots(height=90)
    both = np.maximum(s["engine"] + s["compiled"], ROUNDING)
    ax.loglog(both, np.maximum(s["difference"], 1e-12), "o")
    line = np.array([ROUNDING, 0.1])
    ax.loglog(line, line, color="#000000", linewidth=0.8, label="the sum")
    ax.loglog(line, BEYOND * line, color="#000000", linewidth=0.8, linestyle=":", label=f"{BEYOND:g} times the sum")
    ax.legend()
    ax.set(xlabel="sum of both estimates", ylabel="difference of the solvers")
    return fig
