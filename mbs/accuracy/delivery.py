"""Runs until an accuracy is reached: a fine run, a coarser one beside it, and more of both while the estimate asks for it.

Without clearance a run is made of equal steps, shorter ones only about impacts, so that its error is a power series in the step:
A run of N steps and one of 2N give the solution extrapolated to no step at all, and one on half the elements that on infinitely
many. With clearance only the tolerance is there to be lowered. `docs/theory-precision.md` gives the reasons and the measurements.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf, nan
from typing import Any

import numpy as np

from buckler.mbs.accuracy.difference import PREDICTABLE, difference, differences
from buckler.mbs.accuracy.plan import Plan
from buckler.mbs.engine.settings import Exudyn
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.result import SMOOTH, Result, Status, cubic
from buckler.mbs.record.run import Run

Array = np.ndarray[Any, Any]
Runner = Callable[[Mechanism, float, Exudyn], Run]
ROUNDS = 4
"""Refinements before giving up."""
GAIN, IDLE = 1.5, 2
"""A refinement helps if it divides the error by this; so many in turn that do not are the end."""
LEFT, LEFT_KINKED, LEFT_STRIKING = 0.2, 0.35, 0.5
"""Error left by extrapolation, of the last change it made: 1/15 at fourth order, 1/7 at third, 1/3 at second; where the drive's
acceleration jumps, and where something strikes."""
LEFT_OF_MESH = 1 / 30
"""Error left by extrapolation to infinitely many elements, of the change by half the mesh."""
STRUCK = 1.5
"""Error of an impulse, which is not extrapolated, of its last change by the steps or half of the one before: erratic."""
OF_IMPULSE = 1 / 7
"""Error of an impulse, which is not extrapolated, of the change by half the mesh: of third order."""
AGAIN = (Status.NEWTON_DIVERGED, Status.NOT_FINITE, Status.TOO_MANY_STEPS, Status.ENGINE_ERROR)
"""Failures that shorter steps may cure."""
SECOND_ORDER = 2.5
"""Ratio of the differences of three runs, 4 at second order, from which extrapolation is believed."""
IGNORED = 0.1
"""Differences below this share of the accuracy asked for need not converge: they may be round-off."""
PLAY_SHARE, PLAY_FACTOR, PLAY_SHRINKS = 0.5, 8.0, 4.0
"""Error of the finest of three runs with clearance at least, of the difference to the one before, or that one's over what it
should shrink by; and the ratio of their tolerances."""


@dataclass(frozen=True)
class Delivery:
    """What was reached.

    Attributes
    ----------
    run : Run
        The finest run.
    asked, error : float
        nan for the error of a failed run.
    kind : str
        What the estimate is made of.
    signals : dict of str to array
        Signals of the run that extrapolation improved.
    runs : int
    """

    run: Run
    asked: float
    error: float
    kind: str
    signals: dict[str, Array] = field(default_factory=dict)
    runs: int = 0

    def complete(self, result: Result, wall: float) -> Result:
        """Put error, extrapolated signals and the whole work into the run's result."""
        work = result.work | {"wall_s": wall, "runs": float(self.runs), "share": result.work["wall_s"] / max(wall, 1e-300)}
        result = replace(
            result, signals=result.signals | self.signals, work=work, asked=self.asked, error=self.error, error_kind=self.kind
        )
        if self.error <= self.asked or result.status is not Status.OK:
            return result
        return result.suspect(f"ACCURACY: asked {self.asked:.2g}, reached {self.error:.2g} with {self.runs} runs")


def deliver(mechanism: Mechanism, duration: float, asked: float, run: Runner) -> Delivery:
    """Run until the error is no larger than asked, or nothing helps.

    Parameters
    ----------
    mechanism : Mechanism
    duration, asked : float
        s, 1.
    run : callable
        `run(mechanism, duration, solver)` makes one `Run`.
    """
    plan = Plan(mechanism, duration, asked)
    return (_Tolerance(plan, run) if plan.play else _Extrapolation(plan, run)).deliver()


class _Delivering:
    """Counts the runs; turns them into results that can be compared."""

    def __init__(self, plan: Plan, run: Runner) -> None:
        self.plan, self._run, self.runs = plan, run, 0

    def run(self, mechanism: Mechanism, duration: float, solver: Exudyn) -> Run:
        self.runs += 1
        return self._run(mechanism, duration, solver)

    def delivery(self, run: Run, error: float, kind: str, signals: dict[str, Array] | None = None) -> Delivery:
        return Delivery(run, self.plan.asked, error, kind, signals or {}, self.runs)


def _result(run: Run) -> Result:
    """Signals of a run, to be compared."""
    signals, units = run.signals
    return Result(Status.OK, "", run.record.time, signals, units, run.work)


# --- without clearance -----------------------------------------------------------------------------------------------------


class _Extrapolation(_Delivering):
    """Runs of N, 2 N and 4 N steps, and one of N steps on half the elements."""

    def __init__(self, plan: Plan, run: Runner) -> None:
        super().__init__(plan, run)
        self.first = plan.steps()
        self.known: dict[tuple[int, int], tuple[Run, Result]] = {}

    def at(self, steps: int, mesh: int) -> tuple[Run, Result]:
        """The run of so many steps on a mesh, made once; its failure as an exception."""
        if (steps, mesh) not in self.known:
            solver = self.plan.solver(steps, mesh, steps / self.first)
            run = self.run(self.plan.model(steps, mesh), self.plan.duration, solver)
            self.known[steps, mesh] = run, _result(run)
        if self.known[steps, mesh][0].failure is not None:
            raise _FailedError(self.known[steps, mesh][0])
        return self.known[steps, mesh]

    def deliver(self) -> Delivery:
        steps, mesh = self.first, self.plan.mesh()
        best: Delivery | None = None
        failed: Run | None = None
        idle = 0
        for _ in range(ROUNDS):
            try:
                reached, in_time, in_space = self.estimate(steps, mesh)
            except _FailedError as failure:
                failed = failure.run
                if best is not None or failed.failure is None or failed.failure[0] not in AGAIN:
                    break
                steps *= 2
                continue
            idle = 0 if best is None or reached.error < best.error / GAIN else idle + 1
            best = reached if best is None or reached.error < best.error else best
            if best.error <= self.plan.asked or idle == IDLE or in_time + in_space <= self.plan.asked / 2:
                break
            steps, mesh = self.refine(steps, mesh, in_time, in_space)
        if best is None:
            assert failed is not None
            return self.delivery(failed, nan, "")
        return replace(best, runs=self.runs)

    def estimate(self, steps: int, mesh: int) -> tuple[Delivery, float, float]:
        """The solution extrapolated from all runs of N to 4 N steps, and its errors by steps and by elements."""
        coarsest, coarse, (run, fine) = self.at(steps, mesh)[1], self.at(2 * steps, mesh)[1], self.at(4 * steps, mesh)
        better, in_time = _in_time(fine, coarse, coarsest, self.plan)
        in_space, kind = 0.0, "steps"
        if self.plan.meshed:
            thin, kind = self.at(steps, mesh // 2)[1], "steps and elements"
            apart = differences(coarsest, thin)
            in_space = max(
                (d * (OF_IMPULSE if name.endswith(".impulse") else LEFT_OF_MESH) for name, d in apart.items()), default=0.0
            )
            better = _corrected(better, coarsest, thin, 15.0)
        signals = {name: values for name, values in better.signals.items() if values is not fine.signals[name]}
        left_out = 0.0 if self.plan.resolved else self.plan.axial[0]
        return self.delivery(run, in_time + in_space + left_out, kind, signals), in_time, in_space

    def refine(self, steps: int, mesh: int, in_time: float, in_space: float) -> tuple[int, int]:
        """What to try next: what errs more than its half of the accuracy is made finer, by the order it should have."""
        half = self.plan.asked / 2
        if in_time > half or not in_space > half:
            steps *= 2
        if in_space > half:
            mesh = max(mesh + 2, 2 * round(mesh * min(2.0, (2 * in_space / half) ** 0.25) / 2))
        return steps, mesh


def _in_time(fine: Result, coarse: Result, coarsest: Result, plan: Plan) -> tuple[Result, float]:
    """Extrapolate from three runs, each of half the steps of the one before, if they converge as they should; the error left."""
    first, second = differences(coarse, coarsest), differences(fine, coarse)
    slow = {name for name, d in second.items() if d > IGNORED * plan.asked and first.get(name, 0.0) < SECOND_ORDER * d}
    impulses = {
        name: STRUCK * max(d, first.get(name, 0.0) / 2) for name, d in second.items() if name.endswith(".impulse")
    }  # as they are
    if slow - set(impulses):
        return fine, max((second | impulses).values())
    better, before = _corrected(fine, fine, coarse, 3.0), _corrected(coarse, coarse, coarsest, 3.0)
    left = LEFT_STRIKING if not plan.smooth else LEFT_KINKED if plan.kinked else LEFT
    errors = {name: left * d for name, d in differences(better, before).items()} | impulses
    return better, max(errors.values(), default=0.0)


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


# --- with clearance --------------------------------------------------------------------------------------------------------


class _Tolerance(_Delivering):
    """Runs of falling tolerance, and one on half the elements, over the predictable time; the finest then goes all the way."""

    def deliver(self) -> Delivery:
        asked, finer = self.plan.asked, 1.0
        coarsest, coarse = self.start(PLAY_FACTOR**-2), self.start(1 / PLAY_FACTOR)
        before = _apart(coarse, coarsest)
        for _ in range(ROUNDS):
            fine = self.start(finer)
            apart = _apart(fine, coarse)
            error = _left_with_play(apart, before, asked)
            if error <= asked or (fine.failure is not None and fine.failure[0] not in AGAIN):
                break
            coarse, before, finer = fine, apart, finer * PLAY_FACTOR
        kind = "tolerance"
        if self.plan.meshed:
            thin = self.start(finer, 0.5)
            error, kind = error + _apart(fine, thin) / 15, "tolerance and elements"
        if self.span < self.plan.duration and fine.failure is None:
            fine = self.run(fine.record.mechanism, self.plan.duration, fine.solver)
        return self.delivery(fine, error if fine.failure is None else nan, f"{kind}, over the first {1e3 * self.span:g} ms")

    @property
    def span(self) -> float:
        """Time that is compared, s."""
        return min(self.plan.duration, PREDICTABLE)

    def start(self, finer: float, mesh: float = 1.0) -> Run:
        """Run over the time that is compared."""
        return self.run(self.plan.thinned(mesh), self.span, self.plan.with_play(finer))


def _left_with_play(apart: float, before: float, asked: float) -> float:
    """Error of the finest of three runs, from its difference to the next and that one's to the coarsest.

    It is the rest of a geometric series, but at least a share of what either tells, as two runs may agree by chance.
    """
    share = PLAY_SHARE * max(apart, min(before / PLAY_SHRINKS, 1.0))
    if before < IGNORED * asked and apart < IGNORED * asked:
        return share
    return max(share, apart * apart / (before - apart)) if apart < before else inf


def _apart(fine: Run, coarse: Run) -> float:
    """Difference of two runs; infinite if one failed."""
    if fine.failure is not None or coarse.failure is not None:
        return inf
    return difference(_result(fine), _result(coarse))
