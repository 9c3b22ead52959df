"""Signal over a run as a curve, linear (`Curve`) or cubic (`Smooth`) between its samples, with the functions of formulas.

At a jump, as at an impact, a signal has two samples of almost one time.
"""

from dataclasses import dataclass
from functools import cached_property
from math import nan

import numpy as np
from numpy.polynomial import Polynomial

from ..geometry import Array


def positive_ranges(x: Array) -> Array:
    """Return index ranges of consecutive samples above zero, shape (ranges, 2): first sample, and one past the last."""
    above = np.concatenate([[False], x > 0, [False]])
    return np.flatnonzero(above[1:] != above[:-1]).reshape(-1, 2)


@dataclass(frozen=True)
class Curve:
    """Signal with samples `x` at times [s], linear between them; formulas of readings call its public methods by name.

    A `count` is an ordinal number, 1, 2, ..., a float as all numbers of formulas. Where a method allows it, -1 is the last.
    """

    time: Array
    x: Array

    def impulse(self) -> float:
        """Return the integral over the run."""
        return float(np.trapezoid(self.x, self.time))

    def max(self) -> float:
        """Return the largest sample."""
        return float(np.max(self.x))

    def at(self, when: float) -> float:
        """Return the value at a time [s]."""
        return float(np.interp(when, self.time, self.x))

    def when(self, value: float, count: float) -> float:
        """Return the time of the `count`-th crossing of a value [s]; nan if there is none."""
        is_below = self.x < value
        crossings = np.flatnonzero(is_below[:-1] != is_below[1:])
        if not 1 <= count <= len(crossings):
            return nan
        return self._root(int(crossings[int(count) - 1]), value)

    def begins(self, count: float) -> float:
        """Return the start of the `count`-th interval above zero [s], -1 the last; nan if there is none."""
        samples = self._positive_range(count)
        return nan if samples is None else self._edge(samples.start, 1)

    def ends(self, count: float) -> float:
        """Return the end of the `count`-th interval above zero [s], -1 the last; nan if there is none."""
        samples = self._positive_range(count)
        return nan if samples is None else self._edge(samples.stop - 1, -1)

    def peak(self, count: float) -> float:
        """Return the largest value in the `count`-th interval above zero, -1 the last; nan if there is none."""
        samples = self._positive_range(count)
        return nan if samples is None else type(self)(self.time[samples], self.x[samples]).max()

    def _positive_range(self, count: float) -> slice | None:
        """Return the samples of the `count`-th interval above zero, with the sample before and the one after it, if any."""
        ranges = positive_ranges(self.x)
        k = int(count) - 1 if count > 0 else len(ranges) + int(count)
        if not 0 <= k < len(ranges):
            return None
        first, end = map(int, ranges[k])
        return slice(max(0, first - 1), min(len(self.x), end + 1))

    def _edge(self, k: int, step: int) -> float:
        """Return the time of sample k, the first outside an interval above zero or, at an end of the run, inside."""
        return float(self.time[k])

    def _root(self, k: int, value: float) -> float:
        """Return the time at which the curve has a value between the samples k and k + 1."""
        fraction = (value - self.x[k]) / (self.x[k + 1] - self.x[k])
        return float(self.time[k] + fraction * (self.time[k + 1] - self.time[k]))

    def min(self) -> float:
        """Return the least value."""
        return -type(self)(self.time, -self.x).max()

    def mean(self) -> float:
        """Return the mean over time."""
        span = float(self.time[-1] - self.time[0])
        return self.impulse() / span if span > 0 else float(self.x[-1])

    def rms(self) -> float:
        """Return the root mean square over time."""
        return float(type(self)(self.time, self.x**2).mean() ** 0.5)

    def settled(self) -> float:
        """Return the mean over the last tenth of the run."""
        first = self.time[-1] - 0.1 * (self.time[-1] - self.time[0])
        is_late = self.time > first
        times = np.concatenate([[first], self.time[is_late]])
        return type(self)(times, np.concatenate([[self.at(float(first))], self.x[is_late]])).mean()

    def start(self) -> float:
        """Return the first value."""
        return float(self.x[0])

    def end(self) -> float:
        """Return the last value."""
        return float(self.x[-1])


class Smooth(Curve):
    """Signal with cubic Hermite polynomials between its samples, so that readings depend smoothly on the samples."""

    @cached_property
    def slopes(self) -> Array:
        """Slopes at the samples, shape (samples,)."""
        return self._slopes(np.arange(len(self.time)))

    @cached_property
    def _pieces(self) -> Array:
        """Index of the first sample of each piece between jumps; at the end the number of samples."""
        intervals = np.diff(self.time)
        shorter = np.minimum(np.append(np.inf, intervals[:-1]), np.append(intervals[1:], np.inf))
        is_instant = intervals < 1e-11 * self.time[-1]  # far above rounding, far below a step
        jumps = np.flatnonzero(is_instant | (intervals < 1e-3 * shorter)) + 1  # 1e-3 of both intervals beside it: chosen
        return np.array([0, *jumps, len(self.time)])

    def _slopes(self, k: Array) -> Array:
        """Compute slopes at samples k, to fourth order by the five nearest samples, or by all samples of a shorter piece."""
        piece = np.searchsorted(self._pieces, k, side="right") - 1
        first, end, slopes = self._pieces[piece], self._pieces[piece + 1], np.zeros(len(k))
        size = np.minimum(end - first, 5)
        for m in {*size.tolist()} - {1}:  # polynomials through m samples, all at once; a piece of one sample has the slope 0
            of_size = size == m
            nearest = np.clip(k[of_size] - m // 2, first[of_size], end[of_size] - m)[:, None] + np.arange(m)
            offset = self.time[nearest] - self.time[k[of_size], None]
            scale = np.abs(offset).max(axis=1)
            powers = (offset / scale[:, None])[:, :, None] ** np.arange(m)
            slopes[of_size] = np.linalg.solve(powers, self.x[nearest][:, :, None])[:, 1, 0] / scale
        return slopes

    def impulse(self) -> float:
        """Return the integral of the cubics."""
        h = np.diff(self.time)
        return super().impulse() + float(h**2 @ (self.slopes[:-1] - self.slopes[1:])) / 12

    def max(self) -> float:
        """Return the maximum of the two cubics that meet at the largest sample."""
        k = int(np.argmax(self.x))
        best = float(self.x[k])
        for i in range(max(0, k - 1), min(k + 1, len(self.x) - 1)):
            cubic = self._cubic(i)
            best = max([best, *map(float, cubic(_roots_in_interval(cubic.deriv())))])
        return best

    def at(self, when: float) -> float:
        """Return the value at a time [s]."""
        k = int(np.clip(np.searchsorted(self.time, when, side="right") - 1, 0, len(self.time) - 2))
        return float(self._cubic(k)((when - self.time[k]) / (self.time[k + 1] - self.time[k])))

    def _root(self, k: int, value: float) -> float:
        from scipy.optimize import brentq  # slow to load

        cubic = self._cubic(k)
        fraction = brentq(lambda y: float(cubic(y)) - value, 0.0, 1.0, xtol=1e-15)
        return float(self.time[k] + fraction * (self.time[k + 1] - self.time[k]))

    def _edge(self, k: int, step: int) -> float:
        """Return the time at which an interval above zero begins (`step` = 1) or ends (-1); k is the next sample outside.

        For a signal that is negative outside it is a root of the cubic. For one that is exactly zero outside, such as a contact
        force, it is a root of the parabola through the three nearest samples inside. At a jump, at an end of the run and for
        fewer samples inside, it is the time of a sample.
        """
        after_jumps = self._pieces[1:-1]
        for i in (k, k + step):  # the sample outside, and the first or last one inside
            if i in after_jumps or i + 1 in after_jumps:  # both samples of a jump have almost the same time
                return float(self.time[i])
        inside = [k + step, k + 2 * step, k + 3 * step]
        is_end_of_run = self.x[k] > 0  # no sample lies outside
        if is_end_of_run or not 0 <= inside[-1] < len(self.x) or (self.x[inside] == 0).any():
            return float(self.time[k])
        if self.x[k] < 0:
            return self._root(min(k, k + step), 0.0)
        interval = self.time[inside[0]] - self.time[k]
        parabola = Polynomial(np.polyfit((self.time[inside] - self.time[k]) / interval, self.x[inside], 2)[::-1])
        fraction = _roots_in_interval(parabola).max(initial=0.0)  # the root nearest to the samples inside, or else sample k
        return float(self.time[k] + fraction * interval)

    def _cubic(self, k: int) -> Polynomial:
        """Return the cubic between samples k and k + 1 over the fraction of the interval, 0 to 1."""
        h, step = self.time[k + 1] - self.time[k], self.x[k + 1] - self.x[k]
        before, after = h * self._slopes(np.array([k, k + 1]))
        return Polynomial([self.x[k], before, 3 * step - 2 * before - after, before + after - 2 * step])


def _roots_in_interval(polynomial: Polynomial) -> Array:
    """Return the real roots from 0 to 1."""
    roots = polynomial.roots()
    return np.asarray(roots.real[(np.abs(roots.imag) < 1e-12) & (roots.real >= 0) & (roots.real <= 1)])
