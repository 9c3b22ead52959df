"""Error of the finer of two runs from their difference, and the time at which two runs part.

The error goes as e ~ tol^q. The difference of runs B and C at tolerances tol_B > tol_C is e_B - e_C. So

    e_C = |B - C| / (gain - 1),    gain = (tol_B / tol_C)^q.

The order q is the least of the solver for a first pair and wherever anything strikes, else as the pair before shows, within
bounds: L. F. Richardson, Phil. Trans. R. Soc. A 210 (1911) 307, doi 10.1098/rsta.1911.0009, without extrapolating the run itself.

Two runs of a chaotic motion part as exp(t/t_L): each refinement moves the time of parting by the same amount. A drift of the
phase grows by a power of time, so that each refinement moves its parting by more than the one before.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, log

import numpy as np

from ..elements.signal import Kind
from ..geometry import Array
from ..record.errors import Key, Norm
from .difference import Difference

PARTED = 0.1
"""Difference of places, over their range, of runs that no longer know of each other. At 1 a phase drift would pass for chaos."""
WINDOWS = 200
"""Windows of time in which parting is looked at: the resolution of the parting time. A snap that comes a window later is none."""
LASTING = 0.5
"""Part of all later windows in which runs that have parted are apart: a blow or a snap that comes later does not last."""
LAST = 10
"""Windows at the end in which no parting is looked for: too few are left to see whether it lasts."""
LEAST = float(np.sqrt(np.finfo(float).eps))
"""Least error that is estimated or asked for, half of the digits there are: rounding enters two runs alike."""


def gains(
    now: Mapping[Key, float], before: Mapping[Key, float] | None, ratios: tuple[float, float], orders: tuple[float, float]
) -> dict[Key, float]:
    """Estimate the ratio of errors of the coarser to the finer run of a pair, for each signal and norm.

    Given are differences and ratios of the tolerances of this pair and of the one before, and the least and largest order.
    """
    found, (ratio, ratio_before) = dict.fromkeys(now, orders[0]), ratios
    for key, off in now.items():
        if before is not None and off > 0 and before.get(key, 0.0) > 0 and np.isfinite(off):
            q = 0.5  # differences fall by (r^q - 1)/(1 - s^-q), r and s the ratios before and now: by iteration
            for _ in range(20):
                q = log(1 + before[key] / off * (1 - ratio**-q)) / log(ratio_before)
            found[key] = float(np.clip(q, *orders))
    return {key: ratio**q for key, q in found.items()}


def errors(now: Mapping[Key, float], gain: Mapping[Key, float]) -> dict[Key, float]:
    """Errors of the finer run of a pair; those of keys without a gain by the least gain of all."""
    least = min(gain.values(), default=2.0)
    return {key: max(LEAST, off / (gain.get(key, least) - 1)) for key, off in now.items()}


class Parting:
    """Difference of all places of two runs over time."""

    def __init__(self, pair: Difference, allowed: Mapping[Key, float]) -> None:
        names = [name for name, signal in pair.b.signals.items() if signal.kind is Kind.PLACE and name in pair.a.signals]
        self.time, self.end = pair.time, pair.end
        off = pair.relative(names)
        self.off = off.max(axis=1, initial=0.0)
        limits = np.array([allowed.get((name, Norm.RMS), inf) for name in names])
        self.over = (off / limits).max(axis=1, initial=0.0)

    @property
    def at(self) -> float:
        """Time [s] at which the runs part for good; infinite where they do not."""
        far = self.off > PARTED
        window = np.minimum((self.time / self.end * WINDOWS).astype(int), WINDOWS - 1)
        beyond = np.isin(np.arange(WINDOWS), window[far])
        lasting = beyond & (np.cumsum(beyond[::-1])[::-1] > LASTING * np.arange(WINDOWS, 0, -1))
        if not lasting[: WINDOWS - LAST].any():
            return inf
        return float(self.time[np.argmax(far & (window == np.argmax(lasting)))])

    def within(self, share: float = 1.0) -> float:
        """Time [s] up to which every place is within a share of what is allowed."""
        beyond: Array = np.maximum.accumulate(self.over) > share
        return float(self.time[max(0, int(np.argmax(beyond)) - 1)]) if beyond.any() else self.end
