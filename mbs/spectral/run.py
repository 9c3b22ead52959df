"""Run of the compiled solver: its scene, the choice of the integrator, the loop over calls of the integrator, the record.

Step ends are the times at which a step must end. Compiled functions raise no exceptions: the record `counts` has the status.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba.core.errors import NumbaError

from ..elements.stop import GRAZE, SLOWEST_ONSET
from ..functions import current_memory, use_memory
from ..geometry import Array
from ..laws.compiled import RAISED
from ..mechanism import Mechanism
from ..process import Progress, catch_ctrl_c, working_time
from ..record.errors import Failure, Status
from ..record.run import Run
from ..solvers import SECOND_LEVEL_STEPS, Spectral, subdivide
from . import explicit, implicit, output
from .output import DormandPrince, Ended, Output, Radau
from .recording import record_of
from .samples import ROWS_OF_A_STEP
from .scene import CompiledScene
from .start import balance, dormand_prince, radau, start_rates
from .tables import ForceKind, Forces, MeasureKind, MeasureNumber, Measures, Memory

NEWTON_SHARE = 1e-4
"""Size of the last Newton increment, over the local error allowed, for tolerances from `NEWTON_TOLERANCE` on.
Errors left by Newton's method add up alike in runs of different tolerance, so that their difference does not show these errors.
A tenfold smaller share costs 10 per cent more iterations."""
NEWTON_TOLERANCE = 1e-5
"""Tolerance below which the share falls as tol^(1/4), a chosen exponent: so Newton's errors stay small in fine runs."""
LONGEST_TURN = 4.0
"""Largest turn of a link in a step [rad], over the tolerance^(1/4): 0.7 rad at 1e-3, 0.13 at 1e-6. The error of a step limits the
turn of a link whose centre of mass moves, to less. It does not see the turn of a wheel about its centre, on which points move."""
STEPS_PER_CALL = 44
"""Steps for whose rows a call of the integrator has room, which looks at neither clock nor Ctrl-C: tenfold, the user would wait
tenfold."""


def scene_or_reason(mechanism: Mechanism, degree: int | None) -> CompiledScene | str:
    """Translate a mechanism to arrays; return the reason if this solver does not support it."""
    try:
        return CompiledScene.of(mechanism, degree)
    except (ValueError, NotImplementedError, NumbaError) as refusal:
        return " ".join(str(refusal).split())


class RunState(NamedTuple):
    """State from which a run starts, with angles less than half a turn from those at t = 0."""

    time: float  # [s]
    q: Array  # coordinates, (n,)
    v: Array  # rates, (n,)
    memory: Array  # of forces, (forces, 4): columns of `Memory`


def memory_at_end(out: Output) -> Array:
    """Return the memories of forces, (forces, 4), from which another run goes on."""
    memory = out.memory[-1].copy()
    # `Output` has STEP_START in place of the fastest onset, for which the last onset stands here
    memory[:, Memory.FASTEST] = np.maximum(memory[:, Memory.ONSET], SLOWEST_ONSET)
    return memory


def once(
    mechanism: Mechanism, duration: float, solver: Spectral, timeout: float | None = None, progress: Progress | None = None,
    ends: Array | None = None, scene: CompiledScene | None = None,
) -> Run:  # fmt: skip
    """Integrate a mechanism from t = 0 and record the result; `scene` is its translation, `ends` as in `integrate`."""
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
    return Run(solver, record, failure or find_contradiction(scene, out), work, scene.summary(), notes)


def find_contradiction(scene: CompiledScene, out: Output) -> Failure | None:
    """Report constraints that are violated at the end: Newton's method leaves the residuals of contradictory ones."""
    t, tables = float(out.time[-1]), scene.tables
    violation = np.abs(scene.assemble(out.q[-1], out.v[-1], t, tangents=False).residual)
    is_angle = tables.measures[:, Measures.KIND] == MeasureKind.ANGLE
    coefficients = np.abs(tables.measure_numbers[:, MeasureNumber.FACTOR])  # of the measures in their constraints
    measure_units = coefficients * np.where(is_angle, 1.0, scene.length)
    units = np.array([measure_units[row.measures].max() for row in scene.builder.rows])
    if not (violation > 1e-6 * units).any():  # constraints are met to 1e-8 at any tolerance
        return None
    worst = int((violation / units).argmax())
    where = f"'{scene.row_names[worst]}' is off by {violation[worst]:.2g} m or rad"
    return Failure(Status.SINGULAR, f"constraints contradict each other at t = {t:.6g} s: {where}")


def integrate(
    scene: CompiledScene, end: float, solver: Spectral, timeout: float | None = None, progress: Progress | None = None,
    state: RunState | None = None, ends: Array | None = None, every: int = 1, take: Callable[[Output], None] | None = None,
) -> tuple[Output, Failure | None, output.Record]:  # fmt: skip
    """Integrate a scene from t = 0, or from another state; return its rows, its failure or None, counts of its work.

    With `ends` [s] there is no error control: steps end only at these times, at kinks and at onsets of contacts. `every` is the
    number of steps for each row; if it is 1 there are also rows within steps. A function `take` gets all rows, part by part, for
    statistics. Then only the last row is returned, and explicit steps do not end at onsets of forces that begin smoothly.
    """
    state = state or RunState(0.0, scene.q0, start_rates(scene), scene.memory())
    scene.reset_turns()
    acceleration, multipliers = balance(scene, state.q, state.v, state.time, state.memory)
    first_row = (state.q, state.v, acceleration, multipliers, state.memory)  # fields of `Output` behind the time
    controls = _set_controls(scene, state.time, end, solver, ends, every, gives_parts=take is not None)
    step_ends = _find_step_ends(scene, state.time, controls, ends)
    model: Radau | DormandPrince
    if is_explicit(scene, solver):
        run, model = explicit.run_explicit, dormand_prince(scene, state.q, state.v, multipliers, state.memory)
    else:
        run, model = implicit.run_implicit, radau(scene, *first_row)
    clock, counts = output.blank(output.CLOCK), output.blank(output.COUNTS)
    clock.time, clock.next_step = state.time, controls.first_step
    deadline = working_time() + timeout if timeout else np.inf
    parts, failure, rows = [], None, 1 + STEPS_PER_CALL * ROWS_OF_A_STEP  # 1: the start
    RAISED.clear()  # exceptions of users' functions, which callbacks from compiled code append
    with catch_ctrl_c() as interrupted:
        while clock.time < end * (1 - 1.1e-12) and failure is None:  # the integrators stop 1e-12 before the end
            out = Output(np.zeros(rows), *(np.zeros((rows, *each.shape)) for each in first_row))
            run(model, clock, controls, step_ends, out, counts)
            failure = _translate_failure(counts, clock.time, solver)
            part = Output(*(x[: counts.samples] for x in out))
            if RAISED:
                part, failure = _cut_at_exception(scene, part)
            parts.append(part)
            if take is not None and len(part.time):
                take(part)
                parts = [Output(*(x[-1:].copy() for x in part))]
            if progress is not None:
                progress(clock.time / end)
            if failure is None and (interrupted() or working_time() > deadline):
                status, why = (Status.INTERRUPTED, "Ctrl-C") if interrupted() else (Status.TIMED_OUT, "out of time")
                failure = Failure(status, f"{why} at t = {clock.time:.6g} s of {end:.6g} s")
    return Output(*(np.concatenate(x) for x in zip(*parts, strict=True))), failure, counts


def _find_step_ends(scene: CompiledScene, start: float, controls: output.Record, ends: Array | None) -> Array:
    """Find the step ends [s]: kinks of functions of time, the end, `ends`; unless steps are fixed, times between close kinks."""
    factor, end = scene.tables.time_factor[0], controls.end  # statics varies the speed of drives: functions get factor * t
    # edges of users' functions are searched once, not in every run: in the memory of a surrounding call or, else, of the scene
    with use_memory(current_memory(scene.edge_memory)):
        kinks = [t / factor for t in scene.source.kinks(end * factor) if start < t / factor < end]
    if not controls.fixed:  # a finer run has more steps also between close kinks
        kinks = subdivide(kinks, controls.longest, default_longest=end / SECOND_LEVEL_STEPS)
    times = np.unique([*kinks, end])
    times = times[np.append(np.diff(times) > 1e-12 * end, True)]  # a step between closer ones would be rounding
    return times if ends is None else np.unique(np.concatenate([times, ends]))


def is_explicit(scene: CompiledScene, solver: Spectral) -> bool:
    """Return True if a run is explicit: as asked for, or as only contacts with clearance are stiff, and those not by damping."""
    if solver.method != "chosen":
        return solver.method == "explicit"
    kinds = scene.tables.forces[:, Forces.KIND]
    stiff = np.isin(kinds, (ForceKind.STRUT, ForceKind.FRICTION, ForceKind.GUIDE_FRICTION, ForceKind.STATEFUL)).any()
    # with stiff damping the implicit method is 2 to 8 times faster at a 30 times smaller energy error (docs/theory-spectral.md)
    has_clearance = bool((kinds == ForceKind.JOURNAL).any())
    return has_clearance and not len(scene.tables.strips) and not stiff and not scene.source.is_stiffly_damped


def _set_controls(
    scene: CompiledScene, start: float, end: float, solver: Spectral, ends: Array | None, every: int, gives_parts: bool
) -> output.Record:
    """Set the options of the integrator, `output.CONTROLS`; `ends`, `every` as in `integrate`, `gives_parts` with its `take`."""
    out, duration, runs_explicitly = output.blank(output.CONTROLS), end - start, is_explicit(scene, solver)
    out.end, out.tolerance, out.contact_tolerance = end, solver.tolerance, solver.contact_tolerance
    out.max_steps, out.fixed = solver.steps.max_steps, ends is not None or not solver.steps.adaptive
    out.longest = longest = solver.longest(duration) if ends is None else end  # with `ends` only these and onsets limit steps
    out.longest_turn = np.inf if out.fixed else LONGEST_TURN * solver.tolerance ** (1 / 4)
    # so short that a finer run is finer from its start on, where stiff parts vibrate
    out.first_step = longest if out.fixed else 1e-3 * min(longest, duration / SECOND_LEVEL_STEPS)
    out.shortest = end * (1e-15 if runs_explicitly else 1e-12)  # rounding of a time, or some thousand roundings
    out.every, out.writes_within_steps = every, every == 1 and not out.fixed
    out.stops_at_all_onsets = not (runs_explicitly and gives_parts)
    out.least_onset = SLOWEST_ONSET  # [m/s]
    # GRAZE: share of the fastest onset; finer runs allow slower onsets, so that the difference of two runs shows its effect
    out.least_onset_ratio = GRAZE * min(1.0, solver.contact_tolerance / Spectral().contact_tolerance)
    share = NEWTON_SHARE * min(1.0, solver.tolerance / NEWTON_TOLERANCE) ** (1 / 4)
    # steps of equal length have no error control: Newton's method may leave 1e-12 of a coordinate's unit
    out.newton_share = 1e-12 / solver.tolerance if out.fixed else share
    size = scene.units.max()  # of coordinates: the longest link [m], or 1 of an angle
    out.rounding = 1e-15 * size  # of a distance
    if runs_explicitly:
        # with an error of 0.01 of the clearance contacts chatter: a tenth more onsets are found
        shares = (4e-3 * joint.gap / scene.length for joint in scene.source.clearances)
        out.tolerance = min([out.tolerance, *shares])
        # a tenth of that of implicit steps, as there is no error of Newton's method; 1e-12: rounding errors of a step
        out.face_tolerance, out.stop_gap = max(1e-3 * out.tolerance, 1e-12) * size, 0.0
    else:
        out.face_tolerance = 1e-2 * out.tolerance * size
        # a last node inside the face would have the contact's force; 0.1: ten times the error that Newton's method leaves
        out.stop_gap = max(0.1 * out.face_tolerance, out.rounding)
    out.closing_gap = 2.0 * out.stop_gap  # a step that aims at `stop_gap` ends within this gap, see `contacts`
    return out


def _translate_failure(counts: output.Record, t: float, solver: Spectral) -> Failure | None:
    """Translate the status of a run's counts to one of a result, with a message; None without a failure."""
    not_finite = f"coordinates are not finite after t = {t:.6g} s: a law or a motion returned nan, or a force grew"
    many = f"more than max_steps = {solver.steps.max_steps} steps by t = {t:.6g} s"
    return {
        Ended.UNDERFLOW: Failure(Status.NEWTON_DIVERGED, f"no convergence after t = {t:.6g} s, however short the step"),
        Ended.NOT_FINITE: Failure(Status.NOT_FINITE, not_finite),
        Ended.TOO_MANY: Failure(Status.TOO_MANY_STEPS, many),
    }.get(Ended(counts.status))


def _cut_at_exception(scene: CompiledScene, out: Output) -> tuple[Output, Failure]:
    """Return the rows before a user's function raised an exception, found by bisection, with status and message."""
    error, low, high = RAISED[0], 0, len(out.time)
    while low < high:
        RAISED.clear()
        middle = (low + high) // 2
        scene.assemble(out.q[middle], out.v[middle], float(out.time[middle]), tangents=False)
        low, high = (low, middle) if RAISED else (middle + 1, high)
    part = Output(*(x[: max(1, low)] for x in out))
    t = part.time[-1]
    if isinstance(error, ValueError) and any(link.body.massless for link in scene.mechanism.links):  # by the law of a strut
        return part, Failure(Status.STRUT_OUT_OF_RANGE, f"after t = {t:.6g} s the law of a strut: {error}")
    message = f"after t = {t:.6g} s a function of the mechanism raised {type(error).__name__}: {error}"
    return part, Failure(Status.FUNCTION_FAILED, message)
