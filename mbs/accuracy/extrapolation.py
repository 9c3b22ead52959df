"""Runs of Exudyn until an accuracy is reached, without clearance: a fine run, coarser ones beside it, more as it needs them.

A run is made of equal steps, shorter ones only about impacts, so that its error is a power series in the step: a run of N steps
and one of 2N give the solution extrapolated to no step at all, and one on half the elements that on infinitely many.
`docs/theory-precision.md` gives the reasons and the measurements.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan
from typing import Any

import numpy as np

from buckler.mbs.accuracy.band import unresolved
from buckler.mbs.accuracy.by_signal import SMOOTH, by_energy, by_signal
from buckler.mbs.accuracy.delivery import AGAIN, Delivering, Delivery, Runner, Task, comparable
from buckler.mbs.accuracy.difference import differences
from buckler.mbs.accuracy.plan import Plan
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.lookup import cubic
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

Array = np.ndarray[Any, Any]
ROUNDS, FAILURES = 4, 4
"""Refinements, and first runs that fail for too long steps, before giving up."""
GAIN, IDLE = 1.5, 2
"""A refinement helps if it divides the error by this; so many in turn that do not are the end."""
LEFT, LEFT_KINKED, LEFT_STRIKING, LEFT_ROUGH = 0.2, 0.35, 0.6, 1.0
"""Error left by extrapolation, of the last change it made: 1/15 at fourth order, 1/7 at third, 1/3 at second; where the drive's
acceleration jumps; where something strikes; and where a guide rubs, or nothing drives: what is let go rings in all modes."""
LEFT_OF_MESH = 1 / 30
"""Error left by extrapolation to infinitely many elements, of the change by half the mesh."""
STRUCK = 1.5
"""Error of an impulse or a force, which is not extrapolated, of its last change by the steps, or part of the one before."""
OF_IMPULSE = 1 / 7
"""Error of what is not extrapolated, of the change by half the mesh: of third order."""
ROUGH = 0.25
"""Share of the change of a force by the coarser half of the steps that is taken to be left of it at least, as at second order."""
SECOND_ORDER = 2.5
"""Ratio of the differences of three runs, 4 at second order, from which extrapolation is believed."""
IGNORED = 0.1
"""Differences below this share of the accuracy asked for need not converge: they may be round-off."""


def extrapolated(task: Task, run: Runner) -> Delivery:
    """Deliver by extrapolation, or say how near it came."""
    return _Extrapolation(task, run).deliver()


class _Extrapolation(Delivering):
    """Runs of N, 2 N and 4 N steps, and one of N steps on half the elements."""

    def __init__(self, task: Task, run: Runner) -> None:
        super().__init__(task, run)
        self.plan = Plan(task.mechanism, task.duration, task.asked)
        self.first = self.plan.steps()
        self.known: dict[tuple[int, int], tuple[Run, Result]] = {}

    def at(self, steps: int, mesh: int) -> tuple[Run, Result]:
        """The run of so many steps on a mesh, made once; its failure as an exception."""
        if (steps, mesh) not in self.known:
            solver = self.plan.solver(steps, mesh, steps / self.first)
            run = self.run(self.plan.model(steps, mesh), self.plan.duration, solver)
            self.known[steps, mesh] = run, comparable(run)
        if self.known[steps, mesh][0].failure is not None:
            raise _FailedError(self.known[steps, mesh][0])
        return self.known[steps, mesh]

    def deliver(self) -> Delivery:
        steps, mesh = self.first, self.plan.mesh()
        best: Delivery | None = None
        failed: Run | None = None
        idle = failures = rounds = 0
        while rounds < ROUNDS and failures < FAILURES:
            try:
                reached, in_time, in_space = self.estimate(steps, mesh)
            except _FailedError as failure:
                failed = failure.run
                if best is not None or failed.failure is None or failed.failure[0] not in AGAIN:
                    break
                steps *= 4
                failures += 1
                continue
            rounds += 1
            idle = 0 if best is None or reached.reached < best.reached / GAIN else idle + 1
            best = reached if best is None or reached.better_than(best) else best
            if best.reached <= self.plan.asked or idle == IDLE or in_time + in_space <= self.plan.asked / 2:
                break
            steps, mesh = self.refine(steps, mesh, in_time, in_space)
        if best is None:
            assert failed is not None
            return Delivery(failed, nan, Errors(), {}, self.runs)
        return replace(best, runs=self.runs)

    def estimate(self, steps: int, mesh: int) -> tuple[Delivery, float, float]:
        """The solution extrapolated from all runs of N to 4 N steps, and its errors by steps and by elements."""
        coarsest, coarse, (run, fine) = self.at(steps, mesh)[1], self.at(2 * steps, mesh)[1], self.at(4 * steps, mesh)
        thin = self.at(steps, mesh // 2)[1] if self.plan.meshed else None
        refined = _in_time(fine, coarse, coarsest, self.plan)
        in_space = 0.0 if thin is None else max((_of_mesh(n) * d for n, d in differences(coarsest, thin).items()), default=0.0)
        left_out = 0.0 if self.plan.resolved else self.plan.axial[0]
        errors = refined.by_signal(coarsest, thin)
        if self.aim.motion:  # forces that were asked for are held against another run
            errors = unresolved(self.plan.mechanism, self.plan.duration / (4 * steps), errors, fine.units)
        energies = by_energy(run, self.at(2 * steps, mesh)[0]) if run.solver.steps.record_every == 1 else {}
        kind = "steps" if thin is None else "steps and elements"
        told = Errors(refined.error + in_space + left_out, errors | energies, kind, thin is not None)
        in_time, reached = refined.error, told.motion
        if not self.aim.motion:
            reached = self.aim.largest(errors, fine.units)
            in_space = self.aim.largest(_of_space(coarsest, thin), fine.units) if thin is not None else 0.0
            in_time = reached - in_space
        better = refined.better if thin is None else _corrected(refined.better, coarsest, thin, 15.0)
        signals = {name: values for name, values in better.signals.items() if values is not fine.signals[name]}
        return Delivery(run, reached, told, signals, self.runs), in_time, in_space

    @property
    def aim(self) -> Any:
        """What is asked for."""
        return self.task.aim

    def refine(self, steps: int, mesh: int, in_time: float, in_space: float) -> tuple[int, int]:
        """What to try next: what errs more than its half of the accuracy is made finer, by the order it should have."""
        half = self.plan.asked / 2
        if in_time > half or not in_space > half:
            steps *= 2
        if in_space > half:
            mesh = max(mesh + 2, 2 * round(mesh * min(2.0, (2 * in_space / half) ** 0.25) / 2))
        return steps, mesh


@dataclass(frozen=True)
class _InTime:
    """What three runs, each of half the steps of the one before, tell: the best there is, the next best, the error left.

    `left` is the share of their difference that is left of what extrapolation improves.
    """

    better: Result
    before: Result
    left: float
    error: float

    def by_signal(self, coarsest: Result, thin: Result | None) -> dict[str, float]:
        """Errors of all signals: by steps, and by elements where there is a run on half of them.

        What is not extrapolated is erratic: two runs may agree by chance in the peak of a force that rings.
        """
        first = by_signal(self.before, coarsest)
        found = {
            name: d * self.left if _smooth(name) else STRUCK * max(d, ROUGH * first.get(name, 0.0))
            for name, d in by_signal(self.better, self.before).items()
        }
        of_space = {} if thin is None else _of_space(coarsest, thin)
        return {name: d + of_space.get(name, 0.0) for name, d in found.items()}


def _in_time(fine: Result, coarse: Result, coarsest: Result, plan: Plan) -> _InTime:
    """Extrapolate from three runs, each of half the steps of the one before, if they converge as they should."""
    first, second = differences(coarse, coarsest), differences(fine, coarse)
    slow = {name for name, d in second.items() if d > IGNORED * plan.asked and first.get(name, 0.0) < SECOND_ORDER * d}
    impulses = {
        name: STRUCK * max(d, first.get(name, 0.0) / 2) for name, d in second.items() if name.endswith(".impulse")
    }  # as they are
    if slow - set(impulses):
        return _InTime(fine, coarse, 1.0, max((second | impulses).values()))
    better, before = _corrected(fine, fine, coarse, 3.0), _corrected(coarse, coarse, coarsest, 3.0)
    left = _left(plan)
    errors = {name: left * d for name, d in differences(better, before).items()} | impulses
    return _InTime(better, before, left, max(errors.values(), default=0.0))


def _left(plan: Plan) -> float:
    """Share of the last change by extrapolation that is left, by what keeps the error from being a power series."""
    if not plan.mechanism.drives or any(guide.friction for guide in plan.mechanism.guides):
        return LEFT_ROUGH
    if not plan.smooth:
        return LEFT_STRIKING
    return LEFT_KINKED if plan.kinked else LEFT


def _smooth(name: str) -> bool:
    """Whether extrapolation improves a signal."""
    return name.removesuffix(".peak").rpartition(".")[2] in SMOOTH


def _of_mesh(part: str) -> float:
    """Share of the change by half the mesh that is left of a part of the difference."""
    return OF_IMPULSE if part.endswith(".impulse") else LEFT_OF_MESH


def _of_space(coarsest: Result, thin: Result) -> dict[str, float]:
    """Errors of all signals by their change by half the mesh."""
    return {name: d * (LEFT_OF_MESH if _smooth(name) else OF_IMPULSE) for name, d in by_signal(coarsest, thin).items()}


class _FailedError(Exception):
    """A run that ended before its time."""

    def __init__(self, run: Run) -> None:
        super().__init__(run.failure)
        self.run = run


def _corrected(result: Result, finer: Result, coarser: Result, divisor: float) -> Result:
    """Add (finer - coarser)/divisor to the signals that extrapolation improves; the forces stay the finest run's."""
    names = [name for name in result.signals if name.rpartition(".")[2] in SMOOTH]

    def there(run: Result) -> Array:
        stacked = np.column_stack([run.signals[name] for name in names])
        return stacked if run.time is result.time else cubic(run.time, stacked, result.time)

    corrections = (there(finer) - there(coarser)).T / divisor
    better = {name: result.signals[name] + correction for name, correction in zip(names, corrections, strict=True)}
    return replace(result, signals=result.signals | better)
