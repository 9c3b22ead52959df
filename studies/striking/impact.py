"""What the slider-crank studies share: their parameters, a model's run, and what is read off it.

The models themselves are in studies/striking/impact_models.py.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isnan, nan, pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from buckler.elastica import pinned
from buckler.mbs import Section
from buckler.mbs.accuracy.words import FINEST
from buckler.mbs.geometry import Array
from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.mbs.sensitivity.curve import spells

from ..kit.parameters import choices, quantity
from ..kit.published import GRAVITY, STRIP_WIDTH
from ..kit.report import Metric, StudyResult, Table, worst
from ..kit.style import Axes
from .assumptions import StrikeParameters

MODELS = ("stitched", "strut", "beam")
COLOURS = {"stitched": "#E69F00", "strut": "#0072B2", "beam": "#D55E00", "exact": "#000000", "published": "#009E73"}
SETTLED_BY = np.radians(210.0)
"""Crank angle up to which a contact that begins belongs to the way in."""
DEAD_CENTRE = np.radians((165.0, 195.0))
"""Crank angles between which the largest contact force is looked for."""


@dataclass(frozen=True)
class ImpactParameters(StrikeParameters):
    """Parameters of every slider-crank study; each adds its drive."""

    models: tuple[str, ...] = choices(MODELS, MODELS, "models to run side by side", "models")
    thickness: float = quantity(3e-4, "m", 5e-5, 1e-3, "thickness of the strip", "strip")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    friction: float = quantity(0.1, "1", 0, 0.9, "Coulomb coefficient of the slider by its weight", "slider and stop")
    restitution: float = quantity(0.8, "1", 0.1, 1, "restitution of the stop", "slider and stop")
    accuracy: float = quantity(0, "1", 0, 0.1, "error of the motion asked for, instead of elements and tolerance", "numerics")

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
        """Coulomb friction of the slider, N."""
        return self.friction * self.mass * GRAVITY

    def stated(self) -> str:
        """One sentence for a table."""
        told = f"{super().stated()}; bow {self.imperfection:g} of the length; slider {self.mass:g} kg"
        return told + ("; stitched knows neither gravity nor motor" if self.gravity or self.motor else "")


@dataclass(frozen=True)
class ModelRun:
    """One model's run.

    Attributes
    ----------
    status, message : as of `buckler.mbs.Result`; an OK run may carry a message about the mechanism
    time, angle, force, speed, shortening : s; crank angle, rad; force on the stop, N; slider speed towards the stop, m/s;
        relative shortening of the strip, shape (samples,)
    overload : above 1 before the slider has met the stop, the strip has buckled on its way: `stitched` compares the
        compression its rigid mode asks for with the Euler load, the others their shortening with 1e-3, shape (samples,)
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
    overload: Array
    energy_balance: float
    work: dict[str, float]

    @property
    def ended(self) -> bool:
        """Whether it came to its end."""
        return self.status in ("OK", "SUSPECT")

    @property
    def signals(self) -> dict[str, Array]:
        """Arrays by name, for signals.npz."""
        names = ("time", "angle", "force", "speed", "shortening")
        return {f"{self.model}.{name}": getattr(self, name) for name in names}


def exact_force(parameters: ImpactParameters, angle: ArrayLike) -> Any:
    """Force on the stop of the exact elastica in equilibrium, N; angles in contact, rad."""
    return PAPER.push(pinned.load, parameters.section.bending_stiffness, angle, PAPER_STOP)


class Reading(NamedTuple):
    """What one turn of the crank does to the stop; nan where it does not happen.

    Attributes
    ----------
    contact_angle, settled, release_angle : crank angles of first contact, from which the slider rests against the stop, and of
        last contact, rad; `settled` is nan if the slider is off the stop at the dead centre
    contact_time, settling_time : from first contact until the last, and until the slider rests, s
    impact_speed, rebound_ratio : of the slider at first contact, m/s, and the share of it with which it leaves
    impact_peak, impact_impulse, impact_time : largest force, N, impulse, N s, and duration, s, from first contact until the
        force first returns to zero
    rebounds : how often the slider comes back to the stop on the way in
    force_180, contact_max : force at the dead centre, and the largest around it if the slider rests, N
    shortening : largest end shortening over the length
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
    rebounds: int = 0
    force_180: float = nan
    contact_max: float = nan
    shortening: float = nan
    buckles_before_stop: bool = False

    @property
    def turned(self) -> float:
        """Angle from first contact to the last, rad."""
        return self.release_angle - self.contact_angle


def read(run: ModelRun, turn: int = 0) -> Reading:
    """Read one turn of the crank; the first is number 0."""
    part = slice(*np.searchsorted(run.angle, (2 * pi * turn, 2 * pi * (turn + 1))))
    time, angle, force, speed = run.time[part], run.angle[part] - 2 * pi * turn, run.force[part], run.speed[part]
    if not time.size:
        return Reading()
    own = force.copy()
    own[[0, -1]] = 0.0  # what begins before or ends after the turn belongs to another
    contacts = spells(own)
    until = contacts[0, 0] + 1 if len(contacts) else None
    found = Reading(
        force_180=float(np.interp(pi, angle, force, right=nan)),
        shortening=float(run.shortening[part].max()),
        buckles_before_stop=bool((run.overload[part][:until] > 1).any()),
    )
    if not len(contacts):
        return found
    (start, free), released = contacts[0], contacts[-1, 1] - 1
    with_ends = slice(start - 1, free + 1)  # the samples without force beside it
    return found._replace(
        contact_angle=float(angle[start]),
        release_angle=float(angle[released]),
        contact_time=float(time[released] - time[start]),
        impact_speed=float(speed[start - 1]),
        rebound_ratio=-float(speed[free] / speed[start - 1]) if angle[free - 1] < pi else nan,
        impact_peak=float(force[with_ends].max()),
        impact_impulse=float(np.trapezoid(force[with_ends], time[with_ends])),
        impact_time=float(time[free - 1] - time[start]),
        **_rest(time, angle, force, contacts),
    )


def _rest(time: Array, angle: Array, force: Array, contacts: Array) -> dict[str, Any]:
    """How often the slider comes back, and from where on it stays."""
    inwards = contacts[angle[contacts[:, 0] - 1] < SETTLED_BY]  # those that begin later are the way out
    if not len(inwards):
        return {}
    (start, free), rebounds = inwards[-1], {"rebounds": len(inwards) - 1}
    if not angle[start] < pi <= angle[free - 1]:
        return rebounds
    top = (angle >= max(angle[start], DEAD_CENTRE[0])) & (angle <= DEAD_CENTRE[1])
    settling = {"settled": float(angle[start]), "settling_time": float(time[start] - time[contacts[0, 0]])}
    return {**rebounds, **settling, "contact_max": float(force[top].max())}


def findings(run: ModelRun, readings: Iterable[Reading]) -> list[str]:
    """What a finished run says about the mechanism rather than about itself, in words that begin with a name."""
    if not run.ended:
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


def told(
    p: ImpactParameters,
    runs: Sequence[ModelRun],
    notes: Iterable[str],
    metrics: Mapping[str, Mapping[str, Metric]],
    signals: Mapping[str, Array],
    tables: Sequence[Table],
) -> StudyResult:
    """Of a study: status and message of its worst run, and all that was found; signals and work of each model."""
    return StudyResult(
        parameters=p,
        **worst([(run.model, run) for run in runs], notes),
        metrics={f"{model}.{name}": metric for model, own in metrics.items() for name, metric in own.items()},
        signals={**signals, **{name: values for run in runs for name, values in run.signals.items()}},
        work={f"{run.model}.{name}": value for run in runs for name, value in run.work.items()},
        tables=tables,
    )  # fmt: skip


def draw_force(ax: Axes, x: Array, force: Array, model: str, floor: float, **look: object) -> None:
    """Draw a force on the stop on a logarithmic axis that begins at a floor, N; without contact it lies below."""
    ax.semilogy(x, np.maximum(force, floor / 2), color=COLOURS[model], label=model, **look)


def frame_force(ax: Axes, floor: float, room: float) -> None:
    """End a logarithmic axis of forces, from its floor, N, with room for a legend: that many times the largest."""
    ax.set(ylim=(floor, None), ylabel="force on the stop [N]")
    ax.set_ylim(top=room * ax.get_ylim()[1])
    ax.yaxis.set_major_formatter("{x:g}")


def draw_published(ax: Axes, force: float, label: str = "", at: float = 0) -> None:
    """Draw a published force, N, with its label at a place of the axis."""
    ax.axhline(force, color=COLOURS["published"], linestyle=":")
    ax.annotate(label, (at, force), xytext=(0, 3), textcoords="offset points", color=COLOURS["published"], fontsize=8)
