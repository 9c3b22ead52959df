"""A run with its error: the coarsest rung of a ladder whose error, by two finer rungs, is what is allowed.

A round is three runs: one, one finer in time, one finer in space where there is any. Their differences are the errors in time and
in space of the first, which is what is handed back: its error is known, that of the finer ones is not. Where the sum is too
large, the larger part is refined, then the larger of what theory says is left, until that is half of what is allowed; the
difference of a part that is not refined is kept. It ends when all is within, when refining no longer helps, or when the runs are
used up; no clock decides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

from buckler.mbs.accuracy.compare import Apart, Functions, compare
from buckler.mbs.accuracy.estimate import LATER, REMAINDER, Differences, parted
from buckler.mbs.accuracy.goal import BALANCE, Goal, Worst, worst
from buckler.mbs.accuracy.ladder import Ladder, Runner
from buckler.mbs.elements.signal import Kind
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
FUTILE = 3
"""Rounds of refining that may leave the error as large as it was: runs that do not follow a ringing differ by all of it."""
RESOLVED = 0.05
"""Error of a force that rings, beyond which it is said not to be resolved: its mean is to be read instead."""
HELPED = 0.7
"""Of the error, below which a round helped."""
UNKNOWN = Worst("", inf, 1.0)
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

    def complete(self, result: Result, goal: Goal, wall: float) -> Result:
        """The run's result with its errors and the work of all runs; SUSPECT where it misses."""
        work = {"wall_s": wall, "runs": float(sum(self.made.values()))} | {
            f"{name}_runs": float(n) for name, n in self.made.items()
        }
        told = {"notes": [*result.provenance.get("notes", ()), *self.errors.notes]} if self.errors.notes else {}
        provenance = result.provenance | told
        found = replace(result, work=result.work | work, asked=goal.asked, error=self.errors, provenance=provenance)
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


def _share(error: float) -> str:
    """A relative error, for a sentence."""
    return f"{100 * error:.2g} %" if 1e-3 <= error < 10 else f"{error:.1e}"


class Climb:
    """Runs of a ladder, each made once.

    Parameters
    ----------
    ladder : Ladder
    run : callable
        `run(mechanism, duration, solver)` makes one run.
    made : dict of str to int, optional
        Where runs are counted, by the solver's name.
    """

    def __init__(self, ladder: Ladder, run: Runner, made: dict[str, int] | None = None) -> None:
        self.ladder, self._run = ladder, run
        self.runs: dict[Rung, Run] = {}
        self.made = {} if made is None else made
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


class Look(NamedTuple):
    """What a round shows: a run and two finer ones.

    Attributes
    ----------
    wide : (Functions, Functions) or None
        The pair whose difference is the error in space; None where none could be made.
    parts_at : float
        Time, s, from which the run and the one finer in time no longer know of each other.
    until : float
        Time, s, to which they are compared.
    known : bool
        Whether all runs could be made.
    kind : str
        What they are, in words.
    """

    base: Functions
    parts: Differences
    wide: Pair | None
    parts_at: float
    until: float
    known: bool
    kind: str


def _look(climb: Climb, at: Rung, base: Functions, wide: Pair | None, before: float) -> Look:
    """Hold the run of a rung against its finer ones, in a chaotic motion to the time to which they are one trajectory.

    `before` is when a coarser run and its finer one parted, s; 0 if none was looked at.
    """
    finer = climb.functions(at._replace(time=at.time + 1))
    if wide is None and climb.ladder.in_space:
        other = climb.functions(at._replace(space=at.space + 1))
        wide = None if other is None else (base, other)
    parts_at = inf if finer is None else parted(base, finer)
    chaotic = parts_at < LATER * before < inf
    until = min(parts_at, inf if wide is None else parted(*wide)) if chaotic else inf
    in_time = {} if finer is None else _in_time(base, finer, until)
    in_space = {} if wide is None else compare(*wide, until)
    known = finer is not None and (wide is not None or not climb.ladder.in_space)
    kind = "one finer in time" + (" and one finer in space" if climb.ladder.in_space else "")
    return Look(base, Differences(in_time, in_space), wide, parts_at, until, known, kind)


def beside(base: Functions, finer: Functions) -> Look:
    """Hold a run against one that is finer in time and in space at once."""
    parts = Differences(_in_time(base, finer), {})
    return Look(base, parts, None, parted(base, finer), inf, True, "one of the other solver")


def _in_time(base: Functions, finer: Functions, until: float = inf) -> dict[str, Apart]:
    """The differences, and what the energies do not add up by.

    Of a ringing that the steps do not follow nothing is known: both runs damp it away. A place is off by its amplitude at most,
    and by what it moves.
    """
    found, unknown = compare(base, finer, until), dict.fromkeys(base.unresolved, Apart(inf, 1.0))
    if unknown:
        for name, signal in base.signals.items():
            if signal.kind is Kind.PLACE and name in found:
                way = min(base.taken / (1.0 if signal.unit == "m" else base.size), base.own[name][0])
                found |= {n: Apart(found[n].off + way, found[n].scale) for n in (name, f"{name}.peak")}
    return found | unknown | {BALANCE: Apart(base.balance / REMAINDER, 1.0)}


def deliver(climb: Climb, goal: Goal, parts_at: float = 0.0) -> Delivery:
    """Run until the error is known and allowed, or tell what was reached.

    Parameters
    ----------
    climb : Climb
    goal : Goal
    parts_at : float
        Time, s, from which a coarser run and the first one no longer know of each other; 0 where there was none.
    """
    at, wide, futile = Rung(), None, 0
    best: Delivery | None = None
    while True:
        base = climb.functions(at)
        if base is None:
            failure = climb.run(at).failure
            if best is None and failure is not None and failure[0] in CURED and at.time < MOST:
                at = at._replace(time=at.time + 1)
                continue
            return best or Delivery(climb.run(at), Errors(), UNKNOWN, climb.made)
        look = _look(climb, at, base, wide, parts_at)
        now = delivered(climb, goal, at, look)
        futile += best is not None and now.worst.ratio > HELPED * best.worst.ratio
        best = now if best is None or now.worst.ratio <= best.worst.ratio else best
        after = _next(climb.ladder, goal, look, at)
        used = sum(climb.made.values()) + 2 > RUNS
        if now.worst.ratio <= 1 or futile >= FUTILE or not look.known or used or after == at:
            return best
        at, wide, parts_at = after, look.wide if after.space == at.space else None, look.parts_at


def delivered(climb: Climb, goal: Goal, at: Rung, look: Look) -> Delivery:
    """The run of a rung with what a round shows of its errors."""
    if not look.known:
        return Delivery(climb.run(at), Errors(), UNKNOWN, climb.made)
    errors = _errors(look, climb.run(at), climb.ladder.in_space)
    return Delivery(climb.run(at), errors, worst(goal, look.base, errors.signals), climb.made)


def _next(ladder: Ladder, goal: Goal, look: Look, at: Rung) -> Rung:
    """The rung to try: the larger part is refined, again and again, until the sum is expected to be half of what is allowed.

    Of two runs that part it is the next one, to see whether it parts later. Where elements are named, that in time
    is to be what they leave of what is allowed, or where they leave nothing no more than theirs.
    """
    if look.parts_at < look.until:
        return Rung(at.time + 1, at.space)
    time, space = (worst(goal, look.base, part).ratio for part in look.parts.told())
    if not ladder.refines_space:
        time, space = time / (1.0 - space if space < 1.0 else space), 0.0
    up = out = 0
    while 2 * (time + space) > 1 and max(up, out) < MOST:
        if time >= space:
            time, up = time / GAIN, up + 1
        else:
            space, out = space / WIDENS, out + 1
    return Rung(at.time + up, at.space + out)


def _errors(look: Look, run: Run, in_space: bool) -> Errors:
    """Of all signals, with their parts."""
    base, until = look.base, look.until
    in_time, in_space_too = look.parts.told()
    total = {name: error + in_space_too.get(name, 0.0) for name, error in in_time.items()}
    sizes = {name: apart.scale for part in (look.parts.space, look.parts.time) for name, apart in part.items()}
    places = [name for name, signal in base.signals.items() if signal.kind is Kind.PLACE and name in total]
    kind = f"a run of {type(run.solver).__name__} beside {look.kind}"
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
    if rings:
        others = " and others" if len(rings) > 1 else ""
        notes += (f"{rings[0]}{others}: rings faster than the steps follow; read {rings[0]}.mean",)
    return Errors(
        max((total[name] for name in places), default=0.0), total, kind, in_space,
        time=in_time, space=in_space_too, sizes=sizes, until=min(until, float(base.time[-1])), unresolved=rings, notes=notes,
    )  # fmt: skip
