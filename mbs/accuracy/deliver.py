"""A run with its error: the coarsest rung of a ladder whose error, by two finer rungs, is what is allowed.

A round is three runs: one, one finer in time, one finer in space where there is any. The first is handed back: its error is
known, that of the finer ones is not. The larger part is refined; the difference of one that is not is kept. It ends when all is
within, when refining no longer helps, or when the runs are used up; no clock decides. A result may be held against the other
solver besides: Exudyn and the compiled one share the elements and none of the equations.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ..elements.clearance import clearances
from ..elements.signal import Kind
from ..mechanism import Mechanism
from ..record.errors import Errors, Status
from ..record.result import Result
from ..record.run import Run
from ..solvers import Closure, Controlled, Exudyn, Spectral
from .compare import Functions, compare, relative
from .estimate import ROUNDING, Look, Pair, look, parted
from .goal import IMPULSE, PLACE, Asked, Goal, Usual, Worst, worst
from .ladder import GAIN, ORDER, STRICTER, Ladder, Runner, ladder_of, suited

RUNS, PATIENCE = 12, 3
"""Most runs for one result; most rungs gone at once, and rounds of refining that may leave the error as large as it was: runs
that do not follow a ringing differ by all of it."""
HELPED = GAIN ** (1 / ORDER)
"""By how much a round lessened the error if it helped, and how many times later runs part then: an error that goes by the fourth
power of time is as large so many times later on the next rung."""
UNKNOWN = Worst("", inf, 1.0)
CURED = (Status.NEWTON_DIVERGED, Status.SINGULAR, Status.NOT_FINITE, Status.ENGINE_ERROR)
"""Failures that finer steps may cure."""


class Rung(NamedTuple):
    """Where on the ladder."""

    time: int = 0
    space: int = 0


START, JUDGE = Rung(), Rung(2, 1)
"""First of a ladder; of the compiled solver's, that which is held against Exudyn's run: it costs a fifth to a half of it."""


@dataclass(frozen=True)
class Delivery:
    """A run, its errors, unknown where no finer run could be made, and what is farthest beyond what is allowed.

    `made` counts runs by the solver's name.
    """

    run: Run
    made: Mapping[str, int]
    errors: Errors = field(default_factory=Errors)
    worst: Worst = UNKNOWN

    def complete(self, result: Result, goal: Goal, wall: float) -> Result:
        """The run's result with its errors and the work of all runs; SUSPECT where it misses."""
        counts = {f"{name}_runs": float(n) for name, n in self.made.items()}
        work = result.work | {"wall_s": wall, "runs": sum(counts.values())} | counts
        found = noted(replace(result, work=work, asked=goal.asked, error=self.errors), *self.errors.notes)
        missed = "" if self.run.failure else self.missed(goal)
        return found.suspect(missed) if missed else found

    def missed(self, goal: Goal) -> str:
        """Why it is not what was asked for, in a sentence; '' if it is."""
        count = sum(self.made.values())
        if not self.errors.known:
            return f"ACCURACY: no finer run could be made, so that the error is not known ({count} runs)"
        if self.worst.ratio <= 1:
            return ""
        name, error, allowed = self.worst
        off = f"is off by {_share(error)} (relative error), allowed {_share(allowed)}"
        why = ", mostly by its elements" if self.errors.space.get(name, 0.0) > error / 2 else ""
        return f"ACCURACY: '{name}' {off}{why}, after {count} runs; asked of {goal.words}"


def noted(result: Result, *notes: str) -> Result:
    """The result with notes."""
    every = [*result.provenance.get("notes", ()), *notes]
    return replace(result, provenance=result.provenance | ({"notes": every} if every else {}))


def _share(error: float) -> str:
    """A relative error, for a sentence."""
    return f"{100 * error:.2g} %" if 1e-3 <= error < 10 else f"{error:.1e}"


class Climb:
    """Runs of a ladder, each made once.

    `run(mechanism, duration, solver)` makes one; `made` is where runs are counted, by the solver's name.
    """

    def __init__(self, ladder: Ladder, run: Runner, made: dict[str, int] | None = None) -> None:
        self.ladder, self._run = ladder, run
        self.runs: dict[Rung, Run] = {}
        self.made = {} if made is None else made
        self._functions: dict[Rung, Functions | None] = {}

    def run(self, at: Rung) -> Run:
        """The run of a rung."""
        if at not in self.runs:
            self.runs[at] = made = self.ladder.made(*at, self._run)
            name = type(made.solver).__name__.lower()
            self.made[name] = self.made.get(name, 0) + 1
        return self.runs[at]

    def functions(self, at: Rung) -> Functions | None:
        """Its signals; None of a run that failed."""
        if at not in self._functions:
            run = self.run(at)
            failed = run.failure is not None or len(run.record.time) < 2
            self._functions[at] = None if failed else Functions.of(run)
        return self._functions[at]


def deliver(climb: Climb, goal: Goal, at: Rung = START, rival: Climb | None = None) -> Delivery:
    """Run until the error is known and allowed, or tell what was reached.

    `at` is the first rung. The first run of a `rival` is handed back as soon as a run shows that it is within.
    """
    futile, best, other, parts_at = 0, None, None, 0.0
    wide: Pair | None = None
    while True:
        base = climb.functions(at)
        if rival and base and (first := rival.functions(START)):
            seen = look(first, base)
            other = delivered(rival, goal, START, seen, "one of the other solver")
            if other.worst.ratio <= 1:
                return other
            parts_at = parts_at or (seen.parts_at if seen.parts_at < inf else 0.0)
        failure = climb.run(at).failure
        if base is None and best is None and failure is not None and failure[0] in CURED and at.time < PATIENCE:
            at = at._replace(time=at.time + 1)
            continue
        finer = climb.functions(at._replace(time=at.time + 1)) if base else None
        if climb.ladder.in_space and finer and not wide:
            wider = climb.functions(at._replace(space=at.space + 1))
            wide = (base, wider) if base and wider else None
        if not base or not finer or (climb.ladder.in_space and not wide):
            return _nearest(best, other) or Delivery(climb.run(at), climb.made)
        seen = look(base, finer, wide, parts_at * HELPED)
        now = delivered(climb, goal, at, seen)
        futile += best is not None and HELPED * now.worst.ratio > best.worst.ratio
        best = now if best is None or now.worst.ratio <= best.worst.ratio else best
        after = _next(goal, seen, at)
        if now.worst.ratio <= 1 or futile >= PATIENCE or sum(climb.made.values()) + 2 > RUNS or after == at:
            return _nearest(best, other) or best
        at, wide, parts_at = after, wide if after.space == at.space else None, seen.parts_at


def _nearest(*found: Delivery | None) -> Delivery | None:
    """That which is least beyond what is allowed, of those that are known."""
    return min(filter(None, found), key=lambda each: each.worst.ratio, default=None)


def plain(mechanism: Mechanism, duration: float, run: Runner) -> Delivery:
    """Run without settings: Exudyn's, held against runs of the compiled solver, which shares none of the equations.

    The compiled solver climbs its ladder until one of its runs is within `Usual`, or shows that Exudyn's is. What it does not
    take, or would have to compile from a function in Python, climbs Exudyn's ladder; what constraints alone decide, that of
    loop closure.
    """
    goal, solver = Usual(), suited(mechanism)
    if not isinstance(solver, Spectral):
        return deliver(Climb(ladder_of(mechanism, duration, PLACE, solver), run), goal)
    engine = Climb(ladder_of(mechanism, duration, PLACE, Exudyn()), run)
    base = engine.functions(START)
    if base is None:
        return Delivery(engine.run(START), engine.made)
    steps = Controlled(max_steps=RUNS * RUNS * len(base.time))  # one that takes as many as so many results does not suit it
    compiled = Climb(ladder_of(mechanism, duration, PLACE, Spectral(steps)), run, engine.made)
    return deliver(compiled, goal, JUDGE, engine) if compiled.functions(JUDGE) else deliver(engine, goal)


def _next(goal: Goal, seen: Look, at: Rung) -> Rung:
    """The rung to try: the larger part is refined, again and again, until the sum is expected to be half of what is allowed.

    Of two runs that part it is the next one, to see whether it parts later.
    """
    if seen.parts_at < seen.until:
        return Rung(at.time + 1, at.space)
    time, space = (worst(goal, seen.base, part).ratio for part in seen.told)
    up = out = 0
    while 2 * (time + space) > 1 and max(up, out) < PATIENCE:
        if time >= space:
            time, up = time / GAIN, up + 1
        else:
            space, out = space / STRICTER, out + 1
    return Rung(at.time + up, at.space + out)


def delivered(climb: Climb, goal: Goal, at: Rung, seen: Look, by: str = "") -> Delivery:
    """The run of a rung with what a round shows of its errors; `by` says what it was held against."""
    base, run, (time, space) = seen.base, climb.run(at), seen.told
    total = {name: error + space.get(name, 0.0) for name, error in time.items()}
    sizes = {name: apart.scale for part in (seen.space, seen.time) for name, apart in part.items()}
    places = [total[name] for name, signal in base.signals.items() if signal.kind is Kind.PLACE and name in total]
    by = by or "one finer in time" + (" and one finer in space" if seen.space else "")
    ringing = [name.removesuffix(".mean") for name, signal in base.signals.items() if signal.period]
    rings = tuple(name for name in ringing if total.get(name, 0.0) > IMPULSE)
    notes: tuple[str, ...] = ()
    if seen.until < inf:
        one = f"the motion is one trajectory to about t = {seen.until:.4g} s: beyond, runs that differ in their steps part"
        notes = (f"{one}, and it is one of many; errors are those up to then",)
    if rings:
        others = " and others" if len(rings) > 1 else ""
        notes += (f"{rings[0]}{others}: rings faster than the steps follow; read {rings[0]}.mean",)
    errors = Errors(
        max(places, default=0.0), total, f"a run of {type(run.solver).__name__} beside {by}", climb.ladder.in_space,
        time=time, space=space, sizes=sizes, until=min(seen.until, float(base.time[-1])), unresolved=rings, notes=notes,
    )  # fmt: skip
    return Delivery(run, climb.made, errors, worst(goal, base, total))


LEAST = 0.1
"""Of an accuracy: smaller differences are not asked about."""
NAMES: dict[type, str] = {Exudyn: "Exudyn", Spectral: "the compiled solver", Closure: "loop closure"}


def disagreement(a: Run, b: Run, mine: Errors, other: Errors, least: float = ROUNDING) -> tuple[float, Worst]:
    """How far two runs are apart, as long as they are one trajectory, in what a run without settings is held to (`Usual`).

    Allowed is the sum of their errors, or `least` if that is more; where one is not known, as much as of impulses. Of the places
    the largest relative difference, and the signal that is farthest beyond what is allowed.
    """
    first, second = Functions.of(a), Functions.of(b)
    known = mine.known and other.known
    ends = [each.until for each in (mine, other) if each.known]
    chaotic = min(ends) < first.time[-1] if known else bool(clearances(a.record.mechanism))
    apart = relative(compare(first, second, min([parted(first, second), *ends]) if chaotic else inf))
    motion = max((apart[n] for n, signal in second.signals.items() if signal.kind is Kind.PLACE and n in apart), default=0.0)
    judged = [name for name in Usual().limits(second) if name in apart]
    sums = {name: max(least, mine.signals.get(name, 0.0) + other.signals.get(name, 0.0)) for name in judged}
    farthest = [Worst(name, apart[name], sums[name] if known else IMPULSE) for name in judged]
    return motion, max(farthest, key=lambda each: each.ratio)


def verified(result: Result, made: Run, mechanism: Mechanism, duration: float, run: Runner) -> Result:
    """Run another solver and put the difference into the result; SUSPECT, SOLVERS in the message, where it is too large.

    A failed result is given back as it is; where the other solver does not know the mechanism or does not finish, with a note.
    """
    if result.status not in (Status.OK, Status.SUSPECT):
        return result
    other: Exudyn | Spectral = Exudyn() if isinstance(made.solver, Spectral) else Spectral()
    mine, theirs = NAMES[type(made.solver)], NAMES[type(other)]
    start, asked = perf_counter(), result.asked > 0
    try:
        if asked:
            found = deliver(Climb(ladder_of(mechanism, duration, result.asked, other), run), Asked(result.asked))
        else:
            found = Delivery(run(mechanism, duration, other), {})
    except (ValueError, NotImplementedError, ImportError) as reason:
        return noted(result, f"not verified: {theirs} does not take this mechanism: {reason}")
    result = replace(result, work=result.work | {"verify_s": perf_counter() - start})
    second, errors = found.run, found.errors
    if second.failure is not None:
        return noted(result, f"not verified: {theirs} ended as {second.failure[0]}: {second.failure[1]}")
    if not all(np.isfinite(values).all() for values in (*result.signals.values(), *second.values.values())):
        return noted(result, "not verified: a signal is not finite")
    motion, (name, off, allowed) = disagreement(made, second, result.error, errors, LEAST * result.asked if asked else ROUNDING)
    result = replace(result, verified=motion)
    why = "the sum of their errors" if result.error.known and errors.known else "for want of an estimate of either error"
    said = f"SOLVERS: {mine} and {theirs} are {off:.2g} apart in '{name}', allowed {allowed:.2g}, {why}"
    return result.suspect(said) if off > allowed else result
