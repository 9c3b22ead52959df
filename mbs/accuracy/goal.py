"""How far each signal of a run may be off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from buckler.mbs.accuracy.compare import FORCES, Functions
from buckler.mbs.elements.element import Kind
from buckler.mbs.record.energy import BALANCE as ALLOWED
from buckler.mbs.record.lookup import unknown
from buckler.mbs.validate import short

WORDS = PLACES, ALL_FORCES, MEANS = "places", "forces", "means"
"""What an accuracy can be asked of, besides signals by their names."""
FINEST, COARSEST = 1e-6, 0.1
"""Accuracies that can be asked for."""
BALANCE = "energy.balance"
"""Name of what the energies of a run do not add up by; it is judged in every run."""


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
        over their axial period, the others as computed; or names of signals, or of what is read off them.

    Raises
    ------
    ValueError
        If it is none of these.
    """

    level: float
    of: str | Sequence[str] = PLACES

    def __post_init__(self) -> None:
        names = self.of
        if isinstance(names, str) and names in WORDS:
            return
        listed = isinstance(names, Sequence) and not isinstance(names, str)
        if not listed or not names or not all(isinstance(name, str) and "." in name for name in names):
            raise ValueError(f"of = {short(names)}: must be one of {', '.join(map(repr, WORDS))}, or a list of signals' names")
        object.__setattr__(self, "of", tuple(names))

    @property
    def words(self) -> str:
        """For a sentence."""
        return self.of if isinstance(self.of, str) else ", ".join(self.of)

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
            return dict.fromkeys(self.of, self.level)
        found: dict[str, float] = {}
        for name, signal in run.signals.items():
            if self.of == PLACES:
                wanted = signal.kind is Kind.PLACE
            else:
                wanted = signal.kind in FORCES and bool(signal.period) <= (self.of == MEANS)
                wanted = wanted and not (self.of == MEANS and f"{name}.mean" in run.signals)
            if wanted:
                readings = (name, f"{name}.peak", f"{name}.impulse") if signal.kind is Kind.CONTACT else (name,)
                found |= dict.fromkeys(readings, self.level)
        return found


def worst(goal: Asked, run: Functions, errors: Mapping[str, float]) -> Worst:
    """The signal that is farthest beyond what is allowed."""
    limits = {**goal.limits(run), BALANCE: ALLOWED}
    seen = [Worst(name, errors[name], limit) for name, limit in limits.items() if name in errors]
    return max(seen, key=lambda each: each.ratio, default=Worst("", 0.0, goal.level))
