"""Statistics of signals over windows of time, accumulated during a run by the compiled function `add_rows`.

A column is a signal, a row the values of all signals at one time. Between rows a column is linear; intervals are split at the
edges of windows. Extremes also consider the vertex of the parabola through three rows. Total variation is that of samples at
equal distances.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from .compiling import copy, inline, jit, kernel_function
from .output import Record, blank, record_type


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


PROGRESS = record_type(last_time="f8", time_before="f8", rows="i8", samples="i8")
"""Times of the last row and of the row before [s]; numbers of rows and samples so far."""
SAMPLES_PER_WINDOW = 2000
"""Samples in a window from which the total variation is computed; chosen: a plot of one turn of a drive has as many points."""


class Accumulator(NamedTuple):
    """Statistics accumulated so far, and what the next row needs of the rows before."""

    edges: Array  # edges of windows [s], (windows + 1,)
    found: Array  # values of the statistics, (windows, columns, 8): the last axis is `Statistic`
    last: Array  # values of the last row, (columns,)
    before: Array  # values of the row before the last, (columns,)
    sample: Array  # values of the last sample, (columns,)
    progress: Record  # `PROGRESS`

    @classmethod
    def over(cls, edges: Array, columns: int) -> Accumulator:
        """Return an accumulator for so many columns, before any row is added."""
        found = np.zeros((len(edges) - 1, columns, len(Statistic)))
        found[..., Statistic.LARGEST], found[..., Statistic.SMALLEST], found[..., Statistic.LAST] = -np.inf, np.inf, np.nan
        return cls(edges, found, np.zeros(columns), np.zeros(columns), np.zeros(columns), blank(PROGRESS))


@inline
def find_window(edges, t):
    """Return the index of the window in which time t lies, of the first or last one if it lies outside."""
    window = 0
    while window < edges.size - 2 and edges[window + 1] <= t:
        window += 1
    return window


@kernel_function
def add_vertices(t, value, sums):
    """Update extremes by the vertex of the parabola through the last three rows, where the middle one is an extreme."""
    middle_time, window = sums.progress.last_time, find_window(sums.edges, sums.progress.last_time)
    is_in_window = sums.edges[0] <= middle_time <= sums.edges[-1]  # of any window
    if sums.progress.rows < 2 or not is_in_window:
        return
    h1, h2 = middle_time - sums.progress.time_before, t - middle_time
    for c in range(value.size):
        a, b, d, at = sums.before[c], sums.last[c], value[c], sums.found[window, c]
        if (b - a) * (d - b) < 0.0 and a * b * d != 0.0:  # not at 0: a force has a kink where its contact opens
            s1, s2 = (b - a) / h1, (d - b) / h2
            curvature = (s2 - s1) / (h1 + h2)  # half the second derivative
            slope = (s1 * h2 + s2 * h1) / (h1 + h2)  # at the middle row
            # cut at an eighth of the larger difference, the bound with equal steps: a short step beside a long one has none
            height = min(slope * slope / (4.0 * abs(curvature)), 0.125 * max(abs(b - a), abs(d - b)))
            if curvature < 0.0:
                at[Statistic.LARGEST] = max(at[Statistic.LARGEST], b + height)
            else:
                at[Statistic.SMALLEST] = min(at[Statistic.SMALLEST], b - height)


@kernel_function
def add_samples(t, value, sums):
    """Add the changes from sample to sample, up to this row at time t, to the total variation."""
    windows = sums.edges.size - 1
    while sums.progress.samples <= windows * SAMPLES_PER_WINDOW:
        k = sums.progress.samples
        window = min(k // SAMPLES_PER_WINDOW, windows - 1)
        length = sums.edges[window + 1] - sums.edges[window]
        at = sums.edges[window] + (k - window * SAMPLES_PER_WINDOW) * length / SAMPLES_PER_WINDOW
        if at > t:
            break
        fraction = 1.0  # of the interval from the last row to this one; samples before the first row have its values
        if sums.progress.rows > 0:
            fraction = (at - sums.progress.last_time) / (t - sums.progress.last_time)
        for c in range(value.size):
            sample = value[c] - (1.0 - fraction) * (value[c] - sums.last[c])
            if k > 0:
                sums.found[(k - 1) // SAMPLES_PER_WINDOW, c, Statistic.VARIATION] += abs(sample - sums.sample[c])
            sums.sample[c] = sample
        sums.progress.samples += 1


@kernel_function
def add_intervals(t, value, sums):
    """Add the interval from the last row to this one at time t, split at the edges of windows, to the statistics."""
    edges, last_time = sums.edges, sums.progress.last_time
    start, final = max(last_time, edges[0]), min(t, edges[edges.size - 1])
    window = find_window(edges, start)
    while start < final:
        end = min(t, edges[window + 1])
        for c in range(value.size):
            slope = (value[c] - sums.last[c]) / (t - last_time)
            at, h = sums.found[window, c], end - start
            a, b = sums.last[c] + slope * (start - last_time), sums.last[c] + slope * (end - last_time)  # at its ends
            at[Statistic.INTEGRAL] += 0.5 * h * (a + b)
            at[Statistic.SQUARES] += h * (a * a + a * b + b * b) / 3.0
            if a > 0.0 and b > 0.0:
                at[Statistic.ABOVE] += h
            elif a * b < 0.0:
                at[Statistic.ABOVE] += h * (max(a, b) / abs(a - b))
            elif a > 0.0 or b > 0.0:  # the other is 0: a force begins or ends somewhere in the interval
                at[Statistic.ABOVE] += h * 0.5
            if a <= 0.0 and b > 0.0:
                at[Statistic.ONSETS] += 1.0
            at[Statistic.LARGEST] = max(at[Statistic.LARGEST], max(a, b))
            at[Statistic.SMALLEST] = min(at[Statistic.SMALLEST], min(a, b))
            if end == edges[window + 1]:
                at[Statistic.LAST] = b
        start = end
        window += 1


@jit
def add_rows(time, values, sums):
    """Add rows, time (times,) [s] and values (times, columns), to an `Accumulator`; of rows with equal times the first counts."""
    for i in range(time.size):
        t, is_first = time[i], sums.progress.rows == 0
        if not is_first:
            if not t > sums.progress.last_time:
                continue
            add_intervals(t, values[i], sums)
            add_vertices(t, values[i], sums)
        elif t >= sums.edges[0]:  # a run may have no other row
            for c in range(values.shape[1]):
                sums.found[0, c, Statistic.LARGEST] = sums.found[0, c, Statistic.SMALLEST] = values[i, c]
        add_samples(t, values[i], sums)
        copy(sums.last, sums.before), copy(values[i], sums.last)
        sums.progress.time_before, sums.progress.last_time = sums.progress.last_time, t
        sums.progress.rows += 1
