"""Smooth contact laws against published trajectories of nonsmooth dynamics: do they come together as the stiffness grows?

Two mechanisms with clearance (`studies.rattling.nonsmooth_cases`) are run with ever stiffer contacts and held against the
reference trajectories of Siconos, whose contacts are rigid. A contact of stiffness K is deep by
its load over K where it rests, and by its speed times sqrt(m/K) where it strikes: the distance should fall with 1/K in the
four-bar, whose joints stay closed, and between 1/sqrt(K) and 1/K in the slider-crank, until what is left is the error of the
published steps. The slider-crank's phase is left out, as the published guide has a friction of 0.01: its slider's height is
compared by the crank's angle. Its two published schemes part from each other as well; below that no comparison tells anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np

from buckler.mbs import Controlled, Exudyn, Result, simulate
from buckler.mbs.geometry import Array

from ..kit.parameters import StudyParameters, choices, quantities, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.statistics import exponent
from ..kit.style import COLOURS, Figure, subplots
from .nonsmooth_cases import ARM, CLEARANCE, CRANK, FOURBAR, ROD, SLIDER_CRANK, fourbar, slider_crank

CASES = {"four-bar": (fourbar, 1.0, CRANK), "slider-crank": (slider_crank, 0.1, ARM)}
"""Mechanism by stiffness, length of a run, s, and the length of its crank, m."""
CLOSE = 0.01
"""Distance over the length of the crank below which the stiffest run must come."""
TURNS = 1.45
"""Turns of the slider-crank that are compared; from 1.2 on its published schemes are a clearance apart."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    mechanism: tuple[str, ...] = choices(tuple(CASES), tuple(CASES), "mechanisms", "which")
    stiffnesses: tuple[float, ...] = quantities((1e5, 2e5, 5e5, 1e6, 1e7), "N/m", 1e3, 1e10, "of the contacts", "contact")
    tolerance: float = quantity(1e-5, "1", 1e-9, 1e-2, "position error allowed a step, over clearance/10", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a run may take", "numerics")


def distances(name: str, result: Result) -> Array:
    """Distance from the published trajectory at each of its samples, m."""
    if name == "four-bar":
        time, *angles = FOURBAR[:4]
        apart = [
            length * np.abs(angles[k][0] + result.at(f"{link}.angle", np.minimum(time, result.time[-1])) - angles[k])
            for k, (link, length) in enumerate((("crank", CRANK), ("coupler", 4.0), ("rocker", 2.5)))
        ]
        return np.asarray(np.max(apart, axis=0))
    turned = 2 * pi * SLIDER_CRANK[1]
    kept = SLIDER_CRANK[1] <= TURNS
    return np.asarray(CLEARANCE * np.abs(height(result, turned) - SLIDER_CRANK[2])[kept])


def height(result: Result, turned: Array) -> Array:
    """Height of the slider over its clearance, at angles of the crank, rad."""
    angle, coupler = result.signals["crank.angle"], result.signals["coupler.angle"]
    y = ARM * np.sin(angle) + ROD * np.sin(coupler)
    return np.interp(turned, angle, y) / CLEARANCE


def schemes_apart() -> float:
    """Root mean square distance of the two published schemes of the slider-crank, m."""
    _, turns, one, others, other = SLIDER_CRANK
    kept = turns <= TURNS
    return float(CLEARANCE * np.sqrt(((np.interp(turns, others, other) - one)[kept] ** 2).mean()))


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run every mechanism at every stiffness."""
    jobs = [(name, stiffness) for name in p.mechanism for stiffness in p.stiffnesses]
    metrics: dict[str, Metric] = {}
    signals: dict[str, Array] = {}
    wrong: list[str] = []
    rows: list[list[Any]] = []
    for name, stiffness in progress(jobs, label="stiffnesses"):
        make, duration, length = CASES[name]
        result = simulate(make(stiffness), duration, solver=Exudyn(Controlled(p.tolerance)), timeout=p.timeout)
        if not result.ok:
            wrong.append(f"{name}, {stiffness:g} N/m: {result.message}")
        apart = distances(name, result)
        key = f"{name}.{stiffness:g}"
        mean, largest = float(np.sqrt((apart**2).mean()) / length), float(apart.max() / length)
        metrics[f"{key}.distance"], metrics[f"{key}.largest"] = Metric(mean, "1"), Metric(largest, "1")
        rows.append([name, f"{stiffness:g}", f"{mean:.2e}", f"{largest:.2e}", str(result.status)])
        signals |= _signals(name, key, result)
    for name in p.mechanism:
        metrics |= _rates(name, p.stiffnesses, metrics)
        stiffest = metrics[f"{name}.{max(p.stiffnesses):g}.largest"].value
        if not stiffest < CLOSE:
            wrong.append(f"{name}: {stiffest:.2g} of the crank's length apart at the stiffest, allowed {CLOSE:g}")
    metrics["slider-crank.schemes"] = Metric(schemes_apart() / ARM, "1")
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=[_table(rows, metrics, p)], **judged(wrong))


def _signals(name: str, key: str, result: Result) -> dict[str, Array]:
    if name == "four-bar":
        return {f"{key}.time": FOURBAR[0], f"{key}.distance": distances(name, result)}
    turns = np.linspace(0, TURNS, 2001)
    return {f"{key}.turns": turns, f"{key}.height": height(result, 2 * pi * turns)}


def _rates(name: str, stiffnesses: Sequence[float], metrics: dict[str, Metric]) -> dict[str, Metric]:
    """Power of the stiffness with which the distance falls: over all but the stiffest, which are at the published error."""
    some = sorted(stiffnesses)[: max(2, len(stiffnesses) - 1)]
    power = exponent(some, [metrics[f"{name}.{k:g}.distance"].value for k in some])
    return {f"{name}.power_of_stiffness": Metric(power, "1")} if len(some) > 1 else {}


def _table(rows: list[list[Any]], metrics: dict[str, Metric], p: Parameters) -> Table:
    powers = ", ".join(
        f"{name}: K^{metrics[f'{name}.power_of_stiffness'].value:.2f}"
        for name in p.mechanism
        if f"{name}.power_of_stiffness" in metrics
    )
    notes = (
        f"Distances over the crank's length. All but the stiffest: {powers}. The two published schemes of the slider-crank are\n"
        f"{metrics['slider-crank.schemes'].value:.1e} apart in the mean. Published: siconos-tutorials, Apache License 2.0; the "
        "slider-crank after doi 10.1007/s11044-009-9178-y."
    )
    heads = ["mechanism", "K [N/m]", "root mean square distance [1]", "largest [1]", "status"]
    return Table(heads, rows, "Smooth contacts against published nonsmooth ones", notes)


def figure(result: StudyResult) -> Figure:
    """Distance over stiffness; the slider's height in its guide, published and ours."""
    p = result.of(Parameters)
    fig, (left, right) = subplots(1, 2, height=85, width_ratios=(1, 1.4))
    for name, colour in zip(p.mechanism, COLOURS, strict=False):
        apart = [result.metrics[f"{name}.{k:g}.distance"].value for k in p.stiffnesses]
        left.loglog(p.stiffnesses, apart, "o-", color=colour, label=name)
    left.axhline(result.metrics["slider-crank.schemes"].value, color="#999999", linestyle="--", label="published schemes apart")
    left.set(xlabel="stiffness of the contacts [N/m]", ylabel="distance / crank [1]")
    left.legend(fontsize=7)
    _, turns, one, others, other = SLIDER_CRANK
    right.plot(turns, one, "k.", markersize=3, label="published, direct")
    right.plot(others, other, ".", color="#999999", markersize=3, label="published, combined")
    if "slider-crank" in p.mechanism:
        for k, colour in ((min(p.stiffnesses), COLOURS[2]), (max(p.stiffnesses), COLOURS[1])):
            key = f"slider-crank.{k:g}"
            right.plot(result.signals[f"{key}.turns"], result.signals[f"{key}.height"], color=colour, lw=0.8, label=f"{k:g} N/m")
    right.set(xlim=(0, TURNS), xlabel="turns of the crank [1]", ylabel="height of the slider / clearance [1]", ylim=(-2.2, 2.2))
    right.legend(fontsize=7, ncols=2)
    return fig
