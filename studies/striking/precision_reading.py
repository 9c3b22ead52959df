"""What the study of the slider-crank's precision reads off a contact force, and how far two readings are apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan, pi
from typing import Any, NamedTuple

import numpy as np

from buckler.elastica import pinned
from buckler.mbs.library import PAPER_STOP
from buckler.studies.striking import slider_crank as main_study
from buckler.studies.striking.strikes import strikes
from buckler.studies.strips.contact_force_table import Press

Array = np.ndarray[Any, Any]
JOB = main_study.Parameters()
"""The main job."""
TURN = 2 * pi / JOB.speed
"""One turn of the crank, s."""
PLATEAU = np.radians(np.linspace(150, 210, 601))
"""Crank angles at which the pressed slider's force is held against the exact elastica, rad."""
EXACT = Press(JOB.thickness, PAPER_STOP).force(pinned.load, PLATEAU)
"""Force of the exact elastica there, in equilibrium and without friction, N."""


class PrecisionReading(NamedTuple):
    """What is read off a contact force; nan where the run failed or there was no contact.

    Attributes
    ----------
    peak, impulse : float
        Largest force, N, and impulse, N s, from first contact until the force first returns to zero.
    settled, mean : float
        Force at a crank angle of 180 degrees and its mean over 150 to 210 degrees, N.
    plateau_error : float
        Largest relative deviation from the exact elastica over 150 to 210 degrees.
    release : float
        Crank angle at the last sample in contact, deg.
    plateau : array, shape (601,), or None
        Force at the angles of `PLATEAU`, N.
    """

    peak: float = nan
    impulse: float = nan
    settled: float = nan
    mean: float = nan
    plateau_error: float = nan
    release: float = nan
    plateau: Array | None = None

    def off(self, other: PrecisionReading) -> dict[str, float]:
        """Relative differences of the four numbers that make the error of a run."""
        return {name: abs(getattr(self, name) / getattr(other, name) - 1) for name in self._fields[:4]}


@dataclass(frozen=True)
class ReadRun:
    """Reading of a run, with its status and work."""

    reading: PrecisionReading
    status: str
    work: Mapping[str, float]
    energy_balance: float = nan


def read(time: Array, force: Array, angle: Array | None = None, standard: Array = EXACT) -> PrecisionReading:
    """Read a contact force, N, sampled at times, s, over one turn.

    Parameters
    ----------
    time, force : array, shape (samples,)
    angle : array, shape (samples,), optional
        Crank angle, rad; by default at the job's speed. What comes after one turn is not read.
    standard : array, shape (601,)
        What the force between 150 and 210 degrees is held against, N.
    """
    angle = JOB.speed * time if angle is None else angle
    turn = angle <= 2 * pi * (1 + 1e-9)
    time, force, angle = time[turn], force[turn], angle[turn]
    found = strikes(force)
    if not found:
        return PrecisionReading()
    plateau = np.interp(PLATEAU, angle, force)
    return PrecisionReading(
        peak=found[0].peak(force),
        impulse=found[0].impulse(time, force),
        settled=float(np.interp(pi, PLATEAU, plateau)),
        mean=float(np.trapezoid(plateau, PLATEAU) / np.ptp(PLATEAU)),
        plateau_error=float(np.abs(plateau / standard - 1).max()),
        release=float(np.degrees(angle[found[-1].last])),
        plateau=plateau,
    )
