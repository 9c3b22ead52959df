"""Named signals with units from a record."""

from __future__ import annotations

import numpy as np

from buckler.mbs.elements.link import moving
from buckler.mbs.elements.signal import Signal
from buckler.mbs.geometry import Array
from buckler.mbs.record.means import means
from buckler.mbs.record.motion import between
from buckler.mbs.record.record import Record
from buckler.mbs.record.stored import Shape


def collect(record: Record, asked: str = "") -> dict[str, Signal]:
    """All signals by name: places and velocities of the points, what each element has to say, means of the forces that ring.

    Of points and elements that a text does not mention there are none, where one is given.
    """

    def wanted(name: str) -> bool:
        return not asked or any(word in asked for word in name.split("."))

    found: dict[str, Signal] = {}
    for point in filter(wanted, record.mechanism.points):
        found |= {signal.name: signal for signal in moving(point, *record.point(point))}
    for name, element in record.mechanism.elements().items():
        if wanted(name):
            found |= {signal.name: signal for signal in element.signals(name, record)}
    return found | {signal.name: signal for signal in means(record.mechanism, record.time, found)}


def shapes_at(record: Record, times: Array) -> dict[str, Shape]:
    """Flexible links at chosen times: cubic Hermite interpolation of recorded coordinates and rates."""
    last = record.time[-1]
    times = np.minimum(times[times <= last * (1 + 1e-9)], last)  # a run that failed did not get to the others
    if len(record.time) < 2:
        return {}
    bent = {name: motion for name, motion in record.links.items() if record.mechanism.link(name).body.flexible}
    found = {}
    for name, motion in bent.items():
        section = record.mechanism.link(name).body.section
        found[name] = Shape(times, between(motion, record.time, times).line(), section.thickness)
    return found
