"""Optimal design: numbers of a mechanism that minimise a reading subject to constraints."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import inf

import numpy as np
from scipy.stats import qmc

from ..geometry import Array
from ..mechanism import Mechanism
from ..process import TimeUpError
from ..solvers import Spectral
from ..units import behind
from ..validate import positive, whole
from .derivatives import Reading, readings_of
from .numbers import Family, Source
from .residuals import STEADY
from .runs import RunFailedError, needs_compiler
from .searching import EnoughError, Task, point_of
from .wants import BINDS, Want, parse_want

BUDGET = 1000
"""Largest number of runs of a search, by default."""
CORRECTED = 2
"""Most corrections of a search by the difference of a finer run."""


@dataclass(frozen=True)
class Design:
    """Result of an optimisation.

    Attributes
    ----------
    values : dict of str to float
        SI.
    binding : list of str
        Constraints and ends of ranges at which the design lies.
    readings : dict of str to float
        Of the finer run: what is minimised and what is constrained.
    changes : dict of str to float
        Changes of the readings by the finer run.
    possible : bool
        True if the finer run meets all constraints.
    message : str
        Violated constraints with their violations; a budget that was used up.
    runs : int
    units : dict of str to str
        Of values and readings; '' of functions of one's own.
    complete : bool
        False where the budget of runs was used up: the design is the best one so far.
    front : list of Design
        Where there are several aims: designs none of which is better in all.
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
    front: list[Design] = field(default_factory=list)

    def __str__(self) -> str:
        """Return numbers, readings, and binding constraints."""
        width = max(map(len, [*self.values, *self.readings]))
        lines = [f"{name:{width}}  {value:.6g}{behind(self.units, name)}" for name, value in self.values.items()]
        lines += [f"{name:{width}}  {value:.6g}{behind(self.units, name)}  (finer run: {self.changes[name]:+.1e})"
                  for name, value in self.readings.items()]  # fmt: skip
        lines += [f"binding: {', '.join(self.binding) or 'nothing'}"]
        return "\n".join([*lines, *([self.message] if self.message else [])])


def optimise(
    mechanism: Source,
    duration: float | Callable[[Mechanism], float] | None = None,
    *,
    free: Mapping[str, tuple[float, float] | Sequence[float]],
    minimise: str | Mapping[str, Reading] | Sequence[str] = (),
    subject_to: Sequence[str | tuple[str, float, float]] = (),
    readings: Mapping[str, Reading] | None = None,
    solver: Spectral | None = None,
    start: Mapping[str, float] | None = None,
    starts: int = 8,
    points: int = 9,
    seed: int = 0,
    budget: int = BUDGET,
) -> Design:
    """Choose numbers of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism, mapping or callable
        Or the content of its file; or a function that makes one of arguments by the names in `free`.
    duration : float or callable, optional
        s, positive, or a function of the mechanism that returns it, as one turn at a speed that is free; without it readings are
        of states of rest, or functions of the mechanism.
    free : dict of str to (low, high) or to a list
        Numbers by their paths with their ranges, SI, as pairs; a list is of values that can be bought.
    minimise : str, or several
        A reading, as 'max(drive.torque)'; of two the front is sought. Without one the constraints alone decide.
    subject_to : sequence of str or of (reading, low, high)
        As 'max(B.contact_force) = 1.5 N ± 1 %', 'max(abs(coupler.deflection)) <= 30 mm'.
    readings : dict of str to text or callable, optional
        Names for readings, which the others may use: texts, or functions of the mechanism that return a number.
    solver : Spectral, optional
        By default with a tolerance of 1e-8.
    start : dict of str to float, optional
        Where the search begins: numbers by the names of ranges, SI; the middle of those that are not named.
    starts : int
        That point, and points of a Halton sequence over the ranges; minima are sought from the best of them.
    points : int
        Of the front.
    seed : int
        Of the starts.
    budget : int
        Largest number of runs of a search, those for derivatives among them; then the best design so far is returned, with
        `complete` False. Each combination of values of lists, and each point of a front, is a search.

    Returns
    -------
    Design
        `possible` is False, and `message` says why, where the constraints cannot be kept.

    Raises
    ------
    ValueError
        On wrong input, before anything runs.
    RunFailedError
        If no start leads to a run that ends.

    References
    ----------
    D. Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28, 1988 (SLSQP of SciPy).
    Y. Y. Haimes, L. S. Lasdon, D. A. Wismer, IEEE Trans. Syst. Man Cybern. 1 (1971) 296, doi 10.1109/TSMC.1971.4308298 (fronts).
    """
    needs_compiler()
    aims = [minimise] if isinstance(minimise, str) else list(minimise)
    known = dict(readings or {}) | (dict(minimise) if isinstance(minimise, Mapping) else {})
    wants = [parse_want(each) for each in subject_to]
    names = list(dict.fromkeys([*aims, *(want.name for want in wants)]))
    if not names:
        raise ValueError("minimise and subject_to: neither; give a reading")
    if len(aims) > 2:
        raise ValueError(f"minimise: {len(aims)} readings; allowed: one or two")
    span = duration if duration is None or callable(duration) else float(positive("duration", duration, "s"))
    used = readings_of({name: known.get(name, name) for name in names}, moving=span is not None)
    ranges = {name: each for name, each in free.items() if isinstance(each, tuple) and len(each) == 2}
    lists = {name: sorted(map(float, each)) for name, each in free.items() if name not in ranges}
    for name, (low, high) in ranges.items():
        if not low < high:
            raise ValueError(f"free['{name}'] = ({low:g}, {high:g}): low must be less than high")
    family = Family.of(mechanism, free, dict.fromkeys(free, 0.0))
    count, budget = whole("starts", starts, 1, 10**9), whole("budget", budget, 1, 10**9)
    points_of_start = [
        _first(ranges, start or {}),
        *(qmc.Halton(len(ranges), rng=np.random.default_rng(seed)).random(count - 1) if ranges else ()),
    ]
    task = Task(family, used, aims, wants, ranges, span, solver or replace(STEADY, degree=8), points_of_start, budget)
    return _best(task, lists) if len(aims) < 2 else _front(task, lists, points)


def _first(ranges: Mapping[str, tuple[float, float]], start: Mapping[str, float]) -> Array:
    """Place the start in the unit cube."""
    if unknown := [name for name in start if name not in ranges]:
        raise ValueError(f"start['{unknown[0]}']: free has no range of that name")
    for name, value in start.items():
        low, high = ranges[name]
        if not low <= value <= high:
            raise ValueError(f"start['{name}'] = {value:g}: must lie in its range, {low:g} to {high:g}")
    return np.array([(start.get(name, 0.5 * (low + high)) - low) / (high - low) for name, (low, high) in ranges.items()])


def _best(task: Task, lists: Mapping[str, Sequence[float]]) -> Design:
    """Find the best design over all values of the lists."""
    found, runs = list[tuple[tuple[float, float], Task, Array]](), 0
    for values in product(*lists.values()):
        each = replace(task, kept=dict(zip(lists, values, strict=True)), cache={}, runs=0)
        try:
            each.search()
        except EnoughError:
            pass
        except TimeUpError as error:
            task.stopped = str(error)
        if (x := each.best()) is not None:
            found.append((each.merit(each.cache[point_of(x)]), each, x))
        runs += each.runs
        if task.stopped:
            break
    if not found:
        raise RunFailedError(f"no start leads to a run that ends; narrow the ranges. The first: {each.failed}")
    _, best, x = min(found, key=lambda item: item[0])
    before, best.stopped = best.runs, task.stopped
    design = _correct(best, x)
    return replace(design, runs=runs + design.runs - before)


def _correct(task: Task, x: Array) -> Design:
    """Compare with a finer run; where that violates a constraint, continue the search with its difference."""
    tried: list[tuple[Array, Array, Array]] = []
    for _ in range(1 + CORRECTED):
        found, fine = task.cache[point_of(x)], task.check(x)
        tried.append((x, found, fine))
        if not task.list_violated(fine) or not np.isfinite(fine).all():
            break
        task.offset, task.cache = fine - found, {point_of(x): found}
        if task.stopped:
            break
        try:
            task.descend(x)
        except EnoughError:
            pass
        except TimeUpError as error:
            task.stopped = str(error)
        new = task.best()
        if new is None or point_of(new) == point_of(x):
            break
        x = new
    return _design(task, *min(tried, key=lambda one: task.merit(one[2])))


def _design(task: Task, x: Array, found: Array, fine: Array) -> Design:
    """Make the result, with binding and violated constraints."""
    missed = task.list_violated(fine)
    complete = not task.stopped and (task.runs < task.budget or not (task.aims or missed))
    binding = [
        f"{name} = {'low' if u < 0.5 else 'high'} end" for u, name in zip(x, task.ranges, strict=True) if min(u, 1 - u) < BINDS
    ]
    binding += [want.text for want, value in task.pairs(fine) if want.binds(value)]
    wrong = "; ".join(
        f"{want.text}: {want.describe(value, behind(task.units, want.name))}"
        for want, value in task.pairs(fine)
        if want in missed
    )
    message = f"none of the designs tried keeps {wrong}" if missed else ""
    if not complete:
        best = f"; the best so far misses {wrong}" if missed else ": this is the best so far"
        why = task.stopped or f"the budget of {task.budget} runs was used up"
        message = f"{why}{best}"
    readings, changes = (dict(zip(task.readings, map(float, each), strict=True)) for each in (fine, fine - found))
    return Design(task.values(x), binding, readings, changes, not missed, message, task.runs, task.units, complete)


def _front(task: Task, lists: Mapping[str, Sequence[float]], points: int) -> Design:
    """Find designs of two aims: the first is least while the second does not exceed values between its own extremes."""
    first, second = task.aims
    low, high = (_best(replace(task, aims=[name]), lists) for name in (second, first))
    made = [low]
    for limit in np.linspace(low.readings[second], high.readings[second], points)[1:-1]:
        want = Want(f"{second} <= {limit:.6g}", second, -inf, float(limit))
        made.append(_best(replace(task, aims=[first], wants=[*task.wants, want]), lists))
    made.append(high)

    def is_better(a: Design, b: Design) -> bool:
        """Check whether a dominates b."""
        pairs = [(a.readings[name], b.readings[name]) for name in task.aims]
        return all(x <= y for x, y in pairs) and any(x < y for x, y in pairs)

    kept = [one for one in made if one.possible and not any(is_better(other, one) for other in made if other.possible)]
    apart = {tuple(f"{value:.6g}" for value in one.values.values()): one for one in kept}  # those that read the same are one
    runs, complete = sum(one.runs for one in made), all(one.complete for one in made)
    return replace(high, front=list(apart.values()), runs=runs, complete=complete)
