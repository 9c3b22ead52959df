"""Status of a run, and estimated errors of its signals by norm."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from math import nan
from typing import Any, NamedTuple

from .lookup import UnknownSignalError, unknown

CONFIDENCE = 0.95
"""Probability with which a confidence interval contains the true value, of fits, ensembles and means: a convention."""


class Status(StrEnum):
    """Outcome of a run; any status but OK has a message that says what to do.

    Six are of runs that reached their end. OK: all checks passed. SUSPECT: a check failed. CHAOTIC: small differences grow
    exponentially. SENSITIVE: more runs than allowed would be needed. Both are accurate up to `error.until` of the result only.
    UNSTABLE: an equilibrium is not stable. UNSEEN: steps went over jumps or kinks of a user's function. All others ended early.
    LOCKED: the linkage cannot go on as it is driven. SINGULAR: its constraints no longer decide the motion. STRUT_OUT_OF_RANGE: a
    strut is shorter than its law allows.

    >>> Status.OK.name
    'OK'
    """

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
    CHAOTIC = "CHAOTIC"
    SENSITIVE = "SENSITIVE"
    UNSTABLE = "UNSTABLE"
    UNSEEN = "UNSEEN"

    @property
    def finished(self) -> bool:
        """True if the run reached its end, so that its numbers can be used with care."""
        return self in (Status.OK, Status.SUSPECT, Status.CHAOTIC, Status.SENSITIVE, Status.UNSTABLE, Status.UNSEEN)


class Failure(NamedTuple):
    """Status of a run that did not reach its end, and a message that says why."""

    status: Status
    message: str


class Norm(StrEnum):
    """Norm of the difference between a signal and the exact one; it bounds the error of some readings."""

    RMS = "rms"  # root of the mean square over time; bounds the error of means
    PEAK = "peak"  # largest magnitude; bounds the error of the largest value
    IMPULSE = "impulse"  # largest magnitude over time of the integral from t = 0; bounds the error of an impulse
    ONSET = "onset"  # largest shift of the times at which a contact closes, divided by the duration of the run


Key = tuple[str, Norm]
"""A signal's name and a norm."""


class Deferred(Mapping[Key, float]):
    """Numbers by signal and norm. Some are known; all are computed as soon as any other one, or their list, is read."""

    def __init__(self, known: Mapping[Key, float], compute: Callable[[], Mapping[Key, float]]) -> None:
        self._known, self._compute = known, compute

    @cached_property
    def _all(self) -> Mapping[Key, float]:
        found = self._compute()
        del self._compute  # it holds the data of runs, which are no longer needed
        return found

    def __getitem__(self, key: Key) -> float:
        return self._known[key] if key in self._known else self._all[key]

    def __iter__(self) -> Iterator[Key]:
        return iter(self._all)

    def __len__(self) -> int:
        return len(self._all)

    def __repr__(self) -> str:
        return repr(dict(self))

    def __reduce__(self) -> tuple[type, tuple[dict[Key, float]]]:
        return dict, (dict(self),)  # a copy by pickle is a plain dictionary of all numbers


@dataclass(frozen=True, repr=False)
class Errors(Mapping[Any, float]):
    """Estimated relative errors of a result, by signal and norm.

    >>> from buckler.mbs.record.errors import Errors, Norm
    >>> errors = Errors(0.01, {("B.x", Norm.RMS): 0.01, ("B.x", Norm.PEAK): 0.02})
    >>> errors["B.x"], errors["B.x", "peak"], errors.motion
    (0.01, 0.02, 0.01)
    """

    motion: float = nan  # largest error of all places in the norm RMS; nan without an estimate
    # relative errors: of places over their range, of energies (`energy.kinetic`, ...) over the throughput, of other signals over
    # their own norm; empty without an estimate
    signals: Mapping[Key, float] = field(default_factory=dict)
    # ranges, throughput and norms to which the errors are relative, in the signal's unit; for `IMPULSE` that times 1 s, for
    # `ONSET` the duration [s]
    sizes: Mapping[Key, float] = field(default_factory=dict)
    kind: str = ""  # origin of the estimate, in words: the difference of two runs, see `mbs.accuracy`
    until: float = nan  # time [s] up to which the errors hold; beyond it a chaotic motion is one of many possible trajectories
    drive_period: float = 0.0  # period of revolution of the drive [s], for means over periods; 0 if no drive has a constant speed
    unresolved: tuple[str, ...] = ()  # forces `F` that vibrate too fast for the steps, which resolve their running means `F.mean`
    notes: tuple[str, ...] = ()  # remarks on the errors, in sentences

    @property
    def known(self) -> bool:
        """True if there is an estimate."""
        return self.motion >= 0  # false for nan

    def __getitem__(self, name: str | tuple[str, str]) -> float:
        """Return the error of a signal, in the norm RMS by default; raise an UnknownSignalError if it is unknown."""
        key = (name, Norm.RMS) if isinstance(name, str) else name
        if key in self.signals:
            return self.signals[key]  # type: ignore[index]  # a member of a StrEnum equals its text
        if not self.signals:
            raise UnknownSignalError(f"no error of '{name}': none was estimated; simulate(..., accuracy=1e-3) does")
        names = list(dict.fromkeys(signal for signal, _ in self.signals))
        if key[0] in names:
            norms = ", ".join(norm for signal, norm in self.signals if signal == key[0])
            raise UnknownSignalError(f"no error '{key[1]}' of '{key[0]}'; there are: {norms}")
        raise unknown(key[0], names, "error of")

    def absolute(self, name: str, norm: Norm = Norm.RMS) -> float:
        """Return the error in the signal's unit; nan if it is not known."""
        return self.signals.get((name, norm), nan) * self.sizes.get((name, norm), nan)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Errors) and repr(vars(self)) == repr(vars(other))  # as texts: two nan are equal

    __hash__ = None  # type: ignore[assignment]

    def __iter__(self) -> Iterator[Key]:
        return iter(self.signals)

    def __len__(self) -> int:
        return len(self.signals)

    def __repr__(self) -> str:
        if not self.signals:
            return "<Errors: not estimated>"
        errors = {name: error for (name, norm), error in self.signals.items() if norm is Norm.RMS}
        worst = sorted(errors, key=lambda name: errors[name], reverse=True)
        shown = "".join(f", {name} {errors[name]:.2g}" for name in worst[:3])  # they fit into a line
        return f"<Errors: motion {self.motion:.2g}{shown}{' ...' if len(worst) > 3 else ''}>"
