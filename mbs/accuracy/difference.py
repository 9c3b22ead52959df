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
from .trajectory import FORCES, SMALL, STRAIGHT, TINY, Trajectory

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
        for key, off in found.items():
            size = self._sizes.setdefault(key, self.b.sizes.get(key, 1.0))
            self._found[key] = off / size if np.isfinite(off) else np.inf
        return self._found, self._sizes

    def _compare(self, names: list[str]) -> dict[Key, float]:
        """Compute norms of signals of both runs, in the signals' units."""
        straight = [name for name in names if self.b.signals[name].kind in STRAIGHT]
        others = [name for name in names if name not in straight]
        off = _values(self.a, straight, self.time) - _values(self.b, straight, self.time)
        found = self._means_and_peaks(straight, off, self.weights)
        if others:
            found |= self._compare_jumping(others)
        forces = [name for name in others if self.b.signals[name].kind in FORCES]
        if forces:
            self._add_impulses(found, forces)
        for name in forces:
            self._add_contact(found, name)
        return found

    def relative(self, names: list[str]) -> Array:
        """Return differences of signals over their sizes, shape (times, signals)."""
        off = np.abs(_values(self.a, names, self.time) - _values(self.b, names, self.time))
        return np.asarray(off / np.array([self.b.sizes[name, Norm.RMS] for name in names]))

    def _means_and_peaks(self, names: list[str], off: Array, weights: Array) -> dict[Key, float]:
        """Root mean squares and peaks of differences, of those for which a peak means anything."""
        means, peaks = np.sqrt(weights @ off**2 / self.end).tolist(), np.abs(off).max(axis=0, initial=0.0).tolist()
        found: dict[Key, float] = {(name, Norm.RMS): mean for name, mean in zip(names, means, strict=True)}
        no_peak = (Kind.ENERGY, Kind.RATE, Kind.ACCELERATION)
        return found | {
            (name, Norm.PEAK): peak for name, peak in zip(names, peaks, strict=True) if self.b.signals[name].kind not in no_peak
        }

    def _compare_jumping(self, names: list[str]) -> dict[Key, float]:
        """Compare what jumps at onsets and kinks, over a time in which onsets coincide, but for the samples next to them."""
        mine, theirs = self.onsets
        times = _merge_times((self.a.time, np.interp(self.b.time, theirs, mine), mine), self.end)
        other = np.interp(times, mine, theirs)
        jumps = np.append(mine[1:-1], [t for t in self.b.kinks if t < self.end])
        clear = _clear(times, self.a.time, jumps) & _clear(other, self.b.time, np.interp(jumps, mine, theirs))
        off = np.where(clear[:, None], _values(self.a, names, times) - _values(self.b, names, other), 0.0)
        return self._means_and_peaks(names, off, _trapezoid(times))

    def _add_impulses(self, found: dict[Key, float], names: list[str]) -> None:
        """Add max_t |int_0^t (a - b)| of forces, and as their sizes int |b|."""
        mine, theirs = (np.stack([run.signals[name].values for name in names]) for run in (self.a, self.b))
        first, second = corrected_trapezoidal(self.a.time, mine), corrected_trapezoidal(self.b.time, theirs)
        through = corrected_trapezoidal(self.b.time, np.abs(theirs))
        for name, one, other, passed in zip(names, first, second, through, strict=True):
            off = np.interp(self.time, self.a.time, one) - np.interp(self.time, self.b.time, other)
            found[name, Norm.IMPULSE] = float(np.abs(off).max())
            least = SMALL * self.b.sizes[name, Norm.RMS] * self.end
            self._sizes[name, Norm.IMPULSE] = max(float(np.interp(self.end, self.b.time, passed)), least)

    def _add_contact(self, found: dict[Key, float], name: str) -> None:
        """Replace the norms of a contact force by `contact_norms`, and add the force of contacts that both runs nearly make."""
        a, b = self.a.signals[name], self.b.signals[name]
        if b.kind is Kind.CONTACT and not b.group and b.unit == "N":
            apart = contact_norms((self.a.time, np.abs(a.values)), (self.b.time, np.abs(b.values)), self.end)
            self._sizes[name, Norm.ONSET] = self.end
            sizes = self._sizes | {(name, Norm.PEAK): self.b.sizes[name, Norm.PEAK]}
            found |= {(name, norm): off * sizes[name, norm] for norm, off in apart.items()}
        missed = self._possible_contact_force(a, b)
        if len(missed):
            found[name, Norm.RMS] += float(np.sqrt(self.weights @ missed**2 / self.end))
            found[name, Norm.IMPULSE] += float(self.weights @ missed)
            found[name, Norm.PEAK] += float(missed.max())

    @cached_property
    def onsets(self) -> Array:
        """Matched times of a and of b, shape (2, times): start, onsets near each other, end."""
        pairs = [(0.0, 0.0)]
        found = list[tuple[float, float]]()
        for name, signal in self.b.signals.items():
            if len(signal.onsets) and name in self.a.signals:
                mine, theirs = (x[x < self.end] for x in (self.a.signals[name].onsets, signal.onsets))
                i, j = match_times(mine, theirs)
                near = np.abs(mine[i] - theirs[j]) < NEAR * self.end
                found += zip(mine[i][near].tolist(), theirs[j][near].tolist(), strict=True)
        for one, other in sorted(found):
            if one > pairs[-1][0] and other > pairs[-1][1]:
                pairs.append((one, other))
        return np.array([*pairs, (self.end, self.end)]).T

    def _possible_contact_force(self, a: Signal, b: Signal) -> Array:
        """Return the force [N] of contacts that neither run makes, but that a depth deeper by the runs' difference would make."""
        if not len(b.depth):
            return np.empty(0)
        depths = [between(run.time, each.depth, None, self.time, smooth=True) for run, each in ((self.a, a), (self.b, b))]
        deeper = np.max(depths, axis=0) + np.abs(depths[0] - depths[1]).max()
        spell = np.cumsum(np.diff(deeper > 0, prepend=False))
        touching = np.unique(spell[np.max(depths, axis=0) > 0])
        return np.asarray(np.where(np.isin(spell, touching), 0.0, b.elastic(np.maximum(deeper, 0.0))))


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
        mine = [k for k, s in enumerate(signals) if (s.rate in run.signals) == known and (known or s.trait.smooth == smooth)]
        if mine:
            values = np.stack([signals[k].values[some] for k in mine], axis=1)
            rates = np.stack([run.signals[signals[k].rate].values[some] for k in mine], axis=1) if known else None
            found[:, mine] = between(run.time[some], values, rates, times, smooth)
    return found


def _clear(times: Array, samples: Array, jumps: Array) -> Array:
    """Return True at times that lie between the samples on both sides of a jump."""
    out, near = np.ones(len(times), dtype=bool), 1e-6 * float(samples[-1])
    last = np.minimum(np.searchsorted(samples, jumps - near), len(samples) - 1)
    first = np.maximum(np.searchsorted(samples, jumps + near, side="right") - 1, 0)
    for low, high in zip(samples[np.minimum(first, last)], samples[np.maximum(first, last)], strict=True):
        out[np.searchsorted(times, low) : np.searchsorted(times, high, side="right")] = False
    return out


def match_times(a: Array, b: Array) -> tuple[Array, Array]:
    """Return indices of the times of a and b that are each other's nearest; such pairs never cross."""
    if not len(a) or not len(b):
        return np.empty(0, int), np.empty(0, int)
    there, back = (np.searchsorted((x[1:] + x[:-1]) / 2, y) for x, y in ((b, a), (a, b)))
    mutual = back[there] == np.arange(len(a))
    return np.flatnonzero(mutual), there[mutual]


def contact_norms(a: tuple[Array, Array], b: tuple[Array, Array], end: float) -> dict[Norm, float]:
    """Compute relative differences of two contact forces, each (time, force >= 0), up to an end [s]: impulse, peak, onsets.

    The largest peak may belong to any impact whose own difference allows it. As the peaks of one impact may agree by chance,
    each differs at least by the relative root mean square of all. What the samples of b miss of a peak, by the parabola through
    three of them, is added. An impact of one run alone differs by its whole peak.
    """
    (mine, along), (theirs, other) = (_find_blows(*each, end) for each in (a, b))
    floor = GRAZE * max(each[:, 1].max(initial=0.0) for each in (mine, theirs))
    mine, theirs = mine[mine[:, 1] > floor], theirs[theirs[:, 1] > floor]
    if not len(mine) or not len(theirs):
        lonely = float(len(mine) != len(theirs))
        return {Norm.IMPULSE: lonely, Norm.PEAK: lonely, Norm.ONSET: lonely}
    i, j = match_times(mine[:, 0], theirs[:, 0])
    alone = np.delete(mine[:, 2], i), np.delete(theirs[:, 2], j)
    here = np.concatenate([mine[i, 2], alone[0], np.zeros(len(alone[1]))])
    there = np.concatenate([theirs[j, 2], np.zeros(len(alone[0])), alone[1]])
    off, peak = np.abs(here - there), float(there.max())
    scatter = np.sqrt(np.sum((mine[i, 2] - theirs[j, 2]) ** 2) / max(TINY, np.sum(theirs[j, 2] ** 2)))
    off = np.maximum(off, scatter * there) + np.concatenate([theirs[j, 3], np.zeros(len(alone[0])), np.delete(theirs[:, 3], j)])
    largest = max(float((there + off).max()) - peak, peak - float((there - off).max()))
    late = float(np.abs(mine[i, 0] - theirs[j, 0]).max(initial=0.0))
    impulse = levy((a[0], along), (b[0], other), end, end / len(theirs))
    return {Norm.IMPULSE: impulse, Norm.PEAK: largest / peak, Norm.ONSET: late / end}


def _find_blows(time: Array, force: Array, end: float) -> tuple[Array, Array]:
    """Return onset [s], impulse [N s], peak and what samples miss of it [N] of contacts, (contacts, 4); the integral of force."""
    area, force = corrected_trapezoidal(time, force), np.where(time <= end, force, 0.0)
    edges = np.flatnonzero(np.diff(force > 0, prepend=False, append=False))
    if not len(edges):
        return np.empty((0, 4)), area
    first, after = edges[::2], np.minimum(edges[1::2], len(time) - 1)
    apart = time[np.maximum(first[1:] - 1, 0)] - time[after[:-1]] > SPLIT * (time[after] - time[first])[:-1]
    first, after = first[np.append(True, apart)], after[np.append(apart, True)]
    spans = np.stack([first, after + 1], axis=1).ravel()
    peaks, tops = (np.maximum.reduceat(np.append(each, 0.0), spans)[::2] for each in (force, _find_tops(time, force)))
    return np.stack([time[first], area[after] - area[np.maximum(first - 1, 0)], peaks, tops - peaks], axis=1), area


def _find_tops(time: Array, force: Array) -> Array:
    """Return the force [N] with each local maximum of a contact replaced by that of the parabola through its three samples."""
    h, tops = np.diff(time), force.copy()
    before, after = np.diff(force)[:-1] / h[:-1], np.diff(force)[1:] / h[1:]
    bend, slope = (after - before) / (h[:-1] + h[1:]), (before * h[1:] + after * h[:-1]) / (h[:-1] + h[1:])
    top = (before >= 0) & (after <= 0) & (bend < 0) & (force[:-2] > 0) & (force[2:] > 0)
    tops[1:-1][top] -= slope[top] ** 2 / (4 * bend[top])
    return tops


def levy(a: tuple[Array, Array], b: tuple[Array, Array], end: float, unit: float) -> float:
    """Compute Levy's distance of two impulses: the least e with J_b(t - e unit) - e J <= J_a(t) <= J_b(t + e unit) + e J.

    J_a(t), J_b(t) are the impulses up to t, given with their times; J is J_b(end); `unit` is the mean time between contacts [s].
    The least e is found by bisection of its logarithm.
    """
    (time, along), (times, other) = a, b
    grid = np.append(time[time < end], end)
    along, whole = np.interp(grid, time, along), float(np.interp(end, times, other))
    low, high = -9.0, 0.0
    for _ in range(10):
        e = 10 ** ((low + high) / 2)
        least, most = (np.interp(np.minimum(grid + shift * unit, end), times, other) for shift in (-e, e))
        fits = bool(np.all((least - e * whole <= along) & (along <= most + e * whole)))
        low, high = (low, (low + high) / 2) if fits else ((low + high) / 2, high)
    return float(10**high)
