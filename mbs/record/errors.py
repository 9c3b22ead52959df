"""How a run ended, and how wrong a result is thought to be: as a motion, and signal by signal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from enum import StrEnum
from math import nan
from typing import Any

from ..validate import near

SHOWN = 3
"""Signals with the largest errors that are printed."""


class Status(StrEnum):
    """How a run ended. Anything but OK comes with a sentence a person can act on."""

    OK = "OK"
    SUSPECT = "SUSPECT"
    LOCKED = "LOCKED"
    SINGULAR = "SINGULAR"
    NEWTON_DIVERGED = "NEWTON_DIVERGED"
    NOT_FINITE = "NOT_FINITE"
    TIMED_OUT = "TIMED_OUT"
    INTERRUPTED = "INTERRUPTED"
    TOO_MANY_STEPS = "TOO_MANY_STEPS"
    STRUT_OUT_OF_RANGE = "STRUT_OUT_OF_RANGE"
    FUNCTION_FAILED = "FUNCTION_FAILED"
    ENGINE_ERROR = "ENGINE_ERROR"


class UnknownErrorError(ValueError, KeyError):
    """A result has no error of that name."""

    __str__ = Exception.__str__  # a KeyError would quote its sentence


@dataclass(frozen=True, repr=False)
class Errors(Mapping[str, float]):
    """Estimated relative errors of a result: `errors.motion` of all of it, `errors["B.contact_force"]` of a signal.

    Each is a norm of the difference from finer runs, as `mbs.accuracy.compare` measures it, of the whole or up to `until`.

    Attributes
    ----------
    motion : float
        The largest of all places; nan without an estimate.
    signals : mapping of str to float
        Of each signal by its name: the root of its mean square over that of the signal, or over the range of a place. Of places
        and forces also `F.peak`, which bounds the error of the largest value; of forces `F.impulse`; of contacts `F.onset`, how
        much earlier or later they close or open, over the run; of energies `energy.kinetic` and so on, over the energy put
        through. Empty without an estimate.
    kind : str
        What the estimate is made of, in words.
    elements : bool
        Whether what the elements of strips leave out is in it.
    time, space : mapping of str to float
        The parts of each: by the steps, and by the elements or the degree of strips.
    sizes : mapping of str to float
        What each is relative to, in the signal's unit.
    until : float
        Time, s, to which the motion is one trajectory and errors are told.
    unresolved : tuple of str
        Forces whose ringing the steps do not follow: their means, `F.mean`, are to be read.
    notes : tuple of str
        What else is to be known of the errors, in sentences.
    """

    motion: float = nan
    signals: Mapping[str, float] = field(default_factory=dict)
    kind: str = ""
    elements: bool = False
    time: Mapping[str, float] = field(default_factory=dict)
    space: Mapping[str, float] = field(default_factory=dict)
    sizes: Mapping[str, float] = field(default_factory=dict)
    until: float = nan
    unresolved: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

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
        named = {spec.name: getattr(self, spec.name) for spec in fields(self)}
        return {
            name: dict(value) if isinstance(value, Mapping) else list(value) if isinstance(value, tuple) else value
            for name, value in named.items()
        }

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> Errors:
        """From what `plain` gave."""
        values: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in plain.items()}
        return cls(**values)
