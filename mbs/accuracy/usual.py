"""What a run without settings is held to: how far each signal may be off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from buckler.mbs.accuracy.by_signal import Signals, by_signal
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.kinematics.inertias import mechanism_mass
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.result import Result
from buckler.mbs.units import FORCES

PLACE, STRUCK_PLACE = 1e-3, 5e-3
"""Error allowed of places: its mean square over their range, or the link's length for what bends, and its largest over the
longest link; and where something strikes, as a rebound that is 5 % wrong errs by so much."""
FORCE = 0.05
"""Error allowed of forces and energies: contact laws are known no better. Speeds are not looked at one by one, as those of strips
ring: the kinetic energy tells of them."""
JOURNAL = 0.1
"""Error allowed of the place of a journal, over the clearance."""
SMALL = 0.02
"""Of the largest force of the mechanism, or of one that would move it by its size, or its clearance, in the time of the run:
smaller ones are measured by so much, torques likewise."""
NONE = 1e-6
"""Of the largest force: what is smaller is round-off."""
OF_FRICTION = ("friction_force", "friction_limit")
"""Forces that are not looked at: where a contact sticks, they are what its regularisation makes of them."""
BOUND = 2.0
"""An estimate is a difference of two runs, and so a bound: beyond so many times of what is allowed a run is suspect."""
ASKED = 1e-3
"""What stands for all that is allowed, as an accuracy."""


@dataclass(frozen=True)
class Usual:
    """What is allowed of each signal, as something an accuracy of `ASKED` is asked of.

    Attributes
    ----------
    allowed : mapping of str to float
        In the measure of `mbs.accuracy.by_signal`.
    """

    allowed: Mapping[str, float]
    words: str = "a run without settings"
    motion: bool = False

    @classmethod
    def of(cls, mechanism: Mechanism, result: Result) -> Usual:
        """What is allowed of a mechanism whose signals are about those of a result."""
        place = STRUCK_PLACE if mechanism.stops or clearances(mechanism) else PLACE
        lengths = {link.name: mechanism.length(link.name) for link in mechanism.links}
        sizes = {name: float(np.abs(values).max(initial=0.0)) for name, values in result.signals.items()}
        size = max(lengths.values())
        way = min((joint.gap for joint in clearances(mechanism)), default=size)
        push = mechanism_mass(mechanism) * way / float(result.time[-1]) ** 2
        least = {"N": push, "N m": push * size}
        largest = {unit: max([least[unit], *(sizes[n] for n, u in result.units.items() if u == unit)]) for unit in FORCES}
        allowed: dict[str, float] = {}
        seen = Signals(result)
        for name, unit in result.units.items():
            owner, _, kind = name.rpartition(".")
            if owner in mechanism.points and kind in ("x", "y"):
                allowed |= {name: place, f"{name}.peak": place * size / seen.extent(name)}
            elif kind == "deflection" and owner in lengths:
                span = float(np.ptp(result.signals[name]))
                allowed[name] = place * max(1.0, lengths[owner] / max(span, np.finfo(float).tiny))
            elif kind in ("journal_x", "journal_y"):
                allowed[name] = JOURNAL
            elif unit in FORCES and kind not in OF_FRICTION:
                allowed[name] = FORCE * max(1.0, SMALL / max(sizes[name] / largest[unit], NONE) if largest[unit] > 0 else 1.0)
        return cls(allowed)

    def apart(self, a: Result, b: Result) -> float:
        """How far run a is from run b, over what is allowed, times `ASKED`."""
        return self.largest(by_signal(a, b), b.units)

    def largest(self, errors: Mapping[str, float], _units: Mapping[str, str]) -> float:
        """The largest error over what is allowed, times `ASKED`; what is far beyond is all alike, as motion then decides."""
        _, error, allowed = self.worst(errors)
        return ASKED * min(error / allowed, 2 * BOUND)

    def worst(self, errors: Mapping[str, float]) -> tuple[str, float, float]:
        """The signal or energy that is farthest beyond what is allowed, its error, and what is allowed."""
        energies = [name for name in errors if name.startswith("energy.") and not name.endswith("taken_friction")]
        limits = {**dict.fromkeys(energies, FORCE), **{name: limit for name, limit in self.allowed.items() if name in errors}}
        name = max(limits, key=lambda name: errors[name] / limits[name], default="")
        return name, errors.get(name, 0.0), limits.get(name, FORCE)
