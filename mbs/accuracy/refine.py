"""Refinement until the error estimate is below the allowed one: a coarse run, then finer ones, each compared with the one before.

    answer = refine(run, levels, demand)

`run(mechanism, end, solver)` makes a run up to a time. Two runs are mostly enough: the finer one is returned, its error by their
difference. If two runs separate at t1, a third decides whether finer ones can follow the motion to its end T. Each refinement has
to delay the separation by (T - t1)/N, N the refinements left above the finest tolerance. If one delays it by less, the motion is
chaotic and errors hold up to about t1: runs of a chaotic motion separate as exp(t/t_L), t_L the Lyapunov time, and each
refinement delays this by the same time. An error of the phase of a regular motion grows only by a power of time.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import inf, log
from typing import NamedTuple

import numpy as np

from ..elements.signal import Kind
from ..record.errors import Deferred, Errors, Key, Norm, Status
from ..record.run import BALANCE as BALANCE_ALLOWED
from ..record.run import Run
from .damping import estimate_damping_errors
from .demand import BALANCE, USUAL_ERROR, CheckedRun, DeflectionLimits, Demand, find_worst
from .difference import Difference
from .estimate import LAST_WINDOWS, LEAST_ERROR, WINDOWS, Separation, estimate_gains
from .levels import Level, Levels, Runner
from .trajectory import Trajectory, compute_energies, find_drive_period

Norms = tuple[dict[Key, float], dict[Key, float]]
"""Relative norms, and the sizes to which they are relative."""


def refine(run: Runner, levels: Levels, demand: Demand) -> CheckedRun:
    """Make finer runs until the error is allowed, the motion is found chaotic, or no runs are left."""
    refinement = _Refinement(run, levels, demand)
    try:
        coarse = refinement.run_first()
        refinement.best = partial(CheckedRun, coarse.run)
        end = levels.duration * levels.choose_share(coarse.run)  # a part of the motion may show chaos, at less cost
        fine = refinement.make(refinement.next_level(coarse, levels.ratio), end)
        return refinement.refine_further(coarse, fine)
    except _FailedError as failure:
        if refinement.best is None:  # no run has ended: the answer is the failure
            return CheckedRun(failure.run, count=refinement.count)
        status, message = failure.run.failure or (Status.NOT_FINITE, "no samples")
        return replace(refinement.best(), reason=f"a finer run ended as {status}: {message}", count=refinement.count)


class _Trial(NamedTuple):
    """A run of a level up to a time `end` [s], and its signals as functions of time."""

    run: Run
    level: Level
    end: float
    trajectory: Trajectory


@dataclass(eq=False)
class _FailedError(Exception):
    """A run ended early."""

    run: Run


class _Pair:
    """Two runs that are compared: ratio of their tolerances, difference, allowed errors, separation."""

    def __init__(
        self, coarse: _Trial, fine: _Trial, demand: Demand, before: Mapping[Key, float] | None = None, ratio_before: float = 1.0
    ) -> None:
        self.coarse, self.fine = coarse, fine
        self.before, self.ratio_before = before, ratio_before  # of the pair before: relative differences, ratio of tolerances
        self.ratio = coarse.level.tolerance / fine.level.tolerance
        self.difference = Difference(coarse.trajectory, fine.trajectory)
        self.allowed = demand.limits(fine.trajectory)
        self.separation = Separation(self.difference, self.allowed)
        self.separates = self.separation.start < inf


class _Refinement:
    """State of one refinement."""

    def __init__(self, run: Runner, levels: Levels, demand: Demand) -> None:
        self._run, self.levels, self.demand, self.duration = run, levels, demand, levels.duration
        self.count = 0  # of runs, short and failed ones included
        self.best: Callable[[], CheckedRun] | None = None  # makes the best answer so far, which may take long
        self.first_separation: tuple[float, float] | None = None  # its time [s], and the tolerance of the finer run

    def make(self, level: Level, end: float) -> _Trial:
        """Make a run; _FailedError if it ends early."""
        self.count += 1
        mechanism, solver = self.levels.settings(level)
        run = self._run(mechanism, end, solver)
        if run.failure is not None or len(run.record.time) < 2:
            raise _FailedError(run)
        return _Trial(run, level, end, Trajectory.of(run))

    def run_first(self) -> _Trial:
        """Make the coarsest run that does not fail; report the failure of the fourth."""
        level = self.levels.first()
        cured = Status.NEWTON_DIVERGED, Status.SINGULAR, Status.NOT_FINITE, Status.ENGINE_ERROR  # finer steps may cure these
        for _ in range(3):
            try:
                return self.make(level, self.duration)
            except _FailedError as failed:
                if failed.run.failure is None or failed.run.failure.status not in cured:
                    raise
                level = self.levels.finer(level, self.levels.ratio)
        return self.make(level, self.duration)

    def next_level(self, trial: _Trial, ratio: float) -> Level:
        """Return the level after a run, with the degrees of strips that the last terms of its deflections show to be needed."""
        limits = DeflectionLimits.of(self.demand.limits(trial.trajectory), trial.trajectory)
        return self.levels.raise_degree(self.levels.finer(trial.level, ratio), trial.run, limits)

    def refine_further(self, coarse: _Trial, fine: _Trial) -> CheckedRun:
        """Compare the last two runs, and refine until the error is allowed, the motion is found chaotic or no runs are left."""
        pair = _Pair(coarse, fine, self.demand)
        if not pair.separates:
            pair = self.complete(pair)  # a part of the motion showed no separation, the whole may
        if pair.separates and not pair.fine.run.unseen:  # what steps do not see separates runs, too
            self.first_separation = pair.separation.start, pair.fine.level.tolerance
            found = self.look_for_chaos(pair)
            if isinstance(found, CheckedRun):
                return found
            pair = self.complete(found)
        return self.reduce_error(pair)

    def reduce_error(self, pair: _Pair) -> CheckedRun:
        """Refine from a pair of runs of the whole motion until the error is allowed or `find_status` gives a reason to end."""
        while True:
            now, _sizes = pair.difference.norms(pair.allowed)
            worst = find_worst(pair.allowed, self.estimate(pair, now))
            excess = worst.ratio
            self.best = partial(self.finish, pair)  # computed only if it is the answer
            limits = DeflectionLimits.of(pair.allowed, pair.fine.trajectory)
            is_seen = not pair.fine.run.unseen  # steps of a finer run may end on the edges that steps of this one missed
            if excess <= 1 and is_seen and self.levels.find_truncation(pair.fine.run, limits).excess <= 1:
                answer = self.best()
                excess = answer.worst.ratio  # now with energies and their balance
                if excess <= 1:
                    return answer
            is_smaller = pair.before is None or now.get(worst.key, 0.0) < pair.before.get(worst.key, inf)
            status = self.find_status(pair, is_smaller)
            if status is not None:
                return self.best() if status is Status.SUSPECT else self.answer_until(pair, status)
            level = self.next_level(pair.fine, self.find_ratio(excess, pair.separates))
            pair = _Pair(pair.fine, self.make(level, self.duration), self.demand, now, pair.ratio)

    def find_status(self, pair: _Pair, is_smaller: bool) -> Status | None:
        """Return the status with which refinement ends at too large an error; None if it goes on.

        `is_smaller` says that the last refinement reduced the difference of the worst signal.
        """
        separates_at_times = self.levels.rattles and pair.separation.is_ever_separate  # rattling runs may part and meet again
        is_finest = pair.fine.level.tolerance <= 2 * self.levels.finest  # the next tolerance could not be half of it
        if is_finest or self.count >= self.levels.runs_at_most:
            return Status.SENSITIVE if pair.separates or separates_at_times else Status.SUSPECT
        return Status.CHAOTIC if self.is_out_of_reach(pair) or (separates_at_times and not is_smaller) else None

    def complete(self, pair: _Pair) -> _Pair:
        """Return the pair, of which runs of a part of the motion are made again to its end."""
        if pair.coarse.end == pair.fine.end == self.duration:
            return pair
        trials = pair.coarse, pair.fine
        coarse, fine = (trial if trial.end == self.duration else self.make(trial.level, self.duration) for trial in trials)
        return _Pair(coarse, fine, self.demand)

    def look_for_chaos(self, pair: _Pair) -> CheckedRun | _Pair:
        """Make finer runs; return the answer of a chaotic motion, else the first pair that separates late enough.

        Two runs in a row must separate too early: one would call stick-slip chaotic, whose coarse runs do not resolve the
        bristles. Where pins rattle, one is enough: each costs a run.
        """
        last = reported = pair  # `reported`: the finest pair whose coarser run covers the whole motion
        for _ in range(1 if self.levels.rattles else 2):
            start = last.separation.start
            delay = (self.duration - start) / max(1.0, self.levels.refinements_to_go(last.fine.level))
            required = start + delay  # time [s] to which the next refinement has to delay the separation
            # no separation is found in the last windows of a run, which therefore goes so much beyond the required time
            end = min(last.fine.end, required * (1 + LAST_WINDOWS / WINDOWS))
            last = _Pair(last.fine, self.make(self.next_level(last.fine, self.levels.ratio), end), self.demand)
            if not last.separates:
                return last
            reported = last if last.coarse.end == self.duration else reported
        return self.answer_until(reported, Status.CHAOTIC)

    def is_out_of_reach(self, pair: _Pair) -> bool:
        """Return True if the refinements left delay the separation by too little, at the mean delay of those made."""
        if not pair.separates or self.first_separation is None:
            return False
        start, tolerance = self.first_separation
        made = log(tolerance / pair.fine.level.tolerance) / log(self.levels.ratio)  # number of refinements since then
        if made <= 0:
            return False
        expected_delay = (pair.separation.start - start) / made * self.levels.refinements_to_go(pair.fine.level)  # [s]
        # half of the time left is chosen, not all of it, as delays vary: a double pendulum with 0.84 was followed to its end
        return expected_delay < 0.5 * (self.duration - pair.separation.start)

    def find_ratio(self, excess: float, separate: bool) -> float:
        """Find the ratio of tolerances that brings an error, `excess` times the allowed one, to half the allowed one.

        The next difference is about the present error e, so that the next estimate is e / (gain - 1), gain = ratio^order. The
        largest order gives the least ratio that may be enough. Runs that separate do not show e: the ratio is then the largest.
        """
        ratio, gain = self.levels.ratio, 1 + 2 * excess
        largest = ratio**2  # two levels: with three, the third run is wasted in half of the cases
        return float(largest if separate else np.clip(gain ** (1 / self.levels.orders.largest), ratio, largest))

    def estimate(self, pair: _Pair, differences: Mapping[Key, float]) -> dict[Key, float]:
        """Estimate errors of the finer run: those by the differences, and those by numerical damping, which both runs have."""
        run, (least, place, largest) = pair.fine.trajectory, self.levels.orders

        def orders(name: str) -> tuple[float, float, float]:
            """Return the order of a signal that is assumed of a first pair, and the limits of the order that three runs show."""
            is_place = name in run.signals and run.signals[name].kind is Kind.PLACE
            if run.strikes or (run.unresolved and not is_place):
                return least, least, least  # from such motions no order is read
            return (place if is_place else least), least, largest

        gains = estimate_gains(differences, pair.before, (pair.ratio, pair.ratio_before), orders)
        by_damping = estimate_damping_errors(run, differences) if self.levels.are_radau else {}
        errors = {key: max(LEAST_ERROR, difference / (gains[key] - 1)) for key, difference in differences.items()}
        return {key: error + by_damping.get(key, 0.0) for key, error in errors.items()}

    def finish(self, pair: _Pair) -> CheckedRun:
        """Return the finer run with the errors of its signals, energies and energy balance."""
        signals = pair.difference
        (coarse, _), (fine, balance) = (compute_energies(trial.run) for trial in (pair.coarse, pair.fine))
        energies = Difference(coarse, fine, grid=signals.grid)

        def errors(keys: Iterable[Key] | None = None) -> Norms:
            """Estimate errors of signals, energies and balance."""
            (found, sizes), (more, more_sizes) = signals.norms(keys), energies.norms(keys)  # each of its own keys alone
            return self.estimate(pair, found | more) | {BALANCE: balance}, sizes | more_sizes

        allowed = pair.allowed | {BALANCE: BALANCE_ALLOWED} | {(name, Norm.RMS): USUAL_ERROR for name in self.demand.energies}
        return self.attach_errors(pair.fine, errors, float(fine.time[-1]), allowed)

    def answer_until(self, pair: _Pair, chaos: Status) -> CheckedRun:
        """Return the coarser run with errors up to the time at which they exceed the limits; the finer one may be shorter."""
        gain = pair.ratio**self.levels.orders.least
        error_over_difference = gain / (gain - 1)  # of the coarser run
        until = pair.separation.agree_until(share=1 / error_over_difference)  # there the error of a place reaches its limit
        difference = Difference(pair.coarse.trajectory, pair.fine.trajectory, until)

        def estimate(keys: Iterable[Key] | None = None) -> Norms:
            """Estimate errors of the coarser run."""
            found, sizes = difference.norms(keys)
            return {key: max(LEAST_ERROR, error_over_difference * norm) for key, norm in found.items()}, sizes

        note = (
            f"the motion is one trajectory to about t = {until:.4g} s; beyond it is one of many, and errors are those up to "
            "then: result.reading(...) gives means, rms and peaks with their sampling errors"
        )
        return self.attach_errors(pair.coarse, estimate, until, pair.allowed, (note,), chaos)

    def attach_errors(
        self, trial: _Trial, estimate: Callable[..., Norms], until: float,
        allowed: Mapping[Key, float], notes: tuple[str, ...] = (), chaos: Status | None = None,
    ) -> CheckedRun:  # fmt: skip
        """Attach errors to a run, infinite ones where its steps do not resolve a vibration.

        `estimate` returns errors and sizes of some keys, by default of all. It is called for those with a limit, of places and of
        forces with a running mean; for all others when they are read.
        """
        run = trial.trajectory
        unresolved = {(name, norm): inf for name in run.unresolved for norm in (Norm.RMS, Norm.PEAK)}

        def errors(keys: Iterable[Key] | None = None) -> Norms:
            """Estimate errors, infinite ones of unresolved forces."""
            found, sizes = estimate(keys)
            return {key: unresolved.get(key, error) for key, error in found.items()}, sizes

        places = [(name, Norm.RMS) for name, signal in run.signals.items() if signal.kind is Kind.PLACE]
        averaged = [(mean.source, Norm.RMS) for mean in run.signals.values() if mean.period]  # forces that have a running mean
        known, sizes = errors([*allowed, *places, *averaged])
        # such a force is of a flexible link; a large error is ascribed to axial vibrations, whose phases differ between the runs
        vibrating = tuple(name for name, norm in averaged if known.get((name, norm), 0.0) > USUAL_ERROR)
        if vibrating:
            others = " and others" if len(vibrating) > 1 else ""
            notes += (f"{vibrating[0]}{others}: vibrates faster than the steps resolve; read {vibrating[0]}.mean",)
        largest = max((known[key] for key in places if key in known), default=0.0)
        kind = f"the difference of the last two of {self.count} runs of {type(trial.run.solver).__name__}"
        every, every_size = Deferred(known, lambda: errors()[0]), Deferred(sizes, lambda: errors()[1])
        found = Errors(largest, every, every_size, kind, until, find_drive_period(trial.run.record.mechanism), vibrating, notes)
        return CheckedRun(trial.run, found, find_worst(allowed, known), chaos, count=self.count)
