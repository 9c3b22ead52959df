"""The error of a run from two finer ones: one finer in time, one finer in space.

    u(h, n) - u = [u(h, n) - u(h/k, n)] (1 + q + q^2 + ...) + [u(h, n) - u(h, n+)] (1 + ...)

A rung in time leaves a share q, a fifth to a thirteenth of a smooth error, and a half where contacts, kinks or what lies between
samples lower the order to the first, as steps are halved (Exudyn) or 0.6 of what they were (compiled solver); one in space leaves
next to nothing of a polynomial's error and a sixteenth of an element's.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import NamedTuple

import numpy as np

from ..elements.signal import Kind
from .compare import SMALL, Apart, Functions, compare

REMAINDER = 2.0
"""Error in time, of the difference to the next rung: the sum of a series that falls to a half."""
ROUNDING = float(np.sqrt(np.finfo(float).eps))
"""Error told at least, half of the digits there are: two runs that agree to rounding are told to."""
UNRELATED = 0.1
"""Difference of places, over their range, from which two runs no longer know of each other."""
FASTEST = 2
"""Power of time by which an error grows at most that is no sign of chaos: that of a phase by time, by its square where the
frequency drifts."""
BALANCE = "energy.balance"
"""Name of what the energies of a run do not add up by; it is judged in every run."""
Pair = tuple[Functions, Functions]


class Look(NamedTuple):
    """What a run and two finer ones show: differences from the one finer in time, and of the pair whose is the error in space.

    From `parts_at`, s, the run and the one finer in time no longer know of each other; runs are compared up to `until`, s.
    """

    base: Functions
    time: Mapping[str, Apart]
    space: Mapping[str, Apart]
    parts_at: float
    until: float

    @property
    def told(self) -> tuple[dict[str, float], dict[str, float]]:
        """Errors in time and in space, relative."""
        in_time = {name: max(REMAINDER * apart.relative, ROUNDING) for name, apart in self.time.items()}
        return in_time, {name: apart.relative for name, apart in self.space.items()}


def look(base: Functions, finer: Functions, wide: Pair | None = None, later: float = inf) -> Look:
    """Hold a run against finer ones; where it parts from that before `later`, s, to the time to which they are one trajectory."""
    parts_at = parted(base, finer)
    chaotic = parts_at < later < inf
    until = min(parts_at, parted(*wide) if wide else inf) if chaotic else inf
    return Look(base, _in_time(base, finer, until), compare(*wide, until) if wide else {}, parts_at, until)


def _in_time(base: Functions, finer: Functions, until: float) -> dict[str, Apart]:
    """The differences, and what the energies do not add up by.

    Of a ringing that the steps do not follow nothing is known: both runs damp it away. A place is off by its amplitude at most,
    and by what it moves.
    """
    found = compare(base, finer, until)
    unknown = {f"{name}{reading}": Apart(inf, 1.0) for name in base.unresolved for reading in ("", ".peak")}
    for name, signal in base.signals.items() if unknown and base.taken else ():
        if signal.kind is Kind.PLACE and name in found:
            way = min(base.taken / (1.0 if signal.unit == "m" else base.size), float(base.own[name][0]))
            found |= {n: found[n]._replace(off=found[n].off + way) for n in (name, f"{name}.peak")}
    return found | unknown | {BALANCE: Apart(base.balance / REMAINDER, 1.0)}


def parted(a: Functions, b: Functions) -> float:
    """Time, s, to which two runs of one mechanism are one trajectory; infinite where they are to the end.

    Those that no longer know of each other at the end are held to be one as long as they differ by less than a hundredth of
    `UNRELATED`. Where finer runs part hardly later, the motion is chaotic, and one of many beyond. Steps that do not follow a
    vibration part as early on each rung, but are no sign of it: their difference grows by a power of time (`FASTEST`), that of a
    chaotic motion a hundredfold in as long as it took for the hundredfold before.
    """
    times = a.time[a.time <= b.time[-1]]
    off = np.zeros(len(times))
    for name, theirs in b.at(times, (Kind.PLACE,)).items():
        if name in a.signals:
            off = np.maximum(off, np.abs(a.signals[name].values[: len(times)] - theirs) / b.scales[name][0])
    off = np.maximum.accumulate(off)
    if not off[-1] > UNRELATED:
        return inf
    begun, little, whole = (int(np.argmax(off > UNRELATED * share)) for share in (SMALL**2, SMALL, 1.0))
    before = times[max(0, begun - 1)]
    by_power = times[whole] - before > SMALL ** (-1 / FASTEST) * (times[little] - before)
    return inf if by_power else float(times[max(1, little - 1)])
