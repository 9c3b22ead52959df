"""Errors allowed of a run: by an accuracy that was asked for, or by what a user looks at.

A run that names no accuracy is held to what a drawing and a design need: places, journals, impulses and peaks of contacts,
energies. Forces as functions of time, rates and the stretch of strips ring in periods that depend on microseconds of a blow;
their errors are estimated, and demanded only where an accuracy is asked `of` them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import ClassVar, NamedTuple

from ..elements.signal import Kind
from ..record.errors import Key, Norm
from ..record.lookup import unknown
from ..units import FORCES as UNITS
from .estimate import LEAST
from .trajectory import FORCES, Trajectory
from .words import PLACES, read_signals, write_signals

PLACE = 1e-2
"""Error allowed of a place or a deflection in the mean over time, over its range: as fine as a drawing shows. A convention."""
PEAK_PLACE = 1e-3
"""Error allowed of a place at any time, over the longest link or a radian: as fine as parts are made. A convention."""
STRUCK_PLACE = 5e-3
"""The same in the mean over time where something strikes, sticks or slips: a rebound that is 5 % wrong errs by so much."""
LAW = 0.1
"""Error allowed of a journal over its clearance, and of states: contact laws are known no better."""
STRIKE = 0.05
"""Error allowed of impulses and peaks of contacts and of energies: restitution is measured no better."""
ENERGIES = tuple(
    f"energy.{name}" for name in (
        "kinetic", "strain", "contact", "weight", "spring", "taken_contact", "taken_damping", "taken_resistance",
        "given_drive", "given_load", "given_motor",
    )
)  # fmt: skip
"""Energies that are demanded: all sums but what friction takes, which a regularised law invents where a contact sticks."""
BALANCE: Key = ("energy.balance", Norm.PEAK)
"""Error of the energy balance: a run that invents or loses energy is wrong whatever its places say."""
READING = re.compile(r"(rms|peak|impulse|onset)\((.+)\)")


class Worst(NamedTuple):
    """Signal and norm that are farthest beyond what is allowed; error and what is allowed, relative."""

    key: Key
    error: float
    allowed: float

    @property
    def ratio(self) -> float:
        """Error over what is allowed."""
        return self.error / self.allowed

    @property
    def name(self) -> str:
        """Signal, with the norm where it is not the usual one."""
        signal, norm = self.key
        return signal if norm is Norm.RMS else f"{norm}({signal})"


@dataclass(frozen=True)
class Asked:
    """An accuracy, and what it is asked of: one of `WORDS`, names of signals, or norms of them such as
    'impulse(B.contact_force)'.

    Of contacts' forces peaks and impulses are asked, too. A signal asked for by its name never rests.
    """

    asked: float
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
        """Error allowed of a deflection."""
        return self.asked

    def limits(self, run: Trajectory) -> dict[Key, float]:
        """Relative errors allowed; UnknownSignalError if a name is none of a signal."""
        if not isinstance(self.of, str):
            return self._accuracies_by_name(run, [key_of(name) for name in self.of])
        found = dict[Key, float]()
        for name, signal in run.signals.items():
            force = self.of != PLACES and signal.kind in FORCES and signal.unit in UNITS and not signal.period
            if force or (self.of == PLACES and signal.kind in (Kind.PLACE, Kind.STATE)):
                norms = (Norm.RMS, Norm.PEAK, Norm.IMPULSE) if signal.kind is Kind.CONTACT else (Norm.RMS,)
                found |= {(name, norm): self.asked for norm in norms}
        return found

    def _accuracies_by_name(self, run: Trajectory, keys: Sequence[Key]) -> dict[Key, float]:
        """Return the accuracies of signals asked for by name: each is relative to its own size."""
        found = dict[Key, float]()
        for name, norm in keys:
            if name in run.undetermined:
                raise ValueError(f"of: '{name}' is a force that no equation determines, as redundant constraints share it")
            if name not in run.signals:
                raise unknown(name, list(run.signals))
            own = float(run.own[name][0]) / run.sizes[name, Norm.RMS]
            found[name, norm] = max(LEAST, self.asked * (own if norm is Norm.RMS else 1.0))
        return found


def key_of(text: str) -> Key:
    """Signal and norm of a text."""
    found = READING.fullmatch(text)
    return (found[2], Norm(found[1])) if found else (text, Norm.RMS)


class Usual:
    """Errors allowed of a run that names no accuracy; see the constants of this file."""

    asked: ClassVar[float] = nan
    words: ClassVar[str] = "a run that names no accuracy"
    energies: ClassVar[tuple[str, ...]] = ENERGIES
    place: ClassVar[float] = PLACE

    def limits(self, run: Trajectory) -> dict[Key, float]:
        """Relative errors allowed."""
        found = dict[Key, float]()
        for name, signal in run.signals.items():
            if signal.kind is Kind.PLACE and not signal.scale:
                whole = max(1.0, (run.size if signal.unit == "m" else 1.0) / run.sizes[name, Norm.RMS])
                found[name, Norm.RMS] = min(PLACE, STRUCK_PLACE * whole) if run.strikes else PLACE
                if not run.strikes:
                    found[name, Norm.PEAK] = PEAK_PLACE * whole
            elif signal.kind in (Kind.PLACE, Kind.STATE):
                found[name, Norm.RMS] = LAW
            elif signal.kind is Kind.CONTACT and signal.unit == "N" and not signal.group:
                found |= {(name, norm): STRIKE for norm in (Norm.IMPULSE, Norm.PEAK)}
        return found


Demand = Asked | Usual


def worst(allowed: Mapping[Key, float], errors: Mapping[Key, float]) -> Worst:
    """The signal that is farthest beyond what is allowed."""
    seen = [Worst(key, errors[key], limit) for key, limit in allowed.items() if key in errors]
    return max(seen, key=lambda each: each.ratio, default=Worst(("", Norm.RMS), 0.0, 1.0))
