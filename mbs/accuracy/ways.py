"""Which way leads to an accuracy: by the scene, with another one where the first does not arrive.

- Constraints alone decide the motion: nothing is integrated, and only the samples must be dense enough.
- Strips whose elements are named: Exudyn, as the answer is that of those elements.
- Functions in Python, which the compiled solver would have to compile: Exudyn first.
- Places of strips: Exudyn first, as extrapolation is the faster one there (measured in docs/theory-precision.md), unless what
  drives or loads them has kinks, at which its equal steps do not end.
- All else: the compiled solver first.

Where both ways miss what is asked, each is held against the other: an error is at least their difference less the other's error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.accuracy.by_signal import by_signal
from buckler.mbs.accuracy.delivery import AGAIN, Delivery, Runner, Task, improved
from buckler.mbs.accuracy.difference import difference
from buckler.mbs.accuracy.extrapolation import extrapolated
from buckler.mbs.accuracy.sampling import sampled
from buckler.mbs.accuracy.tolerance import tightened
from buckler.mbs.compiler import compiler
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.elements.element import kinks_of
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
    smooth = not kinks_of(mechanism, task.duration)
    extrapolates = smooth and task.aim.motion and any(link.body.meshed for link in mechanism.links)
    if extrapolates or own_functions(mechanism):
        best = exudyn(task, run)
        spent = max(LEAST, perf_counter() - begin)
        if _settled(best, task) or not compilable(mechanism):
            return best
        return better(compiled(replace(task, patience=min(spent, task.patience)), run), best, task)
    if not compilable(mechanism):
        return exudyn(task, run)
    best = compiled(replace(task, patience=min(PATIENCE, task.patience)), run)
    return best if _settled(best, task) else better(exudyn(task, run), best, task)


def better(later: Delivery, earlier: Delivery, task: Task) -> Delivery:
    """The better one of two ways; where they are farther apart than both tell, its errors are so much larger."""
    best = later.after(earlier)
    other = earlier if best.run is later.run else later
    if best.kept(task.asked) or not (best.errors.known and other.errors.known) or other.run.failure is not None:
        return best
    return against(best, other, task)


def against(best: Delivery, other: Delivery, task: Task) -> Delivery:
    """What was delivered, its errors at least the difference from another delivery less that one's own."""
    mine, theirs = improved(best), improved(other)
    apart = by_signal(mine, theirs)
    told = {name: max(error, apart.get(name, 0.0) - other.errors.signals.get(name, 0.0)) for name, error in best.errors.items()}
    motion = max(best.errors.motion, difference(mine, theirs) - other.errors.motion)
    reached = motion if task.aim.motion else task.aim.largest(told, theirs.units)
    errors = replace(best.errors, motion=motion, signals=told, elements=best.errors.elements or other.errors.elements)
    return replace(best, reached=max(best.reached, reached), errors=errors)


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

    return known(task.mechanism, task.duration, task.asked, run=run, aim=task.aim, patience=task.patience, begun=task.begun)


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
