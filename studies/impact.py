"""What the slider-crank studies share: their parameters, the three models on one footing, and what is read off a run.

The models differ in the coupler only. `stitched` is the published one (studies/stitched.py). `strut` and `beam` simulate
slider, guide friction, stop and drive together; their coupler is a massless exact elastica, or a geometrically exact beam
with its own inertia.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import isnan, nan, pi
from time import perf_counter
from typing import Any

import numpy as np

import mbs
from elastica import pinned
from mbs import Beam, GuideFriction, Mechanism, Ramp, Section, Strut, slider_crank
from mbs.laws import CarvalhoMartins
from mbs.library import PAPER, PAPER_STOP
from studies.parameters import StudyParameters, choices, integer, quantity
from studies.stitched import Stitched, follow

Array = np.ndarray[Any, Any]
MODELS = ("stitched", "strut", "beam")
COLOURS = {"stitched": "#E69F00", "strut": "#0072B2", "beam": "#D55E00", "exact": "#000000", "published": "#009E73"}
WIDTH = 0.030
"""Of the strip, m (Table 1)."""
AXIAL_DAMPING = 9e-5
"""Retardation time of a strut's axial force, s: a fifth of critical for 0.3 kg on the straight strip."""
BUCKLED_BEFORE = 1e-3
"""Relative end shortening before first contact from which the strip counts as buckled on its way to the stop."""
PLATEAU = np.radians((150.0, 210.0))
"""Crank angles between which the contact force is held against the elastica."""
IMPACT_SPEED, IMPACT_FORCE = 1.25, 27.0
"""Crank speed, rad/s, and published impact force, N (Fig. 5)."""
CONTACT_FORCES = {1e-4: 0.0655, 3e-4: 1.7684, 5e-4: 8.1871}
"""Published largest contact force, N, of a strip thickness, m (Table 2)."""


@dataclass(frozen=True)
class ImpactParameters(StudyParameters):
    """Parameters of every slider-crank study; each adds its drive."""

    models: tuple[str, ...] = choices(MODELS, MODELS, "models to run side by side", "models")
    thickness: float = quantity(3e-4, "m", 5e-5, 1e-3, "thickness of the strip", "strip")
    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode (beam)", "strip")
    imperfection: float = quantity(1e-4, "1", -0.05, 0.05, "bow of the stress-free strip over its length (beam)", "strip")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    friction: float = quantity(0.1, "1", 0, 0.9, "Coulomb coefficient of the slider under its weight", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    stop_stiffness: float = quantity(7.2e4, "N/m", 1e3, 1e8, "stiffness of the stop (strut, beam)", "slider and stop")
    impact_duration: float = quantity(3.775e-3, "s", 1e-5, 1, "duration of an impact (stitched)", "slider and stop")
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-9, 1e-3, "position error allowed a step, over the length", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a model may take", "numerics")

    @property
    def section(self) -> Section:
        """Of the strip, without damping."""
        return Section(WIDTH, self.thickness)

    @property
    def friction_force(self) -> float:
        """Coulomb friction of the slider, N; gravity is normal to the plane of motion."""
        return self.friction * self.mass * 9.81

    @property
    def stitched(self) -> Stitched:
        """The published model of this case."""
        return Stitched(
            mass=self.mass,
            restitution=self.restitution,
            friction=self.friction_force,
            impact_duration=self.impact_duration,
            stiffness=self.section.bending_stiffness,
        )


# --- the models -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ModelRun:
    """One model's run.

    Attributes
    ----------
    status, message : str
        As of `mbs.Result`; `notes` are findings about the mechanism, not about the run.
    time, angle, force, speed, shortening : array, shape (samples,)
        s; crank angle, rad; force on the stop, N; slider's speed towards the stop, m/s; the strip's relative shortening.
    overload : array, shape (samples,)
        Above 1 before the slider has met the stop, the strip has buckled on the way: `stitched` compares the compression
        its rigid mode asks for with the Euler load, the others their shortening with `BUCKLED_BEFORE`.
    energy_balance : float
        Largest ledger error over the energy put through.
    work : dict
        wall_s, steps.
    """

    model: str
    status: str
    message: str
    time: Array
    angle: Array
    force: Array
    speed: Array
    shortening: Array
    overload: Array
    energy_balance: float
    work: dict[str, float]

    @property
    def signals(self) -> dict[str, Array]:
        """Arrays by name, for signals.npz."""
        names = ("time", "angle", "force", "speed", "shortening")
        return {f"{self.model}.{name}": getattr(self, name) for name in names}


def run_model(model: str, parameters: ImpactParameters, speed: float | Ramp, duration: float) -> ModelRun:
    """Run one model from crank angle 0; `speed` in rad/s."""
    if model == "stitched":
        return _run_stitched(parameters, speed, duration)
    fastest = max(speed.start, speed.end) if isinstance(speed, Ramp) else speed
    result = mbs.simulate(
        mechanism(model, parameters, speed),
        duration,
        solver=mbs.Solver(tolerance=parameters.tolerance, max_step=pi / 180 / fastest),
        ledger=True,
        timeout=parameters.timeout,
    )
    signals = result.signals
    shortening = signals["coupler.end_shortening"] / PAPER.coupler
    return ModelRun(
        model, str(result.status), result.message,
        result.time, signals["drive.position"], signals["B.contact_force"], -signals["B.vx"],
        shortening, shortening / BUCKLED_BEFORE,
        result.energy_balance, {name: result.work[name] for name in ("wall_s", "steps")},
    )  # fmt: skip


def _run_stitched(parameters: ImpactParameters, speed: float | Ramp, duration: float) -> ModelRun:
    begin = perf_counter()
    motion = speed if isinstance(speed, Ramp) else Ramp(speed, speed, duration)
    trace = follow(parameters.stitched, motion, duration)
    held = f"HELD_OFF: friction, {parameters.friction_force:.3g} N, holds the slider off the stop" if trace.held else ""
    return ModelRun(
        "stitched", "OK", held,
        trace.time, trace.angle, trace.force, -trace.speed, trace.shortening, trace.load,
        trace.energy_balance, {"wall_s": perf_counter() - begin, "steps": float(len(trace.time))},
    )  # fmt: skip


def mechanism(model: str, parameters: ImpactParameters, speed: float | Ramp) -> Mechanism:
    """The slider-crank with a `strut` or `beam` as its coupler."""
    section, length = parameters.section, PAPER.coupler
    if model == "strut":
        material = replace(section.material, axial_damping=AXIAL_DAMPING)
        coupler: Beam | Strut = Strut(replace(section, material=material))
    else:
        damped = section.damped(parameters.damping, length)
        coupler = Beam(damped, elements=parameters.elements, imperfection=parameters.imperfection * length)
    return slider_crank(
        coupler,
        law=CarvalhoMartins(parameters.stop_stiffness, parameters.restitution, exponent=1.0),
        mass=parameters.mass,
        speed=speed,
        friction=GuideFriction(parameters.friction_force) if parameters.friction else None,
    )


# --- what is read off a run -------------------------------------------------------------------------------------------


def exact_force(parameters: ImpactParameters, angle: Any) -> Any:
    """Force on the stop of the exact elastica in equilibrium, N; angles in contact, rad."""
    unit = parameters.section.bending_stiffness / PAPER.coupler**2
    u = np.maximum(PAPER.shortening(angle, PAPER_STOP), 0.0)
    return unit * pinned.load(u) * PAPER.lean_cosine(angle, PAPER_STOP)


@dataclass(frozen=True)
class Reading:
    """What one turn of the crank does to the stop; nan where it does not happen.

    Attributes
    ----------
    contact_angle, release_angle : float
        Crank angles of first and last contact, rad.
    contact_time, settling_time : float
        From first contact until the last, and until the slider rests against the stop, s; nan if it still rebounds at the
        dead centre.
    impact_speed, rebound_ratio : float
        Of the slider at first contact, m/s, and the share of it with which it leaves.
    impact_peak, impact_impulse, impact_time : float
        Largest force, N, impulse, N s, and duration, s, from first contact until the force first returns to zero.
    rebounds : int
        How often the slider comes back to the stop on the way in.
    force_180, contact_max : float
        Force at the dead centre, and its largest on the `PLATEAU` once the slider rests, N.
    force_error : float
        Largest relative deviation from the exact elastica there.
    shortening : float
        Largest end shortening over the length.
    buckles_before_stop : bool
        Whether the strip buckles before the slider meets the stop.
    """

    contact_angle: float = nan
    release_angle: float = nan
    contact_time: float = 0.0
    settling_time: float = nan
    impact_speed: float = nan
    rebound_ratio: float = nan
    impact_peak: float = 0.0
    impact_impulse: float = 0.0
    impact_time: float = nan
    rebounds: int = 0
    force_180: float = nan
    contact_max: float = nan
    force_error: float = nan
    shortening: float = nan
    buckles_before_stop: bool = False


def read(run: ModelRun, parameters: ImpactParameters, turn: int = 0) -> Reading:
    """Read one turn of the crank; the first is number 0."""
    turned = 2 * pi * turn
    part = slice(*np.searchsorted(run.angle, (turned, turned + 2 * pi)))
    time, angle, force, speed = run.time[part], run.angle[part] - turned, run.force[part], run.speed[part]
    touching = force > 0
    touching[[0, -1]] = False  # what begins before or ends after the turn belongs to another
    changes = np.flatnonzero(touching[1:] != touching[:-1])
    before, last = changes[::2], changes[1::2]  # of each contact, the sample before it and the last one in it
    approach = slice(0, before[0] + 2 if before.size else None)
    reading = Reading(
        force_180=float(np.interp(pi, angle, force, right=nan)),
        shortening=float(run.shortening[part].max()),
        buckles_before_stop=bool((run.overload[part][approach] > 1).any()),
    )
    if not before.size:
        return reading
    impact = slice(before[0], last[0] + 2)  # with the unloaded samples on both sides
    reading = replace(
        reading,
        contact_angle=float(angle[before[0] + 1]),
        release_angle=float(angle[last[-1]]),
        contact_time=float(time[last[-1]] - time[before[0] + 1]),
        impact_speed=float(speed[impact][0]),
        rebound_ratio=-float(speed[impact][-1] / speed[impact][0]),
        impact_peak=float(force[impact].max()),
        impact_impulse=float(np.trapezoid(force[impact], time[impact])),
        impact_time=float(time[last[0]] - time[before[0] + 1]),
    )
    inwards = before[angle[before] < PLATEAU[1]]  # what comes later is the way out
    if not inwards.size or angle[inwards[-1]] >= pi or angle[-1] < PLATEAU[1]:
        return replace(reading, rebounds=max(0, len(inwards) - 1))
    rest = inwards[-1] + 1
    resting = (angle >= max(angle[rest], PLATEAU[0])) & (angle <= PLATEAU[1])
    return replace(
        reading,
        rebounds=len(inwards) - 1,
        settling_time=float(time[rest] - time[before[0] + 1]),
        contact_max=float(force[resting].max()),
        force_error=float(np.abs(force[resting] / exact_force(parameters, angle[resting]) - 1).max()),
    )


def findings(run: ModelRun, readings: Iterable[Reading]) -> list[str]:
    """What a run says about the mechanism rather than about itself, in words that begin with a name."""
    readings = list(readings)
    states = {
        "BUCKLES_BEFORE_STOP: inertia and friction buckle the strip on its way": [r.buckles_before_stop for r in readings],
        "NO_CONTACT: the slider does not meet the stop": [r.contact_time == 0 for r in readings],
        "NOT_SETTLED: the slider still rebounds at the dead centre": [
            r.contact_time > 0 and isnan(r.settling_time) for r in readings
        ],
    }
    found = [run.message] if run.status == "OK" and run.message else []
    for state, hit in states.items():
        if any(hit):
            turns = ", ".join(str(turn + 1) for turn, yes in enumerate(hit) if yes)
            found.append(state + (f" (turn {turns})" if len(readings) > 1 else ""))
    return [f"{run.model}: {text}" for text in found]


def verdict(runs: Iterable[ModelRun], notes: Iterable[str] = ()) -> dict[str, str]:
    """Status and message of a study: those of its worst run, and all that was found."""
    runs = list(runs)
    wrong = [run for run in runs if run.status != "OK"]
    status = min((run.status for run in wrong), key=lambda status: status == "SUSPECT", default="OK")
    return {"status": status, "message": "; ".join([*(f"{run.model}: {run.message}" for run in wrong), *notes])}


def work(runs: Iterable[ModelRun]) -> dict[str, float]:
    """Run time and steps of each model."""
    return {f"{run.model}.{name}": value for run in runs for name, value in run.work.items()}
