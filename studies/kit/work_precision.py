"""Error against run time: run variants in turn for the processor time each takes, and find those that nothing beats.

A time alone says nothing, and neither does an error: a comparison needs both of every variant, taken in one run. Variants take
turns (A B C A B C ...), so that a machine that warms up or gets busy slows all of them alike; times are medians, and a ratio of
times is the median of the ratios within each turn.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from statistics import median
from time import process_time
from typing import TypeVar

from buckler.mbs.validate import whole

from .parameters import StudyParameters
from .report import provenance

Name = TypeVar("Name", bound=Hashable)


@dataclass(frozen=True)
class Point:
    """One variant.

    Attributes
    ----------
    error : nan if it failed
    times : processor time of each repetition, s, in order
    front : on the Pareto front: no other variant is at least as accurate and as fast, and better in one of the two
    """

    error: float
    times: tuple[float, ...]
    front: bool = False

    @property
    def time(self) -> float:
        """Median time, s."""
        return median(self.times)

    def speedup(self, other: Point) -> float:
        """Compute the speed-up over another point of the same run: median ratio of the times within one turn."""
        return median(theirs / own for own, theirs in zip(self.times, other.times, strict=True))

    def beats(self, other: Point) -> bool:
        """Check that a point is no worse than another in error and time, and better in one of them."""
        no_worse = self.error <= other.error and self.time <= other.time
        return no_worse and (self.error < other.error or self.time < other.time)


def work_precision(
    variants: Mapping[Name, Callable[[], object]],
    errors: Mapping[Name, float],
    repeats: int = 5,
    *,
    progress: Callable[[list[Name]], Iterable[Name]] = iter,
) -> dict[Name, Point]:
    """Run every variant several times in turn for its run time.

    Parameters
    ----------
    variants : mapping to callable
        Each takes nothing and does the whole job from its input to its answer.
    errors : mapping to float
        Error of each, from a first run that is not timed.
    repeats : int
        Turns, at least 1.
    progress : callable, optional
        Passes on the names of the runs ahead, as a progress bar does.

    Raises
    ------
    ValueError
        If there is no variant, or fewer than one repetition is asked for.
    """
    whole("repeats", repeats, 1, 10**6)
    if not variants:
        raise ValueError("variants: there must be at least one")
    times: dict[Name, list[float]] = {name: [] for name in variants}
    for name in progress([*variants] * repeats):
        start = process_time()
        variants[name]()
        times[name].append(process_time() - start)
    points = {name: Point(errors[name], tuple(spent)) for name, spent in times.items()}
    return {
        name: replace(p, front=isfinite(p.error) and not any(q.beats(p) for q in points.values())) for name, p in points.items()
    }


def fastest(points: Iterable[Point], error: float) -> Point | None:
    """Find the fastest point whose error is at most that; None if none is so accurate."""
    return min((p for p in points if p.error <= error), key=lambda p: p.time, default=None)


def footnote(parameters: StudyParameters) -> str:
    """State machine, versions and repetitions that a table of run times stands on."""
    origin = provenance(parameters)
    versions = ", ".join(f"{name} {version}" for name, version in origin["versions"].items() if version)
    machine = f"{origin['machine']['cpu']}, {origin['machine']['cores']} cores"
    repeats = origin["parameters"]["repeats"]
    return f"Medians of {repeats} runs taken in turn; {machine}; {versions}; commit {origin['commit']}."
