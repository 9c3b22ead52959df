"""Dormand-Prince 5(4), compiled, for rattling mechanisms: steps end at onsets, constraints are solved for accelerations.

The constant mass matrix is factored once, and modal links that no constraint touches are corrected in closed form. After each
step positions and velocities are projected onto the constraints. Bristles are states. Equations and source:
docs/theory-spectral.md, explicit integration.
"""

from __future__ import annotations

import math

import numpy as np

from .compiling import copy, draft, inline, jit
from .contacts import begins_smoothly, first_onset, remember_onset, touches
from .forces import add_one
from .fronts import factor, solve
from .kernel import add_modal, change_at, couple_modes, renew_mass, renew_rows, row_at, row_times
from .lawtable import AFTER, bristle_rate
from .markers import place_marker
from .output import Ended
from .strips import add_strips
from .tables import ForceKind, Forces, Instant, Memory, Report

NODES = np.array([0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0])
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
SHORTEST = 1e-15
"""Step, of the end."""
MOST_GAP = 1e-4
"""Gap of the constraints that may stay, over the tolerance; from a larger one the state is put back."""
SAFETY = 0.9
"""Share of the step length that would just do."""
ORDER = 0.2
"""One over the order of the local error."""
ERRORS = np.array([71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0])


@inline
def _has_changed(tables, state):
    """Return True if the matrix differs from the one factored last: by modal links, or by gradients of constraints."""
    changed = (tables.modal.shape[0] > 0 and state.free_modes[0] == 0) or state.has_factors[0] == 0
    for i in range(state.jacobian.size):
        changed = changed or state.jacobian[i] != state.factored_jacobian[i]
        state.factored_jacobian[i] = state.jacobian[i]
    return changed


@draft
def rates_at(model, t, y, out):
    """Compute the rates of a state: velocities, accelerations, rates of bristles."""
    tables, order, work, state = model.tables, model.order, model.work, model.state
    n, r = state.force.size, state.lam.size
    q, v = y[:n], y[n : 2 * n]
    for k in range(tables.forces.shape[0]):
        state.memory[k, Memory.BRISTLE] = y[2 * n + k]
    for m in range(tables.markers.shape[0]):
        place_marker(tables, work, m, q, v, False)
    for i in range(n):
        state.right[i] = tables.factors[-1] * tables.weight[i]
    if tables.strips.shape[0] > 0:
        add_strips(tables, work, q, v, state.right)
    if tables.modal.shape[0] > 0:
        add_modal(tables, q, v, state.right)
    now = Instant(t, -1.0, q, v, state.lam, state.memory)
    for k in range(tables.forces.shape[0]):
        add_one(tables, work, k, now, state.right)
    for k in range(r):
        row_at(tables, work, k, t, state.residual, state.jacobian, state.speed)
        change_at(tables, work, k, t, AFTER, state.change)
        state.right[n + k] = state.change[k]
    if _has_changed(tables, state):
        if state.free_modes[0] > 0:
            renew_rows(tables, state.jacobian, state.matrix)
        else:
            renew_mass(tables, work, q, state.jacobian, state.matrix)
        factor(order, state.matrix, state.factors, state.swaps, state.amount)
        state.has_factors[0] = 1
    solve(order, state.factors, state.swaps, state.right, state.part)
    if state.free_modes[0] > 0:
        couple_modes(tables, work, q, state.right)
    for i in range(n):
        out[i], out[n + i] = v[i], state.right[i]
    for k in range(r):
        state.lam[k] = state.right[n + k]
    for k in range(tables.forces.shape[0]):
        kind, law = tables.forces[k, Forces.KIND], tables.forces[k, Forces.FRICTION]
        out[2 * n + k] = 0.0
        if law >= 0 and (kind == ForceKind.FRICTION or (kind == ForceKind.JOURNAL and work.reports[k, Report.LENGTH] > 0.0)):
            out[2 * n + k] = bristle_rate(tables, law, y[2 * n + k], work.reports[k, Report.SLIP])


@jit
def fill_accelerations(model, out):
    """Fill in accelerations and multipliers at the states of out."""
    state = model.state
    n = state.force.size
    for i in range(out.time.size):
        for j in range(n):
            state.trial[j], state.trial[n + j] = out.q[i, j], out.v[i, j]
        for k in range(model.tables.forces.shape[0]):
            state.memory[k, Memory.ONSET] = out.memory[i, k, Memory.ONSET]
            state.trial[2 * n + k] = out.memory[i, k, Memory.BRISTLE]
        rates_at(model, out.time[i], state.trial, state.rates[1])
        for j in range(n):
            out.a[i, j] = state.rates[1, n + j]
        copy(state.lam, out.lam[i])


@inline
def _is_off(tables, state, allowed):
    """Return True if the new state violates its constraints by more than is allowed, in units of coordinates and their rates."""
    n, worst = state.force.size, 0.0
    for k in range(state.lam.size):
        slip = row_times(tables, k, state.jacobian, state.new[n : 2 * n]) - state.speed[k]
        worst = max(worst, abs(state.residual[k]), abs(slip) / state.largest_rate[0])
    return worst > allowed * state.units.min()


@inline
def _put_back(tables, order, state):
    """Project the new state onto the constraints, positions by one Newton step in the metric of the mass, then velocities."""
    n, r = state.force.size, state.lam.size
    for level in range(2):
        y = state.new[level * n : level * n + n]
        state.right[:] = 0.0
        for k in range(r):
            state.right[n + k] = state.residual[k] if level == 0 else row_times(tables, k, state.jacobian, y) - state.speed[k]
        solve(order, state.factors, state.swaps, state.right, state.part)
        for i in range(n):
            y[i] -= state.right[i]


@inline
def _stages(model, t, h):
    """Compute the seven stages; state.new becomes the solution of fifth order, and reports are those of its end."""
    state = model.state
    for stage in range(1, 7):
        target, f, c = state.new if stage == 6 else state.trial, state.rates, WEIGHTS[stage]
        for i in range(state.y.size):  # in one sum with zero weights: rates are finite, see _try
            target[i] = state.y[i] + h * (
                c[0] * f[0, i] + c[1] * f[1, i] + c[2] * f[2, i] + c[3] * f[3, i] + c[4] * f[4, i] + c[5] * f[5, i]
            )
        rates_at(model, t + NODES[stage] * h, target, state.rates[stage])


@inline
def _error(state, h, tolerance):
    """Embedded error over the tolerance: of coordinates in their units, of rates in units times the largest rate so far."""
    n, worst = state.force.size, 0.0
    for i in range(2 * n):
        e = 0.0
        for j in range(7):
            e += ERRORS[j] * state.rates[j, i]
        share = abs(h * e) / (state.units[i] if i < n else state.units[i - n] * state.largest_rate[0])
        if not share < math.inf:
            return math.inf  # nan fails all comparisons
        worst = max(worst, share)
    return worst / tolerance


@draft
def _next_stop(clock, controls, stops):
    """The next time at which a step must end."""
    while clock.stop < stops.size and stops[clock.stop] <= clock.time + controls.shortest:
        clock.stop += 1
    return min(controls.end, stops[clock.stop]) if clock.stop < stops.size else controls.end


@draft
def _try(model, clock, h, last, controls, counts):
    """Try a step of length h, the `last` before a stop or not; return False if error or contacts need a shorter one."""
    state = model.state
    _stages(model, clock.time, h * (1.0 - 1e-15) if last else h)
    counts.iterations += 6
    clock.error = error = _error(state, h, controls.tolerance)
    if not error <= 1.0 and not (controls.fixed and error < 1e300):
        clock.next_step = h * (max(0.2, SAFETY * error**-ORDER) if error < 1e300 else 0.2)
        if not error < 1e300:
            state.rates[1:] = 0.0
        if clock.next_step < controls.shortest:
            counts.status = Ended.UNDERFLOW if error < 1e300 else Ended.NOT_FINITE
        return False
    landing = max(1e-3 * controls.tolerance, 1e-12) * state.units.max()
    first = first_onset(model.tables, state.start_reports, model.work.reports, h, landing, 0.0, controls.located)
    if first < 1.0 and h * first > controls.shortest:
        clock.resumed_step, clock.next_step = max(clock.resumed_step, h), h * first
        return False
    return True


@draft
def _accept(model, clock, at, stop, controls, out, counts):
    """Accept a step to the time `at`: project it onto the constraints, and write its row."""
    tables, order, work, state = model.tables, model.order, model.work, model.state
    n, before, clock.time = state.force.size, clock.time, at
    changed = _remember(tables, work, state, controls, counts)
    off = _is_off(tables, state, MOST_GAP * controls.tolerance)
    if off:
        _put_back(tables, order, state)
    if off or changed or at == stop:
        copy(state.new, state.y)
        rates_at(model, at, state.y, state.rates[0])
    else:
        for i in range(state.y.size):
            state.y[i], state.rates[0, i] = state.new[i], state.rates[6, i]
    for i in range(n):
        state.largest_rate[0] = max(state.largest_rate[0], abs(state.y[n + i]) / state.units[i])
    copy(work.reports, state.start_reports)
    counts.steps += 1
    clock.skipped += 1
    if clock.skipped >= controls.every or changed or at >= controls.end - controls.shortest:
        _write(state, out, counts, at, before)
        clock.skipped = 0


@jit
def run_explicit(model, clock, controls, stops, out, counts):
    """Integrate from the state to the end, or until out is full; as `run_implicit`."""
    state = model.state
    counts.samples = 0
    if counts.steps == 0:
        rates_at(model, clock.time, state.y, state.rates[0])
        copy(model.work.reports, state.start_reports)
        _write(state, out, counts, clock.time, clock.time)
    while clock.time < controls.end - controls.shortest and counts.status == Ended.OK and counts.samples < out.time.size:
        stop = _next_stop(clock, controls, stops)
        h = min(clock.next_step, controls.longest)
        reach = 1.0 if clock.resumed_step > 0.0 else 1.0001  # a step beyond an onset would be rejected again
        if clock.time + reach * h >= stop:
            h = stop - clock.time
        last = h >= stop - clock.time
        if counts.steps + counts.rejected > controls.max_steps:
            counts.status = Ended.TOO_MANY
        if not _try(model, clock, h, last, controls, counts):
            counts.rejected += 1
            continue
        _accept(model, clock, stop if last else clock.time + h, stop, controls, out, counts)
        if controls.fixed:
            clock.next_step = controls.first_step
        else:
            clock.next_step = max(h * min(5.0, max(0.2, SAFETY * max(clock.error, 1e-6) ** -ORDER)), clock.resumed_step)
            clock.resumed_step = 0.0


@inline
def _remember(tables, work, state, controls, counts):
    """Update onset speeds of contacts; return True if one closed or opened."""
    changed = False
    n = state.force.size
    for k in range(tables.forces.shape[0]):
        m = state.memory[k]
        if touches(tables, k):
            event = remember_onset(tables, state.start_reports, work.reports, k, m, controls, 0.0)
            changed = changed or (event != 0 and (controls.located or not begins_smoothly(tables, k)))
            if event > 0:
                counts.onsets += 1
            elif event < 0:
                state.new[2 * n + k] = 0.0
        m[Memory.SLIDING] = work.reports[k, Report.SLIP]
    return changed


@inline
def _write(state, out, counts, t, before):
    """Write the state as a row, with bristles of this time."""
    n, i = state.force.size, counts.samples
    counts.samples += 1
    out.time[i] = t
    for j in range(n):
        out.q[i, j], out.v[i, j], out.a[i, j] = state.y[j], state.y[n + j], state.rates[0, n + j]
    copy(state.lam, out.lam[i])
    for k in range(state.memory.shape[0]):
        m = out.memory[i, k]
        m[Memory.ONSET], m[Memory.BRISTLE] = state.memory[k, Memory.ONSET], state.y[2 * n + k]
        m[Memory.SLIDING], m[Memory.STEP_START] = 0.0, t
