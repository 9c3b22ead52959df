"""A run held against the other solver: Exudyn against the compiled one, which share the elements and none of the equations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import nan
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.accuracy.delivery import Delivery, Task, comparable
from buckler.mbs.accuracy.difference import FINEST, difference
from buckler.mbs.accuracy.predictable import cut, predictable
from buckler.mbs.accuracy.ways import by_exudyn, compiled
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
NAMES: dict[type, str] = {Exudyn: "Exudyn", Spectral: "the compiled solver", Closure: "loop closure"}


def verify(result: Result, mechanism: Mechanism, duration: float, solver: Any, run: Callable[..., Run]) -> Result:
    """Run another solver and put the difference into the result; SUSPECT, SOLVERS in the message, where it is too large.

    Without clearance the whole run is compared; with clearance what can be predicted, as rattling is chaotic.

    Parameters
    ----------
    result : Result
        A run that is to be trusted; a failed one is given back as it is.
    mechanism : Mechanism
    duration : float
        s.
    solver : Exudyn, Spectral or Closure
        Which made it.
    run : callable
        `run(mechanism, duration, solver)` makes one `Run`.

    Returns
    -------
    Result
        With `verified`; where the other solver does not know the mechanism or does not finish, with a note that says so.
    """
    if result.status not in (Status.OK, Status.SUSPECT):
        return result
    mine, other = type(solver), Exudyn if isinstance(solver, Spectral) else Spectral
    span = predictable(mechanism, duration)
    start = perf_counter()
    try:
        delivery = _run(mechanism, span, other, result.asked, run)
    except (ValueError, NotImplementedError, ImportError) as reason:
        return _noted(result, f"not verified: {NAMES[other]} does not take this mechanism: {reason}")
    result = replace(result, work=result.work | {"verify_s": perf_counter() - start})
    failure = delivery.run.failure
    if failure is not None:
        return _noted(result, f"not verified: {NAMES[other]} ended as {failure[0]}: {failure[1]}")
    compared = delivery.complete(comparable(delivery.run), 0.0)
    if not all(np.isfinite(values).all() for one in (result, compared) for values in one.signals.values()):
        return _noted(result, "not verified: a signal is not finite")
    apart, (limit, why) = difference(cut(result, span), compared), _limit(result.error.motion, delivery.errors.motion)
    result = replace(result, verified=apart)
    if apart <= limit:
        return result
    return result.suspect(f"SOLVERS: {NAMES[mine]} and {NAMES[other]} are {apart:.2g} apart, allowed {limit:.2g}, {why}")


def _run(mechanism: Mechanism, span: float, other: type, asked: float, run: Callable[..., Run]) -> Delivery:
    """The other solver's run, with an estimate of its error where an accuracy was asked for."""
    if asked > 0:
        return (compiled if other is Spectral else by_exudyn(mechanism))(Task(mechanism, span, asked), run)
    return Delivery(run(mechanism, span, other()), nan, Errors())


def _limit(first: float, second: float) -> tuple[float, str]:
    """Difference allowed, and what it is."""
    if np.isfinite(first) and np.isfinite(second):
        return max(first + second, FINEST), "the sum of their estimated errors"
    return APART, "for want of an estimate of either error"


def _noted(result: Result, note: str) -> Result:
    notes = [*result.provenance.get("notes", ()), note]
    return replace(result, provenance=result.provenance | {"notes": notes})
