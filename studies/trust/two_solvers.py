"""Two solvers that share the elements and none of the equations, on the same mechanisms: is their difference what both estimate?

Exudyn with an accuracy asked for, and the compiled solver with a known error, run the ready mechanisms, published problems
and mechanisms drawn at random. The difference of the two must stay within the sum of their estimates, and they must report the
same forces.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

from buckler.mbs import Beam, Cable, Clearance, Result, Rigid, Section, Status, Strut
from buckler.mbs.accuracy.delivery import Task, comparable, judged
from buckler.mbs.accuracy.difference import FINEST, difference, differences
from buckler.mbs.accuracy.ways import by_exudyn
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, Impact
from buckler.mbs.library import BAR, PAPER, crank_rocker, slider_crank
from buckler.mbs.simulation import SOLVERS
from buckler.mbs.units import FORCES
from buckler.studies.kit.parameters import StudyParameters, integer, quantity
from buckler.studies.kit.published import STRIP_WIDTH
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import Figure, subplots
from buckler.studies.trust import benchmark_problems as problems
from buckler.studies.trust.drawn import EVERYTHING, Drawn, drawn

BEYOND = 3.0
"""Difference over the sum of the estimates from which the two contradict each other."""
CONTRARY = 0.5
"""Share of a force's impulse from which the solvers do not report the same force. A turned sign gives 2; 0.05 was the most of
58 mechanisms, and 0.17 in the four-bars, whose forces peak where they are singular. What vibrates at kilohertz leaves no impulse;
neither solver is asked for that."""
LOOKED = (*FORCES, "m/s^2")
"""Units of signals whose impulses are compared."""
PUSHING = 0.05
"""Impulse over the largest of its unit from which it is looked at."""
FINER = 1e-3
"""Accuracy of the run that explains a difference, of the one asked for."""
FINEST_KNOWN = 1e-7
"""Smallest error the compiled solver can be asked for."""
READY = 11
"""Ready mechanisms and published problems."""
NOTES = """\
difference: of the two runs, in the measure of an accuracy, and where it is largest. estimate: what each solver says its error is.
A run that misses its accuracy, fails or is SUSPECT says so itself; its case counts where both have ended with an estimate.
Where the two are farther apart than both estimates, a finer run tells which of them errs."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    cases: int = integer(23, 1, 10_000, "mechanisms: the 11 ready ones and published problems first, then random ones", "scenes")
    seed: int = integer(0, 0, 2**31 - 1, "draws the random mechanisms", "scenes")
    accuracy: float = quantity(1e-2, "1", 1e-5, 0.1, "asked of both solvers", "numerics")
    timeout: float = quantity(8.0, "s", 0.1, 3600, "longest time a solver may take for a case", "numerics")


class Compared(NamedTuple):
    """What two solvers made of one mechanism; `alone` is how one of them failed, not for want of time, where the other ended,
    `contrary` a force that they report otherwise.
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
    contrary: str = ""

    @property
    def ratio(self) -> float:
        """Difference over the sum of the estimates; nan where one has none."""
        return self.difference / max(self.engine + self.compiled, FINEST)


def known() -> Iterator[Drawn]:
    """The ready mechanisms and the published problems, over short times."""
    strip = Section(STRIP_WIDTH, 2e-3).damped(0.01, PAPER.coupler)

    def play(point: str, pin: str, bush: str) -> Clearance:
        return Clearance(point, pin, bush, 5e-3, 1e-4, Impact(1e8, 1e3, 1e-4), AdamsFriction(0.3, 0.2))

    def slider(coupler: Any, speed: float = 20.0, law: Any = None) -> Any:
        return slider_crank(coupler, law=law, mass=0.3, speed=speed)

    struck = slider(Strut(Section(STRIP_WIDTH, 3e-4)), 6.0, CarvalhoMartins(1e5, 0.5, exponent=1.0))
    yield Drawn("slider-crank, strut, stop", struck, 0.5)
    yield Drawn("slider-crank, beam", slider(Beam(strip)), 0.2)
    yield Drawn("slider-crank, cable", slider(Cable(strip, imperfection=1e-3)), 0.2)
    yield Drawn("crank-rocker", crank_rocker(Rigid(BAR), speed=30.0), 0.2)
    yield Drawn("Andrews", problems.andrews(), 0.01)
    yield Drawn("crank-rocker, clearance", crank_rocker(Rigid(BAR), speed=30.0, play=play), 0.01)
    yield Drawn("crank-rocker, clearance, beam", crank_rocker(Beam(BAR), speed=30.0, play=play), 0.01)
    yield Drawn("four-bars", problems.four_bars(2), 1.0)
    yield Drawn("Simeon", problems.simeon(), 0.02)
    yield Drawn("double pendulum", problems.double_pendulum(), 1.0)
    yield Drawn("Princeton", problems.princeton(8.896), 0.05)


def pairs(p: Parameters) -> Iterator[Drawn]:
    """The ready mechanisms first, then those drawn of the whole grammar."""
    yield from islice(known(), p.cases)
    for k in range(p.cases - READY):
        yield drawn(p.seed, k, EVERYTHING)


def compare(pair: Drawn, p: Parameters) -> Compared:
    """Run both solvers; the compiled one once more where the first run of a process compiled a law."""
    ours, engine_s = _engine(pair, p)
    other, error, compiled_s, failed = _compiled(pair, p, p.accuracy)
    theirs = "" if ours.ok else f"Exudyn {ours.status}: {ours.message}"
    said = "; ".join(filter(None, (theirs, failed)))
    unfinished = [each for each in (theirs * (ours.status is not Status.SUSPECT), failed) if each]
    if unfinished:
        alone = unfinished[0] if len(unfinished) == 1 and Status.TIMED_OUT not in unfinished[0] else ""
        return Compared(pair.name, float("nan"), "", ours.error.motion, error, engine_s, compiled_s, said, alone)
    found = differences(ours, other)
    where = max(found, key=lambda name: found[name], default="")
    case = Compared(pair.name, found.get(where, 0.0), where, ours.error.motion, error, engine_s, compiled_s, said)
    apart = impulses(ours, other, max(pair.mechanism.length(link.name) for link in pair.mechanism.links))
    name = max(apart, key=lambda name: apart[name], default="")
    if apart.get(name, 0.0) > CONTRARY:
        case = case._replace(contrary=f"impulses of {name} are {apart[name]:.2g} of themselves apart")
    return case._replace(said="; ".join(filter(None, (said, _explained(pair, p, ours, other, case))))) if case.ratio > 1 else case


def impulses(a: Result, b: Result, size: float) -> dict[str, float]:
    """Differences of the impulses up to each time of what exerts forces and torques, over their own norm; so of accelerations.

    Those that hardly push, by the largest of their unit, are left out; a torque also by the largest force on an arm of `size`, m.
    """
    times = np.union1d(a.time, b.time)

    def impulse(result: Result, name: str) -> Any:
        return np.interp(times, result.time, cumulative_trapezoid(result[name], result.time, initial=0.0))

    owners: dict[tuple[str, str], list[tuple[Any, Any]]] = {}
    for name in (name for name, unit in b.units.items() if unit in LOOKED):
        owners.setdefault((name.rpartition(".")[0], b.units[name]), []).append((impulse(a, name), impulse(b, name)))
    found: dict[tuple[str, str], tuple[float, float]] = {}
    most = dict.fromkeys(LOOKED, 0.0)
    for (owner, unit), each in owners.items():
        norm = float(np.sqrt(sum(np.mean(second**2) for _, second in each)))
        off = float(np.sqrt(sum(np.mean((first - second) ** 2) for first, second in each)))
        found[owner, unit], most[unit] = (off, norm), max(most[unit], norm)
    most["N m"] = max(most["N m"], most["N"] * size)
    return {f"{owner} [{unit}]": off / norm for (owner, unit), (off, norm) in found.items() if norm > PUSHING * most[unit]}


def _explained(pair: Drawn, p: Parameters, ours: Result, other: Result, case: Compared) -> str:
    """Which of the two errs: both against a finer run of the compiled solver."""
    accuracy = min(p.accuracy * FINER, case.difference / 30, case.compiled / 4)  # so that it is another run than the one judged
    finer, error, _, failed = _compiled(pair, p, accuracy)
    if failed:
        return f"no finer run: {failed}"
    return (
        f"from a finer run ({error:.1g}) Exudyn is {difference(ours, finer):.1g}, the compiled one {difference(other, finer):.1g}"
    )


def _engine(pair: Drawn, p: Parameters) -> tuple[Result, float]:
    """Exudyn's result, with its estimate, and its time."""
    begin = perf_counter()

    def run(mechanism: Any, duration: float, solver: Any, limit: float) -> Any:
        return SOLVERS[type(solver)](mechanism, duration, solver, limit, None)

    task = Task(pair.mechanism, pair.duration, p.accuracy, patience=p.timeout)
    found = by_exudyn(pair.mechanism)(task, run)
    wall = perf_counter() - begin
    status, message = found.run.failure or (Status.OK, "")
    return judged(replace(comparable(found.run), status=status, message=message), found, task, wall), wall


def _compiled(pair: Drawn, p: Parameters, accuracy: float) -> tuple[Result, float, float, str]:
    """The compiled solver's run, its known error, its time, and how it failed if so."""
    from buckler.mbs.solvers.spectral import Spectral
    from buckler.mbs.spectral.accuracy import known
    from buckler.mbs.spectral.run import once

    once(pair.mechanism, 1e-6 * pair.duration, Spectral())  # compiles the mechanism's own functions
    begin = perf_counter()
    found = known(pair.mechanism, pair.duration, max(accuracy, FINEST_KNOWN), patience=p.timeout)
    wall = perf_counter() - begin
    result = Result(Status.OK, "", found.run.record.time, found.run.values, found.run.units, found.run.work)
    failure = found.run.failure
    return result, found.errors.motion, wall, "" if failure is None else f"compiled {failure[0]}: {failure[1]}"


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run both solvers on each mechanism."""
    jobs = list(pairs(parameters))
    found = [compare(pair, parameters) for pair in progress(jobs, label="mechanisms")]
    judged = [c for c in found if np.isfinite(c.ratio)]
    beyond = [c for c in judged if c.ratio > BEYOND]
    times = [c.engine_s / c.compiled_s for c in judged]
    median = float(np.median(times)) if times else float("nan")
    metrics = {
        "cases": Metric(float(len(found)), "1"),
        "compared": Metric(float(len(judged)), "1"),
        "within_estimates": Metric(float(np.mean([c.ratio <= 1 for c in judged])) if judged else float("nan"), "1"),
        "beyond_three": Metric(float(len(beyond)), "1"),
        "median_ratio": Metric(median, "1"),
    }
    wrong = [f"{c.name}: {c.difference:.1e} apart in {c.where}, estimates {c.engine:.1e} and {c.compiled:.1e}" for c in beyond]
    wrong += [f"{c.name}: {c.contrary}" for c in found if c.contrary]
    wrong += [f"{c.name}: only one solver ended, {c.alone}" for c in found if c.alone]
    told = f"{len(judged)} of {len(found)} mechanisms compared, {len(judged) - len(beyond)} no farther apart than 3 estimates"
    names = ("difference", "engine", "compiled", "engine_s", "compiled_s", "ratio")
    return StudyResult(
        parameters=parameters,
        status="SUSPECT" if wrong or not judged else "OK",
        message="; ".join(wrong) or told,
        metrics=metrics,
        signals={name: np.array([getattr(c, name) for c in found]) for name in names},
        tables=[_table(found)],
    )


def _table(found: list[Compared]) -> Table:
    def shown(value: float) -> str:
        return f"{value:.2g}"

    rows = [
        [c.name, shown(c.difference), c.where, shown(c.engine), shown(c.compiled), shown(c.ratio),
         f"{1e3 * c.engine_s:.3g}", f"{1e3 * c.compiled_s:.3g}", "; ".join(filter(None, (c.contrary, c.said)))]
        for c in found
    ]  # fmt: skip
    estimates = ["Exudyn's estimate", "compiled's", "difference/sum"]
    headers = ["mechanism", "difference", "of", *estimates, "Exudyn [ms]", "compiled [ms]", "note"]
    return Table(headers, rows, "Two solvers of the same mechanisms", NOTES)


def figure(result: StudyResult) -> Figure:
    """Difference over the sum of the estimates, a mark a mechanism."""
    s = result.signals
    fig, ax = subplots(height=90)
    both = np.maximum(s["engine"] + s["compiled"], FINEST)
    ax.loglog(both, np.maximum(s["difference"], 1e-12), "o")
    line = np.array([FINEST, 0.1])
    ax.loglog(line, line, color="#000000", linewidth=0.8, label="the sum")
    ax.loglog(line, BEYOND * line, color="#000000", linewidth=0.8, linestyle=":", label=f"{BEYOND:g} times the sum")
    ax.legend()
    ax.set(xlabel="sum of both estimates", ylabel="difference of the solvers")
    return fig
