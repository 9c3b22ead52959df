"""Edges of a user's functions in one run: those of time before it, those of its states along it.

Edges belong to a run: a closure, a global or an attribute may change before the next. A function of states becomes one of time
along a run, its arguments cubics between the samples. Two or more edges between neighbouring samples were not seen by the solver.
The run is then repeated with steps that end on them, until the last run has none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

import numpy as np

from ..geometry import Array
from .breaks import QUICK, WIDTH, Edges, breaks, evaluate, search

ON = 1e-9
"""Distance of an edge from a sample, over the run, at which a step ends on it."""
CUTS = 2
"""Steps within the narrowest feature, where a repeated run still passes some: each has a sample within it then."""

OFF, SHARE = 0.1, 0.01
"""Misfit of a cubic through the samples, over the range, and share of the run with it: with more, steps lose a function."""
LATE = 4
"""Repetitions of a run that may pass features before all of it is parted: edges far behind the first move once or twice."""
NARROW = 1 / 40
"""Distance of two edges, over the run, below which one step may pass both: the longest step there is."""
AHEAD = 1e-4
"""Distance of a stop before its edge, over that between two edges, halved from run to run, so that errors show by differences: a
step ends before it, whatever Newton's method leaves."""
SETTLED = 1e-5
"""Shift of an edge from one run to the next, over its distance from another one, from which no further run is made."""
FEW = 200
"""Most edges along a run on which the next one steps though this one saw them: sliding that sticks has one at each sample."""


class Argument(NamedTuple):
    """One argument of a function over a run, (times,), and its rate, where that is known."""

    values: Array
    rates: Array | None = None

    def curve(self, time: Array, samples: Array) -> Callable[[Array], Array]:
        """Return a cubic between some samples, at increasing times [s]."""
        from scipy.interpolate import CubicHermiteSpline, PchipInterpolator  # they take a while to load, and few runs need them

        known = self.values[samples]
        return PchipInterpolator(time, known) if self.rates is None else CubicHermiteSpline(time, known, self.rates[samples])


class Passed(NamedTuple):
    """Edges [s] between two neighbouring samples of a run, shift of its narrow features, and if edges are too many to locate.

    The shift is the largest from one run to the next, over the distance of the edge from another one.
    """

    edges: Array
    shift: float
    many: bool


Called = tuple[Callable[..., object], Sequence[Argument]]
"""A function of time and states, and these states over a run."""


class Looks:
    """Edges found in one run, or in the runs of one call.

    Attributes
    ----------
    edges, stops : array
        Times [s] of edges along the last run, and shortly before them.
    cuts : array
        Times [s] that part steps further, where edges alone were not enough.
    """

    def __init__(self) -> None:
        self.edges, self.stops, self.cuts = (np.empty(0) for _ in range(3))
        self._ahead = AHEAD
        self._kept: dict[tuple[int, float], tuple[Callable[..., object], Edges]] = {}

    def of_time(self, function: Callable[..., object], duration: float) -> Edges:
        """Find the edges of a function of time, once for each duration [s]."""
        key = id(function), duration
        if key not in self._kept:
            self._kept[key] = function, breaks(function, duration)  # the function is kept, so that its id stays its own
        return self._kept[key][1]

    def find_passed(self, time: Array, functions: Iterable[Called]) -> Passed:
        """Find what a run passed between its samples [s]; the next run steps onto all edges of this one."""
        time, first = np.unique(time, return_index=True)
        found, unseen, many = [np.empty(0)], [np.empty(0)], False
        for function, arguments in functions:
            curves = [each.curve(time, first) for each in arguments]
            edges = search(lambda t: evaluate(function, t, *(curve(t) for curve in curves)), float(time[-1]))  # noqa: B023
            many = many or (edges.capped and not _is_followed(function, time, curves))
            found.append(np.array(edges.times))
            unseen.append(_between(found[-1], time, ON * float(time[-1])))
        unfinished = [function for function, edges in self._kept.values() if edges.capped]
        many = many or not all(_is_followed(function, time, ()) for function in unfinished)
        every = np.unique(np.concatenate(found))
        every = every if len(every) <= FEW else np.empty(0)
        apart = np.minimum(_apart(every), narrow := NARROW * float(time[-1]))
        shift = _shift(every, self.edges, apart)[apart < narrow].max(initial=0.0)
        self.edges, self.stops = every, every - self._ahead * apart
        self._ahead /= 2
        return Passed(np.unique(np.concatenate(unseen)), float(shift), many)

    def cut(self, edges: Array, end: float, repeated: int) -> None:
        """Let the next run step onto edges [s] that were passed; in late repetitions part all of it so that none is passed."""
        if repeated >= LATE and len(edges) > 1:
            count = int(CUTS * end / max(float(np.diff(edges).min()), WIDTH * end))
            self.cuts = np.linspace(0.0, end, count + 1)[1:-1] if count < QUICK else self.cuts
        if not len(self.edges):
            self.stops = edges


_LOOKS: ContextVar[Looks | None] = ContextVar("looks", default=None)


@contextmanager
def looking(looks: Looks) -> Iterator[None]:
    """Look at each function once, until the context is left."""
    token = _LOOKS.set(looks)
    try:
        yield
    finally:
        _LOOKS.reset(token)


def edges_of(function: Callable[..., object], duration: float) -> tuple[float, ...]:
    """Edges of a function of time [s], as the run that is being made has found them."""
    return (_LOOKS.get() or Looks()).of_time(function, duration).times


def edges_along(duration: float, *, cuts: bool = False) -> tuple[float, ...]:
    """Edges [s] that runs before this one passed, and if so wished what parts steps further."""
    looks = _LOOKS.get()
    if looks is None:
        return ()
    return tuple(t for t in (*looks.stops.tolist(), *(looks.cuts.tolist() if cuts else ())) if 0 < t < duration)


def _is_followed(function: Callable[..., object], time: Array, curves: Sequence[Callable[[Array], Array]]) -> bool:
    """Return True if a cubic through the samples of a run follows a function nearly everywhere between them."""
    from scipy.interpolate import PchipInterpolator

    looks = np.linspace(0.0, float(time[-1]), round(1 / WIDTH) + 1)
    known, found = (evaluate(function, t, *(curve(t) for curve in curves)) for t in (time, looks))
    off = np.abs(PchipInterpolator(time, known)(looks) - found).max(axis=1)
    return bool((off > OFF * np.ptp(found, axis=0).max()).mean() < SHARE)


def _apart(edges: Array) -> Array:
    """Distances of edges from the nearest others."""
    gaps = np.diff(edges)
    return np.minimum(np.append(gaps, np.inf), np.append(np.inf, gaps))[: len(edges)]


def _shift(edges: Array, before: Array, apart: Array) -> Array:
    """Distances of edges from the nearest of the run before, over those from their neighbours."""
    known = np.concatenate([[-np.inf], before, [np.inf]])
    place = np.searchsorted(known, edges)
    return np.asarray(np.minimum(edges - known[place - 1], known[place] - edges) / apart)


def _between(edges: Array, time: Array, near: float) -> Array:
    """Edges that share the interval between two samples with another one, samples left out."""
    place = np.searchsorted(time, edges)
    on = np.minimum(np.abs(edges - time[np.minimum(place, len(time) - 1)]), np.abs(edges - time[np.maximum(place - 1, 0)])) < near
    edges, place = edges[~on], place[~on]
    return edges[np.bincount(place, minlength=len(time) + 1)[place] > 1]
