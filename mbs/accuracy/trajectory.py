"""A run as functions of time, and the sizes to which errors of its signals are relative.

The size of a place is its range. A force or a rate has two sizes, its root mean square and its peak. A component has the sizes of
the largest component of its vector. No size is below `SMALL` times the largest of the same kind and unit, or for places below
`RESTING`. Some continuous signals have a `scale`, which is then the size: the clearance for places of journals, the throughput
for energies, which is the energy that goes through the mechanism.
"""

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
"""Least size of a place, over the longest link or in rad: what moves less is at rest. A convention."""
FORCE_KINDS = (Kind.REACTION, Kind.CONTACT, Kind.FRICTION, Kind.INTERNAL)
"""Kinds of forces and torques, which have impulses."""
CONTINUOUS = (Kind.PLACE, Kind.STRETCH, Kind.STATE, Kind.ENERGY)
"""Kinds that do not jump, so that a contact which begins a little later changes them little."""
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Signals of a run as functions of time."""

    time: Array  # [s], (times,)
    signals: Mapping[str, Signal]
    longest_link: float  # its length [m]
    kinks: tuple[float, ...] = ()  # times [s] at which a drive or a load jumps or has a kink
    least_force: float = 0.0  # force [N] that moves the mechanism by its size, or its clearance, within the run
    undetermined: frozenset[str] = frozenset()  # names of forces that no equation determines; `signals` does not contain them
    mass: float = 1.0  # of all links, blocks and points [kg]
    strut_forces: frozenset[str] = frozenset()  # names of the signals of the forces along struts
    strip_forces: frozenset[str] = frozenset()  # names of the signals of the forces along strips with mass

    @classmethod
    def of(cls, run: Run) -> "Trajectory":
        """Return a run's signals as functions of time, without counts and without forces that no equation determines."""
        scene, end, links = Scene.of(run.record.mechanism), float(run.record.time[-1]), run.record.mechanism.links
        found = {name: signal for name, signal in run.signals.items() if signal.kind not in (Kind.COUNT, Kind.UNDETERMINED)}
        return cls(
            time=run.record.time, signals=found, longest_link=scene.linkage.size, kinks=scene.kinks(end), mass=scene.mass,
            least_force=scene.mass * min([scene.linkage.size, *(joint.gap for joint in scene.clearances)]) / end**2,
            undetermined=frozenset(name for name, signal in run.signals.items() if signal.kind is Kind.UNDETERMINED),
            strut_forces=frozenset(f"{link.name}.compression" for link in links if link.body.massless),
            strip_forces=frozenset(f"{link.name}.axial_force" for link in links if link.body.flexible and not link.body.massless),
        )  # fmt: skip

    @cached_property
    def strikes(self) -> bool:
        """True if a contact or friction acts at some time: motions then begin and end suddenly."""
        return any(s.kind in (Kind.CONTACT, Kind.FRICTION) and bool(np.any(s.values)) for s in self.signals.values())

    @cached_property
    def unresolved(self) -> list[str]:
        """Forces that vibrate in periods too short for the steps, so that numerical damping takes the vibration away."""
        means = [signal for signal in self.signals.values() if signal.period > 0]  # running means over a period of vibration
        is_resolved = {period: resolves(self.time, period) for period in {mean.period for mean in means}}
        return [mean.source for mean in means if not is_resolved[mean.period]]  # `source`: name of the force that is averaged

    @cached_property
    def own_sizes(self) -> dict[Key, float]:
        """Sizes of each signal alone: its range in both norms, RMS and PEAK, if continuous; else root mean square and peak."""
        duration = max(np.ptp(self.time), TINY)
        found = dict[Key, float]()
        for name, signal in self.signals.items():
            values = signal.values
            if signal.kind in CONTINUOUS:
                rms = peak = signal.scale or np.ptp(values)
            else:
                rms, peak = np.sqrt(np.trapezoid(values**2, self.time) / duration), max(values.max(), -values.min())
            found[name, Norm.RMS], found[name, Norm.PEAK] = float(rms), float(peak)
        return found

    @cached_property
    def sizes(self) -> dict[Key, float]:
        """Sizes of signals in the norms RMS and PEAK, in the signals' units."""
        return self._find_sizes(Norm.RMS) | self._find_sizes(Norm.PEAK)

    def _find_sizes(self, norm: Norm) -> dict[Key, float]:
        """Return the largest size in the vector of each signal, but at least a share of the largest of its kind and unit."""
        vectors, families = dict[str, float](), dict[tuple[str, str], float]()
        for name, signal in self.signals.items():
            own, group, family = self.own_sizes[name, norm], signal.group or name, _family(signal)
            vectors[group] = np.maximum(vectors.get(group, TINY), own)  # nan stays nan
            families[family] = np.maximum(families.get(family, TINY), own)
        # a torque counts as a force at the arm of the longest link, so that forces and torques have one common largest size
        forces, torques = ("force", "N"), ("force", "N m")
        force_at_arm = families.get(torques, TINY) / self.longest_link
        families[forces] = np.maximum(np.maximum(families.get(forces, TINY), force_at_arm), self.least_force)
        families[torques] = families[forces] * self.longest_link
        found = dict[Key, float]()
        for name, signal in self.signals.items():
            resting = RESTING * (self.longest_link if signal.unit == "m" else 1.0)
            least = resting if signal.kind in (Kind.PLACE, Kind.STRETCH) else SMALL * families[_family(signal)]
            size = self.own_sizes[name, norm] if signal.scale else np.maximum(vectors[signal.group or name], least)
            found[name, norm] = float(size)
        return found

    def until(self, end: float) -> "Trajectory":
        """Return the run up to a time [s], and three samples more, from which slopes at the end are computed."""
        count = int(np.searchsorted(self.time, end)) + 3
        if count >= len(self.time):
            return self
        cut = {name: s._replace(values=s.values[:count], depth=s.depth[:count]) for name, s in self.signals.items()}
        return replace(self, time=self.time[:count], signals=cut)

    def integral(self, name: str, of: Callable[[Array], Array] = np.asarray) -> Array:
        """Integrate a signal, or a function of it, from the start to each sample."""
        return corrected_trapezoidal(self.time, of(self.signals[name].values))


def compute_energies(run: Run) -> tuple[Trajectory, float]:
    """Compute the energies of a run as signals such as `energy.kinetic`, and their imbalance over the throughput.

    Vibrations faster than the steps may store the energy r E, E the throughput. The share r does not count as imbalance. Errors
    of energies are relative to E (1 + r/SMALL), so that r E is an error of at most `SMALL`.
    """
    record, energies, scene = run.record, dict(run.ledger), Scene.of(run.record.mechanism)
    throughput, vibration_share = compute_throughput(record, energies, run.values)  # [J], and r
    imbalance = float(np.abs(energies.pop("error")).max()) / throughput
    del energies["throughput"]
    # twice the energy of a pendulum of the mechanism's mass and size at the angle RESTING
    resting = RESTING**2 * scene.linkage.size * scene.mass * float(np.hypot(*scene.mechanism.gravity))
    size = max(throughput * (1 + vibration_share / SMALL), resting)
    found = {f"energy.{n}": Signal(f"energy.{n}", values, "J", Kind.ENERGY, scale=size) for n, values in energies.items()}
    # r counts strips and bristles of guides, whose vibrations the steps do not resolve; bristles may store all energy put in.
    # Without friction of guides at most 0.05 is ascribed to vibrations, the allowed error `demand.USUAL_ERROR` of energies
    has_friction = any(guide.friction is not None for guide in record.mechanism.guides)
    stored = vibration_share if has_friction else min(vibration_share, 0.05)
    return Trajectory(record.time, found, scene.linkage.size), max(0.0, imbalance - stored)


def find_drive_period(mechanism: Mechanism) -> float:
    """Return the longest period of a link that is driven at constant speed [s]; 0 if there is none."""
    links = {link.name for link in mechanism.links}
    speeds = [drive.speed for drive in mechanism.drives if drive.target in links and isinstance(drive.speed, int | float)]
    return max((2 * np.pi / abs(speed) for speed in speeds if speed), default=0.0)


def _family(signal: Signal) -> tuple[str, str]:
    """Return kind and unit of signals whose sizes are compared; all forces are one kind."""
    return ("force" if signal.kind in FORCE_KINDS else signal.kind), signal.unit
