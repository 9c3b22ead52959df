"""A run as functions of time, and the sizes to which errors of its signals are relative.

The size of a place is its range. A force or a rate has two sizes, its root mean square and its peak; a component has the
largest ones of its vector. No size is below a share of the largest of the same kind and unit; for places, of the mechanism's
size. What is smaller counts as zero. The size of energies is the throughput, the energy that goes through the mechanism.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..elements.signal import Kind, Signal
from ..geometry import Array
from ..mechanism import Mechanism
from ..record.errors import Key, Norm
from ..record.lookup import corrected_trapezoidal
from ..record.run import Run, compute_throughput, resolves
from ..scene.scene import Scene

SMALL = 1e-2
"""Least size of a force or rate, over the largest of its kind and unit: smaller ones are noise. A convention."""
RESTING = 1e-3
"""Least size of a place, over the mechanism's size or in rad: what moves less is at rest. A convention."""
FORCES = (Kind.REACTION, Kind.CONTACT, Kind.FRICTION, Kind.INTERNAL)
"""Kinds of forces and torques, which have impulses."""
CONTINUOUS = (Kind.PLACE, Kind.STRETCH, Kind.STATE, Kind.ENERGY)
"""Kinds that do not jump, so that a contact which begins a little later changes them little."""
UNRESOLVED_MOST = 0.05
"""Largest part of an imbalance of energy, over the throughput, that is ascribed to vibrations faster than the samples: the error
allowed of energies."""
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Signals of a run as functions of time."""

    time: Array  # [s], (times,)
    signals: Mapping[str, Signal]
    size: float  # length of the longest link [m]
    kinks: tuple[float, ...] = ()  # times [s] at which a drive or a load jumps or has a kink
    least_force: float = 0.0  # force [N] that moves the mechanism by its size, or its clearance, within the run
    undetermined: frozenset[str] = frozenset()  # signals of forces that no equation determines, not among the others
    mass: float = 1.0  # of all links, blocks and points [kg]
    struts: frozenset[str] = frozenset()  # signals of the forces along struts
    strips: frozenset[str] = frozenset()  # the same along strips with mass

    @classmethod
    def of(cls, run: Run) -> Trajectory:
        """Take the signals of a run but counts, and forces that no equation determines."""
        scene, end = Scene.of(run.record.mechanism), float(run.record.time[-1])
        found = {name: signal for name, signal in run.signals.items() if signal.kind not in (Kind.COUNT, Kind.UNDETERMINED)}
        least_force = scene.mass * min([scene.size, *(joint.gap for joint in scene.clearances)]) / end**2
        shared = frozenset(name for name, signal in run.signals.items() if signal.kind is Kind.UNDETERMINED)
        links = run.record.mechanism.links
        struts = frozenset(f"{link.name}.compression" for link in links if link.body.massless)
        strips = frozenset(f"{link.name}.axial_force" for link in links if link.body.flexible and not link.body.massless)
        return cls(run.record.time, found, scene.size, scene.kinks(end), least_force, shared, scene.mass, struts, strips)

    @cached_property
    def strikes(self) -> bool:
        """True if a contact or friction acts at some time: motions then begin and end suddenly."""
        return any(s.kind in (Kind.CONTACT, Kind.FRICTION) and bool(np.any(s.values)) for s in self.signals.values())

    @cached_property
    def unresolved(self) -> list[str]:
        """Forces that vibrate in periods too short for the steps, so that both runs lose the vibration by numerical damping."""
        followed = {period: resolves(self.time, period) for period in {s.period for s in self.signals.values() if s.period > 0}}
        return [signal.source for signal in self.signals.values() if not followed.get(signal.period, True)]

    @cached_property
    def own(self) -> dict[str, Array]:
        """Sizes of each signal alone, (RMS, PEAK): its range for both norms if continuous, else root mean square and peak."""
        found = {n: np.full(2, s.scale or np.ptp(s.values)) for n, s in self.signals.items() if s.kind in CONTINUOUS}
        steps = np.diff(self.time)
        weights = (np.append(steps, 0.0) + np.append(0.0, steps)) / 2 / max(np.ptp(self.time), TINY)
        for name, signal in self.signals.items():
            if name not in found:
                values = signal.values
                found[name] = np.array([np.sqrt(values @ (weights * values)), max(values.max(), -values.min())])
        return found

    @cached_property
    def sizes(self) -> dict[Key, float]:
        """Sizes of signals for RMS and PEAK, in the signals' units: at least those of the vector and a share of the family's."""
        vectors, families = dict[str, Array](), dict[tuple[str, str], Array]()
        for name, signal in self.signals.items():
            group, family = signal.group or name, _family(signal)
            vectors[group] = np.maximum(vectors.get(group, TINY), self.own[name])
            families[family] = np.maximum(families.get(family, TINY), self.own[name])
        force, torque = ("force", "N"), ("force", "N m")
        least = np.maximum(families.get(torque, TINY) / self.size, self.least_force)
        families[force] = np.maximum(families.get(force, self.least_force), least)
        families[torque] = families[force] * self.size
        found = dict[Key, float]()
        for name, signal in self.signals.items():
            resting = RESTING * (self.size if signal.unit == "m" else 1.0)
            least = resting if signal.trait.smooth else SMALL * families[_family(signal)]
            size = self.own[name] if signal.scale else np.maximum(vectors[signal.group or name], least)
            found[name, Norm.RMS], found[name, Norm.PEAK] = size.tolist()
        return found

    def until(self, end: float) -> Trajectory:
        """Return the run up to a time [s], and three samples more, from which slopes at the end are computed."""
        some = int(np.searchsorted(self.time, end)) + 3
        if some >= len(self.time):
            return self
        cut = {name: s._replace(values=s.values[:some], depth=s.depth[:some]) for name, s in self.signals.items()}
        return replace(self, time=self.time[:some], signals=cut)

    def integral(self, name: str, of: Callable[[Array], Array] = np.asarray) -> Array:
        """Integrate a signal, or a function of it, from the start to each sample."""
        return corrected_trapezoidal(self.time, of(self.signals[name].values))


def energies_of(run: Run) -> tuple[Trajectory, float]:
    """Return the energies of a run as signals such as `energy.kinetic`, and their imbalance over the throughput.

    What vibrations faster than the steps may store is taken off the imbalance.

    Their size is the throughput and a hundred times the energy of unresolved vibrations. It is at least the work of the weight
    over a displacement that counts as rest.
    """
    record, energies = run.record, dict(run.ledger)
    through, unresolved = compute_throughput(record, energies, run.values)
    missing = float(np.abs(energies.pop("error")).max()) / through
    del energies["throughput"]
    scene = Scene.of(record.mechanism)
    resting = RESTING**2 * scene.size * scene.mass * float(np.hypot(*scene.mechanism.gravity))  # square of the displacement
    size = max(through * (1 + unresolved / SMALL), resting)
    sticks = any(guide.friction is not None for guide in record.mechanism.guides)  # bristles may store all of the energy
    found = {f"energy.{n}": Signal(f"energy.{n}", values, "J", Kind.ENERGY, scale=size) for n, values in energies.items()}
    return Trajectory(record.time, found, 1.0), max(0.0, missing - (unresolved if sticks else min(unresolved, UNRESOLVED_MOST)))


def turn_of(mechanism: Mechanism) -> float:
    """Return the longest period of a link that is driven at constant speed [s]; 0 if there is none."""
    links = {link.name for link in mechanism.links}
    speeds = [drive.speed for drive in mechanism.drives if drive.target in links and isinstance(drive.speed, int | float)]
    return max((2 * np.pi / abs(speed) for speed in speeds if speed), default=0.0)


def _family(signal: Signal) -> tuple[str, str]:
    """Return kind and unit of signals whose sizes are compared; all forces are one kind."""
    return ("force" if signal.kind in FORCES else signal.kind), signal.unit
