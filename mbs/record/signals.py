"""Named signals with units from a record."""

from __future__ import annotations

from typing import Any

import numpy as np

from buckler.mbs.elements.element import Array
from buckler.mbs.record.motion import between
from buckler.mbs.record.record import Record
from buckler.mbs.record.stored import Shape


def collect(record: Record) -> tuple[dict[str, Array], dict[str, str]]:
    """All signals and their units: places and velocities of the points, then what each element has to say."""
    signals: dict[str, Array] = {}
    units: dict[str, str] = {}
    for point in record.mechanism.points:
        for letters, values, unit in zip(("", "v"), record.point(point), ("m", "m/s"), strict=True):
            for axis, letter in enumerate("xy"):
                signals[f"{point}.{letters}{letter}"], units[f"{point}.{letters}{letter}"] = values[:, axis], unit
    for name, element in record.mechanism.elements().items():
        for signal in element.signals(name, record):
            signals[signal.name], units[signal.name] = signal.values, signal.unit
    return signals, units


def shapes_at(record: Record, times: Array) -> dict[str, Shape]:
    """Flexible links at chosen times: cubic Hermite interpolation of recorded coordinates and rates."""
    last = record.time[-1]
    times = np.minimum(times[times <= last * (1 + 1e-9)], last)  # a run that failed did not get to the others
    if len(record.time) < 2:
        return {}
    bent = {name: motion for name, motion in record.links.items() if hasattr(motion, "line")}
    found = {}
    for name, motion in bent.items():
        section: Any = record.mechanism.link(name).body.section
        found[name] = Shape(times, between(motion, record.time, times).line(), section.thickness)
    return found
