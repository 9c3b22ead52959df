"""Difference of two runs of one mechanism, signal by signal, in norms that bound the errors of maxima, means and integrals.

Both runs are cubics between their samples and compared at the samples of both. Two maxima may agree by chance; a norm of the
difference of two functions does not, and bounds the difference of their maxima, means and integrals:

    |rms a - rms b| <= rms(a - b),    |max a - max b| <= max|a - b|,    |int a - int b| <= max_t |int_0^t (a - b)|.

A contact that begins later in one run makes the forces differ by their whole size in between. Onsets of both runs are matched if
each is the nearest of the other. Forces and rates are compared on a time scale on which matched onsets coincide; their shift is
the norm ONSET. Impulses of a contact are compared by Levy's distance, which hardly changes where one impact is resolved as two.

References
----------
P. Levy, Theorie de l'addition des variables aleatoires, Gauthier-Villars, Paris 1937: distance of two increasing functions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..elements.signal import Kind, Signal
from ..geometry import Array
from ..record.errors import Key, Norm
from ..record.lookup import between, corrected_trapezoidal
from .trajectory import CONTINUOUS, FORCES, SMALL, TINY, Trajectory

GRAZE = 1e-3
"""Least impulse of a contact that is matched, over the largest of the run: smaller ones enter by their impulse alone. Ten times
more would ignore small blows, ten times less match noise."""
SPLIT = 0.1
"""Gap, over the length of a contact, below which two contacts are one: the force of a bending strip touches zero within a
blow."""
NEAR = 0.02
"""Largest shift of two onsets that belong together, over the run: twice the tolerance of places. Farther ones are two events."""


class Difference:
    """Run a less run b, up to a time [s]; b, the finer one, gives the sizes."""

    def __init__(self, a: Trajectory, b: Trajectory, until: float = np.inf) -> None:
        self.end = max(min(float(a.time[-1]), float(b.time[-1]), until), TINY)
        self.a, self.b, self.sizes = a.until(self.end), b.until(self.end), b.sizes
        self.grid = Grid.of(self.a.time, self.b.time, np.array([[0.0, self.end]] * 2))
        self._found, self._sizes = dict[Key, float](), dict[Key, float]()
        self._compared = set[str]()

    def norms(self, names: Iterable[str]) -> tuple[dict[Key, float], dict[Key, float]]:
        """Return relative norms and the sizes they are relative to, those of earlier calls included."""
        new = [name for name in names if name in self.a.signals and name in self.b.signals and name not in self._compared]
        self._compared.update(new)
        with np.errstate(all="ignore"):
            found = self._compare(new)
        for key, norm in found.items():
            size = self._sizes.setdefault(key, self.sizes.get(key, 1.0))
            self._found[key] = norm / size if np.isfinite(norm) else np.inf
        return self._found, self._sizes

    def _compare(self, names: list[str]) -> dict[Key, float]:
        """Compute norms of signals of both runs, in the signals' units."""
        jumping = [name for name in names if self.b.signals[name].kind not in CONTINUOUS]
        found = dict[Key, float]()
        for continuous, difference in self._continuous if len(jumping) < len(names) else ():
            some = [k for k, name in enumerate(continuous) if name in names]
            found |= self._means_and_peaks([continuous[k] for k in some], difference[:, some], self.grid.weights)
        if jumping:
            found |= self._compare_jumping(jumping)
        forces = [name for name in jumping if self.b.signals[name].kind in FORCES]
        if forces:
            self._add_impulses(found, forces)
        for name in forces:
            self._add_contact(found, name)
        return found

    @cached_property
    def _continuous(self) -> list[tuple[list[str], Array]]:
        """Continuous signals of both runs in groups: names, and differences of shape (times, signals)."""
        names = [name for name, signal in self.b.signals.items() if signal.kind in CONTINUOUS and name in self.a.signals]
        return list(self._subtract(names, self.grid))

    def places(self) -> Iterator[tuple[list[str], Array]]:
        """Yield places of both runs in groups: names, and differences over their sizes of shape (times, places)."""
        for names, difference in self._continuous:
            some = [k for k, name in enumerate(names) if self.b.signals[name].kind is Kind.PLACE]
            found = [names[k] for k in some]
            yield found, np.abs(difference[:, some]) / np.array([self.sizes[name, Norm.RMS] for name in found])

    def _subtract(self, names: list[str], grid: Grid) -> Iterator[tuple[list[str], Array]]:
        """Yield run a less run b in groups: with recorded rates, smooth, with jumps."""
        (n, m), a, b = grid.own, self.a.signals, self.b.signals
        times_a, times_b = grid.a[n:], np.append(grid.b[:n], grid.b[n + m :])
        groups = {x: (a[x].rate in a, b[x].rate in b, b[x].trait.smooth) for x in names}
        for group in dict.fromkeys(groups.values()):
            some = [x for x in names if groups[x] == group]
            samples_a, between_a = _values(self.a, some, group[0], times_a, group[2])
            samples_b, between_b = _values(self.b, some, group[1], times_b, group[2])
            at_a, at_b, others = samples_a[:n] - between_b[:n], between_a[:m] - samples_b[:m], between_a[m:] - between_b[n:]
            yield some, np.concatenate([at_a, at_b, others])

    def _means_and_peaks(self, names: list[str], difference: Array, weights: Array) -> dict[Key, float]:
        """Return root mean squares and peaks of differences; no peaks of energies, which are sums over the whole run."""
        means, peaks = np.sqrt(weights @ difference**2 / self.end), np.abs(difference).max(axis=0, initial=0.0)
        found: dict[Key, float] = dict(zip([(name, Norm.RMS) for name in names], means.tolist(), strict=True))
        found |= zip([(name, Norm.PEAK) for name in names], peaks.tolist(), strict=True)
        return {key: norm for key, norm in found.items() if key[1] is Norm.RMS or self.b.signals[key[0]].kind is not Kind.ENERGY}

    def _compare_jumping(self, names: list[str]) -> dict[Key, float]:
        """Compare signals that jump, with the times of b moved so that onsets coincide, leaving out the samples at jumps."""
        onsets_a, onsets_b = self.onsets
        grid, found = Grid.of(self.a.time, self.b.time, self.onsets), dict[Key, float]()
        jumps_a = np.append(onsets_a[1:-1], [t for t in self.b.kinks if t < self.end])
        jumps_b = np.interp(jumps_a, onsets_a, onsets_b)
        jumps = grid.find_jumps(grid.a, self.a.time, jumps_a) | grid.find_jumps(grid.b, self.b.time, jumps_b)
        for some, difference in self._subtract(names, grid):
            found |= self._means_and_peaks(some, np.where(jumps[:, None], 0.0, difference), grid.weights)
        return found

    def _add_impulses(self, found: dict[Key, float], names: list[str]) -> None:
        """Add max_t |int_0^t (a - b)| of forces, and as their sizes int |b|."""
        a, b = (np.stack([run.signals[name].values for name in names]) for run in (self.a, self.b))
        impulses_a, impulses_b = corrected_trapezoidal(self.a.time, a), corrected_trapezoidal(self.b.time, b)
        magnitudes = corrected_trapezoidal(self.b.time, np.abs(b))
        for name, impulse_a, impulse_b, magnitude in zip(names, impulses_a, impulses_b, magnitudes, strict=True):
            difference = np.interp(self.grid.a, self.a.time, impulse_a) - np.interp(self.grid.a, self.b.time, impulse_b)
            found[name, Norm.IMPULSE] = float(np.abs(difference).max())
            least = SMALL * self.sizes[name, Norm.RMS] * self.end
            self._sizes[name, Norm.IMPULSE] = max(float(np.interp(self.end, self.b.time, magnitude)), least)

    def _add_contact(self, found: dict[Key, float], name: str) -> None:
        """Replace the norms of a contact force by `contact_norms`, and add the force of contacts that both runs nearly make."""
        a, b = self.a.signals[name], self.b.signals[name]
        if b.kind is Kind.CONTACT and not b.group and b.unit == "N":
            relative = contact_norms((self.a.time, np.abs(a.values)), (self.b.time, np.abs(b.values)), self.end)
            self._sizes[name, Norm.ONSET] = self.end
            sizes = self._sizes | {(name, Norm.PEAK): self.sizes[name, Norm.PEAK]}
            found |= {(name, norm): value * sizes[name, norm] for norm, value in relative.items()}
        possible = self._possible_contact_force(a, b)
        if len(possible):
            found[name, Norm.RMS] += float(np.sqrt(self.grid.weights @ possible**2 / self.end))
            found[name, Norm.IMPULSE] += float(self.grid.weights @ possible)
            found[name, Norm.PEAK] += float(possible.max())

    @cached_property
    def onsets(self) -> Array:
        """Matched times of a and of b, shape (2, times): start, onsets near each other, end."""
        pairs = [(0.0, 0.0)]
        found = list[tuple[float, float]]()
        for name, signal in self.b.signals.items():
            if len(signal.onsets) and name in self.a.signals:
                a, b = (x[x < self.end] for x in (self.a.signals[name].onsets, signal.onsets))
                i, j = match_times(a, b)
                near = np.abs(a[i] - b[j]) < NEAR * self.end
                found += zip(a[i][near].tolist(), b[j][near].tolist(), strict=True)
        for time_a, time_b in sorted(found):
            if time_a > pairs[-1][0] and time_b > pairs[-1][1]:
                pairs.append((time_a, time_b))
        return np.array([*pairs, (self.end, self.end)]).T

    def _possible_contact_force(self, a: Signal, b: Signal) -> Array:
        """Return the force [N] of contacts that neither run makes, but that a depth deeper by the runs' difference would make."""
        if not len(b.depth):
            return np.empty(0)
        depths = [between(run.time, each.depth, None, self.grid.a, smooth=True) for run, each in ((self.a, a), (self.b, b))]
        deeper, order = np.max(depths, axis=0) + np.abs(depths[0] - depths[1]).max(), self.grid.order
        interval = np.empty(len(order), int)
        interval[order] = np.cumsum(np.diff(deeper[order] > 0, prepend=False))
        touching = np.unique(interval[np.max(depths, axis=0) > 0])
        return np.asarray(np.where(np.isin(interval, touching), 0.0, b.elastic(np.maximum(deeper, 0.0))))


@dataclass(frozen=True, eq=False)
class Grid:
    """Matched times of run a and of run b: first at the samples of a, then at those of b, then at times of neither."""

    a: Array
    b: Array
    own: tuple[int, int]  # numbers of samples of a and of b

    @classmethod
    def of(cls, a: Array, b: Array, matched: Array) -> Grid:
        """Merge the samples of two runs, up to the last of their matched times, shape (2, times)."""
        matched_a, matched_b = matched
        samples_a, samples_b = (time[time < end * (1 - 1e-12)] for time, end in zip((a, b), matched[:, -1], strict=True))
        times_a = np.concatenate([samples_a, np.interp(samples_b, matched_b, matched_a), matched_a])
        times_b = np.concatenate([np.interp(samples_a, matched_a, matched_b), samples_b, matched_b])
        return cls(times_a, times_b, (len(samples_a), len(samples_b)))

    @cached_property
    def order(self) -> Array:
        """Indices that sort the times."""
        return np.argsort(self.a, kind="stable")

    @cached_property
    def weights(self) -> Array:
        """Weights of the trapezoidal rule."""
        steps, found = np.diff(self.a[self.order]), np.empty(len(self.a))
        found[self.order] = (np.append(steps, 0.0) + np.append(0.0, steps)) / 2
        return found

    def find_jumps(self, times: Array, samples: Array, jumps: Array) -> Array:
        """Return True at times, `a` or `b`, that lie between the samples on both sides of a jump."""
        near, times = 1e-6 * float(samples[-1]), times[self.order]
        last = np.minimum(np.searchsorted(samples, jumps - near), len(samples) - 1)
        first = np.maximum(np.searchsorted(samples, jumps + near, side="right") - 1, 0)
        count, found = np.zeros(len(times) + 1, int), np.empty(len(times), bool)
        np.add.at(count, np.searchsorted(times, samples[np.minimum(first, last)]), 1)
        np.add.at(count, np.searchsorted(times, samples[np.maximum(first, last)], side="right"), -1)
        found[self.order] = np.cumsum(count[:-1]) > 0
        return found


def _values(run: Trajectory, names: list[str], known: bool, times: Array, smooth: bool) -> tuple[Array, Array]:
    """Return signals of a run at its samples and at other times, each (times, signals); `known` if their rates are recorded."""
    values = np.stack([run.signals[name].values for name in names], axis=1)
    rates = np.stack([run.signals[run.signals[name].rate].values for name in names], axis=1) if known else None
    return values, between(run.time, values, rates, times, smooth)


def match_times(a: Array, b: Array) -> tuple[Array, Array]:
    """Return indices of the times of a and b that are each other's nearest; such pairs never cross."""
    if not len(a) or not len(b):
        return np.empty(0, int), np.empty(0, int)
    nearest_b, nearest_a = (np.searchsorted((x[1:] + x[:-1]) / 2, y) for x, y in ((b, a), (a, b)))
    mutual = nearest_a[nearest_b] == np.arange(len(a))
    return np.flatnonzero(mutual), nearest_b[mutual]


def contact_norms(a: tuple[Array, Array], b: tuple[Array, Array], end: float) -> dict[Norm, float]:
    """Compute relative differences of two contact forces, each (time, force >= 0), up to an end [s]: impulse, peak, onsets.

    The peak differs by what the highest force of one run has beyond the highest of the other during that impact, so that an
    impact in two parts makes no difference. As the peaks of one impact may agree by chance, it differs at least by the relative
    root mean square of all, weighted by the fourth powers of peaks. What the samples of b miss of a peak, by the parabola
    through three of them, is added.
    """
    (impacts_a, impulse_a), (impacts_b, impulse_b) = (_find_impacts(*each, end) for each in (a, b))
    least = GRAZE * max(each[:, 2].max(initial=0.0) for each in (impacts_a, impacts_b))
    impacts_a, impacts_b = impacts_a[impacts_a[:, 2] > least], impacts_b[impacts_b[:, 2] > least]
    if not len(impacts_a) or not len(impacts_b):
        return dict.fromkeys((Norm.IMPULSE, Norm.PEAK, Norm.ONSET), float(len(impacts_a) != len(impacts_b)))
    i, j = match_times(impacts_a[:, 0], impacts_b[:, 0])
    shift = float(np.abs(impacts_a[i, 0] - impacts_b[j, 0]).max(initial=0.0))
    peaks_a, peaks_b, missed = impacts_a[:, 3], impacts_b[:, 3], impacts_b[:, 4]
    excess_a = np.maximum(0.0, peaks_a - _find_highest(*b, impacts_a, shift, end))
    excess_b = np.maximum(0.0, peaks_b - _find_highest(*a, impacts_b, shift, end))
    squares = np.append(
        excess_a * (peaks_a - excess_a), (excess_b * peaks_b)[excess_b < peaks_b]
    )  # 0 of impacts of one run alone
    scatter = np.sqrt(np.sum(squares**2) / np.sum(peaks_b**4)) * peaks_b
    peak, most = float(peaks_b.max()), max(peaks_a.max(), (peaks_b + scatter + missed).max())
    largest = float(max(most - peak, peak - (peaks_b - np.maximum(excess_b, scatter) - missed).max()))
    impulse = levy((a[0], impulse_a), (b[0], impulse_b), end, end / len(impacts_b))
    return {Norm.IMPULSE: impulse, Norm.PEAK: largest / peak, Norm.ONSET: shift / end}


def _find_highest(time: Array, force: Array, impacts: Array, shift: float, end: float) -> Array:
    """Return the highest force [N] of a run during the impacts of another, widened by a shift [s] at both ends."""
    first = np.maximum(np.searchsorted(time, impacts[:, 0] - shift) - 1, 0)
    after = np.minimum(np.searchsorted(time, impacts[:, 1] + shift, side="right") + 1, len(time))
    spans = np.stack([np.minimum(first, after - 1), after], axis=1).ravel()
    return np.asarray(np.maximum.reduceat(np.append(np.where(time <= end, force, 0.0), 0.0), spans)[::2])


def _find_impacts(time: Array, force: Array, end: float) -> tuple[Array, Array]:
    """Return onset and end [s], impulse [N s], peak and what samples miss of it [N], (contacts, 5); the integral of force."""
    impulse, force = corrected_trapezoidal(time, force), np.where(time <= end, force, 0.0)
    edges = np.flatnonzero(np.diff(force > 0, prepend=False, append=False))
    if not len(edges):
        return np.empty((0, 5)), impulse
    first, after = edges[::2], np.minimum(edges[1::2], len(time) - 1)
    distinct = time[np.maximum(first[1:] - 1, 0)] - time[after[:-1]] > SPLIT * (time[after] - time[first])[:-1]
    first, after = first[np.append(True, distinct)], after[np.append(distinct, True)]
    spans = np.stack([first, after + 1], axis=1).ravel()
    peaks, tops = (np.maximum.reduceat(np.append(each, 0.0), spans)[::2] for each in (force, _find_tops(time, force)))
    impulses = impulse[after] - impulse[np.maximum(first - 1, 0)]
    return np.stack([time[first], time[after], impulses, peaks, tops - peaks], axis=1), impulse


def _find_tops(time: Array, force: Array) -> Array:
    """Return the force [N] with each local maximum of a contact replaced by that of the parabola through its three samples."""
    h, tops = np.diff(time), force.copy()
    before, after = np.diff(force)[:-1] / h[:-1], np.diff(force)[1:] / h[1:]
    second, slope = (after - before) / (h[:-1] + h[1:]), (before * h[1:] + after * h[:-1]) / (h[:-1] + h[1:])
    top = (before >= 0) & (after <= 0) & (second < 0) & (force[:-2] > 0) & (force[2:] > 0)
    tops[1:-1][top] -= slope[top] ** 2 / (4 * second[top])
    return tops


def levy(a: tuple[Array, Array], b: tuple[Array, Array], end: float, unit: float) -> float:
    """Compute Levy's distance of two impulses: the least e with J_b(t - e unit) - e J <= J_a(t) <= J_b(t + e unit) + e J.

    J_a(t), J_b(t) are the impulses up to t, given with their times; J is J_b(end); `unit` is the mean time between contacts [s].
    The least e is found by bisection of its logarithm.
    """
    (time_a, impulse_a), (time_b, impulse_b) = a, b
    grid = np.append(time_a[time_a < end], end)
    impulse_a, total = np.interp(grid, time_a, impulse_a), float(np.interp(end, time_b, impulse_b))
    low, high = -9.0, 0.0
    for _ in range(10):
        e = 10 ** ((low + high) / 2)
        least, most = (np.interp(np.minimum(grid + shift * unit, end), time_b, impulse_b) for shift in (-e, e))
        fits = bool(np.all((least - e * total <= impulse_a) & (impulse_a <= most + e * total)))
        low, high = (low, (low + high) / 2) if fits else ((low + high) / 2, high)
    return float(10**high)
