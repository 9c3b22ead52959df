"""Many runs of one mechanism from almost the same start, in threads: the compiled integrators do not hold the interpreter's lock.

Motion with clearance is chaotic: an offset of 1e-12 m grows to 1e-4 m within some 40 ms. Single trajectories then mean nothing
beyond that; means over cycles do, with their standard errors.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from buckler.mbs.record.status import Status
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.spectral.frame_body import FrameBody
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.run import State, integrate
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.tables import work_for
from buckler.mbs.validate import positive, whole

Array = np.ndarray[Any, Any]


@dataclass(frozen=True)
class Member:
    """One run of an ensemble: its seed, what it left, how it failed if so."""

    seed: int
    out: Output
    failure: tuple[Status, str] | None


def ensemble(
    mechanism: Any, duration: float, seeds: Iterable[int], measure: Callable[[Scene, Member], Any], *, spread: float = 1e-9,
    solver: Spectral | None = None, workers: int = 1,
) -> list[Any]:  # fmt: skip
    """Run a mechanism once for each seed, and measure each run where it was made.

    Parameters
    ----------
    mechanism : Mechanism
    duration : float
        s.
    seeds : iterable of int
        One a member, for the offset of its start.
    measure : callable
        (scene, member) -> anything; the member's arrays are let go after it.
    spread : float
        Standard deviation of the start's offset, m and rad: of the links' places and angles that constraints leave free.
    solver : Spectral, optional
    workers : int
        Threads.

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
    if not (seeds := tuple(seeds)):
        raise ValueError("seeds = (): must be one number or more, one for each member")
    solver = solver or Spectral()
    scene = Scene.of(mechanism, solver.degree)
    start = State(0.0, scene.q0, scene.v0, scene.memory())
    shifts = [offset(scene, spread, seed) for seed in seeds]

    def member(k: int) -> Any:
        own = replace(scene, work=work_for(scene.tables))
        out, failure, _ = integrate(own, duration, solver, state=start._replace(q=start.q + shifts[k]))
        return measure(own, Member(seeds[k], out, failure))

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
    rows = scene.assemble(scene.q0, tangents=False).jacobian
    if len(rows):
        step = step - np.linalg.pinv(rows, rcond=1e-10) @ (rows @ step)
    return np.asarray(step)
