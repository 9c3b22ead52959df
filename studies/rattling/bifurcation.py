"""Crank-rocker with clearance: where its motion repeats and where it is chaos, over clearance, speed or contact damping.

Above, the place of one pin in its bush each time the crank passes one angle: a motion that repeats shows points, chaos a
cloud. Below, the largest Lyapunov exponent: the rate at which two motions part that began almost alike, by the method of
Benettin et al., with its standard error over turns of all members. Nothing but that sign tells chaos from a long period.

A second picture resolves the rate over the crank's angle at the parameters themselves, and holds it against an offset
of 1e-12 m that is left alone: the motion parts in one stretch of the turn and comes together in another, so what a few
tens of milliseconds show is not the exponent.

References
----------
G. Benettin, L. Galgani, J.-M. Strelcyn, Kolmogorov entropy and numerical experiments, doi 10.1103/PhysRevA.14.2338.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from buckler.mbs import Mechanism
from buckler.mbs.geometry import Array

from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.statistics import Mean
from ..kit.style import COLOURS, Figure, subplots
from . import bifurcation_points as diagram
from .bifurcation_points import DiagramPoint, Growth
from .bifurcation_points import SectionParameters as Parameters
from .turns import period

LABELS = {"alone": "left alone", "drawn": "drawn back, growth added up"}
"""Curves of the growth over a turn."""


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Follow every member at every value, then one turn at the parameters themselves."""
    mechanisms = [p.at(float(value)) for value in p.values]
    seeds = range(p.seed, p.seed + p.seeds)
    base = p.bars(angle=p.angle)
    with ThreadPoolExecutor(p.workers) as pool:
        jobs = [(mechanism, seed) for mechanism in mechanisms for seed in seeds]
        found = list(progress(pool.map(lambda job: diagram.member(p, *job), jobs), total=len(jobs), label=p.over))
        parts = zip(*pool.map(lambda seed: diagram.growth_over_turn(p, base, seed), seeds), strict=True)
        growth = Growth(*map(np.stack, parts))
    points = [diagram.read(p, f, found[i * p.seeds : (i + 1) * p.seeds]) for i, f in enumerate(mechanisms)]
    wrong = [f"{p.over} = {value:.4g}: {note}" for value, x in zip(p.values, points, strict=True) for note in x.notes]
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics=_metrics(p, base, points, growth),
        signals=_signals(p, mechanisms, points, growth),
        tables=[_table(p, mechanisms, points), _growth_table(p, base, growth)],
    )


def _metrics(p: Parameters, base: Mechanism, points: Sequence[DiagramPoint], growth: Growth) -> dict[str, Metric]:
    here = diagram.exponent(growth.rate * period(base) / growth.rate.shape[-1], period(base))
    exponents = [x.exponent for x in points]
    ends = {"smallest": min(exponents), "largest": max(exponents)}
    rate = here.metric("1/s")
    return {
        "exponent": rate,
        "exponent_per_turn": Metric(here.value * period(base), "1", error=rate.error),
        "fastest_growth": Metric(diagram.fastest(growth.rate, period(base)), "1/s"),
        "alone_against_drawn_back": Metric(diagram.agreement(growth, p.clearance), "1"),
        **{f"{end}_exponent": x.metric("1/s") for end, x in ends.items()},
        "repeating": Metric(float(sum(x.period > 0 for x in points)), "1"),
        "chaotic": Metric(float(sum(x.exponent.value > diagram.SURE * x.exponent.error for x in points)), "1"),
    }


def _signals(p: Parameters, mechanisms: Sequence[Mechanism], points: Sequence[DiagramPoint], growth: Growth) -> dict[str, Array]:
    return {
        p.over: p.values,
        "section": np.stack([x.section for x in points]),
        "exponent": np.array([x.exponent.value for x in points]),
        "exponent_error": np.array([x.exponent.error for x in points]),
        "period": np.array([x.period for x in points]),
        "spread": np.array([x.spread for x in points]),
        "valid": np.array([not x.notes for x in points]),
        "turn": np.array([period(f) for f in mechanisms]),
        "growth.rate": growth.rate,
        "growth.alone": growth.alone,
        "growth.drawn": growth.drawn,
    }


def _table(p: Parameters, mechanisms: Sequence[Mechanism], points: Sequence[DiagramPoint]) -> Table:
    label, factor, _ = diagram.AXES[p.over]
    rows = [
        [
            f"{factor * value:.4g}", f"{x.exponent.value:.1f}", f"{x.exponent.error:.1f}", f"{x.exponent.value * period(f):.2f}",
            x.period or "no", f"{x.spread:.2g}", "; ".join(note.partition(":")[0] for note in x.notes),
        ]
        for value, f, x in zip(p.values, mechanisms, points, strict=True)
    ]  # fmt: skip
    headers = [label.replace("$c_{max}$", "c_max"), "exponent [1/s]", "error", "per turn", "repeats after", "spread [1]", ""]
    title = f"Pin {p.joint} at a crank angle of {np.degrees(p.angle):g} deg, c_max = {p.damping:g} {p.damping_unit}"
    if p.over == "damping":
        title = title.partition(", c_max")[0]
    notes = (
        "error: standard error over turns and members. spread: standard deviation of the section, in clearances.\n"
        f"{p.seeds} members from seed {p.seed}, {p.settle} turns to settle, {p.turns} of the section, {p.exponent_turns} for the "
        f"exponent.\nrepeats after: turns, to {diagram.REPEATS_TO:g} clearances, up to {diagram.LONGEST_PERIOD}.\n{p.stated()}."
    )
    return Table(headers, rows, title, notes)


def _growth_table(p: Parameters, base: Mechanism, growth: Growth) -> Table:
    steps = growth.rate.shape[-1]
    parts = [(a, a + 45) for a in range(0, 360, 45)]
    angles = (np.arange(steps) + 0.5) / steps * 360
    rows = []
    for low, high in parts:
        found = Mean.of(growth.rate[..., (angles >= low) & (angles < high)].mean(axis=-1).ravel())
        rows.append([f"{low} to {high}", f"{found.value:.0f}", f"{found.error:.0f}"])
    title = f"Rate over a turn at {1e3 * p.clearance:g} mm, {p.speed:.4g} rad/s, c_max = {p.damping:g} {p.damping_unit}"
    notes = f"fastest over {1e3 * diagram.WINDOW:g} ms: {diagram.fastest(growth.rate, period(base)):.0f}/s"
    return Table(["crank angle past the section [deg]", "rate [1/s]", "std. error"], rows, title, notes)


def figure(result: StudyResult) -> dict[str, Figure]:
    """Draw section and exponent over what is varied, and the growth over a turn."""
    return {"bifurcation": _bifurcation(result), "growth": _growth(result)}


def _bifurcation(result: StudyResult) -> Figure:
    p = result.of(Parameters)
    s, (label, factor, scale) = result.signals, diagram.AXES[p.over]
    x = factor * s[p.over]
    fig, (above, below) = subplots(2, 1, height=130, sharex=True, height_ratios=(1.4, 1))
    places = s["section"][..., 0].reshape(len(x), -1)
    above.plot(
        np.repeat(x, places.shape[1]), places.ravel(), ".", color=COLOURS[0], markersize=3, markeredgewidth=0, rasterized=True
    )
    above.set(ylabel=f"pin {p.joint}, $x/c$, once a turn", xscale=scale)
    kinds = {
        "does not repeat": (s["valid"] & (s["period"] == 0), COLOURS[1], "o"),
        f"repeats within {diagram.LONGEST_PERIOD} turns": (s["valid"] & (s["period"] > 0), COLOURS[2], "s"),
        "suspect": (~s["valid"], "#999999", "x"),
    }
    for name, (kind, colour, mark) in kinds.items():
        if kind.any():
            bars = {"elinewidth": 0.8, "capsize": 1.5, "linestyle": ""}
            error = np.nan_to_num(s["exponent_error"][kind])
            below.errorbar(x[kind], s["exponent"][kind], error, marker=mark, color=colour, label=name, **bars)
    below.axhline(0, color="#000000", linewidth=0.6)
    below.set(xlabel=label, ylabel="Lyapunov exponent [1/s]")
    below.xaxis.set_major_formatter("{x:g}")
    below.legend()
    return fig


def _growth(result: StudyResult) -> Figure:
    p = result.of(Parameters)
    s, steps = result.signals, result.signals["growth.rate"].shape[-1]
    fig, (left, right) = subplots(1, 2, height=75)
    angle = np.degrees(p.angle) + np.arange(steps + 1) / steps * 360
    rates = s["growth.rate"].reshape(-1, steps)
    mean, error = rates.mean(axis=0), rates.std(axis=0) / np.sqrt(len(rates))
    centres = (angle[1:] + angle[:-1]) / 2
    left.fill_between(centres, mean - error, mean + error, color=COLOURS[0], alpha=0.25, linewidth=0)
    left.plot(centres, mean, color=COLOURS[0], label="local")
    value = result.metrics["exponent"].value
    left.axhline(value, color=COLOURS[1], linestyle="--", label=f"mean, {value:.0f}/s")
    left.axhline(0, color="#000000", linewidth=0.6)
    left.set(xlabel="crank angle [deg]", ylabel="rate of parting [1/s]")
    left.legend()
    for name, colour, style in (("alone", COLOURS[0], "-"), ("drawn", COLOURS[1], "--")):
        for values in s[f"growth.{name}"]:
            label = None if right.get_legend_handles_labels()[1].count(LABELS[name]) else LABELS[name]
            right.semilogy(angle, values, style, color=colour, linewidth=0.9, label=label)
    right.axhline(p.clearance, color="#000000", linewidth=0.6)
    right.annotate("clearance", (angle[0], p.clearance), xytext=(2, 2), textcoords="offset points", fontsize=8)
    right.set(xlabel="crank angle [deg]", ylabel="offset [m]", ylim=(diagram.LEFT_ALONE / 3, 30 * p.clearance))
    right.legend(loc="lower right")
    for ax in (left, right):
        ax.set(xlim=(angle[0], angle[-1]), xticks=angle[0] + np.arange(0, 361, 90))
    return fig
