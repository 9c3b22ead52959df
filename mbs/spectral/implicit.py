"""Collocation at Radau points with variable steps, compiled: onsets located, kinks hit, constraints kept. See `radau`.

Samples lie closer than the steps: between a step's ends coordinates are the quintic with the places, rates and accelerations
there, multipliers the cubic through the nodes. They are as many as straight lines between them need.
"""

from __future__ import annotations

import numpy as np

from buckler.mbs.spectral.compiling import aside, copy, jit, lend
from buckler.mbs.spectral.contacts import depth_of, error_of_depth, first_onset, lets_go, remember_onset, touches
from buckler.mbs.spectral.forces import add_forces
from buckler.mbs.spectral.fronts import solve
from buckler.mbs.spectral.kernel import changes_at, forces, rows_at
from buckler.mbs.spectral.lawtable import AFTER
from buckler.mbs.spectral.markers import place_markers
from buckler.mbs.spectral.output import (
    BUDGET,
    CLOSE,
    CONTACT_TOLERANCE,
    EVERY,
    FIRST_STEP,
    FIXED_STEPS,
    FLOOR,
    GRAZE,
    LONGEST,
    MADE,
    NOT_FINITE,
    NOW,
    OK,
    ONSETS,
    PREVIOUS,
    REJECTED,
    SAMPLES,
    SKIPPED,
    STATUS,
    STEPS,
    TOLERANCE,
    TOO_MANY,
    UNDERFLOW,
    WANTED,
)  # fmt: skip
from buckler.mbs.spectral.radau import PAST, REAL, ROUNDING, SLOW, error_of, newton, predict, put_back, renew_heavy, size_of
from buckler.mbs.spectral.strips import elastic_stresses
from buckler.mbs.spectral.tables import BRISTLE, FASTEST, JOURNAL, ONSET, SEAT, SLIDING

SHARE = 100.0
"""The tolerance of inner coordinates of strips and modes is relative to so many times their largest deformation so far."""
STRAIGHT = 0.75
"""Straight lines between samples may err by the tolerance to this power, in units of coordinates."""
MOST_SAMPLES = 40
"""In a step."""
ORDER = 0.25
"""One over the order of the local error."""
HARDER, LIGHT, FORGETS = 2.0, 1e-2, 0.8
"""A contact's force may err by so many times the share that its depth may, and by that of at least so much of its largest force,
of which it forgets a fifth a step: the end of a long push is small beside the blow that began it, and matters no less."""
SAFETY, SHORTER, LONGER = 0.85, 0.9, 1.4
"""Share of the length that would just do, and changes of the length between which the old one stays: it costs no new matrix."""


@aside
def _follow_units(x, elastic, tolerance):
    """Take the largest deformation across the chord so far as the unit of inner coordinates, as far as rounding allows."""
    least = max(1e-5, 10.0 * ROUNDING / tolerance)
    for k in range(elastic.shape[0]):
        i, j, group = elastic[k, 0], elastic[k, 1], elastic[k, 2]
        size = x.q[i]
        if j >= 0:
            dx, dy = x.q[elastic[k, 5]] - x.q[elastic[k, 3]], x.q[elastic[k, 6]] - x.q[elastic[k, 4]]
            length = max(np.sqrt(dx * dx + dy * dy), 1e-300)
            x.turn[k, 0], x.turn[k, 1] = dx / length, dy / length
            size = (dx * x.q[j] - dy * x.q[i]) / length
        x.amount[group] = max(x.amount[group], abs(size - x.rest[k]))
    for k in range(elastic.shape[0]):
        i, j, group = elastic[k, 0], elastic[k, 1], elastic[k, 2]
        unit = min(x.whole[i], max(least * x.whole[i], SHARE * x.amount[group]))
        if j >= 0:
            x.across[k] = unit
        else:
            x.weight[i] = 1.0 / unit


@aside
def _begin(s, e, w, x, t, tolerance):
    """Fill in what the first step needs to know of the start."""
    elastic_stresses(s, w, x.q, x.v, x.stress)
    w.mixed[0], w.held[:] = 1.0, 0.0
    copy(x.stress, w.stress)
    forces(s, w, t, x.q, x.v, x.lam, x.memory, 0.0, x.force)
    rows_at(s, w, t, x.gap, x.base, x.speed)
    renew_heavy(s, e, w, x, x.q, x.base, False)
    copy(w.reports, x.before)
    for i in range(x.q.size):
        x.weight[i] = 1.0 / x.whole[i]
    for k in range(s.elastic.shape[0]):
        i, j = s.elastic[k, 0], s.elastic[k, 1]
        x.rest[k] = x.q[i]
        if j >= 0:
            x.weight[i] = x.weight[j] = 0.0
            dx, dy = x.q[s.elastic[k, 5]] - x.q[s.elastic[k, 3]], x.q[s.elastic[k, 6]] - x.q[s.elastic[k, 4]]
            x.rest[k] = (dx * x.q[j] - dy * x.q[i]) / max(np.sqrt(dx * dx + dy * dy), 1e-300)
    _follow_units(x, s.elastic, tolerance)


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
def _error(s, e, w, x, t, h, tolerance, contact_tolerance, least):
    """Local error over what is allowed, of the coordinates, and of the depths and forces of closed contacts.

    Reports are those of the end.
    """
    error = error_of(s, e, x, h) / tolerance
    put_back(s, e, w, x, t)
    if s.forces.shape[0] == 0:
        return error
    n, q, v = x.q.size, x.places[2], x.rates[2]
    add_forces(s, w, t, x.multipliers[2], x.memory, h, x.force)
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
                deep = error_of_depth(s, x.before, x.shifted, w.reports, h, k, least)
                push = max(abs(x.before[k, 0]), abs(x.shifted[k, 0]), LIGHT * x.largest[k], 1e-300)
                error = max(error, deep / contact_tolerance)
                error = max(error, abs(w.reports[k, 0] - x.shifted[k, 0]) / (push * HARDER * contact_tolerance))
        copy(x.shifted, w.reports)
    return error


@aside
def _remember(s, w, x, floor, graze, counts):
    """Take over the accepted step: onset speeds of contacts, bristles; whether a contact has closed or let go."""
    changed = False
    for k in range(s.forces.shape[0]):
        kind, m = s.forces[k, 0], x.memory[k]
        x.old[k, 0], x.old[k, 1] = m[BRISTLE], m[SLIDING]
        x.largest[k] = max(FORGETS * x.largest[k], abs(w.reports[k, 0]))
        if touches(s, k):
            event = remember_onset(s, x.before, w.reports, k, m, floor, graze)
            changed = changed or event != 0
            if event > 0:
                counts[ONSETS] += 1
        if kind == JOURNAL or kind == SEAT:
            m[BRISTLE], m[SLIDING] = w.reports[k, 5], w.reports[k, 4]
    return changed


@aside
def _write(x, out, row, t, before):
    """Write the present state as a row; bristles and sliding speeds are those of the step before, at time `before`."""
    out.time[row] = t
    copy(x.q, out.q[row]), copy(x.v, out.v[row]), copy(x.a, out.a[row]), copy(x.lam, out.lam[row])
    _write_memory(x, out, row, before)


@aside
def _write_after_jump(x, out, row, t, moment):
    """Write a row for the moment after a jump of accelerations and multipliers."""
    for i in range(x.q.size):
        out.q[row, i], out.v[row, i] = x.q[i] + moment * x.v[i], x.v[i] + moment * x.a[i]
    out.time[row] = t + moment
    copy(x.a, out.a[row]), copy(x.lam, out.lam[row])
    _write_memory(x, out, row, t)


@aside
def _write_memory(x, out, row, before):
    for k in range(x.old.shape[0]):
        m = out.memory[row, k]
        m[ONSET], m[FASTEST], m[BRISTLE], m[SLIDING] = x.memory[k, ONSET], before, x.old[k, 0], x.old[k, 1]


@aside
def _samples_in(x, elastic, h, tolerance):
    """How many parts of the step straight lines need."""
    for i in range(x.q.size):
        x.dq[0, i] = 0.125 * h * h * max(abs(x.a[i]), abs(x.seconds[2, i]))
    bend = size_of(x, elastic, x.dq[0]) / tolerance**STRAIGHT
    return int(min(MOST_SAMPLES, np.ceil(np.sqrt(bend) + 1e-9)))


@aside
def _write_between(x, out, row, t, h, parts):
    """Write rows within the step from the present state to its end, all parts but the last."""
    for part in range(1, parts):
        y = part / parts
        for i in range(x.q.size):
            v0, a0, v1, a1 = h * x.v[i], h * h * x.a[i], h * x.rates[2, i], h * h * x.seconds[2, i]
            # c3 y^3 + c4 y^4 + c5 y^5 beside q + v0 y + a0 y^2/2
            d0, d1, d2 = x.places[2, i] - x.q[i] - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0
            c3, c4, c5 = 10.0 * d0 - 4.0 * d1 + 0.5 * d2, -15.0 * d0 + 7.0 * d1 - d2, 6.0 * d0 - 3.0 * d1 + 0.5 * d2
            out.q[row, i] = x.q[i] + y * (v0 + y * (0.5 * a0 + y * (c3 + y * (c4 + y * c5))))
            out.v[row, i] = (v0 + y * (a0 + y * (3.0 * c3 + y * (4.0 * c4 + y * 5.0 * c5)))) / h
            out.a[row, i] = (a0 + y * (6.0 * c3 + y * (12.0 * c4 + y * 20.0 * c5))) / (h * h)
        out.time[row], out.lam[row] = t + y * h, 0.0
        for j in range(4):
            factor, lam = 1.0, x.lam if j == 0 else x.multipliers[j - 1]
            for m in range(4):
                if m != j:
                    factor *= (y - PAST[m]) / (PAST[j] - PAST[m])
            for k in range(x.lam.size):
                out.lam[row, k] += factor * lam[k]
        _write_memory(x, out, row, t)
        row += 1
    return row


@aside
def _take_over(x):
    """Make the step's end the present state."""
    for i in range(x.q.size):
        x.past[0, i] = x.v[i]
        x.past[1, i], x.past[2, i], x.past[3, i] = x.rates[0, i], x.rates[1, i], x.rates[2, i]
        x.q[i], x.v[i], x.a[i] = x.places[2, i], x.rates[2, i], x.seconds[2, i]
    copy(x.multipliers[1], x.past_lam), copy(x.stresses[1], x.past_stress)
    copy(x.multipliers[2], x.lam), copy(x.stresses[2], x.stress), copy(x.jacobian, x.base)


@jit
def run_implicit(s, e, w, x, clock, end, stops, controls, out, counts):
    """Go on from the room's state to the end, or until out is full; stops are times at which a step must end.

    Every sample is written to out, or every so many steps. The room and the clock are left as they are then, to go on from.
    """
    _run(lend(s), lend(e), lend(w), lend(x), clock, end, stops, controls, lend(out), counts)


@aside
def _run(s, e, w, x, clock, end, stops, controls, out, counts):
    t, wanted, previous, made, skipped = clock[NOW], clock[WANTED], clock[PREVIOUS], clock[MADE], int(clock[SKIPPED])
    tolerance, fixed, every = controls[TOLERANCE], controls[FIXED_STEPS] > 0.0, int(controls[EVERY])
    shortest, moment, landing = 1e-12 * end, 1e-13 * end, 1e-2 * tolerance * x.whole.max()
    row, nstop, fresh, grow, last_error, last_step = 0, 0, made == 0.0, 5.0, 0.0, 1.0
    if counts[STEPS] == 0:
        _begin(s, e, w, x, t, tolerance)
        _write(x, out, 0, t, t)
        row = 1
    w.mixed[0] = 1.0
    while t < end - shortest and counts[STATUS] == OK and row + MOST_SAMPLES + 2 < out.time.size:
        while nstop < stops.size and stops[nstop] <= t + shortest:
            if stops[nstop] > t - shortest and not fixed:
                previous, fresh = 0.0, True
                _restart(s, e, w, x, t)
                if every == 1:
                    _write_after_jump(x, out, row, t, moment)
                    row += 1
            nstop += 1
        target = min(end, stops[nstop]) if nstop < stops.size else end
        h = min(wanted, controls[LONGEST])
        if t + 1.0001 * h >= target:
            h = target - t
        elif t + 2.0 * h > target and not fixed:
            h = 0.5 * (target - t)
        if counts[STEPS] + counts[REJECTED] > controls[BUDGET]:
            counts[STATUS] = TOO_MANY
        if abs(h - made) > 1e-9 * h:
            fresh = True
        at = target * (1.0 - 4e-16) if h >= target - t else t + h  # just before a drive's kink
        predict(x, h, previous)
        ratio = newton(s, e, w, x, t, h, controls[CLOSE] * tolerance, fresh, counts)
        made, fresh = h, False
        if ratio > 1.0:
            counts[REJECTED] += 1
            wanted, previous, fresh, grow = 0.5 * h, 0.0, True, 1.0
            if wanted < shortest:
                counts[STATUS] = UNDERFLOW if np.isfinite(x.residual.sum()) else NOT_FINITE
            continue
        error = _error(s, e, w, x, at, h, tolerance, controls[CONTACT_TOLERANCE], landing)
        part = first_onset(s, x.before, w.reports, h, landing)
        if part < 1.0 and h * part > shortest and (error <= 1.0 or fixed):
            counts[REJECTED] += 1
            wanted = h * part
            continue
        if not fixed and h > 10.0 * shortest and lets_go(s, x.before, w.reports, x.largest, controls[CONTACT_TOLERANCE]):
            error = max(error, 20.0)
        if error > 1.0 and not fixed and h > 4.0 * shortest:
            counts[REJECTED] += 1
            wanted, grow = max(h * max(0.2, SAFETY * error**-ORDER), 2.0 * shortest), 1.0
            continue
        changed = _remember(s, w, x, controls[FLOOR], controls[GRAZE], counts)
        counts[STEPS] += 1
        skipped += 1
        if not fixed and every == 1:
            row = _write_between(x, out, row, t, h, _samples_in(x, s.elastic, h, tolerance))
        _take_over(x)
        _follow_units(x, s.elastic, tolerance)
        copy(w.reports, x.before)
        before, t = t, (target if h >= target - t else t + h)
        previous = h
        if skipped >= every or changed or t >= end - shortest:
            _write(x, out, row, t, before)
            row, skipped = row + 1, 0
        if changed:
            previous, fresh = 0.0, True
            _restart(s, e, w, x, t)
            if t < end - 2.0 * moment and not fixed and every == 1:
                _write_after_jump(x, out, row, t, moment)
                row += 1
        if ratio > SLOW:
            fresh = True
        if fixed:
            wanted = controls[FIRST_STEP]
            continue
        error = max(error, 1e-8)
        factor = min(grow, SAFETY * error**-ORDER)
        if last_error > 0.0:  # K. Gustafsson's predictive rule
            factor = min(factor, SAFETY * h / last_step * (last_error / (error * error)) ** ORDER)
        grow, last_error, last_step = 5.0, max(error, 1e-2), h
        if factor < SHORTER or factor > LONGER:
            wanted = max(wanted if h < 0.5 * wanted else 0.0, h * factor, 2.0 * shortest)
    clock[NOW], clock[WANTED], clock[PREVIOUS], clock[MADE], clock[SKIPPED] = t, wanted, previous, made, skipped
    counts[SAMPLES] = row
    w.mixed[0] = 0.0
