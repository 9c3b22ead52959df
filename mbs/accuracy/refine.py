"""Refinement until the error is known and allowed: a cheap run, then finer ones, each compared with the one before.

    answer = refine(run, levels, demand, duration)

`run(level, end)` makes a run up to a time. Two runs are enough mostly: the finer one is handed back, its error by their
difference. Where two runs part at t1, a third decides whether finer ones can follow the motion to its end T. Each refinement has
to move the parting by (T - t1)/N, N the refinements left above the finest tolerance. Where the third parts from the second
sooner, the motion is chaotic: finer runs end there, and errors are those up to about t1.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from math import inf, log

import numpy as np

from ..elements.signal import Kind
from ..record.energy import BALANCE as BALANCE_ALLOWED
from ..record.errors import Errors, Key, Norm, Status
from ..record.run import Run
from .damping import damped
from .demand import BALANCE, STRIKE, Demand, Worst, worst
from .difference import Difference
from .estimate import LAST, LEAST, WINDOWS, Parting, errors, gains
from .levels import Level, Levels
from .trajectory import Trajectory, energies_of, turn_of

PATIENCE = 3
"""Coarse runs that may fail before one that finer steps did not cure is handed back."""
CURED = (Status.NEWTON_DIVERGED, Status.SINGULAR, Status.NOT_FINITE, Status.ENGINE_ERROR)
"""Failures that finer steps may cure."""
JUMP = 2
"""Most levels gone at once: at three the third run is wasted as often as not."""


CONFIRMED = 2
"""Refinements in a row that must fail to move a parting before a motion is chaotic; one where pins rattle, as each costs a run.
One alone would call stick-slip chaotic, whose first levels miss the bristles."""
LATER = 0.5
"""Part of its share by which a later refinement has to move a parting. A refinement of the double pendulum in the README moves it
by 0.84 of the share, and a later one to the end; a strip that whips, by nothing."""
UNKNOWN = Worst(("", Norm.RMS), inf, 1.0)
"""Error of a run beside which no finer one could be made."""


class Trial:
    """A run with what is asked about it, each made once."""

    def __init__(self, run: Run, level: Level, end: float) -> None:
        self.run, self.level, self.end = run, level, end

    @property
    def failed(self) -> bool:
        """True if the run ended early."""
        return self.run.failure is not None or len(self.run.record.time) < 2

    @cached_property
    def trajectory(self) -> Trajectory:
        """Its signals."""
        return Trajectory.of(self.run)

    @cached_property
    def energies(self) -> tuple[Trajectory, float]:
        """Its energies, and the error of their balance."""
        return energies_of(self.run)


@dataclass(frozen=True, eq=False)
class Pair:
    """Two runs that are compared, the finer one last; each comparison is made once."""

    coarse: Trial
    fine: Trial

    @cached_property
    def difference(self) -> Difference:
        """Difference of their signals."""
        return Difference(self.coarse.trajectory, self.fine.trajectory)

    @cached_property
    def energies(self) -> tuple[dict[Key, float], dict[Key, float]]:
        """Norms of the difference of their energies, and sizes."""
        a, b = self.coarse.energies[0], self.fine.energies[0]
        return Difference(a, b).norms(b.signals)


@dataclass(frozen=True)
class Answer:
    """A run, its errors, what is farthest beyond what is allowed.

    Attributes
    ----------
    run : Run
    errors : Errors
        Unknown where no finer run could be made.
    worst : Worst
    chaos : Status or None
        CHAOTIC or SENSITIVE where errors hold up to `errors.until` only.
    said : str
        Why refinement ended early, in words.
    count : int
        Runs that were made.
    """

    run: Run
    errors: Errors = field(default_factory=Errors)
    worst: Worst = UNKNOWN
    chaos: Status | None = None
    said: str = ""
    count: int = 1

    def shortfall(self, demand: Demand) -> str:
        """Return why it is not what was asked for, in a sentence; '' if it is."""
        why = f"; {self.said}" if self.said else ""
        if not self.errors.known:
            return f"ACCURACY: no finer run could be made, so that the error is not known ({self.count} runs){why}"
        if self.worst.ratio <= 1:
            return ""
        off = f"is off by {_share(self.worst.error)} (relative error), allowed {_share(self.worst.allowed)}"
        return f"ACCURACY: '{self.worst.name}' {off}, after {self.count} runs; asked of {demand.words}{why}"


def _share(error: float) -> str:
    """A relative error, for a sentence."""
    return f"{100 * error:.2g} %" if 1e-3 <= error < 10 else f"{error:.1e}"


def refine(run: Callable[[Level, float], Run], levels: Levels, demand: Demand, duration: float) -> Answer:
    """Run until the error is allowed, until chaos forbids it, or until the runs are used up."""
    return _Refinement(run, levels, demand, duration).answer()


class _FailedError(Exception):
    """A run ended early."""

    def __init__(self, trial: Trial) -> None:
        self.trial = trial


class _Refinement:
    """State of one refinement: the runs so far, and the pair of the last two."""

    def __init__(self, run: Callable[[Level, float], Run], levels: Levels, demand: Demand, duration: float) -> None:
        self._run, self.levels, self.demand, self.duration = run, levels, demand, duration
        self.count = 0
        self.pair: Pair | None = None
        self.before: Mapping[Key, float] | None = None
        self.ratio_before = 1.0
        self.allowed: dict[Key, float] = {}
        self.best: Callable[[], Answer] | None = None

    def make(self, level: Level, end: float) -> Trial:
        """Make a run; _FailedError if it ends early."""
        self.count += 1
        made = Trial(self._run(level, end), level, end)
        if made.failed:
            raise _FailedError(made)
        return made

    def answer(self) -> Answer:
        """Find the answer; a run that fails ends it with what there is by then."""
        try:
            coarse = self.run_first()
            self.best = partial(Answer, coarse.run)
            fine = self.make(self.next_level(coarse, self.levels.ratio), self.duration * self.levels.prefix)
            return self.refine(coarse, fine)
        except _FailedError as failure:
            found = self.best() if self.best else Answer(failure.trial.run)
            return replace(found, said=_failure(failure.trial), count=self.count)

    def refine(self, coarse: Trial, fine: Trial) -> Answer:
        """Compare the last two runs, and go finer until the error is allowed."""
        looked, needed = False, 0.0
        while True:
            parting = self.find_parting(coarse, fine)
            if parting.at < inf and not looked:
                looked, found = True, self.look_for_chaos(coarse, fine, parting)
                if isinstance(found, Answer):
                    return found
                coarse, fine = (self.complete(trial) for trial in found)
                continue
            if fine.end < self.duration:
                fine = self.complete(fine)
                continue
            errs, now, gain = self.estimate_errors(coarse, fine)
            beyond = worst(self.allowed, errs).ratio
            self.best = partial(self.finish, coarse, fine, errs, gain, dict(self.allowed))
            if beyond <= 1 and self.levels.truncation(fine.run) <= self.demand.place:
                return self.best()
            if self.count >= self.levels.runs_at_most or fine.level.tolerance <= 2 * self.levels.finest:
                return self.answer_until(coarse, fine, Status.SENSITIVE) if parting.at < inf else self.best()
            if parting.at < needed:
                return self.answer_until(coarse, fine, Status.CHAOTIC)
            self.before, self.ratio_before = now, coarse.level.tolerance / fine.level.tolerance
            ratio = self.find_ratio(beyond, parting.at < inf)
            share = self.find_share(parting.at, fine.level, ratio)
            needed = parting.at + LATER * (share - parting.at) if ratio >= self.levels.ratio**CONFIRMED and share else 0.0
            coarse, fine = fine, self.make(self.next_level(fine, ratio), self.duration)

    def find_share(self, parting: float, level: Level, ratio: float) -> float:
        """Find the time to which a refinement has to move a parting, if those that are left are to move it to the end [s]."""
        gone = log(ratio) / log(self.levels.ratio)
        to_go = max(1.0, self.levels.refinements_to_go(level))
        return parting + gone * (self.duration - parting) / to_go if parting < inf else 0.0

    def complete(self, trial: Trial) -> Trial:
        """Make the run of a level up to the end."""
        return trial if trial.end == self.duration else self.make(trial.level, self.duration)

    def run_first(self) -> Trial:
        """Make the coarsest run that does not fail."""
        level = self.levels.first()
        for _ in range(PATIENCE):
            try:
                return self.make(level, self.duration)
            except _FailedError as failure:
                if failure.trial.run.failure is None or failure.trial.run.failure[0] not in CURED:
                    raise
                level = self.levels.finer(level, self.levels.ratio)
        return self.make(level, self.duration)

    def next_level(self, trial: Trial, ratio: float) -> Level:
        """Return the level after a run, with degrees enough as far as that run tells."""
        return self.levels.raise_degree(self.levels.finer(trial.level, ratio), trial.run, self.demand.place)

    def find_ratio(self, beyond: float, parts: bool) -> float:
        """Find the ratio of tolerances that should make the error what is allowed."""
        ratio, most = self.levels.ratio, self.levels.orders[1]
        return float(ratio**JUMP if parts else np.clip((1 + 2 * beyond) ** (1 / most), ratio, ratio**JUMP))

    def compare(self, coarse: Trial, fine: Trial) -> Pair:
        """Return the comparison of two runs, that of before where they are the same."""
        if self.pair is None or self.pair.coarse is not coarse or self.pair.fine is not fine:
            self.pair = Pair(coarse, fine)
        return self.pair

    def find_parting(self, coarse: Trial, fine: Trial) -> Parting:
        """Find when two runs part."""
        self.allowed = self.demand.limits(fine.trajectory)
        return Parting(self.compare(coarse, fine).difference, self.allowed)

    def look_for_chaos(self, coarse: Trial, fine: Trial, parting: Parting) -> Answer | tuple[Trial, Trial]:
        """Return the answer where no finer run can follow the motion to its end, else the first two runs that agree."""
        rattles, last = fine.end < self.duration, fine
        pair = (coarse, fine) if rattles else None
        for _ in range(1 if rattles else CONFIRMED):
            end = min(last.end, self.find_share(parting.at, last.level, self.levels.ratio) * (1 + LAST / WINDOWS))
            finer = self.make(self.next_level(last, self.levels.ratio), end)
            parting = self.find_parting(last, finer)
            if parting.at == inf:
                return last, finer
            pair, last = pair or (last, finer), finer
        return self.answer_until(*(pair or (coarse, fine)), Status.CHAOTIC)

    def answer_until(self, a: Trial, b: Trial, chaos: Status) -> Answer:
        """Return run a with errors up to the time to which its difference to b, a finer run, is allowed."""
        gain = (a.level.tolerance / b.level.tolerance) ** self.levels.orders[0]
        whole = gain / (gain - 1)
        until = self.find_parting(a, b).within(1 / whole)
        now, sizes = Difference(a.trajectory, b.trajectory, until).norms(b.trajectory.signals)
        note = (
            f"the motion is one trajectory to about t = {until:.4g} s; beyond it is one of many, and errors are those up to "
            "then: result.reading(...) gives means, rms and peaks with their sampling errors"
        )
        return self.attach_errors(a, {key: max(LEAST, whole * off) for key, off in now.items()}, sizes, until, (note,), chaos)

    def estimate_errors(self, coarse: Trial, fine: Trial) -> tuple[dict[Key, float], dict[Key, float], dict[Key, float]]:
        """Estimate errors of what is demanded of the finer run; return also differences and gains."""
        asked = {name for name, _ in self.allowed}
        pair = self.compare(coarse, fine)
        now, _ = pair.difference.norms({n: s for n, s in fine.trajectory.signals.items() if n in asked})
        gain = self.find_gains(coarse, fine, {key: now[key] for key in self.allowed if key in now})
        found = add(errors({key: now[key] for key in gain}, gain), self.find_damped(fine))
        if worst(self.allowed, found).ratio <= 1:  # energies are looked at last
            self.allowed |= {BALANCE: BALANCE_ALLOWED} | {(name, Norm.RMS): STRIKE for name in self.demand.energies}
            off = {key: each for key, each in pair.energies[0].items() if key in self.allowed}
            found |= errors(off, gain) | {BALANCE: fine.energies[1]}
        return found, now, gain

    def find_damped(self, trial: Trial) -> dict[Key, float]:
        """Find errors by vibration that numerical damping takes of all runs."""
        return damped(trial.trajectory, self.levels.damping)

    def find_gains(self, coarse: Trial, fine: Trial, now: Mapping[Key, float]) -> dict[Key, float]:
        """Find by how much the finer run errs less than the coarser one."""
        least, most = self.levels.orders
        ratio = coarse.level.tolerance / fine.level.tolerance
        return gains(now, self.before, (ratio, self.ratio_before), (least, least if fine.trajectory.strikes else most))

    def finish(
        self, coarse: Trial, fine: Trial, found: Mapping[Key, float], gain: Mapping[Key, float], allowed: Mapping[Key, float]
    ) -> Answer:
        """Return the finer run with the errors of all its signals."""
        pair = self.compare(coarse, fine)
        now, sizes = pair.difference.norms(fine.trajectory.signals)
        energies, others = pair.energies
        every = add(errors(now | energies, gain), self.find_damped(fine)) | {BALANCE: fine.energies[1]} | dict(found)
        self.allowed = dict(allowed)
        return self.attach_errors(fine, every, sizes | others, float(fine.run.record.time[-1]))

    def attach_errors(
        self, trial: Trial, found: Mapping[Key, float], sizes: Mapping[Key, float], until: float, notes: tuple[str, ...] = (),
        chaos: Status | None = None,
    ) -> Answer:  # fmt: skip
        """Attach errors to a run, infinite ones where its steps do not follow a ringing."""
        run, unresolved = trial.trajectory, tuple(trial.trajectory.unresolved)
        found = {**found, **{(name, norm): inf for name in unresolved for norm in (Norm.RMS, Norm.PEAK) if (name, norm) in found}}
        averaged = [signal.source for signal in run.signals.values() if signal.period]
        rings = tuple(name for name in averaged if found.get((name, Norm.RMS), 0.0) > STRIKE)
        if rings:
            others = " and others" if len(rings) > 1 else ""
            notes += (f"{rings[0]}{others}: rings faster than the steps follow; read {rings[0]}.mean",)
        motion = [found[n, Norm.RMS] for n, s in run.signals.items() if s.kind is Kind.PLACE and (n, Norm.RMS) in found]
        kind = f"the difference of the last two of {self.count} runs of {type(trial.run.solver).__name__}"
        turn, largest = turn_of(trial.run.record.mechanism), max(motion, default=0.0)
        estimate = Errors(largest, dict(found), dict(sizes), kind, until, turn, rings, notes)
        return Answer(trial.run, estimate, worst(self.allowed, found), chaos, count=self.count)


def add(errors: Mapping[Key, float], more: Mapping[Key, float]) -> dict[Key, float]:
    """Add errors of the same signals and norms."""
    return {key: error + more.get(key, 0.0) for key, error in errors.items()}


def _failure(trial: Trial) -> str:
    """Return why a run ended early, in words."""
    status, said = trial.run.failure or (Status.NOT_FINITE, "no samples")
    return f"a finer run ended as {status}: {said}"
