"""How long a mechanism with clearance is taken to move along one trajectory: later, as it rattles, chance decides."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np

from buckler.mbs.elements.clearance import clearances
from buckler.mbs.kinematics.linkage import turning_speed
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.result import Result

PREDICTABLE, TURN = 0.010, 0.1 * pi
"""Time, s, and turn of the drive, rad, up to the longer of which the motion is taken for one trajectory: 10 ms at 300 r/min."""


def predictable(mechanism: Mechanism, duration: float) -> float:
    """Part of a duration, s, over which runs are compared: all of it without clearance."""
    if not clearances(mechanism):
        return duration
    speed = turning_speed(mechanism, duration)
    return min(duration, max(PREDICTABLE, TURN / speed) if speed > 0 else PREDICTABLE)


def wholly_compared(mechanism: Mechanism, result: Result) -> bool:
    """Whether the error of a result is known by other runs, of all its duration."""
    return result.error.known and predictable(mechanism, float(result.time[-1])) >= result.time[-1]


def cut(result: Result, until: float) -> Result:
    """The same up to a time, s, between whose neighbours signals are taken for straight."""
    time = result.time
    if not len(time) or time[-1] <= until:
        return result
    last = int(np.searchsorted(time, until))
    kept = np.append(time[:last], until)
    signals = {name: np.append(values[:last], np.interp(until, time, values)) for name, values in result.signals.items()}
    return replace(result, time=kept, signals=signals)
