"""Work of `error-against-run-time`: a job that several codes do at several settings, its references, the measure of its error.

The runs of one code are a series, see `ENGINE`, `ONCE` and `KNOWN`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Controlled, Mechanism, Spectral, simulate
from buckler.mbs.geometry import Array

Run = Callable[[], Array]
"""Function that does the whole job, from its description to the numbers that are compared."""
Runs = dict[tuple[str, str], Run]
"""Runs by series and setting."""
ENGINE = "engine"
"""Series of runs on Exudyn with settings found by hand."""
ONCE = "once"
"""Series of single runs of the compiled solver; for the buckled strip, of statics of Buckler's beams on Exudyn."""
KNOWN = "known"
"""Series of runs that are asked for an accuracy; such a run reports an estimate of its error."""
STEPS = 100_000_000
"""Largest number of steps in one run, chosen: fine runs take more than the default."""


class HandSetting(NamedTuple):
    """Setting of a run written for the engine: elements, equal steps, relative and absolute tolerance of Newton's method."""

    elements: int
    steps: int
    relative: float
    absolute: float


class AdaptiveSetting(NamedTuple):
    """Setting of a run with error control: tolerance and, if there are flexible strips, their resolution."""

    tolerance: float
    resolution: int = 0  # elements of a strip (Exudyn) or degree of its polynomials (compiled solver); 0 without strips

    @property
    def name(self) -> str:
        """Name of the setting: resolution, where there are strips, and tolerance."""
        return f"{self.resolution} x {power(self.tolerance)}" if self.resolution else power(self.tolerance)


@dataclass(frozen=True)
class ComparedMotion:
    """Motion of a mechanism with its duration [s], and the signals that are compared."""

    mechanism: Mechanism
    duration: float
    signals: tuple[str, ...]

    @property
    def times(self) -> Array:
        """Equally spaced times at which signals are compared [s]: 401, chosen."""
        return np.linspace(0.0, self.duration, 401)

    def simulate(self, **options: Any) -> Array:
        """Simulate the motion; return the signals, shape (times, signals), nan after the end of the run."""
        result = simulate(self.mechanism, self.duration, timeout=300.0, **options)  # 300 s, chosen
        return np.stack([result.at(name, self.times, outside=np.nan) for name in self.signals], axis=1)

    def run_compiled(self, tolerance: float, degree: int) -> Array:
        """Simulate the motion by one run of the compiled solver."""
        return self.simulate(solver=Spectral(Controlled(tolerance, max_steps=STEPS), degree=degree or None))

    def compiled_runs(self, *settings: AdaptiveSetting) -> Runs:
        """Make the series `once`."""
        return {(ONCE, setting.name): partial(self.run_compiled, *setting) for setting in settings}

    def accurate_runs(self, *accuracies: float) -> Runs:
        """Make the series `known`, whose settings are named by the accuracy, the largest relative error allowed."""
        return {(KNOWN, power(x)): partial(self.simulate, accuracy=x, of=self.signals) for x in accuracies}


@dataclass(frozen=True)
class Work:
    """Job with its runs and references."""

    about: str  # description of the job
    measure: str  # description of its error
    runs: Mapping[tuple[str, str], Run]  # by series and setting, coarse to fine
    tuned: str  # setting of the series `engine` with whose time other times are compared
    references: Mapping[str, Run]  # function that computes the reference of each series, of the same shape as its runs
    scale: float | None = None  # divisor of the rms of a difference; by default the rms of the reference less its start
    largest: bool = False  # true for exact references, where the error is the largest relative one, not an rms
    motion: ComparedMotion | None = None  # motion that Buckler simulates; None for statics

    def difference(self, found: Array, exact: Array) -> float:
        """Compute the difference of two results: the largest relative one, or the root mean square over the scale.

        The difference is nan if a result has a nan, as a motion has after the end of a failed run.
        """
        if self.largest:
            return float(np.abs(found / exact - 1).max())
        return _root_mean_square(found - exact) / (self.scale or _root_mean_square(exact - exact[0]))


def _root_mean_square(x: Array) -> float:
    """Compute the root mean square over times; of vectors, shape (times, components), that of their lengths."""
    return float(np.sqrt((x**2).sum(axis=-1).mean() if x.ndim > 1 else (x**2).mean()))


def power(value: float) -> str:
    """Write a number with one significant digit, all that the settings have: 1e-5, not 1e-05."""
    return f"{value:.0e}".replace("e-0", "e-")


def engine_runs(run: Callable[[HandSetting], Array], settings: Sequence[HandSetting]) -> Runs:
    """Make the series `engine`, whose settings are named by elements and steps."""
    return {(ENGINE, f"{each.elements} x {each.steps}"): partial(run, each) for each in settings}


def cross_references(engine: Run, compiled: Run) -> dict[str, Run]:
    """Return the references where no solution is exact: each code is compared with a fine run of the other."""
    by_engine = cache(engine)
    return {ENGINE: cache(compiled), ONCE: by_engine, KNOWN: by_engine}
