"""Crank-rocker with clearance over clearance and crank speed: peak forces, accelerations, penetration, with standard errors.

Every point is an ensemble: members whose journals start anywhere in their bushes, some turns discarded, means over the
turns of all members. A pin deeper in its bush than the clearance is beyond every contact law: such points are named
PENETRATION, are drawn hollow, and enter no fit. Forces are also given over those of ideal joints.

`sections` draws a bifurcation map: one run for each of `section_count` clearances, and of each the velocity of joint B along x
once a turn, a Poincaré section. One point says that the motion repeats each turn, two every second turn, a cloud never.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from math import nan
from typing import NamedTuple

import numpy as np

from buckler.mbs import Mechanism, simulate
from buckler.mbs import ensemble as run_ensemble
from buckler.mbs.ensembles.readings import read_windows
from buckler.mbs.geometry import Array

from ..kit.parameters import integer, quantities
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, metrics_table, status_of
from ..kit.statistics import power_law
from ..kit.style import COLOURS, Figure, plain_ticks, subplots
from .bars import RockerParameters
from .turns import FORCE, Turns, period, run_turns, solver

MEASURES = {
    "peak_force": (FORCE.format("B"), "N"),
    "rms_ax_coupler": ("rms(coupler.ax)", "m/s^2"),
    "rms_ax_rocker": ("rms(rocker.ax)", "m/s^2"),
}
"""Numbers of a turn: readings and units; the joint is that of coupler and rocker."""
READINGS = tuple(reading for reading, _ in MEASURES.values())
IMPACTS = "onsets(B.normal_force)"
IDEAL_FORCE = "max(sqrt(B.coupler-rocker.fx**2 + B.coupler-rocker.fy**2))"
"""Reading of the largest force in B where the joint is ideal [N]."""
SECTION = "end(B.vx)"
"""Reading of the bifurcation map [m/s]."""
LABELS = ("peak force, joint B [N]", "rms $a_x$, coupler [m/s²]", "rms $a_x$, rocker [m/s²]", "penetration over clearance")


@dataclass(frozen=True)
class Parameters(RockerParameters):
    """Parameters of the study; `clearance` and `speed` are those of the point whose numbers are metrics."""

    clearances: tuple[float, ...] = quantities(
        (5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3), "m", 1e-6, 2e-3, "radial clearances", "grid"
    )
    speeds: tuple[float, ...] = quantities((10.0, 20.0, 31.4, 50.0, 75.0, 100.0), "rad/s", 0.1, 500, "crank speeds", "grid")
    sections: int = integer(0, 0, 10**5, "turns of each run of a bifurcation map over the range of clearances, 0: no map", "grid")
    section_count: int = integer(100, 2, 10**5, "its clearances, evenly spaced in the logarithm", "grid")

    def agree(self) -> None:
        """Build every point."""
        super().agree()
        for clearance in self.clearances:
            self.bars(gap=clearance)


class SpeedPoint(NamedTuple):
    """Means of `MEASURES` over turns, their errors, largest penetration over the clearance, impacts in B a turn, objections."""

    mean: Array
    error: Array
    depth: float = nan
    impacts: float = nan
    notes: tuple[str, ...] = ()

    @classmethod
    def of(cls, found: Turns) -> SpeedPoint:
        """Take the numbers from an ensemble."""
        value, error = (np.array([getattr(found.means[name], part) for name in READINGS]) for part in ("value", "error"))
        return cls(value, error, found.depth, found.means[IMPACTS].value, found.notes)


def measure(p: Parameters, mechanisms: Sequence[Mechanism], batch: int = 0) -> list[SpeedPoint]:
    """Measure points of the grid whose speeds are alike."""
    return [SpeedPoint.of(each) for each in run_turns(p, mechanisms, (*READINGS, IMPACTS), batch)]


def ideal(p: Parameters, speed: float) -> Array:
    """Compute the `MEASURES` of ideal joints and a rigid rocker."""
    mechanism = p.bars(gap=0.0, speed=speed, rocker=None)
    turn = period(mechanism)
    result = simulate(mechanism, turn)
    return read_windows((IDEAL_FORCE, *READINGS[1:]), result.time, result.signals, np.array([0.0, turn]))[0]


def sections(p: Parameters, clearances: Array) -> Array:
    """Compute velocities of B [m/s] at the ends of turns after those that settle, (clearances, turns); nan if a run fails."""
    made = [p.bars(gap=clearance) for clearance in clearances.tolist()]
    turn = period(made[0])
    with ThreadPoolExecutor(p.workers) as pool:
        found = run_ensemble(
            made, (p.settle + p.sections) * turn, 1, of=[SECTION], skip=0, each=turn, solver=solver(made[0], p.tolerance),
            seed=p.seed, executor=pool,
        )  # fmt: skip
    return np.asarray(found.values[:, p.settle :, 0])


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Measure the grid, and one point of its own."""
    grid = [(clearance, speed) for clearance in p.clearances for speed in p.speeds]
    found = [
        measure(p, [p.bars(gap=clearance, speed=speed) for clearance in p.clearances], k)
        for k, speed in enumerate(progress(p.speeds, label="speeds"))
    ]
    points = [point for points in zip(*found, strict=True) for point in points]
    rigid = np.array([ideal(p, speed) for speed in p.speeds])
    (here,) = measure(p, [p.bars()], len(p.speeds))
    metrics, wrong = _metrics(p, grid, points, here)
    wrong += [f"FAILED: {1e3 * c:g} mm, {w:g} rad/s" for (c, w), x in zip(grid, points, strict=True) if not np.isfinite(x.depth)]
    shape = len(p.clearances), len(p.speeds)
    signals = {"clearance": np.array(p.clearances), "speed": np.array(p.speeds), "ideal": rigid}
    for name in ("mean", "error", "depth", "impacts"):
        values = np.array([getattr(x, name) for x in points])
        signals[name] = values.reshape(*shape, *values.shape[1:])
    signals["valid"] = np.array([not x.notes for x in points]).reshape(shape)
    if p.sections:
        signals["section_clearance"] = np.geomspace(min(p.clearances), max(p.clearances), p.section_count)
        signals["section"] = sections(p, signals["section_clearance"])
    title = f"At {1e3 * p.clearance:g} mm and {p.speed:.4g} rad/s; powers over the valid points"
    tables = [_table(p, grid, points, np.tile(rigid, (len(p.clearances), 1))), replace(metrics_table(metrics), title=title)]
    return StudyResult(parameters=p, **status_of(wrong), metrics=metrics, signals=signals, tables=tables)


def _metrics(
    p: Parameters, grid: Sequence[tuple[float, float]], points: Sequence[SpeedPoint], here: SpeedPoint
) -> tuple[dict[str, Metric], list[str]]:
    """Return numbers of the point `here`, powers of clearance and speed; and what is wrong."""
    found, wrong = {}, [f"at {1e3 * p.clearance:g} mm: {note}" for note in here.notes]
    valid = np.array([not x.notes for x in points])
    found["valid"] = Metric(float(valid.sum()), "1")
    found["invalid"] = Metric(float((~valid).sum()), "1")
    for i, (name, (_, unit)) in enumerate(MEASURES.items()):
        found[name] = Metric(float(here.mean[i]), unit, error=float(here.error[i] / here.mean[i]))
        if min(len(set(np.array(grid)[valid, k])) for k in (0, 1)) > 1 and valid.sum() > 4:
            found |= _powers(name, np.array(grid)[valid], np.array([x.mean[i] for x in points])[valid])
    return found, wrong


def _powers(name: str, at: Array, values: Array) -> dict[str, Metric]:
    """Fit powers of clearance and speed with standard errors, and the scatter about them."""
    found = power_law(at.T, values)
    powers = {f"{name}.power_of_{over}": power for over, power in zip(("clearance", "speed"), found.metrics(), strict=True)}
    return powers | {f"{name}.scatter": Metric(found.scatter, "1")}


def _table(p: Parameters, grid: Sequence[tuple[float, float]], points: Sequence[SpeedPoint], rigid: Array) -> Table:
    rows = []
    for (clearance, speed), x, still in zip(grid, points, rigid, strict=True):
        numbers = [f"{m:.4g} ± {e:.2g}" for m, e in zip(x.mean, x.error, strict=True)]
        numbers.insert(1, f"{x.mean[0] / still[0]:.1f}")
        names = ", ".join(note.partition(":")[0] for note in x.notes)
        rows.append([f"{1e3 * clearance:g}", f"{speed:g}", *numbers, f"{x.depth:.3f}", f"{x.impacts:.0f}", names])
    means = ("peak force B [N]", "over ideal", "rms ax coupler", "rms ax rocker [m/s^2]")
    headers = ["c [mm]", "[rad/s]", *means, "depth/c", "impacts", ""]
    title = f"Means over turns, c_max = {p.damping:g} {p.damping_unit}"
    drawn = f"± standard error: {p.members} members, {p.cycles} turns each after {p.settle}, seed {p.seed}"
    notes = f"{drawn}; impacts: in B.\n{p.describe()}."
    return Table(headers, rows, title, notes)


def figure(result: StudyResult) -> dict[str, Figure]:
    """Draw each number over the clearance, a line for each speed; as maps over both; and the bifurcation map."""
    found = {"lines": _lines(result), "maps": _maps(result)}
    return found | ({"bifurcation": _bifurcation(result)} if "section" in result.signals else {})


def _bifurcation(result: StudyResult) -> Figure:
    gaps, values = 1e3 * result.signals["section_clearance"], result.signals["section"]
    fig, ax = subplots(1, 1, height=90)
    ax.plot(np.repeat(gaps, values.shape[1]), values.ravel(), ",", color="#000000")
    ax.set(xscale="log", xlabel="radial clearance [mm]", ylabel="$v_x$ of joint B at the end of a turn [m/s]")
    plain_ticks(ax.xaxis, (1, 2, 5))
    return fig


def _lines(result: StudyResult) -> Figure:
    s = result.signals
    fig, axes = subplots(2, 2, height=130, sharex=True)
    values, errors = [*np.moveaxis(s["mean"], -1, 0), s["depth"]], [*np.moveaxis(s["error"], -1, 0), 0 * s["depth"]]
    for ax, name, value, error in zip(axes.flat, LABELS, values, errors, strict=True):
        for k, speed in enumerate(s["speed"]):
            x, colour, ok = 1e3 * s["clearance"], COLOURS[k % len(COLOURS)], s["valid"][:, k]
            ax.errorbar(x, value[:, k], error[:, k], color=colour, linewidth=0.8, capsize=1.5, label=f"{speed:g}")
            ax.plot(x[ok], value[ok, k], "o", color=colour, markersize=3)
            ax.plot(x[~ok], value[~ok, k], "o", color=colour, markersize=3.5, markerfacecolor="white")
        ax.set(xscale="log", yscale="log", ylabel=name)
    axes[1, 1].axhline(1, color="#000000", linewidth=0.7)
    for ax in axes[1]:
        ax.set_xlabel("radial clearance [mm]")
        ax.xaxis.set_major_formatter("{x:g}")
    title = "speed [rad/s]; hollow: PENETRATION, deeper than the clearance"
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=6, title=title)
    return fig


def _maps(result: StudyResult) -> Figure:
    s = result.signals
    fig, axes = subplots(3, 1, height=185, sharex=True)
    names = ["force, joint B, over ideal", "rms $a_x$, coupler, over ideal", "rms $a_x$, rocker, over ideal"]
    for i, (ax, name) in enumerate(zip(axes, names, strict=True)):
        over = s["mean"][..., i].T / s["ideal"][:, i, None]
        ax.grid(False)
        image = ax.imshow(np.log10(over), origin="lower", aspect="auto", cmap="viridis")
        for k, c in np.ndindex(over.shape):
            bright = np.log10(over[k, c]) > np.nanmean(np.log10(over)) + 0.3 * np.nanstd(np.log10(over))
            colour = "#000000" if bright else "#ffffff"
            text = f"{over[k, c]:.3g}" if s["valid"][c, k] else f"({over[k, c]:.3g})"
            ax.text(c, k, text, ha="center", va="center", fontsize=7, color=colour)
        ax.set(title=name, ylabel="crank [rad/s]")
        ax.set_xticks(range(len(s["clearance"])), [f"{1e3 * c:g}" for c in s["clearance"]])
        ax.set_yticks(range(len(s["speed"])), [f"{w:g}" for w in s["speed"]])
        fig.colorbar(image, ax=ax, label="log10")
    axes[-1].set_xlabel("radial clearance [mm]; in brackets: PENETRATION, deeper than the clearance")
    return fig
