"""A run with its error: the coarsest rung of a ladder whose error, by two finer rungs, is what is allowed.

A round is three runs: one, one finer in time, one finer in space where there is any. Their differences are the errors in time and
in space of the first, which is what is handed back: its error is known, that of the finer ones is not. Where the sum is too
large, each part that takes more than half of what is allowed is refined by as many rungs as theory says, and the other part's
difference is kept. It ends when all is within, when refining no longer helps, or when the runs are used up; no clock decides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import ceil, inf, log
from typing import NamedTuple

from buckler.mbs.accuracy.compare import Apart, Functions, compare
from buckler.mbs.accuracy.estimate import REMAINDER, Differences, parted
from buckler.mbs.accuracy.goal import BALANCE, Asked, Worst, worst
from buckler.mbs.accuracy.ladder import Ladder, Runner
from buckler.mbs.accuracy.means import means
from buckler.mbs.elements.element import Kind
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run
from buckler.mbs.record.status import Status

RUNS = 12
"""Most runs for one result."""
GAIN, WIDENS = 5.0, 10.0
"""What a rung in time and one in space make of an error."""
MOST = 3
"""Rungs gone at once."""
FUTILE = 2
"""Rounds of refining that may leave the error as large as it was."""
RESOLVED = 0.05
"""Error of a force that rings, beyond which it is said not to be resolved: its mean is to be read instead."""
HELPED = 0.7
"""Of the error, below which a round helped."""
CURED = (Status.NEWTON_DIVERGED, Status.SINGULAR, Status.NOT_FINITE, Status.ENGINE_ERROR)
"""Failures that finer steps may cure."""


class Rung(NamedTuple):
    """Where on the ladder: rungs in time and in space."""

    time: int = 0
    space: int = 0


@dataclass(frozen=True)
class Delivery:
    """A run, its errors, and how they compare with what is allowed.

    Attributes
    ----------
    run : Run
    errors : Errors
        Unknown where no finer run could be made.
    worst : Worst
        What is farthest beyond what is allowed.
    made : mapping of str to int
        How many runs were made, by the solver's name.
    """

    run: Run
    errors: Errors
    worst: Worst
    made: Mapping[str, int]

    def complete(self, result: Result, goal: Asked, wall: float) -> Result:
        """The run's result with its errors, its means of forces that ring, and the work of all runs; SUSPECT where it misses."""
        extra = list(means(self.run.record.mechanism, result.time, self.run.signals))
        work = {"wall_s": wall, "runs": float(sum(self.made.values()))} | {
            f"{name}_runs": float(n) for name, n in self.made.items()
        }
        told = {"notes": [*result.provenance.get("notes", ()), *self.errors.notes]} if self.errors.notes else {}
        found = replace(
            result,
            signals=result.signals | {signal.name: signal.values for signal in extra},
            units=result.units | {signal.name: signal.unit for signal in extra},
            traits=result.traits | {signal.name: signal.trait for signal in extra},
            work=result.work | work, asked=goal.level, error=self.errors, provenance=result.provenance | told,
        )  # fmt: skip
        missed = "" if self.run.failure else self.missed(goal)
        return found.suspect(missed) if missed else found

    def missed(self, goal: Asked) -> str:
        """Why it is not what was asked for, in a sentence; '' if it is."""
        count = sum(self.made.values())
        if not self.errors.known:
            return f"ACCURACY: no finer run could be made, so that the error is not known ({count} runs)"
        if self.worst.ratio <= 1:
            return ""
        name, error, allowed = self.worst
        off = f"is off by {_share(error)} (relative error), allowed {_share(allowed)}"
        return f"ACCURACY: '{name}' {off}, after {count} runs; asked of {goal.words}"


def _share(error: float) -> str:
    """A relative error, for a sentence."""
    return f"{100 * error:.2g} %" if 1e-3 <= error < 10 else f"{error:.1e}"


class _Climb:
    """Runs of a ladder, each made once."""

    def __init__(self, ladder: Ladder, run: Runner) -> None:
        self.ladder, self._run = ladder, run
        self.runs: dict[Rung, Run] = {}
        self.made: dict[str, int] = {}
        self._functions: dict[Rung, Functions] = {}

    def run(self, at: Rung) -> Run:
        """The run of a rung."""
        if at not in self.runs:
            self.runs[at] = self.ladder.made(*at, self._counted)
        return self.runs[at]

    def _counted(self, *what: object) -> Run:
        made = self._run(*what)  # type: ignore[arg-type]
        name = type(made.solver).__name__.lower()
        self.made[name] = self.made.get(name, 0) + 1
        return made

    def functions(self, at: Rung) -> Functions | None:
        """Its signals; None of a run that failed."""
        if self.run(at).failure is not None or len(self.run(at).record.time) < 2:
            return None
        if at not in self._functions:
            self._functions[at] = Functions.of(self.runs[at])
        return self._functions[at]


Pair = tuple[Functions, Functions]


class _Look(NamedTuple):
    """What a round shows: a run and two finer ones.

    `wide` is the pair whose difference is the error in space, None where none could be made; `known` is whether all could be.
    """

    base: Functions
    parts: Differences
    wide: Pair | None
    until: float
    known: bool


def _look(climb: _Climb, at: Rung, base: Functions, wide: Pair | None, tried: bool) -> _Look:
    """Hold the run of a rung against its finer ones, to the time to which they are one trajectory."""
    finer = climb.functions(at._replace(time=at.time + 1))
    if wide is None and climb.ladder.in_space:
        other = climb.functions(at._replace(space=at.space + 1))
        wide = None if other is None else (base, other)
    narrow = None if finer is None else (base, finer)
    until = min((parted(*pair, tried) for pair in (narrow, wide) if pair is not None), default=inf)
    in_time = {} if finer is None else compare(base, finer, until)
    in_space = {} if wide is None else compare(*wide, until)
    parts = Differences(in_time | {BALANCE: Apart(base.balance / REMAINDER, 1.0)}, in_space)
    return _Look(base, parts, wide, until, finer is not None and (wide is not None or not climb.ladder.in_space))


def deliver(ladder: Ladder, goal: Asked, run: Runner, budget: int = RUNS) -> Delivery:
    """Run until the error is known and allowed, or tell what was reached.

    Parameters
    ----------
    ladder : Ladder
    goal : Asked
    run : callable
        `run(mechanism, duration, solver)` makes one run.
    budget : int
        Most runs.
    """
    climb, at, wide, futile = _Climb(ladder, run), Rung(), None, 0
    best: Delivery | None = None
    while True:
        base = climb.functions(at)
        if base is None:
            failure = climb.run(at).failure
            if best is None and failure is not None and failure[0] in CURED and at.time < MOST:
                at = at._replace(time=at.time + 1)
                continue
            return best or Delivery(climb.run(at), Errors(), Worst("", inf, goal.level), climb.made)
        look = _look(climb, at, base, wide, tried=False)
        now = _delivery(climb, goal, at, look)
        if best is not None and now.worst.ratio > max(1.0, HELPED * best.worst.ratio):
            futile, look = futile + 1, _look(climb, at, base, look.wide, tried=True)
            now = _delivery(climb, goal, at, look)
        best = now if best is None or now.worst.ratio <= best.worst.ratio else best
        after = _next(ladder, goal, base, at, look.parts)
        used = sum(climb.made.values()) + 2 > budget
        if now.worst.ratio <= 1 or futile >= FUTILE or not look.known or used or after == at:
            return best
        at, wide = after, look.wide if after.space == at.space else None


def _delivery(climb: _Climb, goal: Asked, at: Rung, look: _Look) -> Delivery:
    """The run of a rung with what a round shows of its errors."""
    if not look.known:
        return Delivery(climb.run(at), Errors(), Worst("", inf, goal.level), climb.made)
    errors = _errors(climb.ladder, look.base, look.parts, climb.run(at), look.until)
    return Delivery(climb.run(at), errors, worst(goal, look.base, errors.signals), climb.made)


def _next(ladder: Ladder, goal: Asked, base: Functions, at: Rung, parts: Differences) -> Rung:
    """The rung to try: each part beyond half of what is allowed is refined by as many rungs as its order says."""
    in_time, in_space = parts.told()
    time, space = worst(goal, base, in_time).ratio, worst(goal, base, in_space).ratio
    up = min(MOST, ceil(log(max(2 * time, 1.0)) / log(GAIN)))
    out = min(MOST, ceil(log(max(2 * space, 1.0)) / log(WIDENS))) if ladder.refines_space and in_space else 0
    return Rung(at.time + up, at.space + out)


def _errors(ladder: Ladder, base: Functions, parts: Differences, run: Run, until: float) -> Errors:
    """Of all signals, with their parts."""
    in_time, in_space = parts.told()
    total = {name: error + in_space.get(name, 0.0) for name, error in in_time.items()}
    places = [name for name, signal in base.signals.items() if signal.kind is Kind.PLACE and name in total]
    solver = type(run.solver).__name__
    kind = f"a run of {solver} beside one finer in time" + (" and one finer in space" if ladder.in_space else "")
    notes: tuple[str, ...] = ()
    if until < inf:
        notes = (
            f"the motion is one trajectory to about t = {until:.4g} s: beyond, runs that differ in their steps part, and it is "
            "one of many; errors are those up to then",
        )
    rings = tuple(
        name.removesuffix(".mean")
        for name, signal in base.signals.items()
        if signal.period and total.get(name.removesuffix(".mean"), 0.0) > RESOLVED
    )
    return Errors(
        max((total[name] for name in places), default=0.0), total, kind, ladder.in_space,
        time=in_time, space=in_space, until=min(until, float(base.time[-1])), unresolved=rings, notes=notes,
    )  # fmt: skip
