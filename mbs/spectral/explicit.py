"""Explicit integrator, compiled: Dormand and Prince's pair 5(4) for mechanisms with clearance, whose steps end at onsets.

Constraints are solved for accelerations; after a step in which they drift, positions and velocities are projected onto them.
The saddle-point matrix [M G^T; G 0] is factored again only where it changes. If no constraint acts on modal links, M at zero
deformation is factored, and `couple_modes` corrects the accelerations. Source: docs/theory-spectral.md.

The state y of a step is (q, v, bristles): n coordinates, their n rates, a deflection for each force. Single numbers that
compiled functions change are arrays of one element, such as `state.largest_rate[0]`. For `clock`, `controls`, `counts`, and the
rows `out`, see `output`; `order` is the order in which `fronts` eliminates the unknowns of the matrix.
"""

import math

import numpy as np

from .compiling import copy, inline, jit, kernel_function
from .contacts import find_first_event, has_smooth_onset, is_contact, update_onset
from .fronts import factor, solve
from .kernel import compute_changes, compute_forces, compute_rows, couple_modes, fill_saddle, multiply_row, write_rows
from .lawtable import JUST_AFTER, bristle_rate
from .output import LARGEST_RATIO, SMALLEST_RATIO, STEP_END_REACH, Ended
from .tables import STEP_START, ForceKind, Forces, Instant, Memory, Report

NODES = np.array([0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0])
"""Nodes of the seven stages (Dormand and Prince 1980, doi 10.1016/0771-050X(80)90013-3)."""
WEIGHTS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
        [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
        [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
        [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
        [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
        [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
    ]
)
"""Coefficients of the stages; the last row is the solution of fifth order."""
SAFETY = 0.9
"""Safety factor of the length of a step; 0.8 to 0.9 are usual (Hairer, Nørsett and Wanner 1993, II.4)."""
EXPONENT = 1 / 5
"""One over the order of the local error."""
ERROR_WEIGHTS = np.array([71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0])
"""Coefficients of the error estimate: those of the fifth order less those of the fourth."""


@inline
def _has_changed(tables, state):
    """Return True if the matrix differs from the one factored last, by modal links or by G; keep G to compare next time."""
    has_free_modes = state.free_modes[0] > 0  # no constraint acts on modal links: M at zero deformation is factored
    is_mass_constant = tables.modal.shape[0] == 0 or has_free_modes  # other bodies have a constant mass matrix
    changed = not is_mass_constant or state.has_factors[0] == 0
    for i in range(state.jacobian.size):
        changed = changed or state.jacobian[i] != state.factored_jacobian[i]
        state.factored_jacobian[i] = state.jacobian[i]
    return changed


@kernel_function
def compute_rates(model, t, y, out):
    """Fill `out` with the rates of a state y: velocities, accelerations, rates of bristles; renew multipliers and reports."""
    tables, order, work, state = model.tables, model.order, model.work, model.state
    n, has_free_modes = state.force.size, state.free_modes[0] > 0
    q, v = y[:n], y[n : 2 * n]
    for k in range(tables.forces.shape[0]):
        state.memory[k, Memory.BRISTLE] = y[2 * n + k]
    now = Instant(t, -1.0, q, v, state.lam, state.memory)  # -1, as `since`: bristles are states of this integrator
    compute_forces(tables, work, now, state.right_side[:n])
    compute_rows(tables, work, t, state.violation, state.jacobian, state.speed)  # g, G, and the right side of G v = speed
    compute_changes(tables, work, t, JUST_AFTER, state.change)  # right side of G a = change; at a kink, that just after it
    copy(state.change, state.right_side[n:])
    if _has_changed(tables, state):
        if has_free_modes:
            write_rows(tables, state.jacobian, state.matrix)
        else:
            fill_saddle(tables, work, q, state.jacobian, state.matrix)
        factor(order, state.matrix, state.factors, state.swaps, state.row_magnitude)
        state.has_factors[0] = 1
    solve(order, state.factors, state.swaps, state.right_side, state.front_work)
    if has_free_modes:
        couple_modes(tables, work, q, state.right_side)
    copy(v, out[:n])
    copy(state.right_side[:n], out[n : 2 * n])
    copy(state.right_side[n:], state.lam)
    for k in range(tables.forces.shape[0]):
        kind, law = tables.forces[k, Forces.KIND], tables.forces[k, Forces.FRICTION]
        out[2 * n + k] = 0.0
        is_closed_pin = kind == ForceKind.JOURNAL and work.reports[k, Report.LENGTH] > 0.0  # a pin's depth
        if law >= 0 and (kind == ForceKind.FRICTION or is_closed_pin):  # a guide is always closed; a stop's law has no bristle
            out[2 * n + k] = bristle_rate(tables, law, y[2 * n + k], work.reports[k, Report.SLIP])


@jit
def fill_accelerations(model, out):
    """Fill in accelerations and multipliers at the states of `out`; the model's stage arrays are work space."""
    state = model.state
    n = state.force.size
    for i in range(out.time.size):
        copy(out.q[i], state.y_stage[:n])
        copy(out.v[i], state.y_stage[n : 2 * n])
        for k in range(model.tables.forces.shape[0]):
            state.memory[k, Memory.ONSET] = out.memory[i, k, Memory.ONSET]
            state.y_stage[2 * n + k] = out.memory[i, k, Memory.BRISTLE]
        compute_rates(model, out.time[i], state.y_stage, state.stage_rates[1])
        copy(state.stage_rates[1, n : 2 * n], out.a[i])
        copy(state.lam, out.lam[i])


@inline
def _violates_constraints(tables, state, allowed):
    """Return True if a constraint, or its rate over the largest rate so far, is off by over `allowed` times the least unit."""
    n, worst = state.force.size, 0.0
    for k in range(state.lam.size):
        rate_defect = multiply_row(tables, k, state.jacobian, state.y_new[n : 2 * n]) - state.speed[k]
        worst = max(worst, abs(state.violation[k]), abs(rate_defect) / state.largest_rate[0])
    return worst > allowed * state.units.min()


@inline
def _project(tables, order, state):
    """Project the new state onto the constraints in the mass metric: positions by one Newton step, then velocities."""
    n = state.force.size
    q, v, defect = state.y_new[:n], state.y_new[n : 2 * n], state.violation  # the last stage, at y_new, left defect, G, factors
    _subtract_correction(order, state, defect, q)
    for k in range(state.lam.size):  # now the defects of the velocities, in the same array
        defect[k] = multiply_row(tables, k, state.jacobian, v) - state.speed[k]
    _subtract_correction(order, state, defect, v)


@kernel_function
def _subtract_correction(order, state, defect, y):
    """Subtract from y (n,) the vector x of least kinetic energy with G x = defect (r,), for r constraints."""
    state.right_side[:] = 0.0
    copy(defect, state.right_side[y.size :])
    solve(order, state.factors, state.swaps, state.right_side, state.front_work)
    for i in range(y.size):
        y[i] -= state.right_side[i]


@inline
def _compute_stages(model, t, h, end):
    """Compute the seven stages; state.y_new becomes the solution of fifth order, reports are those of its end."""
    state = model.state
    for stage in range(1, 7):  # functions of time are taken up to the time `end`, which is just before a kink
        target, f, c = state.y_new if stage == 6 else state.y_stage, state.stage_rates, WEIGHTS[stage]
        for i in range(state.y.size):  # c is 0 for later stages, whose rates must be finite: 0 times nan is nan
            target[i] = state.y[i] + h * (
                c[0] * f[0, i] + c[1] * f[1, i] + c[2] * f[2, i] + c[3] * f[3, i] + c[4] * f[4, i] + c[5] * f[5, i]
            )
        compute_rates(model, min(t + NODES[stage] * h, end), target, state.stage_rates[stage])


@inline
def _estimate_error(state, h, tolerance):
    """Return the embedded error over the tolerance: coordinates in their units, rates in units times the largest rate so far."""
    n, worst = state.force.size, 0.0
    for i in range(2 * n):  # the deflections of bristles do not count
        e = 0.0
        for j in range(7):
            e += ERROR_WEIGHTS[j] * state.stage_rates[j, i]
        ratio = abs(h * e) / (state.units[i] if i < n else state.units[i - n] * state.largest_rate[0])
        if not ratio < math.inf:
            return math.inf  # nan fails all comparisons
        worst = max(worst, ratio)
    return worst / tolerance


@kernel_function
def _try_step(model, clock, h, end, controls, counts):
    """Try a step of length h to the time `end`; return True if accepted, else shorten the next."""
    state = model.state
    _compute_stages(model, clock.time, h, end)
    counts.iterations += 6  # the first of seven stages is the last of the step before
    clock.error = error = _estimate_error(state, h, controls.tolerance)
    is_finite = error < math.inf
    is_accurate = error <= 1.0 or (controls.fixed and is_finite)
    if not is_accurate:
        clock.next_step = h * (max(SMALLEST_RATIO, SAFETY * error**-EXPONENT) if is_finite else SMALLEST_RATIO)
        if not is_finite:
            state.stage_rates[1:] = 0.0
        if clock.next_step < controls.shortest:
            counts.status = Ended.UNDERFLOW if is_finite else Ended.NOT_FINITE
        return False
    fraction = find_first_event(model.tables, state.start_reports, model.work.reports, h, controls)
    if fraction < 1.0 and h * fraction > controls.shortest:
        clock.resumed_step = max(clock.resumed_step, h)  # length with which `run_explicit` goes on after the onset
        clock.next_step = h * fraction
        return False
    return True


@kernel_function
def _accept(model, clock, end, step_end, controls, out, counts):
    """Accept a step to the time `end`: project it onto the constraints if needed, and write its row."""
    tables, order, work, state = model.tables, model.order, model.work, model.state
    n, clock.time = state.force.size, end
    is_event = _update_memories(tables, work, state, controls, counts)
    is_projected = _violates_constraints(tables, state, 1e-4 * controls.tolerance)  # chosen
    if is_projected:
        _project(tables, order, state)
    if is_projected or is_event or end == step_end:  # at a kink the last stage has the rates before it
        copy(state.y_new, state.y)
        compute_rates(model, end, state.y, state.stage_rates[0])
    else:
        for i in range(state.y.size):
            state.y[i], state.stage_rates[0, i] = state.y_new[i], state.stage_rates[6, i]
    for i in range(n):
        state.largest_rate[0] = max(state.largest_rate[0], abs(state.y[n + i]) / state.units[i])
    copy(work.reports, state.start_reports)
    counts.steps, clock.skipped = counts.steps + 1, clock.skipped + 1
    if clock.skipped >= controls.every or is_event or end >= controls.end - controls.shortest:
        _write(state, out, counts, end)
        clock.skipped = 0


@jit
def run_explicit(model, clock, controls, step_ends, out, counts):
    """Integrate from the model's state to the end, or until `out` is full; the next call goes on. Steps end at `step_ends`."""
    state = model.state
    counts.samples = 0
    if counts.steps == 0:
        compute_rates(model, clock.time, state.y, state.stage_rates[0])
        copy(model.work.reports, state.start_reports)
        _write(state, out, counts, clock.time)
    while clock.time < controls.end - controls.shortest and counts.status == Ended.OK and counts.samples < out.time.size:
        while clock.end_index < step_ends.size and step_ends[clock.end_index] <= clock.time + controls.shortest:
            clock.end_index += 1
        step_end = min(controls.end, step_ends[clock.end_index]) if clock.end_index < step_ends.size else controls.end
        h = min(clock.next_step, controls.longest)
        reach = 1.0 if clock.resumed_step > 0.0 else STEP_END_REACH  # a step to an onset must not be lengthened past it
        if clock.time + reach * h >= step_end:
            h = step_end - clock.time
        ends_at_step_end = h >= step_end - clock.time
        end = step_end if ends_at_step_end else clock.time + h
        if counts.steps + counts.rejected > controls.max_steps:
            counts.status = Ended.TOO_MANY  # this step is still tried, then the loop ends
        # two roundings before a kink a function of time still has its form before it
        if not _try_step(model, clock, h, end * (1.0 - 4e-16) if ends_at_step_end else end, controls, counts):
            counts.rejected += 1
            continue
        _accept(model, clock, end, step_end, controls, out, counts)
        if controls.fixed:
            clock.next_step = controls.first_step
        else:
            # 1e-6, chosen: the error may be 0; below 1e-4 the ratio is the largest anyway
            ratio = min(LARGEST_RATIO, max(SMALLEST_RATIO, SAFETY * max(clock.error, 1e-6) ** -EXPONENT))
            clock.next_step = max(h * ratio, clock.resumed_step)
        clock.resumed_step = 0.0


@inline
def _update_memories(tables, work, state, controls, counts):
    """Update onset speeds; return True if a contact closed or opened so that rates must be computed anew."""
    is_event, n = False, state.force.size
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            has_closed, has_opened = update_onset(tables, state.start_reports, work.reports, k, state.memory[k], controls)
            is_counted = controls.stops_at_all_onsets or not has_smooth_onset(tables, k)
            is_event = is_event or (is_counted and (has_closed or has_opened))
            if has_closed:
                counts.onsets += 1
            if has_opened:
                state.y_new[2 * n + k] = 0.0  # its bristle
    return is_event


@inline
def _write(state, out, counts, t):
    """Write the state at time t as a row. Readers move its bristles on from STEP_START, here t, so SLIDING has no effect."""
    n, i = state.force.size, counts.samples
    counts.samples += 1
    out.time[i] = t
    for j in range(n):
        out.q[i, j], out.v[i, j], out.a[i, j] = state.y[j], state.y[n + j], state.stage_rates[0, n + j]
    copy(state.lam, out.lam[i])
    for k in range(state.memory.shape[0]):
        m = out.memory[i, k]
        m[Memory.ONSET], m[Memory.BRISTLE] = state.memory[k, Memory.ONSET], state.y[2 * n + k]
        m[Memory.SLIDING], m[STEP_START] = 0.0, t
