"""Self-checks of a finished run: each gives the reasons for which it must not be trusted.

No check relies on the integrator: energy is balanced by formulas that the engine does not use, and impossible behaviour is
searched for (pull at a contact, a jump to the other branch). The error of a run follows from finer runs: `mbs.accuracy`.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..record.result import Result
from ..record.run import Run
from .check import Check
from .linear import linear
from .linkages import off_dead_centres, together
from .signals import check_balance, check_crossing, clock, finite, pushing, shallow
from .unbuckled import check_buckled

READABLE: tuple[Check, ...] = (finite, clock)
"""Checks without which no other means anything."""
CHECKS: tuple[Check, ...] = (
    *READABLE,
    together,
    check_balance,
    pushing,
    shallow,
    check_buckled,
    check_crossing,
    off_dead_centres,
    linear,
)
"""All checks, in the order in which they look."""


def idle(run: Run, result: Result) -> dict[str, str]:
    """Return the checks that have nothing to look at in a run, and why, in words; of a failed one nothing is said."""
    if not result.status.finished:
        return {}
    return {check.name: why for check in CHECKS if (why := check.idle(run, result))}


def suspicions(run: Run, result: Result) -> Iterator[str]:
    """Yield the checks that failed, in words, of a run and its result; none for a run that failed already."""
    if not result.status.finished:
        return
    for check in READABLE:
        for said in check(run, result):
            yield said
            return
    for check in CHECKS[len(READABLE) :]:
        yield from check(run, result)
