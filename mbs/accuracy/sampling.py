"""Linkages whose constraints decide their motion: nothing is integrated, so that only the samples must be dense enough."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan

from buckler.mbs.accuracy.by_signal import by_energy, by_signal
from buckler.mbs.accuracy.delivery import Delivering, Delivery, Runner, Task, comparable
from buckler.mbs.accuracy.difference import difference
from buckler.mbs.record.errors import Errors
from buckler.mbs.solvers.closure import Closure
from buckler.mbs.solvers.steps import Controlled

ROUNDS = 7
"""Most times the samples are doubled."""


def sampled(task: Task, run: Runner) -> Delivery:
    """Double the samples until what is read off them stays, or say how near it came."""
    own = Delivering(task, run)
    coarse = own.run(task.mechanism, task.duration, Closure())
    reached, told, fine = inf, Errors(), coarse
    for _ in range(ROUNDS):
        if coarse.failure is not None:
            break
        steps = Controlled(max_step=task.duration / (2 * (len(coarse.record.time) - 1)))
        fine = own.run(task.mechanism, task.duration, Closure(steps))
        if fine.failure is not None:
            break
        a, b = comparable(coarse), comparable(fine)
        told = Errors(difference(a, b), by_signal(a, b), "samples; nothing is integrated")
        reached = task.aim.apart(a, b)
        if reached <= task.asked:
            told = replace(told, signals={**told.signals, **by_energy(coarse, fine)})
            break
        coarse = fine
    return Delivery(fine, nan if fine.failure is not None else reached, told, {}, own.runs)
