"""Statistics of columns over windows of time, accumulated during a run; compiled.

Between rows a column is taken as linear, and split at the edges of windows. Rows are close where contacts act. A maximum between
rows is that of the parabola through three of them. Total variation is that of samples at equal times.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ..geometry import Array
from .compiling import draft, inline, jit


class Statistic(IntEnum):
    """Statistics of a column in a window."""

    INTEGRAL = 0
    SQUARES = 1  # integral of its square
    ABOVE = 2  # time above zero [s]
    LARGEST = 3
    SMALLEST = 4
    ONSETS = 5  # how often it rises above zero
    LAST = 6  # value at the end of the window
    VARIATION = 7  # total variation


Between = IntEnum("Between", "T1 T2 ROWS DRAWN FIRST", start=0)
"""State between stretches: times of the last two rows, rows and samples so far; then values of these rows, and last samples."""
SAMPLES = 2000
"""Samples a window of which the total variation is taken, as a drawing of a turn shows it."""
OVERSHOOT = 0.125
"""Largest height of a vertex over the middle row, of the larger difference of the rows: that of equal steps. Where a short step
lies beside a long one the parabola of a kink has no bound.
"""


@dataclass(frozen=True)
class Accumulator:
    """Statistics accumulated so far."""

    edges: Array  # [s], (windows + 1,)
    found: Array  # (windows, columns, 8)
    state: Array  # (4 + 3 columns,)

    @classmethod
    def over(cls, edges: Array, columns: int) -> Accumulator:
        """Begin without rows."""
        found = np.zeros((len(edges) - 1, columns, len(Statistic)))
        found[..., Statistic.LARGEST], found[..., Statistic.SMALLEST], found[..., Statistic.LAST] = -np.inf, np.inf, np.nan
        return cls(edges, found, np.zeros(Between.FIRST + 3 * columns))

    def add(self, time: Array, values: Array) -> None:
        """Add the next rows, time (times,), values (times, columns)."""
        accumulate(time, values, self.edges, self.found, self.state)


@inline
def piece(at, h, a, b):
    """Add an interval of length h on which a column changes from a to b."""
    at[Statistic.INTEGRAL] += 0.5 * h * (a + b)
    at[Statistic.SQUARES] += h * (a * a + a * b + b * b) / 3.0
    if a > 0.0 and b > 0.0:
        at[Statistic.ABOVE] += h
    elif a > 0.0 or b > 0.0:  # half the interval if a force that is never negative begins or ends
        at[Statistic.ABOVE] += h * (max(a, b) / abs(a - b) if a * b < 0.0 else 0.5)
    if a <= 0.0 and b > 0.0:
        at[Statistic.ONSETS] += 1.0
    at[Statistic.LARGEST] = max(at[Statistic.LARGEST], max(a, b))
    at[Statistic.SMALLEST] = min(at[Statistic.SMALLEST], min(a, b))


@draft
def vertices(t, value, edges, found, state):
    """Update extremes by the vertex of the parabola through the last two rows and this one, if the middle one is an extreme."""
    columns, windows = value.size, edges.size - 1
    if state[Between.ROWS] < 2.0:
        return
    window = 0
    while window < windows - 1 and edges[window + 1] <= state[Between.T1]:
        window += 1
    if state[Between.T1] < edges[window] or state[Between.T1] > edges[windows]:
        return
    h1, h2 = state[Between.T1] - state[Between.T2], t - state[Between.T1]
    for c in range(columns):
        a, b, d = state[Between.FIRST + columns + c], state[Between.FIRST + c], value[c]
        if (b - a) * (d - b) < 0.0 and a * b * d != 0.0:  # a force has a kink where its contact opens
            s1, s2 = (b - a) / h1, (d - b) / h2
            bend = (s2 - s1) / (h1 + h2)
            slope = (s1 * h2 + s2 * h1) / (h1 + h2)
            height = min(slope * slope / (4.0 * abs(bend)), OVERSHOOT * max(abs(b - a), abs(d - b)))
            if bend < 0.0:
                found[window, c, Statistic.LARGEST] = max(found[window, c, Statistic.LARGEST], b + height)
            else:
                found[window, c, Statistic.SMALLEST] = min(found[window, c, Statistic.SMALLEST], b - height)


@draft
def draw(t, value, edges, found, state):
    """Add changes from sample to sample up to time t, between the last row and this one."""
    columns, windows = value.size, edges.size - 1
    while state[Between.DRAWN] <= windows * SAMPLES:
        k = int(state[Between.DRAWN])
        window = min(k // SAMPLES, windows - 1)
        at = edges[window] + (k - window * SAMPLES) * (edges[window + 1] - edges[window]) / SAMPLES
        if at > t:
            break
        share = (at - state[Between.T1]) / (t - state[Between.T1]) if state[Between.ROWS] > 0.0 else 1.0
        for c in range(columns):
            sample = value[c] - (1.0 - share) * (value[c] - state[Between.FIRST + c])
            if k > 0:
                found[(k - 1) // SAMPLES, c, Statistic.VARIATION] += abs(sample - state[Between.FIRST + 2 * columns + c])
            state[Between.FIRST + 2 * columns + c] = sample
        state[Between.DRAWN] += 1.0


@jit
def accumulate(time, values, edges, found, state):
    """Add rows to the statistics; those of equal time count once."""
    columns, windows = values.shape[1], edges.size - 1
    for i in range(time.size):
        t = time[i]
        if state[Between.ROWS] > 0.0:
            if not t > state[Between.T1]:
                continue
            window = 0
            while window < windows - 1 and edges[window + 1] <= state[Between.T1]:
                window += 1
            start = state[Between.T1]
            while start < t and window < windows:
                end = min(t, edges[window + 1]) if window < windows else t
                if end > start and start >= edges[window] - 1e-15 * t:
                    for c in range(columns):
                        before = state[Between.FIRST + c]
                        slope = (values[i, c] - before) / (t - state[Between.T1])
                        a, b = before + slope * (start - state[Between.T1]), before + slope * (end - state[Between.T1])
                        piece(found[window, c], end - start, a, b)
                        if end == edges[window + 1]:
                            found[window, c, Statistic.LAST] = b
                if end < edges[window + 1]:
                    break
                start = end
                window += 1
            vertices(t, values[i], edges, found, state)
        draw(t, values[i], edges, found, state)
        for c in range(columns):
            if state[Between.ROWS] == 0.0 and t >= edges[0]:
                found[0, c, Statistic.LARGEST] = found[0, c, Statistic.SMALLEST] = values[i, c]
            state[Between.FIRST + columns + c] = state[Between.FIRST + c]
            state[Between.FIRST + c] = values[i, c]
        state[Between.T2] = state[Between.T1]
        state[Between.T1] = t
        state[Between.ROWS] += 1.0
