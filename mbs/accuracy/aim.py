"""What an accuracy is asked of: the motion, all forces, or signals by their names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from buckler.mbs.record.lookup import unknown
from buckler.mbs.record.result import Result
from buckler.mbs.units import FORCES
from buckler.mbs.validate import short

PLACES, ALL_FORCES = "places", "forces"


@dataclass(frozen=True)
class Aim:
    """What an accuracy is asked of.

    Parameters
    ----------
    of : str or sequence of str
        "places": the motion, as `mbs.accuracy.difference` measures it; "forces": all forces and torques; or names of signals.

    Raises
    ------
    ValueError
        If it is neither.
    """

    of: str | Sequence[str] = PLACES

    def __post_init__(self) -> None:
        if isinstance(self.of, str):
            if self.of not in (PLACES, ALL_FORCES):
                raise ValueError(f"of = {short(self.of)}: must be '{PLACES}', '{ALL_FORCES}', or a list of signals' names")
            return
        names: Any = self.of
        if not isinstance(names, Sequence) or not names or not all(isinstance(n, str) and "." in n for n in names):
            raise ValueError(f"of = {short(names)}: must be '{PLACES}', '{ALL_FORCES}', or a list of signals' names")
        object.__setattr__(self, "of", tuple(names))

    @property
    def words(self) -> str:
        """For a sentence."""
        return self.of if isinstance(self.of, str) else ", ".join(self.of)

    @property
    def motion(self) -> bool:
        """Whether it is the motion."""
        return self.of == PLACES

    def apart(self, a: Result, b: Result) -> float:
        """Difference of run a from run b in what is asked for, relative to b."""
        from buckler.mbs.accuracy.by_signal import by_signal
        from buckler.mbs.accuracy.difference import difference  # both load scipy, which the command line does without

        return difference(a, b) if self.motion else self.largest(by_signal(a, b), b.units)

    def largest(self, errors: Mapping[str, float], units: Mapping[str, str]) -> float:
        """The largest error of the signals asked for; UnknownSignalError, a ValueError, if a name is none of a signal."""
        if self.of == ALL_FORCES:
            return max((errors[name] for name, unit in units.items() if unit in FORCES and name in errors), default=0.0)
        for name in self.of:
            if name not in errors:
                raise unknown(name, list(units))
        return max(errors[name] for name in self.of)


MOTION = Aim()
"""The motion, which is asked for where nothing else is named."""
