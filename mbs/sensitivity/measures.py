"""Measures of a run with their errors, as pages and commands show them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from math import isfinite, nan
from typing import NamedTuple

import numpy as np

from ..accuracy.demand import STRIKE
from ..record.errors import Status
from ..record.result import Result
from .reading import parse_reading

PEAKS = ("contact_force", "normal_force", "force", "torque", "current", "fx", "fy", "axial_force", "compression", "deflection",
         "end_shortening", "penetration")  # fmt: skip
"""Last parts of the names of signals whose peaks are read where no measure is given."""

ENDED = (Status.TIMED_OUT, Status.INTERRUPTED)
"""Ends of a run from outside."""
TIMED = re.compile(r"\bat\(")
"""Readings at a time, which the part of a run may not have."""


class Measure(NamedTuple):
    """Number read off a run.

    Attributes
    ----------
    name : str
        Its formula.
    value, unit
    error : float
        In that unit; nan where it is not known.
    beyond : bool
        Error larger than what was asked for, or not known where others are.
    signals : tuple of str
        Signals in it.
    """

    name: str
    value: float
    unit: str
    error: float
    beyond: bool
    signals: tuple[str, ...]

    @property
    def relative(self) -> float:
        """Relative error; nan where it is not known or says nothing: of a value no larger than its error."""
        return self.error / abs(self.value) if self.error < abs(self.value) else nan


def measures(result: Result, texts: Sequence[str] = ()) -> list[Measure]:
    """Read these formulas off a run, by default the peaks of its forces, torques and deflections; none of a run that failed.

    A run that was ended from outside has those of the part that ran.
    """
    ended = result.status in ENDED and len(result.time) > 1
    wanted = [text for text in texts or peaks(result) if not (ended and TIMED.search(text))]
    return [_measure(result, text) for text in wanted] if ended or result.status.finished else []


def _measure(result: Result, text: str) -> Measure:
    """Read a formula and compare its error with the accuracy that was asked for, or with `STRIKE`."""
    value, error, unit, _ = result.reading(text)
    known = parse_reading(text, result.signals)[1].values()
    names = [name for name in known if result.units.get(name) == unit]
    size = max([abs(value), *(float(np.abs(result.signals[name]).max(initial=0.0)) for name in names)])
    allowed = (result.asked if result.asked > 0 else STRIKE) * (abs(value) if error < abs(value) else size)
    return Measure(
        text, value, unit, error if isfinite(error) else nan, result.error.known and not error <= allowed, tuple(known)
    )


def peaks(result: Result) -> list[str]:
    """List the default readings: peaks of forces, torques and deflections, of means where ringing is not resolved."""
    names = [name for name in result.signals if name.rpartition(".")[2] in PEAKS]
    return [f"max(abs({name}{'.mean' if name in result.error.unresolved else ''}))" for name in names]
