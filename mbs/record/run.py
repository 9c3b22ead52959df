"""One run of a solver: record, failure, computational work; signals with units and energies of the record.

A flexible link and the masses at its ends vibrate axially at kilohertz after each jump of an acceleration, hardly damped. A shift
of the jump by microseconds changes the phase. Each reaction and internal force `F` therefore has a signal `F.mean`: the mean over
an axial period T, taken twice. Each mean multiplies amplitudes at a frequency f by sin(pi f T)/(pi f T), zero at 1/T, 2/T, ...
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..elements.link import make_motion_signals
from ..elements.signal import Kind, Signal
from ..geometry import Array
from ..laws import BristleLaw
from ..mechanism import Mechanism
from ..scene.scene import Scene
from .errors import Failure
from .lookup import OUTSIDE, hermite, trapezoidal
from .record import Record, between


def collect(record: Record, asked: str = "") -> dict[str, Signal]:
    """Return all signals by name: places and velocities of points, signals of elements, running means of vibrating forces.

    The text `asked`, if not '', restricts them to the points and elements whose names it contains, also as a part of a word.
    """

    def is_asked(name: str) -> bool:
        """Return True for a point or element that the text may name."""
        return not asked or any(word in asked for word in name.split("."))

    found: dict[str, Signal] = {}
    for point in filter(is_asked, record.mechanism.points):
        place, velocity = record.point(point)
        found |= {signal.name: signal for signal in make_motion_signals(point, place, velocity)}
    for name, element in Scene.of(record.mechanism).elements.items():
        if is_asked(name):
            for signal in element.signals(name, record):
                undetermined = name in record.undetermined and signal.kind is Kind.REACTION
                found[signal.name] = signal._replace(kind=Kind.UNDETERMINED) if undetermined else signal
    return found | {signal.name: signal for signal in means(record.mechanism, record.time, found)}


@dataclass(frozen=True)
class Shape:
    """Shape of a flexible link at some times [s]: positions along it [m], (times, stations, 2), and its thickness [m]."""

    times: Array
    points: Array
    thickness: float


def shapes_at(record: Record, times: Array) -> dict[str, Shape]:
    """Interpolate the shapes of flexible links at some times [s], by cubic Hermite polynomials of coordinates and rates."""
    last = record.time[-1]
    times = np.minimum(times[times <= last * (1 + OUTSIDE)], last)  # a failed run ends earlier
    if len(record.time) < 2:
        return {}
    found = {}
    for name, motion in record.links.items():
        body = record.mechanism.link(name).body
        if body.flexible:
            found[name] = Shape(times, between(motion, record.time, times).line(), body.section.thickness)
    return found


def means(mechanism: Mechanism, time: Array, signals: Mapping[str, Signal]) -> Iterator[Signal]:
    """Yield the signals `F.mean` of vibrating forces and moments; none without flexible links."""
    period = Scene.of(mechanism).axial_period
    if not period > 0 or len(time) < 3:
        return
    for name, signal in signals.items():
        is_load = signal.unit in ("N", "N m")  # a force or moment, not a stress or strain
        if is_load and signal.kind in (Kind.REACTION, Kind.INTERNAL):
            values = running_mean(time, running_mean(time, signal.values, period), period)
            group = f"{signal.group}.mean" if signal.group else ""
            yield Signal(f"{name}.mean", values, signal.unit, signal.kind, group, period=period, source=name)


def running_mean(time: Array, values: Array, period: float) -> Array:
    """Compute the mean over a period [s] about each time; near the ends of the run, over the first or the last period."""
    period = min(period, time[-1] - time[0])
    middle = np.clip(time, time[0] + period / 2, time[-1] - period / 2)
    total = trapezoidal(time, values)  # integral of values linear between samples: parabolas, to which `hermite` is exact
    begin, end = (hermite(time, total, values, t)[0] for t in (middle - period / 2, middle + period / 2))
    return (end - begin) / period


def resolves(time: Array, period: float) -> bool:
    """Return True unless steps longer than a quarter of a period [s], which damp a vibration, make up more than one period."""
    steps = np.diff(time)
    long_steps = steps[4 * steps > period]
    return not float(long_steps.sum()) > period


BALANCE = 1e-2
"""Error of the energy balance, relative to the throughput, beyond which a run is suspect: a convention."""
STRETCH = 1e-5
"""Axial strain, in steel 2 MPa, below which steps need not resolve a strip's axial vibration; the balance may lack its energy.
Ten times more would let the balance lack 100 times the energy."""


def ledger(record: Record) -> dict[str, Array]:
    """Compute the energies over the run [J], each (times,), by name.

    Stored: `kinetic`, `strain`, `contact`, `weight`, `spring`. Dissipated since t = 0: `taken_contact`, `taken_friction`,
    `taken_damping`. Supplied since t = 0: `given_drive`. `error` = change of stored + dissipated - supplied energy. `throughput`:
    largest sum of stored and dissipated energy so far, in which weight and springs, whose zero is arbitrary, count from their
    minimum. Each joint with clearance also has `<point>.taken_contact` and `<point>.taken_friction`.
    """
    zero = np.zeros_like(record.time)
    stored = {"kinetic": zero, "strain": zero}
    dissipated = {"taken_damping": zero}
    supplied = {"given_drive": zero}
    # by kind: prefix of the names of energies, and the table of their sums
    sums = {"stored": ("", stored), "dissipated": ("taken_", dissipated), "supplied": ("given_", supplied)}
    of_joints: dict[str, Array] = {}
    for name, element in Scene.of(record.mechanism).elements.items():
        for kind, entry, values in element.energies(name, record):
            if kind == "part":  # of one joint with clearance, already in a sum
                of_joints[entry] = values
                continue
            prefix, energies = sums[kind]
            energies[prefix + entry] = energies.get(prefix + entry, zero) + values
    total, lost = sum(stored.values(), zero), sum(dissipated.values(), zero)
    error = total - total[0] + lost - sum(supplied.values(), zero)
    active = sum((value - value.min() if name in ("weight", "spring") else value) for name, value in stored.items())
    throughput = np.maximum.accumulate(active + lost)
    return {**stored, **dissipated, **supplied, "error": error, "throughput": throughput, **of_joints}


def compute_throughput(record: Record, energy: Mapping[str, Array], signals: Mapping[str, Array]) -> tuple[float, float]:
    """Return the throughput [J], and the share of it by which unresolved stiff vibrations may disturb the balance."""
    mechanism, duration = record.mechanism, float(record.time[-1]) or 1.0
    mass = sum(link.mass(mechanism.length(link.name)) for link in mechanism.links)
    # kinetic energy of a mechanism that counts as at rest: it moves by 1e-6 of its longest link in the run
    least = mass * (1e-6 * Scene.of(mechanism).linkage.size / duration) ** 2 / 2
    throughput = max(float(energy["throughput"][-1]), least)
    # twice the potential energy that these vibrations can store: the 2 is a margin
    return throughput, 2 * (_unresolved_stretch(record, signals) + _unresolved_bristles(record, signals)) / throughput


def _unresolved_stretch(record: Record, signals: Mapping[str, Array]) -> float:
    """Return the axial strain energy [J] at the largest force of each strip, summed over strips that may vibrate unseen."""
    total, resolved = 0.0, resolves(record.time, Scene.of(record.mechanism).axial_period)
    for link in record.mechanism.links:
        if link.body.meshed:  # a strip
            stiffness = link.body.section.axial_stiffness
            strain = float(np.abs(signals[f"{link.name}.axial_force"]).max()) / stiffness
            if strain < STRETCH or not resolved:
                total += stiffness * record.mechanism.length(link.name) * strain**2 / 2
    return total


def _unresolved_bristles(record: Record, signals: Mapping[str, Array]) -> float:
    """Return the largest energies [J] of sliders' bristles, summed over those too stiff for the steps to resolve their vibration.

    Bristles that deflect by less than 1e-4 of the longest link (chosen) count as too stiff. The balance may lack their energy,
    force times half the deflection: with a tenfold limit ten times as much.
    """
    total = 0.0
    for guide in record.mechanism.guides:
        if isinstance(guide.friction, BristleLaw):
            energies = guide.energies(guide.key, record)
            # the entry `contact` of the kind `stored` is the energy of the guide's bristles
            stored = max(float(values.max()) for kind, entry, values in energies if (kind, entry) == ("stored", "contact"))
            # the signal is named after the point, or after the guide if the point's joint has clearance
            frictions = [signals.get(f"{owner}.friction_force", np.zeros(1)) for owner in (guide.point, guide.key)]
            force = max(float(np.abs(friction).max()) for friction in frictions)
            if 2 * stored < 1e-4 * Scene.of(record.mechanism).linkage.size * force:  # deflection = 2 energy / force
                total += stored
    return total


@dataclass(frozen=True, eq=False)
class Run:
    """One run of a solver."""

    solver: Any
    record: Record
    failure: Failure | None
    work: dict[str, float]  # computational work
    summary: Mapping[str, int] = field(default_factory=dict)  # numbers of elements, coordinates and constraints
    notes: Sequence[str] = ()  # remarks on the mechanism
    unseen: str = ""  # message about edges of a user's function between steps
    asked: str = ""  # text that names the signals to compute; '' for all

    @cached_property
    def signals(self) -> dict[str, Signal]:
        """All signals by name."""
        return collect(self.record, self.asked)

    @cached_property
    def ledger(self) -> dict[str, Array]:
        """Energies over the run [J], by the function `ledger`."""
        return ledger(self.record)

    @property
    def values(self) -> dict[str, Array]:
        """Values of the signals, each (times,)."""
        return {name: signal.values for name, signal in self.signals.items()}

    @property
    def units(self) -> dict[str, str]:
        """Units of the signals."""
        return {name: signal.unit for name, signal in self.signals.items()}
