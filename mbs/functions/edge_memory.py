"""Edges (jumps, kinks, quick changes) of a user's functions along a run, which is then repeated with steps that end on edges.

A state is any argument besides the time: a coordinate, its rate, or a state of a law. Edges of a function of time are known
before the run. Edges of a function of states are found along the run, with the states interpolated by cubics between samples.
If a function depends on one state only, its edges are values of this state. Steps can end at values of the first state,
`MEASURE` = 0, which is a place or an angle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..geometry import Array
from .edge_search import Edges, evaluate, find_edges, find_edges_in_time
from .probing import MEASURE, MOST_EDGES, ON_SAMPLE, find_crossings, find_state_of_edges, is_resolved, scan_states

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

CLOSE = 0.025
"""Distance of two edges, over the run, below which one step may pass both: the longest step of the second level is as long.
Only the shift of such close edges is watched, as error control sees single edges."""
SETTLED = 1e-5
"""Shift of an edge from one run to the next, over its distance from another edge, below which no further run is made."""
SAME_EDGE = 1e-12
"""Distance of two edges, over the run, below which they are the same edge."""
TIME = -1
"""Index of the time among the states, for edges at fixed times."""
BEYOND = 1e-3
"""Distance by which a state may leave the range in which edges were searched, over the range: finer runs differ less."""


class Argument(NamedTuple):
    """One argument of a function over a run, (times,), and its rate, if known."""

    values: Array
    rates: Array | None = None

    def curve(self, time: Array, samples: Array) -> PPoly:
        """Return the cubic interpolant through the samples of these indices, at increasing times [s]."""
        from scipy.interpolate import CubicHermiteSpline, PchipInterpolator  # they take a while to load, and few runs need them

        known = self.values[samples]
        return PchipInterpolator(time, known) if self.rates is None else CubicHermiteSpline(time, known, self.rates[samples])


class Passed(NamedTuple):
    """Edges [s] of which two or more lie between two neighbouring samples of a run; error control may miss the pulse there.

    `shift` is the largest shift of close edges since the run before, over their distance from the nearest edge. `too_many` is
    True if a function has more edges than can be located, and the samples do not resolve it.
    """

    edges: Array
    shift: float
    too_many: bool


Called = tuple[Callable[..., object], Sequence[Argument]]
"""A function of time and states, and the states over a run."""


class _Known(NamedTuple):
    """Known edges of a function of one state or of the time: `values` of that state, and the range that was searched."""

    state: int
    values: Array
    low: float = -np.inf
    high: float = np.inf

    @classmethod
    def of(cls, state: int, course: Array, values: Array) -> _Known | None:
        """Return the edges at `values` of a state with a course (times,), nearly equal ones as one; None above `MOST_EDGES`.

        Distinct values count for the state `MEASURE`, as steps can end at its values. For other states each passage counts.
        """
        low, high = float(course.min()), float(course.max())
        values = np.sort(values)
        distinct = values[np.diff(values, prepend=-np.inf) > ON_SAMPLE * (high - low)]
        count = len(distinct if state == MEASURE else values)
        return cls(state, distinct, low, high) if count <= MOST_EDGES else None

    def covers(self, time: Array, curves: Sequence[PPoly]) -> bool:
        """Return True if the state stays in the searched range in a run, up to `BEYOND`."""
        if self.state == TIME:
            return True
        values, margin = curves[self.state](time), BEYOND * (self.high - self.low)
        return bool(self.low - margin <= values.min() and values.max() <= self.high + margin)

    def times(self, curves: Sequence[PPoly], end: float) -> Array:
        """Return the times of the edges in a run [s]."""
        return self.values if self.state == TIME else find_crossings(curves[self.state : self.state + 1], [self.values], end)


class EdgeMemory:
    """`edges` [s] of the last run of a call, and `step_ends` [s], shortly before and after them, for the next run.

    A function is searched in each run until its edges are known: as values of one state, or as equal times in two runs. Edges are
    settled if they shift by `SETTLED` at most from one run to the next. Then a second search of all functions confirms the known
    edges. Edges are located if the solver itself ends steps on them, at values of the state `MEASURE`.
    """

    def __init__(self) -> None:
        self.edges, self.step_ends = np.empty(0), np.empty(0)
        # distance from an edge to the ends of steps around it, over the distance of two edges: a short step crosses it
        self._side_distance = 1e-5
        self._confirmed = False
        # functions have numbers, by their order in a run
        self._known: dict[int, _Known] = {}
        self._names: list[str] = []  # of the element of each function
        self._times: dict[int, Array] = {}  # edges of each function in its last search [s]
        self._times_before: dict[int, Array] = {}  # and in its last search of an earlier run
        self._located: dict[str, Array] = {}  # by element: values of the first state on which the run's steps end
        self._of_time: dict[tuple[int, float], tuple[Callable[..., object], Edges]] = {}  # by function and duration

    def of_time(self, function: Callable[..., object], duration: float) -> Edges:
        """Find the edges of a function of time, once for each duration [s]."""
        key = id(function), duration
        if key not in self._of_time:
            edges = find_edges_in_time(function, duration)
            self._of_time[key] = function, edges  # the reference to the function keeps its id unique
        return self._of_time[key][1]

    def locate(self, names: Sequence[str]) -> dict[str, Array]:
        """Return, by element, the known values of the first state at edges; the next run of the caller ends its steps there."""
        by_element = {self._names[k]: known for k, known in self._known.items()}  # `names` are of elements with one function
        measures = {name: by_element[name] for name in names if name in by_element and by_element[name].state == MEASURE}
        self._located = {name: known.values for name, known in measures.items()}
        return self._located

    def find_passed(self, time: Array, functions: Iterable[tuple[str, Called]]) -> Passed:
        """Find the edges [s] of elements' functions that a run passed between its samples, on which the next run will step."""
        time, first = np.unique(time, return_index=True)
        self._times_before = dict(self._times)
        self._names, every_function = [], []
        for name, (function, arguments) in functions:
            self._names.append(name)
            every_function.append((function, [each.curve(time, first) for each in arguments]))
        found, too_many = self._find_all(time, every_function)
        if self._known and not self._confirmed and self._compare(time, found)[0] <= SETTLED:
            self._known = {}  # a second search of this run, now of known functions as well, confirms their edges
            found, too_many = self._find_all(time, every_function)
        self._located = {}  # each run calls `locate` anew, or locates no edges
        shift, self.edges, distances = self._compare(time, found)
        passed = _merge([_between(each, time, ON_SAMPLE * float(time[-1])) for each in found], time)
        if shift <= SETTLED and not len(passed):
            self._confirmed = True
            self._side_distance /= 2  # so that the difference of two runs contains its effect
        sides = self._side_distance * distances
        # `_compare` returns no edges if they are more than `MOST_EDGES`: then steps end on those in `passed`
        self.step_ends = np.unique([self.edges - sides, self.edges + sides]) if len(self.edges) else passed
        return Passed(passed, shift, too_many)

    def _find_all(self, time: Array, called: Sequence[tuple[Callable[..., object], Sequence[PPoly]]]) -> tuple[list[Array], bool]:
        """Find the edges [s] of each function in a run, without located ones, and if a function has too many to be resolved."""
        found, too_many = [], False
        for k, (function, curves) in enumerate(called):
            if k in self._known and self._known[k].covers(time, curves):
                times = self._known[k].times(curves, float(time[-1]))
            else:
                times, is_capped = self._search_run(k, function, time, curves)
                too_many = too_many or (is_capped and not is_resolved(function, time, curves))
            if not self._is_located(k):
                found.append(times)
        # functions of time alone of which the search left edges out
        capped = [function for function, edges in self._of_time.values() if edges.capped]
        return found, too_many or not all(is_resolved(function, time, ()) for function in capped)

    def _search_run(self, k: int, function: Callable[..., object], time: Array, curves: Sequence[PPoly]) -> tuple[Array, bool]:
        """Search a run for the edges [s] of function k, note them as known if they are, and tell if some were left out."""
        end = float(time[-1])
        edges = find_edges(lambda t: evaluate(function, t, *(curve(t) for curve in curves)), end)
        of_states = scan_states(function, time, curves)  # it also finds pulses that are too short in time for the first search
        times = _merge([np.array(edges.times), find_crossings(curves, of_states, end)], time)
        before, self._times[k] = self._times_before.get(k), times
        if edges.capped:
            return times, True
        state = find_state_of_edges(function, time, curves, times)
        known = None if state is None else _Known.of(state, curves[state](time), curves[state](times))
        if known is not None:
            self._known[k] = known
        elif before is not None and len(before) == len(times) and np.allclose(before, times, rtol=0.0, atol=SAME_EDGE * end):
            self._known[k] = _Known(TIME, times)
        return times, False

    def _is_located(self, k: int) -> bool:
        """Return True if the run's steps end on all known edges of a function."""
        if k not in self._known or self._names[k] not in self._located:
            return False
        state, values, low, high = self._known[k]
        distance = np.abs(values[:, None] - self._located[self._names[k]]).min(axis=1, initial=np.inf)
        return state == MEASURE and bool((distance <= ON_SAMPLE * (high - low)).all())

    def _compare(self, time: Array, found: list[Array]) -> tuple[float, Array, Array]:
        """Compare the edges found in a run with those of the run before: return shift, edges [s], distances [s].

        The shift is the largest of edges closer than `CLOSE`, over their distance from the nearest edge, which is cut off at
        `CLOSE` of the run. More than `MOST_EDGES` edges count as none.
        """
        every, limit = _merge(found, time), CLOSE * float(time[-1])
        edges = every if len(every) <= MOST_EDGES else np.empty(0)
        gaps = np.diff(edges, prepend=-np.inf, append=np.inf)
        distances = np.minimum(np.minimum(gaps[:-1], gaps[1:]), limit)
        before = np.concatenate([[-np.inf], self.edges, [np.inf]])
        place = np.searchsorted(before, edges)
        shifts = np.minimum(edges - before[place - 1], before[place] - edges) / distances
        return float(shifts[distances < limit].max(initial=0.0)), edges, distances


_MEMORY: ContextVar[EdgeMemory | None] = ContextVar("edge_memory", default=None)


@contextmanager
def use_memory(memory: EdgeMemory) -> Iterator[None]:
    """Use a memory of edges within the context, so that each function is searched once."""
    token = _MEMORY.set(memory)
    try:
        yield
    finally:
        _MEMORY.reset(token)


def current_memory(default: EdgeMemory) -> EdgeMemory:
    """Return the memory in use, or a default."""
    return _MEMORY.get() or default


def step_ends(duration: float) -> tuple[float, ...]:
    """Return the times [s] at which steps end in a run because of edges in the run before."""
    memory = _MEMORY.get()
    return () if memory is None else tuple(t for t in memory.step_ends.tolist() if 0 < t < duration)


def _merge(found: Sequence[Array], time: Array) -> Array:
    """Join edges [s] in order, each once."""
    every = np.sort(np.concatenate([np.empty(0), *found]))
    return every[np.diff(every, prepend=-np.inf) > SAME_EDGE * float(time[-1])]


def _between(edges: Array, time: Array, near: float) -> Array:
    """Return the edges that lie in the same interval between samples as another edge, except those on a sample."""
    place = np.searchsorted(time, edges)
    before, after = time[np.maximum(place - 1, 0)], time[np.minimum(place, len(time) - 1)]
    off_samples = np.minimum(np.abs(edges - after), np.abs(edges - before)) >= near
    edges, place = edges[off_samples], place[off_samples]
    return edges[np.bincount(place, minlength=len(time) + 1)[place] > 1]
