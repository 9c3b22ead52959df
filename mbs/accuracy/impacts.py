"""Difference of the forces of one contact in two runs, impact by impact: impulses, peaks and times of onset.

Impacts are not paired by number: after a graze that only one run has, all pairs would be wrong. Impulses are compared by Levy's
distance of two increasing functions of time (P. Levy, Theorie de l'addition des variables aleatoires, Gauthier-Villars, 1937).
It hardly changes where one impact is resolved as two. Peaks are compared by the highest force that the other run has nearby.
"""

from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from ..geometry import Array
from ..record.errors import Norm
from ..record.lookup import corrected_trapezoidal


class ImpactTable(NamedTuple):
    """Impacts in the order of time, each field (impacts,)."""

    onset: Array  # [s]
    end: Array  # [s]
    impulse: Array  # [N s]
    peak: Array  # highest sample of the force [N]
    missed: Array  # highest vertex of the parabolas through three samples, less `peak` [N]


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts of a contact in one run, up to a time."""

    time: Array  # [s], (times,)
    force: Array  # [N], 0 beyond the end, (times,)
    impulse: Array  # up to each time [N s], (times,)
    table: ImpactTable
    end: float  # [s]

    @classmethod
    def of(cls, time: Array, force: Array, end: float) -> Self:
        """Find the impacts of a force >= 0 up to an end [s].

        Two contacts are one impact if less than a tenth of the duration of the first lies between them: the tenth is chosen, as
        the force of a bending strip touches zero within a blow.
        """
        impulse = corrected_trapezoidal(time, force)  # up to each time, also beyond the end
        force = np.where(time <= end, force, 0.0)
        touches = np.concatenate([[False], force > 0, [False]])
        edges = np.flatnonzero(touches[1:] != touches[:-1])
        if not len(edges):
            return cls(time, force, impulse, ImpactTable(*np.empty((5, 0))), end)
        first = edges[::2]  # first sample of each contact
        after = np.minimum(edges[1::2], len(time) - 1)  # first sample after the contact, at most the last sample
        before = np.maximum(first - 1, 0)
        gap = time[before[1:]] - time[after[:-1]]  # time [s] of zero force between two impacts
        is_distinct = gap > 0.1 * (time[after] - time[first])[:-1]
        is_first, is_last = np.append(True, is_distinct), np.append(is_distinct, True)
        first, before, after = first[is_first], before[is_first], after[is_last]
        beyond = after + 1  # spans include the sample `after`, which is in contact where the run ends in contact
        peaks = _find_maxima(force, first, beyond)
        vertices = _find_maxima(_find_vertices(time, force), first, beyond)
        table = ImpactTable(time[first], time[after], impulse[after] - impulse[before], peaks, vertices - peaks)
        return cls(time, force, impulse, table, end)

    def find_highest(self, impacts: ImpactTable, shift: float) -> Array:
        """Return the highest force [N] during each impact of another run, widened by a shift [s] and a sample at both ends."""
        first = np.maximum(np.searchsorted(self.time, impacts.onset - shift) - 1, 0)
        after = np.minimum(np.searchsorted(self.time, impacts.end + shift, side="right") + 1, len(self.time))
        return _find_maxima(self.force, np.minimum(first, after - 1), after)  # over one sample at least


def compare_impacts(a: Impacts, b: Impacts) -> dict[Norm, float]:
    """Compute relative differences of two contact forces: impulse, peak, onsets. Run b, the finer level, gives the sizes."""
    # Onsets and peaks: only impacts with more than a thousandth of the largest impulse are compared. A larger fraction would
    # ignore small impacts, a smaller one would match noise.
    least = 1e-3 * max(each.table.impulse.max(initial=0.0) for each in (a, b))
    impacts_a, impacts_b = (ImpactTable(*(field[table.impulse > least] for field in table)) for table in (a.table, b.table))
    count_a, count_b = len(impacts_a.onset), len(impacts_b.onset)
    if not count_a or not count_b:
        no_impacts = not count_a and not count_b
        return dict.fromkeys((Norm.IMPULSE, Norm.PEAK, Norm.ONSET), 0.0 if no_impacts else 1.0)
    i, j = match_times(impacts_a.onset, impacts_b.onset)
    shift = float(np.abs(impacts_a.onset[i] - impacts_b.onset[j]).max(initial=0.0))
    peak = _compare_peaks(impacts_a, impacts_b, b.find_highest(impacts_a, shift), a.find_highest(impacts_b, shift))
    mean_interval = b.end / count_b  # [s], of the impacts that are compared
    impulse = levy((a.time, a.impulse), (b.time, b.impulse), b.end, mean_interval)
    return {Norm.IMPULSE: impulse, Norm.PEAK: peak, Norm.ONSET: shift / b.end}


def _compare_peaks(a: ImpactTable, b: ImpactTable, highest_b: Array, highest_a: Array) -> float:
    """Bound the error of the highest peak of b, over that peak, from the highest forces of each run at impacts of the other.

    `highest_b` is the highest force of b during each impact of a [N], `highest_a` that of a during each impact of b. The excess
    of a peak is its height above this force of the other run, or 0. The peaks of one impact may agree by chance. So no peak of b
    is known better than the relative scatter s of all peaks:

        s^2 = sum (excess/F)^2 F^4 / sum peak_b^4.

    F is the force of b: `highest_b` at an impact of a, the peak at an impact of b. The first sum is over the impacts of a and
    those of b that a has, too. The weights F^4 let small peaks count little. The scatter and the vertex between samples raise the
    upper bound and lower the lower bound of each peak of b. Where the excess of b is larger than the scatter, it replaces the
    scatter in the lower bound. The peaks of a, the coarser run, only raise the largest upper bound.
    """
    excess_a, excess_b = np.maximum(0.0, a.peak - highest_b), np.maximum(0.0, b.peak - highest_a)
    is_in_both = highest_a > 0  # for the impacts of b; for those of a `highest_b` is 0 if b does not have them
    weighted = np.append(excess_a * highest_b, np.where(is_in_both, excess_b * b.peak, 0.0))  # excess F, for impacts of a, of b
    scatter = np.sqrt(np.sum(weighted**2) / np.sum(b.peak**4)) * b.peak
    upper = max(a.peak.max(), (b.peak + scatter + b.missed).max())  # [N]
    lower = (b.peak - np.maximum(excess_b, scatter) - b.missed).max()  # [N]
    peak = b.peak.max()
    return float(max(upper - peak, peak - lower) / peak)


def match_times(a: Array, b: Array) -> tuple[Array, Array]:
    """Return indices of the times of a and b that are each other's nearest; such pairs never cross."""
    if not len(a) or not len(b):
        return np.empty(0, int), np.empty(0, int)
    nearest_b, nearest_a = (np.searchsorted((x[1:] + x[:-1]) / 2, y) for x, y in ((b, a), (a, b)))
    mutual = nearest_a[nearest_b] == np.arange(len(a))
    return np.flatnonzero(mutual), nearest_b[mutual]


def _find_maxima(values: Array, first: Array, after: Array) -> Array:
    """Return the largest of `values` >= 0 in each span from the index `first` to the one before `after`."""
    spans = np.stack([first, after], axis=1).ravel()  # every second span goes from `after` to the next `first`
    return np.asarray(np.maximum.reduceat(np.append(values, 0.0), spans)[::2])  # `after` may be one beyond the last index


def _find_vertices(time: Array, force: Array) -> Array:
    """Return the force [N] with each local maximum of a contact raised to the vertex of the parabola through three samples."""
    left, right, vertices = force[:-2], force[2:], force.copy()
    k = 1 + np.flatnonzero((force[1:-1] >= np.maximum(left, right)) & (np.minimum(left, right) > 0))
    h1, h2 = time[k] - time[k - 1], time[k + 1] - time[k]
    secant1, secant2 = (force[k] - force[k - 1]) / h1, (force[k + 1] - force[k]) / h2
    slope, square = (secant1 * h2 + secant2 * h1) / (h1 + h2), (secant2 - secant1) / (h1 + h2)  # force[k] + slope t + square t^2
    curved = square < 0
    vertices[k[curved]] -= slope[curved] ** 2 / (4 * square[curved])
    return vertices


def levy(a: tuple[Array, Array], b: tuple[Array, Array], end: float, unit: float) -> float:
    """Compute Levy's distance of two impulses: the least e with J_b(t - e unit) - e J <= J_a(t) <= J_b(t + e unit) + e J.

    J_a(t) and J_b(t) are the impulses up to t, given with their times; J is J_b(end). `unit` is the mean time between impacts
    [s]. The inequalities are tested at the samples of a. The result is at most 1. The least e is found by bisection of its
    logarithm. A time that meets the inequalities at an e meets them at all larger ones. If an e is too small, only the times
    that failed at that e are tested further.
    """
    (time_a, impulse_a), (time_b, impulse_b) = a, b
    grid = np.append(time_a[time_a < end], end)
    impulse_a, total = np.interp(grid, time_a, impulse_a), float(np.interp(end, time_b, impulse_b))
    changes = np.diff(impulse_a) != 0
    needed = np.append(True, changes) | np.append(changes, True)  # of an interval with constant J_a, both ends suffice
    grid, impulse_a = grid[needed], impulse_a[needed]
    low, high = -9.0, 0.0  # decimal logarithms; the least is below the least error that is estimated (`estimate.LEAST_ERROR`)
    for _ in range(10):  # each halves the 9 decades: the result is then known to 2 %
        middle = (low + high) / 2
        e = 10**middle
        least, most = (np.interp(np.minimum(grid + shift * unit, end), time_b, impulse_b) for shift in (-e, e))
        fails = (least - e * total > impulse_a) | (impulse_a > most + e * total)
        if fails.any():
            low, grid, impulse_a = middle, grid[fails], impulse_a[fails]
        else:
            high = middle
    return float(10**high)
