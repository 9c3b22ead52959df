"""One run of the compiled solver: the scene, the integrator that suits it, the record."""

from __future__ import annotations

from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.record.record import Record
from buckler.mbs.record.result import Status
from buckler.mbs.record.run import Run
from buckler.mbs.spectral import explicit, implicit
from buckler.mbs.spectral.implicit import Output
from buckler.mbs.spectral.recording import record_of
from buckler.mbs.spectral.scene import SLOWEST_ONSET, Scene
from buckler.mbs.spectral.solver import Spectral
from buckler.mbs.spectral.start import balance
from buckler.mbs.spectral.tables import DRY, FASTEST, JOURNAL, ONSET, SEAT, STRUT

Array = np.ndarray[Any, Any]
GRAZE = 0.05
"""Share of a stop's fastest approach so far that slower ones are taken for; see `buckler.mbs.engine.stop`."""
CLOSE = 2e-2
"""Last Newton step, of the local error allowed."""
CLOSEST = 1e-13
"""The same of equal steps, whose error nothing watches:
what is left of a place, over the step squared, is an error of an acceleration."""
ROWS = 2000
"""Steps between looks at the clock."""


class State(NamedTuple):
    """A state from which to go on: time, coordinates, rates, memories of forces."""

    time: float
    q: Array
    v: Array
    memory: Array


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

    def again(first: int, last: int) -> Record | None:
        memory = out.memory[first].copy()
        memory[:, FASTEST] = np.maximum(memory[:, ONSET], SLOWEST_ONSET)
        state = State(float(out.time[first]), out.q[first], out.v[first], memory)
        finer, failed, _ = integrate(scene, float(out.time[last]), solver.finer(out.time), timeout, None, state)
        return None if failed else record_of(scene, finer)

    return Run(solver, record_of(scene, out), failure, work, scene.summary(), again)


def integrate(
    scene: Scene, end: float, solver: Spectral, timeout: float | None = None, progress: Any = None, state: State | None = None,
) -> tuple[Output, tuple[Status, str] | None, Array]:  # fmt: skip
    """Integrate a scene from t = 0, or from another state: what it left, how it failed if so, counts of its work."""
    state = state or State(0.0, scene.q0, scene.v0, scene.memory())
    rest = balance(scene, state.q, state.v, state.time, state.memory)
    if explicitly(scene, solver):
        room: Any = explicit.flight_for(state.q, state.v, rest.multipliers, state.memory, scene.mass_at(state.q), scene.units)
        run = explicit.run_explicit
    else:
        room = implicit.room_for(
            state.q, state.v, rest.acceleration, rest.multipliers, state.memory, scene.mass_at(state.q), scene.units
        )
        run = implicit.run_implicit
    controls, counts = _controls(end - state.time, solver), np.zeros(implicit.COUNTERS, dtype=np.int64)
    clock = np.array([state.time, controls[implicit.FIRST_STEP], 0.0, 0.0, 0.0, 0.0])
    stops = np.array([t for t in scene.kinks if state.time < t < end])
    deadline = perf_counter() + timeout if timeout else np.inf
    parts, failure = [], None
    while clock[0] < end * (1 - 1e-14) and failure is None:
        out = implicit.output_for(ROWS, scene.size, len(rest.multipliers), state.memory.shape)
        run(scene.tables, scene.work, room, clock, end, stops, controls, out, counts)
        parts.append(Output(*(x[: counts[implicit.SAMPLES]] for x in out)))
        failure = _failure(counts, clock[0], solver)
        if progress is not None:
            progress(clock[0] / end)
        if failure is None and perf_counter() > deadline:
            failure = (Status.TIMED_OUT, f"out of time at t = {clock[0]:.6g} s of {end:.6g} s")
    return Output(*(np.concatenate(x) for x in zip(*parts, strict=True))), failure, counts


def explicitly(scene: Scene, solver: Spectral) -> bool:
    """Whether the explicit integrator runs a scene: nothing is stiff but contacts, and some of these have clearance."""
    s = scene.tables
    if solver.method != "chosen":
        return solver.method == "explicit"
    kinds = s.forces[:, 0]
    return not len(s.strips) and bool((kinds == JOURNAL).any()) and not np.isin(kinds, (STRUT, SEAT, DRY)).any()


def _controls(duration: float, solver: Spectral) -> Array:
    out = np.zeros(implicit.CONTROLS)
    longest, equal = solver.longest(duration), solver.count is not None
    first = longest if equal else duration * 1e-5
    for place, value in (
        (implicit.TOLERANCE, solver.tolerance), (implicit.RADIUS, solver.spectral_radius), (implicit.LONGEST, longest),
        (implicit.FIRST_STEP, first), (implicit.BUDGET, solver.steps.max_steps), (implicit.FLOOR, SLOWEST_ONSET),
        (implicit.GRAZE, GRAZE), (implicit.CONTACT_TOLERANCE, solver.contact_tolerance),
        (implicit.FIXED_STEPS, float(equal)), (implicit.CLOSE, CLOSEST / solver.tolerance if equal else CLOSE),
        (implicit.EVERY, solver.steps.record_every),
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
        return Status.TOO_MANY_STEPS, f"more than max_steps = {solver.steps.max_steps} steps by t = {t:.6g} s"
    return None
