"""The five jobs of the other studies once each, ours against plain: medians, errors and ratios of this machine in one table.

static: twenty loads of a buckled strip, against the engine used plainly, error of the load. smooth: slider-crank with a
bending coupler, against plain uniform steps, error of its deflection. buckling: slider-crank striking its stop, against
plain uniform steps, error of four numbers of its force. rigid clearance, beam clearance: crank-rocker with clearance, one
turn, against the compiled solver (a modal rocker for the beam's, damped mode by mode), error of the coupler's path over
the first 10 ms (5 ms), in clearances. smooth and rigid clearance are asked for an accuracy and name no setting: their time holds
all the runs that the estimate of their error takes. Times never make the run SUSPECT; errors do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from buckler.elastica.rod import Rod
from buckler.mbs import Beam, Cable, Modal, Section, simulate
from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER
from buckler.mbs.modal import BarModes
from buckler.mbs.record.result import Result

from ..kit.parameters import StudyParameters, choices, integer
from ..kit.published import STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Figure, subplots
from ..kit.work_precision import footnote, verdict, work_precision
from ..strips.static_precision import SHORTENINGS

SMOOTH, PLAY = 6.2e-4, 1e-2
"""Accuracies asked for: that of the tuned plain run, and in clearances."""
START = np.linspace(0.0, 0.01, 101)
"""Rattling is chaotic: paths are compared in the first 10 ms only, s."""


ERROR = {
    "static": "largest error of the load [1]",
    "smooth": "L2 error of the deflection [1]",
    "buckling": "largest error of four readings [1]",
    "rigid clearance": "distance in 10 ms [clearances]",
    "beam clearance": "distance in 5 ms [clearances]",
}
"""What the error of each job is."""


class TimedJob(NamedTuple):
    """Ours and the baseline, the error of an outcome, and the largest that is accepted of ours."""

    ours: Callable[[], Any]
    baseline: Callable[[], Any]
    error: Callable[[Any], float]
    largest: float


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    jobs: tuple[str, ...] = choices(tuple(ERROR), tuple(ERROR), "jobs to run", "jobs")
    repeats: int = integer(5, 1, 1000, "repetitions, ours and baseline in turn", "numerics")


def _static() -> TimedJob:
    from buckler.mbs.engine.pressed import pinned_strip

    from . import plain

    section, length = Section(STRIP_WIDTH, 3e-4), PAPER.coupler
    unit = section.bending_stiffness / length**2
    axial, shear = section.axial_stiffness / unit, section.shear_stiffness / unit
    beam, cable = (np.array([rod.at_shortening(u).load for u in SHORTENINGS]) for rod in (Rod(axial, shear), Rod(axial)))
    return TimedJob(
        lambda: pinned_strip(Beam(section, 20), length, SHORTENINGS).load / beam,
        lambda: plain.buckled_strip(section, length, SHORTENINGS, 64).force / unit / cable,
        lambda ratio: float(np.abs(ratio - 1).max()),
        2e-5,
    )


def _smooth() -> TimedJob:
    from . import smooth_precision as study

    p = study.Parameters()
    exact = study.reference(p, p.degree)
    mechanism, duration = p.mechanism(Cable(p.section)), float(p.times[-1])

    return TimedJob(
        lambda: study.deflection(simulate(mechanism, duration, SMOOTH, timeout=120), p.times),
        partial(study.plainly, p, 4, 800, 1e-5, 1e-8),
        lambda outcome: float(np.sqrt(((outcome.deflection - exact) ** 2).sum() / (exact**2).sum())),
        2e-3,
    )


def _buckling() -> TimedJob:
    from ..striking import slider_crank_precision as study

    reference = study.simulated(study.with_coupler(Beam, 16), 1e-8).reading
    return TimedJob(
        partial(study.simulated, study.with_coupler(Beam, 8), 1e-5),
        partial(study.plainly, study.with_coupler(Cable, 8), 10_000, 1e-4),
        lambda outcome: max(outcome.reading.off(reference).values()),
        5e-3,
    )


def _with_play(beam: bool) -> TimedJob:
    from ..rattling.clearance import CrankRockerParameters
    from ..rattling.turns import period, solver

    p = CrankRockerParameters()
    like = p.bars(rocker=Modal(p.section, BarModes(2, 1), p.rocker_damping) if beam else None)
    mechanism = p.bars(rocker=Beam(p.section, elements=4)) if beam else like
    compared = len(START) // 2 if beam else len(START)

    def path(result: Result) -> Array:
        return np.stack([result.at("coupler.x", START, outside=np.nan), result.at("coupler.y", START, outside=np.nan)], axis=1)

    exact = path(simulate(like, START[-1], solver=solver(like, 1e-10)))
    return TimedJob(
        lambda: path(simulate(mechanism, period(like), None if beam else PLAY, timeout=120)),
        lambda: path(simulate(like, period(like), solver=solver(like, 1e-8), timeout=120)),
        lambda found: float(np.abs(found - exact)[:compared].max()) / p.clearance,
        0.1 if beam else 1e-2,
    )


JOBS: dict[str, Callable[[], TimedJob]] = dict(
    zip(ERROR, (_static, _smooth, _buckling, partial(_with_play, False), partial(_with_play, True)), strict=True)
)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run each job, ours and its baseline in turn."""
    metrics: dict[str, Metric] = {}
    rows: list[list[Any]] = []
    wrong, sentences = [], []
    for name in progress(p.jobs, label="jobs"):
        job = JOBS[name]()
        job.ours(), job.baseline()  # untimed: the first call of anything is slow
        ours, baseline = work_precision({f"{name}, ours": job.ours, f"{name}, baseline": job.baseline}, job.error, p.repeats)
        key = name.replace(" ", "_").replace("clearance", "play")  # metrics keep their first names
        ratio = ours.speedup(baseline)
        metrics |= {
            f"{key}.error": Metric(ours.error, "1"),
            f"{key}.baseline_error": Metric(baseline.error, "1"),
            f"{key}.time": Metric(ours.wall_s, "s"),
            f"{key}.baseline_over_ours": Metric(ratio, "1"),
        }
        rows.append([name, ours.error, 1e3 * ours.wall_s, baseline.error, 1e3 * baseline.wall_s, f"{ratio:.3g}"])
        sentences.append(verdict(ours, baseline))
        if not ours.error <= job.largest:
            wrong.append(f"{name}: error {ours.error:.1e}, allowed {job.largest:g}")
    headers = ["job", "Buckler's error", "Buckler's time [ms]", "baseline's error", "baseline's time [ms]", "baseline/ours"]
    return StudyResult(
        parameters=p,
        **judged(wrong, " ".join(sentences)),
        metrics=metrics,
        tables=[Table(headers, rows, "Benchmark: ours and the baseline of each job, in turn", footnote(p))],
    )


def figure(result: StudyResult) -> Figure:
    """Error over run time, a panel a job as each has its own error; an arrow from the baseline to ours."""
    rows = result.tables[0].rows
    lines = (len(rows) + 2) // 3
    fig, axes = subplots(lines, 3, height=25 + 55 * lines, squeeze=False)
    for ax, (name, *numbers) in zip(axes.flat, rows, strict=False):
        error, time, their_error, their_time = (float(x) for x in numbers[:4])
        ax.annotate("", (time, error), (their_time, their_error), arrowprops={"arrowstyle": "->", "color": "0.5"})
        ax.loglog(their_time, their_error, "x", color=COLOURS[1], ms=6, label="baseline")
        ax.loglog(time, error, "o", color=COLOURS[0], label="ours")
        ax.set(title=name, ylabel=ERROR[name])
        ax.margins(0.3)
        for axis, values in ((ax.xaxis, (their_time, time)), (ax.yaxis, (their_error, error))):
            axis.set_ticks(values, [f"{value:.3g}" for value in values])
            axis.set_ticks([], minor=True)
    for ax in axes.flat[len(rows) :]:
        ax.remove()
    fig.supxlabel("run time [ms]", fontsize=9)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return fig
