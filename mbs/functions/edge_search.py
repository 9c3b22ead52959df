"""Edges of a function of time, found by sampling: jumps, kinks and quick changes, on which steps of a run shall end.

The function is sampled at each `WIDTH` of the run. A second difference that is much larger than its neighbours is a jump or a
kink. Bisection locates it. The intervals between jumps and kinks are halved until polynomials fit the pieces, as in R. Pachon,
R. B. Platte, L. N. Trefethen, Piecewise-smooth chebfuns, IMA J. Numer. Anal. 30 (2010) 898, doi 10.1093/imanum/drp008. The ends
of pieces shorter than `PIECE` samples are quick changes. Jumps that a periodic series of jumps lacks are added.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import reduce
from itertools import chain, islice, pairwise
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..laws.compiled import evaluate_compiled

WIDTH = 1e-5
"""Distance of samples, over the duration: 1e5 calls take some 20 ms. A single pulse that is shorter may be missed."""
PIECE = 500
"""Length of a piece [samples], 1/200 of a run, above which any run resolves the piece without a step on its end."""
MOST = 20_000
"""Most jumps and kinks that are located; the search then costs less than a tenth of a run that steps on them."""
MOST_SMOOTH = 2000
"""Most quick changes on which steps end: with more of them, error control resolves the function anyway."""
REACHES = (6, 9)
"""Distances of neighbours [samples] with which a second difference is compared, each with the next nearer one; chosen. The
distance with the smaller neighbours counts, as another edge spoils one of the two only."""
FEWEST = 4
"""Least number of sample intervals of a piece, and of samples for each degree of its polynomial."""
MISFIT = 1e-3
"""Largest error of a polynomial, relative to the range of the function. It also limits the error times the samples of the piece,
relative to the sum of |value - median| over all samples: a short pulse in an otherwise constant function is resolved, too."""
HALVINGS = 60
"""Number of halvings of an interval, down to neighbouring floats."""
ROUNDING = 1e-12
"""Relative difference of equal values, and of equal times over the run."""
JUMP_ERROR = 2e-9
"""Half width, over the duration, of the interval in which a jump is located that a period predicts or the user names.

It is more than the rounding of thousands of periods. A tenfold width could hold the next jump as well."""
RECURRING = 20
"""Least number of jumps, half of them upwards, from which a period is detected; largest number of jumps in a period; chosen."""

Values = Callable[[Array], Array]
"""Function from times (times,) [s] to values (times, components)."""


class Edges(NamedTuple):
    """Times [s] of edges, in order; `capped` is True if quick changes or jumps were left out as there were too many."""

    times: tuple[float, ...] = ()
    capped: bool = False


def find_edges_in_time(function: Callable[..., object], duration: float) -> Edges:
    """Find the edges of a function of time in (0, duration) [s], with all other arguments zero, by `find_edges`."""
    return find_edges(lambda times: evaluate(function, times, *[np.zeros_like(times)] * count_others(function)), duration)


def find_edges_between(low: float, high: float, values_at: Values, width: float = WIDTH) -> Array:
    """Find the edges of a function of another variable than time in (low, high), as `find_edges` finds times from 0 on."""
    return low + np.array(find_edges(lambda x: values_at(low + x), high - low, width).times)


def find_edges(values_at: Values, duration: float, width: float = WIDTH) -> Edges:
    """Find the edges in (0, duration) [s] of a function of times, sampled `width` times the duration apart; none if it fails."""
    with suppress(Exception, SystemExit):  # a function may raise anything: the run reports it
        times = np.linspace(0.0, duration, round(1 / width) + 1)
        values = values_at(times)
        span = float(np.ptp(values, axis=0).max(initial=0.0))
        if not np.isfinite(values).all() or span == 0:
            return Edges()
        scaled = values / span
        outstanding = _find_outstanding(scaled)
        if len(outstanding) > MOST:
            return Edges(capped=True)
        sudden = _complete_periodic(values_at, _locate(values_at, times, values, outstanding), duration)
        edges = [0, *np.unique(np.searchsorted(times, sudden)).tolist(), len(times) - 1]  # first samples at or after edges
        deviation = np.abs(values - np.median(values, axis=0)).sum(axis=0).max() / span  # summed over all samples
        quick = (times[k] for a, b in pairwise(edges) for k in _find_quick_changes(scaled, a, b, MISFIT * deviation))
        quick_times = [float(t) for t in islice(quick, MOST_SMOOTH + 1)]
        capped = len(quick_times) > MOST_SMOOTH
        found = sorted({*sudden.tolist(), *([] if capped else quick_times)})
        return Edges(tuple(t for t in found if 0 < t < duration), capped)
    return Edges()


def evaluate(function: Callable[..., object], *columns: Array) -> Array:
    """Evaluate a function for columns of arguments (times,), as (times, components).

    Three ways are tried in this order: machine code of an earlier run, one call with arrays, and a call for each row. The call
    with arrays counts if some seven single calls agree.
    """
    count = len(columns[0])
    if (compiled := evaluate_compiled(function, columns)) is not None:
        return compiled.reshape(count, -1)
    if count >= 64:  # many more than the single calls that check the one with arrays
        some = slice(None, None, count // 7)  # seven rows or a few more
        single = np.array([function(*each) for each in zip(*(c[some].tolist() for c in columns), strict=True)], dtype=float)
        try:
            found = np.asarray(function(*columns), dtype=float).T  # (times, components), or a constant without times
            values = np.broadcast_to(found, (count, *single.shape[1:]))
            if np.allclose(values[some], single, rtol=ROUNDING, atol=ROUNDING * np.abs(single).max()):
                return values.reshape(count, -1)
        except (Exception, SystemExit):  # the function accepts numbers only
            pass
    return np.array(list(map(function, *(c.tolist() for c in columns))), dtype=float).reshape(count, -1)


def count_others(function: Callable[..., object]) -> int:
    """Count the arguments of a function in addition to the time, by trial calls with zeros."""
    for others in range(20):  # no function has more
        try:
            function(0.0, *[0.0] * others)
        except (TypeError, ValueError):
            continue
        return others
    raise ValueError("no function of time and others")


def _find_outstanding(values: Array) -> Array:
    """Find the samples whose second difference is much larger than at the neighbours at `REACHES`."""
    second = reduce(np.maximum, np.abs(np.diff(values, 2, axis=0)).T)  # of all components; max(axis=1) takes 40 times as long
    pad = max(REACHES)
    padded = np.pad(second, pad, mode="edge")  # neighbours of the first and last samples

    def largest(*shifts: int) -> Array:
        """Return the largest second difference at given shifts [samples] from each sample."""
        return np.asarray(reduce(np.maximum, (padded[pad + k : pad + k + len(second)] for k in shifts)))

    neighbours = np.min([largest(-reach, 1 - reach, reach - 1, reach) for reach in REACHES], axis=0)
    is_largest_near = second >= largest(*range(-2, 3))
    # 30 is chosen; a larger number misses weaker kinks
    outstanding = (second > 30.0 * np.maximum(neighbours, ROUNDING)) & is_largest_near
    return np.flatnonzero(outstanding) + 1


def _locate(values_at: Values, times: Array, values: Array, samples: Array) -> Array:
    """Locate the jumps in the two intervals beside each sample, or else the kink there: times [s], in order."""
    if not len(samples):
        return np.empty(0)
    first = np.concatenate([samples - 1, samples])
    jumps, is_jump = _bisect(values_at, times[first], times[first + 1], values[first], values[first + 1])
    kinked = samples[~is_jump.reshape(2, -1).any(axis=0)]
    return np.unique(np.concatenate([jumps[is_jump], _locate_kinks(values_at, times[kinked - 1], times[kinked + 1])]))


def _bisect(values_at: Values, start: Array, end: Array, before: Array, after: Array) -> tuple[Array, Array]:
    """Locate the last times before jumps by bisection; return them, and a mask of the times with a jump.

    A step that ends at such a time evaluates the function before the jump only. There is a jump where a tenth or
    more of the first difference of values is left at the end; at a kink the difference vanishes with the interval.
    """
    initial = np.abs(after - before).max(axis=1)
    for _ in range(HALVINGS):
        middle = (start + end) / 2
        if not ((start < middle) & (middle < end)).any():
            break
        value = values_at(middle)
        in_first_half = np.abs(value - before).max(axis=1) > np.abs(after - value).max(axis=1)
        start, end = np.where(in_first_half, start, middle), np.where(in_first_half, middle, end)
        before, after = np.where(in_first_half[:, None], before, value), np.where(in_first_half[:, None], value, after)
    return start, np.abs(after - before).max(axis=1) > np.maximum(0.1 * initial, 1e-300)  # 1e-300: no change, no jump


def _locate_kinks(values_at: Values, start: Array, end: Array) -> Array:
    """Locate kinks, up to the rounding of values, by repeated halving: keep the half with the largest second difference."""
    for _ in range(HALVINGS if len(start) else 0):
        middle = (start + end) / 2
        if not ((start < middle) & (middle < end)).any():
            break
        quarters = np.linspace(start, end, 5, axis=1)
        second = np.abs(np.diff(values_at(quarters.ravel()).reshape(len(start), 5, -1), 2, axis=1)).max(axis=2)
        half, each = np.argmax(second, axis=1), np.arange(len(start))
        start, end = quarters[each, half], quarters[each, half + 2]
    return end  # equal to start up to rounding


def _complete_periodic(values_at: Values, jumps: Array, duration: float) -> Array:
    """Add missing jumps to periodic jumps (times,) [s], as pulses shorter than `WIDTH` may lie between samples.

    The period is the median distance of upward jumps, refined by their mean distance. Phases are times of jumps in a period.
    Two times count as one if they round to the same multiple of `same`. The rounding, at most half of `same`, leaves the jump
    within the interval in which `sharpen` searches.
    """
    if len(jumps) < RECURRING:
        return jumps
    same = JUMP_ERROR * duration / 2
    sizes = values_at(np.minimum(jumps + same, duration)) - values_at(np.maximum(jumps - same, 0.0))
    up = jumps[sizes[:, np.abs(sizes).max(axis=0).argmax()] > 0]  # upward in the component with the largest jump
    if len(up) < RECURRING / 2:
        return jumps
    whole = float(np.ptp(up))
    count = max(1, round(whole / float(np.median(np.diff(up)))))  # of periods from the first to the last upward jump
    period = whole / count
    phases = np.unique(np.round((jumps % period) / same) * same)
    if not period > 0 or len(phases) > RECURRING or len(phases) * duration / period > MOST:
        return jumps
    predicted = (np.arange(np.ceil(duration / period) + 1)[:, None] * period + phases).ravel()
    missing = predicted[~np.isin(np.round(predicted / same), np.round(jumps / same))]
    found, is_jump = sharpen(values_at, missing, duration)
    return np.unique(np.concatenate([jumps, found[is_jump]]))


def sharpen(values_at: Values, times: Array, duration: float) -> tuple[Array, Array]:
    """Locate the last times before jumps near known times in (0, duration) [s]; return them, and a mask of the jumps."""
    side = JUMP_ERROR * duration
    times = times[(times > side) & (times < duration - side)]
    if not len(times):
        return times, times > 0
    start, end = times - side, times + side
    return _bisect(values_at, start, end, values_at(start), values_at(end))


def _split(values: Array, first: int, last: int, allowed: float) -> Iterator[int]:
    """Yield the samples between polynomial pieces of a smooth interval from sample `first` to `last`, by recursive halving.

    A polynomial fits a piece if its largest error is at most `MISFIT`, and error times samples of the piece at most `allowed`.
    A piece longer than `PIECE`, which is no quick change, counts as `PIECE` samples.
    """
    length = last - first
    if length < FEWEST or _misfit(values[first : last + 1]) <= min(MISFIT, allowed / min(length, PIECE)):
        return
    middle = (first + last) // 2
    yield from _split(values, first, middle, allowed)
    yield middle
    yield from _split(values, middle, last, allowed)


def _find_quick_changes(values: Array, first: int, last: int, allowed: float) -> Iterator[int]:
    """Yield the inner ends of pieces shorter than `PIECE`, between edges at or before the samples `first` and `last`."""
    # the time of a jump is the last before it: if a sample has this time, its value is the one before the jump
    start = first + 1 if first > 0 else first
    ends = chain((first,), _split(values, start, last - 1, allowed), (last,))
    for (before, here), (_, after) in pairwise(pairwise(ends)):
        if min(here - before, after - here) < PIECE:
            yield here


def _misfit(values: Array) -> float:
    """Return the largest error, at all samples, of the polynomial through the samples next to Chebyshev points."""
    degree = min(8, len(values) // FEWEST)  # 8 is chosen; most samples lie between the points
    nodes = np.unique(np.rint((1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2 * (len(values) - 1)).astype(int))
    x = np.linspace(-1.0, 1.0, len(values))
    fitted = np.polynomial.chebyshev.chebval(x, np.polynomial.chebyshev.chebfit(x[nodes], values[nodes], len(nodes) - 1))
    return float(np.abs(fitted.T - values).max())
