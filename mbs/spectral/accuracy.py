"""A run of the compiled solver that knows its error: it is compared with the coarser run that led to it.

Each run of the series has a tolerance 8 times smaller than the one before, and so steps half as long, and strips of two degrees
more. The finer of two neighbours is told to have their whole difference as its error, which suffices for any rate from the
first order up. All runs but the last cost as much together as the last.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from buckler.mbs.accuracy.difference import difference
from buckler.mbs.engine.settings import Controlled
from buckler.mbs.record.result import Result, Status
from buckler.mbs.record.run import Run
from buckler.mbs.spectral.run import once
from buckler.mbs.spectral.solver import Spectral
from buckler.mbs.validate import number, positive

FIRST, SHORTER, MOST, SHARE = 1e-5, 8.0, 9, 1.0
"""First tolerance, ratio of neighbours, most runs, share of the difference that is told."""
COARSEST_DEGREE, HIGHEST_DEGREE = 4, 24


@dataclass(frozen=True)
class Known:
    """A run, the estimate of its error in the sense of `mbs.accuracy.difference`, and how many runs it took."""

    run: Run
    error: float
    runs: int


def known(
    mechanism: Any, duration: float, accuracy: float, solver: Spectral | None = None, run: Callable[..., Run] = once
) -> Known:
    """Run a mechanism so that its error is below the accuracy asked for, and known.

    Parameters
    ----------
    mechanism : Mechanism
    duration : float
        s.
    accuracy : float
        Largest relative error of the motion, 1e-7 to 0.1.
    solver : Spectral, optional
        Its steps and degree are chosen here, the rest stays.
    run : callable
        `run(mechanism, duration, solver)` makes one run; one that ends for want of time ends the series.

    Returns
    -------
    Known
        The last run; its error is larger than asked where the series ended first, and infinite where a run failed.
    """
    positive("duration", duration, "s"), number("accuracy", accuracy, 1e-7, 0.1, "1")
    solver = solver or Spectral()
    before: Result | None = None
    found, error = None, float("inf")
    for k in range(MOST):
        degree = min(COARSEST_DEGREE + 2 * k, HIGHEST_DEGREE)
        steps = Controlled(tolerance=FIRST / SHORTER**k, max_step=duration / (100 * 2 ** (k / 2)))
        share = solver.contact_tolerance / 2**k
        found = run(mechanism, duration, replace(solver, steps=steps, degree=degree, contact_tolerance=share))
        if found.failure is not None:
            before, error = None, float("inf")
            if found.failure[0] is Status.TIMED_OUT:
                break
            continue
        now = Result(Status.OK, "", found.record.time, *found.signals, found.work)
        if before is not None:
            error = SHARE * difference(before, now)
            if error <= accuracy:
                return Known(found, error, k + 1)
        before = now
    assert found is not None
    return Known(found, error, k + 1)
