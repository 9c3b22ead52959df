"""Collocation at Radau points with variable steps, compiled: steps end at onsets and kinks. See `radau`."""

from __future__ import annotations

import numpy as np

from .compiling import copy, draft, jit
from .contacts import (
    bend_of_depths,
    closing,
    depth_of,
    error_of_depth,
    first_edge,
    first_onset,
    lets_go,
    touches,
)
from .events import jump, landing, outside, remember
from .forces import add_forces
from .kernel import forces, rows_at
from .markers import place_markers
from .newton import SLOW, newton
from .output import Ended
from .radau import REAL, deformation, error_of, follow_units, integrate, predict, put_back, renew_heavy
from .samples import (
    JUMP,
    MOST_SAMPLES,
    dense,
    samples_in,
    write,
    write_at_face,
    write_between,
)
from .strips import MIXED, PLAIN, elastic_stresses
from .tables import Instant, Report

ORDER = 0.25
"""One over the order of the local error."""
FORCE_TOLERANCE = 2.0
"""Error allowed of a contact's force, over the one allowed of its depth."""
LEAST_FORCE = 1e-2
"""Least force with which that error is compared, over the contact's largest: the end of a long push matters, too."""
NOISE = 1e-15
"""Error of a depth, of the longest link, that is rounding: no shorter step makes it less."""
SHORTEST = 1e-12
"""Step, of the end."""
REACH = 1.0001
"""A stop that is nearer than so many step lengths ends the step; not one to an onset, which would be stepped over again."""
SAFETY = 0.85
"""Share of the step length that would just do."""
SHORTER = 0.9
"""Ratio of lengths above which the old one stays, as it needs no new matrix."""
LONGER = 1.4
"""Ratio of lengths below which the old one stays, as it needs no new matrix."""
MOST_GROWTH = 5.0
"""Largest ratio of the lengths of two steps."""
RELEASE_ERROR = 20.0
"""Error of a step in which a contact lets go, over the one allowed."""
LEAST_MOVE = 1e-2
"""Move of the end of a step to an onset that is none, over the shortest step."""


@draft
def _begin(model, t, tolerance):
    """Initialise the state for the first step."""
    tables, orders, work, state = model.tables, model.orders, model.work, model.state
    elastic_stresses(tables, work, state.q, state.v, state.stress)
    work.strip_form[0], work.b0[:] = MIXED, 0.0
    copy(state.stress, work.stress)
    forces(tables, work, Instant(t, 0.0, state.q, state.v, state.lam, state.memory), state.force)
    rows_at(tables, work, t, state.gap, state.start_jacobian, state.speed)
    renew_heavy(tables, orders, work, state, state.q, state.start_jacobian)
    copy(work.reports, state.start_reports)
    for i in range(state.q.size):
        state.inverse_unit[i] = 1.0 / state.full_unit[i]
    for k in range(tables.elastic.shape[0]):
        i, j = tables.elastic[k, 0], tables.elastic[k, 1]
        state.start_deformation[k] = deformation(state, tables.elastic, k)
        if j >= 0:
            state.inverse_unit[i] = state.inverse_unit[j] = 0.0
    follow_units(state, tables.elastic, tolerance)


@draft
def _error(model, t, h, controls, least):
    """Project the step's end onto the constraints; return the largest local error over the tolerance.

    It is that of the coordinates, or of depths and forces of closed contacts; 0 of equal steps. Reports are those of the end.
    """
    tables, orders, work, state = model.tables, model.orders, model.work, model.state
    error = 0.0 if controls.fixed else error_of(tables, orders, state, h) / controls.tolerance
    allowed = controls.contact_tolerance
    put_back(tables, orders, work, state, t, h)
    if tables.forces.shape[0] == 0:
        return error
    n, q, v = state.q.size, state.node_q[2], state.node_v[2]
    now = Instant(t, h, q, v, state.node_lam[2], state.memory)
    add_forces(tables, work, now, state.force)
    if controls.fixed:
        return error
    closed = False
    for k in range(tables.forces.shape[0]):
        if touches(tables, k) and (depth_of(tables, work.reports, k) > 0.0 or depth_of(tables, state.start_reports, k) > 0.0):
            closed = True
    if closed:
        copy(work.reports, state.end_reports)
        for i in range(n):  # error of the rates, by the first row of the error's equation
            state.dv[0, i], state.dq[0, i] = v[i] + REAL / h * state.step[i] - state.dq[0, i], q[i] + state.step[i]
        place_markers(tables, work, state.dq[0], state.dv[0])
        add_forces(tables, work, now, state.force)
        for k in range(tables.forces.shape[0]):
            if touches(tables, k):
                deep = error_of_depth(tables, state, work.reports, h, k, least, NOISE * state.full_unit.max())
                before, shifted = state.start_reports[k, Report.VALUE], state.end_reports[k, Report.VALUE]
                push = max(abs(before), abs(shifted), LEAST_FORCE * state.largest_force[k], 1e-300)
                error = max(error, deep / allowed)
                if deep > 0.0:
                    error = max(error, abs(work.reports[k, Report.VALUE] - shifted) / (push * FORCE_TOLERANCE * allowed))
        copy(state.end_reports, work.reports)
    return error


@draft
def _take_over(state):
    """Make the step's end the present state."""
    for i in range(state.q.size):
        state.past_v[0, i] = state.v[i]
        state.past_v[1, i], state.past_v[2, i], state.past_v[3, i] = state.node_v[0, i], state.node_v[1, i], state.node_v[2, i]
        state.q[i], state.v[i], state.a[i] = state.node_q[2, i], state.node_v[2, i], state.node_a[2, i]
    copy(state.node_lam[1], state.past_lam), copy(state.node_stress[1], state.past_stress)
    copy(state.node_lam[2], state.lam), copy(state.node_stress[2], state.stress), copy(state.jacobian, state.start_jacobian)


@draft
def _next_stop(model, clock, controls, stops, out, counts):
    """Return the next time at which a step must end; at a kink just reached restart, as accelerations jump."""
    while clock.stop < stops.size:
        due = stops[clock.stop]
        if due > clock.time + controls.shortest:
            return min(controls.end, due)
        if due > clock.time - controls.shortest and not controls.fixed:
            jump(model, clock, controls, out, counts)
        clock.stop += 1
    return controls.end


@draft
def _length(clock, controls, stop):
    """Length of the next step: as the error allows, up to the stop, or half-way to it if the step after would be short.

    A step to an event is not halved: it would be lengthened to the event and halved again for ever.
    """
    h, left = min(clock.next_step, controls.longest), stop - clock.time
    if clock.time + clock.reach * h >= stop:
        return left
    return 0.5 * left if clock.time + 2.0 * h > stop and not controls.fixed and clock.reach == REACH else h


@draft
def _try(model, clock, h, at, controls, counts):
    """Try a step of length h to the time `at`; return False if Newton's method, error or contacts need a shorter one."""
    tables, work, state = model.tables, model.work, model.state
    shortest, near = controls.shortest, landing(state, controls)
    fresh = clock.needs_matrix or abs(h - clock.matrix_step) > 1e-9 * h
    predict(state, h, clock.previous)
    integrate(state, h)
    ratio = newton(model, clock.time, h, controls.newton_share * controls.tolerance, fresh, counts)
    clock.matrix_step, clock.needs_matrix = h, ratio > SLOW
    if ratio > 1.0:
        clock.next_step, clock.previous, clock.max_growth = 0.5 * h, 0.0, 1.0
        if clock.next_step < shortest:
            counts.status = Ended.UNDERFLOW if np.isfinite(state.residual.sum()) else Ended.NOT_FINITE
        return False
    clock.error = _error(model, at, h, controls, near)
    part = first_onset(tables, state.start_reports, work.reports, h, near, outside(state, controls), True)
    part = min(part, first_edge(tables, state.start_reports, work.reports, h, near, outside(state, controls)))
    if h * part > shortest and h * (1.0 - part) > LEAST_MOVE * shortest and clock.error <= 1.0:
        clock.next_step, clock.reach = h * part, 1.0
        return False
    if controls.fixed:
        return True
    if h > 10.0 * shortest:
        if lets_go(tables, state.start_reports, work.reports, state.largest_force, controls.contact_tolerance, near):
            clock.error = max(clock.error, RELEASE_ERROR)
    if clock.error > 1.0 and h > 4.0 * shortest:
        clock.next_step, clock.max_growth = max(h * max(0.2, SAFETY * clock.error**-ORDER), 2.0 * shortest), 1.0
        return False
    return True


@draft
def _accept(model, clock, h, target, controls, out, counts):
    """Accept a step of length h to the time `target`, and write its rows."""
    tables, work, state = model.tables, model.work, model.state
    changed, before = remember(tables, work, state, controls, counts), clock.time
    if dense(controls):
        moment = closing(tables, state.start_reports, work.reports, JUMP * controls.shortest)
        parts = samples_in(state, tables.elastic, h, controls, bend_of_depths(tables, state.start_reports, work.reports, h))
        if 0.0 < moment < 0.5 * h / parts:
            write_at_face(state, out, counts, before, h, moment)
        write_between(state, out, counts, before, h, parts)
        if 0.0 < -moment < 0.5 * h / parts:
            write_at_face(state, out, counts, before, h, moment)
    _take_over(state)
    follow_units(state, tables.elastic, controls.tolerance)
    copy(work.reports, state.start_reports)
    counts.steps += 1
    clock.time, clock.previous, clock.reach, clock.skipped = target, h, REACH, clock.skipped + 1
    if clock.skipped >= controls.every or changed or target >= controls.end - controls.shortest:
        write(state, out, counts, target, before)
        clock.skipped = 0
    if changed:
        jump(model, clock, controls, out, counts)


@draft
def _lengthen(clock, h, shortest):
    """Length of the step after an accepted one of length h, by its error and the last one's: K. Gustafsson's predictive rule."""
    error = max(clock.error, 1e-8)
    factor = min(clock.max_growth, SAFETY * error**-ORDER)
    if clock.last_error > 0.0:
        factor = min(factor, SAFETY * h / clock.last_step * (clock.last_error / (error * error)) ** ORDER)
    clock.max_growth, clock.last_error, clock.last_step = MOST_GROWTH, max(error, 1e-2), h
    if factor < SHORTER or factor > LONGER:
        clock.next_step = max(clock.next_step if h < 0.5 * clock.next_step else 0.0, h * factor, 2.0 * shortest)


@jit
def run_implicit(model, clock, controls, stops, out, counts):
    """Integrate from the model's state to the end, or until out is full; stops are times at which a step must end.

    All samples, or every n-th step, are written to out. The model's state and the clock are kept for the next call.
    """
    state, mixed = model.state, model.work.strip_form
    counts.samples = 0
    if counts.steps == 0:
        clock.needs_matrix, clock.max_growth, clock.reach = True, MOST_GROWTH, REACH
        _begin(model, clock.time, controls.tolerance)
        write(state, out, counts, clock.time, clock.time)
    mixed[0], rows = MIXED, out.time.size - MOST_SAMPLES - 3
    while clock.time < controls.end - controls.shortest and counts.status == Ended.OK and counts.samples < rows:
        stop = _next_stop(model, clock, controls, stops, out, counts)
        h = _length(clock, controls, stop)
        if counts.steps + counts.rejected > controls.max_steps:
            counts.status = Ended.TOO_MANY
        last = h >= stop - clock.time
        at = stop * (1.0 - 4e-16) if last else clock.time + h  # just before a drive's kink
        if not _try(model, clock, h, at, controls, counts):
            counts.rejected += 1
            continue
        _accept(model, clock, h, stop if last else clock.time + h, controls, out, counts)
        if controls.fixed:
            clock.next_step = controls.first_step
        else:
            _lengthen(clock, h, controls.shortest)
    mixed[0] = PLAIN
