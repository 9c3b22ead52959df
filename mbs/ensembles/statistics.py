"""Statistics of columns over windows of time, accumulated stretch by stretch.

Between rows a column is linear. Rows are close where contacts act. A maximum between rows is that of the parabola through three
of them. Total variation is that of samples at equal times.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry import Array

SUM, SQUARES, ABOVE, LARGEST, SMALLEST, ONSETS, LAST, VARIATION = range(8)
"""Statistics of a column in a window: integral, integral of its square, time above zero [s], maximum, minimum, onsets (it rises
above zero), value at the end of the window, total variation."""
COUNT = 8
"""Number of statistics."""
SAMPLES = 2000
"""Samples a window of which the total variation is taken, as a drawing of a turn shows it."""
OVERSHOOT = 0.125
"""Largest height of a vertex over the middle row, of the larger difference of the rows: that of equal steps. Where a short step
lies beside a long one the parabola of a kink has no bound.
"""


@dataclass
class Accumulator:
    """Statistics of a run in the making.

    Attributes
    ----------
    edges : array, shape (windows + 1,)
        s.
    found : array, shape (windows, columns, 8)
    time, values : arrays, shape (rows,), (rows, columns)
        The last two rows so far.
    drawn : array, shape (samples, columns)
        The last sample so far.
    samples : int
        Number of samples so far.
    """

    edges: Array
    found: Array
    time: Array
    values: Array
    drawn: Array
    samples: int = 0

    @classmethod
    def over(cls, edges: Array, columns: int) -> Accumulator:
        """Begin without rows."""
        found, none = np.zeros((len(edges) - 1, columns, COUNT)), np.empty((0, columns))
        found[..., LARGEST], found[..., SMALLEST], found[..., LAST] = -np.inf, np.inf, np.nan
        return cls(edges, found, np.empty(0), none, none)

    @cached_property
    def _grid(self) -> Array:
        """Times of all samples."""
        shares = np.arange(SAMPLES) / SAMPLES
        return np.append((self.edges[:-1, None] + np.diff(self.edges)[:, None] * shares).ravel(), self.edges[-1])

    def add(self, time: Array, values: Array) -> None:
        """Take over the next rows, time (times,), values (times, columns); of rows of equal time the first counts."""
        known = max(0, len(self.time) - 1)
        time, values = np.concatenate([self.time, time]), np.concatenate([self.values, values])
        later = np.append(True, time[1:] > np.maximum.accumulate(time)[:-1])
        time, values = time[later], values[later]
        self._add_pieces(time[known:], values[known:])
        self._add_vertices(time, values)
        self._draw(time[known:], values[known:])
        self.time, self.values = time[-2:], values[-2:]

    def _add_pieces(self, time: Array, values: Array) -> None:
        """Add straight lines from row to row, split at the edges of windows."""
        at = np.union1d(time, self.edges[(time[0] < self.edges) & (self.edges < time[-1])])
        window = np.searchsorted(self.edges, at[:-1], side="right") - 1
        inside = (window >= 0) & (window < len(self.found))
        values, window, h = _between(at, time, values), window[inside], np.diff(at)[inside, None]
        a, b = values[:-1][inside], values[1:][inside]
        # half of a line on which a contact, whose force is not negative, opens or closes
        share = np.where(a * b < 0.0, np.maximum(a, b) / np.maximum(np.abs(a - b), 1e-300), 0.5 * ((a > 0.0) ^ (b > 0.0)))
        self._put(SUM, np.add, window, 0.5 * h * (a + b))
        self._put(SQUARES, np.add, window, h * (a * a + a * b + b * b) / 3.0)
        self._put(ABOVE, np.add, window, h * np.where((a > 0.0) & (b > 0.0), 1.0, share))
        self._put(ONSETS, np.add, window, (a <= 0.0) & (b > 0.0))
        self._put(LARGEST, np.maximum, window, np.maximum(a, b))
        self._put(SMALLEST, np.minimum, window, np.minimum(a, b))
        last = at[1:][inside] == self.edges[window + 1]
        self.found[window[last], :, LAST] = b[last]

    def _add_vertices(self, time: Array, values: Array) -> None:
        """Take the vertices of parabolas through three rows each, where the middle one is an extreme."""
        a, b, d, t = values[:-2], values[1:-1], values[2:], time[1:-1]
        h1, h2 = np.diff(time)[:-1, None], np.diff(time)[1:, None]
        s1, s2 = (b - a) / h1, (d - b) / h2
        bend, slope = (s2 - s1) / (h1 + h2), (s1 * h2 + s2 * h1) / (h1 + h2)
        height = np.minimum(
            slope**2 / np.maximum(4.0 * np.abs(bend), 1e-300), OVERSHOOT * np.maximum(np.abs(b - a), np.abs(d - b))
        )
        # a force has a kink where its contact opens
        extreme = ((b - a) * (d - b) < 0.0) & (a * b * d != 0.0) & (self.edges[0] <= t)[:, None] & (t <= self.edges[-1])[:, None]
        window = np.clip(np.searchsorted(self.edges, t, side="right") - 1, 0, len(self.found) - 1)
        self._put(LARGEST, np.maximum, window, np.where(extreme & (bend < 0.0), b + height, -np.inf))
        self._put(SMALLEST, np.minimum, window, np.where(extreme & (bend >= 0.0), b - height, np.inf))

    def _draw(self, time: Array, values: Array) -> None:
        """Add changes from sample to sample up to the last row."""
        at = self._grid[self.samples : np.searchsorted(self._grid, time[-1], side="right")]
        drawn = np.concatenate([self.drawn, _between(at, time, values)])
        self.samples += len(at)
        window = np.arange(self.samples - len(drawn), self.samples - 1) // SAMPLES
        self._put(VARIATION, np.add, window, np.abs(np.diff(drawn, axis=0)))
        self.drawn = drawn[-1:]

    def _put(self, statistic: int, reduce: np.ufunc, window: Array, values: Array) -> None:
        """Reduce values (rows, columns) of windows in ascending order into a statistic."""
        if len(window):
            first = np.flatnonzero(np.diff(window, prepend=-1))
            at = self.found[window[first], :, statistic]
            self.found[window[first], :, statistic] = reduce(at, reduce.reduceat(values, first, axis=0))


def _between(at: Array, time: Array, values: Array) -> Array:
    """Values (times, columns) on straight lines between rows."""
    return np.column_stack([np.interp(at, time, column) for column in values.T])
