"""One run of the compiled solver: the scene, the integrator that suits it, the record."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.compiler import working_time
from buckler.mbs.elements.striking import GRAZE, SLOWEST_ONSET
from buckler.mbs.interrupts import ctrl_c
from buckler.mbs.kinematics.diagnosis import remarks
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.record import Record
from buckler.mbs.record.run import Run
from buckler.mbs.record.status import Status
from buckler.mbs.solvers.choice import stiffly_damped
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.spectral import explicit, implicit, output
from buckler.mbs.spectral.fronts import Orders
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.recording import record_of
from buckler.mbs.spectral.room import room_for
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.settle import begin
from buckler.mbs.spectral.start import balance
from buckler.mbs.spectral.tables import DRY, FASTEST, JOURNAL, ONSET, SEAT, STRUT, TURN
from buckler.mbs.spectral.threads import one_thread

Array = np.ndarray[Any, Any]
CLOSE = 1e-4
"""Last Newton step, of the local error allowed: what is left of a place, over the step, is left of a speed, and adds up."""
CLOSEST = 1e-12
"""The same of equal steps, whose error nothing watches."""
ARRIVED = 1.1e-12
"""Of the end: a run this near to it is over; the integrators themselves stop 1e-12 before it."""
SHORT = 1e-3
"""First step, of the longest: a finer run is finer from its start on, where stiff parts ring as the steps let them."""
ROWS = 2000
"""Steps between looks at the clock."""


class State(NamedTuple):
    """A state from which to go on: time, coordinates, rates, memories of forces, and angles of markers, which count whole turns.

    Without angles it is one at the start.
    """

    time: float
    q: Array
    v: Array
    memory: Array
    turns: Array | None = None


def once(
    mechanism: Mechanism, duration: float, solver: Spectral, timeout: float | None = None, progress: Any = None,
    ends: Array | None = None, every: int | None = None,
) -> Run:  # fmt: skip
    """Build the scene and integrate it; `ends` and `every` as in `integrate`."""
    scene = Scene.of(mechanism, solver.degree)
    start = working_time()
    out, failure, counts = integrate(scene, duration, solver, timeout, progress, ends=ends, every=every)
    work = {
        "wall_s": working_time() - start,
        "steps": float(counts[output.STEPS]),
        "newton_iterations": float(counts[output.ITERATIONS]),
        "jacobians": float(counts[output.JACOBIANS]),
        "rejected": float(counts[output.REJECTED]),
    }

    def again(first: int, last: int) -> Record | None:
        memory = out.memory[first].copy()
        memory[:, FASTEST] = np.maximum(memory[:, ONSET], SLOWEST_ONSET)
        turns = scene.turns(out.q[: first + 1])
        state = State(float(out.time[first]), out.q[first], out.v[first], memory, turns)
        finer, failed, _ = integrate(scene, float(out.time[last]), solver.finer(out.time), timeout, None, state)
        return None if failed else record_of(scene, finer, turns)

    return Run(
        solver, record_of(scene, out), failure, work, scene.summary(), again, [*remarks(mechanism, scene.redundant), *scene.told]
    )


def integrate(
    scene: Scene, end: float, solver: Spectral, timeout: float | None = None, progress: Any = None, state: State | None = None,
    ends: Array | None = None, every: int | None = None,
) -> tuple[Output, tuple[Status, str] | None, Array]:  # fmt: skip
    """Integrate a scene from t = 0, or from another state: what it left, how it failed if so, counts of its work.

    `ends` are times at which steps end, besides beginnings of contacts, instead of those that the local error asks for; of
    `every` so many steps one is kept, and nothing between them.
    """
    state = state or State(0.0, *begin(scene), scene.memory())
    scene.work.state[:, TURN] = scene.turns(scene.q0[None]) if state.turns is None else state.turns
    rest = balance(scene, state.q, state.v, state.time, state.memory)
    order: Any = scene.heavy_fronts
    if explicitly(scene, solver):
        room: Any = explicit.flight_for(scene, state.q, state.v, rest.multipliers, state.memory)
        run = explicit.run_explicit
    else:
        room = room_for(scene, state.q, state.v, rest.acceleration, rest.multipliers, state.memory)
        run, order = implicit.run_implicit, Orders(scene.fronts, scene.heavy_fronts)
    controls, counts = _controls(end - state.time, solver), np.zeros(output.COUNTERS, dtype=np.int64)
    clock = np.array([state.time, controls[output.FIRST_STEP], 0.0, 0.0, 0.0, 0.0])
    stops = np.array([t for t in scene.kinks if state.time < t < end])
    if ends is not None:
        stops = np.unique(np.concatenate([stops, ends]))
        controls[[output.FIRST_STEP, output.LONGEST, output.FIXED_STEPS]] = end, end, 1.0
        controls[output.CLOSE], clock[1] = CLOSEST / solver.tolerance, end
    if every is not None:
        controls[output.EVERY] = every
    deadline = working_time() + timeout if timeout else np.inf
    parts, failure = [], None
    with ctrl_c() as interrupted:
        while clock[0] < end * (1 - ARRIVED) and failure is None:
            out = output.output_for(ROWS, scene.size, len(rest.multipliers), state.memory.shape)
            try:
                with one_thread():
                    run(scene.tables, order, scene.work, room, clock, end, stops, controls, out, counts)
                failure = _failure(counts, clock[0], solver)
            except np.linalg.LinAlgError:
                counts[output.SAMPLES] = int(np.argmax(out.time)) + 1
                failure = Status.SINGULAR, f"the constraints' matrix is singular after t = {out.time.max():.6g} s"
            parts.append(Output(*(x[: counts[output.SAMPLES]] for x in out)))
            if progress is not None:
                progress(clock[0] / end)
            if failure is None and (interrupted() or working_time() > deadline):
                why = (Status.INTERRUPTED, "Ctrl-C") if interrupted() else (Status.TIMED_OUT, "out of time")
                failure = why[0], f"{why[1]} at t = {clock[0]:.6g} s of {end:.6g} s"
    return Output(*(np.concatenate(x) for x in zip(*parts, strict=True))), failure, counts


def explicitly(scene: Scene, solver: Spectral) -> bool:
    """Whether the explicit integrator runs a scene: nothing is stiff but contacts with clearance, not stiffly damped ones.

    Where they are, the implicit one is 2 to 8 times faster, and its energies add up 30 times better (docs/theory-spectral.md).
    """
    s = scene.tables
    if solver.method != "chosen":
        return solver.method == "explicit"
    kinds = s.forces[:, 0]
    loose = not len(s.strips) and bool((kinds == JOURNAL).any()) and not np.isin(kinds, (STRUT, SEAT, DRY)).any()
    return loose and not stiffly_damped(scene.mechanism)


def _controls(duration: float, solver: Spectral) -> Array:
    out = np.zeros(output.CONTROLS)
    longest, equal = solver.longest(duration), solver.count is not None
    first = longest if equal else SHORT * min(longest, duration / 100)
    for place, value in (
        (output.TOLERANCE, solver.tolerance), (output.LONGEST, longest),
        (output.FIRST_STEP, first), (output.BUDGET, solver.steps.max_steps), (output.FLOOR, SLOWEST_ONSET),
        (output.GRAZE, GRAZE), (output.CONTACT_TOLERANCE, solver.contact_tolerance),
        (output.FIXED_STEPS, float(equal)), (output.CLOSE, CLOSEST / solver.tolerance if equal else CLOSE),
        (output.EVERY, solver.steps.record_every),
    ):  # fmt: skip
        out[place] = value
    return out


def _failure(counts: Array, t: float, solver: Spectral) -> tuple[Status, str] | None:
    status = counts[output.STATUS]
    if status == output.UNDERFLOW:
        return Status.NEWTON_DIVERGED, f"no convergence after t = {t:.6g} s, however short the step"
    if status == output.NOT_FINITE:
        return (
            Status.NOT_FINITE,
            f"coordinates are not finite after t = {t:.6g} s: a law or a motion returned nan, or a force grew",
        )
    if status == output.TOO_MANY:
        return Status.TOO_MANY_STEPS, f"more than max_steps = {solver.steps.max_steps} steps by t = {t:.6g} s"
    return None
