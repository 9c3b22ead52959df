"""Difference of two runs of one mechanism, signal by signal, in norms that bound the errors of maxima, means and integrals.

Both runs are cubics between their samples and compared at the samples of both. Two maxima may agree by chance; a norm of the
difference of two functions does not, and bounds the difference of their maxima, means and integrals:

    |rms a - rms b| <= rms(a - b),    |max a - max b| <= max|a - b|,    |int a - int b| <= max_t |int_0^t (a - b)|.

A contact that begins later in one run makes the forces differ by their whole size in between. Onsets of both runs are matched if
each is the nearest of the other. Forces and rates are compared on a time scale on which matched onsets coincide; their shift is
the norm ONSET. Normal forces of contacts are compared impact by impact, see `impacts`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np

from ..elements.signal import Kind, Signal
from ..geometry import Array
from ..record.errors import Key, Norm
from ..record.lookup import Cubics, between, slopes
from .impacts import Impacts, compare_impacts, match_times
from .trajectory import CONTINUOUS, FORCES, SMALL, TINY, Trajectory

NEAR = 0.02
"""Largest shift of two onsets that belong together, over the run: twice the limit of places. Farther ones are two events."""
BLOCK = 50_000
"""Most values that are compared at once, but one signal at least: they then stay in the processor's cache."""


class Difference:
    """Run a less run b, up to a time [s]; b, the finer one, gives the sizes. Norms are computed once, when they are asked for."""

    def __init__(self, a: Trajectory, b: Trajectory, until: float = np.inf, grid: Grid | None = None) -> None:
        self.end = max(min(float(a.time[-1]), float(b.time[-1]), until), TINY)
        self.a, self.b, self.sizes = a.until(self.end), b.until(self.end), b.sizes
        self.keys = [(name, norm) for name, signal in b.signals.items() if name in a.signals for norm in norms_of(signal)]
        self.grid = grid or Grid(self.a.time, self.b.time, np.array([[0.0, self.end]] * 2))
        self._found, self._sizes = dict[Key, float](), dict[Key, float]()

    def norms(self, keys: Iterable[Key] | None = None) -> tuple[dict[Key, float], dict[Key, float]]:
        """Return relative norms, all by default, and the sizes to which they are relative."""
        wanted = set(self.keys if keys is None else keys)
        asked = [key for key in self.keys if key in wanted]
        with np.errstate(all="ignore"):
            for key, norm in self._compare([key for key in asked if key not in self._found]):
                size = self._sizes.setdefault(key, self.sizes.get(key, 1.0))
                self._found[key] = norm / size if np.isfinite(norm) else np.inf
        return {key: self._found[key] for key in asked}, {key: self._sizes[key] for key in asked}

    def _compare(self, keys: list[Key]) -> Iterator[tuple[Key, float]]:
        """Yield norms in the signals' units: of all continuous signals at once, of others those asked for."""
        signals = {name: self.b.signals[name] for name, _ in keys}
        if any(signal.kind in CONTINUOUS for signal in signals.values()):
            for names, difference in self._continuous:
                yield from self._means_and_peaks(names, difference, self.grid.weights).items()
            del self._continuous  # their norms are all known now
        jumping = [key for key in keys if signals[key[0]].kind not in CONTINUOUS]
        impulses = dict.fromkeys(name for name, norm in jumping if norm is Norm.IMPULSE)
        impacts = dict.fromkeys(name for name, norm in jumping if is_normal_force(signals[name]) and norm is not Norm.RMS)
        over_time = dict.fromkeys(n for n, norm in jumping if norm is Norm.RMS or (norm is Norm.PEAK and n not in impacts))
        found = self._compare_over_time(over_time)
        for name in impacts | impulses:
            found |= self._compare_impacts(name) if name in impacts else self._compare_impulses(name)
        for name, norm in jumping:
            yield (name, norm), found[name, norm] + self._possible_contact(name).get(norm, 0.0)

    @cached_property
    def _continuous(self) -> list[tuple[list[str], Array]]:
        """Continuous signals of both runs in groups: names, and differences of shape (signals, times)."""
        signals = self.b.signals
        return list(self._subtract([n for n in signals if signals[n].kind in CONTINUOUS and n in self.a.signals], self.grid))

    def places(self) -> Iterator[tuple[list[str], Array]]:
        """Yield places of both runs in groups: names, and differences over their sizes of shape (places, times)."""
        for names, difference in self._continuous:
            some = [k for k, name in enumerate(names) if self.b.signals[name].kind is Kind.PLACE]
            if some:
                found = [names[k] for k in some]
                yield found, np.abs(difference[some]) / np.array([[self.sizes[name, Norm.RMS]] for name in found])

    def _subtract(self, names: Iterable[str], grid: Grid) -> Iterator[tuple[list[str], Array]]:
        """Yield names and run a less run b, in groups alike in smoothness and in which runs recorded the rates."""
        a, b, groups = self.a.signals, self.b.signals, dict[tuple[bool, bool, bool], list[str]]()
        for name in names:
            groups.setdefault((a[name].rate in a, b[name].rate in b, b[name].trait.smooth), []).append(name)
        most = max(1, BLOCK // len(grid.a))
        for (known_a, known_b, smooth), group in groups.items():
            for some in (group[k : k + most] for k in range(0, len(group), most)):
                yield some, grid.subtract(*_samples(self.a, some, known_a, smooth), *_samples(self.b, some, known_b, smooth))

    def _means_and_peaks(self, names: list[str], difference: Array, weights: Array) -> dict[Key, float]:
        """Return root mean squares and peaks of differences, (signals, times)."""
        means = np.sqrt(difference**2 @ weights / self.end)
        peaks = np.maximum(difference.max(axis=1, initial=0.0), -difference.min(axis=1, initial=0.0))
        rms: dict[Key, float] = dict(zip([(name, Norm.RMS) for name in names], means.tolist(), strict=True))
        return rms | dict(zip([(name, Norm.PEAK) for name in names], peaks.tolist(), strict=True))

    @cached_property
    def _grid_of_onsets(self) -> tuple[Grid, Array]:
        """Grid on which matched onsets coincide, and True at its times between the samples before and after a jump."""
        onsets_a, onsets_b = self.onsets
        grid = Grid(self.a.time, self.b.time, self.onsets)
        jumps_a = np.append(onsets_a[1:-1], [t for t in self.b.kinks if t < self.end])
        jumps_b = np.interp(jumps_a, onsets_a, onsets_b)
        return grid, grid.find_jumps(grid.a, self.a.time, jumps_a) | grid.find_jumps(grid.b, self.b.time, jumps_b)

    def _compare_over_time(self, names: Iterable[str]) -> dict[Key, float]:
        """Compare signals that jump, with the times of b moved so that onsets coincide, and without the times next to jumps."""
        found = dict[Key, float]()
        for some, difference in self._subtract(names, self._grid_of_onsets[0]) if names else ():
            difference[:, self._grid_of_onsets[1]] = 0.0
            found |= self._means_and_peaks(some, difference, self._grid_of_onsets[0].weights)
        return found

    def _compare_impulses(self, name: str) -> dict[Key, float]:
        """Return max_t |int_0^t (a - b)| of a force, and set its size, int |b|."""
        impulse_a, impulse_b = (run.integral(name) for run in (self.a, self.b))
        difference = np.interp(self.grid.a, self.a.time, impulse_a) - np.interp(self.grid.a, self.b.time, impulse_b)
        self._set_impulse(name, float(np.interp(self.end, self.b.time, self.b.integral(name, np.abs))))
        return {(name, Norm.IMPULSE): float(np.abs(difference).max())}

    def _compare_impacts(self, name: str) -> dict[Key, float]:
        """Return the differences of a contact's impulse [N s], peak [N] and onsets [s]."""
        a, b = (Impacts.of(run.time, np.abs(run.signals[name].values), self.end) for run in (self.a, self.b))
        self._set_impulse(name, b.total)
        sizes = {Norm.IMPULSE: self._sizes[name, Norm.IMPULSE], Norm.PEAK: self.sizes[name, Norm.PEAK], Norm.ONSET: self.end}
        self._sizes[name, Norm.ONSET] = self.end
        return {(name, norm): difference * sizes[norm] for norm, difference in compare_impacts(a, b).items()}

    def _set_impulse(self, name: str, impulse: float) -> None:
        """Set the size of the impulse of a force [N s], at least a share of the force's size times the duration."""
        self._sizes[name, Norm.IMPULSE] = max(impulse, SMALL * self.sizes[name, Norm.RMS] * self.end)

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

    def _possible_contact(self, name: str) -> dict[Norm, float]:
        """Return the norms of the force of a contact that neither run makes."""
        possible = self._possible_contact_force(self.a.signals[name], self.b.signals[name])
        if not len(possible):
            return {}
        mean = float(np.sqrt(self.grid.weights @ possible**2 / self.end))
        return {Norm.RMS: mean, Norm.IMPULSE: float(self.grid.weights @ possible), Norm.PEAK: float(possible.max())}

    def _possible_contact_force(self, a: Signal, b: Signal) -> Array:
        """Return the force [N] at the larger depth plus the largest difference of depths, 0 in intervals where a run touches."""
        if not len(b.depth):
            return np.empty(0)
        depths = [between(run.time, each.depth, None, self.grid.a, smooth=True) for run, each in ((self.a, a), (self.b, b))]
        deeper, order = np.max(depths, axis=0) + np.abs(depths[0] - depths[1]).max(), self.grid.order
        interval = np.empty(len(order), int)  # number of the interval in which a contact is possible, or of the gap between two
        interval[order] = np.cumsum(np.diff(deeper[order] > 0, prepend=False))
        touching = np.unique(interval[np.max(depths, axis=0) > 0])
        return np.asarray(np.where(np.isin(interval, touching), 0.0, b.elastic(np.maximum(deeper, 0.0))))


def norms_of(signal: Signal) -> tuple[Norm, ...]:
    """Return the norms in which a signal is compared; energies are sums over the whole run and have no peak."""
    if signal.kind is Kind.ENERGY:
        return (Norm.RMS,)
    impulse = (Norm.IMPULSE,) if signal.kind in FORCES else ()
    return (Norm.RMS, Norm.PEAK, *impulse, *((Norm.ONSET,) if is_normal_force(signal) else ()))


def is_normal_force(signal: Signal) -> bool:
    """Return True for the normal force of a contact."""
    return signal.kind is Kind.CONTACT and not signal.group and signal.unit == "N"  # components have a group


def _samples(run: Trajectory, names: list[str], known: bool, smooth: bool) -> tuple[Array, Array]:
    """Return signals and their rates at the samples of a run, each (signals, times); `known` if rates are recorded."""
    values = np.stack([run.signals[name].values for name in names])
    if known:
        return values, np.stack([run.signals[run.signals[name].rate].values for name in names])
    return values, slopes(run.time, values.T, smooth).T


class Grid:
    """Times at which runs a and b are compared: at the samples of a, then those of b, then the matched times.

    Matched times, (2, times), are those at which a and b have the same event; between them, times of b are moved linearly.
    """

    def __init__(self, time_a: Array, time_b: Array, matched: Array) -> None:
        matched_a, matched_b = matched
        a, b = (time[time < end * (1 - 1e-12)] for time, end in zip((time_a, time_b), matched[:, -1], strict=True))
        self.a = np.concatenate([a, np.interp(b, matched_b, matched_a), matched_a])
        self.b = np.concatenate([np.interp(a, matched_a, matched_b), b, matched_b])
        self.counts = n, m = len(a), len(b)
        self.order = np.argsort(self.a, kind="stable")
        self._cubics_a, self._cubics_b = Cubics(time_a, self.a[n:]), Cubics(time_b, np.append(self.b[:n], self.b[n + m :]))

    def subtract(self, a: Array, rates_a: Array, b: Array, rates_b: Array) -> Array:
        """Return run a less run b at all times, (signals, times), from values and rates at their samples."""
        (n, m), between_a, between_b = self.counts, self._cubics_a(a, rates_a), self._cubics_b(b, rates_b)
        at_a, at_b, others = a[:, :n] - between_b[:, :n], between_a[:, :m] - b[:, :m], between_a[:, m:] - between_b[:, n:]
        return np.concatenate([at_a, at_b, others], axis=1)

    @cached_property
    def weights(self) -> Array:
        """Weights of the trapezoidal rule."""
        steps, found = np.diff(self.a[self.order]), np.empty(len(self.a))
        found[self.order] = (np.append(steps, 0.0) + np.append(0.0, steps)) / 2
        return found

    def find_jumps(self, times: Array, samples: Array, jumps: Array) -> Array:
        """Return True where the grid's times in one run lie from the sample before a jump [s] to the one after it."""
        near, times = 1e-6 * float(samples[-1]), times[self.order]
        last = np.minimum(np.searchsorted(samples, jumps - near), len(samples) - 1)
        first = np.maximum(np.searchsorted(samples, jumps + near, side="right") - 1, 0)
        count, found = np.zeros(len(times) + 1, int), np.empty(len(times), bool)
        np.add.at(count, np.searchsorted(times, samples[np.minimum(first, last)]), 1)
        np.add.at(count, np.searchsorted(times, samples[np.maximum(first, last)], side="right"), -1)
        found[self.order] = np.cumsum(count[:-1]) > 0
        return found
