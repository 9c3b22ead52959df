"""Error against run time: what accuracy a model, a mesh or a tolerance buys for the time it takes.

A time alone says nothing, and neither does an error: a comparison needs both for every variant, taken in one run. The
variants take turns (A B C A B C ...), so that a machine that warms up or gets busy slows all of them alike; times are
medians, and a ratio of times is the median of the ratios within each turn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite, nan
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.validate import whole


@dataclass(frozen=True, eq=False)
class Point:
    """One variant: how wrong, how long.

    Attributes
    ----------
    name : str
    error : float
        By the measure given; nan if the variant failed.
    walls : tuple of float
        Wall time of each repetition, s, in order.
    work : dict
        What the outcome says in its `work`: steps, iterations.
    front : bool
        On the Pareto front: no other variant is at least as accurate and as fast, and better in one of the two.
    """

    name: str
    error: float
    walls: tuple[float, ...]
    work: Mapping[str, float] = field(default_factory=dict)
    front: bool = False

    @property
    def wall_s(self) -> float:
        """Median wall time, s."""
        return median(self.walls)

    def speedup(self, other: Point) -> float:
        """How many times faster than another point of the same run: median ratio of the times within one turn."""
        return median(theirs / own for own, theirs in zip(self.walls, other.walls, strict=True))

    def beats(self, other: Point) -> bool:
        """Whether no worse than another point in error and time, and better in one of them."""
        no_worse = self.error <= other.error and self.wall_s <= other.wall_s
        return no_worse and (self.error < other.error or self.wall_s < other.wall_s)


def work_precision(
    variants: Mapping[str, Callable[[], Any]],
    error: Callable[[Any], float],
    repeats: int = 5,
    *,
    progress: Callable[[Sequence[str]], Iterable[str]] = iter,
    clock: Callable[[], float] | None = None,
) -> list[Point]:
    """Run every variant several times in turn, and measure its error and its run time.

    Parameters
    ----------
    variants : mapping of str to callable
        Each takes nothing, does the whole job from its input to its answer, and returns an outcome. A failure is an
        outcome too: a variant that raises ends the measurement.
    error : callable
        Error of an outcome, not negative; nan if it failed. Not timed.
    repeats : int
        Turns, at least 1. The first outcome of a variant gives its error and its work.
    progress : callable, optional
        Passes on the names of the runs ahead, as a progress bar does.
    clock : callable, optional
        Time, s: that of the wall by default; `time.process_time` for that of the processor alone.

    Returns
    -------
    list of Point
        In the order of the variants.

    Raises
    ------
    ValueError
        If there is no variant, or fewer than one repetition is asked for.
    """
    whole("repeats", repeats, 1, 10**6)
    if not variants:
        raise ValueError("variants: there must be at least one")
    now = clock or perf_counter
    outcomes: dict[str, Any] = {}
    walls: dict[str, list[float]] = {name: [] for name in variants}
    for name in progress([*variants] * repeats):
        start = now()
        outcome = variants[name]()
        walls[name].append(now() - start)
        outcomes.setdefault(name, outcome)
    points = [
        Point(name, float(error(outcome)), tuple(walls[name]), dict(getattr(outcome, "work", {})))
        for name, outcome in outcomes.items()
    ]
    return [replace(p, front=isfinite(p.error) and not any(q.beats(p) for q in points)) for p in points]


def fastest(points: Iterable[Point], error: float) -> Point | None:
    """The fastest point whose error is at most that; None if none is so accurate."""
    return min((p for p in points if p.error <= error), key=lambda p: p.wall_s, default=None)


def time_for(points: Iterable[Point], error: float) -> float:
    """Time, s, in which points reach an error: along their front, linear in logarithms; nan outside its errors."""
    points = [p for p in points if isfinite(p.error)]
    front = sorted((p.error, p.wall_s) for p in points if not any(q.beats(p) for q in points))
    if not front or not front[0][0] <= error <= front[-1][0]:
        return nan
    errors, walls = np.log(front).T
    return float(np.exp(np.interp(np.log(error), errors, walls)))


def verdict(point: Point, baseline: Point) -> str:
    """Compare two points of one run in a sentence."""
    ratio, share = point.speedup(baseline), point.error / baseline.error
    faster = f"{ratio:.1f} times faster" if ratio >= 1 else f"{1 / ratio:.1f} times slower"
    error = f"{share:.2g} times the error" if isfinite(share) else "an error the other does not reach"
    return (
        f"{point.name} has an error of {point.error:.1e} after {1e3 * point.wall_s:.3g} ms, {baseline.name} one of "
        f"{baseline.error:.1e} after {1e3 * baseline.wall_s:.3g} ms: {faster} at {error}."
    )
