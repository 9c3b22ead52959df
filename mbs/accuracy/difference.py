"""Difference of two runs of one mechanism, signal by signal, in norms that bound the errors of maxima, means and integrals.

Both runs are cubics between their samples and compared at the samples of both. Two maxima may agree by chance. A norm of the
difference of two functions does not, and bounds the difference of maxima, means and integrals:

    |rms a - rms b| <= rms(a - b),    |max a - max b| <= max|a - b|,    |int a - int b| <= max_t |int_0^t (a - b)|.

A contact that closes later in one run makes the forces differ by their whole size in between. So contact events of both runs,
closings and openings, are matched if each is the nearest of the other. The time axis of run b is stretched piecewise until they
coincide; kinks of drives stay where they are. Then forces and rates are compared. Normal forces of contacts are compared impact
by impact, see `impacts`.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property

import numpy as np

from ..elements.signal import Kind, Signal
from ..geometry import Array
from ..record.errors import Key, Norm
from ..record.lookup import Cubics, between, slopes
from .impacts import Impacts, compare_impacts, match_times
from .trajectory import CONTINUOUS, FORCE_KINDS, SMALL, TINY, Trajectory

BLOCK = 50_000
"""Most values that are compared at once, but one signal at least: they then stay in the processor's cache."""


class Difference:
    """Run a less run b, up to a time [s].

    Norms are relative to `sizes`, which has a size for each pair of signal and norm. Run b, the finer one, gives the sizes: those
    of `Trajectory` in the norms RMS and PEAK. A size in another norm is set when the norm is computed. The argument `grid` may be
    that of another difference with the same sample times and the same end; by default it is made here.
    """

    def __init__(self, a: Trajectory, b: Trajectory, until: float = np.inf, grid: "Grid | None" = None) -> None:
        self.end = max(min(float(a.time[-1]), float(b.time[-1]), until), TINY)
        self.a, self.b, self.sizes = a.until(self.end), b.until(self.end), dict(b.sizes)
        self.keys = [(name, norm) for name, signal in b.signals.items() if name in a.signals for norm in norms_of(signal)]
        matched = np.array([[0.0, self.end], [0.0, self.end]])  # start and end alone: times of both runs are the same
        self.grid = grid or Grid(self.a.time, self.b.time, matched)
        self._kinks = tuple(t for t in b.kinks if t < self.end)  # [s], of jumps and kinks of drives and loads, the same in both
        self._aligned = dict[tuple[float, ...], tuple[Grid, Array]]()  # grids and masks of `_align`, by kinks
        self._found = dict[Key, float]()

    def norms(self, keys: Iterable[Key] | None = None) -> tuple[dict[Key, float], dict[Key, float]]:
        """Return relative norms and their sizes, by default of all keys; keys of signals that the runs lack are left out."""
        wanted = set(self.keys if keys is None else keys)
        asked = [key for key in self.keys if key in wanted]
        with np.errstate(all="ignore"):
            for key, norm in self._compare([key for key in asked if key not in self._found]).items():
                self._found[key] = norm / max(self.sizes[key], TINY) if np.isfinite(norm) else np.inf
        return {key: self._found[key] for key in asked}, {key: self.sizes[key] for key in asked}

    def _compare(self, keys: list[Key]) -> dict[Key, float]:
        """Return norms in the signals' units."""
        signals = {name: self.b.signals[name] for name, _ in keys}
        norms = dict[Key, float]()
        if any(signal.kind in CONTINUOUS for signal in signals.values()):
            for names, difference in self._continuous:  # all of them at once
                norms |= self._means_and_peaks(names, difference, self.grid.weights)
            del self._continuous  # frees memory: later calls seldom need the differences, and would compute them again
        jumping = [key for key in keys if signals[key[0]].kind not in CONTINUOUS]
        normal = {name for name, _ in jumping if is_normal_force(signals[name])}
        by_impact = [name for name, norm in jumping if name in normal and norm is not Norm.RMS]
        over_time = [name for name, norm in jumping if norm is Norm.RMS or (norm is Norm.PEAK and name not in normal)]
        found = self._compare_over_time(dict.fromkeys(over_time))  # each name once, in order
        for name in dict.fromkeys(by_impact):
            found |= self._compare_impacts(name)
        for name, norm in jumping:
            if norm is Norm.IMPULSE and name not in normal:
                found |= self._compare_impulses(name)
        # the norm of a sum is at most the sum of the norms
        return norms | {(name, norm): found[name, norm] + self._possible_contact(name).get(norm, 0.0) for name, norm in jumping}

    @cached_property
    def _continuous(self) -> list[tuple[list[str], Array]]:
        """Continuous signals in groups: names, and differences (signals, times)."""
        signals = self.b.signals
        return list(self._subtract([n for n in signals if signals[n].kind in CONTINUOUS and n in self.a.signals], self.grid))

    def places(self) -> Iterator[tuple[list[str], Array]]:
        """Yield places of both runs in groups: names, and differences over their sizes, (places, times)."""
        for names, difference in self._continuous:
            some = [k for k, name in enumerate(names) if self.b.signals[name].kind is Kind.PLACE]
            if some:
                found = [names[k] for k in some]
                yield found, np.abs(difference[some]) / np.array([[self.sizes[name, Norm.RMS]] for name in found])

    def _subtract(self, names: Iterable[str], grid: "Grid") -> Iterator[tuple[list[str], Array]]:
        """Yield names and run a less run b, in groups alike in smoothness and in which runs recorded the rates."""
        a, b, groups = self.a.signals, self.b.signals, dict[tuple[bool, bool, bool], list[str]]()
        for name in names:  # `rate` names another signal; `smooth` chooses the `slopes` that replace rates not recorded
            groups.setdefault((a[name].rate in a, b[name].rate in b, b[name].trait.smooth), []).append(name)
        most = max(1, BLOCK // len(grid.times_a))
        for (has_rates_a, has_rates_b, smooth), group in groups.items():
            for some in (group[k : k + most] for k in range(0, len(group), most)):
                samples_a = _samples(self.a, some, has_rates_a, smooth)
                yield some, grid.subtract(*samples_a, *_samples(self.b, some, has_rates_b, smooth))

    def _means_and_peaks(self, names: list[str], difference: Array, weights: Array) -> dict[Key, float]:
        """Return root mean squares and peaks of differences, (signals, times)."""
        means = np.sqrt(difference**2 @ weights / self.end)
        peaks = np.maximum(difference.max(axis=1, initial=0.0), -difference.min(axis=1, initial=0.0))
        by_norm = {Norm.RMS: means.tolist(), Norm.PEAK: peaks.tolist()}
        return {(name, norm): value for norm, values in by_norm.items() for name, value in zip(names, values, strict=True)}

    def _align(self, kinks: Sequence[float]) -> "tuple[Grid, Array]":
        """Return a grid on which contact events and `kinks` coincide, and a mask of times, True next to a jump in either run."""
        events = self._match_events(kinks)
        grid = Grid(self.a.time, self.b.time, events)
        jumps_a, jumps_b = np.hstack([events[:, 1:-1], [self._kinks] * 2])  # kinks may occur twice, which does no harm
        is_next_in_a = _is_next_to_jump(grid.times_a, self.a.time, jumps_a)
        return grid, is_next_in_a | _is_next_to_jump(grid.times_b, self.b.time, jumps_b)

    def _compare_over_time(self, names: Iterable[str]) -> dict[Key, float]:
        """Compare signals that jump, with the times of b moved so that events coincide, and without the times next to jumps.

        For contact and friction forces only contact events coincide: a contact that is late in one run stays late after a kink.
        """
        found, groups = dict[Key, float](), dict[bool, list[str]]()
        for name in names:
            groups.setdefault(self.b.signals[name].kind in (Kind.CONTACT, Kind.FRICTION), []).append(name)
        for is_of_contact, group in groups.items():
            kinks = () if is_of_contact else self._kinks
            if kinks not in self._aligned:
                self._aligned[kinks] = self._align(kinks)
            grid, is_next_to_jump = self._aligned[kinks]
            for some, difference in self._subtract(group, grid):
                difference[:, is_next_to_jump] = 0.0
                found |= self._means_and_peaks(some, difference, grid.weights)
        return found

    def _compare_impulses(self, name: str) -> dict[Key, float]:
        """Return max_t |int_0^t (a - b)| of a force, and set its size, int |b|."""
        impulse_a, impulse_b = (np.interp(self.grid.times_a, run.time, run.integral(name)) for run in (self.a, self.b))
        self._set_impulse(name, float(np.interp(self.end, self.b.time, self.b.integral(name, np.abs))))
        return {(name, Norm.IMPULSE): float(np.abs(impulse_a - impulse_b).max())}

    def _compare_impacts(self, name: str) -> dict[Key, float]:
        """Return the differences of a contact's impulse [N s], peak [N] and onsets [s]."""
        a, b = (Impacts.of(run.time, np.abs(run.signals[name].values), self.end) for run in (self.a, self.b))
        self._set_impulse(name, float(np.interp(b.end, b.time, b.impulse)))
        self.sizes[name, Norm.ONSET] = self.end
        return {(name, norm): difference * self.sizes[name, norm] for norm, difference in compare_impacts(a, b).items()}

    def _set_impulse(self, name: str, impulse: float) -> None:
        """Set the size of the impulse of a force [N s], at least a hundredth (`SMALL`) of the force's size times the duration."""
        self.sizes[name, Norm.IMPULSE] = max(impulse, SMALL * self.sizes[name, Norm.RMS] * self.end)

    def _match_events(self, kinks: Sequence[float]) -> Array:
        """Return matched times of a and of b, shape (2, times): start, contact events near each other, `kinks` of both, end.

        Events farther from each other than 0.02 of the duration are not matched. A convention: twice `demand.PLACE_ERROR`.
        """
        pairs, found = [(0.0, 0.0)], [(t, t) for t in kinks]
        for name, signal in self.b.signals.items():
            if len(signal.contact_events) and name in self.a.signals:
                a, b = (x[x < self.end] for x in (self.a.signals[name].contact_events, signal.contact_events))
                i, j = match_times(a, b)
                near = np.abs(a[i] - b[j]) < 0.02 * self.end
                found += zip(a[i][near].tolist(), b[j][near].tolist(), strict=True)
        for time_a, time_b in sorted(found):
            if time_a > pairs[-1][0] and time_b > pairs[-1][1]:  # times of both must increase: a pair that crosses is left out
                pairs.append((time_a, time_b))
        return np.array([*pairs, (self.end, self.end)]).T

    def _possible_contact(self, name: str) -> dict[Norm, float]:
        """Return the norms of the force of a contact that neither run makes."""
        if not len(self.b.signals[name].depth):  # not the normal force of a contact
            return {}
        possible = self._possible_contact_force(self.a.signals[name], self.b.signals[name])
        mean = float(np.sqrt(self.grid.weights @ possible**2 / self.end))
        return {Norm.RMS: mean, Norm.IMPULSE: float(self.grid.weights @ possible), Norm.PEAK: float(possible.max())}

    def _possible_contact_force(self, a: Signal, b: Signal) -> Array:
        """Return the force [N] of contacts that the exact motion might have where neither run touches, (times,) of the grid.

        Depths are uncertain by their largest difference in the two runs, so that the possible depth is the larger one plus this.
        An interval of positive possible depth in which a run touches has no such force: the forces of the runs are compared. The
        elastic part of the contact law, `b.elastic`, gives the force at a depth, zero where the depth is not positive.
        """
        order, times = self.grid.order, self.grid.times_a
        depth_a = between(self.a.time, a.depth, None, times, smooth=True)[order]
        depth_b = between(self.b.time, b.depth, None, times, smooth=True)[order]
        larger = np.maximum(depth_a, depth_b)
        possible = larger + np.abs(depth_a - depth_b).max()
        interval = np.cumsum(np.diff(possible > 0, prepend=False))  # number of sign changes so far: one for each interval
        has_touch = np.isin(interval, interval[larger > 0])
        force = np.empty(len(order))
        force[order] = np.where(has_touch, 0.0, b.elastic(np.maximum(possible, 0.0)))
        return force


def norms_of(signal: Signal) -> tuple[Norm, ...]:
    """Return the norms in which a signal is compared; an energy only in RMS, as no other error of it is used."""
    if signal.kind is Kind.ENERGY:
        return (Norm.RMS,)
    impulse = (Norm.IMPULSE,) if signal.kind in FORCE_KINDS else ()
    return (Norm.RMS, Norm.PEAK, *impulse, *((Norm.ONSET,) if is_normal_force(signal) else ()))


def is_normal_force(signal: Signal) -> bool:
    """Return True for the normal force of a contact."""
    return signal.kind is Kind.CONTACT and not signal.group and signal.unit == "N"  # components have a group


def _is_next_to_jump(times: Array, samples: Array, jumps: Array) -> Array:
    """Return a mask of times, True from the sample before a jump to the one after it, or only at the samples at a jump."""
    near = 1e-6 * float(samples[-1])  # chosen: a jump this near to a sample [s] is at the sample
    up_to_jump, from_jump = np.searchsorted(samples, jumps + near, side="right") - 1, np.searchsorted(samples, jumps - near)
    # for a jump between two samples these are the two; for a jump at samples, the last and the first of these samples
    neighbours = samples[np.clip([up_to_jump, from_jump], 0, len(samples) - 1)]
    first, last = np.sort(neighbours.min(axis=0)), np.sort(neighbours.max(axis=0))
    # numbers of intervals begun by a time, and ended before it; it lies in an interval if more have begun, also if they overlap
    begun, ended = np.searchsorted(first, times, side="right"), np.searchsorted(last, times)
    return np.asarray(begun > ended)


def _samples(run: Trajectory, names: list[str], has_rates: bool, smooth: bool) -> tuple[Array, Array]:
    """Return signals and their rates at the samples of a run, each (signals, times); `has_rates` if rates are recorded."""
    values = np.stack([run.signals[name].values for name in names])
    if has_rates:
        return values, np.stack([run.signals[run.signals[name].rate].values for name in names])
    return values, slopes(run.time, values.T, smooth).T


class Grid:
    """Times at which runs a and b are compared: samples of a, then those of b, then times of `matched` events, (2, times).

    Time `times_a[k]` of a corresponds to `times_b[k]` of b. Between matched times those of b are moved linearly.
    """

    def __init__(self, time_a: Array, time_b: Array, matched: Array) -> None:
        matched_a, matched_b = matched
        # samples before the end, which is a matched time; 1e-12 is chosen, above the rounding of the end
        a, b = (time[time < end * (1 - 1e-12)] for time, end in zip((time_a, time_b), matched[:, -1], strict=True))
        b_in_a, a_in_b = np.interp(b, matched_b, matched_a), np.interp(a, matched_a, matched_b)
        self.times_a, self.times_b = np.concatenate([a, b_in_a, matched_a]), np.concatenate([a_in_b, b, matched_b])
        self.order = np.argsort(self.times_a, kind="stable")
        self._count_a, self._count_b = len(a), len(b)
        self._cubics_a = Cubics(time_a, np.append(b_in_a, matched_a))
        self._cubics_b = Cubics(time_b, np.append(a_in_b, matched_b))

    def subtract(self, a: Array, rates_a: Array, b: Array, rates_b: Array) -> Array:
        """Return run a less run b at all times, (signals, times), from values and rates at their samples."""
        n, m = self._count_a, self._count_b
        between_a = self._cubics_a(a, rates_a)  # run a at the m samples of b, then at the matched times
        between_b = self._cubics_b(b, rates_b)  # run b at the n samples of a, then at the matched times
        at_a, at_b, at_matched = a[:, :n] - between_b[:, :n], between_a[:, :m] - b[:, :m], between_a[:, m:] - between_b[:, n:]
        return np.concatenate([at_a, at_b, at_matched], axis=1)

    @cached_property
    def weights(self) -> Array:
        """Weights of the trapezoidal rule [s], (times,)."""
        steps, found = np.diff(self.times_a[self.order]), np.empty(len(self.times_a))
        found[self.order] = (np.append(steps, 0.0) + np.append(0.0, steps)) / 2
        return found
