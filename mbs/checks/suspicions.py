"""Self-checks of a finished run: each gives the reasons for which it must not be trusted.

None of them believes the integrator: energy is balanced by formulas that the engine does not use, a stretch of the run is run
again at half its steps, and what a mechanism cannot do (pull at a contact, jump to its other branch) is looked for.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.branch import branches
from buckler.mbs.checks.closure import closures
from buckler.mbs.checks.contact import pulls
from buckler.mbs.checks.energy import BALANCE, OF_ACCURACY, at_rest, unbalanced
from buckler.mbs.checks.mesh import meshes
from buckler.mbs.checks.penetration import pierced
from buckler.mbs.checks.steps import steps
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.record.energy import ledger
from buckler.mbs.record.result import Result, Status
from buckler.mbs.record.run import Run


def suspicions(run: Run, result: Result) -> Iterator[str]:
    """Yield the checks that failed, in words; none for a run that failed already.

    Parameters
    ----------
    run : Run
        The pass that is looked at.
    result : Result
        What is to be trusted.
    """
    if result.status is not Status.OK:
        return
    if not all(np.isfinite(values).all() for values in result.signals.values()):
        yield "NOT_FINITE: a signal is not finite"
        return
    if len(result.time) > 1 and not (np.diff(result.time) > 0).all():
        yield "TIME: time does not increase"
        return
    mechanism = run.record.mechanism
    if result.energy or run.solver.steps.record_every == 1:  # work cannot be summed over steps that were not recorded
        least = at_rest(mechanism, float(result.time[-1] - result.time[0]) or 1.0)
        yield from unbalanced(result.energy or ledger(run.record), max(BALANCE, OF_ACCURACY * result.asked), least)
    yield from pulls(result)
    yield from pierced(mechanism, result)
    yield from branches(run.record, result)
    yield from closures(run.record)
    yield from meshes(run.record)
    halved = result.error >= 0 and not clearances(mechanism)  # whole runs were, to estimate the error; with clearance 10 ms only
    if not halved:
        yield from steps(run, result)
