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

from collections.abc import Iterable
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
        self.a, self.b = a, b
        self.end = max(min(float(a.time[-1]), float(b.time[-1]), until), TINY)
        self.time = _merge_times((a.time, b.time), self.end)
        self.weights = _trapezoid(self.time)
        self._found, self._sizes = dict[Key, float](), dict[Key, float]()
        self._compared = set[str]()

    def norms(self, names: Iterable[str]) -> tuple[dict[Key, float], dict[Key, float]]:
        """Return relative norms and the sizes they are relative to, those of earlier calls included."""
        new = [name for name in names if name in self.a.signals and name in self.b.signals and name not in self._compared]
        self._compared.update(new)
        with np.errstate(all="ignore"):
            found = self._compare(new)
        for key, norm in found.items():
            size = self._sizes.setdefault(key, self.b.sizes.get(key, 1.0))
            self._found[key] = norm / size if np.isfinite(norm) else np.inf
        return self._found, self._sizes

    def _compare(self, names: list[str]) -> dict[Key, float]:
        """Compute norms of signals of both runs, in the signals' units."""
        continuous = [name for name in names if self.b.signals[name].kind in CONTINUOUS]
        jumping = [name for name in names if name not in continuous]
        difference = _values(self.a, continuous, self.time) - _values(self.b, continuous, self.time)
        found = self._means_and_peaks(continuous, difference, self.weights)
        if jumping:
            found |= self._compare_jumping(jumping)
        forces = [name for name in jumping if self.b.signals[name].kind in FORCES]
        if forces:
            self._add_impulses(found, forces)
        for name in forces:
            self._add_contact(found, name)
        return found

    def relative(self, names: list[str]) -> Array:
        """Return differences of signals over their sizes, shape (times, signals)."""
        difference = np.abs(_values(self.a, names, self.time) - _values(self.b, names, self.time))
        return np.asarray(difference / np.array([self.b.sizes[name, Norm.RMS] for name in names]))

    def _means_and_peaks(self, names: list[str], difference: Array, weights: Array) -> dict[Key, float]:
        """Return root mean squares and peaks of differences; no peaks of energies, rates and accelerations."""
        means = np.sqrt(weights @ difference**2 / self.end).tolist()
        peaks = np.abs(difference).max(axis=0, initial=0.0).tolist()
        found: dict[Key, float] = {(name, Norm.RMS): mean for name, mean in zip(names, means, strict=True)}
        no_peak = (Kind.ENERGY, Kind.RATE, Kind.ACCELERATION)
        return found | {
            (name, Norm.PEAK): peak for name, peak in zip(names, peaks, strict=True) if self.b.signals[name].kind not in no_peak
        }

    def _compare_jumping(self, names: list[str]) -> dict[Key, float]:
        """Compare signals that jump, with the times of b moved so that onsets coincide, leaving out the samples at jumps."""
        onsets_a, onsets_b = self.onsets
        times_a = _merge_times((self.a.time, np.interp(self.b.time, onsets_b, onsets_a), onsets_a), self.end)
        times_b = np.interp(times_a, onsets_a, onsets_b)
        jumps_a = np.append(onsets_a[1:-1], [t for t in self.b.kinks if t < self.end])
        jumps_b = np.interp(jumps_a, onsets_a, onsets_b)
        smooth = ~(_find_jumps(times_a, self.a.time, jumps_a) | _find_jumps(times_b, self.b.time, jumps_b))
        difference = np.where(smooth[:, None], _values(self.a, names, times_a) - _values(self.b, names, times_b), 0.0)
        return self._means_and_peaks(names, difference, _trapezoid(times_a))

    def _add_impulses(self, found: dict[Key, float], names: list[str]) -> None:
        """Add max_t |int_0^t (a - b)| of forces, and as their sizes int |b|."""
        a, b = (np.stack([run.signals[name].values for name in names]) for run in (self.a, self.b))
        impulses_a, impulses_b = corrected_trapezoidal(self.a.time, a), corrected_trapezoidal(self.b.time, b)
        magnitudes = corrected_trapezoidal(self.b.time, np.abs(b))
        for name, impulse_a, impulse_b, magnitude in zip(names, impulses_a, impulses_b, magnitudes, strict=True):
            difference = np.interp(self.time, self.a.time, impulse_a) - np.interp(self.time, self.b.time, impulse_b)
            found[name, Norm.IMPULSE] = float(np.abs(difference).max())
            least = SMALL * self.b.sizes[name, Norm.RMS] * self.end
            self._sizes[name, Norm.IMPULSE] = max(float(np.interp(self.end, self.b.time, magnitude)), least)

    def _add_contact(self, found: dict[Key, float], name: str) -> None:
        """Replace the norms of a contact force by `contact_norms`, and add the force of contacts that both runs nearly make."""
        a, b = self.a.signals[name], self.b.signals[name]
        if b.kind is Kind.CONTACT and not b.group and b.unit == "N":
            relative = contact_norms((self.a.time, np.abs(a.values)), (self.b.time, np.abs(b.values)), self.end)
            self._sizes[name, Norm.ONSET] = self.end
            sizes = self._sizes | {(name, Norm.PEAK): self.b.sizes[name, Norm.PEAK]}
            found |= {(name, norm): value * sizes[name, norm] for norm, value in relative.items()}
        possible = self._possible_contact_force(a, b)
        if len(possible):
            found[name, Norm.RMS] += float(np.sqrt(self.weights @ possible**2 / self.end))
            found[name, Norm.IMPULSE] += float(self.weights @ possible)
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
        depths = [between(run.time, each.depth, None, self.time, smooth=True) for run, each in ((self.a, a), (self.b, b))]
        deeper = np.max(depths, axis=0) + np.abs(depths[0] - depths[1]).max()
        interval = np.cumsum(np.diff(deeper > 0, prepend=False))
        touching = np.unique(interval[np.max(depths, axis=0) > 0])
        return np.asarray(np.where(np.isin(interval, touching), 0.0, b.elastic(np.maximum(deeper, 0.0))))


def _merge_times(times: Iterable[Array], end: float) -> Array:
    """Merge times up to an end, each once."""
    every = np.unique(np.concatenate(list(times)))
    return np.append(every[every < end * (1 - 1e-12)], end)


def _trapezoid(times: Array) -> Array:
    """Return the weights of the trapezoidal rule."""
    steps = np.diff(times)
    return (np.append(steps, 0.0) + np.append(0.0, steps)) / 2


def _values(run: Trajectory, names: list[str], times: Array) -> Array:
    """Interpolate signals of a run, shape (times, signals), in three groups: with recorded rates, smooth, with jumps."""
    found = np.empty((len(times), len(names)))
    some = slice(int(np.searchsorted(run.time, times[-1])) + 3)  # slopes need two samples more
    signals = [run.signals[name] for name in names]
    for known, smooth in ((True, False), (False, True), (False, False)):
        group = [k for k, s in enumerate(signals) if (s.rate in run.signals) == known and (known or s.trait.smooth == smooth)]
        if group:
            values = np.stack([signals[k].values[some] for k in group], axis=1)
            rates = np.stack([run.signals[signals[k].rate].values[some] for k in group], axis=1) if known else None
            found[:, group] = between(run.time[some], values, rates, times, smooth)
    return found


def _find_jumps(times: Array, samples: Array, jumps: Array) -> Array:
    """Return True at times that lie between the samples on both sides of a jump."""
    found, near = np.zeros(len(times), dtype=bool), 1e-6 * float(samples[-1])
    last = np.minimum(np.searchsorted(samples, jumps - near), len(samples) - 1)
    first = np.maximum(np.searchsorted(samples, jumps + near, side="right") - 1, 0)
    for low, high in zip(samples[np.minimum(first, last)], samples[np.maximum(first, last)], strict=True):
        found[np.searchsorted(times, low) : np.searchsorted(times, high, side="right")] = True
    return found


def match_times(a: Array, b: Array) -> tuple[Array, Array]:
    """Return indices of the times of a and b that are each other's nearest; such pairs never cross."""
    if not len(a) or not len(b):
        return np.empty(0, int), np.empty(0, int)
    nearest_b, nearest_a = (np.searchsorted((x[1:] + x[:-1]) / 2, y) for x, y in ((b, a), (a, b)))
    mutual = nearest_a[nearest_b] == np.arange(len(a))
    return np.flatnonzero(mutual), nearest_b[mutual]


def contact_norms(a: tuple[Array, Array], b: tuple[Array, Array], end: float) -> dict[Norm, float]:
    """Compute relative differences of two contact forces, each (time, force >= 0), up to an end [s]: impulse, peak, onsets.

    The largest peak may belong to any impact whose own difference allows it. As the peaks of one impact may agree by chance,
    each differs at least by the relative root mean square of all. What the samples of b miss of a peak, by the parabola through
    three of them, is added. An impact of one run alone differs by its whole peak.
    """
    (impacts_a, impulse_a), (impacts_b, impulse_b) = (_find_impacts(*each, end) for each in (a, b))
    least = GRAZE * max(each[:, 1].max(initial=0.0) for each in (impacts_a, impacts_b))
    impacts_a, impacts_b = impacts_a[impacts_a[:, 1] > least], impacts_b[impacts_b[:, 1] > least]
    if not len(impacts_a) or not len(impacts_b):
        return dict.fromkeys((Norm.IMPULSE, Norm.PEAK, Norm.ONSET), float(len(impacts_a) != len(impacts_b)))
    i, j = match_times(impacts_a[:, 0], impacts_b[:, 0])
    only_a, only_b = np.delete(impacts_a, i, axis=0), np.delete(impacts_b, j, axis=0)
    peaks_a = np.concatenate([impacts_a[i, 2], only_a[:, 2], np.zeros(len(only_b))])
    peaks_b = np.concatenate([impacts_b[j, 2], np.zeros(len(only_a)), only_b[:, 2]])
    missed = np.concatenate([impacts_b[j, 3], np.zeros(len(only_a)), only_b[:, 3]])
    scatter = np.sqrt(np.sum((impacts_a[i, 2] - impacts_b[j, 2]) ** 2) / max(TINY, np.sum(impacts_b[j, 2] ** 2)))
    error, peak = np.maximum(np.abs(peaks_a - peaks_b), scatter * peaks_b) + missed, float(peaks_b.max())
    largest = max(float((peaks_b + error).max()) - peak, peak - float((peaks_b - error).max()))
    shift = float(np.abs(impacts_a[i, 0] - impacts_b[j, 0]).max(initial=0.0))
    impulse = levy((a[0], impulse_a), (b[0], impulse_b), end, end / len(impacts_b))
    return {Norm.IMPULSE: impulse, Norm.PEAK: largest / peak, Norm.ONSET: shift / end}


def _find_impacts(time: Array, force: Array, end: float) -> tuple[Array, Array]:
    """Return onset [s], impulse [N s], peak and what samples miss of it [N] of contacts, (contacts, 4); the integral of force."""
    impulse, force = corrected_trapezoidal(time, force), np.where(time <= end, force, 0.0)
    edges = np.flatnonzero(np.diff(force > 0, prepend=False, append=False))
    if not len(edges):
        return np.empty((0, 4)), impulse
    first, after = edges[::2], np.minimum(edges[1::2], len(time) - 1)
    distinct = time[np.maximum(first[1:] - 1, 0)] - time[after[:-1]] > SPLIT * (time[after] - time[first])[:-1]
    first, after = first[np.append(True, distinct)], after[np.append(distinct, True)]
    spans = np.stack([first, after + 1], axis=1).ravel()
    peaks, tops = (np.maximum.reduceat(np.append(each, 0.0), spans)[::2] for each in (force, _find_tops(time, force)))
    return np.stack([time[first], impulse[after] - impulse[np.maximum(first - 1, 0)], peaks, tops - peaks], axis=1), impulse


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
