"""The three models of the slider-crank on one footing, and the stop that makes each strike as published.

`stitched` is the published model (studies/stitched.py). `strut` and `beam` simulate slider, guide friction, stop and
drive together and differ in the coupler: a massless exact elastica, or a geometrically exact beam with its own inertia.
"""

from __future__ import annotations

from dataclasses import replace
from math import exp, log, pi
from time import perf_counter
from typing import NamedTuple

import numpy as np

from buckler import mbs
from buckler.mbs import Beam, Cable, GuideFriction, Mechanism, Ramp, Strut, slider_crank
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.studies.kit.published import IMPACT_FORCE, IMPACT_SPEED
from buckler.studies.striking.assumptions import crank_angle
from buckler.studies.striking.impact import ImpactParameters, ModelRun, read
from buckler.studies.striking.stitched import Stitched, follow

COUPLERS: dict[str, type[Beam | Strut]] = {"strut": Strut, "beam": Beam}
AXIAL_DAMPING = 9e-5
"""Retardation time of a strut's axial force, s: a fifth of critical for 0.3 kg on the straight strip."""
BUCKLED_FROM = 1e-3
"""Relative end shortening from which a strip on its way to the stop counts as buckled."""
IMPACT_UNTIL = np.radians(150.0)
"""Crank angle, rad, at which a run ends that is about the first impact only."""
CALIBRATED_TO, TRIALS = 1e-3, 12
"""How close a calibration must come to the published force, and how many runs it may take."""


def run_model(model: str, parameters: ImpactParameters, stop: float, speed: float | Ramp, duration: float) -> ModelRun:
    """Run one model from crank angle 0.

    Parameters
    ----------
    model : {"stitched", "strut", "beam"}
    parameters : ImpactParameters
    stop : float
        What the model takes the stop for: the duration of an impact, s (stitched), or its stiffness, N/m.
    speed : float or Ramp
        Of the crank, rad/s.
    duration : float
        s.
    """
    if model == "stitched":
        return _run_stitched(parameters, stop, speed, duration)
    fastest = max(speed.start, speed.end) if isinstance(speed, Ramp) else speed
    result = mbs.simulate(
        mechanism(COUPLERS[model], parameters, stop, speed),
        duration,
        parameters.accuracy or None,
        solver=None
        if parameters.accuracy
        else mbs.Exudyn(mbs.Controlled(tolerance=parameters.tolerance, max_step=pi / 180 / fastest)),
        ledger=True,
        timeout=parameters.timeout,
    )
    signals = result.signals
    shortening = signals["coupler.end_shortening"] / PAPER.coupler
    return ModelRun(
        model, str(result.status), result.message,
        result.time, crank_angle(result.signals), signals["B.contact_force"], -signals["B.vx"],
        shortening, shortening / BUCKLED_FROM,
        result.energy_balance,
        {name: result.work[name] for name in ("wall_s", "steps")}
        | ({"error": result.error.motion} if parameters.accuracy else {}),
    )  # fmt: skip


def _run_stitched(parameters: ImpactParameters, stop: float, speed: float | Ramp, duration: float) -> ModelRun:
    begin = perf_counter()
    motion = speed if isinstance(speed, Ramp) else Ramp(speed, speed, duration)
    trace = follow(stitched(parameters, stop), motion, duration)
    held = f"HELD_OFF: friction, {parameters.friction_force:.3g} N, holds the slider off the stop" if trace.held else ""
    return ModelRun(
        "stitched", "OK", held,
        trace.time, trace.angle, trace.force, -trace.speed, trace.shortening, trace.load,
        trace.energy_balance, {"wall_s": perf_counter() - begin, "steps": float(len(trace.time))},
    )  # fmt: skip


def stitched(parameters: ImpactParameters, impact_duration: float) -> Stitched:
    """The published model."""
    return Stitched(
        mass=parameters.mass,
        restitution=parameters.restitution,
        friction=parameters.friction_force,
        impact_duration=impact_duration,
        stiffness=parameters.section.bending_stiffness,
    )


def mechanism(
    coupler: type[Beam | Cable | Strut], parameters: ImpactParameters, stiffness: float, speed: float | Ramp
) -> Mechanism:
    """The slider-crank with a coupler of this kind, and a stop of this stiffness, N/m."""
    section, length = parameters.section, PAPER.coupler
    if issubclass(coupler, Strut):
        material = replace(section.material, axial_damping=AXIAL_DAMPING)
        body: Beam | Cable | Strut = Strut(replace(section, material=material))
    else:
        elements = None if parameters.accuracy else parameters.elements
        bow = -parameters.imperfection * length
        body = coupler(section.damped(parameters.damping, length), elements=elements, imperfection=bow)
    made = slider_crank(
        body,
        law=CarvalhoMartins(stiffness, parameters.restitution, exponent=1.0),
        mass=parameters.mass,
        speed=speed,
        friction=GuideFriction(parameters.friction_force) if parameters.friction else None,
    )
    return parameters.under(made)


def strike(model: str, parameters: ImpactParameters, stop: float, speed: float) -> ModelRun:
    """Run one model past its first impact."""
    return run_model(model, parameters, stop, speed, IMPACT_UNTIL / speed)


class NotCalibratedError(ValueError):
    """No stop makes a model strike with the published force."""


class Fit(NamedTuple):
    """The stop with which a model strikes with 27 N at 1.25 rad/s, and the trials on the way: (stop, force)."""

    model: str
    stop: float
    trials: list[tuple[float, float]]


def calibrate(model: str, parameters: ImpactParameters) -> Fit:
    """Fit the one number a model has for its stop: at once where force is m (1 + e) v/dt, else by secants in log-log.

    Raises
    ------
    NotCalibratedError
        If a trial fails or does not strike, or too many are needed.
    """
    speed = IMPACT_SPEED * abs(float(PAPER.slider_rate(PAPER.contact_angle(PAPER_STOP))))
    if model == "stitched":
        duration = parameters.mass * (1 + parameters.restitution) * speed / IMPACT_FORCE
        return Fit(model, duration, [(duration, IMPACT_FORCE)])
    log_stop, slope, trials = 2 * log(IMPACT_FORCE / speed) - log(parameters.mass), 0.5, []  # elastic: F = v sqrt(k m)
    for _ in range(TRIALS):
        run = strike(model, parameters, exp(log_stop), IMPACT_SPEED)
        force = read(run, parameters).impact_peak
        if run.status not in ("OK", "SUSPECT") or not force:
            reason = run.message or "the slider does not meet the stop"
            raise NotCalibratedError(f"{model}: no stop stiffness found for {IMPACT_FORCE:g} N: {reason}")
        trials.append((exp(log_stop), force))
        off = log(force / IMPACT_FORCE)
        if abs(off) < CALIBRATED_TO:
            return Fit(model, exp(log_stop), trials)
        if len(trials) > 1:
            (k0, f0), (k1, f1) = trials[-2:]
            slope = min(2.0, max(0.2, log(f1 / f0) / log(k1 / k0)))
        log_stop -= off / slope
    raise NotCalibratedError(f"{model}: no stop stiffness found for {IMPACT_FORCE:g} N; the last trials: {trials[-2:]}")
