"""Statistics of signals over windows of time, accumulated during a run; compiled as parts of `accumulate`, which Python calls.

A column is a signal, a row the values of all signals at one time. Between rows a column is linear; intervals are split at the
edges of windows. Extremes also consider the vertex of the parabola through three rows. Total variation is that of samples at
equal distances.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from ..geometry import Array
from .compiling import inline, jit, kernel_function


class Statistic(IntEnum):
    """Statistics of a column in a window."""

    INTEGRAL = 0
    SQUARES = 1  # integral of the square
    ABOVE = 2  # time above zero [s]
    LARGEST = 3
    SMALLEST = 4
    ONSETS = 5  # number of rises above zero
    LAST = 6  # value at the end of the window
    VARIATION = 7  # total variation


StateIndex = IntEnum("StateIndex", "T1 T2 ROWS SAMPLES FIRST", start=0)
"""Indices of the state kept from call to call: times of the last row and of the row before, numbers of rows and samples so far.
From FIRST on follow the values of the last row, of the row before, and of the last sample, (columns,) each."""
SAMPLES_PER_WINDOW = 2000
"""Samples per window from which the total variation is computed: as many as a plot of one turn of a drive resolves."""
OVERSHOOT = 0.125
"""Bound of the height of a vertex above the middle row, over the larger difference of that row to a neighbour. With equal steps
and differences a and b the height is (a - b)^2/(8 (a + b)), at most an eighth of the larger. Where a short step lies beside a
long one, the vertex of a parabola through a kink has no bound."""


@dataclass(frozen=True)
class Accumulator:
    """Statistics accumulated so far."""

    edges: Array  # edges of windows [s], (windows + 1,)
    found: Array  # values of the statistics, (windows, columns, 8): the last axis is `Statistic`
    state: Array  # indices of `StateIndex`, (4 + 3 columns,)

    @classmethod
    def over(cls, edges: Array, columns: int) -> Accumulator:
        """Return an accumulator for so many columns, before any row is added."""
        found = np.zeros((len(edges) - 1, columns, len(Statistic)))
        found[..., Statistic.LARGEST], found[..., Statistic.SMALLEST], found[..., Statistic.LAST] = -np.inf, np.inf, np.nan
        return cls(edges, found, np.zeros(StateIndex.FIRST + 3 * columns))

    def add(self, time: Array, values: Array) -> None:
        """Add the next rows: time (times,) [s], values (times, columns)."""
        accumulate(time, values, self.edges, self.found, self.state)


@inline
def add_interval(at, h, a, b):
    """Add an interval of length h, on which a column goes linearly from a to b, to its statistics `at`, (8,)."""
    at[Statistic.INTEGRAL] += 0.5 * h * (a + b)
    at[Statistic.SQUARES] += h * (a * a + a * b + b * b) / 3.0
    if a > 0.0 and b > 0.0:
        at[Statistic.ABOVE] += h
    elif a > 0.0 or b > 0.0:  # if the other is 0 a force begins or ends, somewhere in the interval: half of it
        at[Statistic.ABOVE] += h * (max(a, b) / abs(a - b) if a * b < 0.0 else 0.5)
    if a <= 0.0 and b > 0.0:
        at[Statistic.ONSETS] += 1.0
    at[Statistic.LARGEST] = max(at[Statistic.LARGEST], max(a, b))
    at[Statistic.SMALLEST] = min(at[Statistic.SMALLEST], min(a, b))


@inline
def find_window(edges, t):
    """Return the index of the window in which time t lies, of the first or last one if it lies outside."""
    window = 0
    while window < edges.size - 2 and edges[window + 1] <= t:
        window += 1
    return window


@kernel_function
def add_vertices(t, value, edges, found, state):
    """Update extremes by the vertex of the parabola through the last three rows, where the middle one is an extreme."""
    columns, windows = value.size, edges.size - 1
    if state[StateIndex.ROWS] < 2.0:
        return
    window = find_window(edges, state[StateIndex.T1])
    if state[StateIndex.T1] < edges[window] or state[StateIndex.T1] > edges[windows]:
        return
    h1, h2 = state[StateIndex.T1] - state[StateIndex.T2], t - state[StateIndex.T1]
    for c in range(columns):
        a, b, d = state[StateIndex.FIRST + columns + c], state[StateIndex.FIRST + c], value[c]
        if (b - a) * (d - b) < 0.0 and a * b * d != 0.0:  # not at 0: a force has a kink where its contact opens
            s1, s2 = (b - a) / h1, (d - b) / h2
            curvature = (s2 - s1) / (h1 + h2)  # half the second derivative
            slope = (s1 * h2 + s2 * h1) / (h1 + h2)  # at the middle row
            height = min(slope * slope / (4.0 * abs(curvature)), OVERSHOOT * max(abs(b - a), abs(d - b)))
            if curvature < 0.0:
                found[window, c, Statistic.LARGEST] = max(found[window, c, Statistic.LARGEST], b + height)
            else:
                found[window, c, Statistic.SMALLEST] = min(found[window, c, Statistic.SMALLEST], b - height)


@kernel_function
def add_samples(t, value, edges, found, state):
    """Add the changes from sample to sample, up to this row at time t, to the total variation."""
    columns, windows = value.size, edges.size - 1
    while state[StateIndex.SAMPLES] <= windows * SAMPLES_PER_WINDOW:
        k = int(state[StateIndex.SAMPLES])
        window = min(k // SAMPLES_PER_WINDOW, windows - 1)
        length = edges[window + 1] - edges[window]
        at = edges[window] + (k - window * SAMPLES_PER_WINDOW) * length / SAMPLES_PER_WINDOW
        if at > t:
            break
        fraction = (at - state[StateIndex.T1]) / (t - state[StateIndex.T1]) if state[StateIndex.ROWS] > 0.0 else 1.0
        for c in range(columns):
            sample = value[c] - (1.0 - fraction) * (value[c] - state[StateIndex.FIRST + c])
            if k > 0:
                found[(k - 1) // SAMPLES_PER_WINDOW, c, Statistic.VARIATION] += abs(
                    sample - state[StateIndex.FIRST + 2 * columns + c]
                )
            state[StateIndex.FIRST + 2 * columns + c] = sample
        state[StateIndex.SAMPLES] += 1.0


@kernel_function
def add_intervals(t, value, edges, found, state):
    """Add the interval from the last row to this one at time t, split at the edges of windows, to the statistics."""
    last, columns = state[StateIndex.T1], value.size
    start, final = max(last, edges[0]), min(t, edges[edges.size - 1])
    window = find_window(edges, start)
    while start < final:
        end = min(t, edges[window + 1])
        for c in range(columns):
            before = state[StateIndex.FIRST + c]
            slope = (value[c] - before) / (t - last)
            a, b = before + slope * (start - last), before + slope * (end - last)
            add_interval(found[window, c], end - start, a, b)
            if end == edges[window + 1]:
                found[window, c, Statistic.LAST] = b
        start = end
        window += 1


@jit
def accumulate(time, values, edges, found, state):
    """Add rows, time (times,) and values (times, columns), to the statistics; of rows with equal times the first counts."""
    columns = values.shape[1]
    for i in range(time.size):
        t, is_first = time[i], state[StateIndex.ROWS] == 0.0
        if not is_first:
            if not t > state[StateIndex.T1]:
                continue
            add_intervals(t, values[i], edges, found, state)
            add_vertices(t, values[i], edges, found, state)
        add_samples(t, values[i], edges, found, state)
        for c in range(columns):
            if is_first and t >= edges[0]:  # a run may have no other row
                found[0, c, Statistic.LARGEST] = found[0, c, Statistic.SMALLEST] = values[i, c]
            state[StateIndex.FIRST + columns + c] = state[StateIndex.FIRST + c]
            state[StateIndex.FIRST + c] = values[i, c]
        state[StateIndex.T2] = state[StateIndex.T1]
        state[StateIndex.T1] = t
        state[StateIndex.ROWS] += 1.0
