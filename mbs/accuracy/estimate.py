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
from buckler.mbs.elements.element import Kind

REMAINDER = 1.5
"""Error in time, of the difference to the next rung: the sum of a series that falls to a third."""
ROUNDING = 1e-8
"""Error told at least: two runs that agree to rounding are told to."""
GROWS, UNRELATED = 6.0, 0.1
"""Power of time from which a difference of two runs grows so fast that a finer run gains little time; and that of places, over
their range, from which the two no longer know of each other."""


class Differences(NamedTuple):
    """Of a run from one finer in time, and from one finer in space."""

    time: Mapping[str, Apart]
    space: Mapping[str, Apart]

    def told(self) -> tuple[dict[str, float], dict[str, float]]:
        """Errors in time and in space, relative."""
        in_time = {name: max(REMAINDER * apart.relative, ROUNDING) for name, apart in self.time.items()}
        return in_time, {name: apart.relative for name, apart in self.space.items()}


def parted(a: Functions, b: Functions, tried: bool = False) -> float:
    """Time, s, to which two runs of one mechanism are one trajectory; infinite where they are to the end.

    In a chaotic motion the difference of two runs grows until they no longer know of each other: faster than by `GROWS`, or,
    if it was `tried`, in finer runs as well. They are held to be one as long as it is below a hundredth of `UNRELATED`.
    """
    end = min(a.time[-1], b.time[-1])
    times = np.linspace(0.0, end, 400)
    off = np.zeros(len(times))
    for name, (scale, _) in b.scales.items():
        if b.signals[name].kind is Kind.PLACE and name in a.signals:
            off = np.maximum(off, np.abs(a.at(name, times) - b.at(name, times)) / scale)
    off = np.maximum.accumulate(off)
    if not off[-1] > UNRELATED:
        return np.inf
    last = int(np.argmax(off > UNRELATED))
    known = off[last // 2]
    if off[last] <= 2**GROWS * known and not tried:
        return np.inf
    return float(times[max(1, int(np.argmax(off > UNRELATED / 100)) - 1)])
