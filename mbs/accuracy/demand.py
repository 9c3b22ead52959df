"""Errors allowed of a run, by the accuracy that a user requested (`Asked`) or by conventions (`Usual`); runs with their errors.

Without an accuracy, limits exist for places, journals, impulses and peaks of contacts, and energies. Forces over time, rates and
end shortenings of strips have none: they vibrate, and a shift of an impact by microseconds changes the phase of the vibration.
Errors are relative to `run.sizes`, see `trajectory`.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf, nan
from typing import ClassVar, NamedTuple

import numpy as np

from ..elements.signal import Kind
from ..record.errors import Errors, Key, Norm, Status
from ..record.lookup import unknown
from ..record.run import Run
from .difference import is_normal_force
from .estimate import LEAST_ERROR
from .trajectory import FORCE_KINDS, Trajectory
from .words import COARSEST, PLACES, read_signals, write_signals

PLACE_ERROR = 1e-2
"""Root mean square of the error allowed of a place or a deflection, over its range: a drawing shows no more. A convention."""
PLACE_PEAK_ERROR = 1e-3
"""Error allowed of a place at any time, over the longest link (an angle: a radian) or the range, whichever is larger: a tolerance
of manufacture. A convention."""
STRUCK_PLACE_ERROR = 5e-3
"""Root mean square of the error allowed of a place where bodies strike, stick or slip, over the longest link or the range,
whichever is larger. A rebound over a tenth of this length errs by 5e-3 of it if its speed errs by 5 %. `PLACE_ERROR` holds as
well; `PLACE_PEAK_ERROR` does not."""
LAW_ERROR = COARSEST
"""Error allowed of a journal's place, over its clearance, and of the states x of a load with equations dx/dt = f, over their
largest values: 0.1, as their laws are known no better."""
USUAL_ERROR = 0.05
"""Error allowed of impulses and peaks of contacts and of energies: restitution is measured no better."""
BALANCE: Key = ("energy.balance", Norm.PEAK)
"""Error of the energy balance: a run that gains or loses energy is wrong even if a finer run agrees."""


class DeflectionLimits(NamedTuple):
    """Limits of the last two terms of the polynomials in a strip's deflection, which show whether its degree is high enough."""

    rms: float  # limit of a term's root mean square over time [m]: the least limit of a place; inf without one
    peak: float  # limit of a term at any time, over the strip's largest deflection: least relative error allowed of other signals

    @classmethod
    def of(cls, limits: Mapping[Key, float], run: Trajectory) -> "DeflectionLimits":
        """Return the limits that follow from those of signals."""
        rms = peak = inf
        for (name, norm), limit in limits.items():
            signal = run.signals[name]
            if signal.kind is Kind.PLACE:
                size = run.sizes[name, norm] * (1.0 if signal.unit == "m" else run.longest_link)  # [m]
                rms = min(rms, limit * size)
            elif np.any(signal.values):  # a signal that is zero throughout sets no limit
                peak = min(peak, limit)
        return cls(rms, peak)


class Worst(NamedTuple):
    """Signal and norm with the largest ratio of the relative error to the allowed one; by default no signal."""

    key: Key = ("", Norm.RMS)
    error: float = 0.0
    allowed: float = 1.0

    @property
    def ratio(self) -> float:
        """Error over the allowed one."""
        return self.error / self.allowed

    @property
    def name(self) -> str:
        """Signal, with the norm where it is not RMS."""
        signal, norm = self.key
        return signal if norm is Norm.RMS else f"{norm}({signal})"


@dataclass(frozen=True)
class Asked:
    """An accuracy and the signals that shall have it: one of `WORDS`, names, or norms such as 'impulse(B.contact_force)'.

    The accuracy is relative to `run.sizes`; for the root mean square of a named signal, to the signal's own size.
    """

    accuracy: float
    of: str | Sequence[str] = PLACES

    energies: ClassVar[tuple[str, ...]] = ()  # energies with a limit: none

    def __post_init__(self) -> None:
        object.__setattr__(self, "of", read_signals(self.of))

    @property
    def words(self) -> str:
        """Subject of the accuracy in a message: the signals, as words of a sentence."""
        return write_signals(self.of)

    @property
    def place_error(self) -> float:
        """Error allowed of a place, to which the degrees of strips are chosen."""
        return self.accuracy

    def limits(self, run: Trajectory) -> dict[Key, float]:
        """Return the relative errors allowed; UnknownSignalError if a signal does not exist."""
        if not isinstance(self.of, str):
            return self._accuracies_by_name(run, [key_of(name) for name in self.of])
        if self.of == PLACES:
            return {(n, Norm.RMS): self.accuracy for n, s in run.signals.items() if s.kind in (Kind.PLACE, Kind.STATE)}
        found = dict[Key, float]()  # `of` is ALL_FORCES
        for name, signal in run.signals.items():
            is_running_mean = signal.period > 0  # a signal `F.mean`, beside the force F, which has the limit
            if signal.kind in FORCE_KINDS and signal.unit in ("N", "N m") and not is_running_mean:
                norms = (Norm.RMS, Norm.PEAK, Norm.IMPULSE) if signal.kind is Kind.CONTACT else (Norm.RMS,)
                found |= {(name, norm): self.accuracy for norm in norms}
        return found

    def _accuracies_by_name(self, run: Trajectory, keys: Sequence[Key]) -> dict[Key, float]:
        """Return the errors allowed of named signals, relative to `run.sizes`: root mean squares are converted from own sizes."""
        found = dict[Key, float]()
        for name, norm in keys:
            if name in run.undetermined:
                raise ValueError(f"of: '{name}' is a force that no equation determines, as redundant constraints share it")
            if name not in run.signals:
                raise unknown(name, list(run.signals))
            own_over_size = run.own_sizes[name, Norm.RMS] / run.sizes[name, Norm.RMS]
            found[name, norm] = max(LEAST_ERROR, self.accuracy * (own_over_size if norm is Norm.RMS else 1.0))
        return found


def key_of(text: str) -> Key:
    """Split a text such as 'peak(B.contact_force)' into signal and norm."""
    found = re.fullmatch(r"(rms|peak|impulse|onset)\((.+)\)", text)
    return (found[2], Norm(found[1])) if found else (text, Norm.RMS)


class Usual:
    """Errors allowed of a run without an accuracy, by the constants of this file."""

    accuracy: ClassVar[float] = nan
    words: ClassVar[str] = "a run that names no accuracy"  # in a message: subject of the limits
    # all but that of friction, which a regularised law dissipates even where a contact sticks
    energies: ClassVar[tuple[str, ...]] = (
        "energy.kinetic", "energy.strain", "energy.contact", "energy.weight", "energy.spring", "energy.taken_contact",
        "energy.taken_damping", "energy.taken_resistance", "energy.given_drive", "energy.given_load", "energy.given_motor",
    )  # fmt: skip
    place_error: ClassVar[float] = PLACE_ERROR

    def limits(self, run: Trajectory) -> dict[Key, float]:
        """Return the relative errors allowed."""
        found = dict[Key, float]()
        # of the places only those of journals have a `scale`, the clearance
        clearances = [signal.scale for signal in run.signals.values() if signal.kind is Kind.PLACE and signal.scale]
        # share of the longest link by which a journal may err: places that it moves may err by this share, angles by it in rad
        journal_error = LAW_ERROR * min(clearances, default=0.0) / run.longest_link
        for name, signal in run.signals.items():
            if signal.kind is Kind.PLACE and not signal.scale:
                length_over_range = (run.longest_link if signal.unit == "m" else 1.0) / run.sizes[name, Norm.RMS]
                larger_over_range = max(1.0, length_over_range)  # the larger one of the two, over the range
                allowed = PLACE_ERROR
                if run.strikes:
                    allowed = min(allowed, STRUCK_PLACE_ERROR * larger_over_range)
                else:
                    found[name, Norm.PEAK] = PLACE_PEAK_ERROR * larger_over_range
                found[name, Norm.RMS] = max(allowed, journal_error * length_over_range)
            elif signal.kind in (Kind.PLACE, Kind.STATE):
                found[name, Norm.RMS] = LAW_ERROR
            elif is_normal_force(signal):
                found |= {(name, norm): USUAL_ERROR for norm in (Norm.IMPULSE, Norm.PEAK)}
        return found


Demand = Asked | Usual


def find_worst(allowed: Mapping[Key, float], errors: Mapping[Key, float]) -> Worst:
    """Find the signal with the largest ratio of its error to the allowed one."""
    candidates = [Worst(key, errors[key], limit) for key, limit in allowed.items() if key in errors]
    return max(candidates, key=lambda each: each.ratio, default=Worst())


@dataclass(frozen=True)
class CheckedRun:
    """A run, its errors, and the signal whose error is worst."""

    run: Run
    errors: Errors = field(default_factory=Errors)  # unknown where no finer run could be made
    worst: Worst = field(default_factory=lambda: Worst(error=inf))  # without a finer run the error is not known
    chaos: Status | None = None  # CHAOTIC or SENSITIVE: errors hold only up to `errors.until`
    reason: str = ""  # why refinement ended early, in words
    count: int = 1  # runs that were made

    def shortfall(self, demand: Demand) -> str:
        """Say in a sentence which error is above the allowed one; '' if none is."""
        why = f"; {self.reason}" if self.reason else ""
        if not self.errors.known:
            return f"ACCURACY: no finer run could be made, so that the error is not known ({self.count} runs){why}"
        if self.worst.ratio <= 1:
            return ""
        error, allowed = (f"{100 * e:.2g} %" if 1e-3 <= e < 10 else f"{e:.1e}" for e in (self.worst.error, self.worst.allowed))
        off = f"is off by {error} (relative error), allowed {allowed}"
        return f"ACCURACY: '{self.worst.name}' {off}, after {self.count} runs; asked of {demand.words}{why}"
