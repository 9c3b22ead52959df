"""Optimal design: numbers of a mechanism that minimise a reading subject to constraints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from scipy.stats import qmc

from ..geometry import Array
from ..progress import STOPS, watch, watching
from ..solvers import Spectral
from ..units import unit_suffix
from ..validate import positive, whole
from .numbers import Family, Source
from .reading import RunFailedError
from .residuals import STEADY, check_ranges
from .runs import Reading, needs_compiler, readings_of
from .searching import BINDS, EnoughError, Search, parse_want, point_of

BUDGET = 1000
"""Largest number of runs of a search, by default."""
MOST_CORRECTIONS = 2
"""Most corrections of a search by the difference between a finer run and its own."""


@dataclass(frozen=True)
class Design:
    """Result of an optimisation: `values` of the free numbers, SI, and the constraints and ends of ranges that are `binding`.

    The `readings`, minimised or constrained, are of a finer run at these values; `changes` are their differences from the run of
    the search. The design is `possible` if the finer run meets all constraints; the `message` names violated ones with their
    violations, and why the search ended early. `units` are those of values and readings, '' for a function. It is not `complete`
    if the budget of runs was used up: the design is then the best one so far.
    """

    values: dict[str, float]
    binding: list[str]
    readings: dict[str, float]
    changes: dict[str, float]
    possible: bool
    message: str
    runs: int
    units: dict[str, str]
    complete: bool = True

    def __str__(self) -> str:
        """Return numbers, readings, and binding constraints."""
        width = max(map(len, [*self.values, *self.readings]))
        lines = [f"{name:{width}}  {value:.6g}{unit_suffix(self.units, name)}" for name, value in self.values.items()]
        lines += [f"{name:{width}}  {value:.6g}{unit_suffix(self.units, name)}  (finer run: {self.changes[name]:+.1e})"
                  for name, value in self.readings.items()]  # fmt: skip
        lines += [f"binding: {', '.join(self.binding) or 'nothing'}"]
        return "\n".join([*lines, *([self.message] if self.message else [])])


@watch("runs")
def optimise(
    mechanism: Source,
    duration: float | None = None,
    *,
    free: Mapping[str, tuple[float, float]],
    minimise: str = "",
    subject_to: Sequence[str | tuple[str, float, float]] = (),
    readings: Mapping[str, Reading] | None = None,
    solver: Spectral | None = None,
    start: Mapping[str, float] | None = None,
    starts: int = 8,
    budget: int = BUDGET,
    timeout: float | None = None,
    progress: bool | None = None,
) -> Design:
    """Choose numbers of a mechanism that minimise a reading subject to constraints.

    Parameters
    ----------
    mechanism : Mechanism, mapping or callable
        Or the content of its file; or a function that makes one of arguments by the names in `free`.
    duration : float, optional
        s, positive; without it readings are of states of rest, or functions of the mechanism.
    free : dict of str to (low, high)
        Numbers by their paths with their ranges, SI.
    minimise : str
        A reading, as 'max(drive.torque)'; without one any design that meets the constraints is returned.
    subject_to : sequence of str or of (reading, low, high)
        Constraints, as 'max(B.contact_force) = 1.5 N ± 1 %', 'max(abs(coupler.deflection)) <= 30 mm'.
    readings : dict of str to text or callable, optional
        Readings by names that `minimise` and `subject_to` may use: texts, or functions of the mechanism that return a number.
    solver : Spectral, optional
        By default with a tolerance of 1e-8.
    start : dict of str to float, optional
        Where the search begins: numbers by their paths, SI; by default the middle of their ranges.
    starts : int
        Number of starts: that point, and points of a Halton sequence over the ranges; minima are sought from the best of them.
    budget : int
        Largest number of runs, with those for derivatives; then the best design so far is returned, with `complete` False.
    timeout, progress
        Limit of time [s], after which the best so far is the answer; how long it takes is shown, by default in terminals.

    Returns
    -------
    Design
        `possible` is False, and `message` says why, if no design met the constraints.

    Raises
    ------
    ValueError
        On wrong input, before anything runs.
    RunFailedError
        If no start leads to a run that ends.
    """
    needs_compiler()
    wants, known = [parse_want(each) for each in subject_to], readings or {}
    names = list(dict.fromkeys([*([minimise] if minimise else []), *(want.name for want in wants)]))
    if not names:
        raise ValueError("minimise and subject_to: neither; give a reading")
    span = None if duration is None else float(positive("duration", duration, "s"))
    used = readings_of({name: known.get(name, name) for name in names}, moving=span is not None)
    check_ranges(free)
    family = Family.of(mechanism, free, dict.fromkeys(free, 0.0))
    count, budget = whole("starts", starts, 1, 10**9), whole("budget", budget, 1, 10**9)
    others = qmc.Halton(len(free), rng=np.random.default_rng(0)).random(count - 1)
    search = Search(family, used, minimise, wants, dict(free), span, solver or replace(STEADY, degree=8), budget)
    watching.get().most = budget
    return _answer(search, [_first(free, start or {}), *others])


def _first(ranges: Mapping[str, tuple[float, float]], start: Mapping[str, float]) -> Array:
    """Scale the start to the unit cube."""
    for name, value in start.items():
        if name not in ranges:
            raise ValueError(f"start['{name}']: free has no range of that name")
        low, high = ranges[name]
        if not low <= value <= high:
            raise ValueError(f"start['{name}'] = {value:g}: must lie in its range, {low:g} to {high:g}")
    return np.array([(start.get(name, 0.5 * (low + high)) - low) / (high - low) for name, (low, high) in ranges.items()])


def _answer(search: Search, starts: Sequence[Array]) -> Design:
    """Search, and compare with a finer run; if that violates a constraint, search again with readings corrected by it."""
    _until_enough(search, lambda: search.from_starts(starts))
    tried: list[tuple[Array, Array, Array]] = []
    for _ in range(1 + MOST_CORRECTIONS):
        x = search.best()
        if x is None:
            if search.stopped:
                raise RunFailedError(f"{search.stopped}, before any run ended")
            raise RunFailedError(f"no start leads to a run that ends; narrow the ranges. The first: {search.failed}")
        if tried and point_of(x) == point_of(tried[-1][0]):
            break
        found, fine = search.cache[point_of(x)], search.check(x)
        tried.append((x, found, fine))
        if not search.list_violated(fine) or search.stopped or search.runs >= search.budget:
            break
        search.offset = fine - found
        _until_enough(search, lambda x=x: search.descend(x))  # type: ignore[misc]
    return _design(search, *min(tried, key=lambda one: search.merit(one[2])))


def _until_enough(search: Search, step: Callable[[], object]) -> None:
    """Take a step of a search; it ends early if runs or time are used up, or if all that was sought is found."""
    try:
        step()
    except EnoughError:
        pass
    except STOPS as stop:
        search.stopped = str(stop)


def _design(search: Search, x: Array, found: Array, fine: Array) -> Design:
    """Make the result, with binding and violated constraints."""
    missed, pairs = search.list_violated(fine), search.pairs(fine)
    complete = not search.stopped and (search.runs < search.budget or not (search.aim or missed))
    binding = [
        f"{name} = {'low' if u < 0.5 else 'high'} end" for u, name in zip(x, search.ranges, strict=True) if min(u, 1 - u) < BINDS
    ]
    binding += [want.text for want, value in pairs if want.binds(value)]
    wrong = "; ".join(
        f"{want.text}: {value:.6g}{unit_suffix(search.units, want.name)}, {100 * want.miss(value):.2g} % off" if isfinite(value)
        else f"{want.text}: it has no value there" for want, value in pairs if want in missed
    )  # fmt: skip
    message = f"none of the designs tried keeps {wrong}" if missed else ""
    if not complete:
        best = f"; the best so far misses {wrong}" if missed else ": this is the best so far"
        message = f"{search.stopped or f'the budget of {search.budget} runs was used up'}{best}"
    readings, changes = (dict(zip(search.readings, map(float, each), strict=True)) for each in (fine, fine - found))
    return Design(search.values(x), binding, readings, changes, not missed, message, search.runs, search.units, complete)
