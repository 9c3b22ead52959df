"""One pass of a solver: what it left, how it ended, what it cost; signals with units and energies of its record.

A link is a spring of stiffness E A/L along itself. With the masses it holds it rings at kilohertz after each jump of an
acceleration, hardly damped: how much is a matter of microseconds of the start or of a blow. Each such force `F` comes with
`F.mean`: a mean over a period T, taken twice. Of a frequency f it leaves (sin(pi f T)/(pi f T))^2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..elements.link import moving
from ..elements.signal import Kind, Signal, Trait
from ..geometry import Array
from ..laws import BristleLaw
from ..mechanism import Mechanism
from ..scene.scene import Scene
from .errors import Status
from .record import Record, between


def collect(record: Record, asked: str = "") -> dict[str, Signal]:
    """All signals by name: places and velocities of the points, what each element has to say, means of the forces that ring.

    Of points and elements that a text does not mention there are none, where one is given.
    """

    def is_asked(name: str) -> bool:
        """Return True if a signal, or part of its name, was asked for."""
        return not asked or any(word in asked for word in name.split("."))

    found: dict[str, Signal] = {}
    for point in filter(is_asked, record.mechanism.points):
        found |= {signal.name: signal for signal in moving(point, *record.point(point))}
    for name, element in Scene.of(record.mechanism).elements.items():
        if is_asked(name):
            free = name in record.undetermined
            for signal in element.signals(name, record):  # places and the like of its element are determined
                undetermined = free and signal.kind is Kind.REACTION
                found[signal.name] = signal._replace(kind=Kind.UNDETERMINED) if undetermined else signal
    return found | {signal.name: signal for signal in means(record.mechanism, record.time, found)}


@dataclass(frozen=True)
class Shape:
    """A flexible link at chosen times [s]: positions along it [m], (times, stations, 2), and its thickness in the plane [m]."""

    times: Array
    points: Array
    thickness: float


def shapes_at(record: Record, times: Array) -> dict[str, Shape]:
    """Flexible links at chosen times: cubic Hermite interpolation of recorded coordinates and rates."""
    last = record.time[-1]
    times = np.minimum(times[times <= last * (1 + 1e-9)], last)  # a run that failed did not get to the others
    if len(record.time) < 2:
        return {}
    bent = {name: motion for name, motion in record.links.items() if record.mechanism.link(name).body.flexible}
    found = {}
    for name, motion in bent.items():
        section = record.mechanism.link(name).body.section
        found[name] = Shape(times, between(motion, record.time, times).line(), section.thickness)
    return found


RINGING = (Kind.REACTION, Kind.INTERNAL)
RINGS = 4
"""Steps in a period of axial vibration from which a run follows it."""


def means(mechanism: Mechanism, time: Array, signals: Mapping[str, Signal]) -> Iterator[Signal]:
    """Yield the means of the forces that ring; none of a mechanism without flexible links."""
    period = Scene.of(mechanism).axial_period
    if not period > 0 or len(time) < 3:
        return
    for name, signal in signals.items():
        if signal.kind in RINGING and signal.unit in ("N", "N m"):
            values = running_mean(time, running_mean(time, signal.values, period), period)
            group = f"{signal.group}.mean" if signal.group else ""
            yield Signal(f"{name}.mean", values, signal.unit, signal.kind, group, period=period, source=name)


def running_mean(time: Array, values: Array, period: float) -> Array:
    """Compute the mean over a period about each time; about the nearest time of which a whole period lies within the run."""
    total = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))])
    period = min(period, time[-1] - time[0])
    middle = np.clip(time, time[0] + period / 2, time[-1] - period / 2)

    def integral(t: Array) -> Array:
        """Return the integral up to times, of values linear between instants."""
        k = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(time) - 2)
        s = t - time[k]
        slope = (values[k + 1] - values[k]) / (time[k + 1] - time[k])
        return np.asarray(total[k] + s * (values[k] + s * slope / 2))

    return (integral(middle + period / 2) - integral(middle - period / 2)) / period


def follows(time: Array, period: float) -> bool:
    """Return True if steps resolve a vibration: not where they are long for a whole period of it, as there it is damped away."""
    steps = np.diff(time)
    return not float(steps[RINGS * steps > period].sum()) > period


BALANCE = 1e-2
"""Energy balance, relative to the energy put through, beyond which a run is suspect."""
AT_REST = 1e-6
"""Way, in lengths of the largest link, below which nothing has moved in the whole run."""
STRETCH = 1e-5
"""Amplitude of axial vibration of a strip that steps leave out, relative to its length. Its energy is missing in the balance."""
BRISTLE = 1e-4
"""Amplitude of a slider on the bristles of its friction that steps leave out, relative to the length; its energy likewise."""


def ledger(record: Record) -> dict[str, Array]:
    """Energies over the run, J, each of shape (times,).

    Returns
    -------
    dict
        Held: `kinetic`, `strain`, `contact`, `weight`. Taken since t = 0: `taken_contact`, `taken_friction`, `taken_damping`.
        Given since t = 0: `given_drive`. `error` = change of what is held + taken - given. `throughput`: the most that was
        held and taken by then, the measure for the error. Of each joint with clearance `<point>.taken_contact` and
    `.taken_friction`.
    """
    zero = np.zeros_like(record.time)
    held = {"kinetic": zero, "strain": zero}
    taken = {"taken_damping": zero}
    given = {"given_drive": zero}
    single: dict[str, Array] = {}
    for name, element in Scene.of(record.mechanism).elements.items():
        for kind, what, values in element.energies(name, record):
            if kind == "single":
                single[what] = values
                continue
            column, key = {"held": (held, what), "taken": (taken, f"taken_{what}"), "given": (given, f"given_{what}")}[kind]
            column[key] = column.get(key, zero) + values
    total, lost = sum(held.values(), zero), sum(taken.values(), zero)
    error = total - total[0] + lost - sum(given.values(), zero)
    active = sum((value - value.min() if name in ("weight", "spring") else value) for name, value in held.items())
    throughput = np.maximum.accumulate(active + lost)
    return {**held, **taken, **given, "error": error, "throughput": throughput, **single}


def put_through(record: Record, energy: Mapping[str, Array], signals: Mapping[str, Array]) -> tuple[float, float]:
    """Energy put through, J, and the share of it that stiff vibrations that nobody sees may hold."""
    mechanism, duration = record.mechanism, float(record.time[-1]) or 1.0
    mass = sum(link.mass(mechanism.length(link.name)) for link in mechanism.links)
    at_rest = mass * (AT_REST * size_of(record) / duration) ** 2 / 2  # at a speed at which nothing moves in a run this long
    through = max(float(energy["throughput"][-1]), at_rest)
    return through, 2 * (_unseen_stretch(record, signals) + _unseen_bristles(record, signals)) / through


def size_of(record: Record) -> float:
    """Longest link, m."""
    return max(record.mechanism.length(link.name) for link in record.mechanism.links)


def _unseen_stretch(record: Record, signals: Mapping[str, Array]) -> float:
    """Largest axial strain energy, J, of strips whose axial strain nobody sees, or whose axial vibration steps do not follow."""
    total, followed = 0.0, follows(record.time, Scene.of(record.mechanism).axial_period)
    for link in record.mechanism.links:
        if link.body.meshed:
            stiffness = link.body.section.axial_stiffness
            strain = float(np.abs(signals[f"{link.name}.axial_force"]).max()) / stiffness
            if strain < STRETCH or not followed:
                total += stiffness * record.mechanism.length(link.name) * strain**2 / 2
    return total


def _unseen_bristles(record: Record, signals: Mapping[str, Array]) -> float:
    """Largest energy, J, of the bristles of sliders that they hold within a way nobody sees."""
    total = 0.0
    for guide in record.mechanism.guides:
        if isinstance(guide.friction, BristleLaw):
            energies = guide.energies(guide.key, record)
            held = max(float(values.max()) for kind, name, values in energies if (kind, name) == ("held", "contact"))
            drags = [signals.get(f"{owner}.friction_force", np.zeros(1)) for owner in (guide.point, guide.key)]
            force = max(float(np.abs(drag).max()) for drag in drags)
            if 2 * held < BRISTLE * size_of(record) * force:
                total += held
    return total


@dataclass(frozen=True, eq=False)
class Run:
    """One pass of a solver: its record, failure, work, and the numbers of what the scene was made of.

    `notes` hold what is worth knowing of the mechanism, as redundant constraints left out; `unseen` the edges of a user's
    function that the run passed. `asked` is a text that names the signals wanted; '' for all.
    """

    solver: Any
    record: Record
    failure: tuple[Status, str] | None
    work: dict[str, float]
    summary: Mapping[str, int] = field(default_factory=dict)
    notes: Sequence[str] = ()
    unseen: str = ""
    asked: str = ""

    @cached_property
    def signals(self) -> dict[str, Signal]:
        """All signals by name."""
        return collect(self.record, self.asked)

    @cached_property
    def ledger(self) -> dict[str, Array]:
        """Energies over the run [J], as `ledger` makes them."""
        return ledger(self.record)

    @property
    def values(self) -> dict[str, Array]:
        """Values of the signals, each (times,)."""
        return {name: signal.values for name, signal in self.signals.items()}

    @property
    def units(self) -> dict[str, str]:
        """Units of the signals."""
        return {name: signal.unit for name, signal in self.signals.items()}

    @property
    def traits(self) -> dict[str, Trait]:
        """Properties of the signals."""
        return {name: signal.trait for name, signal in self.signals.items()}
