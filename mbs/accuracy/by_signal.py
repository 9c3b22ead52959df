"""How far apart two runs of one mechanism are, signal by signal.

- Places, m and rad: the L2 norm over time of the difference over the range of the signal, or of the larger one where two belong
  to a point; and the largest difference over the same, as `.peak`.
- Speeds, accelerations and all else: the same over the largest magnitude of the signal, or of the larger one of its pair.
- Forces and torques: the largest of three differences, each over that of the signal itself or the larger one of its pair: the
  largest magnitude, the root of the mean square, and the impulse, with its sign or without, over that without. So an impact
  that comes a step later is as good; the places tell when it comes.
- Times of the first touch of a contact, over the run's.
- Each at least over `SMALL` of the largest signal of its unit: joint forces that cancel, the speed of a bearing. Places at least
  over `SMALL` of the mechanism's size, speeds over that in the time of the run: what moves less rests.

Runs with clearance in joints are to be cut first, see `mbs.accuracy.predictable`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from buckler.mbs.accuracy.difference import GRID
from buckler.mbs.record.energy import ledger
from buckler.mbs.record.lookup import cubic
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run
from buckler.mbs.units import FORCES

Array = np.ndarray[Any, Any]
PLACES = ("m", "rad")
SMOOTH = ("x", "y", "angle", "deflection", "end_shortening")
PAIRS = {"x": "y", "vx": "vy", "ax": "ay", "fx": "fy", "journal_x": "journal_y"}
"""Last parts of the names of the components of a vector: one may be none while the other is all."""
SMALL = 0.01
"""Of the largest signal of the same unit, or of the mechanism: smaller ones are measured by so much."""


def by_signal(a: Result, b: Result) -> dict[str, float]:
    """Difference of each signal of run a from that of run b, relative; see above.

    Parameters
    ----------
    a, b : Result
        Of the same mechanism and duration, whatever their elements, steps and solver; b has units.

    Returns
    -------
    dict of str to float
        By signal, of places `.peak` and of forces `.peak`, `.rms`, `.impulse` too, and of contacts `.onset`; infinite where a run
        has no finite value.
    """
    mine, other = Signals(a), Signals(b)
    times = np.union1d(mine.time, other.time)
    times = times[times <= min(mine.time[-1], other.time[-1])]
    if len(times) > GRID:
        times = times[np.unique(np.linspace(0, len(times) - 1, GRID).astype(int))]
    mine.look(times)
    other.look(times)
    found: dict[str, float] = {}
    for name, unit in b.units.items():
        if name in a.signals and name in b.signals:
            found |= {key: value if np.isfinite(value) else np.inf for key, value in _apart(name, unit, mine, other, times)}
    return found


def by_energy(a: Run, b: Run) -> dict[str, float]:
    """Differences of the energies of run a from those of run b, L2 norms over time, over the energy put through.

    Their names are `energy.kinetic` and so on. An impact that comes a step later is as good; what it leaves of the energy counts.
    """
    mine, other = ledger(a.record), ledger(b.record)
    through = max(float(other["throughput"][-1]), np.finfo(float).tiny)
    kinds = [name for name in other if name in mine and name not in ("error", "throughput")]
    times = np.clip(b.record.time, *a.record.time[[0, -1]])
    values = np.column_stack([mine[name] for name in kinds])
    if len(a.record.time) < 3 or not np.isfinite(values).all():
        there = np.column_stack([np.interp(times, a.record.time, each) for each in values.T])
    else:  # it does not swing where an impact takes energy
        there = scipy.interpolate.PchipInterpolator(a.record.time, values)(times)
    return {f"energy.{name}": _norm(times, each - other[name]) / through for name, each in zip(kinds, there.T, strict=True)}


class Signals:
    """Signals of a result, and the largest of each unit."""

    def __init__(self, result: Result) -> None:
        self.time, self.values = result.time, result.signals
        self.largest: dict[str, float] = {}
        self.times, self.there = self.time, self.values
        for name, values in self.values.items():
            unit = result.units.get(name, "")
            self.largest[unit] = max(self.largest.get(unit, 0.0), float(np.abs(values).max(initial=0.0)))

    def look(self, times: Array) -> None:
        """Take other times: cubics of all that is smooth are made at once."""
        self.times, self.there = times, {}
        if len(times) == len(self.time) and (times == self.time).all():
            self.there = self.values
        elif len(self.time) > 2:
            smooth = [name for name in self.values if name.rpartition(".")[2] in SMOOTH and np.isfinite(self.values[name]).all()]
            found = cubic(self.time, np.array([self.values[name] for name in smooth]).T, times) if smooth else np.empty((0, 0))
            self.there = dict(zip(smooth, found.T, strict=True))

    def at(self, name: str) -> Array:
        """A signal at those times: cubic what is smooth, linear the rest."""
        return self.there[name] if name in self.there else np.interp(self.times, self.time, self.values[name])

    @cached_property
    def size(self) -> float:
        """Largest distance of points along an axis, at any times, m."""
        found = 0.0
        for axis in (".x", ".y"):
            ends = [end for name, x in self.values.items() if name.endswith(axis) for end in (float(x.min()), float(x.max()))]
            found = max(found, max(ends, default=0.0) - min(ends, default=0.0))
        return found

    def extent(self, name: str) -> float:
        """What a place is measured over: its range, or its partner's, m or rad."""
        return max(*(float(np.ptp(self.values[each])) for each in self.pair(name)), SMALL * self.size, np.finfo(float).tiny)

    def pair(self, name: str) -> list[str]:
        """The signal and its partner in a vector."""
        owner, _, kind = name.rpartition(".")
        partner = (PAIRS | {second: first for first, second in PAIRS.items()}).get(kind)
        names = [name, f"{owner}.{partner}"] if partner else [name]
        return [each for each in names if each in self.values]


def _apart(name: str, unit: str, a: Signals, b: Signals, times: Array) -> Iterator[tuple[str, float]]:
    """The differences of one signal."""
    least = max(SMALL * b.largest.get(unit, 0.0), np.finfo(float).tiny)
    if unit in FORCES:
        parts = _of_force(a, b, name, least)
        yield name, float(max(parts.values()))
        yield from ((f"{name}.{key}", float(value)) for key, value in parts.items())
        if name.endswith(("contact_force", "normal_force")):
            yield f"{name}.onset", _onset(a, b, name)
        return
    apart = a.at(name) - b.at(name)
    off = _norm(times, apart)
    if unit in PLACES:
        scale = b.extent(name)
        yield f"{name}.peak", float(np.abs(apart).max(initial=0.0)) / scale
    else:
        slow = b.size / (float(times[-1] - times[0]) or 1.0) if unit == "m/s" else 0.0
        scale = max(least, SMALL * slow, *(float(np.abs(b.values[each]).max()) for each in b.pair(name)))
    yield name, off / scale


def _norm(times: Array, values: Array) -> float:
    if len(times) < 2:
        return float(np.abs(values).max(initial=0.0))
    return float(np.sqrt(np.trapezoid(values * values, times) / (times[-1] - times[0])))


def _of_force(a: Signals, b: Signals, name: str, least: float) -> dict[str, float]:
    """Differences of the largest magnitude, of the root of the mean square, and of the impulse."""
    pair = b.pair(name)
    peak = abs(np.abs(a.values[name]).max() - np.abs(b.values[name]).max())
    rms = abs(_norm(a.time, a.values[name]) - _norm(b.time, b.values[name]))
    (mine, size), (other, total) = ((_integral(run, name), _integral(run, name, np.abs)) for run in (a, b))
    impulse = max(abs(mine - other), abs(size - total))
    span = float(b.time[-1] - b.time[0]) or 1.0
    return {
        "peak": peak / max(least, *(float(np.abs(b.values[each]).max()) for each in pair)),
        "rms": rms / max(least, *(_norm(b.time, b.values[each]) for each in pair)),
        "impulse": impulse / max(least * span, *(_integral(b, each, np.abs) for each in pair)),
    }


def _integral(run: Signals, name: str, of: Callable[[Array], Array] = np.asarray) -> float:
    return float(np.trapezoid(of(run.values[name]), run.time))


def _onset(a: Signals, b: Signals, name: str) -> float:
    """Difference of the times of the first touch over the run's; infinite where but one run has any."""
    first = [run.time[np.argmax(run.values[name] > 0)] if (run.values[name] > 0).any() else None for run in (a, b)]
    if first[0] is None or first[1] is None:
        return 0.0 if first[0] is first[1] else np.inf
    return float(abs(first[0] - first[1]) / (b.time[-1] - b.time[0]))
