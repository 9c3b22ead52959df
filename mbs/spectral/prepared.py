"""Many runs of mechanisms that differ in numbers, side by side: the compiled integrators do not hold the interpreter's lock.

The order of elimination is found once for all of one structure (`elimination`), and machine code once for all mechanisms. What
is left of a short run's Python is its scene, its start and its record.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.run import Run
from buckler.mbs.solvers import Spectral
from buckler.mbs.spectral.run import once
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.validate import one_of, positive

T = TypeVar("T")
Make = Callable[..., Mechanism]


@dataclass(frozen=True)
class Prepared:
    """Runs of the mechanisms that a function makes of values.

    Attributes
    ----------
    make : callable
        (**values) -> Mechanism.
    duration : float
        s.
    solver : Spectral
    """

    make: Make
    duration: float
    solver: Spectral

    def run(self, **values: object) -> Run:
        """One run: signals are `run.values`, and None of `run.failure` says that it went well. No check has looked at it."""
        return once(self.make(**values), self.duration, self.solver)

    def runs(self, cases: Iterable[Mapping[str, object]], measure: Callable[[Run], T], workers: int | None = None) -> list[T]:
        """What a function of the run gives for each case, in their order; as many threads as there are cores by default."""
        with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
            return list(pool.map(lambda values: measure(self.run(**values)), cases))


def prepare(make: Make, duration: float, solver: Spectral | None = None, **values: object) -> Prepared:
    """Prepare runs of mechanisms that differ in their numbers.

    Parameters
    ----------
    make : callable
        (**values) -> Mechanism.
    duration : float
        s.
    solver : Spectral, optional
    **values
        One case, which is put together at once: what is wrong with the mechanism is told before any run.

    Raises
    ------
    ValueError
        If the mechanism has what the compiled solver does not know, or a number is out of its range.
    """
    solver = one_of("solver", solver or Spectral(), (Spectral,))
    Scene.of(make(**values), solver.degree)
    return Prepared(make, float(positive("duration", duration, "s")), solver)
