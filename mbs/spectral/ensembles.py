"""Many runs in threads, of one mechanism from almost the same start or of others: the integrators do not hold Python's lock.

Motion with clearance is chaotic: an offset of 1e-12 m grows to 1e-4 m within some 40 ms. Single trajectories then mean nothing
beyond that; means over cycles do, with their standard errors.

Of mechanisms that differ in numbers the order of elimination is found once for all of one structure (`elimination`), and machine
code once for all. What is left of a short run's Python is its scene, its start and its record.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

import numpy as np

from ..geometry import Array
from ..mechanism import Mechanism
from ..record.energy import ledger
from ..record.errors import Status
from ..record.record import Record
from ..record.result import Result
from ..record.run import Run
from ..solvers import Spectral
from ..validate import one_of, positive, whole
from .dense import refined
from .frame_body import FrameBody
from .recording import record_of
from .run import State, integrate, once
from .scene import Scene
from .start import begin as settled
from .tables import work_for

T = TypeVar("T")


class Member(NamedTuple):
    """One run of an ensemble: its seed, its signals and energies, which no check has looked at, its record, its last state."""

    seed: int
    result: Result
    record: Record
    state: State


def resume(scene: Scene, end: float, solver: Spectral, state: State, seed: int = 0, between: int = 0) -> Member:
    """Run a scene from a state on; see `ensemble`."""
    out, failure, counts = integrate(scene, end, solver, state=state)
    record = record_of(scene, refined(scene, out, between) if between and len(out.time) > 1 else out)
    run = Run(solver, record, failure, {"steps": float(counts.steps)})
    ended = failure or (Status.OK, "")
    result = Result(*ended, record.time, run.values, run.units, run.work, ledger(record), traits=run.traits)
    return Member(seed, result, record, State(float(out.time[-1]), out.q[-1], out.v[-1], out.memory[-1].copy()))


def ensemble(
    mechanism: Mechanism, duration: float, seeds: Iterable[int], measure: Callable[[Member], T], *, spread: float = 1e-9,
    solver: Spectral | None = None, workers: int = 1, between: int = 0,
) -> list[T]:  # fmt: skip
    """Run a mechanism once for each seed, and measure each run where it was made.

    Parameters
    ----------
    mechanism : Mechanism
    duration : float
        s.
    seeds : iterable of int
        One a member, for the offset of its start.
    measure : callable
        member -> anything; the member's arrays are let go after it.
    spread : float
        Standard deviation of the start's offset, m and rad: of the links' places and angles that constraints leave free.
    solver : Spectral, optional
    workers : int
        Threads.
    between : int
        States of each step that signals have beside its end: peaks of forces that loose steps go over are in between.

    Returns
    -------
    list
        What `measure` gave, in the order of the seeds.

    Raises
    ------
    ValueError
        If there are no seeds, or a number is out of its range.
    """
    positive("duration", duration, "s"), positive("spread", spread, "m"), whole("workers", workers, 1, 1024)
    whole("between", between, 0, 100)
    if not (seeds := tuple(seeds)):
        raise ValueError("seeds = (): must be one number or more, one for each member")
    solver = one_of("solver", solver or Spectral(), (Spectral,))
    scene = Scene.of(mechanism, solver.degree)
    start = State(0.0, *settled(scene), scene.memory())
    shifts = [offset(scene, spread, seed) for seed in seeds]

    def member(k: int) -> T:
        own = replace(scene, work=work_for(scene.tables))
        return measure(resume(own, duration, solver, start._replace(q=start.q + shifts[k]), seeds[k], between))

    if workers == 1:
        return [member(k) for k in range(len(seeds))]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(member, range(len(seeds))))


def offset(scene: Scene, spread: float, seed: int) -> Array:
    """A small change of the start that constraints allow, to first order; modes stay at rest."""
    step = spread * np.random.default_rng(seed).standard_normal(scene.size)
    for body in scene.builder.bodies.values():
        if isinstance(body, FrameBody):
            step[body.offset + 3 : body.offset + 3 + body.modes] = 0.0
    return allowed(scene.assemble(scene.q0, tangents=False).jacobian, step)


def allowed(rows: Array, *changes: Array) -> Array:
    """The part of changes of all coordinates, one after the other, that constraints' rows allow, to first order."""
    if not len(rows):
        return np.concatenate(changes)
    back = np.linalg.pinv(rows, rcond=1e-10)
    return np.concatenate([each - back @ (rows @ each) for each in changes])


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
