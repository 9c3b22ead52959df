"""All self-checks of a finished run, which find reasons not to trust it.

No check relies on the integrator. The energy balance has formulas that the engine does not use. The other checks look for
impossible behaviour, such as a contact that pulls. The error of a run is estimated from finer runs, in `mbs.accuracy`.
"""

from collections.abc import Iterator

from ..record.result import Result
from ..record.run import Run
from .check import Check
from .linear import check_linear
from .linkages import check_constraints, check_dead_centres
from .signals import check_balance, check_crossing, check_depths, check_directions, check_finite, check_time
from .unbuckled import check_buckled

FIRST: tuple[Check, ...] = (check_finite, check_time)
"""Checks without which the others cannot be made."""
CHECKS: tuple[Check, ...] = (
    *FIRST, check_constraints, check_balance, check_directions, check_depths, check_buckled, check_crossing, check_dead_centres,
    check_linear,
)  # fmt: skip
"""All checks, in their order."""


def explain_not_applicable(run: Run, result: Result) -> dict[str, str]:
    """Return the checks that do not apply to a run, with the reasons in words; none for a failed run."""
    if not result.status.finished:
        return {}
    return {check.name: check.reason for check in CHECKS if not check.subjects(run)}


def find_suspicions(run: Run, result: Result) -> Iterator[str]:
    """Yield the faults that checks find in a run and its result, in words; one if it is of `FIRST`, none if the run failed."""
    if not result.status.finished:
        return
    if fault := next((fault for check in FIRST for fault in check(run, result)), ""):
        yield fault
    else:
        yield from (fault for check in CHECKS[len(FIRST) :] for fault in check(run, result))
