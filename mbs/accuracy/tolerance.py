"""Runs of Exudyn until an accuracy is reached, with clearance: of falling tolerance, over the time that can be predicted.

The finest then goes all the way. `docs/theory-precision.md` gives the reasons and the measurements.
"""

from __future__ import annotations

from math import inf, nan

from buckler.mbs.accuracy.by_signal import by_energy, by_signal
from buckler.mbs.accuracy.delivery import AGAIN, Delivering, Delivery, Runner, Task, comparable
from buckler.mbs.accuracy.difference import difference
from buckler.mbs.accuracy.plan import Plan
from buckler.mbs.accuracy.predictable import predictable
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.run import Run

ROUNDS = 4
"""Refinements before giving up."""
IGNORED = 0.1
"""Differences below this share of the accuracy asked for need not converge: they may be round-off."""
PLAY_SHARE, PLAY_FACTOR, PLAY_SHRINKS = 1.25, 8.0, 10.0
"""Error of the finest of three runs with clearance at least, of the difference to the one before, or that one's over what it
should shrink by; and the ratio of their tolerances."""


def tightened(task: Task, run: Runner) -> Delivery:
    """Deliver by smaller tolerances, or say how near it came."""
    return _Tolerance(task, run).deliver()


class _Tolerance(Delivering):
    """Runs of falling tolerance, and one on half the elements, over the predictable time; the finest then goes all the way."""

    def __init__(self, task: Task, run: Runner) -> None:
        super().__init__(task, run)
        self.plan = Plan(task.mechanism, task.duration, task.asked)

    def deliver(self) -> Delivery:
        asked, finer = self.task.asked, 1.0
        coarsest, coarse = self.start(PLAY_FACTOR**-2), self.start(1 / PLAY_FACTOR)
        before = self.apart(coarse, coarsest)
        for left in reversed(range(ROUNDS)):
            fine = self.start(finer)
            off = self.apart(fine, coarse)
            error = left_with_play(off, before, asked)
            if error <= asked or not left or (fine.failure is not None and fine.failure[0] not in AGAIN):
                break
            coarse, before, finer = fine, off, finer * PLAY_FACTOR
        thin = self.start(finer, 0.5) if self.plan.meshed else None
        if thin is not None:
            error += self.apart(fine, thin) / 15
        told = self.errors(fine, coarse, thin, error)
        if self.span < self.task.duration and fine.failure is None:
            fine = self.run(fine.record.mechanism, self.task.duration, fine.solver)
        return Delivery(fine, error if fine.failure is None else nan, told if fine.failure is None else Errors(), {}, self.runs)

    @property
    def span(self) -> float:
        """Time that is compared, s."""
        return predictable(self.task.mechanism, self.task.duration)

    def start(self, finer: float, mesh: float = 1.0) -> Run:
        """Run over the time that is compared."""
        return self.run(self.plan.thinned(mesh), self.span, self.plan.with_play(finer))

    def apart(self, fine: Run, coarse: Run) -> float:
        """Difference of two runs in what is asked for; infinite if one failed."""
        if fine.failure is not None or coarse.failure is not None:
            return inf
        return self.task.aim.apart(comparable(fine), comparable(coarse))

    def errors(self, fine: Run, coarse: Run, thin: Run | None, error: float) -> Errors:
        """Of the motion and of all signals, by the two finest runs and the one on half the elements."""
        others = [coarse, *([] if thin is None else [thin])]
        if any(run.failure is not None for run in (fine, *others)):
            return Errors()
        motion = error if self.task.aim.motion else difference(comparable(fine), comparable(coarse))
        signals = by_signal(comparable(fine), comparable(coarse)) | by_energy(fine, coarse)
        of_space = {} if thin is None else by_signal(comparable(fine), comparable(thin))
        kind = f"tolerance{' and elements' if thin else ''}, over the first {1e3 * self.span:g} ms"
        return Errors(motion, {name: d + of_space.get(name, 0.0) / 15 for name, d in signals.items()}, kind, thin is not None)


def left_with_play(apart: float, before: float, asked: float) -> float:
    """Error of the finest of three runs, from its difference to the next and that one's to the coarsest.

    It is the rest of a geometric series, but at least what either tells and a quarter, as two runs may agree by chance.
    """
    share = PLAY_SHARE * max(apart, min(before / PLAY_SHRINKS, 1.0))
    if before < IGNORED * asked and apart < IGNORED * asked:
        return share
    return max(share, apart * apart / (before - apart)) if apart < before else inf
