"""Dormand-Prince 5(4), compiled, for mechanisms that rattle: onsets located, constraints solved at the level of accelerations.

    a = M^-1 (f - G^T lambda),   (G M^-1 G^T) lambda = G M^-1 f - change.

M^-1 is kept (modal links' own part is taken out by a small solve). Bodies that constraints and a drive hold from the ground move
exactly as the drive says, as positions and velocities are put back onto the constraints after each step. Bristles are states.

References
----------
J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26, doi 10.1016/0771-050X(80)90013-3.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.spectral.compiling import borrowed, inner, jit, lend_tables, lend_work
from buckler.mbs.spectral.implicit import (
    BUDGET,
    COUNTERS,
    EVERY,
    FIRST_STEP,
    FIXED_STEPS,
    FLOOR,
    GRAZE,
    ITERATIONS,
    LONGEST,
    NOT_FINITE,
    ONSETS,
    REJECTED,
    SAMPLES,
    STATUS,
    STEPS,
    TOLERANCE,
    TOO_MANY,
    UNDERFLOW,
    Output,
    crossing,
    depth_of,
    lend_output,
    rate_of_depth,
)  # fmt: skip
from buckler.mbs.spectral.kernel import constraints, forces, mass_matrix, solve_small, spread_rows
from buckler.mbs.spectral.lawtable import bristle_rate
from buckler.mbs.spectral.tables import BRISTLE, CONTACT, FASTEST, FRICTION_OF, JOURNAL, ONSET, SEAT, SLIDING

Array = np.ndarray[Any, Any]
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
ERRORS = np.array([71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0])


class Flight(NamedTuple):
    """State y = (q, v, bristles), its seven rates, and room to work in."""

    y: Array
    new: Array
    trial: Array
    rates: Array
    lam: Array
    force: Array
    residual: Array
    speed: Array
    change: Array
    jacobian: Array
    inverse: Array
    spread: Array
    schur: Array
    right: Array
    mass: Array
    none: Array
    memory: Array
    before: Array
    pace: Array
    units: Array


def flight_for(q: Array, v: Array, lam: Array, memory: Array, mass: Array, units: Array) -> Flight:
    """Make room for a run from this state."""
    n, r, k = len(q), len(lam), len(memory)
    y = np.concatenate([q, v, memory[:, BRISTLE]])
    pace = np.array([max(1e-3, np.abs(v / units).max(initial=0.0))])
    return Flight(
        y, y.copy(), y.copy(), np.zeros((7, len(y))), np.array(lam, dtype=float), np.zeros(n), np.zeros(r), np.zeros(r),
        np.zeros(r), np.zeros((r, n)), np.linalg.inv(mass), np.zeros((r, n)), np.zeros((r, r)), np.zeros(n + r), mass.copy(),
        np.zeros((1, 1)), memory.copy(), np.zeros((k, 8)), pace, np.array(units, dtype=float),
    )  # fmt: skip


@inner
def _lend(x):
    """The room without its shares in the memory's reference counts."""
    return Flight(
        borrowed(x.y), borrowed(x.new), borrowed(x.trial), borrowed(x.rates), borrowed(x.lam), borrowed(x.force),
        borrowed(x.residual), borrowed(x.speed), borrowed(x.change), borrowed(x.jacobian), borrowed(x.inverse),
        borrowed(x.spread), borrowed(x.schur), borrowed(x.right), borrowed(x.mass), borrowed(x.none), borrowed(x.memory),
        borrowed(x.before), borrowed(x.pace), borrowed(x.units),
    )  # fmt: skip


@inner
def rates_at(s, w, x, t, y, out):
    """Rates of a state: velocities, accelerations, bristles'."""
    n, r = x.force.size, x.lam.size
    q, v = y[:n], y[n : 2 * n]
    for k in range(s.forces.shape[0]):
        x.memory[k, BRISTLE] = y[2 * n + k]
    forces(s, w, t, q, v, x.lam, x.memory, -1.0, x.force, x.none, x.none, x.none, False)
    if s.modal.shape[0] > 0:
        mass_matrix(s, q, x.mass)
        x.inverse[:] = np.linalg.inv(x.mass)
    for i in range(n):
        total = 0.0
        for j in range(n):
            total += x.inverse[i, j] * x.force[j]
        out[i], out[n + i] = v[i], total
    if r > 0:
        constraints(s, w, t, x.residual, x.jacobian, x.speed, x.change)
        spread_rows(x.jacobian, x.inverse, x.spread, x.schur)
        for k in range(r):
            total = -x.change[k]
            for i in range(n):
                total += x.jacobian[k, i] * out[n + i]
            x.right[k] = total
        solve_small(x.schur, x.right, r)
        for k in range(r):
            x.lam[k] = x.right[k]
            for i in range(n):
                out[n + i] -= x.spread[k, i] * x.right[k]
    for k in range(s.forces.shape[0]):
        kind, law = s.forces[k, 0], s.forces[k, FRICTION_OF]
        out[2 * n + k] = 0.0
        if law >= 0 and (kind == SEAT or (kind == JOURNAL and w.reports[k, 2] > 0.0)):
            out[2 * n + k] = bristle_rate(s, law, y[2 * n + k], w.reports[k, 4])


@inner
def _put_back(s, w, x, t):
    """Move the new state onto the constraints, positions by one Newton step in the metric of the mass, then velocities."""
    n, r = x.force.size, x.lam.size
    if r == 0:
        return
    y = x.new
    for level in range(2):
        if level == 0:
            for k in range(r):
                x.right[k] = x.residual[k]
        else:
            for k in range(r):
                x.right[k] = -x.speed[k]
                for i in range(n):
                    x.right[k] += x.jacobian[k, i] * y[n + i]
        spread_rows(x.jacobian, x.inverse, x.spread, x.schur)
        solve_small(x.schur, x.right, r)
        for k in range(r):
            for i in range(n):
                y[level * n + i] -= x.spread[k, i] * x.right[k]


@inner
def _stages(s, w, x, t, h):
    """The seven stages; x.new becomes the fifth-order solution, and reports are those of its end."""
    for stage in range(1, 7):
        target = x.new if stage == 6 else x.trial
        for i in range(x.y.size):
            total = 0.0
            for j in range(stage):
                total += WEIGHTS[stage, j] * x.rates[j, i]
            target[i] = x.y[i] + h * total
        rates_at(s, w, x, t + NODES[stage] * h, target, x.rates[stage])


@inner
def _error(x, h, tolerance):
    """Embedded error over what is allowed: of coordinates, in their units, and of rates, in units a largest rate so far."""
    n, worst = x.force.size, 0.0
    for i in range(2 * n):
        e = 0.0
        for j in range(7):
            e += ERRORS[j] * x.rates[j, i]
        worst = max(worst, abs(h * e) / (x.units[i] if i < n else x.units[i - n] * x.pace[0]))
    return worst / tolerance


@jit
def run_explicit(s, w, x, clock, end, stops, controls, out, counts):
    """Go on from the state to the end, or until out is full; as `run_implicit`."""
    s, w, x, out = lend_tables(s), lend_work(w), _lend(x), lend_output(out)
    t, wanted, held, skipped = clock[0], clock[1], clock[2], int(clock[5])
    tolerance, fixed, n = controls[TOLERANCE], controls[FIXED_STEPS] > 0.0, x.force.size
    shortest, landing = 1e-15 * end, 1e-3 * tolerance * x.units.max()
    row, every, nstop = 0, int(controls[EVERY]), 0
    if counts[STEPS] == 0:
        rates_at(s, w, x, t, x.y, x.rates[0])
        x.before[:] = w.reports
        _write(x, out, 0, t, t)
        row = 1
    while t < end - shortest and counts[STATUS] == 0 and row < out.time.size:
        while nstop < stops.size and stops[nstop] <= t + shortest:
            nstop += 1
        target = min(end, stops[nstop]) if nstop < stops.size else end
        h = min(wanted, controls[LONGEST])
        if t + 1.0001 * h >= target:
            h = target - t
        _stages(s, w, x, t, h * (1.0 - 1e-15) if h >= target - t else h)
        counts[ITERATIONS] += 6
        error = _error(x, h, tolerance)
        if counts[STEPS] + counts[REJECTED] > controls[BUDGET]:
            counts[STATUS] = TOO_MANY
        if not error <= 1.0 and not (fixed and error < 1e300):
            counts[REJECTED] += 1
            wanted = h * (max(0.2, 0.9 * error**-0.2) if error < 1e300 else 0.2)
            if wanted < shortest:
                counts[STATUS] = UNDERFLOW if error < 1e300 else NOT_FINITE
            continue
        first = 2.0
        for k in range(s.forces.shape[0]):
            kind = s.forces[k, 0]
            if kind == CONTACT or kind == JOURNAL:
                d0, d1 = depth_of(s, x.before, k), depth_of(s, w.reports, k)
                if d0 < -landing and not (-landing <= d1 <= landing):
                    first = min(first, crossing(h, d0, rate_of_depth(s, x.before, k), d1, rate_of_depth(s, w.reports, k)))
        if first < 1.0 and h * first > shortest:
            counts[REJECTED] += 1
            held = max(held, h)
            wanted = h * first
            continue
        before, t = t, (target if h >= target - t else t + h)
        changed = _remember(s, w, x, controls[FLOOR], controls[GRAZE], counts)
        _put_back(s, w, x, t)
        if x.lam.size > 0 or changed or t == target:
            x.y[:] = x.new
            rates_at(s, w, x, t, x.y, x.rates[0])
        else:
            for i in range(x.y.size):
                x.y[i], x.rates[0, i] = x.new[i], x.rates[6, i]
        for i in range(n):
            x.pace[0] = max(x.pace[0], abs(x.y[n + i]) / x.units[i])
        x.before[:] = w.reports
        counts[STEPS] += 1
        skipped += 1
        if skipped >= every or changed or t >= end - shortest:
            _write(x, out, row, t, before)
            row, skipped = row + 1, 0
        if not fixed:
            wanted = max(h * min(5.0, max(0.2, 0.9 * max(error, 1e-6) ** -0.2)), held)
            held = 0.0
        else:
            wanted = controls[FIRST_STEP]
    clock[0], clock[1], clock[2], clock[5] = t, wanted, held, skipped
    counts[SAMPLES] = row


@inner
def _remember(s, w, x, floor, graze, counts):
    """Onset speeds of contacts that are about to close or have just closed; whether one has changed."""
    changed = False
    n = x.force.size
    for k in range(s.forces.shape[0]):
        kind, m = s.forces[k, 0], x.memory[k]
        if kind == CONTACT or kind == JOURNAL:
            old, new, rate = depth_of(s, x.before, k), depth_of(s, w.reports, k), rate_of_depth(s, w.reports, k)
            if new <= 0.0 or old <= 0.0:
                m[ONSET] = max(rate, floor, graze * m[FASTEST])
            if new > 0.0 and old <= 0.0:
                if kind == CONTACT:
                    m[FASTEST] = max(m[FASTEST], m[ONSET])
                counts[ONSETS] += 1
                changed = True
            if new <= 0.0 and old > 0.0:
                changed = True
                x.new[2 * n + k] = 0.0
        m[SLIDING] = w.reports[k, 4]
    return changed


@inner
def _write(x, out, i, t, before):
    """Write the state as row i; bristles as they stand, with no time since."""
    n = x.force.size
    out.time[i] = t
    out.q[i], out.v[i], out.a[i], out.lam[i] = x.y[:n], x.y[n : 2 * n], x.rates[0, n : 2 * n], x.lam
    out.memory[i, :, ONSET] = x.memory[:, ONSET]
    out.memory[i, :, BRISTLE] = x.y[2 * n :]
    out.memory[i, :, SLIDING] = 0.0
    out.memory[i, :, FASTEST] = t


assert COUNTERS > ONSETS
assert Output._fields[0] == "time"
