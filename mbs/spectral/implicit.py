"""Implicit integrator, compiled: collocation at the Radau points with variable steps that end at onsets and kinks; see `radau`.

Step ends are the times at which a step must end: kinks of functions of time, and the run's end. Step control: K. Gustafsson's
predictive rule (Hairer and Wanner 1996, IV.8). The end of a step is its third node, `[2]` of arrays. The records `clock`,
`controls`, `counts` and the rows `out` are described in `output`.
"""

import numpy as np

from . import contacts, samples
from .compiling import copy, jit, kernel_function
from .events import compute_start, restart_past_event, update_memories
from .forces import add_forces
from .markers import place_markers
from .newton import SLOW, solve_nodes
from .output import LARGEST_RATIO, SMALLEST_RATIO, STEP_END_REACH, Ended
from .radau import REAL_EIGENVALUE, estimate_error, integrate, measure_deformation, predict, project, update_units
from .strips import MIXED, PLAIN, compute_stresses
from .tables import Elastic, Instant, Report

EXPONENT = 1 / 4
"""One over the order of the local error, in the rule for the length of a step."""
LEAST_STEP = 2.0
"""Least length to which an error shortens a step, over the shortest step. A step of up to twice this length, a chosen factor, is
accepted with its error."""
SAFETY = 0.85
"""Safety factor of the length of a step; 0.8 to 0.9 are usual (Hairer, Nørsett and Wanner 1993, II.4)."""


@kernel_function
def _begin(model, t, tolerance):
    """Initialise the state before the first step."""
    tables, work, state = model.tables, model.work, model.state
    compute_stresses(tables, work, state.q, state.v, state.stress)
    compute_start(model, t)
    for i in range(state.q.size):
        state.inverse_error_unit[i] = 1.0 / state.unit[i]
    for k in range(tables.elastic.shape[0]):
        i, j = tables.elastic[k, Elastic.FIRST], tables.elastic[k, Elastic.SECOND]
        state.start_deformation[k] = measure_deformation(state, tables.elastic, k)
        if j >= 0:  # the vector of a strip's piece: `measure_change` compares its components along and across the chord
            state.inverse_error_unit[i] = state.inverse_error_unit[j] = 0.0
    update_units(state, tables.elastic, tolerance)


@kernel_function
def _complete_step(model, t, h, controls):
    """Project the step's end onto the constraints and compute its forces; return the largest local error over the tolerance."""
    tables, orders, work, state = model.tables, model.orders, model.work, model.state
    error = 0.0 if controls.fixed else estimate_error(tables, orders, state, h) / controls.tolerance
    project(tables, orders, work, state, t, h)
    if tables.forces.shape[0] == 0:
        return error
    now = Instant(t, h, state.node_q[2], state.node_v[2], state.node_lam[2], state.memory)
    add_forces(tables, work, now, state.force)  # for the reports; state.force is work space here
    # of a closed contact also depth and force have errors
    if not controls.fixed and _has_closed_contact(tables, state.start_reports, work.reports):
        error = max(error, _estimate_contact_error(model, now, h, controls))
    return error


@kernel_function
def _has_closed_contact(tables, start, end):
    """Return True if a contact is closed at the start or end of the step."""
    for k in range(tables.forces.shape[0]):
        if contacts.is_contact(tables, k):
            if contacts.get_depth(tables, start, k)[0] > 0.0 or contacts.get_depth(tables, end, k)[0] > 0.0:
                return True
    return False


@kernel_function
def _estimate_contact_error(model, now, h, controls):
    """Return the largest error of depth and force of a contact over the one allowed; the instant `now` is the step's end."""
    tables, work, state, error, allowed = model.tables, model.work, model.state, 0.0, controls.contact_tolerance
    copy(work.reports, state.end_reports)
    # reports at the end shifted by its error, of which `estimate_error` left e_q and d_q; the rates' is e_v = e_q/k1 - d_q
    e_q, d_q = state.real_solution, state.dq[0]
    shifted_q, shifted_v = state.dq[1], state.dv[1]  # work space, as is state.force
    for i in range(shifted_q.size):
        shifted_v[i] = now.v[i] + REAL_EIGENVALUE / h * e_q[i] - d_q[i]
        shifted_q[i] = now.q[i] + e_q[i]
    place_markers(tables, work, shifted_q, shifted_v)
    add_forces(tables, work, now, state.force)  # contacts read the markers, not q and v
    shifted = work.reports
    for k in range(tables.forces.shape[0]):
        if contacts.is_contact(tables, k):
            depth_error = contacts.estimate_depth_error(tables, state, shifted, h, k, controls)
            before, end = state.start_reports[k, Report.VALUE], state.end_reports[k, Report.VALUE]
            # 1e-2, chosen: with 1, errors of the small forces before a release would not count; 1e-300: not zero
            scale = max(abs(before), abs(end), 1e-2 * state.largest_force[k], 1e-300)
            error = max(error, depth_error / allowed)
            if depth_error > 0.0:  # closed at the start or end, with an error above rounding
                force_error = abs(shifted[k, Report.VALUE] - end)
                # an elastic force d^n has n times the error of the depth d: it counts if n is above 2, or with damping
                error = max(error, force_error / (scale * 2.0 * allowed))
    copy(state.end_reports, work.reports)
    return error


@kernel_function
def _advance(state):
    """Make the end of the step, its third node, the present state; keep what the next step's first guess (`predict`) needs."""
    copy(state.v, state.past_v[0])
    copy(state.node_v, state.past_v[1:])
    copy(state.node_lam[1], state.past_lam)
    copy(state.node_stress[1], state.past_stress)
    copy(state.node_q[2], state.q)
    copy(state.node_v[2], state.v)
    copy(state.node_a[2], state.a)
    copy(state.node_lam[2], state.lam)
    copy(state.node_stress[2], state.stress)
    copy(state.jacobian, state.start_jacobian)


@kernel_function
def _find_step_end(model, clock, controls, step_ends, out, counts):
    """Return the next time at which a step must end; at a kink just reached, restart, as accelerations jump there."""
    while clock.end_index < step_ends.size:
        step_end = step_ends[clock.end_index]
        if step_end > clock.time + controls.shortest:
            return min(controls.end, step_end)
        if step_end > clock.time - controls.shortest and not controls.fixed:
            restart_past_event(model, clock, controls, out, counts)
        clock.end_index += 1
    return controls.end


@kernel_function
def _choose_length(state, clock, controls, step_end):
    """Return the length of the next step: `clock.next_step`, up to `step_end`, or half-way to it if the rest would be short.

    A link turns at most by `controls.longest_turn`. This limit is rounded down to a power of 2^(1/4): steps of nearly the same
    limit have one length, and one matrix.
    """
    h, left, fastest = min(clock.next_step, controls.longest), step_end - clock.time, 0.0
    for i in range(state.v.size):
        fastest = max(fastest, state.turns[i] * abs(state.v[i]))
    if h * fastest > controls.longest_turn:
        h = 2.0 ** (0.25 * np.floor(4.0 * np.log2(controls.longest_turn / fastest)))
    if clock.time + clock.reach * h >= step_end:
        return left
    is_to_event = clock.reach != STEP_END_REACH  # then no halving: steps would come to the event ever more slowly
    is_halved = clock.time + 2.0 * h > step_end and not controls.fixed and not is_to_event
    return 0.5 * left if is_halved else h


@kernel_function
def _try_step(model, clock, h, end, controls, counts):
    """Try a step of length h to the time `end`; return True if it is accepted, else shorten the next."""
    tables, work, state, shortest = model.tables, model.work, model.state, controls.shortest
    renews = clock.needs_matrix or abs(h - clock.matrix_step) > 1e-9 * h  # equal but for rounding
    predict(state, h, clock.previous)
    integrate(state, h)
    convergence = solve_nodes(model, clock.time, h, controls.newton_share * controls.tolerance, renews, counts)
    clock.matrix_step, clock.needs_matrix = h, convergence > SLOW  # ratio of the last two increments, above 1 for a failure
    if convergence > 1.0:
        clock.next_step, clock.max_growth = 0.5 * h, 1.0  # 1.0: no growth after the shorter step
        clock.previous = 0.0  # `predict` then starts from the acceleration, not from the last step's polynomial
        if clock.next_step < shortest:
            counts.status = Ended.UNDERFLOW if np.isfinite(state.residual.sum()) else Ended.NOT_FINITE
        return False
    clock.error = _complete_step(model, end, h, controls)
    fraction = contacts.find_first_event(tables, state.start_reports, work.reports, h, controls)
    # equal steps end at onsets, too; a `fraction` above 1 (NEVER) moves no end, and a tiny move is not worth a step
    is_moved = h * fraction > shortest and h * (1.0 - fraction) > 1e-2 * shortest
    if is_moved and clock.error <= 1.0:  # with too large an error the step is first shortened by the error
        clock.next_step, clock.reach = h * fraction, 1.0
        return False
    if controls.fixed:
        return True
    # up to 10 shortest steps, the time of the release is known well enough
    if h > 10.0 * shortest and contacts.has_released(tables, state, work.reports, controls):
        clock.error = max(clock.error, 20.0)  # so that the step is repeated at 0.4 of its length
    if clock.error > 1.0 and h > 2.0 * LEAST_STEP * shortest:
        ratio = max(SMALLEST_RATIO, SAFETY * clock.error**-EXPONENT)
        clock.next_step, clock.max_growth = max(h * ratio, LEAST_STEP * shortest), 1.0
        return False
    return True


@kernel_function
def _write_within(model, t, h, controls, out, counts):
    """Write rows within a step of length h from time t: at equal distances, and just past the face of a contact that closes."""
    tables, state, start, end = model.tables, model.state, model.state.start_reports, model.work.reports
    # time from the step's start to the row past a face or, if negative, to it from the step's end; 0: no such row
    face_time = contacts.find_time_past_face(tables, start, end, samples.JUMP * controls.shortest)
    parts = samples.count_parts(state, tables.elastic, h, controls, contacts.compute_depth_deviation(tables, start, end, h))
    is_outermost = abs(face_time) < 0.5 * h / parts  # nearer to this end of the step than the other rows
    if is_outermost and face_time > 0.0:
        samples.write_at_face(state, out, counts, t, h, face_time)
    samples.write_between(state, out, counts, t, h, parts)
    if is_outermost and face_time < 0.0:
        samples.write_at_face(state, out, counts, t, h, face_time)


@kernel_function
def _accept(model, clock, h, target, controls, out, counts):
    """Accept a step of length h to the time `target`, write its rows and restart past an event."""
    tables, work, state = model.tables, model.work, model.state
    start_time = clock.time
    is_event = update_memories(tables, work, state, controls, counts)
    if controls.writes_within_steps:
        _write_within(model, start_time, h, controls, out, counts)
    _advance(state)
    update_units(state, tables.elastic, controls.tolerance)
    copy(work.reports, state.start_reports)
    counts.steps += 1
    clock.time, clock.previous, clock.reach, clock.skipped = target, h, STEP_END_REACH, clock.skipped + 1
    if clock.skipped >= controls.every or is_event or target >= controls.end - controls.shortest:
        samples.write(state, out, counts, target, start_time)
        clock.skipped = 0
    if is_event:
        restart_past_event(model, clock, controls, out, counts)


@kernel_function
def _set_next_step(clock, h, shortest):
    """Set the length of the next step after one of length h, by Gustafsson's predictive rule."""
    # after errors e and, in the last step of length h_0, e_0: h SAFETY e^(-1/4) min(1, h/h_0 (e_0/e)^(1/4))
    error = max(clock.error, 1e-8)  # not zero
    factor = min(clock.max_growth, SAFETY * error**-EXPONENT)
    if clock.last_error > 0.0:
        factor = min(factor, SAFETY * h / clock.last_step * (clock.last_error / (error * error)) ** EXPONENT)
    clock.max_growth, clock.last_error, clock.last_step = LARGEST_RATIO, max(error, 1e-2), h  # 1e-2: as in RADAU5
    if factor < 0.9 or factor > 1.4:  # else the old length is kept, which needs no new matrices
        was_cut_short = h < 0.5 * clock.next_step  # to less than half (chosen), by a step end: the plan is kept
        clock.next_step = max(clock.next_step if was_cut_short else 0.0, h * factor, LEAST_STEP * shortest)


@jit
def run_implicit(model, clock, controls, step_ends, out, counts):
    """Integrate from the model's state to the end, or until `out` is full; the next call goes on. Steps end at `step_ends`."""
    state, strip_form = model.state, model.work.strip_form
    counts.samples = 0
    strip_form[0] = MIXED  # stresses of strips are unknowns
    if counts.steps == 0:
        clock.needs_matrix, clock.max_growth, clock.reach = True, LARGEST_RATIO, STEP_END_REACH
        _begin(model, clock.time, controls.tolerance)
        samples.write(state, out, counts, clock.time, clock.time)
    rows = out.time.size - samples.ROWS_OF_A_STEP
    while clock.time < controls.end - controls.shortest and counts.status == Ended.OK and counts.samples <= rows:
        step_end = _find_step_end(model, clock, controls, step_ends, out, counts)
        h = _choose_length(state, clock, controls, step_end)
        if counts.steps + counts.rejected > controls.max_steps:
            counts.status = Ended.TOO_MANY  # this step is still tried, then the loop ends
        is_last = h >= step_end - clock.time  # of the steps before this step end
        # the step is computed up to two roundings before a kink, where a function of time still has its form before it
        end = step_end * (1.0 - 4e-16) if is_last else clock.time + h
        if not _try_step(model, clock, h, end, controls, counts):
            counts.rejected += 1
            continue
        _accept(model, clock, h, step_end if is_last else clock.time + h, controls, out, counts)
        if controls.fixed:
            clock.next_step = controls.first_step
        else:
            _set_next_step(clock, h, controls.shortest)
    strip_form[0] = PLAIN
