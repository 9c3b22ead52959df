"""Assumptions, parameters and numbers of the studies of the striking slider-crank; its models are in `impact_models`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isnan, nan, pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from buckler.elastica import pinned
from buckler.mbs import Mechanism, Motor, Ramp, Section
from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.mbs.sensitivity.curve import spells

from ..kit.parameters import Gravity, choices, integer, quantity
from ..kit.published import GRAVITY, STRIP_WIDTH
from ..kit.report import Metric, Table, relative

MODELS = ("stitched", "strut", "beam")
COLOURS = {"stitched": "#E69F00", "strut": "#0072B2", "beam": "#D55E00", "exact": "#000000", "published": "#009E73"}
SETTLED_BY = np.radians(210.0)
"""Crank angle [rad] before which a contact begins on the inward stroke."""
DEAD_CENTRE = np.radians((165.0, 195.0))
"""Crank angles [rad] between which the largest contact force is looked for."""
SLOWED = 1.2
"""Factor on the time of a run whose crank a motor turns: motors that explain the forces are slower by less."""


@dataclass(frozen=True)
class StrikeAssumptions(Gravity):
    """Gravity and motor of every study of the striking slider-crank."""

    motor: float = quantity(
        0.0, "N.m.s/rad", 0, 1e4, "DC motor at the crank: fall of its torque over speed; 0: speed prescribed", "left open"
    )
    motor_inertia: float = quantity(0.02, "kg.m^2", 0, 10, "of the motor's rotor at the crank", "left open")

    def under(self, made: Mechanism) -> Mechanism:
        """Put the mechanism under gravity, and let the motor turn its crank instead of the drive.

        The voltage is the one at which the motor without load has the drive's speed; it starts with that speed. The torque
        constant is 1 N m/A: only the slope of torque over speed matters, its square over the resistance.
        """
        if self.gravity:
            made = replace(made, gravity=self.pull)
        if not self.motor:
            return made
        speed: Any = made.drives[0].speed
        voltage, first = (lambda t: speed.speed(t), speed.speed(0.0)) if isinstance(speed, Ramp) else (speed, speed)
        motor = Motor("crank", voltage, resistance=1 / self.motor, constant=1.0, inertia=self.motor_inertia)
        return replace(made, drives=(), loads=(*made.loads, motor), velocities={"crank": float(first)})

    def lasts(self, duration: float) -> float:
        """Bound the time [s] in which the crank turns as far as it would at the speed without load in `duration` [s]."""
        return duration * (SLOWED if self.motor else 1.0)

    def describe(self) -> str:
        """State gravity and motor in one sentence."""
        drive = f"DC motor of {self.motor:g} N m s, {self.motor_inertia:g} kg m²" if self.motor else "speed prescribed"
        return f"Left open by the paper: gravity {self.down}; crank: {drive}"


@dataclass(frozen=True)
class StrikeParameters(StrikeAssumptions):
    """Gravity and motor, and how the strip is simulated."""

    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode (beam)", "strip")
    imperfection: float = quantity(
        1e-4, "1", -0.05, 0.05, "bow of the unloaded strip over its length, to the side its inertia bends it (beam)", "strip"
    )
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-9, 1e-3, "position error allowed a step, over the length", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a run may take", "numerics")


def crank_angle(signals: Mapping[str, Array]) -> Array:
    """Return the crank angle from 0 at the start [rad]: of the drive, or where a motor has turned the crank."""
    if "drive.position" in signals:
        return np.asarray(signals["drive.position"])
    return np.unwrap(np.arctan2(signals["crank.y"], signals["crank.x"]))


@dataclass(frozen=True)
class ImpactParameters(StrikeParameters):
    """Parameters of every study of the slider-crank; each adds its drive."""

    models: tuple[str, ...] = choices(MODELS, MODELS, "models to run side by side", "models")
    thickness: float = quantity(3e-4, "m", 5e-5, 1e-3, "thickness of the strip", "strip")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    friction: float = quantity(0.1, "1", 0, 0.9, "Coulomb coefficient of the slider by its weight", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")

    @property
    def section(self) -> Section:
        """Section of the strip, without damping."""
        return Section(STRIP_WIDTH, self.thickness)

    @property
    def friction_force(self) -> float:
        """Coulomb friction of the slider [N]."""
        return self.friction * self.mass * GRAVITY

    def describe(self) -> str:
        """State in one sentence what the paper does not give."""
        known = f"{super().describe()}; bow {self.imperfection:g} of the length; slider {self.mass:g} kg"
        return known + ("; stitched knows neither gravity nor motor" if self.gravity or self.motor else "")


@dataclass(frozen=True)
class ModelRun:
    """One model's run.

    Attributes
    ----------
    status, message : as of `buckler.mbs.Result`; an OK run may carry a message about the mechanism
    time, angle, force, speed, shortening, push : time [s]; crank angle [rad]; force on the stop [N]; slider speed towards the
        stop [m/s]; shortening of the strip over its length; compression of the strip [N]; shape (samples,)
    overload : above 1 before the slider has met the stop, the strip has buckled on its way: compression of the rigid coupler
        over the Euler load (stitched), or shortening over 1e-3; shape (samples,)
    energy_balance : largest ledger error over the energy put through
    work : wall_s, steps
    """

    model: str
    status: str
    message: str
    time: Array
    angle: Array
    force: Array
    speed: Array
    shortening: Array
    push: Array
    overload: Array
    energy_balance: float
    work: dict[str, float]

    @property
    def signals(self) -> dict[str, Array]:
        """Arrays by name, as signals.npz holds them."""
        return {f"{self.model}.{name}": getattr(self, name) for name in ("time", "angle", "force", "speed", "shortening")}


def exact_force(parameters: ImpactParameters, angle: ArrayLike) -> Any:
    """Compute the force of the exact elastica on the stop [N] in equilibrium, at crank angles in contact [rad]."""
    return PAPER.push(pinned.load, parameters.section.bending_stiffness, angle, PAPER_STOP)


class TurnReading(NamedTuple):
    """Numbers of one turn of the crank; nan where something does not happen.

    Attributes
    ----------
    contact_angle, settled, release_angle : crank angles of first contact, from which the slider rests against the stop, and of
        last contact [rad]; `settled` is nan if the slider is off the stop at the dead centre
    contact_time, settling_time : from first contact until the last, and until the slider rests [s]
    impact_speed, rebound_ratio : speed of the slider at first contact [m/s], and the share of it with which it leaves
    impact_peak, impact_impulse, impact_time : largest force [N], impulse [N s] and duration [s] of the first impact
    impact_push : largest compression of the strip until the first impact ends [N]
    rebounds : returns of the slider to the stop on the way in
    force_180, contact_max : force at the dead centre, and the largest around it if the slider rests [N]
    shortening, early_shortening : largest end shortening, and its change before first contact, over the length
    buckles_before_stop : whether the strip buckles before the slider meets the stop
    """

    contact_angle: float = nan
    settled: float = nan
    release_angle: float = nan
    contact_time: float = 0.0
    settling_time: float = nan
    impact_speed: float = nan
    rebound_ratio: float = nan
    impact_peak: float = 0.0
    impact_impulse: float = 0.0
    impact_time: float = nan
    impact_push: float = nan
    rebounds: int = 0
    force_180: float = nan
    contact_max: float = nan
    shortening: float = nan
    early_shortening: float = nan
    buckles_before_stop: bool = False

    @property
    def contact_turn(self) -> float:
        """Angle from first contact to the last [rad]."""
        return self.release_angle - self.contact_angle


def read(run: ModelRun, turn: int = 0) -> TurnReading:
    """Read one turn of the crank; the first is number 0."""
    part = slice(*np.searchsorted(run.angle, (2 * pi * turn, 2 * pi * (turn + 1))))
    time, angle, force, speed = run.time[part], run.angle[part] - 2 * pi * turn, run.force[part], run.speed[part]
    if not time.size:
        return TurnReading()
    own = force.copy()
    own[[0, -1]] = 0.0  # contacts across the ends belong to other turns
    contacts, shortening = spells(own), run.shortening[part]
    until = contacts[0, 0] + 1 if len(contacts) else None
    found = TurnReading(
        force_180=float(np.interp(pi, angle, force, right=nan)),
        shortening=float(shortening.max()),
        early_shortening=float(np.ptp(shortening[:until])),
        buckles_before_stop=bool((run.overload[part][:until] > 1).any()),
    )
    if not len(contacts):
        return found
    (start, free), released = contacts[0], contacts[-1, 1] - 1
    with_ends = slice(start - 1, free + 1)  # with the adjacent samples without force
    return found._replace(
        contact_angle=float(angle[start]),
        release_angle=float(angle[released]),
        contact_time=float(time[released] - time[start]),
        impact_speed=float(speed[start - 1]),
        rebound_ratio=-float(speed[free] / speed[start - 1]) if angle[free - 1] < pi else nan,
        impact_peak=float(force[with_ends].max()),
        impact_impulse=float(np.trapezoid(force[with_ends], time[with_ends])),
        impact_time=float(time[free - 1] - time[start]),
        impact_push=float(run.push[part][start:free].max()),
        **_rest(time, angle, force, contacts),
    )


def _rest(time: Array, angle: Array, force: Array, contacts: Array) -> dict[str, Any]:
    """Count how often the slider comes back, and find from where on it stays."""
    inwards = contacts[angle[contacts[:, 0] - 1] < SETTLED_BY]  # later ones are on the outward stroke
    if not len(inwards):
        return {}
    (start, free), rebounds = inwards[-1], {"rebounds": len(inwards) - 1}
    if not angle[start] < pi <= angle[free - 1]:
        return rebounds
    top = force[(angle >= max(angle[start], DEAD_CENTRE[0])) & (angle <= DEAD_CENTRE[1])].max()
    return {
        **rebounds, "settled": float(angle[start]), "settling_time": float(time[start] - time[contacts[0, 0]]),
        "contact_max": float(top),
    }  # fmt: skip


def findings(run: ModelRun, readings: Sequence[TurnReading]) -> list[str]:
    """List remarks of a finished run on the mechanism, not on the run, each beginning with a name."""
    if run.status not in ("OK", "SUSPECT"):
        return []
    states = {
        "BUCKLES_BEFORE_STOP: the strip is buckled, or swings far, before the slider meets the stop": lambda r: (
            r.buckles_before_stop
        ),
        "NO_CONTACT: the slider does not meet the stop": lambda r: r.contact_time == 0,
        "NOT_SETTLED: the slider is not at rest against the stop at the dead centre": lambda r: (
            r.contact_time > 0 and isnan(r.settling_time)
        ),
        "NO_REBOUND: the force does not return to zero, so that impact and contact are one": lambda r: r.settling_time == 0,
    }
    found = [run.message] if run.status == "OK" and run.message else []
    for state, holds in states.items():
        if turns := [str(turn) for turn, reading in enumerate(readings, 1) if holds(reading)]:
            found.append(state + (f" (turn {', '.join(turns)})" if len(readings) > 1 else ""))
    return [f"{run.model}: {text}" for text in found]


def by_case(metrics: Mapping[str, Mapping[str, Metric]]) -> dict[str, Metric]:
    """Name every metric by its case, a model as a rule, and itself."""
    return {f"{case}.{name}": metric for case, own in metrics.items() for name, metric in own.items()}


def compare(metrics: Mapping[str, Mapping[str, Metric]], title: str, notes: Iterable[str]) -> Table:
    """Tabulate the metrics of all cases: published, exact, and the value of each with its relative error."""
    rows: list[list[Any]] = []
    for name in dict.fromkeys(name for own in metrics.values() for name in own):
        found = [own.get(name) for own in metrics.values()]
        first = next(metric for metric in found if metric is not None)
        shown = [None if metric is None else _format(metric) for metric in found]
        rows.append([name, first.unit, first.published, first.exact, *shown])
    return Table(["", "unit", "published", "exact", *metrics], rows, title, "\n".join(notes))


def _format(metric: Metric) -> str:
    """Write a value, and in brackets its error or its deviation from the published one."""
    error = metric.error
    if error is None and metric.published:
        error = abs(metric.value / metric.published - 1)
    return f"{metric.value:.5g}" + ("" if error is None or isnan(error) else f" ({relative(error)})")
