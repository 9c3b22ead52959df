"""Errors allowed of a run: by the accuracy that a user requested, or else by conventions.

Without an accuracy, limits exist for what a drawing and a design need: places, journals, impulses and peaks of contacts,
energies. Forces over time, rates and end shortenings of strips vibrate with a phase that depends on microseconds of an impact:
their errors are limited only where the user names them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import ClassVar, NamedTuple

import numpy as np

from ..elements.signal import Kind
from ..record.errors import Key, Norm
from ..record.lookup import unknown
from ..units import FORCES as UNITS
from .estimate import LEAST_ERROR
from .trajectory import FORCES, Trajectory
from .words import COARSEST, PLACES, read_signals, write_signals

PLACE = 1e-2
"""Root mean square of the error allowed of a place or a deflection, over its range: a drawing shows no more. A convention."""
PEAK_PLACE = 1e-3
"""Error allowed of a place at any time, over the longest link or a radian: a tolerance of manufacture. A convention."""
STRUCK_PLACE = 5e-3
"""Root mean square where bodies strike, stick or slip, over the longest link or a radian: a rebound wrong by 5 % causes it."""
LAW = COARSEST
"""Error allowed of a journal over its clearance, and of states of a force with memory: contact laws are known no better."""
STRIKE = 0.05
"""Error allowed of impulses and peaks of contacts and of energies: restitution is measured no better."""
ENERGIES = (
    "energy.kinetic", "energy.strain", "energy.contact", "energy.weight", "energy.spring", "energy.taken_contact",
    "energy.taken_damping", "energy.taken_resistance", "energy.given_drive", "energy.given_load", "energy.given_motor",
)  # fmt: skip
"""Energies whose errors are limited: all but that of friction, which a regularised law dissipates even where a contact sticks."""
BALANCE: Key = ("energy.balance", Norm.PEAK)
"""Error of the energy balance: a run that gains or loses energy is wrong even if its places agree with a finer run."""
READING = re.compile(r"(rms|peak|impulse|onset)\((.+)\)")
"""Norm of a signal, such as `peak(B.contact_force)`."""


class Deflections(NamedTuple):
    """Limits of the last two terms of the polynomials in a strip's deflection, which show whether its degree is high enough."""

    rms: float  # limit of a term's root mean square over time [m]; infinite where no place has a limit
    peak: float  # limit of a term at any time, over the strip's largest deflection; infinite where only places have limits

    @classmethod
    def of(cls, limits: Mapping[Key, float], run: Trajectory) -> Deflections:
        """Return the limits that follow from those of signals: an error of a deflection moves no place by more than itself."""
        rms = peak = inf
        for (name, norm), limit in limits.items():
            signal = run.signals[name]
            if signal.kind is Kind.PLACE:
                size = run.sizes[name, norm] * (1.0 if signal.unit == "m" else run.size)
                rms = min(rms, limit * size)
            elif np.any(signal.values):
                peak = min(peak, limit)
        return cls(rms, peak)


class Worst(NamedTuple):
    """Signal and norm with the largest ratio of the relative error to the allowed one."""

    key: Key
    error: float
    allowed: float

    @property
    def ratio(self) -> float:
        """Error over the allowed one."""
        return self.error / self.allowed

    @property
    def name(self) -> str:
        """Signal, with the norm where it is not the usual one."""
        signal, norm = self.key
        return signal if norm is Norm.RMS else f"{norm}({signal})"


@dataclass(frozen=True)
class Asked:
    """An accuracy and the signals that shall have it: one of `WORDS`, names, or norms such as 'impulse(B.contact_force)'.

    With 'forces' it holds for peaks and impulses of contacts, too. The error of a named signal is relative to its own size.
    """

    accuracy: float
    of: str | Sequence[str] = PLACES

    energies: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "of", read_signals(self.of))

    @property
    def words(self) -> str:
        """Signals that the accuracy holds for, as words of a sentence."""
        return write_signals(self.of)

    @property
    def place(self) -> float:
        """Error allowed of a place, to which the degrees of strips are chosen."""
        return self.accuracy

    def limits(self, run: Trajectory) -> dict[Key, float]:
        """Return the relative errors allowed; UnknownSignalError if a signal does not exist."""
        if not isinstance(self.of, str):
            return self._accuracies_by_name(run, [key_of(name) for name in self.of])
        found = dict[Key, float]()
        for name, signal in run.signals.items():
            force = self.of != PLACES and signal.kind in FORCES and signal.unit in UNITS and not signal.period  # no running mean
            if force or (self.of == PLACES and signal.kind in (Kind.PLACE, Kind.STATE)):
                norms = (Norm.RMS, Norm.PEAK, Norm.IMPULSE) if signal.kind is Kind.CONTACT else (Norm.RMS,)
                found |= {(name, norm): self.accuracy for norm in norms}
        return found

    def _accuracies_by_name(self, run: Trajectory, keys: Sequence[Key]) -> dict[Key, float]:
        """Return the errors allowed of named signals, over `run.sizes`; an rms is requested relative to the signal's own size."""
        found = dict[Key, float]()
        for name, norm in keys:
            if name in run.undetermined:
                raise ValueError(f"of: '{name}' is a force that no equation determines, as redundant constraints share it")
            if name not in run.signals:
                raise unknown(name, list(run.signals))
            share = run.own_sizes[name, Norm.RMS] / run.sizes[name, Norm.RMS]
            found[name, norm] = max(LEAST_ERROR, self.accuracy * (share if norm is Norm.RMS else 1.0))
        return found


def key_of(text: str) -> Key:
    """Split a text such as 'peak(B.contact_force)' into signal and norm."""
    found = READING.fullmatch(text)
    return (found[2], Norm(found[1])) if found else (text, Norm.RMS)


class Usual:
    """Errors allowed of a run without an accuracy, by the constants of this file."""

    accuracy: ClassVar[float] = nan
    words: ClassVar[str] = "a run that names no accuracy"
    energies: ClassVar[tuple[str, ...]] = ENERGIES
    place: ClassVar[float] = PLACE

    def limits(self, run: Trajectory) -> dict[Key, float]:
        """Return the relative errors allowed."""
        found = dict[Key, float]()
        clearances = [signal.scale for signal in run.signals.values() if signal.kind is Kind.PLACE and signal.scale]
        journal = LAW * min(clearances, default=0.0) / run.size  # error of a journal: no place is known better
        for name, signal in run.signals.items():
            if signal.kind is Kind.PLACE and not signal.scale:
                length_over_range = (run.size if signal.unit == "m" else 1.0) / run.sizes[name, Norm.RMS]
                length_over_size = max(1.0, length_over_range)  # the range may be larger than the longest link or a radian
                if run.strikes:
                    allowed = min(PLACE, STRUCK_PLACE * length_over_size)
                else:
                    allowed = PLACE
                    found[name, Norm.PEAK] = PEAK_PLACE * length_over_size
                found[name, Norm.RMS] = max(allowed, journal * length_over_range)
            elif signal.kind in (Kind.PLACE, Kind.STATE):
                found[name, Norm.RMS] = LAW
            elif signal.kind is Kind.CONTACT and signal.unit == "N" and not signal.group:  # components have a group
                found |= {(name, norm): STRIKE for norm in (Norm.IMPULSE, Norm.PEAK)}
        return found


Demand = Asked | Usual


def find_worst(allowed: Mapping[Key, float], errors: Mapping[Key, float]) -> Worst:
    """Find the signal with the largest ratio of its error to the allowed one."""
    candidates = [Worst(key, errors[key], limit) for key, limit in allowed.items() if key in errors]
    return max(candidates, key=lambda each: each.ratio, default=Worst(("", Norm.RMS), 0.0, 1.0))
