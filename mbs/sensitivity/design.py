"""Optimal design: numbers of a mechanism that minimise a reading subject to constraints.

The free numbers are scaled to the unit cube: a point x of it has one coordinate, 0 to 1, for each number.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from scipy.stats import qmc

from ..geometry import Array
from ..progress import USER_STOPS, watch, watching
from ..solvers import Spectral
from ..units import unit_suffix
from ..validate import positive, whole
from .numbers import Family, Source
from .reading import RunFailedError
from .residuals import SOLVER, check_ranges
from .runs import Reading, readings_of, require_compiler
from .searching import BINDS, EnoughError, Point, Search, parse_constraint

BUDGET = 1000
"""Default of the largest number of runs of a search."""


@dataclass(frozen=True)
class Design:
    """Result of an optimisation: `values` of the free numbers, SI, and the constraints and ends of ranges that are `binding`.

    `readings`, minimised or constrained, are of a finer run at these values; `changes` are their differences from the run of the
    search. The design is `possible` if the finer run meets all constraints. It is not `complete` if the search ended early. The
    `message` lists violated constraints and why the search ended early. `units`, of values and readings, are '' for a function.
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
        width = max(map(len, [*self.values, *self.readings]))
        lines = [f"{name:{width}}  {value:.6g}{unit_suffix(self.units, name)}" for name, value in self.values.items()]
        lines += [f"{name:{width}}  {value:.6g}{unit_suffix(self.units, name)}  (finer run: {self.changes[name]:+.1e})"
                  for name, value in self.readings.items()]  # fmt: skip
        binding = f"binding: {', '.join(self.binding) or 'nothing'}"
        return "\n".join(filter(None, [*lines, binding, self.message]))


@watch("runs")
def optimise(
    mechanism: Source, duration: float | None = None, *,
    free: Mapping[str, tuple[float, float]], minimise: str = "", subject_to: Sequence[str | tuple[str, float, float]] = (),
    readings: Mapping[str, Reading] | None = None, solver: Spectral | None = None,
    start: Mapping[str, float] | None = None, starts: int = 8, budget: int = BUDGET,
    timeout: float | None = None, progress: bool | None = None,
) -> Design:  # fmt: skip
    """Choose numbers of a mechanism that minimise a reading subject to constraints.

    If no design meets the constraints, `possible` of the result is False, and its `message` says why. Raise a ValueError on wrong
    input, before anything runs, and a RunFailedError if no start leads to a run that ends.

    Parameters
    ----------
    mechanism : Mechanism, mapping or callable
        A mechanism, the content of its file, or a function that makes a mechanism from arguments with the names in `free`.
    duration : float, optional
        Duration of the runs [s], positive; without it, readings are of states of rest, or functions of the mechanism.
    free : dict of str to (low, high)
        Numbers by their paths with their ranges, SI.
    minimise : str
        A reading, as 'max(drive.torque)'; without it, any design that meets the constraints is returned.
    subject_to : sequence of str or of (reading, low, high)
        Constraints, as 'max(B.contact_force) = 1.5 N ± 1 %', 'max(abs(coupler.deflection)) <= 30 mm'.
    readings : dict of str to text or callable, optional
        Names for readings that `minimise` and `subject_to` may use: texts, or functions of the mechanism that return a number.
    solver : Spectral, optional
        Solver of the search, by default with a tolerance of 1e-8 and strips of degree 8; the finer run adds 4 to the degree.
    start : dict of str to float, optional
        First start of the search: numbers by their paths, SI; by default the middles of the ranges.
    starts : int
        Number of starts: `start`, and points of a Halton sequence over the ranges. The search descends from `start` and from
        the `searching.BEST_STARTS` (3) best of the others.
    budget : int
        Largest number of runs, derivatives included, after which the best design so far is returned.
    timeout, progress
        Limit of time [s], after which the best design so far is returned; `progress` shows the state, by default in terminals.
    """
    require_compiler()
    constraints, named = [parse_constraint(text) for text in subject_to], readings or {}
    names = list(dict.fromkeys([*([minimise] if minimise else []), *(constraint.reading for constraint in constraints)]))
    if not names:
        raise ValueError("minimise and subject_to: neither; give a reading")
    duration = None if duration is None else float(positive("duration", duration, "s"))
    used = readings_of({name: named.get(name, name) for name in names}, moving=duration is not None)
    check_ranges(free)
    family = Family.of(mechanism, free)
    count, budget = whole("starts", starts, 1, 10**9), whole("budget", budget, 1, 10**9)
    others = qmc.Halton(len(free), rng=np.random.default_rng(0)).random(count - 1)
    search = Search(family, used, minimise, constraints, dict(free), duration, solver or SOLVER, budget)
    watching.get().most = budget  # number of runs for the display of progress
    return _answer(search, [_first(free, start or {}), *others])


def _first(ranges: Mapping[str, tuple[float, float]], start: Mapping[str, float]) -> Array:
    """Scale the user's start to the unit cube of the ranges; numbers without a start are in the middle."""
    for name, value in start.items():
        if name not in ranges:
            raise ValueError(f"start['{name}']: free has no range of that name")
        low, high = ranges[name]
        if not low <= value <= high:
            raise ValueError(f"start['{name}'] = {value:g}: must lie in its range, {low:g} to {high:g}")
    return np.array([(start.get(name, 0.5 * (low + high)) - low) / (high - low) for name, (low, high) in ranges.items()])


def _answer(search: Search, starts: Sequence[Array]) -> Design:
    """Search a design; while a finer run of the design violates a constraint, correct readings by this run and search again."""
    fine: dict[Point, Array] = {}  # readings of the best point by a finer run, before and after corrections
    best: Point | None = None
    for _ in range(3):  # the search, and two corrected ones at most; then the best design is returned
        try:
            if best is None:
                search.descend_from_starts(starts)
            else:
                search.descend(np.array(best))
        except EnoughError:  # the budget of runs is used up or, with nothing to minimise, constraints are met
            pass
        except USER_STOPS as stop:  # the time limit, or Ctrl-C
            search.stopped = str(stop)
        best = search.find_best()
        if best is None:
            no_run = f"no start leads to a run that ends; narrow the ranges. The first: {search.failed}"
            raise RunFailedError(f"{search.stopped}, before any run ended" if search.stopped else no_run)
        if best in fine:  # the last correction did not change the design
            break
        fine[best] = search.read_finer(best)
        if not search.list_violated(fine[best]) or search.stopped or search.runs >= search.budget:
            break
        search.offset = fine[best] - search.cache[best]  # the cache has readings without an offset
    # of least violation or, without violation, of the least reading
    best = min(fine, key=lambda point: search.merit(fine[point]))
    return _design(search, best, fine[best])


def _design(search: Search, point: Point, fine: Array) -> Design:
    """Make the result from the best point and its readings by a finer run."""
    violated, pairs = search.list_violated(fine), search.pair_constraints(fine)
    has_all = not search.objective and not violated  # nothing is left to search for, also with the budget used up
    complete = not search.stopped and (has_all or search.runs < search.budget)
    at_ends = [(name, u < 0.5) for u, name in zip(point, search.ranges, strict=True) if min(u, 1 - u) < BINDS]
    binding = [f"{name} = {'low' if is_low else 'high'} end" for name, is_low in at_ends]
    binding += [constraint.text for constraint, value in pairs if constraint.is_binding(value)]
    violations = "; ".join(  # of the best design
        f"{each.text}: {value:.6g}{unit_suffix(search.units, each.reading)}, {100 * each.violation(value):.2g} % off"
        if isfinite(value) else f"{each.text}: it has no value there" for each, value in pairs if each in violated
    )  # fmt: skip
    message = f"none of the designs tried keeps {violations}" if violated else ""
    if not complete:
        best = f"; the best so far misses {violations}" if violated else ": this is the best so far"
        message = f"{search.stopped or f'the budget of {search.budget} runs was used up'}{best}"
    readings, changes = (dict(zip(search.readings, map(float, part), strict=True)) for part in (fine, fine - search.cache[point]))
    return Design(search.values(point), binding, readings, changes, not violated, message, search.runs, search.units, complete)
