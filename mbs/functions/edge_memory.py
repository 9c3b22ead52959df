"""Edges of a user's functions in one run: those of time before it, those of its states along it, as cubics between the samples.

Of a function of one state they are values of it. A run that passed two edges between samples is repeated with steps on them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, NamedTuple

import numpy as np

from ..geometry import Array
from .breaks import WIDTH, Edges, breaks, evaluate, search

ON = 1e-9
"""Distance of an edge from a sample, over the run, at which a step ends on it."""
OFF = 0.1
"""Misfit of a cubic through the samples of a run, over the range of a function, with which the run has not followed it."""
SHARE = 0.01
"""Share of the run that may have such a misfit: jumps have it at any number of samples."""
NARROW = 1 / 40
"""Distance of two edges, over the run, below which one step may pass both: the longest step there is."""
AHEAD = 1e-5
"""Distance of stops before and after an edge, over that between two edges: a short step crosses it, and the next one starts with
what acts behind it. It is halved from level to level, so that errors show by differences."""
SETTLED = 1e-5
"""Shift of an edge from one run to the next, over its distance from another one, from which no further run is made."""
FEW = 200
"""Most edges along a run on which the next one steps though this one saw them: sliding that sticks has one at each sample."""
SCANNED = 1e-4
"""Distance of samples over the range of a state: beside those along the run it costs a tenth."""
APART = 1e-12
"""Distance of two edges, over the run, below which they are one that was found in two ways."""
TIME = -1
"""Place of the time among the states: edges that do not move from run to run are times."""
BEYOND = 1e-3
"""Way that a state may go beyond the range in which edges were looked for, over that: finer runs differ by less."""
PROBES = 50
"""Arguments at which a function that depends on one state only does not change with the others."""


class Argument(NamedTuple):
    """One argument of a function over a run, (times,), and its rate, where that is known."""

    values: Array
    rates: Array | None = None

    def curve(self, time: Array, samples: Array) -> Curve:
        """Return a cubic between some samples, at increasing times [s]."""
        from scipy.interpolate import CubicHermiteSpline, PchipInterpolator  # they take a while to load, and few runs need them

        known = self.values[samples]
        return PchipInterpolator(time, known) if self.rates is None else CubicHermiteSpline(time, known, self.rates[samples])


Curve = Callable[[Array], Array]
"""Argument of a function over time, between the samples of a run."""


class Passed(NamedTuple):
    """Edges [s] between two neighbouring samples of a run, shift of its narrow features, and if edges are too many to locate.

    The shift is the largest from one run to the next, over the distance of the edge from another one.
    """

    edges: Array
    shift: float
    many: bool


Called = tuple[Callable[..., object], Sequence[Argument]]
"""A function of time and states, and these states over a run."""
MEASURE = 0
"""Place among the states of the one that steps of a run can end on: elongation or angle. Speeds have kinks where bodies stick."""


class _Known(NamedTuple):
    """Edges of a function of one state, or of the time, as values of it, and the range in which they were looked for."""

    state: int
    values: Array
    low: float = -np.inf
    high: float = np.inf

    def covers(self, time: Array, curves: Sequence[Curve]) -> bool:
        """Tell whether the state stays in that range in a run, but for a little."""
        if self.state == TIME:
            return True
        way, little = curves[self.state](time), BEYOND * (self.high - self.low)
        return bool(self.low - little <= way.min() and way.max() <= self.high + little)

    def times(self, curves: Sequence[Curve], end: float) -> Array:
        """Times of the edges in a run [s]."""
        return self.values if self.state == TIME else _crossings(curves[self.state : self.state + 1], [self.values], end)


class Looks:
    """Edges [s] found in one run, or in the runs of one call, along the last run, and stops shortly before and after them."""

    def __init__(self) -> None:
        self.edges, self.stops = np.empty(0), np.empty(0)
        self._ahead, self._confirmed = AHEAD, False
        self._known: dict[int, _Known] = {}
        self._names: list[str] = []
        self._located: dict[str, Array] = {}
        self._times: dict[int, Array] = {}
        self._kept: dict[tuple[int, float], tuple[Callable[..., object], Edges]] = {}

    def of_time(self, function: Callable[..., object], duration: float) -> Edges:
        """Find the edges of a function of time, once for each duration [s]."""
        key = id(function), duration
        if key not in self._kept:
            self._kept[key] = function, breaks(function, duration)  # the function is kept, so that its id stays its own
        return self._kept[key][1]

    def locate(self, names: Sequence[str]) -> dict[str, Array]:
        """Values of their first state at which functions of it alone have edges, by element, of those whose edges end steps."""
        known = {self._names[k]: known for k, known in self._known.items()}
        self._located = {name: known[name].values for name in names if name in known and known[name].state == MEASURE}
        return self._located

    def find_passed(self, time: Array, functions: Iterable[tuple[str, Called]]) -> Passed:
        """Find what a run passed between its samples [s], of functions by element; the next run steps onto all of that."""
        time, first = np.unique(time, return_index=True)
        self._names, every_function = [], []
        for name, (function, arguments) in functions:
            self._names.append(name)
            every_function.append((function, [each.curve(time, first) for each in arguments]))
        found, many = self._find(time, every_function)
        if self._known and not self._confirmed and self._judge(time, found)[0] <= SETTLED:
            self._known = {}
            found, many = self._find(time, every_function)
        shift, every, apart = self._judge(time, found)
        self._located = {}
        unseen = _merge([_between(each, time, ON * float(time[-1])) for each in found], time)
        settled = shift <= SETTLED and not len(unseen)
        self._confirmed = self._confirmed or settled
        self._ahead /= 2 if settled else 1
        self.edges, self.stops = every, np.unique([every - self._ahead * apart, every + self._ahead * apart])
        self.stops = self.stops if len(every) else unseen
        return Passed(unseen, shift, many)

    def _find(self, time: Array, called: Sequence[tuple[Callable[..., object], Sequence[Curve]]]) -> tuple[list[Array], bool]:
        """Find the edges [s] of each function along a run, and if there are too many of one to locate."""
        end, found, many = float(time[-1]), [], False
        for k, (function, curves) in enumerate(called):
            if k in self._known and self._known[k].covers(time, curves):
                found.append(self._known[k].times(curves, end))
                continue
            edges = search(lambda t: evaluate(function, t, *(curve(t) for curve in curves)), end)  # noqa: B023
            many = many or (edges.capped and not _is_followed(function, time, curves))
            times = _merge([np.array(edges.times), _crossings(curves, _scan(function, time, curves), end)], time)
            found.append(times)
            only = None if edges.capped or len(times) > FEW else _only_state(function, time, curves, times)
            before, self._times[k] = self._times.get(k), times
            rests = before is not None and before.shape == times.shape and (np.abs(before - times) <= APART * end).all()
            if only is not None:
                way = curves[only](time)
                self._known[k] = _Known(only, np.unique(curves[only](times)), float(way.min()), float(way.max()))
            elif rests and not edges.capped:
                self._known[k] = _Known(TIME, times)
        found = [each for k, each in enumerate(found) if not self._is_located(k)]
        many = many or not all(_is_followed(function, time, ()) for function, edges in self._kept.values() if edges.capped)
        return found, many

    def _is_located(self, k: int) -> bool:
        """Tell whether the run's steps end on all known edges of a function."""
        if k not in self._known or self._names[k] not in self._located:
            return False
        state, values, low, high = self._known[k]
        off = np.abs(values[:, None] - self._located[self._names[k]]).min(axis=1, initial=np.inf)
        return state == MEASURE and bool((off <= ON * (high - low)).all())

    def _judge(self, time: Array, found: list[Array]) -> tuple[float, Array, Array]:
        """Return the shift of narrow features since the last run, edges to step onto, and their distances from each other."""
        every, narrow = _merge(found, time), NARROW * float(time[-1])
        every = every if len(every) <= FEW else np.empty(0)
        apart = np.minimum(_spacings(every), narrow)
        return float(_shift(every, self.edges, apart)[apart < narrow].max(initial=0.0)), every, apart


_LOOKS: ContextVar[Looks | None] = ContextVar("looks", default=None)


@contextmanager
def looking(looks: Looks) -> Iterator[None]:
    """Look at each function once, until the context is left."""
    token = _LOOKS.set(looks)
    try:
        yield
    finally:
        _LOOKS.reset(token)


def looks_or(other: Looks) -> Looks:
    """Return the looks of the run that is being made, or other ones: of a scene that is integrated many times."""
    return _LOOKS.get() or other


def locate(names: Sequence[str]) -> dict[str, Array]:
    """Values as of `Looks.locate`, of the runs before this one."""
    looks = _LOOKS.get()
    return {} if looks is None else looks.locate(names)


def edges_along(duration: float) -> tuple[float, ...]:
    """Edges [s] that runs before this one passed."""
    looks = _LOOKS.get()
    return () if looks is None else tuple(t for t in looks.stops.tolist() if 0 < t < duration)


def _scan(function: Callable[..., object], time: Array, curves: Sequence[Curve]) -> list[Array]:
    """Find the edges of a function in each state alone over its range of motion, the other arguments zero."""
    found = []
    for k, curve in enumerate(curves):
        values = curve(time)
        low, high = float(values.min()), float(values.max())

        def along_state(way: Array, k: int = k, low: float = low) -> Array:
            """Evaluate the function at places of its state."""
            others = [np.zeros_like(way)] * len(curves)
            return evaluate(function, np.zeros_like(way), *others[:k], low + way, *others[k + 1 :])

        edges = search(along_state, high - low, SCANNED) if high > low else Edges()
        found.append(low + np.array(edges.times) if len(edges.times) <= FEW else np.empty(0))
    return found


def _crossings(curves: Sequence[Curve], values: Sequence[Array], end: float) -> Array:
    """Find the times within a run [s] at which states pass values."""
    ways: Any = curves
    found = [way.solve(value, extrapolate=False) for way, some in zip(ways, values, strict=True) for value in some]
    times = np.concatenate([np.empty(0), *found])
    return np.asarray(times[(times > 0) & (times < end)])  # nan where a state rests on a value


def _only_state(function: Callable[..., object], time: Array, curves: Sequence[Curve], edges: Array) -> int | None:
    """Return the state on which alone a function depends, beside its edges and all along a run; None if there is none."""
    near = ON * float(time[-1])
    times = np.clip(np.concatenate([np.linspace(0.0, time[-1], PROBES), edges - near, edges + near]), 0.0, time[-1])
    states = [curve(times) for curve in curves]
    known, nothing = evaluate(function, times, *states), np.zeros_like(times)
    for k, state in enumerate(states):
        alone = [state if j == k else nothing for j in range(len(states))]
        if np.array_equal(known, evaluate(function, nothing, *alone)):
            return k
    return None


def _merge(found: Sequence[Array], time: Array) -> Array:
    """Join edges [s] in order, each once."""
    every = np.sort(np.concatenate([np.empty(0), *found]))
    return every[np.diff(every, prepend=-np.inf) > APART * float(time[-1])]


def _is_followed(function: Callable[..., object], time: Array, curves: Sequence[Callable[[Array], Array]]) -> bool:
    """Return True if a cubic through the samples of a run follows a function nearly everywhere between them."""
    from scipy.interpolate import PchipInterpolator

    looks = np.linspace(0.0, float(time[-1]), round(1 / WIDTH) + 1)
    known, found = (evaluate(function, t, *(curve(t) for curve in curves)) for t in (time, looks))
    off = np.abs(PchipInterpolator(time, known)(looks) - found).max(axis=1)
    return bool((off > OFF * np.ptp(found, axis=0).max()).mean() < SHARE)


def _spacings(edges: Array) -> Array:
    """Distances of edges from the nearest others."""
    gaps = np.diff(edges)
    return np.minimum(np.append(gaps, np.inf), np.append(np.inf, gaps))[: len(edges)]


def _shift(edges: Array, before: Array, spacings: Array) -> Array:
    """Distances of edges from the nearest of the run before, over those from their neighbours."""
    known = np.concatenate([[-np.inf], before, [np.inf]])
    place = np.searchsorted(known, edges)
    return np.asarray(np.minimum(edges - known[place - 1], known[place] - edges) / spacings)


def _between(edges: Array, time: Array, near: float) -> Array:
    """Edges that share the interval between two samples with another one, samples left out."""
    place = np.searchsorted(time, edges)
    on = np.minimum(np.abs(edges - time[np.minimum(place, len(time) - 1)]), np.abs(edges - time[np.maximum(place - 1, 0)])) < near
    edges, place = edges[~on], place[~on]
    return edges[np.bincount(place, minlength=len(time) + 1)[place] > 1]
