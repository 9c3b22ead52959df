"""The compiled solver beside hand-tuned plain runs of the engine: error and run time of one run each, on three works.

All three are the slider-crank with a bending coupler, one turn of its crank, and compare the deflection of mid-span from the
chord, relative L2 norm over 401 times, with a finer run of the compiled solver (more degrees, a tighter tolerance):

- fast: 2 mm at 62.8 rad/s, undamped; the coupler follows inertia, and starts with a jolt that rings on along it;
- slow: 2 mm at 1.25 rad/s, undamped; it only rings on from the start, for 244 periods of its first mode;
- stop: 0.3 mm at 1.25 rad/s with 1 % damping; it strikes a stop, buckles, and lets go.

Plain runs are those of `plain`, their settings the best found for these works. Times are of the processor, everything from the
mechanism to the signals included on our side, from the first item to the last step on the other; runs are taken in turn.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import nan, pi, sqrt
from time import process_time
from typing import NamedTuple

import numpy as np

from buckler.mbs import Beam, Cable, Controlled, Mechanism, Section, simulate, slider_crank
from buckler.mbs.geometry import Array
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.library import PAPER
from buckler.mbs.record.lookup import cubic
from buckler.mbs.solvers import Spectral

from ..kit.parameters import StudyParameters, choices, integer, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Figure, subplots
from ..kit.work_precision import Point, footnote, work_precision
from .smooth_precision import DEFLECTION, TIMES, DeflectionRun, deflection, plain_deflection

MASS, STIFFNESS = 0.3, 1e5
"""Of the slider, kg; of the stop, N/m, which is damped critically."""


class Work(NamedTuple):
    """One job: thickness, m, and speed, rad/s; whether there is a stop; settings of ours, of its reference, of the plain run."""

    thickness: float
    speed: float
    stop: bool
    tolerance: float
    degree: int
    fine: float
    fine_degree: int
    plain: tuple[int, int, float, float]
    bar: float

    @property
    def duration(self) -> float:
        """One turn, s."""
        return 2 * pi / self.speed

    @property
    def times(self) -> Array:
        """When deflections are compared, s."""
        return np.linspace(0.0, self.duration, TIMES)

    def mechanism(self, kind: type, **more: object) -> Mechanism:
        """The slider-crank with a coupler of this kind."""
        section = Section(0.030, self.thickness)
        if self.stop:
            section = section.damped(0.01, PAPER.coupler)
            more["imperfection"] = PAPER.coupler / 1000
        law = KelvinVoigt(STIFFNESS, 2 * sqrt(STIFFNESS * MASS)) if self.stop else None
        return slider_crank(kind(section, **more), law=law, mass=MASS, speed=self.speed)


WORKS = {
    "fast": Work(2e-3, 62.8, False, 1e-4, 5, 1e-8, 8, (4, 800, 1e-5, 1e-8), 3.0),
    "slow": Work(2e-3, 1.25, False, 1e-7, 6, 1e-9, 8, (4, 64_000, 1e-6, 1e-6), 8.0),
    "stop": Work(3e-4, 1.25, True, 3e-5, 8, 1e-7, 10, (8, 10_000, 1e-6, 1e-6), 6.0),
}


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    works: tuple[str, ...] = choices(("fast", "slow", "stop"), tuple(WORKS), "which works", "works")
    repeats: int = integer(5, 1, 1000, "repetitions, taken in turn", "numerics")
    known: int = integer(1, 0, 1, "1 to time a call with an accuracy of the deflection too, the plain run's error", "numerics")
    timeout: float = quantity(60.0, "s", 1.0, 3600, "longest time of that call", "numerics")


def ours(work: Work, tolerance: float, degree: int) -> DeflectionRun:
    """Deflection by the compiled solver."""
    from buckler.mbs.spectral.run import once  # takes a second to load

    run = once(work.mechanism(Beam), work.duration, Spectral(Controlled(tolerance), degree=degree))
    if run.failure is not None:
        return DeflectionRun(np.full(TIMES, np.nan), str(run.failure[0]), run.work)
    return DeflectionRun(cubic(run.record.time, run.values[DEFLECTION], work.times), "OK", run.work)


def plainly(work: Work) -> DeflectionRun:
    """Deflection by a plain run."""
    elements, steps, relative, absolute = work.plain
    return plain_deflection(work.mechanism(Cable, elements=elements), work.times, steps, relative, absolute)


def known(work: Work, level: float, timeout: float) -> DeflectionRun:
    """Deflection by a call with an accuracy asked of it."""
    return deflection(simulate(work.mechanism(Beam), work.duration, level, of=[DEFLECTION], timeout=timeout), work.times)


class Row(NamedTuple):
    """What one work came to: our run, the plain one, and a call with a known error where that was asked for."""

    ours: Point
    plain: Point
    known: Point | None = None

    @property
    def numbers(self) -> dict[str, float]:
        """By their metrics' names; ratios are of the plain run's time."""
        error, ratio = (self.known.error, self.known.speedup(self.plain)) if self.known else (nan, nan)
        found = {"error": self.ours.error, "plain_error": self.plain.error, "ratio": self.ours.speedup(self.plain)}
        return found | {"known_error": error, "known_ratio": ratio}


def compare(work: Work, p: Parameters) -> Row:
    """Run one work both ways, each once untimed: the first call of anything is slow."""
    exact = ours(work, work.fine, work.fine_degree).deflection
    size = float(np.linalg.norm(exact))

    def off(run: DeflectionRun) -> float:
        return float(min(np.linalg.norm(sign * run.deflection - exact) for sign in (1, -1))) / size

    calls = {"ours": partial(ours, work, work.tolerance, work.degree), "plain": partial(plainly, work)}
    first = {name: call() for name, call in calls.items()}
    if p.known:
        calls["known"] = partial(known, work, max(off(first["plain"]), 1e-6), p.timeout)
        calls["known"]()
    return Row(*work_precision(calls, off, p.repeats, clock=process_time))


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run every work."""
    rows = {name: compare(WORKS[name], p) for name in progress(p.works, label="works")}
    numbers = {name: row.numbers for name, row in rows.items()}
    metrics = {f"{name}_{key}": Metric(value, "1") for name, found in numbers.items() for key, value in found.items()}
    table = [
        [
            name, n["error"], 1e3 * row.ours.wall_s, int(row.ours.work["steps"]), n["plain_error"], 1e3 * row.plain.wall_s,
            n["ratio"], WORKS[name].bar, n["known_error"], n["known_ratio"],
        ]
        for (name, row), n in zip(rows.items(), numbers.values(), strict=True)
    ]  # fmt: skip
    times = ("error", "time [ms]", "steps", "plain error", "plain [ms]", "plain/time", "bar", "known: error", "plain/known")
    title = "One run each: relative L2 error of the deflection, time of the processor"
    worse = [name for name, n in numbers.items() if not n["error"] <= n["plain_error"]]
    lost = [name for name, n in numbers.items() if not np.isfinite(n["error"] + n["plain_error"])]
    return StudyResult(
        parameters=p,
        metrics=metrics,
        signals={"work": np.array(list(rows)), "ratio": np.array([n["ratio"] for n in numbers.values()])},
        tables=[Table(["work", *times], table, title, footnote(p))],
        **judged([f"no result: {name}" for name in lost], f"less accurate than the plain run: {', '.join(worse) or 'none'}"),
    )


def figure(result: StudyResult) -> Figure:
    """Ratios beside their bars."""
    fig, ax = subplots(height=70)
    names = result.signals["work"].tolist()
    at = np.arange(len(names))
    ax.bar(at, result.signals["ratio"], width=0.5, label="found")
    ax.plot(at, [WORKS[name].bar for name in names], "k_", markersize=30, label="bar")
    ax.set(xticks=at, xticklabels=names, xlabel="work", ylabel="plain run's time over ours")
    ax.legend()
    return fig
