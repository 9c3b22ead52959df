"""Self-checks of a finished run, each of which yields reasons not to trust it.

No check relies on the integrator: the energy balance has formulas that the engine does not use, and others look for impossible
behaviour, as a contact that pulls or a jump to another branch. The error of a run follows from finer runs: `mbs.accuracy`.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..record.result import Result
from ..record.run import Run
from .check import Check
from .linear import linear
from .linkages import check_constraints, off_dead_centres
from .signals import check_balance, check_crossing, clock, finite, pushing, shallow
from .unbuckled import check_buckled

READABLE: tuple[Check, ...] = (finite, clock)
"""Checks that must pass before the others are made."""
CHECKS: tuple[Check, ...] = (
    *READABLE,
    check_constraints,
    check_balance,
    pushing,
    shallow,
    check_buckled,
    check_crossing,
    off_dead_centres,
    linear,
)
"""All checks, in order."""


def idle(run: Run, result: Result) -> dict[str, str]:
    """Return the checks that do not apply to a run, with the reasons in words; none for a failed run."""
    if not result.status.finished:
        return {}
    return {check.name: why for check in CHECKS if (why := check.idle(run, result))}


def suspicions(run: Run, result: Result) -> Iterator[str]:
    """Yield the faults that checks find in a run and its result, in words; none for a run that failed."""
    if not result.status.finished:
        return
    for check in READABLE:
        for fault in check(run, result):
            yield fault
            return
    for check in CHECKS[len(READABLE) :]:
        yield from check(run, result)
