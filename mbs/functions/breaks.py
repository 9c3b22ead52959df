"""Jumps, kinks and quick changes of a function of time, found by sampling it before a run.

It is sampled every `WIDTH` of the run. Where its second difference stands out is a jump or a kink, found closely by halving.
What is left is parted until a polynomial fits each piece, as in R. Pachon, R. B. Platte, L. N. Trefethen, Piecewise-smooth
chebfuns, IMA J. Numer. Anal. 30 (2010) 898, doi 10.1093/imanum/drp008; edges of pieces that are shorter than the steps of a run
are times onto which it steps. What is shorter than `WIDTH` may be missed: a `Table` names its own kinks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import chain, islice, pairwise
from typing import Any

import numpy as np

from ..geometry import Array

WIDTH = 1e-5
"""Sampling interval, relative to the run."""
PIECE = 1 / 200
"""Length of a piece, of the run, from which the steps of any run see what is in it."""
MOST = 2000
"""Times at most; a function with more is left to the control of the steps."""
OUTSTANDING = 30.0
"""Second difference over those of its neighbours that makes a jump or a kink."""
REACH = 6
"""Neighbours on either side with which a second difference is compared [samples]."""
DEGREE = 8
"""Largest degree of the interpolants."""
FEWEST = 4
"""Samples for each degree of an interpolant, so that most samples lie between its nodes."""
TOLERANCE = 1e-3
"""Largest residual of an interpolant, relative to the range; with the length of a step also to the function's integral."""
HALVINGS = 60
"""Largest number of bisections towards a jump."""
SAME = 1e-12
"""Largest relative difference of values in Python and in NumPy."""
MOST_OTHERS = 20
"""Arguments of a function besides the time."""


def breaks(function: Callable[..., object], duration: float) -> tuple[float, ...]:
    """Find the times in (0, duration), s, onto which steps should go; none if a function fails or is not finite.

    Parameters
    ----------
    function : callable
        Of time, s; values are numbers or sequences of numbers. One that has more arguments, as an angle and a speed, is looked at
        where these are zero. It is looked at once, if it can be hashed.
    duration : float
        s.
    """
    try:
        hash(function)
    except TypeError:
        return _find(function, duration)
    return _find_cached(function, duration)


def _find(function: Callable[..., object], duration: float) -> tuple[float, ...]:
    times = np.linspace(0.0, duration, round(1 / WIDTH) + 1)
    try:
        function = _of_time(function)
        values = _sample(function, times)
        span = float(np.ptp(values, axis=0).max(initial=0.0))
        if not np.isfinite(values).all() or span == 0:
            return ()
        sudden = [t for k in _outstanding(values / span) for t in _sudden(function, times[k - 1 : k + 2], values[k - 1 : k + 2])]
    except (Exception, SystemExit):  # a function may raise anything: the run will name it
        return ()
    edges = [0, *sorted({int(np.searchsorted(times, t)) for t in sudden}), len(times) - 1]
    whole = np.abs(values - np.median(values, axis=0)).sum(axis=0).max() / span
    quick = (
        times[k] for a, b in pairwise(edges) for k in _short(a, _split(values / span, a + (a > 0), b - 1, TOLERANCE * whole), b)
    )
    found = sorted({*sudden, *islice(quick, MOST)})
    return tuple(float(t) for t in found if 0 < t < duration) if len(found) < MOST else ()


_find_cached = lru_cache(maxsize=64)(_find)


def _of_time(function: Callable[..., object]) -> Callable[[Any], Any]:
    """Make it a function of time alone, its other arguments zero."""
    for others in range(MOST_OTHERS):
        try:
            function(0.0, *[0.0] * others)
        except (TypeError, ValueError):
            continue
        return lambda t: function(t, *[0.0] * others)
    raise ValueError("no function of time and others")


def _sample(function: Callable[..., object], times: Array) -> Array:
    """Evaluate at times, (times, components): at once where the function takes arrays."""
    some = times[:: len(times) // 7]
    one_by_one = np.array([function(float(t)) for t in some], dtype=float)
    try:
        at_once = np.broadcast_to(np.asarray(function(times), dtype=float).T, (len(times), *one_by_one.shape[1:]))
        if np.allclose(at_once[:: len(times) // 7], one_by_one, rtol=SAME, atol=SAME * np.abs(one_by_one).max()):
            return at_once.reshape(len(times), -1)
    except (Exception, SystemExit):  # it takes numbers only
        pass
    return np.array([function(float(t)) for t in times], dtype=float).reshape(len(times), -1)


def _outstanding(values: Array) -> Iterator[int]:
    """Samples whose second difference stands out; of neighbours the largest."""
    second = np.abs(np.diff(values, 2, axis=0)).max(axis=1)
    about = np.pad(second, REACH, mode="edge")
    others = [about[REACH + k : REACH + k + len(second)] for k in (-REACH, 1 - REACH, REACH - 1, REACH)]
    stands = second > OUTSTANDING * np.maximum(np.max(others, axis=0), 1e-12)
    for k in np.flatnonzero(stands):
        if second[k] >= second[max(0, k - 2) : k + 3].max():
            yield int(k) + 1


def _sudden(function: Callable[[Any], Any], times: Array, values: Array) -> Iterator[float]:
    """Times of the jumps between three looks, or of the kink if there is none."""
    jumps = [_jump(function, *times[k : k + 2], *values[k : k + 2]) for k in (0, 1)]
    found = [t for t in jumps if t is not None]
    yield from found or [_kink(function, times[0], times[2])]


def _jump(function: Callable[[Any], Any], start: float, end: float, before: Array, after: Array) -> float | None:
    """Last time before values change, however short the interval; None if they do not. A step that ends there sees no change."""
    whole = np.abs(after - before).max()
    for _ in range(HALVINGS):
        middle = (start + end) / 2
        if not start < middle < end:
            break
        value = np.atleast_1d(np.asarray(function(float(middle)), dtype=float)).ravel()
        if np.abs(value - before).max() > np.abs(after - value).max():
            end, after = middle, value
        else:
            start, before = middle, value
    return float(start) if np.abs(after - before).max() > max(0.1 * whole, 1e-300) else None


def _kink(function: Callable[[Any], Any], start: float, end: float) -> float:
    """Time of a kink between two, s: the part in which the function is farthest from a straight line."""
    for _ in range(HALVINGS):
        middle = (start + end) / 2
        if not start < middle < end:
            break
        quarters = np.array([function(float(t)) for t in np.linspace(start, end, 5)], dtype=float).reshape(5, -1)
        bends = np.abs(np.diff(quarters, 2, axis=0)).max(axis=1)
        start, end = ((start, middle), ((start + middle) / 2, (middle + end) / 2), (middle, end))[int(np.argmax(bends))]
    return float(end)


def _split(values: Array, first: int, last: int, little: float) -> Iterator[int]:
    """Yield the edges of the pieces of a smooth stretch."""
    if last - first < FEWEST or _residual(values[first : last + 1]) <= min(TOLERANCE, little / min(last - first, PIECE / WIDTH)):
        return
    middle = (first + last) // 2
    yield from _split(values, first, middle, little)
    yield middle
    yield from _split(values, middle, last, little)


def _short(first: int, inner: Iterator[int], last: int) -> Iterator[int]:
    """Edges, those between two ends, of pieces that are shorter than what steps see."""
    before, here = first, next(inner, last)
    for after in chain(inner, (last,)):
        if min(here - before, after - here) < PIECE / WIDTH and here < last:
            yield here
        before, here = here, after


def _residual(values: Array) -> float:
    """Return the largest error at all samples of the polynomial through points near Chebyshev's."""
    degree = min(DEGREE, len(values) // FEWEST)  # most looks are to be between the points
    nodes = np.unique(np.rint((1 - np.cos(np.pi * np.arange(degree + 1) / degree)) / 2 * (len(values) - 1)).astype(int))
    x = np.linspace(-1.0, 1.0, len(values))
    fitted = np.polynomial.chebyshev.chebval(x, np.polynomial.chebyshev.chebfit(x[nodes], values[nodes], len(nodes) - 1))
    return float(np.abs(fitted.T - values).max())
