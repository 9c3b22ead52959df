"""How far each signal of a run may be off: by an accuracy that was asked for, or in a run without settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import ClassVar, NamedTuple

from ..elements.signal import Kind
from ..record.energy import BALANCE as ALLOWED
from ..record.lookup import unknown
from ..units import FORCES as UNITS
from .compare import FORCES, TINY, Functions
from .estimate import BALANCE, ROUNDING
from .words import COARSEST, MEANS, PLACES, spoken, wanted

PLACE, STRUCK_PLACE = 1e-3, 5e-3
"""Error allowed of places at any time, over the longest link or a radian; where something strikes, in the mean over time, as a
rebound that is 5 % wrong errs by so much, and one that is a little later by more for that little while."""
FORCE, IMPULSE = COARSEST, 0.05
"""Error allowed of forces as functions of time, and of a journal's place over its clearance; of impulses and energies, which a
rebound that is so much wrong changes by it."""


class Worst(NamedTuple):
    """The signal that is farthest beyond what is allowed; its error and what is allowed, relative."""

    name: str
    error: float
    allowed: float

    @property
    def ratio(self) -> float:
        """Its error over what is allowed."""
        return self.error / self.allowed


@dataclass(frozen=True)
class Asked:
    """An accuracy, and what it is asked of: one of `WORDS`, or names of signals, or of what is read off them.

    Of contacts' forces their largest values and impulses are asked, too. A signal asked for by its name never rests: its error is
    to be so small against its own size.
    """

    asked: float
    of: str | Sequence[str] = PLACES

    def __post_init__(self) -> None:
        object.__setattr__(self, "of", wanted(self.of))

    @property
    def words(self) -> str:
        """What it is asked of, for a sentence."""
        return spoken(self.of)

    def limits(self, run: Functions) -> Mapping[str, float]:
        """Relative error allowed of signals and of what is read off them; UnknownSignalError if a name is none of a signal."""
        if not isinstance(self.of, str):
            for name in self.of:
                if name not in run.signals and name.rpartition(".")[0] not in run.signals:
                    raise unknown(name, list(run.signals))
            share = {name: run.own[name][0] / run.scales[name][0] for name in self.of if name in run.signals}
            return {name: max(ROUNDING, self.asked * share.get(name, 1.0)) for name in self.of}
        found: dict[str, float] = {}
        for name, signal in run.signals.items():
            wanted = signal.kind in (Kind.PLACE, Kind.STATE)
            if self.of != PLACES:
                forces = signal.kind in FORCES and signal.unit in UNITS
                wanted = forces and (f"{name}.mean" not in run.signals if self.of == MEANS else not signal.period)
            if wanted:
                readings = (name, f"{name}.peak", f"{name}.impulse") if signal.kind is Kind.CONTACT else (name,)
                found |= dict.fromkeys(readings, self.asked)
        return found


class Usual:
    """What a run without settings is held to.

    Of places, energies, and forces, those that ring as means; of contacts impulses, too, and where pins rattle in their bushes
    those alone, as each blow rings in what it strikes. Rates ring, and the kinetic energy tells of them. Friction is what its
    regularisation makes of it where a contact sticks.
    """

    asked: ClassVar[float] = nan
    words: ClassVar[str] = "a run without settings"

    def limits(self, run: Functions) -> Mapping[str, float]:
        """Relative error allowed of signals and of what is read off them."""
        signals = run.signals
        struck = any(signal.kind is Kind.CONTACT for signal in signals.values())
        rattles = any(signal.kind is Kind.PLACE and signal.scale for signal in signals.values())
        place, norm = (STRUCK_PLACE, "") if struck else (PLACE, ".peak")
        found = dict[str, float]()
        for name, signal in signals.items():
            force = signal.unit in UNITS and f"{name}.mean" not in signals
            if signal.kind is Kind.PLACE and signal.scale:
                found[name] = FORCE
            elif signal.kind is Kind.PLACE:
                whole = run.size if signal.unit == "m" else 1.0
                found[name + norm] = place * max(1.0, whole / max(float(run.scales[name][1]), TINY))
            elif signal.kind is Kind.STATE:
                found[name] = FORCE
            elif signal.kind is Kind.ENERGY and "friction" not in name:
                found[name] = IMPULSE
            elif force and signal.kind in (Kind.CONTACT, Kind.REACTION, Kind.INTERNAL):
                if rattles or signal.kind is Kind.CONTACT:
                    found[f"{name}.impulse"] = IMPULSE
                if not rattles:
                    found[name] = FORCE
        return found


Goal = Asked | Usual


def worst(goal: Goal, run: Functions, errors: Mapping[str, float]) -> Worst:
    """The signal that is farthest beyond what is allowed."""
    limits = {**goal.limits(run), BALANCE: ALLOWED}
    seen = [Worst(name, errors[name], limit) for name, limit in limits.items() if name in errors]
    return max(seen, key=lambda each: each.ratio, default=Worst("", 0.0, 1.0))
