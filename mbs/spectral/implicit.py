"""Collocation at Radau points with variable steps, compiled: onsets located, kinks hit, constraints kept. See `radau`."""

from __future__ import annotations

import numpy as np

from .compiling import aside, copy, inner, jit, lend
from .contacts import (
    bend_of_depths,
    closing,
    depth_of,
    error_of_depth,
    first_onset,
    lets_go,
    remember_onset,
    time_to_faces,
    touches,
)
from .forces import add_forces
from .fronts import solve
from .kernel import changes_at, forces, rows_at
from .lawtable import AFTER
from .markers import place_markers
from .newton import SLOW, newton
from .output import NOT_FINITE, OK, TOO_MANY, UNDERFLOW
from .radau import REAL, error_of, integrate, predict, put_back, renew_heavy
from .samples import (
    JUMP,
    MOST_SAMPLES,
    dense,
    samples_in,
    write,
    write_after_jump,
    write_at_face,
    write_between,
)
from .scaling import deformed, follow_units
from .strips import MIXED, PLAIN, elastic_stresses
from .tables import BENT, BRISTLE, JOURNAL, KIND, SEAT, SLIDING, SLIP, VALUE

ORDER = 0.25
"""One over the order of the local error."""
HARDER, LIGHT, FORGETS = 2.0, 1e-2, 0.8
"""A contact's force may err by so many times the share that its depth may, and by that of at least so much of its largest force,
of which it forgets a fifth a step: the end of a long push is small beside the blow that began it, and matters no less."""
NOISE = 1e-15
"""Error of a depth, of the longest link, that is rounding: no shorter step makes it less."""
SHORTEST = 1e-12
"""Step, of the end."""
REACH = 1.0001
"""A stop that is nearer than so many step lengths ends the step; not one to an onset, which would be stepped over again."""
SAFETY, SHORTER, LONGER, GROW = 0.85, 0.9, 1.4, 5.0
"""Share of the length that would just do, changes of the length between which the old one stays, as it costs no new matrix, and
the largest change."""
LANDING = 1e-2
"""A contact this near to its face, of the tolerance and the longest link, is at it."""
LETS_GO = 20.0
"""What counts as the error of a step in which a contact lets go."""
OUTSIDE, ROUNDING = 1e-2, 1e-15
"""Distance from a face at which a step to an onset ends, of the landing, and of the longest link at least."""
NEARLY = 0.1
"""Share of the last step by which the state is moved past a face at most."""
ROOM = 1e-2
"""Of the shortest step, by which the end of a step to an onset is moved no more."""


@aside
def _begin(s, e, w, x, t, tolerance):
    """Fill in what the first step needs to know of the start."""
    elastic_stresses(s, w, x.q, x.v, x.stress)
    w.mixed[0], w.held[:] = MIXED, 0.0
    copy(x.stress, w.stress)
    forces(s, w, t, x.q, x.v, x.lam, x.memory, 0.0, x.force)
    rows_at(s, w, t, x.gap, x.base, x.speed)
    renew_heavy(s, e, w, x, x.q, x.base, False)
    copy(w.reports, x.before)
    for i in range(x.q.size):
        x.weight[i] = 1.0 / x.whole[i]
    for k in range(s.elastic.shape[0]):
        i, j = s.elastic[k, 0], s.elastic[k, 1]
        x.rest[k] = deformed(x, s.elastic, k)
        if j >= 0:
            x.weight[i] = x.weight[j] = 0.0
    follow_units(x, s.elastic, tolerance)


@aside
def _restart(s, e, w, x, t):
    """Accelerations and multipliers anew, after a jump of them: from M a + G^T lambda = f, G a = change."""
    n, r = x.q.size, x.lam.size
    w.held[:] = 0.0
    copy(x.stress, w.stress)
    forces(s, w, t, x.q, x.v, x.lam, x.memory, 0.0, x.force)
    rows_at(s, w, t, x.gap, x.base, x.speed)
    changes_at(s, w, t, AFTER, x.change)
    for i in range(n):
        x.right[i] = x.force[i]
    for k in range(r):
        x.right[n + k] = x.change[k]
    renew_heavy(s, e, w, x, x.q, x.base, True)
    solve(e.mass, x.heavy, x.heavy_swaps, x.right, x.part)
    for i in range(n):
        x.a[i] = x.right[i]
    for k in range(r):
        x.lam[k] = x.right[n + k]
    copy(w.reports, x.before)


@aside
def _error(s, e, w, x, t, h, controls, least):
    """Local error over what is allowed, of the coordinates, and of the depths and forces of closed contacts; 0 of equal
    steps.

    Reports are those of the end.
    """
    error, allowed = 0.0 if controls.fixed else error_of(s, e, x, h) / controls.tolerance, controls.contact_tolerance
    put_back(s, e, w, x, t, h)
    if s.forces.shape[0] == 0:
        return error
    n, q, v = x.q.size, x.places[2], x.rates[2]
    add_forces(s, w, t, x.multipliers[2], x.memory, h, x.force)
    if controls.fixed:
        return error
    closed = False
    for k in range(s.forces.shape[0]):
        if touches(s, k) and (depth_of(s, w.reports, k) > 0.0 or depth_of(s, x.before, k) > 0.0):
            closed = True
    if closed:
        copy(w.reports, x.shifted)
        for i in range(n):  # the first row of the error's equation gives that of the rates
            x.dv[0, i], x.dq[0, i] = v[i] + REAL / h * x.step[i] - x.dq[0, i], q[i] + x.step[i]
        place_markers(s, w, x.dq[0], x.dv[0])
        add_forces(s, w, t, x.multipliers[2], x.memory, h, x.force)
        for k in range(s.forces.shape[0]):
            if touches(s, k):
                deep = error_of_depth(s, x.before, x.shifted, w.reports, h, k, least, NOISE * x.whole.max())
                push = max(abs(x.before[k, VALUE]), abs(x.shifted[k, VALUE]), LIGHT * x.largest[k], 1e-300)
                error = max(error, deep / allowed)
                if deep > 0.0:
                    error = max(error, abs(w.reports[k, VALUE] - x.shifted[k, VALUE]) / (push * HARDER * allowed))
        copy(x.shifted, w.reports)
    return error


@inner
def _landing(x, controls):
    """Depth up to which a contact is at its face."""
    return LANDING * controls.tolerance * x.whole.max()


@inner
def _outside(x, controls):
    """Distance from its face at which a step to an onset ends."""
    return max(OUTSIDE * _landing(x, controls), ROUNDING * x.whole.max())


@aside
def _remember(s, w, x, controls, counts):
    """Take over the accepted step: onset speeds of contacts, bristles; whether a contact has closed or let go."""
    changed, near = False, 2.0 * _outside(x, controls)
    for k in range(s.forces.shape[0]):
        kind, m = s.forces[k, KIND], x.memory[k]
        copy(m, x.old[k])
        x.largest[k] = max(FORGETS * x.largest[k], abs(w.reports[k, VALUE]))
        if touches(s, k):
            event = remember_onset(s, x.before, w.reports, k, m, controls.floor, controls.graze, near)
            changed = changed or event != 0
            if event > 0:
                counts.onsets += 1
        if kind == JOURNAL or kind == SEAT:
            m[BRISTLE], m[SLIDING] = w.reports[k, BENT], w.reports[k, SLIP]
    return changed


@aside
def _take_over(x):
    """Make the step's end the present state."""
    for i in range(x.q.size):
        x.past[0, i] = x.v[i]
        x.past[1, i], x.past[2, i], x.past[3, i] = x.rates[0, i], x.rates[1, i], x.rates[2, i]
        x.q[i], x.v[i], x.a[i] = x.places[2, i], x.rates[2, i], x.seconds[2, i]
    copy(x.multipliers[1], x.past_lam), copy(x.stresses[1], x.past_stress)
    copy(x.multipliers[2], x.lam), copy(x.stresses[2], x.stress), copy(x.jacobian, x.base)


@aside
def _jump(s, e, w, x, clock, controls, out, counts):
    """Start anew after a jump of accelerations and multipliers; contacts that are about to close are moved past their faces."""
    past = min(time_to_faces(s, x.before, 2.0 * _outside(x, controls)), NEARLY * clock.previous)
    for i in range(x.q.size):
        x.q[i] += past * x.v[i]
    clock.previous, clock.fresh = 0.0, True
    _restart(s, e, w, x, clock.time)
    if dense(controls):
        write_after_jump(x, clock, controls, out, counts)


@aside
def _next_stop(s, e, w, x, clock, controls, stops, out, counts):
    """The next time at which a step must end. At a kink that has come, accelerations jump."""
    while clock.stop < stops.size:
        due = stops[clock.stop]
        if due > clock.time + controls.shortest:
            return min(controls.end, due)
        if due > clock.time - controls.shortest and not controls.fixed:
            _jump(s, e, w, x, clock, controls, out, counts)
        clock.stop += 1
    return controls.end


@aside
def _length(clock, controls, stop):
    """Length of the next step: the one wanted, all that is left to the stop, or half of that if the next one would be short.

    A step to an event is not halved: it would be lengthened to the event and halved again for ever.
    """
    h, left = min(clock.wanted, controls.longest), stop - clock.time
    if clock.time + clock.reach * h >= stop:
        return left
    return 0.5 * left if clock.time + 2.0 * h > stop and not controls.fixed and clock.reach == REACH else h


@aside
def _try(s, e, w, x, clock, h, at, controls, counts):
    """Whether a step of length h to the time `at` stands: Newton's method, error, contacts. If not, the next one is shorter."""
    shortest, landing = controls.shortest, _landing(x, controls)
    fresh = clock.fresh or abs(h - clock.made) > 1e-9 * h
    predict(x, h, clock.previous)
    integrate(x, h)
    ratio = newton(s, e, w, x, clock.time, h, controls.close * controls.tolerance, fresh, counts)
    clock.made, clock.fresh = h, ratio > SLOW
    if ratio > 1.0:
        clock.wanted, clock.previous, clock.grow = 0.5 * h, 0.0, 1.0
        if clock.wanted < shortest:
            counts.status = UNDERFLOW if np.isfinite(x.residual.sum()) else NOT_FINITE
        return False
    clock.error = _error(s, e, w, x, at, h, controls, landing)
    part = first_onset(s, x.before, w.reports, h, landing, _outside(x, controls), True)
    if h * part > shortest and h * (1.0 - part) > ROOM * shortest and clock.error <= 1.0:
        clock.wanted, clock.reach = h * part, 1.0
        return False
    if controls.fixed:
        return True
    if h > 10.0 * shortest:
        if lets_go(s, x.before, w.reports, x.largest, controls.contact_tolerance, landing):
            clock.error = max(clock.error, LETS_GO)
    if clock.error > 1.0 and h > 4.0 * shortest:
        clock.wanted, clock.grow = max(h * max(0.2, SAFETY * clock.error**-ORDER), 2.0 * shortest), 1.0
        return False
    return True


@aside
def _accept(s, e, w, x, clock, h, target, controls, out, counts):
    """Take over a step of length h to the time `target`, and write its rows."""
    changed, before = _remember(s, w, x, controls, counts), clock.time
    if dense(controls):
        moment = closing(s, x.before, w.reports, JUMP * controls.shortest)
        parts = samples_in(x, s.elastic, h, controls, bend_of_depths(s, x.before, w.reports, h))
        if 0.0 < moment < 0.5 * h / parts:
            write_at_face(x, out, counts, before, h, moment)
        write_between(x, out, counts, before, h, parts)
        if 0.0 < -moment < 0.5 * h / parts:
            write_at_face(x, out, counts, before, h, moment)
    _take_over(x)
    follow_units(x, s.elastic, controls.tolerance)
    copy(w.reports, x.before)
    counts.steps += 1
    clock.time, clock.previous, clock.reach, clock.skipped = target, h, REACH, clock.skipped + 1
    if clock.skipped >= controls.every or changed or target >= controls.end - controls.shortest:
        write(x, out, counts, target, before)
        clock.skipped = 0
    if changed:
        _jump(s, e, w, x, clock, controls, out, counts)


@aside
def _lengthen(clock, h, shortest):
    """Length of the step after one of length h that stood, by its error and the last one's: K. Gustafsson's predictive rule."""
    error = max(clock.error, 1e-8)
    factor = min(clock.grow, SAFETY * error**-ORDER)
    if clock.last_error > 0.0:
        factor = min(factor, SAFETY * h / clock.last_step * (clock.last_error / (error * error)) ** ORDER)
    clock.grow, clock.last_error, clock.last_step = GROW, max(error, 1e-2), h
    if factor < SHORTER or factor > LONGER:
        clock.wanted = max(clock.wanted if h < 0.5 * clock.wanted else 0.0, h * factor, 2.0 * shortest)


@jit
def run_implicit(s, e, w, x, clock, controls, stops, out, counts):
    """Go on from the room's state to the end, or until out is full; stops are times at which a step must end.

    Every sample is written to out, or every so many steps. The room and the clock are left as they are then, to go on from.
    """
    _run(lend(s), lend(e), lend(w), lend(x), clock, controls, stops, lend(out), counts)


@aside
def _run(s, e, w, x, clock, controls, stops, out, counts):
    counts.samples = 0
    if counts.steps == 0:
        clock.fresh, clock.grow, clock.reach = True, GROW, REACH
        _begin(s, e, w, x, clock.time, controls.tolerance)
        write(x, out, counts, clock.time, clock.time)
    w.mixed[0], rows = MIXED, out.time.size - MOST_SAMPLES - 3
    while clock.time < controls.end - controls.shortest and counts.status == OK and counts.samples < rows:
        stop = _next_stop(s, e, w, x, clock, controls, stops, out, counts)
        h = _length(clock, controls, stop)
        if counts.steps + counts.rejected > controls.budget:
            counts.status = TOO_MANY
        last = h >= stop - clock.time
        at = stop * (1.0 - 4e-16) if last else clock.time + h  # just before a drive's kink
        if not _try(s, e, w, x, clock, h, at, controls, counts):
            counts.rejected += 1
            continue
        _accept(s, e, w, x, clock, h, stop if last else clock.time + h, controls, out, counts)
        if controls.fixed:
            clock.wanted = controls.first_step
        else:
            _lengthen(clock, h, controls.shortest)
    w.mixed[0] = PLAIN
