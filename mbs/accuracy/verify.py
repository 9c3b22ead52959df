"""A run held against the other solver: Exudyn against the compiled one, which share the elements and none of the equations."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from time import perf_counter
from typing import NamedTuple

import numpy as np

from buckler.mbs.accuracy.compare import Functions, compare
from buckler.mbs.accuracy.deliver import Climb, deliver
from buckler.mbs.accuracy.estimate import ROUNDING, parted
from buckler.mbs.accuracy.goal import Asked
from buckler.mbs.accuracy.ladder import Runner, ladder_of
from buckler.mbs.accuracy.usual import Usual
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.elements.signal import Kind
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run
from buckler.mbs.record.status import Status
from buckler.mbs.solvers.closure import Closure
from buckler.mbs.solvers.exudyn import Exudyn
from buckler.mbs.solvers.spectral import Spectral

APART = 0.05
"""Difference allowed of two runs of which one has no estimate of its error."""
LEAST = 0.1
"""Of an accuracy: smaller differences are not asked about."""
NAMES: dict[type, str] = {Exudyn: "Exudyn", Spectral: "the compiled solver", Closure: "loop closure"}


class Disagreement(NamedTuple):
    """Two runs of one mechanism: of the places, the largest relative difference; and the signal that is farthest beyond what is
    allowed, its difference and what is allowed, relative.
    """

    motion: float
    name: str
    off: float
    allowed: float

    @property
    def ratio(self) -> float:
        """Difference over what is allowed."""
        return self.off / self.allowed


def disagreement(a: Run, b: Run, mine: Errors, other: Errors, least: float = ROUNDING) -> Disagreement:
    """How far two runs are apart, as long as they are one trajectory, in what a run without settings is held to (`Usual`).

    Parameters
    ----------
    a, b : Run
    mine, other : Errors
        Allowed is their sum, or `least` if that is more; where one is not known, `APART`.
    """
    first, second = Functions.of(a), Functions.of(b)
    known = mine.known and other.known
    ends = [each.until for each in (mine, other) if each.known]
    chaotic = min(ends) < first.time[-1] if known else bool(clearances(a.record.mechanism))
    apart = compare(first, second, min([parted(first, second), *ends]) if chaotic else inf)
    judged = [name for name in Usual().limits(second) if name in apart]
    places = [name for name, signal in second.signals.items() if signal.kind is Kind.PLACE and name in apart]
    allowed = {
        name: max(least, mine.signals.get(name, 0.0) + other.signals.get(name, 0.0)) if known else APART for name in judged
    }
    name = max(judged, key=lambda name: apart[name].relative / allowed[name])
    motion = max((apart[name].relative for name in places), default=0.0)
    return Disagreement(motion, name, apart[name].relative, allowed[name])


def verified(result: Result, made: Run, mechanism: Mechanism, duration: float, run: Runner) -> Result:
    """Run another solver and put the difference into the result; SUSPECT, SOLVERS in the message, where it is too large.

    Parameters
    ----------
    result : Result
        A run that is to be trusted; a failed one is given back as it is.
    made : Run
        What it was made of.
    mechanism : Mechanism
    duration : float
        s.
    run : callable
        `run(mechanism, duration, solver)` makes one `Run`.

    Returns
    -------
    Result
        With `verified`; where the other solver does not know the mechanism or does not finish, with a note that says so.
    """
    if result.status not in (Status.OK, Status.SUSPECT):
        return result
    other: Exudyn | Spectral = Exudyn() if isinstance(made.solver, Spectral) else Spectral()
    mine, theirs = NAMES[type(made.solver)], NAMES[type(other)]
    start = perf_counter()
    try:
        second, errors = _run(mechanism, duration, other, result.asked, run)
    except (ValueError, NotImplementedError, ImportError) as reason:
        return _noted(result, f"not verified: {theirs} does not take this mechanism: {reason}")
    result = replace(result, work=result.work | {"verify_s": perf_counter() - start})
    if second.failure is not None:
        return _noted(result, f"not verified: {theirs} ended as {second.failure[0]}: {second.failure[1]}")
    if not all(np.isfinite(values).all() for values in (*result.signals.values(), *second.values.values())):
        return _noted(result, "not verified: a signal is not finite")
    least = LEAST * result.asked if result.asked > 0 else ROUNDING
    found = disagreement(made, second, result.error, errors, least)
    result = replace(result, verified=found.motion)
    if found.ratio <= 1:
        return result
    why = "the sum of their errors" if result.error.known and errors.known else "for want of an estimate of either error"
    apart = f"{found.off:.2g} apart in '{found.name}', allowed {found.allowed:.2g}"
    return result.suspect(f"SOLVERS: {mine} and {theirs} are {apart}, {why}")


def _run(mechanism: Mechanism, duration: float, solver: Exudyn | Spectral, asked: float, run: Runner) -> tuple[Run, Errors]:
    """The other solver's run, with an estimate of its error where an accuracy was asked for."""
    if asked > 0:
        delivery = deliver(Climb(ladder_of(mechanism, duration, asked, solver), run), Asked(asked))
        return delivery.run, delivery.errors
    return run(mechanism, duration, solver), Errors()


def _noted(result: Result, note: str) -> Result:
    notes = [*result.provenance.get("notes", ()), note]
    return replace(result, provenance=result.provenance | {"notes": notes})
