"""How far each signal of a run may be off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from buckler.mbs.accuracy.compare import FORCES, Functions
from buckler.mbs.accuracy.estimate import ROUNDING
from buckler.mbs.accuracy.words import MEANS, PLACES, spoken, wanted
from buckler.mbs.elements.signal import Kind
from buckler.mbs.record.energy import BALANCE as ALLOWED
from buckler.mbs.record.lookup import unknown
from buckler.mbs.units import FORCES as UNITS

BALANCE = "energy.balance"
"""Name of what the energies of a run do not add up by; it is judged in every run."""


class Goal(Protocol):
    """How far signals may be off."""

    @property
    def asked(self) -> float:
        """The accuracy that was asked for; nan if none was."""

    @property
    def words(self) -> str:
        """What it is asked of, for a sentence."""

    def limits(self, run: Functions) -> Mapping[str, float]:
        """Relative error allowed of signals and of what is read off them; of others nothing is asked."""


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
    """An accuracy, and what it is asked of.

    Parameters
    ----------
    level : float
    of : str or sequence of str
        "places"; "forces", as computed, of contacts their largest values and impulses too; "means", forces that ring as means
        over their axial period, the others as computed; or names of signals, or of what is read off them. A signal asked for
        by its name never rests: its error is to be so small against its own size.

    Raises
    ------
    ValueError
        If it is none of these.
    """

    level: float
    of: str | Sequence[str] = PLACES

    def __post_init__(self) -> None:
        object.__setattr__(self, "of", wanted(self.of))

    @property
    def asked(self) -> float:
        """See `Goal`."""
        return self.level

    @property
    def words(self) -> str:
        """See `Goal`."""
        return spoken(self.of)

    def limits(self, run: Functions) -> Mapping[str, float]:
        """Relative error allowed of signals and of what is read off them; of others nothing is asked.

        Raises
        ------
        UnknownSignalError
            A ValueError, if a name is none of a signal.
        """
        if not isinstance(self.of, str):
            for name in self.of:
                if name not in run.signals and name.rpartition(".")[0] not in run.signals:
                    raise unknown(name, list(run.signals))
            scales, own = run.scales, run.own
            share = {name: own[name][0] / scales[name][0] for name in self.of if name in own}
            return {name: max(ROUNDING, self.level * share.get(name, 1.0)) for name in self.of}
        found: dict[str, float] = {}
        for name, signal in run.signals.items():
            if self.of == PLACES:
                asked = signal.kind is Kind.PLACE
            else:
                asked = signal.kind in FORCES and signal.unit in UNITS and bool(signal.period) <= (self.of == MEANS)
                asked = asked and not (self.of == MEANS and f"{name}.mean" in run.signals)
            if asked:
                readings = (name, f"{name}.peak", f"{name}.impulse") if signal.kind is Kind.CONTACT else (name,)
                found |= dict.fromkeys(readings, self.level)
        return found


def worst(goal: Goal, run: Functions, errors: Mapping[str, float]) -> Worst:
    """The signal that is farthest beyond what is allowed."""
    limits = {**goal.limits(run), BALANCE: ALLOWED}
    seen = [Worst(name, errors[name], limit) for name, limit in limits.items() if name in errors]
    return max(seen, key=lambda each: each.ratio, default=Worst("", 0.0, 1.0))
