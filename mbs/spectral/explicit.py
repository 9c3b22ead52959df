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
def _has_changed(tables, flight):
    """Return True if the matrix differs from the one factored last: by modal links, or by gradients of constraints."""
    changed = (tables.modal.shape[0] > 0 and flight.apart[0] == 0) or flight.begun[0] == 0
    for i in range(flight.jacobian.size):
        changed = changed or flight.jacobian[i] != flight.factored[i]
        flight.factored[i] = flight.jacobian[i]
    return changed


@draft
def rates_at(model, t, y, out):
    """Compute the rates of a state: velocities, accelerations, rates of bristles."""
    tables, order, work, flight = model.tables, model.order, model.work, model.flight
    n, r = flight.force.size, flight.lam.size
    q, v = y[:n], y[n : 2 * n]
    for k in range(tables.forces.shape[0]):
        flight.memory[k, Memory.BRISTLE] = y[2 * n + k]
    for m in range(tables.markers.shape[0]):
        place_marker(tables, work, m, q, v, False)
    for i in range(n):
        flight.right[i] = tables.factors[-1] * tables.weight[i]
    if tables.strips.shape[0] > 0:
        add_strips(tables, work, q, v, flight.right)
    if tables.modal.shape[0] > 0:
        add_modal(tables, q, v, flight.right)
    now = Instant(t, -1.0, q, v, flight.lam, flight.memory)
    for k in range(tables.forces.shape[0]):
        add_one(tables, work, k, now, flight.right)
    for k in range(r):
        row_at(tables, work, k, t, flight.residual, flight.jacobian, flight.speed)
        change_at(tables, work, k, t, AFTER, flight.change)
        flight.right[n + k] = flight.change[k]
    if _has_changed(tables, flight):
        if flight.apart[0] > 0:
            renew_rows(tables, flight.jacobian, flight.matrix)
        else:
            renew_mass(tables, work, q, flight.jacobian, flight.matrix)
        factor(order, flight.matrix, flight.factors, flight.swaps, flight.amount)
        flight.begun[0] = 1
    solve(order, flight.factors, flight.swaps, flight.right, flight.part)
    if flight.apart[0] > 0:
        couple_modes(tables, work, q, flight.right)
    for i in range(n):
        out[i], out[n + i] = v[i], flight.right[i]
    for k in range(r):
        flight.lam[k] = flight.right[n + k]
    for k in range(tables.forces.shape[0]):
        kind, law = tables.forces[k, Forces.KIND], tables.forces[k, Forces.FRICTION]
        out[2 * n + k] = 0.0
        if law >= 0 and (kind == ForceKind.SEAT or (kind == ForceKind.JOURNAL and work.reports[k, Report.LENGTH] > 0.0)):
            out[2 * n + k] = bristle_rate(tables, law, y[2 * n + k], work.reports[k, Report.SLIP])


@jit
def fill_accelerations(model, out):
    """Fill in accelerations and multipliers at the states of out."""
    flight = model.flight
    n = flight.force.size
    for i in range(out.time.size):
        for j in range(n):
            flight.trial[j], flight.trial[n + j] = out.q[i, j], out.v[i, j]
        for k in range(model.tables.forces.shape[0]):
            flight.memory[k, Memory.ONSET] = out.memory[i, k, Memory.ONSET]
            flight.trial[2 * n + k] = out.memory[i, k, Memory.BRISTLE]
        rates_at(model, out.time[i], flight.trial, flight.rates[1])
        for j in range(n):
            out.a[i, j] = flight.rates[1, n + j]
        copy(flight.lam, out.lam[i])


@inline
def _is_off(tables, flight, allowed):
    """Return True if the new state violates its constraints by more than is allowed, in units of coordinates and their rates."""
    n, worst = flight.force.size, 0.0
    for k in range(flight.lam.size):
        slip = row_times(tables, k, flight.jacobian, flight.new[n : 2 * n]) - flight.speed[k]
        worst = max(worst, abs(flight.residual[k]), abs(slip) / flight.pace[0])
    return worst > allowed * flight.units.min()


@inline
def _put_back(tables, order, flight):
    """Project the new state onto the constraints, positions by one Newton step in the metric of the mass, then velocities."""
    n, r = flight.force.size, flight.lam.size
    for level in range(2):
        y = flight.new[level * n : level * n + n]
        flight.right[:] = 0.0
        for k in range(r):
            flight.right[n + k] = flight.residual[k] if level == 0 else row_times(tables, k, flight.jacobian, y) - flight.speed[k]
        solve(order, flight.factors, flight.swaps, flight.right, flight.part)
        for i in range(n):
            y[i] -= flight.right[i]


@inline
def _stages(model, t, h):
    """Compute the seven stages; flight.new becomes the solution of fifth order, and reports are those of its end."""
    flight = model.flight
    for stage in range(1, 7):
        target, f, c = flight.new if stage == 6 else flight.trial, flight.rates, WEIGHTS[stage]
        for i in range(flight.y.size):  # in one sum with zero weights: rates are finite, see _try
            target[i] = flight.y[i] + h * (
                c[0] * f[0, i] + c[1] * f[1, i] + c[2] * f[2, i] + c[3] * f[3, i] + c[4] * f[4, i] + c[5] * f[5, i]
            )
        rates_at(model, t + NODES[stage] * h, target, flight.rates[stage])


@inline
def _error(flight, h, tolerance):
    """Embedded error over the tolerance: of coordinates in their units, of rates in units times the largest rate so far."""
    n, worst = flight.force.size, 0.0
    for i in range(2 * n):
        e = 0.0
        for j in range(7):
            e += ERRORS[j] * flight.rates[j, i]
        share = abs(h * e) / (flight.units[i] if i < n else flight.units[i - n] * flight.pace[0])
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
    flight = model.flight
    _stages(model, clock.time, h * (1.0 - 1e-15) if last else h)
    counts.iterations += 6
    clock.error = error = _error(flight, h, controls.tolerance)
    if not error <= 1.0 and not (controls.fixed and error < 1e300):
        clock.wanted = h * (max(0.2, SAFETY * error**-ORDER) if error < 1e300 else 0.2)
        if not error < 1e300:
            flight.rates[1:] = 0.0
        if clock.wanted < controls.shortest:
            counts.status = Ended.UNDERFLOW if error < 1e300 else Ended.NOT_FINITE
        return False
    landing = max(1e-3 * controls.tolerance, 1e-12) * flight.units.max()
    first = first_onset(model.tables, flight.before, model.work.reports, h, landing, 0.0, controls.located)
    if first < 1.0 and h * first > controls.shortest:
        clock.held, clock.wanted = max(clock.held, h), h * first
        return False
    return True


@draft
def _accept(model, clock, at, stop, controls, out, counts):
    """Accept a step to the time `at`: project it onto the constraints, and write its row."""
    tables, order, work, flight = model.tables, model.order, model.work, model.flight
    n, before, clock.time = flight.force.size, clock.time, at
    changed = _remember(tables, work, flight, controls, counts)
    off = _is_off(tables, flight, MOST_GAP * controls.tolerance)
    if off:
        _put_back(tables, order, flight)
    if off or changed or at == stop:
        copy(flight.new, flight.y)
        rates_at(model, at, flight.y, flight.rates[0])
    else:
        for i in range(flight.y.size):
            flight.y[i], flight.rates[0, i] = flight.new[i], flight.rates[6, i]
    for i in range(n):
        flight.pace[0] = max(flight.pace[0], abs(flight.y[n + i]) / flight.units[i])
    copy(work.reports, flight.before)
    counts.steps += 1
    clock.skipped += 1
    if clock.skipped >= controls.every or changed or at >= controls.end - controls.shortest:
        _write(flight, out, counts, at, before)
        clock.skipped = 0


@jit
def run_explicit(model, clock, controls, stops, out, counts):
    """Integrate from the state to the end, or until out is full; as `run_implicit`."""
    flight = model.flight
    counts.samples = 0
    if counts.steps == 0:
        rates_at(model, clock.time, flight.y, flight.rates[0])
        copy(model.work.reports, flight.before)
        _write(flight, out, counts, clock.time, clock.time)
    while clock.time < controls.end - controls.shortest and counts.status == Ended.OK and counts.samples < out.time.size:
        stop = _next_stop(clock, controls, stops)
        h = min(clock.wanted, controls.longest)
        reach = 1.0 if clock.held > 0.0 else 1.0001  # a step beyond an onset would be rejected again
        if clock.time + reach * h >= stop:
            h = stop - clock.time
        last = h >= stop - clock.time
        if counts.steps + counts.rejected > controls.budget:
            counts.status = Ended.TOO_MANY
        if not _try(model, clock, h, last, controls, counts):
            counts.rejected += 1
            continue
        _accept(model, clock, stop if last else clock.time + h, stop, controls, out, counts)
        if controls.fixed:
            clock.wanted = controls.first_step
        else:
            clock.wanted = max(h * min(5.0, max(0.2, SAFETY * max(clock.error, 1e-6) ** -ORDER)), clock.held)
            clock.held = 0.0


@inline
def _remember(tables, work, flight, controls, counts):
    """Update onset speeds of contacts; return True if one closed or opened."""
    changed = False
    n = flight.force.size
    for k in range(tables.forces.shape[0]):
        m = flight.memory[k]
        if touches(tables, k):
            event = remember_onset(tables, flight.before, work.reports, k, m, controls, 0.0)
            changed = changed or (event != 0 and (controls.located or not begins_smoothly(tables, k)))
            if event > 0:
                counts.onsets += 1
            elif event < 0:
                flight.new[2 * n + k] = 0.0
        m[Memory.SLIDING] = work.reports[k, Report.SLIP]
    return changed


@inline
def _write(flight, out, counts, t, before):
    """Write the state as a row, with bristles of this time."""
    n, i = flight.force.size, counts.samples
    counts.samples += 1
    out.time[i] = t
    for j in range(n):
        out.q[i, j], out.v[i, j], out.a[i, j] = flight.y[j], flight.y[n + j], flight.rates[0, n + j]
    copy(flight.lam, out.lam[i])
    for k in range(flight.memory.shape[0]):
        m = out.memory[i, k]
        m[Memory.ONSET], m[Memory.BRISTLE] = flight.memory[k, Memory.ONSET], flight.y[2 * n + k]
        m[Memory.SLIDING], m[Memory.FASTEST] = 0.0, t
