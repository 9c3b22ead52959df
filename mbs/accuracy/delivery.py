"""What came of an accuracy asked for, and what every way to it needs: counted runs, comparable results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.accuracy.aim import MOTION
from buckler.mbs.accuracy.band import banded, told
from buckler.mbs.accuracy.predictable import cut, predictable
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run
from buckler.mbs.record.status import Status

Array = np.ndarray[Any, Any]
Runner = Callable[..., Run]
"""`run(mechanism, duration, solver)` makes one run; one more number limits its time, s."""
AGAIN = (Status.NEWTON_DIVERGED, Status.NOT_FINITE, Status.TOO_MANY_STEPS, Status.ENGINE_ERROR)
"""Failures that shorter steps, or the other solver, may cure."""


@dataclass(frozen=True)
class Task:
    """What is to be delivered.

    Attributes
    ----------
    mechanism : Mechanism
    duration, asked : float
        s, 1.
    aim : Aim or Usual
        What the accuracy is asked of.
    patience : float
        Wall time, s, that a way may take.
    begun : Run, optional
        One of the compiled solver that is there already, for a finer one to be compared with.
    """

    mechanism: Mechanism
    duration: float
    asked: float
    aim: Any = MOTION
    patience: float = inf
    begun: Run | None = None


@dataclass(frozen=True)
class Delivery:
    """What was reached.

    Attributes
    ----------
    run : Run
        The finest run.
    reached : float
        Estimated error of what was asked for; nan for a failed run.
    errors : Errors
        Of all signals.
    signals : dict of str to array
        Signals of the run that extrapolation improved.
    runs : mapping of str to int
        How many runs each solver made, by its name.
    """

    run: Run
    reached: float
    errors: Errors
    signals: Mapping[str, Array] = field(default_factory=dict)
    runs: Mapping[str, int] = field(default_factory=dict)

    def kept(self, asked: float) -> bool:
        """Whether it is what was asked for."""
        return self.run.failure is None and self.reached <= asked

    def better_than(self, other: Delivery) -> bool:
        """Whether it got farther than another one: to the end, with a smaller error, or a smaller one of the motion."""
        if self.run.failure is not None or other.run.failure is not None:
            return self.run.failure is None
        return (self.reached, self.errors.motion) < (other.reached, other.errors.motion)

    def after(self, other: Delivery) -> Delivery:
        """The better of this and an earlier one, with the runs of both."""
        return (self if self.better_than(other) else other).counting(self, other)

    def counting(self, *others: Delivery) -> Delivery:
        """The same with the runs of these."""
        names = dict.fromkeys(name for other in reversed(others) for name in other.runs)
        return replace(self, runs={name: sum(other.runs.get(name, 0) for other in others) for name in names})

    def complete(self, result: Result, wall: float) -> Result:
        """Put errors, extrapolated signals, means of forces that ring, and the whole work into the run's result."""
        mechanism = self.run.record.mechanism
        means = banded(mechanism, result.time, result.signals, result.units)
        if means:
            notes = [*result.provenance.get("notes", ()), told(mechanism)]
            result = replace(result, signals=result.signals | means, provenance=result.provenance | {"notes": notes})
        work = result.work | {"wall_s": wall, "share": result.work["wall_s"] / max(wall, 1e-300)}
        work |= {"runs": float(sum(self.runs.values()))} | {f"{name}_runs": float(n) for name, n in self.runs.items()}
        return replace(result, signals=result.signals | dict(self.signals), work=work, error=self.errors)


def judged(result: Result, delivery: Delivery, task: Task, wall: float) -> Result:
    """The result of what was asked for: SUSPECT, ACCURACY in the message, where it was not reached."""
    result = replace(delivery.complete(result, wall), asked=task.asked)
    if delivery.reached <= task.asked or result.status is not Status.OK:
        return result
    of = "" if task.aim.motion else f" of {task.aim.words}"
    runs = f"{sum(delivery.runs.values())} runs"
    return result.suspect(f"ACCURACY: asked {task.asked:.2g}{of}, reached {delivery.reached:.2g} with {runs}")


class Delivering:
    """Counts the runs by solver."""

    def __init__(self, task: Task, run: Runner) -> None:
        self.task, self._run, self._start = task, run, perf_counter()
        self.runs: dict[str, int] = {}

    def run(self, mechanism: Mechanism, duration: float, solver: Any) -> Run:
        """Make one run."""
        name = type(solver).__name__.lower()
        self.runs[name] = self.runs.get(name, 0) + 1
        left = self.task.patience - (perf_counter() - self._start)
        return self._run(mechanism, duration, solver, max(1e-3, left))


def comparable(run: Run) -> Result:
    """Signals of a run, to be compared: forces that ring as means, with clearance for as long as the motion can be predicted."""
    signals, units = run.values, run.units
    means = banded(run.record.mechanism, run.record.time, signals, units)
    whole = Result(Status.OK, "", run.record.time, signals | means, units, run.work)
    return cut(whole, predictable(run.record.mechanism, float(run.record.time[-1]))) if len(whole.time) > 1 else whole


def improved(delivery: Delivery) -> Result:
    """Signals of what was delivered, to be compared, with those that extrapolation improved."""
    result = comparable(delivery.run)
    return replace(result, signals=result.signals | dict(delivery.signals))
