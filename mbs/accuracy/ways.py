"""Which way leads to an accuracy: by the scene, with another one where the first does not arrive.

- Constraints alone decide the motion: nothing is integrated, and only the samples must be dense enough.
- Strips whose elements are named: Exudyn, as the answer is that of those elements.
- Functions in Python, which the compiled solver would have to compile: Exudyn first.
- Places of strips: Exudyn first, as extrapolation is the faster one there (measured in docs/theory-precision.md).
- All else: the compiled solver first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.accuracy.delivery import AGAIN, Delivery, Runner, Task
from buckler.mbs.accuracy.extrapolation import extrapolated
from buckler.mbs.accuracy.sampling import sampled
from buckler.mbs.accuracy.tolerance import tightened
from buckler.mbs.compiler import compiler
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.kinematics.determined import answered
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.status import Status

Way = Callable[[Task, Runner], Delivery]
OURS = "buckler."
PATIENCE, LEAST = 30.0, 2.0
"""Wall time, s, that the compiled solver may take where it is the first; where it is the second, it may take as long as the first
did, but at least so long."""


def deliver(task: Task, run: Runner) -> Delivery:
    """Run until the error is no larger than asked, or nothing helps."""
    mechanism, exudyn = task.mechanism, by_exudyn(task.mechanism)
    if exudyn is sampled or named(mechanism):
        return exudyn(task, run)
    begin = perf_counter()
    extrapolates = task.aim.motion and any(link.body.meshed for link in mechanism.links)
    if extrapolates or own_functions(mechanism):
        best = exudyn(task, run)
        spent = max(LEAST, perf_counter() - begin)
        if _settled(best, task) or not compilable(mechanism):
            return best
        return compiled(replace(task, patience=min(spent, task.patience)), run).after(best)
    if not compilable(mechanism):
        return exudyn(task, run)
    best = compiled(replace(task, patience=min(PATIENCE, task.patience)), run)
    return best if _settled(best, task) else exudyn(task, run).after(best)


def named(mechanism: Mechanism) -> bool:
    """Whether the elements of a strip are named, so that the answer asked for is that of these elements."""
    return any(link.body.meshed and not link.body.meshed_freely for link in mechanism.links)


def _settled(delivery: Delivery, task: Task) -> bool:
    """Whether another way is of no use: it is what was asked for, or it failed as any other would."""
    failure = delivery.run.failure
    return delivery.kept(task.asked) or (failure is not None and failure[0] not in (*AGAIN, Status.TIMED_OUT))


def by_exudyn(mechanism: Mechanism) -> Way:
    """The way of Exudyn, or of closure."""
    if answered(mechanism):
        return sampled
    return tightened if clearances(mechanism) else extrapolated


def compiled(task: Task, run: Runner) -> Delivery:
    """Deliver by the compiled solver."""
    from buckler.mbs.spectral.accuracy import known  # loads the compiled solver

    return known(task.mechanism, task.duration, task.asked, run=run, aim=task.aim, patience=task.patience)


def compilable(mechanism: Mechanism) -> bool:
    """Whether the compiled solver is there and takes a mechanism."""
    if not compiler():
        return False
    from buckler.mbs.spectral.accuracy import takes

    return takes(mechanism)


def own_functions(value: Any) -> bool:
    """Whether anything in a mechanism is a function in Python, or an object of a class, that is not Buckler's."""
    if is_dataclass(value) and not isinstance(value, type):
        return not type(value).__module__.startswith(OURS) or any(own_functions(getattr(value, f.name)) for f in fields(value))
    if isinstance(value, dict):
        return any(own_functions(each) for each in value.values())
    if isinstance(value, tuple | list):
        return any(own_functions(each) for each in value)
    return callable(value) and not str(getattr(value, "__module__", "")).startswith(OURS) and not isinstance(value, np.ndarray)
