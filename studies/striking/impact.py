"""Striking slider-crank: parameters of its studies, the run of a model, and the numbers that are read from a turn of the crank.

A contact is a time interval in which the stop feels a force. The first contact is the impact; later ones are rebounds. The slider
rests at the dead centre, 180 degrees, if it is in contact there and no later contact begins before 210 degrees.
The paper is B. Demirel et al., 2008, doi 10.1115/IMECE2008-68796.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isnan, nan, pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from buckler.elastica import pinned
from buckler.mbs import Mechanism, Motor, Ramp, Section
from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.mbs.sensitivity.curve import positive_ranges

from ..kit.parameters import Gravity, choices, integer, quantity
from ..kit.published import GRAVITY, STRIP_WIDTH
from ..kit.report import Metric, Table, relative

MODELS = ("stitched", "strut", "beam")
"""Models of the slider-crank, which the module `impact_models` describes."""
COLOURS = {"stitched": "#E69F00", "strut": "#0072B2", "beam": "#D55E00", "exact": "#000000", "published": "#009E73"}
SETTLED_BY = np.radians(210.0)
"""Crank angle before which the onset of a contact counts [rad], chosen: a slider that still bounces there does not rest."""


@dataclass(frozen=True)
class StrikeAssumptions(Gravity):
    """Gravity and motor of every study of the striking slider-crank."""

    motor: float = quantity(
        0.0, "N.m.s/rad", 0, 1e4, "DC motor at the crank: fall of its torque over speed; 0: speed prescribed", "unpublished"
    )
    motor_inertia: float = quantity(0.02, "kg.m^2", 0, 10, "inertia of the motor's rotor at the crank", "unpublished")

    def apply(self, mechanism: Mechanism) -> Mechanism:
        """Add gravity to a mechanism, and replace the drive of its crank by the motor.

        The motor starts with the speed of the drive, and its voltage is the one that gives this speed without load. Only the
        slope of torque over speed, constant^2/resistance, matters: the torque constant is 1 N m/A.
        """
        if self.gravity:
            mechanism = replace(mechanism, gravity=self.gravity_vector)
        if not self.motor:
            return mechanism
        speed: Any = mechanism.drives[0].speed
        voltage, first = speed, speed
        if isinstance(speed, Ramp):
            voltage, first = (lambda t: speed.speed(t)), speed.speed(0.0)  # a function of time, and its value at the start
        motor = Motor("crank", voltage, resistance=1 / self.motor, constant=1.0, inertia=self.motor_inertia)
        return replace(mechanism, drives=(), loads=(*mechanism.loads, motor), velocities={"crank": float(first)})

    def extend_for_motor(self, duration: float) -> float:
        """Return the duration of a run [s], 20 % longer with a motor.

        A motor that explains the published forces turns the crank less than 20 % more slowly than the drive.
        """
        return duration * (1.2 if self.motor else 1.0)

    def describe(self) -> str:
        """State gravity and motor in one sentence."""
        drive = f"DC motor of {self.motor:g} N m s, {self.motor_inertia:g} kg m²" if self.motor else "speed prescribed"
        return f"Left open by the paper: gravity {self.gravity_text}; crank: {drive}"


@dataclass(frozen=True)
class StrikeParameters(StrikeAssumptions):
    """Gravity and motor, the strip's damping and bow, and the accuracy of a simulation."""

    damping: float = quantity(0.05, "1", 0, 1, "damping ratio of the strip's first bending mode (beam)", "strip")
    imperfection: float = quantity(
        1e-4, "1", -0.05, 0.05, "bow of the unloaded strip over its length, to the side its inertia bends it (beam)", "strip"
    )
    elements: int = integer(8, 2, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-9, 1e-3, "position error allowed a step, over the length", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a run may take", "numerics")


def crank_angle(signals: Mapping[str, Array]) -> Array:
    """Return the crank angle from 0 at the start [rad]: position of the drive, or of the crank that a motor turns."""
    if "drive.position" in signals:
        return np.asarray(signals["drive.position"])
    return np.unwrap(np.arctan2(signals["crank.y"], signals["crank.x"]))  # of its centre of mass; it turns about the origin


@dataclass(frozen=True)
class ImpactParameters(StrikeParameters):
    """Parameters of the slider-crank without its drive, which each study adds."""

    models: tuple[str, ...] = choices(MODELS, MODELS, "models to run side by side", "models")
    thickness: float = quantity(3e-4, "m", 5e-5, 1e-3, "thickness of the strip", "strip")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    friction: float = quantity(0.1, "1", 0, 0.9, "Coulomb friction of the slider over its weight", "slider and stop")
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
    """Run of one model; arrays have the shape (samples,)."""

    model: str
    status: str  # of `buckler.mbs.Result`
    message: str  # of an OK run: a remark on the mechanism
    time: Array  # [s]
    angle: Array  # of the crank [rad]
    force: Array  # on the stop [N]
    speed: Array  # of the slider towards the stop [m/s]
    shortening: Array  # end shortening of the strip over its length
    push: Array  # compression of the strip [N]
    # Above 1 the strip is buckled. For strut and beam: `shortening` over `impact_models.BUCKLED_FROM`. For stitched: the
    # compression of the rigid coupler over the Euler load.
    buckling_ratio: Array
    energy_balance: float  # largest error of the energy ledger over the throughput
    work: dict[str, float]  # `wall_s`, the run time [s], and `steps`


def exact_force(parameters: ImpactParameters, angle: ArrayLike) -> Any:
    """Compute the force of the exact elastica on the stop in equilibrium [N], at crank angles in contact [rad]."""
    return PAPER.push(pinned.load, parameters.section.bending_stiffness, angle, PAPER_STOP)


class TurnReading(NamedTuple):
    """Numbers of one turn of the crank; for an event that does not happen, nan, or 0 where that is the default."""

    contact_angle: float = nan  # crank angle at the first contact [rad]
    rest_angle: float = nan  # crank angle at the onset of rest [rad], nan if the slider is off the stop at the dead centre
    release_angle: float = nan  # crank angle at the end of the last contact [rad]
    contact_time: float = 0.0  # time from the first contact to the end of the last [s]
    settling_time: float = nan  # time from the first contact to the onset of rest [s], nan without rest
    impact_speed: float = nan  # speed of the slider at first contact [m/s]
    rebound_ratio: float = nan  # speed after the impact over `impact_speed`
    impact_peak: float = 0.0  # largest force of the impact [N]
    impact_impulse: float = 0.0  # [N s]
    impact_time: float = nan  # duration of the impact [s]
    impact_push: float = nan  # largest compression of the strip in the impact [N]
    rebounds: int = 0  # that begin before `SETTLED_BY`
    force_180: float = nan  # force on the stop at the dead centre [N]
    contact_max: float = nan  # largest force around the dead centre if the slider rests [N]
    shortening: float = nan  # largest end shortening over the length
    early_shortening: float = nan  # change of the end shortening before the first contact, over the length
    buckles_before_stop: bool = False  # the strip buckles before the slider meets the stop


def read(run: ModelRun, turn: int = 0) -> TurnReading:
    """Read one turn of the crank; the first turn is number 0."""
    part = slice(*np.searchsorted(run.angle, (2 * pi * turn, 2 * pi * (turn + 1))))
    time, angle, force, speed = run.time[part], run.angle[part] - 2 * pi * turn, run.force[part], run.speed[part]
    if not time.size:
        return TurnReading()
    inner = force.copy()
    inner[[0, -1]] = 0.0  # so that each contact has a sample before it and one after it
    contacts, shortening = positive_ranges(inner), run.shortening[part]  # a contact: its first sample, the first one after it
    before = slice(contacts[0, 0] + 1 if len(contacts) else None)  # up to the first sample in contact, at or after its onset
    found = TurnReading(
        force_180=float(np.interp(pi, angle, force, right=nan)), shortening=float(shortening.max()),
        early_shortening=float(np.ptp(shortening[before])),
        buckles_before_stop=bool((run.buckling_ratio[part][before] > 1).any()),
    )  # fmt: skip
    if not len(contacts):
        return found
    (start, after), released = contacts[0], contacts[-1, 1] - 1
    with_ends = slice(start - 1, after + 1)  # the impact and the adjacent samples, whose force is 0
    is_rebound = angle[after - 1] < pi  # later, the crank pulls the slider off the stop
    return found._replace(
        contact_angle=float(angle[start]), release_angle=float(angle[released]),
        contact_time=float(time[released] - time[start]), impact_speed=float(speed[start - 1]),
        rebound_ratio=-float(speed[after] / speed[start - 1]) if is_rebound else nan,
        impact_peak=float(force[with_ends].max()), impact_impulse=float(np.trapezoid(force[with_ends], time[with_ends])),
        impact_time=float(time[after - 1] - time[start]), impact_push=float(run.push[part][start:after].max()),
        **_rest(time, angle, force, contacts),
    )  # fmt: skip


def _rest(time: Array, angle: Array, force: Array, contacts: Array) -> dict[str, Any]:
    """Count the rebounds before `SETTLED_BY`; where the slider rests, find the onset of rest and the largest contact force."""
    # the onset of a contact lies between the last sample before it and its first sample; the earlier of them decides
    early = contacts[angle[contacts[:, 0] - 1] < SETTLED_BY]
    if not len(early):
        return {}
    (start, after), fields = early[-1], {"rebounds": len(early) - 1}
    if not angle[start] < pi <= angle[after - 1]:
        return fields
    first, last = np.radians((165.0, 195.0))  # 15 degrees to either side of the dead centre, chosen
    is_central = (angle >= max(angle[start], first)) & (angle <= last)
    settling_time = float(time[start] - time[contacts[0, 0]])
    largest = float(force[is_central].max())
    return fields | {"rest_angle": float(angle[start]), "settling_time": settling_time, "contact_max": largest}


# A large shortening before the first contact counts as buckling, though a swing of the strip makes it, too.
STATES: dict[str, Callable[[TurnReading], bool]] = {
    "BUCKLES_BEFORE_STOP: the strip is buckled, or swings far, before the slider meets the stop": lambda x: x.buckles_before_stop,
    "NO_CONTACT: the slider does not meet the stop": lambda x: x.contact_time == 0,
    "NOT_SETTLED: the slider is not at rest against the stop at the dead centre": lambda x: (
        isnan(x.settling_time) and x.contact_time > 0
    ),
    "NO_REBOUND: the force does not return to zero, so that impact and contact are one": lambda x: x.settling_time == 0,
}
"""Remarks on the mechanism, each with a name, and the condition for them."""


def findings(run: ModelRun, readings: Sequence[TurnReading]) -> list[str]:
    """List the remarks on the mechanism that apply to a finished run, with the turns in which they do."""
    if run.status not in ("OK", "SUSPECT"):
        return []
    found = [run.message] if run.status == "OK" and run.message else []
    for state, applies in STATES.items():
        if turns := [str(turn) for turn, reading in enumerate(readings, 1) if applies(reading)]:  # in texts the first is turn 1
            found.append(state + (f" (turn {', '.join(turns)})" if len(readings) > 1 else ""))
    return [f"{run.model}: {text}" for text in found]


def by_case(metrics: Mapping[str, Mapping[str, Metric]]) -> dict[str, Metric]:
    """Join the metrics of all cases, often models, under names `case.metric`."""
    return {f"{case}.{name}": metric for case, each in metrics.items() for name, metric in each.items()}


def compare(metrics: Mapping[str, Mapping[str, Metric]], title: str, notes: Iterable[str]) -> Table:
    """Tabulate the metrics of all cases, a row for each metric: published and exact value, and the values of the cases."""
    rows: list[list[Any]] = []
    for name in dict.fromkeys(name for each in metrics.values() for name in each):
        found = [each.get(name) for each in metrics.values()]
        first = next(metric for metric in found if metric is not None)
        shown = [None if metric is None else _format(metric) for metric in found]
        rows.append([name, first.unit, first.published, first.exact, *shown])
    return Table(["", "unit", "published", "exact", *metrics], rows, title, "\n".join(notes))


def _format(metric: Metric) -> str:
    """Write a value, and in brackets its relative error, or else its relative difference from the published value."""
    error = metric.error
    if error is None and metric.published:
        error = abs(metric.value / metric.published - 1)
    return f"{metric.value:.5g}" + ("" if error is None or isnan(error) else f" ({relative(error)})")
