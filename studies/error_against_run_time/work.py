"""A work of `error-against-run-time`: its runs by series and setting, the reference of each series, the measure of an error."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np

from buckler.mbs import Controlled, Mechanism, Spectral, simulate
from buckler.mbs.geometry import Array

Run = Callable[[], Array]
"""Does a whole job, from its description to the numbers that are compared."""
Runs = dict[tuple[str, str], Run]
"""Runs by series and setting."""
Hand = tuple[int, int, float, float]
"""Elements, equal steps, Newton's relative and absolute tolerance of a run written directly for the engine."""
Setting = tuple[float, int]
"""Tolerance of the compiled solver and degree of its strips; 0 without strips."""
PLAIN = "engine"
"""Series of runs of the engine with settings found by hand."""
ONCE = "once"
"""Series of single runs of the compiled solver."""
KNOWN = "known"
"""Series of runs by an accuracy."""
STEPS = 100_000_000
"""Most steps of a run: fine ones take more than Buckler allows by default."""
LIMIT = 300.0
"""Longest time of a run [s]."""
TIMES = 401
"""Equally spaced times at which motions are compared."""


@dataclass(frozen=True)
class ComparedWork:
    """One job.

    Attributes
    ----------
    about, measure : what is done, and what its error is
    runs : by series and setting, coarse to fine
    tuned : setting of the hand-tuned run that others are compared with
    references : what each series is held against, of the same shape as what its runs give; exact ones for each series
    scale : what the root mean square of a difference is divided by; by default that of the reference about its start
    largest : the largest relative error counts, not the root mean square
    motion : what Buckler runs, where it is a motion
    """

    about: str
    measure: str
    runs: Mapping[tuple[str, str], Run]
    tuned: str
    references: Mapping[str, Run]
    scale: float | None = None
    largest: bool = False
    motion: ComparedMotion | None = None

    def error(self, series: str, found: Array) -> float:
        """Return the error of an answer of a series; nan if its run failed."""
        return self.difference(found, self.references[series]())

    def difference(self, found: Array, exact: Array) -> float:
        """Difference of two answers, by the work's measure."""
        if self.largest:
            return float(np.abs(found / exact - 1).max())
        return _size(found - exact) / (self.scale or _size(exact - exact[0]))

    @property
    def uncertainty(self) -> float:
        """Difference of the references of two codes, below which no error is known; 0 of exact ones."""
        one, other = self.references[ONCE], self.references[PLAIN]
        return 0.0 if one is other or self.largest else self.difference(one(), other())


def _size(x: Array) -> float:
    return float(np.sqrt((x**2).sum(axis=-1).mean() if x.ndim > 1 else (x**2).mean()))


@dataclass(frozen=True)
class ComparedMotion:
    """A motion and the signals that are compared, with Buckler's runs by their settings."""

    mechanism: Mechanism
    duration: float
    signals: tuple[str, ...]

    @property
    def times(self) -> Array:
        """When signals are compared, s."""
        return np.linspace(0.0, self.duration, TIMES)

    def read(self, **how: Any) -> Array:
        """Signals of a run, shape (times, signals); nan after its end."""
        result = simulate(self.mechanism, self.duration, timeout=LIMIT, **how)
        return np.stack([result.at(name, self.times, outside=np.nan) for name in self.signals], axis=1)

    def once(self, tolerance: float, degree: int) -> Array:
        """Read one run of the compiled solver."""
        return self.read(solver=Spectral(Controlled(tolerance, max_steps=STEPS), degree=degree or None))

    def onces(self, *settings: Setting) -> Runs:
        """Name runs of the compiled solver by degree, where there are strips, and tolerance."""
        return {(ONCE, f"{n} x {power(x)}" if n else power(x)): partial(self.once, x, n) for x, n in settings}

    def knowns(self, *accuracies: float) -> Runs:
        """Name runs by their accuracy."""
        return {(KNOWN, power(x)): partial(self.read, accuracy=x, of=self.signals) for x in accuracies}


def power(value: float) -> str:
    """Write 1e-05 as 1e-5."""
    return f"{value:.0e}".replace("e-0", "e-")


def by_hand(run: Callable[[Hand], Array], settings: Sequence[Hand]) -> Runs:
    """Name runs written directly for the engine by elements and steps."""
    return {(PLAIN, f"{given[0]} x {given[1]}"): partial(run, given) for given in settings}


def cross_references(engine: Run, compiled: Run) -> dict[str, Run]:
    """References where no solution is exact: each code is judged by the other."""
    by_engine = cache(engine)
    return {PLAIN: cache(compiled), ONCE: by_engine, KNOWN: by_engine}
