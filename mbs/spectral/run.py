"""One run of the compiled solver: the scene, the integrator that suits it, the record."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba.core.errors import NumbaError

from ..elements.stop import GRAZE, SLOWEST_ONSET
from ..functions import current_memory, use_memory
from ..geometry import Array
from ..laws import BristleLaw, FrictionLaw
from ..laws.compiled import RAISED
from ..mechanism import Mechanism
from ..process import Progress, ctrl_c, working_time
from ..record.errors import Status
from ..record.run import Run
from ..solvers import COARSEST, Spectral, subdivide
from . import explicit, implicit, output
from .fronts import Orders
from .output import DormandPrince, Output, Radau
from .recording import record_of
from .scene import CompiledScene
from .start import Balance, balance, dormand_prince, radau_state, start_rates
from .tables import ForceKind, Memory, State

CLOSE = 1e-4
"""Last Newton step, of the local error allowed at the tolerance `CLOSE_AT`. What is left adds up, with steps and with speeds
over a step, as tol^(1/2), and errors go as tol^(3/4): the share goes as tol^(1/4). Unscaled, a double pendulum of 10 s is off
by 3e-3 at any tolerance below 1e-8; ten times less costs a tenth of the iterations."""
CLOSE_AT = 1e-5
"""Tolerance above which the last Newton step is a fixed share of it: errors of coarser runs are larger by far."""
CLOSEST = 1e-12
"""The same of equal steps, whose error nothing watches."""
ARRIVED = 1.1e-12
"""Distance from the end at which a run is over, relative to it; the integrators themselves stop 1e-12 before it."""
SHORT = 1e-3
"""First step, of the longest: a finer run is finer from its start on, where stiff parts ring as the steps let them, and two runs
never share their first samples."""
OF_GAP = 4e-3
"""Largest local error of explicit steps, of the smallest clearance. At a hundredth contacts chatter: a tenth more onsets."""
MOST_VIOLATION = 1e-6
"""Largest gap of constraints at the end, over the longest link, or rad; they are met to 1e-8 at any tolerance."""
DISTINCT = 1e-12
"""Distance of two ends of steps, of the end, below which they are one: a step between them would be rounding."""
STEPS_PER_CALL = 2000
"""Steps between looks at the clock."""


def scene_or_reason(mechanism: Mechanism, degree: int | None) -> CompiledScene | str:
    """Translate a mechanism; return the reason if this solver does not support it.

    Friction without memory of a guide could be translated, but near self-locking its first reactions are wrong.
    """
    for guide in mechanism.guides:
        if isinstance(guide.friction, FrictionLaw) and not isinstance(guide.friction, BristleLaw):
            return f"friction of {guide.where} has no memory and follows its reaction"
    try:
        return CompiledScene.of(mechanism, degree)
    except (ValueError, NotImplementedError, NumbaError) as refusal:
        return " ".join(str(refusal).split())


class RunState(NamedTuple):
    """A state from which a run starts: time, coordinates, rates, memories of forces, angles of markers with whole turns.

    Without angles it is a state at the start.
    """

    time: float
    q: Array
    v: Array
    memory: Array
    turns: Array | None = None


def memory_at_end(out: Output) -> Array:
    """Memories of forces to continue a run; rows have a time instead of the fastest onset, for which the onset speed is taken."""
    memory = out.memory[-1].copy()
    memory[:, Memory.FASTEST] = np.maximum(memory[:, Memory.ONSET], SLOWEST_ONSET)
    return memory


def once(
    mechanism: Mechanism, duration: float, solver: Spectral, timeout: float | None = None, progress: Progress | None = None,
    ends: Array | None = None, scene: CompiledScene | None = None,
) -> Run:  # fmt: skip
    """Integrate a mechanism, or its `scene` if given; `ends` as in `integrate`."""
    scene = scene or CompiledScene.of(mechanism, solver.degree)
    start = working_time()
    out, failure, counts = integrate(scene, duration, solver, timeout, progress, ends=ends)
    work = {
        "wall_s": working_time() - start,
        "steps": float(counts.steps),
        "newton_iterations": float(counts.iterations),
        "jacobians": float(counts.jacobians),
        "rejected": float(counts.rejected),
    }

    notes, record = [*scene.source.remarks, *scene.notes], record_of(scene, out)
    return Run(solver, record, failure or _contradiction(scene, out), work, scene.summary(), notes)


def _contradiction(scene: CompiledScene, out: Output) -> tuple[Status, str] | None:
    """Find constraints violated at the end: contradictory ones Newton's method solves as well as possible."""
    t = float(out.time[-1])
    gap = np.abs(scene.assemble(out.q[-1], out.v[-1], t, tangents=False).residual)
    if not gap.max(initial=0.0) > MOST_VIOLATION * scene.length:
        return None
    what = f"'{scene.row_names[int(gap.argmax())]}' is off by {gap.max():.2g} m or rad"
    return Status.SINGULAR, f"by t = {t:.6g} s what holds the mechanism contradicts itself: {what}"


def integrate(
    scene: CompiledScene, end: float, solver: Spectral, timeout: float | None = None, progress: Progress | None = None,
    state: RunState | None = None, ends: Array | None = None, every: int = 1, take: Callable[[Output], None] | None = None,
) -> tuple[Output, tuple[Status, str] | None, output.Record]:  # fmt: skip
    """Integrate a scene from t = 0, or from another state; return its rows, its failure or None, counts of its work.

    Steps end at the times `ends` and at onsets of contacts, by default as the local error requires. One step in `every` is
    written, and samples within steps only if that is 1. If there is a `take`, it is called with all rows, part by part; then only
    the last row is returned, and explicit steps do not end at onsets without a kink.
    """
    state = state or RunState(0.0, scene.q0, start_rates(scene), scene.memory())
    scene.work.state[:, State.TURN] = scene.turns(scene.q0[None]) if state.turns is None else state.turns
    rest = balance(scene, state.q, state.v, state.time, state.memory)
    controls, clock, counts = _controls(scene, state.time, end, solver), output.blank(output.CLOCK), output.blank(output.COUNTS)
    stops = _stops(scene, state.time, end, controls.longest if not controls.fixed and ends is None else None)
    run, model, shortest = _method(scene, solver, state, rest)
    controls.located = take is None
    controls.shortest, controls.every = shortest * end, max(every, controls.every)
    if ends is not None:
        stops = np.unique(np.concatenate([stops, ends]))
        controls.first_step, controls.longest, controls.fixed, controls.newton_share = end, end, True, CLOSEST / solver.tolerance
    clock.time, clock.next_step = state.time, controls.first_step
    deadline = working_time() + timeout if timeout else np.inf
    parts, failure = [], None
    RAISED.clear()
    with ctrl_c() as interrupted:
        while clock.time < end * (1 - ARRIVED) and failure is None:
            out = output.output_for(STEPS_PER_CALL, scene.size, len(rest.multipliers), state.memory.shape)
            run(model, clock, controls, stops, out, counts)
            failure = _failure(counts, clock.time, solver)
            part = Output(*(x[: counts.samples] for x in out))
            if RAISED:
                part, failure = _cut_at_exception(scene, part)
            if take is None:
                parts.append(part)
            elif len(part.time):
                take(part)
                parts = [Output(*(x[-1:].copy() for x in part))]
            if progress is not None:
                progress(clock.time / end)
            if failure is None and (interrupted() or working_time() > deadline):
                why = (Status.INTERRUPTED, "Ctrl-C") if interrupted() else (Status.TIMED_OUT, "out of time")
                failure = why[0], f"{why[1]} at t = {clock.time:.6g} s of {end:.6g} s"
    return Output(*(np.concatenate(x) for x in zip(*parts, strict=True))), failure, counts


def _stops(scene: CompiledScene, start: float, end: float, longest: float | None) -> Array:
    """Find times at which steps end: kinks of functions of time, with parts of the longest step between them, and the end."""
    pace = scene.tables.time_factor[0]
    with use_memory(current_memory(scene.edge_memory)):
        kinks = [t / pace for t in scene.source.kinks(end * pace) if start < t / pace < end]
    if longest is not None:
        kinks = subdivide(kinks, longest, end / COARSEST)
    stops = np.unique([*kinks, end])
    return stops[np.append(np.diff(stops) > DISTINCT * end, True)]


def _method(
    scene: CompiledScene, solver: Spectral, state: RunState, rest: Balance
) -> tuple[Callable[..., None], Radau | DormandPrince, float]:
    """Choose the integrator that suits a scene; return it with its data and its shortest step over the end."""
    if explicitly(scene, solver):
        model = dormand_prince(scene, state.q, state.v, rest.multipliers, state.memory)
        return explicit.run_explicit, model, explicit.SHORTEST
    room = radau_state(scene, state.q, state.v, rest.acceleration, rest.multipliers, state.memory)
    orders, tables = Orders(scene.fronts, scene.mass_fronts), scene.tables._replace(edges=scene.edges())
    return implicit.run_implicit, Radau(tables, orders, scene.work, room), implicit.SHORTEST


def explicitly(scene: CompiledScene, solver: Spectral) -> bool:
    """Return True if the explicit integrator suits: only contacts with clearance are stiff, and these not stiffly damped.

    If they are, the implicit one is 2 to 8 times faster with a 30 times smaller energy error (docs/theory-spectral.md).
    """
    s = scene.tables
    if solver.method != "chosen":
        return solver.method == "explicit"
    kinds = s.forces[:, 0]
    stiff = np.isin(kinds, (ForceKind.STRUT, ForceKind.FRICTION, ForceKind.FRICTION_FORCE, ForceKind.STATEFUL)).any()
    loose = not len(s.strips) and bool((kinds == ForceKind.JOURNAL).any()) and not stiff
    return loose and not scene.source.is_stiffly_damped


def _controls(scene: CompiledScene, start: float, end: float, solver: Spectral) -> output.Record:
    out, equal, duration = output.blank(output.CONTROLS), not solver.steps.adaptive, end - start
    out.end, out.tolerance, out.contact_tolerance = end, solver.tolerance, solver.contact_tolerance
    out.longest = longest = solver.longest(duration)
    out.first_step = longest if equal else SHORT * min(longest, duration / COARSEST)
    out.max_steps, out.every, out.fixed = solver.steps.max_steps, 1, equal
    out.least_onset, out.graze = SLOWEST_ONSET, GRAZE * min(1.0, solver.contact_tolerance / Spectral().contact_tolerance)
    out.newton_share = CLOSEST / solver.tolerance if equal else CLOSE * min(1.0, solver.tolerance / CLOSE_AT) ** (1 / 4)
    if explicitly(scene, solver):
        out.tolerance = min([out.tolerance, *(OF_GAP * joint.gap / scene.source.size for joint in scene.source.clearances)])
    return out


def _failure(counts: output.Record, t: float, solver: Spectral) -> tuple[Status, str] | None:
    status = counts.status
    if status == output.Ended.UNDERFLOW:
        return Status.NEWTON_DIVERGED, f"no convergence after t = {t:.6g} s, however short the step"
    if status == output.Ended.NOT_FINITE:
        return (
            Status.NOT_FINITE,
            f"coordinates are not finite after t = {t:.6g} s: a law or a motion returned nan, or a force grew",
        )
    if status == output.Ended.TOO_MANY:
        return Status.TOO_MANY_STEPS, f"more than max_steps = {solver.steps.max_steps} steps by t = {t:.6g} s"
    return None


def _cut_at_exception(scene: CompiledScene, out: Output) -> tuple[Output, tuple[Status, str]]:
    """Find the part of a run before a user's function raised an exception, by bisection; return it with status and message.

    A ValueError of a strut's law means that it is out of its range.
    """
    error, low, high = RAISED[0], 0, len(out.time)
    while low < high:
        RAISED.clear()
        middle = (low + high) // 2
        scene.assemble(out.q[middle], out.v[middle], float(out.time[middle]), tangents=False)
        low, high = (low, middle) if RAISED else (middle + 1, high)
    part = Output(*(x[: max(1, low)] for x in out))
    t = part.time[-1]
    if isinstance(error, ValueError) and any(link.body.massless for link in scene.mechanism.links):
        return part, (Status.STRUT_OUT_OF_RANGE, f"after t = {t:.6g} s the law of a strut: {error}")
    what = "a function of the mechanism"
    return part, (Status.FUNCTION_FAILED, f"after t = {t:.6g} s {what} raised {type(error).__name__}: {error}")
