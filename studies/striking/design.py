"""Inverse design of the striking slider-crank: strip, stop and speed for a wished contact force, impact force and contact angle.

The equations of `inverse` give the design, and one simulated turn checks it. The crank drives the slider by a strip, the coupler,
and the slider strikes a stop. While the strip is buckled, it presses the slider against the stop: the contact. The equations hold
for a massless strip, the model `strut`. The strip of the model `beam` has inertia: if nearly straight, it carries more than the
Euler load before it has time to bend, and the slider strikes far harder.
Source: B. Demirel et al., 2008, doi 10.1115/IMECE2008-68796.
"""

from dataclasses import dataclass, replace
from math import degrees, isfinite, pi

import numpy as np

from buckler.elastica import law
from buckler.mbs import STEEL, Section
from buckler.mbs.library import PAPER

from ..kit.parameters import choice, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, metrics_table, status_of
from ..kit.style import Figure, plain_ticks, subplots
from .impact import ModelRun, StrikeParameters, read
from .impact_models import make_slider_crank, simulate_model
from .inverse import Given, StrikeDesign, Wish, binding, design, feasible, limits


@dataclass(frozen=True)
class Parameters(StrikeParameters):
    """Parameters of the study."""

    contact_force: float = quantity(2.0, "N", 1e-3, 1e4, "largest force of the buckled strip, crank at 180 deg", "wish")
    impact_force: float = quantity(30.0, "N", 1e-3, 1e5, "largest force of the first impact", "wish")
    contact_angle: float = quantity(2 * pi / 3, "rad", 0.1, 6.0, "angle the crank turns from contact to release", "wish")
    width: float = quantity(0.030, "m", 1e-4, 1, "width of the strip", "strip")
    yield_strength: float = quantity(1e9, "Pa", 1e5, 1e11, "stress at which the strip yields; spring steel", "strip")
    mass: float = quantity(0.3, "kg", 1e-3, 100, "mass of the slider", "slider and stop")
    friction_force: float = quantity(0.3, "N", 0, 1e3, "Coulomb friction of the slider in its guide", "slider and stop")
    stop_stiffness: float = quantity(7.2e4, "N/m", 1, 1e9, "stiffness of the stop", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    fastest: float = quantity(10, "rad/s", 1e-3, 1e3, "fastest the drive can run", "drive")
    model: str = choice("strut", ("strut", "beam"), "model that the design is checked with", "check")

    def design(self) -> StrikeDesign:
        """Solve for the design of these wishes."""
        given = Given(
            width=self.width, mass=self.mass, stiffness=self.stop_stiffness, restitution=self.restitution,
            friction=self.friction_force, yield_strength=self.yield_strength, fastest=self.fastest,
        )  # fmt: skip
        return design(Wish(self.contact_force, self.impact_force, self.contact_angle), given)


def simulate_design(model: str, chosen: StrikeDesign, p: StrikeParameters) -> ModelRun:
    """Simulate a designed slider-crank from crank angle 0 until the slider has left the stop."""
    given = chosen.given
    section = Section(given.width, chosen.thickness)
    numbers = {"mass": given.mass, "speed": chosen.speed, "stop": chosen.stop}
    mechanism = make_slider_crank(model, section, p, given.friction, float(given.stiffness), given.restitution, **numbers)
    release_angle = 2 * pi - chosen.angle  # `angle` is that at the impact; both lie symmetrically about the dead centre at pi
    duration = p.extend_for_motor((release_angle + np.radians(2.0)) / chosen.speed)  # [s], longer on a motor (`--motor`)
    return simulate_model(model, mechanism, p, chosen.speed, duration)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Solve for the design, and simulate one turn of it."""
    d = p.design()
    bounds = {f"limit.{limit.name}": Metric(float(limit.use), "1") for limit in limits(d)}
    if not feasible(d):
        return StudyResult(parameters=p, status="INFEASIBLE", message=str(binding(d)), metrics=bounds)
    turn = simulate_design(p.model, d, p)
    found = read(turn)
    units = {"thickness": "m", "stop": "m", "speed": "rad/s", "impact_speed": "m/s", "shortening": "1", "euler_load": "N"}
    metrics = {
        "contact_force": Metric(found.force_180, "N", exact=p.contact_force),
        "impact_force": Metric(found.impact_peak, "N", exact=p.impact_force),
        "contact_angle": Metric(degrees(found.release_angle - found.contact_angle), "deg", exact=degrees(p.contact_angle)),
        **{name: Metric(getattr(d, name), unit) for name, unit in units.items()},
        "settled": Metric(degrees(found.rest_angle), "deg"),
        "energy_balance": Metric(turn.energy_balance, "1"),
        **bounds,
    }
    allowed = {"contact_force": 5e-3, "impact_force": 2e-2, "contact_angle": 5e-3}  # chosen; the equations err by 1 %
    errors = {name: metrics[name].error or 0.0 for name in allowed}  # relative to `exact`
    wrong = [f"{name} off by {error:.2g}" for name, error in errors.items() if not error <= allowed[name]]
    wrong += [] if isfinite(found.rest_angle) else ["NOT_SETTLED: the slider is not at rest at the dead centre"]
    wrong = [f"{p.model}: {line}" for line in wrong]  # any line makes the study SUSPECT
    notes = "exact: the wish. limit: share of a bound that is used. settled: crank angle from which the slider rests.\n"
    notes += f"{p.describe()}; friction {p.friction_force:g} N."
    status = status_of(wrong) if turn.status == "OK" else {"status": turn.status, "message": f"{p.model}: {turn.message}"}
    return StudyResult(
        parameters=p, **status,
        metrics=metrics, signals={"angle": turn.angle, "force": turn.force},
        tables=[replace(metrics_table(metrics), notes=notes)],
    )  # fmt: skip


def figure(result: StudyResult) -> Figure:
    """Draw contours of the contact force over thickness and contact angle; grey where the limits exclude the wished impact."""
    p = result.of(Parameters)
    d = p.design()
    fig, ax = subplots(height=90)
    h, angle = np.meshgrid(np.geomspace(d.thickness / 4, 4 * d.thickness, 120), np.radians(np.linspace(10, 340, 120)))
    bending_stiffness = STEEL.modulus * p.width * h**3 / 12
    force = PAPER.push(law.fast, 1.0, pi, PAPER.slider(pi - angle / 2)) * bending_stiffness  # on a rigid stop
    is_feasible = feasible(design(Wish(force, p.impact_force, angle), d.given))
    ax.contourf(1e3 * h, np.degrees(angle), is_feasible, levels=[-0.5, 0.5], colors=["#dddddd"])
    lines = ax.contour(1e3 * h, np.degrees(angle), force, levels=p.contact_force * 2.0 ** np.arange(-3, 4), colors="#555555")
    ax.clabel(lines, fmt="%.3g N", fontsize=7)
    ax.plot(1e3 * d.thickness, degrees(p.contact_angle), "o", color="#D55E00", label="design")
    ax.set(xscale="log", xlabel="thickness [mm]", ylabel="contact angle [deg]")
    plain_ticks(ax.xaxis)
    ax.legend()
    return fig
