"""Examination of one function of states: its edges along each state, the state that decides them, its resolution by samples.

Edges are jumps and kinks. Along one state all other states and the time are zero. `curves` interpolate the states of a run, one
each, by cubics between its samples `time`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..geometry import Array
from .edge_search import WIDTH, evaluate, find_edges_between

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

ON_SAMPLE = 1e-9
"""Distance of an edge from a sample, over the run, below which the edge lies on the sample, as if a step ended there."""
MISFIT = 0.1
"""Error of a cubic through the samples of a run, over the range of a function, that counts as a misfit; chosen."""
MISFIT_SHARE = 0.01
"""Largest share of misfits in a run that resolves a function; chosen. It is not 0: near jumps misfits remain at any number."""
MOST_EDGES = 200
"""Most edges of a search along a run or along one state; chosen. If there are more, as with friction that sticks, which has an
edge at each sample, steps end on none of them. It is also about the number of edges at which `find_state_of_edges` tests."""
LEAST_KINK = 1e-8
"""Least second difference across a kink, over the range of the function: a kink has some 1e-6, a smooth curve 1e-12."""
MEASURE = 0
"""Index of the state at whose values the solver can end steps: elongation or angle. A speed has kinks where bodies stick."""


def scan_states(function: Callable[..., object], time: Array, curves: Sequence[PPoly]) -> list[Array]:
    """Find the edges of a function along each state over the state's range; a run that passes them has edges there, too."""
    found = []
    for k, curve in enumerate(curves):
        values = curve(time)
        low, high = float(values.min()), float(values.max())

        def along_state(x: Array, k: int = k) -> Array:
            """Evaluate the function at values of one state."""
            others = [np.zeros_like(x)] * len(curves)
            return evaluate(function, np.zeros_like(x), *others[:k], x, *others[k + 1 :])

        width = 10 * WIDTH  # a tenth of the cost of the search along the run
        edges = find_edges_between(low, high, along_state, width) if high > low else np.empty(0)
        found.append(edges if len(edges) <= MOST_EDGES else np.empty(0))
    return found


def find_crossings(curves: Sequence[PPoly], values: Sequence[Array], end: float) -> Array:
    """Find the times within a run [s] at which states pass values."""
    found = [curve.solve(value, extrapolate=False) for curve, some in zip(curves, values, strict=True) for value in some]
    times = np.concatenate([np.empty(0), *found])
    return np.asarray(times[(times > 0) & (times < end)])  # nan if a state stays at a value


def find_state_of_edges(function: Callable[..., object], time: Array, curves: Sequence[PPoly], edges: Array) -> int | None:
    """Return the state at whose values all edges [s] of a function lie, whatever its other arguments are; None if unknown."""
    probes = edges[:: 1 + len(edges) // MOST_EDGES]  # every second, third, ... if there are many
    near = ON_SAMPLE * float(time[-1])
    times = np.clip(np.concatenate([np.linspace(0.0, time[-1], 50), probes - near, probes + near]), 0.0, time[-1])
    states = [curve(times) for curve in curves]
    known, zero = evaluate(function, times, *states), np.zeros_like(times)
    for k, state in enumerate(states):
        alone = [state if j == k else zero for j in range(len(states))]
        if np.array_equal(known, evaluate(function, zero, *alone)):
            return k  # the only state on which the function depends, near its edges and along the run
    return MEASURE if len(edges) and _has_fixed_edges(function, time, curves, probes) else None


def _has_fixed_edges(function: Callable[..., object], time: Array, curves: Sequence[PPoly], edges: Array) -> bool:
    """Return True if a function has kinks at these values of the first state, whatever time and other states are."""
    states, zero = [curve(edges) for curve in curves], np.zeros_like(edges)
    values, step = states[MEASURE], 1e-6 * float(np.ptp(curves[MEASURE](time)))
    size = float(np.ptp(evaluate(function, time, *(curve(time) for curve in curves))))
    for t, others in ((edges, states[1:]), (zero, [zero] * len(states[1:]))):
        before, here, after = (evaluate(function, t, values + side * step, *others) for side in (-1, 0, 1))
        largest = np.abs(after - 2 * here + before).max(axis=1)  # of the function's components
        if (largest <= LEAST_KINK * size).any():
            return False
    return True


def is_resolved(function: Callable[..., object], time: Array, curves: Sequence[PPoly]) -> bool:
    """Return True if a cubic through the samples of a run fits a function on all but a `MISFIT_SHARE` of the run."""
    from scipy.interpolate import PchipInterpolator

    fine = np.linspace(0.0, float(time[-1]), round(1 / WIDTH) + 1)  # the times that `find_edges` samples
    known, exact = (evaluate(function, t, *(curve(t) for curve in curves)) for t in (time, fine))  # (times, components)
    error = np.abs(PchipInterpolator(time, known)(fine) - exact).max(axis=1)
    return bool((error > MISFIT * np.ptp(exact, axis=0).max()).mean() < MISFIT_SHARE)
