"""Named signals with units from a record; forces of mechanisms with flexible links also as means over their axial vibration.

A link is a spring of stiffness E A/L along itself. With the masses it holds it rings at kilohertz after each jump of an
acceleration, hardly damped: how much is a matter of microseconds of the start or of a blow. Each such force `F` comes with
`F.mean`: a mean over a period T, taken twice. Of a frequency f it leaves (sin(pi f T)/(pi f T))^2.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ..elements.link import moving
from ..elements.signal import Kind, Signal
from ..geometry import Array
from ..mechanism import Mechanism
from ..scene.scene import Scene
from .record import Record, between


def collect(record: Record, asked: str = "") -> dict[str, Signal]:
    """All signals by name: places and velocities of the points, what each element has to say, means of the forces that ring.

    Of points and elements that a text does not mention there are none, where one is given.
    """

    def is_asked(name: str) -> bool:
        """Return True if a signal, or part of its name, was asked for."""
        return not asked or any(word in asked for word in name.split("."))

    found: dict[str, Signal] = {}
    for point in filter(is_asked, record.mechanism.points):
        found |= {signal.name: signal for signal in moving(point, *record.point(point))}
    for name, element in Scene.of(record.mechanism).elements.items():
        if is_asked(name):
            free = name in record.undetermined
            for signal in element.signals(name, record):  # places and the like of its element are determined
                undetermined = free and signal.kind is Kind.REACTION
                found[signal.name] = signal._replace(kind=Kind.UNDETERMINED) if undetermined else signal
    return found | {signal.name: signal for signal in means(record.mechanism, record.time, found)}


@dataclass(frozen=True)
class Shape:
    """A flexible link at chosen times [s]: positions along it [m], (times, stations, 2), and its thickness in the plane [m]."""

    times: Array
    points: Array
    thickness: float


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


RINGING = (Kind.REACTION, Kind.INTERNAL)
RINGS = 4
"""Steps in a period of axial vibration from which a run follows it."""


def means(mechanism: Mechanism, time: Array, signals: Mapping[str, Signal]) -> Iterator[Signal]:
    """Yield the means of the forces that ring; none of a mechanism without flexible links."""
    period = Scene.of(mechanism).axial_period
    if not period > 0 or len(time) < 3:
        return
    for name, signal in signals.items():
        if signal.kind in RINGING and signal.unit in ("N", "N m"):
            values = running_mean(time, running_mean(time, signal.values, period), period)
            group = f"{signal.group}.mean" if signal.group else ""
            yield Signal(f"{name}.mean", values, signal.unit, signal.kind, group, period=period, source=name)


def running_mean(time: Array, values: Array, period: float) -> Array:
    """Compute the mean over a period about each time; about the nearest time of which a whole period lies within the run."""
    total = np.concatenate([[0.0], np.cumsum((values[1:] + values[:-1]) / 2 * np.diff(time))])
    period = min(period, time[-1] - time[0])
    middle = np.clip(time, time[0] + period / 2, time[-1] - period / 2)

    def integral(t: Array) -> Array:
        """Return the integral up to times, of values linear between instants."""
        k = np.clip(np.searchsorted(time, t, side="right") - 1, 0, len(time) - 2)
        s = t - time[k]
        slope = (values[k + 1] - values[k]) / (time[k + 1] - time[k])
        return np.asarray(total[k] + s * (values[k] + s * slope / 2))

    return (integral(middle + period / 2) - integral(middle - period / 2)) / period


def follows(time: Array, period: float) -> bool:
    """Return True if steps resolve a vibration: not where they are long for a whole period of it, as there it is damped away."""
    steps = np.diff(time)
    return not float(steps[RINGS * steps > period].sum()) > period
