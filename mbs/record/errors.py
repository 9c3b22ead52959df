"""How wrong a result is thought to be: as a motion, and signal by signal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import nan
from typing import Any

from buckler.mbs.validate import near

SHOWN = 3
"""Signals with the largest errors that are printed."""


class UnknownErrorError(ValueError, KeyError):
    """A result has no error of that name."""

    __str__ = Exception.__str__  # a KeyError would quote its sentence


@dataclass(frozen=True, repr=False)
class Errors(Mapping[str, float]):
    """Estimated relative errors of a result: `errors.motion` of all of it, `errors["B.contact_force"]` of a signal.

    Attributes
    ----------
    motion : float
        Of places, shapes, impulses and journals, as `mbs.accuracy.difference` measures it; nan without an estimate.
    signals : mapping of str to float
        Of each signal by its name, as `mbs.accuracy.by_signal` measures it. Of a place P also `P.peak`; of a force F `F.peak`,
        `F.rms` and `F.impulse`, of which its own is the largest; of the force of a contact `F.onset`, the time of the first touch
        over the run's; of energies `energy.kinetic` and so on, over the energy put through. Empty without an estimate.
    kind : str
        What the estimate is made of, in words.
    elements : bool
        Whether what the elements of strips leave out is in it.
    """

    motion: float = nan
    signals: Mapping[str, float] = field(default_factory=dict)
    kind: str = ""
    elements: bool = False

    @property
    def known(self) -> bool:
        """Whether there is an estimate."""
        return self.motion >= 0

    def __getitem__(self, name: str) -> float:
        """Error of a signal, or of what is read off it; UnknownErrorError, a ValueError, if there is none of that name."""
        if name in self.signals:
            return self.signals[name]
        if not self.signals:
            raise UnknownErrorError(f"no error of '{name}': none was estimated; simulate(..., accuracy=1e-3) does")
        close = near(str(name), self.signals, 3)
        some = f"near it: {', '.join(close)}" if close else f"there are {', '.join(list(self.signals)[:8])}, ..."
        raise UnknownErrorError(f"no error of '{name}'; {some}")

    def __eq__(self, other: object) -> bool:
        """Whether all is the same; what is not known in both is."""
        return isinstance(other, Errors) and repr(self.plain()) == repr(other.plain())

    __hash__ = None  # type: ignore[assignment]

    def __iter__(self) -> Iterator[str]:
        """Names of the signals."""
        return iter(self.signals)

    def __len__(self) -> int:
        """Return the number of signals."""
        return len(self.signals)

    def __repr__(self) -> str:
        """Return the error of the motion and the largest ones of signals, in a line."""
        if not self.known and not self.signals:
            return "<Errors: not estimated>"
        worst = sorted(self.signals, key=lambda name: self.signals[name], reverse=True)[:SHOWN]
        shown = "".join(f", {name} {self.signals[name]:.2g}" for name in worst)
        return f"<Errors: motion {self.motion:.2g}{shown}{' ...' if len(self.signals) > SHOWN else ''}>"

    def plain(self) -> dict[str, Any]:
        """As plain values, for a file."""
        return {"motion": self.motion, "signals": dict(self.signals), "kind": self.kind, "elements": self.elements}

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Errors:
        """From what `plain` gave."""
        return cls(**plain)
