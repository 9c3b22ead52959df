"""One run of the compiled solver: the scene, the integrator that suits it, the record."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.record.result import Status
from buckler.mbs.record.run import Run
from buckler.mbs.spectral import implicit
from buckler.mbs.spectral.implicit import Output
from buckler.mbs.spectral.recording import record_of
from buckler.mbs.spectral.scene import SLOWEST_ONSET, Scene
from buckler.mbs.spectral.solver import Spectral
from buckler.mbs.spectral.start import balance

Array = np.ndarray[Any, Any]
GRAZE = 0.05
"""Share of a stop's fastest approach so far that slower ones are taken for; see `buckler.mbs.engine.stop`."""
CLOSE = 2e-2
"""Last Newton step, of the local error allowed."""
ROWS = 2000
"""Steps between looks at the clock."""


def once(mechanism: Any, duration: float, solver: Spectral, timeout: float | None = None, progress: Any = None) -> Run:
    """Build the scene and integrate it."""
    scene = Scene.of(mechanism, solver.degree)
    start = perf_counter()
    out, failure, counts = integrate(scene, duration, solver, timeout, progress)
    work = {
        "wall_s": perf_counter() - start,
        "steps": float(counts[implicit.STEPS]),
        "newton_iterations": float(counts[implicit.ITERATIONS]),
        "jacobians": float(counts[implicit.JACOBIANS]),
        "rejected": float(counts[implicit.REJECTED]),
    }
    return Run(solver, record_of(scene, out), failure, work, scene.summary())


def integrate(
    scene: Scene, duration: float, solver: Spectral, timeout: float | None = None, progress: Any = None,
    state: tuple[Array, Array] | None = None,
) -> tuple[Output, tuple[Status, str] | None, Array]:  # fmt: skip
    """Integrate a scene from t = 0, or from another state (q, v) there: what it left, how it failed if so, counts of its work."""
    q, v = (scene.q0, scene.v0) if state is None else state
    memory = scene.memory()
    rest = balance(scene, q, v, 0.0, memory)
    room = implicit.room_for(q, v, rest.acceleration, rest.multipliers, memory, scene.units)
    controls, counts = _controls(duration, solver), np.zeros(implicit.COUNTERS, dtype=np.int64)
    clock = np.array([0.0, controls[implicit.FIRST_STEP], 0.0, 0.0, 0.0, 0.0])
    stops = np.array([t for t in scene.kinks if 0.0 < t < duration])
    deadline = perf_counter() + timeout if timeout else np.inf
    parts, failure = [], None
    while clock[0] < duration * (1 - 1e-14) and failure is None:
        out = implicit.output_for(ROWS, room)
        implicit.run_implicit(scene.tables, scene.work, room, clock, duration, stops, controls, out, counts)
        parts.append(Output(*(x[: counts[implicit.SAMPLES]] for x in out)))
        failure = _failure(counts, clock[0], solver)
        if progress is not None:
            progress(clock[0] / duration)
        if failure is None and perf_counter() > deadline:
            failure = (Status.TIMED_OUT, f"out of time at t = {clock[0]:.6g} s of {duration:.6g} s")
    return Output(*(np.concatenate(x) for x in zip(*parts, strict=True))), failure, counts


def _controls(duration: float, solver: Spectral) -> Array:
    out = np.zeros(implicit.CONTROLS)
    longest = solver.max_step or duration / 100
    first = duration * 1e-5
    if solver.uniform_steps is not None:
        longest = first = duration / solver.uniform_steps
    for place, value in (
        (implicit.TOLERANCE, solver.tolerance), (implicit.RADIUS, solver.spectral_radius), (implicit.LONGEST, longest),
        (implicit.FIRST_STEP, first), (implicit.BUDGET, solver.max_steps), (implicit.FLOOR, SLOWEST_ONSET),
        (implicit.GRAZE, GRAZE), (implicit.CONTACT_TOLERANCE, solver.contact_tolerance),
        (implicit.FIXED_STEPS, float(solver.uniform_steps is not None)), (implicit.CLOSE, CLOSE),
        (implicit.EVERY, solver.record_every),
    ):  # fmt: skip
        out[place] = value
    return out


def _failure(counts: Array, t: float, solver: Spectral) -> tuple[Status, str] | None:
    status = counts[implicit.STATUS]
    if status == implicit.UNDERFLOW:
        return Status.NEWTON_DIVERGED, f"no convergence after t = {t:.6g} s, however short the step"
    if status == implicit.NOT_FINITE:
        return (
            Status.NOT_FINITE,
            f"coordinates are not finite after t = {t:.6g} s: a law or a motion returned nan, or a force grew",
        )
    if status == implicit.TOO_MANY:
        return Status.TOO_MANY_STEPS, f"more than max_steps = {solver.max_steps} steps by t = {t:.6g} s"
    return None
