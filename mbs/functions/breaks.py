"""Jumps, kinks and quick changes of a function of time, found by sampling it.

It is sampled at each `WIDTH` of the run. A second difference much larger than its neighbours is a jump or a kink, located by
bisection. Smooth intervals are halved until polynomials fit the pieces, as in R. Pachon, R. B. Platte, L. N. Trefethen,
Piecewise-smooth chebfuns, IMA J. Numer. Anal. 30 (2010) 898, doi 10.1093/imanum/drp008. If pieces are shorter than the steps of
a run, steps end on their edges. Periodic jumps are completed, as pulses may be shorter than `WIDTH`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import reduce
from itertools import chain, islice, pairwise
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from ..laws.compiled import evaluate_compiled

WIDTH = 1e-5
"""Distance of samples, over the run: 1e5 calls take some 20 ms. A single pulse that is shorter may be missed."""
PIECE = 1 / 200
"""Length of a piece, over the run, above which any run resolves it: its longest steps are a fortieth of the run."""
MOST = 20_000
"""Most jumps and kinks that are located: each costs a run some steps, so that the search costs less than a tenth of it."""
MOST_SMOOTH = 2000
"""Most edges of smooth pieces: with more of them, error control resolves the function anyway."""
OUTSTANDING = 30.0
"""Least second difference of a jump or kink, over those of its neighbours."""
REACHES = (6, 9)
"""Distances of the neighbours [samples]: two, so that another edge affects one of them only."""
DEGREE = 8
"""Degree of the polynomials."""
FEWEST = 4
"""Least number of sample intervals of a piece."""
MISFIT = 1e-3
"""Largest error of a polynomial over the range of the function, or over its integral in the run if that is stricter."""
HALVINGS = 60
"""Number of halvings of an interval, down to neighbouring floats."""
ROUNDING = 1e-12
"""Relative difference of equal values, and of equal times over the run."""
AT_ONCE = 64
"""Least number of arguments for which a call with arrays is tried."""
MOST_OTHERS = 20
"""Most arguments of a function in addition to the time."""
JUMP_ERROR = 2e-9
"""Error of a jump that is predicted by the period, over the run: rounding of thousands of periods."""
RECURRING = 20
"""Least number of jumps for the detection of a period."""

Values = Callable[[Array], Array]
"""Values at times [s]: (times,) to (times, components)."""


class Edges(NamedTuple):
    """Times [s] of jumps, kinks and quick changes, in order; `capped` is True if there were too many, which are left out."""

    times: tuple[float, ...] = ()
    capped: bool = False


def breaks(function: Callable[..., object], duration: float) -> Edges:
    """Find the edges of a function of time in (0, duration) [s], other arguments zero; none where it raises or is not finite."""
    return search(lambda times: evaluate(function, times, *[np.zeros_like(times)] * others_of(function)), duration)


def search(values_at: Values, duration: float, width: float = WIDTH) -> Edges:
    """Find the edges of a function given by its values at an array of times; none where it raises or is not finite.

    `width` is the distance of samples over the duration.
    """
    try:
        return _search(values_at, duration, width)
    except (Exception, SystemExit):  # a function may raise anything: the run reports it
        return Edges()


def _search(values_at: Values, duration: float, width: float) -> Edges:
    times = np.linspace(0.0, duration, round(1 / width) + 1)
    values = values_at(times)
    span = float(np.ptp(values, axis=0).max(initial=0.0))
    if not np.isfinite(values).all() or span == 0:
        return Edges()
    outstanding = _outstanding(values / span)
    if len(outstanding) > MOST:
        return Edges(capped=True)
    sudden = _recurring(values_at, _locate(values_at, times, values, outstanding), duration)
    edges = [0, *np.unique(np.searchsorted(times, sudden)).tolist(), len(times) - 1]
    whole = np.abs(values - np.median(values, axis=0)).sum(axis=0).max() / span
    pieces = ((a, _split(values / span, a + (a > 0), b - 1, MISFIT * whole), b) for a, b in pairwise(edges))
    quick = (times[k] for piece in pieces for k in _short(*piece))
    smooth = [float(t) for t in islice(quick, MOST_SMOOTH + 1)]
    capped = len(smooth) > MOST_SMOOTH
    found = sorted({*sudden.tolist(), *([] if capped else smooth)})
    return Edges(tuple(t for t in found if 0 < t < duration), capped)


def evaluate(function: Callable[..., object], *columns: Array) -> Array:
    """Evaluate a function at columns of arguments, (times, components): by machine code, arrays or single calls."""
    count = len(columns[0])
    if (compiled := evaluate_compiled(function, columns)) is not None:
        return compiled.reshape(count, -1)
    if count >= AT_ONCE:
        some = slice(None, None, count // 7)
        few = np.array([function(*each) for each in zip(*(c[some].tolist() for c in columns), strict=True)], dtype=float)
        try:
            whole = np.broadcast_to(np.asarray(function(*columns), dtype=float).T, (count, *few.shape[1:]))
            if np.allclose(whole[some], few, rtol=ROUNDING, atol=ROUNDING * np.abs(few).max()):
                return whole.reshape(count, -1)
        except (Exception, SystemExit):  # it accepts numbers only
            pass
    return np.array(list(map(function, *(c.tolist() for c in columns))), dtype=float).reshape(count, -1)


def others_of(function: Callable[..., object]) -> int:
    """Count the arguments of a function in addition to the time."""
    for others in range(MOST_OTHERS):
        try:
            function(0.0, *[0.0] * others)
        except (TypeError, ValueError):
            continue
        return others
    raise ValueError("no function of time and others")


def _outstanding(values: Array) -> Array:
    """Find the samples whose second difference is much larger than those of neighbours at `REACHES`."""
    second = reduce(np.maximum, np.abs(np.diff(values, 2, axis=0)).T)
    padded = np.pad(second, pad := max(REACHES), mode="edge")

    def largest(*shifts: int) -> Array:
        """Return the largest of the values at these shifts from each sample."""
        return np.asarray(reduce(np.maximum, (padded[pad + k : pad + k + len(second)] for k in shifts)))

    others = np.min([largest(-reach, 1 - reach, reach - 1, reach) for reach in REACHES], axis=0)
    outstanding = (second > OUTSTANDING * np.maximum(others, 1e-12)) & (second >= largest(*range(-2, 3)))
    return np.flatnonzero(outstanding) + 1


def _locate(values_at: Values, times: Array, values: Array, samples: Array) -> Array:
    """Locate the jumps in the two intervals at each sample, or the kink if there is none: times [s], in order."""
    if not len(samples):
        return np.empty(0)
    first = np.concatenate([samples - 1, samples])
    jumps, jumped = _bisect(values_at, times[first], times[first + 1], values[first], values[first + 1])
    smooth = samples[~jumped.reshape(2, -1).any(axis=0)]
    return np.unique(np.concatenate([jumps[jumped], _kinks(values_at, times[smooth - 1], times[smooth + 1])]))


def _bisect(values_at: Values, start: Array, end: Array, before: Array, after: Array) -> tuple[Array, Array]:
    """Locate the last times before jumps by bisection; return them, and True for those that are jumps at any interval.

    A step that ends at such a time evaluates the function before the jump only.
    """
    whole = np.abs(after - before).max(axis=1)
    for _ in range(HALVINGS):
        middle = (start + end) / 2
        if not ((start < middle) & (middle < end)).any():
            break
        value = values_at(middle)
        early = np.abs(value - before).max(axis=1) > np.abs(after - value).max(axis=1)
        start, end = np.where(early, start, middle), np.where(early, middle, end)
        before, after = np.where(early[:, None], before, value), np.where(early[:, None], value, after)
    return start, np.abs(after - before).max(axis=1) > np.maximum(0.1 * whole, 1e-300)


def _kinks(values_at: Values, start: Array, end: Array) -> Array:
    """Locate kinks by bisection: take the part of each interval with the largest second difference."""
    for _ in range(HALVINGS if len(start) else 0):
        middle = (start + end) / 2
        if not ((start < middle) & (middle < end)).any():
            break
        quarters = np.linspace(start, end, 5, axis=1)
        bends = np.abs(np.diff(values_at(quarters.ravel()).reshape(len(start), 5, -1), 2, axis=1)).max(axis=2)
        part, each = np.argmax(bends, axis=1), np.arange(len(start))
        start, end = quarters[each, part], quarters[each, part + 2]
    return end


def _recurring(values_at: Values, jumps: Array, duration: float) -> Array:
    """Complete periodic jumps, (times,): some pulses shorter than `WIDTH` lie between samples."""
    if len(jumps) < RECURRING:
        return jumps
    side = JUMP_ERROR * duration / 2
    sizes = values_at(np.minimum(jumps + side, duration)) - values_at(np.maximum(jumps - side, 0.0))
    up = jumps[sizes[:, np.abs(sizes).max(axis=0).argmax()] > 0]
    if len(up) < RECURRING / 2:
        return jumps
    period = float(np.median(np.diff(up)))
    period = float(np.ptp(up)) / max(1, round(float(np.ptp(up)) / period))
    phases = np.unique(np.round((jumps % period) / side) * side)
    if not period > 0 or len(phases) > RECURRING or len(phases) * duration / period > MOST:
        return jumps
    every = (np.arange(np.ceil(duration / period) + 1)[:, None] * period + phases).ravel()
    every = every[~np.isin(np.round(every / side), np.round(jumps / side))]
    found, jumped = sharpen(values_at, every, duration)
    return np.unique(np.concatenate([jumps, found[jumped]]))


def sharpen(values_at: Values, times: Array, duration: float) -> tuple[Array, Array]:
    """Locate the last times before jumps that are known to rounding; return them, and True for jumps; without the run's ends."""
    side = JUMP_ERROR * duration
    times = times[(times > side) & (times < duration - side)]
    if not len(times):
        return times, times > 0
    start, end = times - side, times + side
    return _bisect(values_at, start, end, values_at(start), values_at(end))


def _split(values: Array, first: int, last: int, little: float) -> Iterator[int]:
    """Yield the edges of the polynomial pieces of a smooth interval, by recursive halving."""
    if last - first < FEWEST or _misfit(values[first : last + 1]) <= min(MISFIT, little / min(last - first, PIECE / WIDTH)):
        return
    middle = (first + last) // 2
    yield from _split(values, first, middle, little)
    yield middle
    yield from _split(values, middle, last, little)


def _short(first: int, inner: Iterator[int], last: int) -> Iterator[int]:
    """Yield the inner edges of pieces that are shorter than `PIECE`."""
    before, here = first, next(inner, last)
    for after in chain(inner, (last,)):
        if min(here - before, after - here) < PIECE / WIDTH and here < last:
            yield here
        before, here = here, after


def _misfit(values: Array) -> float:
    """Return the largest error at the samples of the polynomial through samples near Chebyshev points."""
    degree = min(DEGREE, len(values) // FEWEST)  # most samples shall lie between the points
    nodes = np.unique(np.rint((1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2 * (len(values) - 1)).astype(int))
    x = np.linspace(-1.0, 1.0, len(values))
    fitted = np.polynomial.chebyshev.chebval(x, np.polynomial.chebyshev.chebfit(x[nodes], values[nodes], len(nodes) - 1))
    return float(np.abs(fitted.T - values).max())
