"""The slider-crank over strip thickness and crank speed: contact force, impact, duration of the contact, energy balance.

Every case is a run of the study `slider-crank`, one model each, swept over processes. The force with which the strip
presses on the stop at the dead centre goes with the cube of the thickness and not with the speed, as long as the strip has
time to come to rest: the published ratios are 27 and 125. Where it has not, the case says why: the slider is still in the
air, or its inertia and friction have buckled the strip before it got to the stop. The cube is read off at a speed low
enough for every strip.

A guide's friction of more than the Euler load, 0.054 N at 0.1 mm, keeps the thinnest strip from ever pressing: `friction`
is 0 here. Source: B. Demirel et al., doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.geometry import Array

from ..kit.parameters import choices, integer, quantities, quantity
from ..kit.published import CONTACT_FORCES
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged, relative
from ..kit.statistics import power_law
from ..kit.style import COLOURS, Axes, Figure, plain_ticks, subplots
from ..sweeping.report import study_page
from ..sweeping.sweep import sweep
from . import slider_crank
from .assumptions import StrikeParameters
from .impact import MODELS

CUBE_TO = 2e-3
"""How far a ratio of quasi-static forces may be from the cube; the stop gives way by 2e-4."""
STATIC_TO = 0.01
"""How far a force may be from the elastica in equilibrium to count as static."""
STATES = {
    "pressed": ("pressed at rest", "o", COLOURS[2]),
    "in the air": ("not at rest at the dead centre", "v", COLOURS[4]),
    "buckled": ("buckles before the stop", "X", COLOURS[1]),
    "no contact": ("never meets the stop", "_", COLOURS[6]),
    "SUSPECT": ("suspect or failed", "s", "#999999"),
}
"""What a case comes to; how it is called and marked."""
LINES = {"strut": "solid", "beam": "dashed", "stitched": "dotted"}
"""Line styles of the models."""


@dataclass(frozen=True)
class Parameters(StrikeParameters):
    """Parameters of the study."""

    thicknesses: tuple[float, ...] = quantities(
        (1e-4, 2e-4, 3e-4, 4e-4, 5e-4), "m", 5e-5, 1e-3, "thicknesses of the strip", "grid"
    )
    speeds: tuple[float, ...] = quantities((0.75, 1.25, 2.0, 3.0, 4.5, 6.58), "rad/s", 0.1, 60, "speeds of the crank", "grid")
    slow: float = quantity(0.1, "rad/s", 0.1, 1, "speed at which the cube is read off", "grid")
    models: tuple[str, ...] = choices(("strut", "beam"), MODELS, "models to run", "grid")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    friction: float = quantity(0.0, "1", 0, 0.9, "Coulomb coefficient of the slider by its weight", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    stop_stiffness: float = quantity(7.2e4, "N/m", 1e3, 1e8, "stiffness of the stop (strut, beam)", "slider and stop")
    workers: int = integer(2, 0, 256, "processes, 0 for none but this", "numerics")

    def check(self) -> None:
        """Check the grid."""
        if self.slow in self.speeds:
            raise ValueError(f"slow = {self.slow:g} rad/s: is one of the speeds already")
        self.cases()

    def cases(self) -> list[slider_crank.Parameters]:
        """One for each model, thickness and speed, in this order; the slow speed first."""
        given = self.shared(slider_crank.Parameters)
        return [
            slider_crank.Parameters(**given | {"models": (model,), "thickness": thickness, "speed": speed})
            for model in self.models
            for thickness in self.thicknesses
            for speed in (self.slow, *self.speeds)
        ]


class GridCase(NamedTuple):
    """What one case gives; nan where it does not happen.

    Attributes
    ----------
    state : one of `STATES`
    force, exact : on the stop at the dead centre if the slider rests there, and that of the elastica in equilibrium, N
    impact : largest force of the first impact, N
    duration, turned : from first to last contact, s, and the crank's turn in that time, rad
    energy_balance : largest ledger error over the energy put through
    message : why it is suspect or failed
    """

    state: str
    force: float = nan
    exact: float = nan
    impact: float = nan
    duration: float = nan
    turned: float = nan
    energy_balance: float = nan
    message: str = ""


def read(row: Any, model: str, speed: float) -> GridCase:
    """Read a row of the sweep."""

    def value(name: str) -> float:
        return float(row.value(f"{model}.{name}"))

    balance = value("energy_balance")
    if row.status != "OK":
        return GridCase("SUSPECT", energy_balance=balance, message=f"{row.status}: {row.message}")
    exact = row.metrics[f"{model}.contact_force_180"].exact
    turned = np.radians(value("release_angle") - value("contact_angle"))
    if not isfinite(turned):
        return GridCase("no contact", exact=exact, energy_balance=balance)
    rests = isfinite(value("settling_time"))
    state = "buckled" if value("buckles_before_stop") else "pressed" if rests else "in the air"
    force = value("contact_force_180") if rests else nan
    return GridCase(state, force, exact, value("impact_peak"), turned / speed, turned, balance)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Sweep the grid and read it."""
    given = p.cases()
    rows = sweep("slider-crank", given, workers=p.workers, progress=progress)
    cases = [read(row, case.models[0], case.speed) for row, case in zip(rows, given, strict=True)]
    shape = len(p.models), len(p.thicknesses), 1 + len(p.speeds)
    columns = {name: np.array([getattr(case, name) for case in cases]).reshape(shape) for name in GridCase._fields}
    notes = columns.pop("message")
    metrics, wrong = _metrics(p, columns)
    return StudyResult(
        parameters=p,
        **judged(wrong),
        metrics=metrics,
        signals=columns,
        work={"cases": len(cases), "cases_wall_s": sum(row.wall_s for row in rows)},
        pages={"report.html": study_page("thickness-speed", "slider-crank", given, ("models", "thickness", "speed"), rows)},
        tables=[_cube_table(p, metrics), *(_table(p, columns, notes, m) for m in range(len(p.models)))],
    )


def _metrics(p: Parameters, columns: Mapping[str, Array]) -> tuple[dict[str, Metric], list[str]]:
    """Cubes at the slow speed, the forces' distance from the elastica, how the impact grows; and what is wrong."""
    found: dict[str, Metric] = {}
    wrong = []
    for m, model in enumerate(p.models):
        force, exact, impact, state = (columns[name][m] for name in ("force", "exact", "impact", "state"))
        for h, ratio in zip(p.thicknesses, (force[:, 0] / force[0, 0]).tolist(), strict=True):
            name, cube = f"{1e3 * h:g}mm", (h / p.thicknesses[0]) ** 3
            found[f"{model}.cube.{name}"] = Metric(ratio, "1", exact=cube)
            if not abs(ratio / cube - 1) < CUBE_TO:
                known = isfinite(ratio)
                why = f"ratio {ratio:.4g} instead of {cube:.4g}" if known else "no force to be had: lower `slow`, `mass`"
                wrong.append(f"CUBE: {model}, {name} at {p.slow:g} rad/s: {why}")
        off = np.where(state == "pressed", np.abs(force / exact - 1), nan)
        found[f"{model}.force_off_elastica"] = Metric(float(np.nanmax(off, initial=0.0)), "1")
        for h, far, states, forces in zip(p.thicknesses, off[:, 1:], state[:, 1:], impact[:, 1:], strict=True):
            until = np.max(p.speeds, where=np.logical_and.accumulate(far < STATIC_TO), initial=0.0)
            found[f"{model}.{1e3 * h:g}mm.static_up_to"] = Metric(float(until), "rad/s")
            met = (states == "pressed") | (states == "in the air")
            if met.sum() > 2:
                law = power_law(np.array(p.speeds)[None, met], forces[met])
                found[f"{model}.{1e3 * h:g}mm.impact_power"] = law.metrics()[0]
        for name in STATES:
            found[f"{model}.cases.{name.replace(' ', '_')}"] = Metric(float((state == name).sum()), "1")
    return found, wrong


def _cube_table(p: Parameters, metrics: Mapping[str, Metric]) -> Table:
    base = CONTACT_FORCES.get(p.thicknesses[0])
    rows = []
    for h in p.thicknesses:
        published = CONTACT_FORCES.get(h)
        found = [metrics[f"{model}.cube.{1e3 * h:g}mm"] for model in p.models]
        ratio = f"{published / base:.2f}" if published and base else ""
        errors = (x for f in found for x in (f"{f.value:.4f}", relative(f.error or 0.0)))
        rows.append([f"{1e3 * h:g}", f"{found[0].exact:g}", ratio, *errors])
    headers = ["h [mm]", "cube", "published", *(x for model in p.models for x in (model, f"{model}, relative error"))]
    title = f"Force at the dead centre over that of the thinnest strip, at {p.slow:g} rad/s"
    stated = f"{p.stated()}; bow {p.imperfection:g} of the length; slider {p.mass:g} kg."
    return Table(headers, rows, title, stated)


def _table(p: Parameters, columns: Mapping[str, Array], messages: Array, m: int) -> Table:
    rows, notes = [], []
    for i, h in enumerate(p.thicknesses):
        for k, speed in enumerate((p.slow, *p.speeds)):
            case = GridCase(**{name: column[m, i, k] for name, column in columns.items()})
            numbers = (case.force, case.force / case.exact - 1, case.impact, case.duration, degrees(case.turned))
            shown = [f"{x:.4g}" if isfinite(x) else "-" for x in numbers]
            rows.append([f"{1e3 * h:g}", f"{speed:g}", *shown, f"{case.energy_balance:.1e}", STATES[case.state][0]])
            if why := messages[m, i, k].partition(";")[0]:
                notes.append(f"{1e3 * h:g} mm, {speed:g} rad/s: {why}")
    headers = ["h [mm]", "[rad/s]", "contact [N]", "off elastica", "impact [N]", "contact [s]", "[deg]", "energy", ""]
    return Table(headers, rows, f"Model {p.models[m]}, slider of {p.mass:g} kg", "\n".join(notes))


def figure(result: StudyResult) -> Figure:
    """Draw contact force over thickness, impact and contact over speed, and what each case comes to."""
    p = result.of(Parameters)
    fig, axes = subplots(2, 2, height=140)
    (forces, impacts), (turns, states) = axes
    _draw_forces(forces, result)
    _draw_over_speed(impacts, result, "impact", 1.0, "impact force [N]")
    _draw_over_speed(turns, result, "turned", degrees(1.0), "contact, turn of the crank [deg]")
    _draw_states(states, result)
    for ax in (impacts, turns, states):
        ax.set(xscale="log", xlabel="speed of the crank [rad/s]")
        ax.set(xticks=p.speeds, xticklabels=[f"{w:g}" for w in p.speeds])
        ax.xaxis.set_minor_formatter("")
    impacts.set(yscale="log", ylim=(10, 600))
    plain_ticks(impacts.yaxis)
    impacts.legend(title="h [mm]", ncols=2, fontsize=7, title_fontsize=7)
    fig.legend(*states.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return fig


def _draw_forces(ax: Axes, result: StudyResult) -> None:
    p = result.of(Parameters)
    s, h = result.signals, np.array(p.thicknesses)
    for m, model in enumerate(p.models):
        force = np.where(s["state"][m] == "pressed", s["force"][m], np.nan)
        x = np.broadcast_to(1e3 * h[:, None], force.shape)
        ax.loglog(x.ravel(), force.ravel(), "ox+"[m], markersize=5 - m, color=COLOURS[m], fillstyle="none", label=model)
    slow = s["exact"][0, :, 0]
    ax.loglog(1e3 * h, slow[0] * (h / h[0]) ** 3, "k-", linewidth=0.7, label="elastica, $h^3$", zorder=0)
    table = [(1e3 * t, f) for t, f in CONTACT_FORCES.items() if t in p.thicknesses]
    if table:
        ax.loglog(*zip(*table, strict=True), "*", color=COLOURS[2], markersize=7, label="published", zorder=0)
    ax.set(xlabel="thickness [mm]", ylabel="force at the dead centre [N]", xticks=1e3 * h)
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter("")
    ax.yaxis.set_major_formatter("{x:g}")
    ax.legend()


def _draw_over_speed(ax: Axes, result: StudyResult, name: str, factor: float, label: str) -> None:
    p = result.of(Parameters)
    for m, model in enumerate(p.models):
        for i, h in enumerate(p.thicknesses):
            ok = np.isin(result.signals["state"][m, i, 1:], ("pressed", "in the air"))
            values = np.where(ok, factor * result.signals[name][m, i, 1:], np.nan)
            label_of = f"{1e3 * h:g}" if m == 0 else None
            ax.plot(p.speeds, values, ".", color=COLOURS[i % len(COLOURS)], linestyle=LINES[model], linewidth=0.9, label=label_of)
    ax.set_ylabel(label)
    ax.set_title(", ".join(f"{model} {LINES[model]}" for model in p.models), fontsize=7, loc="left")


def _draw_states(ax: Axes, result: StudyResult) -> None:
    p = result.of(Parameters)
    shift = np.linspace(-0.1, 0.1, len(p.models)) if len(p.models) > 1 else [0.0]
    for state, (name, mark, colour) in STATES.items():
        m, i, k = np.nonzero(result.signals["state"][..., 1:] == state)
        if m.size:
            y = np.arange(len(p.thicknesses))[i] + 1.5 * np.asarray(shift)[m]
            ax.plot(np.array(p.speeds)[k], y, mark, color=colour, label=name, linestyle="", markersize=4.5)
    ax.set(ylabel="thickness [mm]", yticks=range(len(p.thicknesses)), yticklabels=[f"{1e3 * h:g}" for h in p.thicknesses])
    ax.set(ylim=(-0.5, len(p.thicknesses) - 0.5))
    ax.set_title(" above ".join(reversed(p.models)), fontsize=7, loc="left")
