"""A run held against the other solver: Exudyn against the compiled one, which share the elements and none of the equations."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from time import perf_counter

import numpy as np

from buckler.mbs.accuracy.compare import Functions, compare, relative
from buckler.mbs.accuracy.deliver import Climb, Delivery, deliver, noted
from buckler.mbs.accuracy.estimate import ROUNDING, parted
from buckler.mbs.accuracy.goal import IMPULSE, Asked, Usual, Worst
from buckler.mbs.accuracy.ladder import Runner, ladder_of
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
