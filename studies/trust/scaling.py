"""How the cost of a step grows with the mechanism: chains, a net and rattling joints, in both solvers and on the bare engine.

Four families of n links, let go under gravity for a fraction of a second:

- chain: rigid links, pinned to each other, from the horizontal;
- strips: the same of slender strips;
- lattice: strips that are the meshes' sides of a net, twice as many as it has knots, as wide as high, with closed loops;
- clearance: the rigid chain with clearance in every joint, and its links pushed up and down in turn, so that all joints strike.

Series are `spectral`, the compiled solver; `exudyn`, the other one; and `plain`, the engine alone with the same items and
settings, and nothing of ours called in a step. The exponent is that of the time of a step over n, from 16 to 128 links. The
ratio is the time of the cheapest run of the compiled solver that is no less accurate than the engine's, over the engine's.
Errors are those of the last link's end, over its way, against a finer run of the compiled solver, between samples by cubics.
Joints rattle for 20 ms, in which runs are one trajectory.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import isqrt, nan
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Cable, Clearance, Controlled, Equal, Exudyn, Force, Link, Mechanism, Revolute, Rigid, Section, Spectral
from buckler.mbs.elements.element import Body
from buckler.mbs.geometry import Array
from buckler.mbs.laws import Impact
from buckler.mbs.record.lookup import hermite

from ..kit import statistics
from ..kit.parameters import StudyParameters, choices, counts, integer, quantities, quantity
from ..kit.published import GRAVITY
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Figure, subplots
from ..kit.work_precision import footnote
from . import plain

SIDE = 0.1
"""Length of a link, m."""
BAR, STRIP = Rigid(Section(0.020, 0.005)), Section(0.010, 0.0005)
PIN, GAP, LAW, PUSH = 5e-3, 1e-4, Impact(1e7, 1e3, 1e-4), 2.0
DOWN, ASLANT = (0.0, -GRAVITY), (6.94, -6.94)
FROM, TO = 16, 128
"""Links between which the exponent is taken."""
TOGETHER = 0.02
"""How long joints rattle, s."""
FINER = 0.1
"""Tolerance of the reference, of the tightest one compared."""
Point = tuple[int, int]


def chain(links: int, body: Body, gravity: tuple[float, float] = DOWN) -> Mechanism:
    """Links in a row, the first one pinned to the ground."""
    points = {f"P{k}": (SIDE * k, 0.0) for k in range(links + 1)}
    made = [Link(f"link{k}", f"P{k}", f"P{k + 1}", body) for k in range(links)]
    joints = [Revolute(f"P{k}", f"link{k - 1}" if k else "ground", f"link{k}") for k in range(links)]
    return Mechanism(points, made, joints, gravity=gravity)


def rattling(links: int) -> Mechanism:
    """The rigid chain with clearance in every joint, each link pushed away from its neighbours."""
    made = chain(links, BAR)
    pushes = [Force(f"{x.name}:{x.end}", (0.0, PUSH * (-1) ** k), follows=x.name) for k, x in enumerate(made.links)]
    return replace(made, joints=[Clearance(j.point, j.first, j.second, PIN, GAP, LAW) for j in made.joints], loads=pushes)


def lattice(links: int, body: Body) -> Mechanism:
    """Sides of a net's meshes, row by row, hung up along its upper edge: strips downward, and across between their ends."""
    wide = max(1, isqrt(links // 2))
    sides: list[tuple[Point, Point]] = []
    row = 0
    while len(sides) < links:
        sides += [((i, row), (i, row + 1)) for i in range(wide)]
        row += 1
        sides += [((i, row), (i + 1, row)) for i in range(wide - 1)]
    points: dict[str, tuple[float, float]] = {}
    made, joints = [], []
    holders: dict[str, str] = {}
    for k, ends in enumerate(sides[:links]):
        names = [f"P{i}_{j}" for i, j in ends]
        made.append(Link(f"link{k}", names[0], names[1], body))
        for name, (i, j) in zip(names, ends, strict=True):
            points[name] = (SIDE * i, -SIDE * j)
            if j == 0 or name in holders:
                joints.append(Revolute(name, "ground" if j == 0 else holders[name], f"link{k}"))
            holders.setdefault(name, f"link{k}")
    return Mechanism(points, made, joints, gravity=ASLANT)


FAMILIES: Mapping[str, Callable[[int, int], Mechanism]] = {
    "chain": lambda n, _: chain(n, BAR),
    "strips": lambda n, elements: chain(n, Cable(STRIP, elements=elements)),
    "lattice": lambda n, elements: lattice(n, Cable(STRIP, elements=elements)),
    "clearance": lambda n, _: rattling(n),
}
SERIES = ("spectral", "exudyn", "plain")


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    links: tuple[int, ...] = counts((1, 2, 4, 8, 16, 32, 64, 128), 1, 1024, "numbers of links", "mechanisms")
    families: tuple[str, ...] = choices(tuple(FAMILIES), tuple(FAMILIES), "families of mechanisms", "mechanisms")
    series: tuple[str, ...] = choices(SERIES, SERIES, "what runs them", "mechanisms")
    compared: tuple[int, ...] = counts((64,), 1, 1024, "numbers of links at which errors are compared", "mechanisms")
    duration: float = quantity(0.2, "s", 1e-3, 10.0, "of each run", "mechanisms")
    elements: int = integer(4, 1, 64, "of a strip on the engine", "numerics")
    steps: int = integer(200, 10, 10**6, "of the engine, of one length; with clearance its own control", "numerics")
    tolerances: tuple[float, ...] = quantities((1e-2, 1e-3, 1e-4, 1e-5), "1", 1e-9, 1e-1, "of the compiled solver", "numerics")
    repeats: int = integer(3, 1, 1000, "runs of which the quickest counts", "numerics")


@dataclass(frozen=True)
class Run:
    """What one run took, s: in all, and a step; and where the last link's end was."""

    time: float
    step: float
    end: Callable[[Array], Array] | None = None


def compiled(mechanism: Mechanism, duration: float, tolerance: float) -> Run:
    """A run of the compiled solver."""
    from buckler.mbs.spectral.run import once  # takes a second to load

    return _timed(partial(once, mechanism, duration, Spectral(Controlled(tolerance))), mechanism)


def engine(mechanism: Mechanism, duration: float, solver: Exudyn) -> Run:
    """A run of the other solver."""
    from buckler.mbs.engine.solve import once  # loads the engine

    return _timed(partial(once, mechanism, duration, solver, None, None), mechanism)


def _timed(call: Callable[[], Any], mechanism: Mechanism) -> Run:
    begin = perf_counter()
    run = call()
    time = perf_counter() - begin
    if run.failure is not None:
        return Run(nan, nan)
    return Run(time, float(run.work["wall_s"] / run.work["steps"]), partial(_end, run, mechanism))


def bare(mechanism: Mechanism, duration: float, solver: Exudyn) -> Run:
    """The engine's own run of the same items, without a callback."""
    return Run(*plain.same_items(mechanism, duration, solver))


def quickest(calls: Mapping[str, Callable[[], Run]], repeats: int) -> dict[str, Run]:
    """The quickest run of each call, taken in turn."""
    runs = [{name: call() for name, call in calls.items()} for _ in range(repeats)]
    times = {name: min(run[name].time for run in runs) for name in calls}
    steps = {name: min(run[name].step for run in runs) for name in calls}
    return {name: Run(times[name], steps[name], run.end) for name, run in runs[-1].items()}


def _end(run: Any, mechanism: Mechanism, times: Array) -> Array:
    """Places of the last link's end, (times, 2), m."""
    last = mechanism.links[-1]
    places, rates = run.record.links[last.name].point(last.end)
    return hermite(run.record.time, places, rates, times)[0]


def error(run: Run, exact: Run, times: Array) -> float:
    """Largest distance of the last link's end from that of the exact run, of the way that it has gone at most."""
    if run.end is None or exact.end is None:
        return nan
    truth = exact.end(times)
    way = np.hypot(*(truth - truth[0]).T).max()
    return float(np.hypot(*(run.end(times) - truth).T).max() / way)


def _solver(family: str, p: Parameters) -> Exudyn:
    return Exudyn() if family == "clearance" else Exudyn(Equal(p.steps))


def _lasting(family: str, p: Parameters) -> float:
    return min(p.duration, TOGETHER) if family == "clearance" else p.duration


def calls_for(family: str, mechanism: Mechanism, p: Parameters) -> dict[str, Callable[[], Run]]:
    """What makes a run, by series."""
    duration = _lasting(family, p)
    calls = {
        "spectral": partial(compiled, mechanism, duration, max(p.tolerances)),
        "exudyn": partial(engine, mechanism, duration, _solver(family, p)),
        "plain": partial(bare, mechanism, duration, _solver(family, p)),
    }
    return {name: calls[name] for name in p.series}


class Comparison(NamedTuple):
    """Errors of the engine's run and of ours, and our time over its."""

    engine: float
    ours: float
    ratio: float


def compare(family: str, links: int, p: Parameters) -> Comparison:
    """The engine's run, and the cheapest compiled run that is no less accurate, nan if none is."""
    mechanism, duration = FAMILIES[family](links, p.elements), _lasting(family, p)
    times = np.linspace(0.0, duration, 201)
    exact = compiled(mechanism, duration, FINER * min(p.tolerances))
    calls = {"exudyn": partial(engine, mechanism, duration, _solver(family, p))}
    runs = quickest({**calls, **{f"{x}": partial(compiled, mechanism, duration, x) for x in p.tolerances}}, p.repeats)
    errors = {name: error(run, exact, times) for name, run in runs.items()}
    allowed = errors["exudyn"]
    good = [name for name in runs if name != "exudyn" and errors[name] <= allowed]
    if not good:
        return Comparison(allowed, min(errors[f"{x}"] for x in p.tolerances), nan)
    best = min(good, key=lambda name: runs[name].time)
    return Comparison(allowed, errors[best], runs[best].time / runs["exudyn"].time)


def exponent(links: Array, steps: Array) -> float:
    """Slope of the time of a step over the number of links, both as logarithms; nan of fewer than two."""
    within = (links >= FROM) & (links <= TO)
    return statistics.exponent(links[within], steps[within])


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Time all families, and compare errors."""
    links = sorted(p.links)
    metrics: dict[str, Metric] = {}
    signals: dict[str, Array] = {"links": np.array(links)}
    steps: list[list[Any]] = []
    compared: list[list[Any]] = []
    for family in progress(p.families, label="families"):
        found: dict[str, list[float]] = {name: [] for name in p.series}
        for n in links:
            for name, each in quickest(calls_for(family, FAMILIES[family](n, p.elements), p), p.repeats).items():
                found[name].append(each.step)
        for name, times in found.items():
            signals[f"{family}.{name}"] = np.array(times)
            slope = exponent(signals["links"], signals[f"{family}.{name}"])
            metrics[f"{family}.{name}.exponent"] = Metric(slope, "1")
            steps.append([family, name, *(1e3 * t for t in times), slope])
        for n in sorted(set(links) & set(p.compared)):
            versus = compare(family, n, p)
            metrics[f"{family}.ratio_{n}"] = Metric(versus.ratio, "1")
            compared.append([family, n, *versus])
    failed = [" ".join(row[:2]) for row in steps if np.isnan(row[2:-1]).any()]
    note = footnote(p, "Quickest")
    return StudyResult(
        parameters=p,
        metrics=metrics,
        signals=signals,
        tables=[
            Table(["family", "series", *map(str, links), "exponent"], steps, "Time of a step by links, ms", note),
            Table(["family", "links", "Exudyn's error", "ours", "our time / Exudyn's"], compared, "At no larger error"),
        ],
        **judged([f"runs failed: {', '.join(failed)}"] if failed else []),
    )


def figure(result: StudyResult) -> Figure:
    """Time of a step over the number of links, a panel for each family."""
    families = result.of(Parameters).families
    fig, axes = subplots(2, 2, height=120, sharex=True, squeeze=False)
    links = result.signals["links"]
    for ax, family in zip(axes.flat, families, strict=False):
        for name, style in zip(SERIES, ("o-", "s-", "^--"), strict=True):
            if f"{family}.{name}" in result.signals:
                ax.loglog(links, 1e3 * result.signals[f"{family}.{name}"], style, label=name)
        ax.set(xlabel="links [1]", ylabel=f"{family}: a step [ms]")
        ax.legend()
    for ax in axes.flat[len(families) :]:
        ax.remove()
    return fig
