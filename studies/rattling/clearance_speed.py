"""Crank-rocker with clearance: forces, accelerations, penetration as functions of clearance and crank speed, standard errors.

Each point of the grid is an ensemble, whose journals start at random places in their bushes; its numbers are means over the turns
of all members, after some turns that are discarded. Where a pin is deeper in its bush than the clearance no contact law holds:
such points are marked PENETRATION. They and failed points are invalid: drawn hollow, and not in any fit. Forces are also given
relative to those of ideal joints.

With `sections` the study draws a bifurcation map by Poincaré sections: the velocity of joint B along x once a turn, in one run
for each of `section_count` clearances. A motion with the period of a turn gives one point, of two turns two, chaos a cloud.
"""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from buckler.mbs import ensemble as run_ensemble
from buckler.mbs import simulate
from buckler.mbs.ensembles.readings import read_windows
from buckler.mbs.geometry import Array

from ..kit.parameters import integer, quantities
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, metrics_table, status_of
from ..kit.statistics import power_law
from ..kit.style import COLOURS, Figure, plain_ticks, subplots
from .bars import RockerParameters
from .turns import FORCE, Turns, period, run_turns, solver

MEASURES = {
    "peak_force": (FORCE.format(place="B"), "N"),
    "rms_ax_coupler": ("rms(coupler.ax)", "m/s^2"),
    "rms_ax_rocker": ("rms(rocker.ax)", "m/s^2"),
}
"""Readings of a turn and their units, by the names of their metrics; joint B connects coupler and rocker."""
READINGS = tuple(reading for reading, _ in MEASURES.values())
"""Readings of `MEASURES`, in their order."""
IMPACTS = "onsets(B.normal_force)"
"""Reading of the number of impacts in B."""


@dataclass(frozen=True)
class Parameters(RockerParameters):
    """Parameters of the study; `clearance` and `speed` are those of the point whose numbers are metrics."""

    clearances: tuple[float, ...] = quantities(
        (5e-6, 1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3), "m", 1e-6, 2e-3, "radial clearances", "grid"
    )
    speeds: tuple[float, ...] = quantities((10.0, 20.0, 31.4, 50.0, 75.0, 100.0), "rad/s", 0.1, 500, "crank speeds", "grid")
    sections: int = integer(0, 0, 10**5, "turns of each run of a bifurcation map over the range of clearances, 0: no map", "grid")
    section_count: int = integer(100, 2, 10**5, "clearances of the map, evenly spaced in the logarithm", "grid")

    def agree(self) -> None:
        """Check the parameters by making the mechanism of every clearance."""
        super().agree()
        for clearance in self.clearances:
            self.bars(gap=clearance)


def ideal(p: Parameters, speed: float) -> Array:
    """Compute the `MEASURES` of ideal joints and a rigid rocker, also in a study of flexible ones, so that studies compare."""
    mechanism = p.bars(gap=0.0, speed=speed, rocker=None)  # None: rigid
    turn = period(mechanism)
    result = simulate(mechanism, turn)  # one turn is enough: with ideal joints the drive determines the motion
    force = "max(sqrt(B.coupler-rocker.fx**2 + B.coupler-rocker.fy**2))"  # [N]; `B.coupler-rocker` is one name
    return read_windows((force, *READINGS[1:]), result.time, result.signals, np.array([0.0, turn]))[0]


def compute_sections(p: Parameters, clearances: Array) -> Array:
    """Compute velocities of B [m/s] at the ends of turns after the discarded ones, (clearances, turns); nan if a run fails."""
    mechanisms = [p.bars(gap=clearance) for clearance in clearances.tolist()]
    turn = period(mechanisms[0])
    with ThreadPoolExecutor(p.workers) as pool:
        found = run_ensemble(
            mechanisms, (p.settle + p.sections) * turn, members=1, of=["end(B.vx)"], skip=0, each=turn,  # a reading each turn
            solver=solver(mechanisms[0], p.tolerance), seed=p.seed, executor=pool,
        )  # fmt: skip
    return np.asarray(found.values[:, p.settle :, 0])  # (clearances, turns, readings): of the only reading


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Compute the points of the grid, and the point whose numbers are metrics."""
    grid = [(clearance, speed) for clearance in p.clearances for speed in p.speeds]
    readings = (*READINGS, IMPACTS)
    by_speed = [  # `batch` gives each speed its own random starts
        run_turns(p, [p.bars(gap=clearance, speed=speed) for clearance in p.clearances], readings, batch)
        for batch, speed in enumerate(progress(p.speeds, label="speeds"))
    ]
    points = [point for row in zip(*by_speed, strict=True) for point in row]
    of_ideal = np.array([ideal(p, speed) for speed in p.speeds])
    (chosen,) = run_turns(p, [p.bars()], readings, batch=len(p.speeds))
    metrics = _metrics(grid, points, chosen)
    faults = [f"at {1e3 * p.clearance:g} mm: {note}" for note in chosen.notes]
    # A point of the grid with the note PENETRATION is invalid, which is no fault of the study.
    has_failed = [any(note.startswith("FAILED") for note in x.notes) for x in points]
    faults += [f"FAILED: {1e3 * c:g} mm, {w:g} rad/s" for (c, w), failed in zip(grid, has_failed, strict=True) if failed]
    shape = len(p.clearances), len(p.speeds)
    means = np.array([[x.means[name] for name in readings] for x in points]).reshape(*shape, -1, 3)  # (mean, error, members)
    signals = {
        "clearance": np.array(p.clearances), "speed": np.array(p.speeds), "ideal": of_ideal, "mean": means[..., :-1, 0],
        "error": means[..., :-1, 1], "impacts": means[..., -1, 0],
        "depth": np.array([x.depth for x in points]).reshape(shape),  # over the clearance
        "valid": np.array([not x.notes for x in points]).reshape(shape),
    }  # fmt: skip
    if p.sections:
        signals["section_clearance"] = np.geomspace(min(p.clearances), max(p.clearances), p.section_count)
        signals["section"] = compute_sections(p, signals["section_clearance"])
    title = f"At {1e3 * p.clearance:g} mm and {p.speed:.4g} rad/s; powers over the valid points"
    tables = [_table(p, grid, points, np.tile(of_ideal, (len(p.clearances), 1))), replace(metrics_table(metrics), title=title)]
    return StudyResult(parameters=p, **status_of(faults), metrics=metrics, signals=signals, tables=tables)


def _metrics(grid: Sequence[tuple[float, float]], points: Sequence[Turns], chosen: Turns) -> dict[str, Metric]:
    """Return the means of the chosen point, and for each measure the power law fitted to the valid points."""
    is_valid = np.array([not x.notes for x in points])
    fitted = np.array(grid)[is_valid]
    # the law has three parameters; two points more leave two degrees of freedom for its scatter
    can_fit = len(fitted) > 4 and all(len(set(column)) > 1 for column in fitted.T)
    metrics = {"valid": Metric(float(is_valid.sum()), "1"), "invalid": Metric(float((~is_valid).sum()), "1")}
    for name, (reading, unit) in MEASURES.items():
        metrics[name] = chosen.means[reading].metric(unit)
        if can_fit:
            values = np.array([x.means[reading].value for x in points])[is_valid]
            powers, scatter = power_law(fitted.T, values)
            names = ("power_of_clearance", "power_of_speed", "scatter")
            metrics |= {f"{name}.{key}": metric for key, metric in zip(names, (*powers, scatter), strict=True)}
    return metrics


def _table(p: Parameters, grid: Sequence[tuple[float, float]], points: Sequence[Turns], of_ideal: Array) -> Table:
    rows = []
    for (clearance, speed), x, (ideal_peak, *_) in zip(grid, points, of_ideal, strict=True):
        peak, *accelerations = (x.means[reading] for reading in READINGS)
        numbers = [f"{each.value:.4g} ± {each.error:.2g}" for each in accelerations]
        forces = [f"{peak.value:.4g} ± {peak.error:.2g}", f"{peak.value / ideal_peak:.1f}"]
        names = ", ".join(note.partition(":")[0] for note in x.notes)
        impacts = f"{x.means[IMPACTS].value:.0f}"
        rows.append([f"{1e3 * clearance:g}", f"{speed:g}", *forces, *numbers, f"{x.depth:.3f}", impacts, names])
    means = ("peak force B [N]", "over ideal", "rms ax coupler", "rms ax rocker [m/s^2]")
    headers = ["c [mm]", "[rad/s]", *means, "depth/c", "impacts", ""]
    title = f"Means over turns, c_max = {p.damping:g} {p.damping_unit}; c: radial clearance"
    statistics = f"± standard error: {p.members} members, {p.cycles} turns each after {p.settle}, seed {p.seed}"
    return Table(headers, rows, title, f"{statistics}; impacts: in B.\n{p.describe()}.")


def figure(result: StudyResult) -> dict[str, Figure]:
    """Draw each number over the clearance with a curve for each speed, and the bifurcation map if there is one."""
    figures = {"lines": _lines(result)}
    if "section" in result.signals:
        gaps, values = 1e3 * result.signals["section_clearance"], result.signals["section"]
        figures["bifurcation"], ax = subplots(1, 1, height=90)
        ax.plot(np.repeat(gaps, values.shape[1]), values.ravel(), ",", color="#000000")
        ax.set(xscale="log", xlabel="radial clearance [mm]", ylabel="$v_x$ of joint B at the end of a turn [m/s]")
        plain_ticks(ax.xaxis)
    return figures


def _lines(result: StudyResult) -> Figure:
    """Draw each number over the clearance with a curve for each speed; points without a valid law are hollow."""
    s = result.signals
    fig, axes = subplots(2, 2, height=130, sharex=True)
    labels = ("peak force, joint B [N]", "rms $a_x$, coupler [m/s²]", "rms $a_x$, rocker [m/s²]")  # of `MEASURES`
    panels = [(label, s["mean"][..., i], s["error"][..., i]) for i, label in enumerate(labels)]
    panels.append(("penetration over clearance", s["depth"], np.zeros_like(s["depth"])))  # its error is not known
    for ax, (name, value, error) in zip(axes.flat, panels, strict=True):
        for k, speed in enumerate(s["speed"]):
            x, colour, valid = 1e3 * s["clearance"], COLOURS[k % len(COLOURS)], s["valid"][:, k]
            ax.errorbar(x, value[:, k], error[:, k], color=colour, linewidth=0.8, capsize=1.5, label=f"{speed:g}")
            ax.plot(x[valid], value[valid, k], "o", color=colour, markersize=3)
            ax.plot(x[~valid], value[~valid, k], "o", color=colour, markersize=3.5, markerfacecolor="white")
        ax.set(xscale="log", yscale="log", ylabel=name)
    axes[1, 1].axhline(1, color="#000000", linewidth=0.7)
    for ax in axes[1]:
        ax.set_xlabel("radial clearance [mm]")
        ax.xaxis.set_major_formatter("{x:g}")
    title = "speed [rad/s]; hollow: PENETRATION, deeper than the clearance"
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=6, title=title)
    return fig
