"""One strike of the slider-crank, its coupler a beam: impact force, and what else one could measure of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import nan, pi

import numpy as np

from buckler import mbs
from buckler.mbs import Beam, Mechanism
from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER
from buckler.mbs.sensitivity.curve import spells

from ..kit.parameters import choices, quantity
from ..kit.published import IMPACT_SPEED
from ..kit.report import QUIET, Metric, Progress, StudyResult, metrics_table
from ..kit.style import Figure, subplots
from . import impact_models
from .assumptions import crank_angle
from .impact import ImpactParameters

UNTIL = np.radians(190.0)
"""Crank angle, rad, at which a run ends, if its crank keeps to its speed."""
TORQUES = ("motor.crank.torque", "drive.torque")
"""Signals of the torque on the crank; the first that there is."""
UNITS = {"peak": "N", "pulse": "s", "torque": "N.m", "between": "s", "force_180": "N"}
"""What is read off a strike: largest force of the first impact, its duration, the largest torque on the crank until it ends,
the time from its end to the next contact, the force at the dead centre."""

PUSH = {"compression": "N", "early": "1"}
"""What the strip does: its largest compression until the first impact ends; how its end shortening changes on the way, over
its length."""


@dataclass(frozen=True)
class Parameters(ImpactParameters):
    """Parameters of the study."""

    models: tuple[str, ...] = choices(("beam",), ("beam",), "model of the coupler", "models")
    speed: float = quantity(IMPACT_SPEED, "rad/s", 0.1, 60, "speed of the crank", "drive")
    stop_stiffness: float = quantity(7.2e4, "N/m", 1e2, 1e8, "stiffness of the stop", "slider and stop")


def mechanism(p: Parameters) -> Mechanism:
    """The slider-crank."""
    return impact_models.mechanism(Beam, p, p.stop_stiffness, p.speed)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Strike once and read it."""
    solver = mbs.Exudyn(mbs.Controlled(tolerance=p.tolerance, max_step=pi / 180 / p.speed))
    result = mbs.simulate(mechanism(p), duration(p), solver=solver, timeout=p.timeout)
    found = read(result.time, result.signals)
    metrics = {name: Metric(found.get(name, nan), unit) for name, unit in (UNITS | PUSH).items()}
    return StudyResult(
        parameters=p,
        status=str(result.status) if result.status != "SUSPECT" else "OK",
        message=result.message,
        metrics=metrics,
        signals={"time": result.time, "force": result.signals["B.contact_force"]},
        work={name: result.work[name] for name in ("wall_s", "steps")},
        tables=[replace(metrics_table(metrics), notes=f"{p.stated()}.")],
    )


def duration(p: Parameters) -> float:
    """Length of a run, s."""
    return p.lasts(float(UNTIL) / p.speed)


def read(time: Array, signals: Mapping[str, Array]) -> dict[str, float]:
    """Numbers of `UNITS` and `PUSH` as far as they happen."""
    force = signals["B.contact_force"]
    contacts = spells(force)
    if not len(contacts):
        return {}
    first, free = contacts[0]
    torque = next(signals[name] for name in TORQUES if name in signals)
    told = {
        "peak": float(force[first:free].max()),
        "pulse": float(time[free - 1] - time[first]),
        "torque": float(np.abs(torque[first : free + 1]).max()),
        "force_180": float(np.interp(pi, crank_angle(signals), force, right=nan)),
        "compression": float(-signals["coupler.axial_force"][first:free].min()),
        "early": float(np.ptp(signals["coupler.end_shortening"][: first + 1]) / PAPER.coupler),
    }
    if len(contacts) > 1:
        told["between"] = float(time[contacts[1, 0]] - time[free - 1])
    return told


def figure(result: StudyResult) -> Figure:
    """Force over time from shortly before the first contact."""
    fig, ax = subplots(height=80)
    time, force = result.signals["time"], result.signals["force"]
    start = time[np.argmax(force > 0)]
    ax.plot(1e3 * (time - start), force)
    ax.set(xlim=(-5, 1e3 * (time[-1] - start)), xlabel="time since first contact [ms]", ylabel="force on the stop [N]")
    return fig
