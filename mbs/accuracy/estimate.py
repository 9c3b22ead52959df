"""The error of a run from two finer ones: one finer in time, one finer in space.

With u the solution, u(h, n) a run of steps h and n elements or degrees, and k the rung's factor,

    u(h, n) - u = [u(h, n) - u(h/k, n)] (1 + q + q^2 + ...) + [u(h, n) - u(h, n+)] (1 + ...),

where q is how much a rung in time leaves. Each difference is a function of time, and its norm is told (`compare`). A rung in
time leaves a fifth to an eighth of a smooth error, and a third where contacts or kinks lower the order: `REMAINDER` is the sum of
that series. A rung in space leaves next to nothing of a polynomial's error and a sixteenth of an element's.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from buckler.mbs.accuracy.compare import Apart, Functions
from buckler.mbs.elements.signal import Kind

REMAINDER = 1.5
"""Error in time, of the difference to the next rung: the sum of a series that falls to a third."""
ROUNDING = 1e-8
"""Error told at least: two runs that agree to rounding are told to."""
UNRELATED = 0.1
"""Difference of places, over their range, from which two runs no longer know of each other."""
LATER, FASTEST = 1.5, 2
"""A rung in time later two runs of a motion that can be computed part so many times later at least, if they part at all: an
error that goes by the fourth power of time, and shrinks to a fifth, does. Power of time by which an error grows at most where
steps do not follow a vibration: that of its phase by time, and by its square where its frequency drifts."""


class Differences(NamedTuple):
    """Of a run from one finer in time, and from one finer in space."""

    time: Mapping[str, Apart]
    space: Mapping[str, Apart]

    def told(self) -> tuple[dict[str, float], dict[str, float]]:
        """Errors in time and in space, relative."""
        in_time = {name: max(REMAINDER * apart.relative, ROUNDING) for name, apart in self.time.items()}
        return in_time, {name: apart.relative for name, apart in self.space.items()}


def parted(a: Functions, b: Functions) -> float:
    """Time, s, to which two runs of one mechanism are one trajectory; infinite where they are to the end.

    Those that no longer know of each other at the end are held to be one as long as they differ by less than a hundredth of
    `UNRELATED`. Where finer runs part hardly later (`LATER`), the motion is chaotic, and one of many beyond. Steps that do not
    follow a vibration part as early on each rung, but are no sign of it: their difference grows by a power of time (`FASTEST`),
    that of a chaotic motion a hundredfold in as long as it took for the hundredfold before.
    """
    end = min(a.time[-1], b.time[-1])
    times = a.time[a.time <= end]
    mine, theirs, off = a.at(times), b.at(times), np.zeros(len(times))
    for name, (scale, _) in b.scales.items():
        if b.signals[name].kind is Kind.PLACE and name in a.signals:
            off = np.maximum(off, np.abs(mine[name] - theirs[name]) / scale)
    off = np.maximum.accumulate(off)
    if not off[-1] > UNRELATED:
        return np.inf
    begun, little, whole = (int(np.argmax(off > UNRELATED * share)) for share in (1e-4, 1e-2, 1.0))
    before = times[max(0, begun - 1)]
    if times[whole] - before > 100 ** (1 / FASTEST) * (times[little] - before):
        return np.inf
    return float(times[max(1, little - 1)])
