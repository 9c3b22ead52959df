"""Error of the finer of two runs from their difference, and the time at which two runs separate.

The error goes as e ~ tol^q. The difference of runs B and C at tolerances tol_B > tol_C is e_B - e_C. So

    e_C = |B - C| / (gain - 1),    gain = (tol_B / tol_C)^q.

A first pair does not show the order q. A low order is assumed, see `levels.Orders`, which overestimates the error where the true
order is higher. With q = 1/3 and tolerances in the ratio 8 the estimated error is the difference itself. If the true order is
between 1.46 and 0.2, the true error is 0.05 to 2 times the estimated one. Later pairs show the order. This is the error estimate
of L. F. Richardson, Phil. Trans. R. Soc. A 210 (1911) 307, doi 10.1098/rsta.1911.0009, without extrapolation.
"""

from collections.abc import Callable, Mapping
from math import inf, log

import numpy as np

from ..record.errors import Key, Norm
from .difference import Difference

SEPARATED = 0.1
"""Difference of places, over their range, beyond which runs are separate: ten times `demand.PLACE_ERROR`, a tenth of the most by
which two motions within one range can differ."""
WINDOWS = 200
"""Windows of time in which runs are separate or not: the resolution of the separation time."""
LAST_WINDOWS = 10
"""Windows at the end in which no separation begins: too few are left to see whether it lasts."""
LEAST_ERROR = float(np.sqrt(np.finfo(float).eps))
"""Least relative error that is estimated or requested, half of the digits: rounding errors are common to both runs."""


def estimate_gains(
    now: Mapping[Key, float], before: Mapping[Key, float] | None, ratios: tuple[float, float],
    orders: Callable[[str], tuple[float, float, float]],
) -> dict[Key, float]:  # fmt: skip
    """Estimate the ratio of errors of the coarser to the finer run of a pair, for each signal and norm.

    Let r be the ratio of tolerances of this pair, s of the one before; `ratios` are (r, s). The ratio of differences before/now
    is (s^q - 1)/(1 - r^-q), which fixed-point iteration solves for q. With r = s = 8 each iteration reduces the error of q by the
    factor 8^-q: 20 iterations from 0.5 leave 1e-5 at q = 1/4 and less above.
    `orders` returns for a signal the order assumed of a first pair, and the least and the largest of later pairs.
    """
    gains, (ratio, ratio_before) = dict[Key, float](), ratios
    for key, difference in now.items():
        order, least, largest = orders(key[0])
        earlier = before.get(key, 0.0) if before else 0.0  # difference of the pair before
        if earlier > 0 and 0 < difference < inf:  # both show the order; infinite: a signal is not finite
            q = 0.5
            for _ in range(20):
                q = log(1 + earlier / difference * (1 - ratio**-q)) / log(ratio_before)
            order = float(np.clip(q, least, largest))
        gains[key] = ratio**order
    return gains


class Separation:
    """Largest difference of all places at each time: once divided by their ranges, once by the errors allowed in RMS."""

    def __init__(self, pair: Difference, allowed: Mapping[Key, float]) -> None:
        self.time = pair.grid.times_a  # samples of both runs [s], not in order
        self.end = pair.end  # [s]
        self.relative, self.over_allowed = np.zeros(len(self.time)), np.zeros(len(self.time))
        for names, relative in pair.places():  # (places, times)
            limits = np.array([[allowed.get((name, Norm.RMS), inf)] for name in names])
            np.maximum(self.relative, relative.max(axis=0), out=self.relative)
            np.maximum(self.over_allowed, (relative / limits).max(axis=0), out=self.over_allowed)
        self.is_ever_separate = bool((self.relative > SEPARATED).any())  # though perhaps not later on

    @property
    def start(self) -> float:
        """Time [s] from which the runs are separate in most windows; infinite if there is none.

        One impact at two different instants separates them briefly.
        """
        separate = self.relative > SEPARATED
        window = np.minimum((self.time / self.end * WINDOWS).astype(int), WINDOWS - 1)
        has_separate = np.isin(np.arange(WINDOWS), window[separate])
        separate_from_here = np.cumsum(has_separate[::-1])[::-1]  # number of such windows from each window to the last
        windows_from_here = np.arange(WINDOWS, 0, -1)
        lasting = has_separate & (separate_from_here > 0.5 * windows_from_here)
        if not lasting[: WINDOWS - LAST_WINDOWS].any():
            return inf
        return float(self.time[separate & (window == np.argmax(lasting))].min())

    def agree_until(self, share: float = 1.0) -> float:
        """Find the time [s] up to which the difference of every place is at most a share of the allowed error."""
        first = self.time[self.over_allowed > share].min(initial=inf)
        return float(self.time[self.time < first].max(initial=0.0)) if first < inf else self.end
