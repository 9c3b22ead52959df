"""Difference of two forces of one contact by their impacts: impulses, peaks and times of onset.

Pairs by number would all be wrong after a graze that only one run has. Impulses are compared by Levy's
distance, which hardly changes where one impact is resolved as two; peaks by the highest force that the other run has nearby.

References
----------
P. Levy, Theorie de l'addition des variables aleatoires, Gauthier-Villars, Paris 1937: distance of two increasing functions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry import Array
from ..record.errors import Norm
from ..record.lookup import corrected_trapezoidal

GRAZE = 1e-3
"""Least impulse of an impact whose onset and peak are compared, over the largest; smaller ones add to the impulse. Ten times
more would ignore small blows, ten times less match noise."""
SPLIT = 0.1
"""Gap, over the duration of the first impact, below which two impacts are one: the force of a bending strip touches zero within a
blow."""
LEAST_DISTANCE = -9.0
"""Decimal logarithm of the least distance of two impulses, below the least error that is estimated, 1.5e-8."""
BISECTIONS = 10
"""Bisections of the logarithm of that distance, of 9 decades: it is then known to 2 %."""


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts of a contact in one run, up to a time."""

    time: Array  # [s], (times,)
    force: Array  # [N], 0 beyond the end, (times,)
    impulse: Array  # up to each time [N s], (times,)
    table: Array  # columns: onset, end [s], impulse [N s], peak, what samples miss of the peak [N]; (impacts, 5)
    end: float  # [s]

    @classmethod
    def of(cls, time: Array, force: Array, end: float) -> Impacts:
        """Find the impacts of a force >= 0 up to an end [s]; impacts closer than `SPLIT` are one."""
        impulse, force = corrected_trapezoidal(time, force), np.where(time <= end, force, 0.0)
        edges = np.flatnonzero(np.diff(force > 0, prepend=False, append=False))
        if not len(edges):
            return cls(time, force, impulse, np.empty((0, 5)), end)
        first, after = edges[::2], np.minimum(edges[1::2], len(time) - 1)
        distinct = time[np.maximum(first[1:] - 1, 0)] - time[after[:-1]] > SPLIT * (time[after] - time[first])[:-1]
        first, after = first[np.append(True, distinct)], after[np.append(distinct, True)]
        spans = np.stack([first, after + 1], axis=1).ravel()  # every second one is an impact, the others lie between impacts
        peaks, tops = (np.maximum.reduceat(np.append(each, 0.0), spans)[::2] for each in (force, _find_tops(time, force)))
        impulses = impulse[after] - impulse[np.maximum(first - 1, 0)]
        return cls(time, force, impulse, np.stack([time[first], time[after], impulses, peaks, tops - peaks], axis=1), end)

    @property
    def total(self) -> float:
        """Impulse up to the end [N s]."""
        return float(np.interp(self.end, self.time, self.impulse))

    def find_highest(self, impacts: Array, shift: float) -> Array:
        """Return the highest force [N] during the impacts of another run, widened by a shift [s] at both ends."""
        first = np.maximum(np.searchsorted(self.time, impacts[:, 0] - shift) - 1, 0)
        after = np.minimum(np.searchsorted(self.time, impacts[:, 1] + shift, side="right") + 1, len(self.time))
        spans = np.stack([np.minimum(first, after - 1), after], axis=1).ravel()
        return np.asarray(np.maximum.reduceat(np.append(self.force, 0.0), spans)[::2])


def compare_impacts(a: Impacts, b: Impacts) -> dict[Norm, float]:
    """Compute relative differences of two contact forces, of which b gives the sizes: impulse, peak, onsets.

    The difference of peaks is the excess of the highest force of one run over the highest of the other during that impact. So an
    impact in two parts makes no difference. The peaks of one impact may agree by chance. So the difference is at least the
    root mean square of all relative excesses, weighted by the fourth powers of peaks. The excess of the parabola through three
    samples of b over their peak is added.
    """
    least = GRAZE * max(each.table[:, 2].max(initial=0.0) for each in (a, b))
    impacts_a, impacts_b = (each.table[each.table[:, 2] > least] for each in (a, b))
    if not len(impacts_a) or not len(impacts_b):
        return dict.fromkeys((Norm.IMPULSE, Norm.PEAK, Norm.ONSET), float(len(impacts_a) != len(impacts_b)))
    i, j = match_times(impacts_a[:, 0], impacts_b[:, 0])
    shift = float(np.abs(impacts_a[i, 0] - impacts_b[j, 0]).max(initial=0.0))
    peaks_a, peaks_b, missed = impacts_a[:, 3], impacts_b[:, 3], impacts_b[:, 4]
    excess_a = np.maximum(0.0, peaks_a - b.find_highest(impacts_a, shift))
    excess_b = np.maximum(0.0, peaks_b - a.find_highest(impacts_b, shift))
    # relative excess times squared peak of b, which is peak - excess at impacts of a; without impacts of one run alone
    weighted = np.append(excess_a * (peaks_a - excess_a), (excess_b * peaks_b)[excess_b < peaks_b])
    scatter = np.sqrt(np.sum(weighted**2) / np.sum(peaks_b**4)) * peaks_b
    peak, most = float(peaks_b.max()), max(peaks_a.max(), (peaks_b + scatter + missed).max())
    largest = float(max(most - peak, peak - (peaks_b - np.maximum(excess_b, scatter) - missed).max()))
    impulse = levy((a.time, a.impulse), (b.time, b.impulse), b.end, b.end / len(impacts_b))
    return {Norm.IMPULSE: impulse, Norm.PEAK: largest / peak, Norm.ONSET: shift / b.end}


def match_times(a: Array, b: Array) -> tuple[Array, Array]:
    """Return indices of the times of a and b that are each other's nearest; such pairs never cross."""
    if not len(a) or not len(b):
        return np.empty(0, int), np.empty(0, int)
    nearest_b, nearest_a = (np.searchsorted((x[1:] + x[:-1]) / 2, y) for x, y in ((b, a), (a, b)))
    mutual = nearest_a[nearest_b] == np.arange(len(a))
    return np.flatnonzero(mutual), nearest_b[mutual]


def _find_tops(time: Array, force: Array) -> Array:
    """Return the force [N] with each local maximum of a contact replaced by that of the parabola through its three samples."""
    left, right, tops = force[:-2], force[2:], force.copy()
    k = 1 + np.flatnonzero((force[1:-1] >= np.maximum(left, right)) & (np.minimum(left, right) > 0))
    h1, h2 = time[k] - time[k - 1], time[k + 1] - time[k]
    before, after = (force[k] - force[k - 1]) / h1, (force[k + 1] - force[k]) / h2
    second, slope = (after - before) / (h1 + h2), (before * h2 + after * h1) / (h1 + h2)
    curved = second < 0
    tops[k[curved]] -= slope[curved] ** 2 / (4 * second[curved])
    return tops


def levy(a: tuple[Array, Array], b: tuple[Array, Array], end: float, unit: float) -> float:
    """Compute Levy's distance of two impulses: the least e with J_b(t - e unit) - e J <= J_a(t) <= J_b(t + e unit) + e J.

    J_a(t), J_b(t) are the impulses up to t, given with their times; J is J_b(end); `unit` is the mean time between impacts [s].
    The least e is found by bisection of its logarithm. A time that fits at an e fits at all larger ones.
    """
    (time_a, impulse_a), (time_b, impulse_b) = a, b
    grid = np.append(time_a[time_a < end], end)
    impulse_a, total = np.interp(grid, time_a, impulse_a), float(np.interp(end, time_b, impulse_b))
    changes = np.diff(impulse_a, prepend=np.nan, append=np.nan) != 0  # where J_a is constant, the ends decide
    grid, impulse_a = (each[changes[1:] | changes[:-1]] for each in (grid, impulse_a))
    low, high = LEAST_DISTANCE, 0.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        e = 10**middle
        least, most = (np.interp(np.minimum(grid + shift * unit, end), time_b, impulse_b) for shift in (-e, e))
        beyond = (least - e * total > impulse_a) | (impulse_a > most + e * total)
        if beyond.any():
            low, grid, impulse_a = middle, grid[beyond], impulse_a[beyond]
        else:
            high = middle
    return float(10**high)
