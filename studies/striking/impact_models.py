"""Three models of the striking slider-crank, and the calibration of their stops by the published impact force.

`stitched` is the published model (doi 10.1115/IMECE2008-68796), three modes of motion in closed form, one after another. The
others simulate the mechanism: the coupler of `strut` is a massless exact elastica, that of `beam` a geometrically exact beam.
"""

from dataclasses import replace
from functools import cache
from math import exp, log, pi
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import root_scalar

from buckler import mbs
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.library import PAPER, PAPER_STOP

from ..kit.published import IMPACT_FORCE, IMPACT_SPEED
from ..kit.report import Metric
from .impact import ImpactParameters, ModelRun, StrikeParameters, crank_angle, read
from .stitched import Stitched, follow

BUCKLED_FROM = 1e-3
"""End shortening over length above which a strip counts as buckled before contact, by convention."""


def make_slider_crank(
    model: str, section: mbs.Section, p: StrikeParameters, friction: float, stiffness: float, restitution: float, **numbers: Any
) -> mbs.Mechanism:
    """Make the slider-crank of `strut` or `beam`, with friction in the slider's guide [N], and gravity and motor of `p`.

    `stiffness` [N/m] and `restitution` are the stop's, `numbers` mass, speed and stop. A strut is damped along its axis. A beam
    has the bow of `p`, positive to the side to which inertia bends the beam. `Beam.imperfection` is positive to the other side.
    """
    if model == "strut":
        # [s], chosen: times k = E A/L of the default strip, a fifth of the critical damping 2 sqrt(k m), m the default slider's
        body: mbs.Beam | mbs.Strut = mbs.Strut(replace(section, material=replace(section.material, axial_damping=9e-5)))
    else:
        damped = section.damped(p.damping, PAPER.coupler)
        body = mbs.Beam(damped, elements=p.elements, imperfection=-p.imperfection * PAPER.coupler)
    guide, law = mbs.GuideFriction(friction) if friction else None, CarvalhoMartins(stiffness, restitution, exponent=1.0)
    return p.apply(mbs.slider_crank(body, law=law, friction=guide, **numbers))


def simulate_model(model: str, mechanism: mbs.Mechanism, p: StrikeParameters, fastest: float, duration: float) -> ModelRun:
    """Run the mechanism of a model for a duration [s], with its energy ledger; `fastest` is the largest crank speed [rad/s]."""
    solver = mbs.Exudyn(mbs.Controlled(p.tolerance, max_step=pi / 180 / fastest))  # a degree of the crank at most, chosen
    result = mbs.simulate(mechanism, duration, solver=solver, ledger=True, timeout=p.timeout)
    signals = result.signals
    push = signals["coupler.compression"] if "coupler.compression" in signals else -signals["coupler.axial_force"]
    shortening = signals["coupler.end_shortening"] / mechanism.length("coupler")
    work = {name: result.work[name] for name in ("wall_s", "steps")}
    return ModelRun(
        model=model, status=str(result.status), message=result.message, time=result.time, angle=crank_angle(signals),
        force=signals["B.contact_force"], speed=-signals["B.vx"],  # positive towards the stop, which lies at smaller x
        shortening=shortening, push=push, buckling_ratio=shortening / BUCKLED_FROM,
        energy_balance=result.energy_balance, work=work,
    )  # fmt: skip


def run_model(model: str, p: ImpactParameters, stop_setting: float, speed: float | mbs.Ramp, duration: float) -> ModelRun:
    """Run one model from crank angle 0; `stop_setting` is an impact's duration [s] (stitched), or the stop's stiffness [N/m]."""
    if model == "stitched":
        begin, motion = perf_counter(), speed if isinstance(speed, mbs.Ramp) else mbs.Ramp(speed, speed, duration)
        closed_forms = Stitched(p.mass, p.restitution, p.friction_force, stop_setting, p.section.bending_stiffness)
        trace = follow(closed_forms, motion, duration)
        # The status stays OK: with this friction the slider does not reach the stop again, which is no fault of the run.
        remark = f"HELD_OFF: friction, {p.friction_force:.3g} N, holds the slider off the stop" if trace.held else ""
        arrays = {name: getattr(trace, name) for name in ("time", "angle", "force", "shortening", "push", "buckling_ratio")}
        work = {"wall_s": perf_counter() - begin, "steps": float(len(trace.time))}
        return ModelRun(model, "OK", remark, speed=-trace.speed, energy_balance=trace.energy_balance, work=work, **arrays)
    fastest = max(speed.start, speed.end) if isinstance(speed, mbs.Ramp) else speed
    numbers = {"mass": p.mass, "speed": speed, "stop": PAPER_STOP}
    mechanism = make_slider_crank(model, p.section, p, p.friction_force, stop_setting, p.restitution, **numbers)
    return simulate_model(model, mechanism, p, fastest, duration)


def strike(model: str, parameters: ImpactParameters, stop_setting: float, speed: float) -> ModelRun:
    """Run one model from crank angle 0 to 150 degrees, where its first impact is over."""
    return run_model(model, parameters, stop_setting, speed, np.radians(150.0) / speed)


class NotCalibratedError(ValueError):
    """Failure to find a stop with which a model strikes with the published force."""


class Calibration(NamedTuple):
    """Stop with which a model strikes with the published force: impact's duration [s] or stiffness [N/m], and its force [N]."""

    model: str
    stop_setting: float
    force: float

    @property
    def metrics(self) -> dict[str, Metric]:
        """Metrics of the stop and of its force, whose exact value is the published force."""
        name, unit = ("impact_duration", "s") if self.model == "stitched" else ("stop_stiffness", "N/m")
        return {name: Metric(self.stop_setting, unit), "force_calibrated": Metric(self.force, "N", IMPACT_FORCE)}


def calibrate(model: str, parameters: ImpactParameters) -> Calibration:
    """Fit a model's stop to the published force: by m (1 + e) v/dt for stitched, else by the secant method in logarithms.

    A NotCalibratedError says that a run fails or has no impact, or that 12 iterations are not enough; five usually are.
    """
    # speed of the slider at the impact [m/s]; the published force was measured at the crank speed IMPACT_SPEED
    slider_speed = IMPACT_SPEED * abs(float(PAPER.slider_rate(PAPER.contact_angle(PAPER_STOP))))
    if model == "stitched":
        impulse = parameters.mass * (1 + parameters.restitution) * slider_speed
        return Calibration(model, impulse / IMPACT_FORCE, IMPACT_FORCE)

    @cache
    def strike_force(log_stop: float) -> float:
        """Run the model with a stop, and return the force of its impact [N]."""
        run = strike(model, parameters, exp(log_stop), IMPACT_SPEED)
        force = read(run).impact_peak
        if run.status not in ("OK", "SUSPECT") or not force:
            why = run.message or "the slider does not meet the stop"
            raise NotCalibratedError(f"{model}: no stop stiffness found for {IMPACT_FORCE:g} N: {why}")
        return force

    def log_ratio(log_stop: float) -> float:
        """Compute the logarithm of force over published force, or 0, which ends the iteration, where the stop is accurate."""
        ratio = log(strike_force(log_stop) / IMPACT_FORCE)
        return ratio if abs(ratio) >= 1e-3 else 0.0  # a tenth of the accuracy of values read off plots

    first = 2 * log(IMPACT_FORCE / slider_speed) - log(parameters.mass)  # elastic impact: F = v sqrt(k m)
    root = first
    if log_ratio(first):
        second = first - 2 * log_ratio(first)  # F grows with sqrt(k)
        root = root_scalar(log_ratio, method="secant", x0=first, x1=second, maxiter=12).root
    if log_ratio(root):
        last = strike_force(root)
        raise NotCalibratedError(f"{model}: no stop stiffness found for {IMPACT_FORCE:g} N; the last gave {last:.4g} N")
    return Calibration(model, exp(root), strike_force(root))
