"""What the slider-crank studies share: their parameters, a model's run, and what is read off it.

The models themselves are in studies/impact_models.py.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import isnan, nan, pi
from typing import Any

import numpy as np

from buckler.elastica import pinned
from buckler.mbs import Section
from buckler.mbs.accuracy.words import FINEST
from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.studies.kit.parameters import choices, integer, quantity
from buckler.studies.kit.published import STRIP_WIDTH
from buckler.studies.kit.report import worst
from buckler.studies.striking.assumptions import StrikeAssumptions
from buckler.studies.striking.strikes import strikes

Array = np.ndarray[Any, Any]
MODELS = ("stitched", "strut", "beam")
COLOURS = {"stitched": "#E69F00", "strut": "#0072B2", "beam": "#D55E00", "exact": "#000000", "published": "#009E73"}
PLATEAU = np.radians((150.0, 210.0))
"""Crank angles between which the contact force is held against the elastica."""
DEAD_CENTRE = np.radians((165.0, 195.0))
"""Crank angles between which the largest contact force is looked for."""


@dataclass(frozen=True)
class ImpactParameters(StrikeAssumptions):
    """Parameters of every slider-crank study; each adds its drive."""

    models: tuple[str, ...] = choices(MODELS, MODELS, "models to run side by side", "models")
    thickness: float = quantity(3e-4, "m", 5e-5, 1e-3, "thickness of the strip", "strip")
    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode (beam)", "strip")
    imperfection: float = quantity(
        1e-4, "1", -0.05, 0.05, "bow of the unloaded strip over its length, to the side its inertia bends it (beam)", "strip"
    )
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    friction: float = quantity(0.1, "1", 0, 0.9, "Coulomb coefficient of the slider by its weight", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-9, 1e-3, "position error allowed a step, over the length", "numerics")
    accuracy: float = quantity(0, "1", 0, 0.1, "error of the motion asked for, instead of elements and tolerance", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a model may take", "numerics")

    def check(self) -> None:
        """Raise a ValueError at an accuracy that cannot be asked for."""
        if 0 < self.accuracy < FINEST:
            raise ValueError(f"accuracy = {self.accuracy:g}: must be 0, for none asked, or lie in [{FINEST:g}, 0.1]")

    @property
    def section(self) -> Section:
        """Of the strip, without damping."""
        return Section(STRIP_WIDTH, self.thickness)

    @property
    def friction_force(self) -> float:
        """Coulomb friction of the slider, N, by its weight on the guide, whichever way gravity acts on strip and links."""
        return self.friction * self.mass * 9.81

    def stated(self) -> str:
        """One sentence for a table."""
        told = f"{super().stated()}; bow {self.imperfection:g} of the length; slider {self.mass:g} kg"
        return told + ("; stitched knows neither gravity nor motor" if self.gravity or self.motor else "")


@dataclass(frozen=True)
class ModelRun:
    """One model's run.

    Attributes
    ----------
    status, message : str
        As of `buckler.mbs.Result`; an OK run may carry a message about the mechanism.
    time, angle, force, speed, shortening : array, shape (samples,)
        s; crank angle, rad; force on the stop, N; slider speed towards the stop, m/s; relative shortening of the strip.
    overload : array, shape (samples,)
        Above 1 before the slider has met the stop, the strip has buckled on its way: `stitched` compares the
        compression its rigid mode asks for with the Euler load, the others their shortening with 1e-3.
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


def exact_force(parameters: ImpactParameters, angle: Any) -> Any:
    """Force on the stop of the exact elastica in equilibrium, N; angles in contact, rad."""
    u = np.maximum(PAPER.shortening(angle, PAPER_STOP), 0.0)
    force = pinned.load(u) * parameters.section.bending_stiffness / PAPER.coupler**2
    return force * PAPER.lean_cosine(angle, PAPER_STOP)


@dataclass(frozen=True)
class Reading:
    """What one turn of the crank does to the stop; nan where it does not happen.

    Attributes
    ----------
    contact_angle, release_angle : float
        Crank angles of first and last contact, rad.
    contact_time, settling_time : float
        From first contact until the last, and until the slider rests against the stop, s; nan if it is off it at the
        dead centre.
    impact_speed, rebound_ratio : float
        Of the slider at first contact, m/s, and the share of it with which it leaves.
    impact_peak, impact_impulse, impact_time : float
        Largest force, N, impulse, N s, and duration, s, from first contact until the force first returns to zero.
    rebounds : int
        How often the slider comes back to the stop on the way in.
    force_180, contact_max : float
        Force at the dead centre, and the largest around it if the slider rests, N.
    force_error : float
        Largest relative deviation from the exact elastica on that part of the `PLATEAU` where the slider rests.
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
    seen = _Turn(run, turn)
    return Reading(**seen.approach(), **seen.impact(), **seen.rest(parameters))


class _Turn:
    """Samples of one turn, and its contacts."""

    def __init__(self, run: ModelRun, turn: int) -> None:
        self.run, turned = run, 2 * pi * turn
        self.part = slice(*np.searchsorted(run.angle, (turned, turned + 2 * pi)))
        self.time, self.angle = run.time[self.part], run.angle[self.part] - turned
        self.force, self.speed = run.force[self.part], run.speed[self.part]
        own = self.force.copy()
        own[[0, -1]] = 0.0  # what begins before or ends after the turn belongs to another
        self.strikes = strikes(own)

    def approach(self) -> dict[str, Any]:
        until = self.strikes[0].first + 1 if self.strikes else None
        return {
            "force_180": float(np.interp(pi, self.angle, self.force, right=nan)),
            "shortening": float(self.run.shortening[self.part].max()),
            "buckles_before_stop": bool((self.run.overload[self.part][:until] > 1).any()),
        }

    def impact(self) -> dict[str, Any]:
        if not self.strikes:
            return {}
        time, angle, force, speed = self.time, self.angle, self.force, self.speed
        one, released = self.strikes[0], self.strikes[-1].last
        return {
            "contact_angle": float(angle[one.first]),
            "release_angle": float(angle[released]),
            "contact_time": float(time[released] - time[one.first]),
            "impact_speed": float(speed[one.before]),
            "rebound_ratio": -float(speed[one.after] / speed[one.before]) if angle[one.last] < pi else nan,
            "impact_peak": one.peak(force),
            "impact_impulse": one.impulse(time, force),
            "impact_time": float(time[one.last] - time[one.first]),
        }

    def rest(self, parameters: ImpactParameters) -> dict[str, Any]:
        inwards = [one for one in self.strikes if self.angle[one.before] < PLATEAU[1]]  # those that begin later are the way out
        if not inwards:
            return {}
        rebounds, angle, force = len(inwards) - 1, self.angle, self.force
        start, end = inwards[-1].first, inwards[-1].last
        if not angle[start] < pi <= angle[end]:
            return {"rebounds": rebounds}
        resting = (angle >= max(angle[start], PLATEAU[0])) & (angle <= PLATEAU[1])
        top = (angle >= max(angle[start], DEAD_CENTRE[0])) & (angle <= DEAD_CENTRE[1])
        return {
            "rebounds": rebounds,
            "settling_time": float(self.time[start] - self.time[self.strikes[0].first]),
            "contact_max": float(force[top].max()),
            "force_error": float(np.abs(force[resting] / exact_force(parameters, angle[resting]) - 1).max()),
        }


def findings(run: ModelRun, readings: Iterable[Reading]) -> list[str]:
    """What a finished run says about the mechanism rather than about itself, in words that begin with a name."""
    if run.status not in ("OK", "SUSPECT"):
        return []
    readings = list(readings)
    states = {
        "BUCKLES_BEFORE_STOP: the strip is buckled, or swings far, before the slider meets the stop": [
            r.buckles_before_stop for r in readings
        ],
        "NO_CONTACT: the slider does not meet the stop": [r.contact_time == 0 for r in readings],
        "NOT_SETTLED: the slider is not at rest against the stop at the dead centre": [
            r.contact_time > 0 and isnan(r.settling_time) for r in readings
        ],
        "NO_REBOUND: the force does not return to zero, so that impact and contact are one": [
            r.settling_time == 0 for r in readings
        ],
    }
    found = [run.message] if run.status == "OK" and run.message else []
    for state, hit in states.items():
        if any(hit):
            turns = ", ".join(str(turn + 1) for turn, yes in enumerate(hit) if yes)
            found.append(state + (f" (turn {turns})" if len(readings) > 1 else ""))
    return [f"{run.model}: {text}" for text in found]


def verdict(runs: Iterable[ModelRun], notes: Iterable[str] = ()) -> dict[str, Any]:
    """Status and message of a study: those of its worst run, and all that was found."""
    return worst([(run.model, run) for run in runs], notes)


def work(runs: Iterable[ModelRun]) -> dict[str, float]:
    """Run time and steps of each model."""
    return {f"{run.model}.{name}": value for run in runs for name, value in run.work.items()}
