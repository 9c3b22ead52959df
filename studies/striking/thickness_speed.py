"""The slider-crank over strip thickness and crank speed: contact force, impact, angle of the contact, energy balance.

Every case is a run of the study `slider-crank` with one model; a sweep runs them on processes. The force with which the strip
presses on the stop at the dead centre grows with the cube of the thickness: the published ratios are 27 and 125. The force does
not depend on the speed if the slider rests by then. If not, the state of the case tells why: the slider is off the stop ("in the
air"), or its inertia and friction have buckled the strip before contact. The ratios are computed at a speed low enough for all.

A strip of 0.1 mm pushes the slider with about its Euler load, 0.054 N. A larger friction in the guide would hold the slider off
the stop, so `friction` is 0 by default. `impact_models` describes the models.
Source: B. Demirel et al., doi 10.1115/IMECE2008-68796.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np

from buckler.mbs.geometry import Array

from ..kit.parameters import choices, integer, quantities, quantity
from ..kit.published import CONTACT_FORCES
from ..kit.report import QUIET, Metric, Progress, StudyResult, status_of
from ..kit.style import COLOURS, Figure, plain_ticks, subplots
from ..sweeping.sweep import Row, sweep
from . import slider_crank
from .impact import MODELS, StrikeParameters, by_case, compare, exact_force

STATES = {
    "pressed": ("pressed at rest", "o", COLOURS[2]),
    "in the air": ("not at rest at the dead centre", "v", COLOURS[4]),
    "buckled": ("buckles before the stop", "X", COLOURS[1]),
    "no contact": ("never meets the stop", "_", COLOURS[6]),
    "SUSPECT": ("suspect or failed", "s", "#999999"),
}
"""States of a case: label, mark and colour in the figure."""
STRUCK = ("pressed", "in the air")
"""States of a case whose slider strikes the stop before the strip buckles."""


@dataclass(frozen=True)
class Parameters(StrikeParameters):
    """Parameters of the study."""

    thicknesses: tuple[float, ...] = quantities((1e-4, 2e-4, 3e-4, 4e-4, 5e-4), "m", 5e-5, 1e-3, "strip thicknesses", "grid")
    speeds: tuple[float, ...] = quantities((0.75, 1.25, 2.0, 3.0, 4.5, 6.58), "rad/s", 0.1, 60, "speeds of the crank", "grid")
    slow: float = quantity(0.1, "rad/s", 0.1, 1, "speed at which the cube is read off", "grid")
    models: tuple[str, ...] = choices(("strut", "beam"), MODELS, "models to run", "grid")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    friction: float = quantity(0.0, "1", 0, 0.9, "Coulomb friction of the slider over its weight", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    stop_stiffness: float = quantity(7.2e4, "N/m", 1e3, 1e8, "stiffness of the stop (strut, beam)", "slider and stop")
    workers: int = integer(2, 0, 256, "processes, 0: the cases run in this one", "numerics")

    def agree(self) -> None:
        """Check that the slow speed is not in the grid; making every case checks its parameters."""
        if self.slow in self.speeds:
            raise ValueError(f"slow = {self.slow:g} rad/s: is one of the speeds already")
        self.cases()

    def cases(self) -> list[slider_crank.Parameters]:
        """Make a case for each model, thickness and speed, in this order of loops; the slow speed is the first."""
        shared = self.share(slider_crank.Parameters)  # the parameters that both studies have, by name
        return [
            slider_crank.Parameters(**shared | {"models": (model,), "thickness": thickness, "speed": speed})
            for model in self.models
            for thickness in self.thicknesses
            for speed in (self.slow, *self.speeds)
        ]


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run all cases, read them, and check the cube."""
    cases = p.cases()
    rows = sweep("slider-crank", cases, workers=p.workers, progress=progress)
    shape = len(p.models), len(p.thicknesses), 1 + len(p.speeds)
    columns = {name: column.reshape(shape) for name, column in read(cases, rows).items()}
    messages = [f"{case.speed:g} rad/s, {1e3 * case.thickness:g} mm: {row.status}: {row.message.partition(';')[0]}"
                for case, row in zip(cases, rows, strict=True) if row.status != "OK"]  # fmt: skip
    metrics = {model: _metrics(p, {name: column[m] for name, column in columns.items()}) for m, model in enumerate(p.models)}
    wrong = [f"CUBE: {model}, {line}" for model, each in metrics.items() for line in _check_cube(p, each)]
    cube = f"cube: force over that of the first strip, {1e3 * p.thicknesses[0]:g} mm, at {p.slow:g} rad/s."
    notes = [cube, f"{p.describe()}; bow {p.imperfection:g} of the length; slider {p.mass:g} kg.", *messages]
    return StudyResult(
        parameters=p, **status_of(wrong), metrics=by_case(metrics), signals=columns,
        tables=[compare(metrics, "Slider-crank over thickness and speed", notes)],
    )  # fmt: skip


def read(cases: Sequence[slider_crank.Parameters], rows: Sequence[Row]) -> dict[str, Array]:
    """Read the rows of the sweep to arrays of shape (cases,), nan where a case has no such number."""

    def column(name: str) -> Array:
        """Read a metric of all rows."""
        return np.array([row.value(f"{case.models[0]}.{name}") for case, row in zip(cases, rows, strict=True)])

    is_ok = np.array([row.status == "OK" for row in rows])
    turned = np.where(is_ok, np.radians(column("release_angle") - column("contact_angle")), nan)
    has_contact = np.isfinite(turned)  # both angles are nan without a contact
    is_resting = np.isfinite(column("settling_time"))  # nan unless the slider rests at the dead centre
    conditions = [~is_ok, ~has_contact, column("buckles_before_stop") > 0, is_resting]  # the first that is met counts
    return {
        "state": np.select(conditions, ["SUSPECT", "no contact", "buckled", "pressed"], "in the air"),
        "force": np.where(has_contact & is_resting, column("contact_force_180"), nan),  # at the dead centre [N]
        "exact": np.array([exact_force(case, np.pi) for case in cases]),  # of the elastica there [N]
        "impact": np.where(has_contact, column("impact_peak"), nan),  # largest force of the first impact [N]
        "turned": turned,  # crank angle from the first contact to the end of the last [rad]
        "energy_balance": column("energy_balance"),
    }


def _metrics(p: Parameters, columns: Mapping[str, Array]) -> dict[str, Metric]:
    """Compute a model's metrics from columns (thicknesses, speeds); ratios of forces are those at the first speed, `slow`."""
    found: dict[str, Metric] = {}
    force, exact, state = (columns[name] for name in ("force", "exact", "state"))
    base, printed = p.thicknesses[0], CONTACT_FORCES
    for h, ratio in zip(p.thicknesses, (force[:, 0] / force[0, 0]).tolist(), strict=True):
        published = printed[h] / printed[base] if h in printed and base in printed else None
        found[f"cube.{1e3 * h:g}mm"] = Metric(ratio, "1", published=published, exact=(h / base) ** 3)
    difference = np.where(state == "pressed", np.abs(force / exact - 1), nan)
    found["force_off_elastica"] = Metric(float(np.nanmax(difference, initial=0.0)), "1")
    for i, h in enumerate(p.thicknesses):
        is_static = np.logical_and.accumulate(difference[i, 1:] < 0.01)  # by convention; at this and all earlier speeds
        found[f"{1e3 * h:g}mm.static_up_to"] = Metric(float(np.max(p.speeds, where=is_static, initial=0.0)), "rad/s")
    return found | {f"cases.{name.replace(' ', '_')}": Metric(float((state == name).sum()), "1") for name in STATES}


def _check_cube(p: Parameters, metrics: Mapping[str, Metric]) -> list[str]:
    """List the thicknesses whose force is not that of the first strip times the cube of the ratio of thicknesses."""
    lines = []
    for name, metric in metrics.items():
        error = metric.error or 0.0  # relative difference from `exact`; nan without a force, None without `exact`
        if name.startswith("cube.") and not error < 2e-3:  # ten times the 2e-4 by which the stop's compliance changes ratios
            ratio = f"ratio {metric.value:.4g} instead of {metric.exact:.4g}"
            why = ratio if isfinite(metric.value) else "no force to be had: lower `slow`, `mass`"
            lines.append(f"{name.removeprefix('cube.')} at {p.slow:g} rad/s: {why}")
    return lines


def figure(result: StudyResult) -> Figure:
    """Draw contact force over thickness, impact over speed, and the state of each case."""
    p, s = result.of(Parameters), result.signals
    lines = {"strut": "solid", "beam": "dashed", "stitched": "dotted"}
    fig, (forces, impacts, states) = subplots(3, 1, height=200)
    for m, model in enumerate(p.models):
        force = np.where(s["state"][m] == "pressed", s["force"][m], nan)
        x = np.broadcast_to(1e3 * np.array(p.thicknesses)[:, None], force.shape)
        forces.loglog(x.ravel(), force.ravel(), "ox+"[m], color=COLOURS[m], fillstyle="none", label=model)
        for i, h in enumerate(p.thicknesses):
            is_struck = np.isin(s["state"][m, i, 1:], STRUCK)
            values, name = np.where(is_struck, s["impact"][m, i, 1:], nan), f"{1e3 * h:g} mm" if m == 0 else None
            impacts.loglog(p.speeds, values, ".", color=COLOURS[i % len(COLOURS)], linestyle=lines[model], label=name)
    forces.loglog(1e3 * np.array(p.thicknesses), s["exact"][0, :, 0], "k-", linewidth=0.7, label="elastica")
    for state, (name, mark, colour) in STATES.items():
        models, strips, speeds = np.nonzero(s["state"][..., 1:] == state)
        y = 1e3 * np.array(p.thicknesses)[strips] + 0.03 * models  # shifted, so that models do not cover each other
        states.semilogx(np.array(p.speeds)[speeds], y, mark, color=colour, label=name, linestyle="", markersize=4.5)
    forces.set(xlabel="thickness [mm]", ylabel="force at the dead centre [N]")
    impacts.set(xlabel="speed of the crank [rad/s]", ylabel=f"impact force [N]: {', '.join(map(' '.join, lines.items()))}")
    states.set(xlabel="speed of the crank [rad/s]", ylabel="thickness [mm]")
    for axis in (forces.xaxis, impacts.xaxis, impacts.yaxis, states.xaxis):
        plain_ticks(axis)
    for ax in (forces, impacts, states):
        ax.legend(ncols=2, fontsize=7)
    return fig
