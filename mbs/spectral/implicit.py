"""Generalized-alpha on the index-3 equations, compiled: variable steps, onsets located, velocities held on the constraints.

    q1 = q + h v + h^2 ((1/2 - beta) b + beta b1),   v1 = v + h ((1 - gamma) b + gamma b1),
    (1 - am) b1 + am b = (1 - af) a1 + af a,         M a1 = f - G^T lambda1,   g(q1, t1) = 0,

then v1 and a1 are moved by M^-1 G^T mu onto G v = dg/dt and G a = the like of the drives. So a wrong acceleration dies out by
(1/2 - beta)/beta a step, whatever the steps do.

The local error of q1 is (beta - 1/6) h^3 q''' to leading order; it is taken from q1 - q - h (v + v1)/2 = -h^3 q'''/12, in which
accelerations, and so the slow decay of their errors, do not appear. Steps follow the largest of the last ones, so that they stay
while a vibration passes through zero: a step of the same length costs no new inverse.

References
----------
J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371-375, doi 10.1115/1.2900803.
M. Arnold, O. Bruels, Convergence of the generalized-alpha scheme for constrained mechanical systems, Multibody System Dynamics 18
(2007) 185-202, doi 10.1007/s11044-007-9084-0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from buckler.mbs.spectral.compiling import borrowed, inner, jit, lend_tables, lend_work
from buckler.mbs.spectral.forces import add_forces
from buckler.mbs.spectral.kernel import (
    add_mass_slope,
    add_multipliers,
    constraints,
    forces,
    mass_matrix,
    solve_small,
    spread_rows,
)
from buckler.mbs.spectral.markers import place_markers
from buckler.mbs.spectral.tables import BRISTLE, CONTACT, FASTEST, JOURNAL, NUMBERS, ONSET, SEAT, SLIDING

Array = np.ndarray[Any, Any]
OK, UNDERFLOW, NOT_FINITE, TOO_MANY = 0, 1, 2, 3
STATUS, STEPS, REJECTED, JACOBIANS, ITERATIONS, SAMPLES, ONSETS, COUNTERS = 0, 1, 2, 3, 4, 5, 6, 8
"""Places in the counts."""
TOLERANCE, RADIUS, LONGEST, FIRST_STEP, BUDGET, FLOOR, GRAZE, CONTACT_TOLERANCE, FIXED_STEPS, CLOSE, EVERY, CONTROLS = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
    9,
    10,
    11,
)
"""Places in the controls: local error allowed, spectral radius at infinity, longest and first step, most steps, slowest onset
speed, share of the fastest approach below which onsets are not taken apart, local error allowed of the depth of a contact,
1 for steps that do not vary, size of the last Newton step over the local error allowed, how
many steps to a row."""
MOST = 10
"""Newton iterations."""
ROUNDING = 1e-13
"""A Newton step below this, of the coordinates' whole units, can grow no smaller."""
SHARE = 100.0
"""The tolerance of inner coordinates of strips and modes is relative to so many times their largest deformation so far."""


class Room(NamedTuple):
    """State, new state and room to work in; see the equations above. `scale` holds the units of coordinates."""

    q: Array
    v: Array
    a: Array
    b: Array
    lam: Array
    q1: Array
    v1: Array
    a1: Array
    b1: Array
    lam1: Array
    force: Array
    residual: Array
    speed: Array
    change: Array
    jacobian: Array
    stiffness: Array
    damping: Array
    cross: Array
    mass: Array
    matrix: Array
    inverse: Array
    right: Array
    memory: Array
    before: Array
    da: Array
    dlam: Array
    largest: Array
    past: Array
    light: Array
    spread: Array
    schur: Array
    rest: Array
    whole: Array
    amount: Array
    units: Array


class Output(NamedTuple):
    """What a run leaves of each step: time, coordinates, rates, second rates, multipliers; of each force its onset speed, bristle
    and sliding speed at the step before, and that step's time.
    """

    time: Array
    q: Array
    v: Array
    a: Array
    lam: Array
    memory: Array


def room_for(q: Array, v: Array, a: Array, lam: Array, memory: Array, mass: Array, units: Array) -> Room:
    """Make room for a run from this state."""
    n, r, k = len(q), len(lam), len(memory)
    vectors = [np.array(x, dtype=float) for x in (q, v, a, a, lam)]
    return Room._make((
        *vectors, *(x.copy() for x in vectors), np.zeros(n), np.zeros(r), np.zeros(r), np.zeros(r), np.zeros((r, n)),
        np.zeros((n, n)), np.zeros((n, n)), np.zeros((r, n)), np.zeros((n, n)), np.zeros((n + r, n + r)),
        np.zeros((n + r, n + r)), np.zeros(n + r), memory.copy(), np.zeros((k, 8)), np.zeros(n), np.zeros(r), np.zeros(k),
        memory[:, 1:3].copy(), np.linalg.inv(mass), np.zeros((r, n)), np.zeros((r, r)), np.array(q),
        np.array(units, dtype=float), np.zeros(n), np.array(units, dtype=float),
    ))  # fmt: skip


def output_for(rows: int, n: int, r: int, k: tuple[int, ...]) -> Output:
    """Make room for what so many steps leave of n coordinates, r multipliers, memories of shape k."""
    q, v, a = (np.zeros((rows, n)) for _ in range(3))
    return Output(np.zeros(rows), q, v, a, np.zeros((rows, r)), np.zeros((rows, *k)))


@inner
def lend_output(out):
    """The same without its shares in the memory's reference counts."""
    return Output(borrowed(out.time), borrowed(out.q), borrowed(out.v), borrowed(out.a), borrowed(out.lam), borrowed(out.memory))


@inner
def _coefficients(radius, h):
    """Of the method at this radius and step: am, af, gamma, beta, and derivatives of a1 and v1 by q1."""
    am, af = (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0)
    gamma = 0.5 - am + af
    beta = 0.25 * (gamma + 0.5) ** 2
    return am, af, gamma, beta, (1.0 - am) / (h * h * beta * (1.0 - af)), gamma / (h * beta)


@inner
def _predict(x, h, ratio, am, af, gamma, beta):
    """First guess of the new state: accelerations go on as in the last step, `ratio` times as long."""
    for i in range(x.q.size):
        x.a1[i] = x.a[i] + ratio * x.da[i]
        b1 = ((1.0 - af) * x.a1[i] + af * x.a[i] - am * x.b[i]) / (1.0 - am)
        x.q1[i] = x.q[i] + h * x.v[i] + h * h * ((0.5 - beta) * x.b[i] + beta * b1)
        x.v1[i] = x.v[i] + h * ((1.0 - gamma) * x.b[i] + gamma * b1)
    for k in range(x.lam.size):
        x.lam1[k] = x.lam[k] + ratio * x.dlam[k]


@inner
def _factorise(s, w, x, by_a, by_v):
    """Invert the Newton matrix at the present iterate, in units in which its parts are alike."""
    n, r = x.q.size, x.lam.size
    add_multipliers(s, w, x.q1, x.lam1, x.stiffness)
    if s.modal.shape[0] > 0:
        add_mass_slope(s, x.q1, x.a1, x.stiffness)
    for i in range(n):
        for j in range(n):
            x.matrix[i, j] = x.mass[i, j] + (by_v * x.damping[i, j] + x.stiffness[i, j]) / by_a
        for k in range(r):
            x.matrix[i, n + k] = x.jacobian[k, i] - x.cross[k, i]
            x.matrix[n + k, i] = x.jacobian[k, i]
    for i in range(r):
        for j in range(r):
            x.matrix[n + i, n + j] = 0.0
    x.inverse[:] = np.linalg.inv(x.matrix)


@inner
def _newton(s, w, x, t, h, before, radius, close, fresh, counts):
    """Solve for the new state; returns 0 if it converged, 1 if not; the inverse is renewed where it contracts too slowly."""
    n, r = x.q.size, x.lam.size
    am, af, gamma, beta, by_a, by_v = _coefficients(radius, h)
    _predict(x, h, h / before if before > 0.0 else 0.0, am, af, gamma, beta)
    last, renewed = 1e300, False
    for iteration in range(MOST):
        renew = fresh and not renewed
        forces(s, w, t, x.q1, x.v1, x.lam1, x.memory, h, x.force, x.stiffness, x.damping, x.cross, renew)
        constraints(s, w, t, x.residual, x.jacobian, x.speed, x.change)
        if s.modal.shape[0] > 0:
            mass_matrix(s, x.q1, x.mass)
        if renew:
            _factorise(s, w, x, by_a, by_v)
            counts[JACOBIANS] += 1
            renewed = True
        x.right[:n] = x.mass @ x.a1
        for i in range(n):
            total = x.right[i] - x.force[i]
            for k in range(r):
                total += x.jacobian[k, i] * x.lam1[k]
            x.right[i] = total / by_a
        x.right[n:] = x.residual
        step = x.inverse @ x.right
        counts[ITERATIONS] += 1
        size, whole = 0.0, 0.0
        for i in range(n):
            size = max(size, abs(step[i]) / x.units[i])
            whole = max(whole, abs(step[i]) / x.whole[i])
            x.q1[i] -= step[i]
            x.v1[i] -= by_v * step[i]
            x.a1[i] -= by_a * step[i]
        for k in range(r):
            x.lam1[k] -= step[n + k] * by_a
        if not np.isfinite(size):
            return 1
        if size <= close or whole <= ROUNDING or (iteration > 0 and size * size / last <= 0.3 * close and size < 0.3 * last):
            return 0
        if iteration > 0 and size > 0.25 * last:
            if renewed and size > 0.9 * last:
                return 1
            fresh, renewed = True, False
        last = size
    return 1


@inner
def _project(s, x):
    """Move the new velocities and accelerations onto the constraints, with the least change in the metric of the mass.

    The constraints' directions are the present ones: with those of a kept Newton matrix the motion along them would be wrong.
    """
    n, r = x.q.size, x.lam.size
    if r == 0:
        return
    if s.modal.shape[0] > 0:
        x.light[:] = np.linalg.inv(x.mass)
    for k in range(r):
        slip, swing = -x.speed[k], -x.change[k]
        for i in range(n):
            slip += x.jacobian[k, i] * x.v1[i]
            swing += x.jacobian[k, i] * x.a1[i]
        x.speed[k], x.change[k] = slip, swing
    spread_rows(x.jacobian, x.light, x.spread, x.schur)
    solve_small(x.schur, x.speed, r)
    spread_rows(x.jacobian, x.light, x.spread, x.schur)
    solve_small(x.schur, x.change, r)
    for k in range(r):
        x.lam1[k] += x.change[k]
        for i in range(n):
            x.v1[i] -= x.spread[k, i] * x.speed[k]
            x.a1[i] -= x.spread[k, i] * x.change[k]


@inner
def _grow_units(x, elastic):
    """Take the largest deformation so far as the unit of a strip's or mode's inner coordinates."""
    for k in range(elastic.shape[0]):
        i, j, group = elastic[k]
        size = abs(x.q[i] - x.rest[i]) if j < 0 else abs(np.hypot(x.q[i], x.q[j]) - np.hypot(x.rest[i], x.rest[j]))
        x.amount[group] = max(x.amount[group], size)
    for k in range(elastic.shape[0]):
        i, j, group = elastic[k]
        x.units[i] = min(x.whole[i], max(1e-6 * x.whole[i], SHARE * x.amount[group]))
        if j >= 0:
            x.units[j] = x.units[i]


@inner
def _error(s, w, x, h, tolerance, contact_tolerance):
    """Embedded error over what is allowed: of the coordinates, and of the depths of contacts that are closed."""
    worst = 0.0
    for i in range(x.q.size):
        e = 1.5 * (x.q1[i] - x.q[i] - 0.5 * h * (x.v[i] + x.v1[i]))
        worst = max(worst, abs(e) / x.units[i])
    worst /= tolerance
    for k in range(s.forces.shape[0]):
        kind = s.forces[k, 0]
        if kind == CONTACT or kind == JOURNAL:
            old, new = depth_of(s, x.before, k), depth_of(s, w.reports, k)
            deep = max(old, new)
            if deep > 0.0:
                rate = rate_of_depth(s, w.reports, k)
                before = rate_of_depth(s, x.before, k)
                # error of the depth: that of the cubic through both ends' depths and rates against the trapezium
                e = abs(new - old - 0.5 * h * (rate + before)) / 3.0
                worst = max(worst, e / (contact_tolerance * max(deep, h * max(abs(rate), abs(before)))))
    return worst


@inner
def _lets_go(s, w, x, share):
    """Whether a contact that pushed with more than a share of its largest force so far pushes no more: a kink to be cut out."""
    for k in range(s.forces.shape[0]):
        kind = s.forces[k, 0]
        if (kind == CONTACT or kind == JOURNAL) and w.reports[k, 0] == 0.0:
            if abs(x.before[k, 0]) > share * x.largest[k]:
                return True
    return False


@inner
def depth_of(s, reports, k):
    """Depth of contact k, from its report."""
    if s.forces[k, 0] == JOURNAL:
        return reports[k, 2]
    side, face = s.data[s.forces[k, NUMBERS]], s.data[s.forces[k, NUMBERS] + 1]
    return side * (reports[k, 2] - face)


@inner
def rate_of_depth(s, reports, k):
    """Its rate."""
    return reports[k, 3] if s.forces[k, 0] == JOURNAL else s.data[s.forces[k, NUMBERS]] * reports[k, 3]


@inner
def hermite(x, h, d0, v0, d1, v1):
    """Cubic with these values and slopes at the ends of a step of length h, at the fraction x."""
    return (1.0 - x) ** 2 * ((1.0 + 2.0 * x) * d0 + x * h * v0) + x * x * ((3.0 - 2.0 * x) * d1 + (x - 1.0) * h * v1)


@inner
def crossing(h, d0, v0, d1, v1):
    """First fraction of the step at which the cubic, negative at its start, passes zero; 2 if it does not."""
    high = 2.0
    if d1 > 0.0:
        high = 1.0
    elif v0 > 0.0 and v1 < 0.0:
        # both ends outside, in between perhaps inside: look at the top
        a, b = 0.0, 1.0
        for _ in range(40):
            m1, m2 = a + (b - a) / 3.0, b - (b - a) / 3.0
            if hermite(m1, h, d0, v0, d1, v1) < hermite(m2, h, d0, v0, d1, v1):
                a = m1
            else:
                b = m2
        if hermite(0.5 * (a + b), h, d0, v0, d1, v1) > 0.0:
            high = 0.5 * (a + b)
    if high > 1.0:
        return 2.0
    low = 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if hermite(middle, h, d0, v0, d1, v1) > 0.0:
            high = middle
        else:
            low = middle
    return high


@inner
def _first_onset(s, w, x, h, landing):
    """Fraction of the step at which the first open contact closes, and which; 2 if none does."""
    first, which = 2.0, -1
    for k in range(s.forces.shape[0]):
        kind = s.forces[k, 0]
        if kind != CONTACT and kind != JOURNAL:
            continue
        d0, d1 = depth_of(s, x.before, k), depth_of(s, w.reports, k)
        if d0 < -landing and not (-landing <= d1 <= landing):
            at = crossing(h, d0, rate_of_depth(s, x.before, k), d1, rate_of_depth(s, w.reports, k))
            if at < first:
                first, which = at, k
    return first, which


@inner
def _remember(s, w, x, floor, graze, counts):
    """Take over the accepted step: onset speeds of contacts that are about to close or have just closed, bristles."""
    changed = False
    for k in range(s.forces.shape[0]):
        kind, m = s.forces[k, 0], x.memory[k]
        x.past[k, 0], x.past[k, 1] = m[BRISTLE], m[SLIDING]
        x.largest[k] = max(x.largest[k], abs(w.reports[k, 0]))
        if kind == CONTACT or kind == JOURNAL:
            old, new, rate = depth_of(s, x.before, k), depth_of(s, w.reports, k), rate_of_depth(s, w.reports, k)
            if new <= 0.0 or old <= 0.0:
                m[ONSET] = max(rate, floor, graze * m[FASTEST])
            if new > 0.0 and old <= 0.0 and kind == CONTACT:
                m[FASTEST] = max(m[FASTEST], m[ONSET])
            if new > 0.0 and old <= 0.0:
                counts[ONSETS] += 1
                changed = True
            if new <= 0.0 and old > 0.0:
                changed = True
        if kind == JOURNAL or kind == SEAT:
            m[BRISTLE], m[SLIDING] = w.reports[k, 5], w.reports[k, 4]
    return changed


@inner
def write(x, out, i, t, before):
    """Write the present state as row i; bristles and sliding speeds are those of the step before, at time `before`."""
    out.time[i] = t
    out.q[i], out.v[i], out.a[i], out.lam[i] = x.q, x.v, x.a, x.lam
    out.memory[i, :, ONSET] = x.memory[:, ONSET]
    out.memory[i, :, FASTEST] = before
    out.memory[i, :, BRISTLE : SLIDING + 1] = x.past


@inner
def _take_over(s, x, h, radius):
    """Make the new state the present one."""
    am, af = _coefficients(radius, h)[:2]
    for i in range(x.q.size):
        x.da[i] = x.a1[i] - x.a[i]
        x.b[i] = ((1.0 - af) * x.a1[i] + af * x.a[i] - am * x.b[i]) / (1.0 - am)
        x.q[i], x.v[i], x.a[i] = x.q1[i], x.v1[i], x.a1[i]
    for k in range(x.lam.size):
        x.dlam[k] = x.lam1[k] - x.lam[k]
        x.lam[k] = x.lam1[k]


@inner
def _lend(x):
    """The room without its shares in the memory's reference counts."""
    return Room(
        borrowed(x.q), borrowed(x.v), borrowed(x.a), borrowed(x.b), borrowed(x.lam), borrowed(x.q1), borrowed(x.v1),
        borrowed(x.a1), borrowed(x.b1), borrowed(x.lam1), borrowed(x.force), borrowed(x.residual), borrowed(x.speed),
        borrowed(x.change), borrowed(x.jacobian), borrowed(x.stiffness), borrowed(x.damping), borrowed(x.cross),
        borrowed(x.mass), borrowed(x.matrix), borrowed(x.inverse), borrowed(x.right), borrowed(x.memory), borrowed(x.before),
        borrowed(x.da), borrowed(x.dlam), borrowed(x.largest),
        borrowed(x.past), borrowed(x.light), borrowed(x.spread), borrowed(x.schur), borrowed(x.rest),
        borrowed(x.whole), borrowed(x.amount), borrowed(x.units),
    )  # fmt: skip


@inner
def _restart(s, w, x, t):
    """Accelerations and multipliers anew, after a jump of them: from M a + G^T lambda = f, G a = change."""
    n, r = x.q.size, x.lam.size
    forces(s, w, t, x.q, x.v, x.lam, x.memory, 0.0, x.force, x.stiffness, x.damping, x.cross, False)
    constraints(s, w, t, x.residual, x.jacobian, x.speed, x.change)
    x.matrix[:] = 0.0
    x.matrix[:n, :n] = x.mass
    x.matrix[:n, n:] = x.jacobian.T
    x.matrix[n:, :n] = x.jacobian
    x.inverse[:] = np.linalg.inv(x.matrix)
    for i in range(n + r):
        total = 0.0
        for j in range(n):
            total += x.inverse[i, j] * x.force[j]
        for k in range(r):
            total += x.inverse[i, n + k] * x.change[k]
        if i < n:
            x.a[i], x.b[i], x.da[i] = total, total, 0.0
        else:
            x.lam[i - n], x.dlam[i - n] = total, 0.0
    x.before[:] = w.reports


@jit
def run_implicit(s, w, x, clock, end, stops, controls, out, counts):
    """Go on from the room's state to the end, or until out is full; stops are times at which a step must end.

    Every step is written to out, or every so many. The room and the clock are left as they are then, to go on from.
    """
    s, w, x, out = lend_tables(s), lend_work(w), _lend(x), lend_output(out)
    t, wanted, held, previous, made, skipped = clock[0], clock[1], clock[2], clock[3], clock[4], int(clock[5])
    tolerance, radius, fresh, fixed = controls[TOLERANCE], controls[RADIUS], True, controls[FIXED_STEPS] > 0.0
    shortest, landing = 1e-15 * end, 1e-2 * tolerance * x.whole.max()
    row, nstop, every = 0, 0, int(controls[EVERY])
    if counts[STEPS] == 0:
        begin(s, w, x, t)
        write(x, out, 0, t, t)
        row = 1
    while t < end - shortest and counts[STATUS] == OK and row < out.time.size:
        while nstop < stops.size and stops[nstop] <= t + shortest:
            if stops[nstop] > t - shortest and not fixed:
                wanted, held, previous, fresh = min(wanted, 1e-3 * controls[LONGEST]), 0.0, 0.0, True
                _restart(s, w, x, t)
            nstop += 1
        target = min(end, stops[nstop]) if nstop < stops.size else end
        h = min(wanted, controls[LONGEST])
        if t + 1.0001 * h >= target:
            h = target - t
        elif t + 2.0 * h > target and not fixed:
            h = 0.5 * (target - t)
        if abs(h - made) > 1e-9 * h:
            fresh = True
        at = target * (1.0 - 4e-16) if h >= target - t else t + h  # just before a drive's kink
        failed = _newton(s, w, x, at, h, previous, radius, controls[CLOSE] * tolerance, fresh, counts) > 0
        made, fresh = h, False
        if counts[STEPS] + counts[REJECTED] > controls[BUDGET]:
            counts[STATUS] = TOO_MANY
        if failed:
            counts[REJECTED] += 1
            wanted, fresh, previous = 0.3 * h, True, 0.0
            if wanted < shortest:
                counts[STATUS] = UNDERFLOW if np.isfinite(x.right.sum()) else NOT_FINITE
            continue
        _project(s, x)
        if s.forces.shape[0] > 0:
            place_markers(s, w, x.q1, x.v1)
            add_forces(s, w, at, x.q1, x.lam1, x.memory, h, x.force, x.stiffness, x.damping, x.cross, False)
        error = _error(s, w, x, h, tolerance, controls[CONTACT_TOLERANCE])
        part, which = _first_onset(s, w, x, h, landing)
        if which >= 0 and part < 1.0 and h * part > shortest and (error <= 1.0 or fixed):
            counts[REJECTED] += 1
            wanted = h * part
            continue
        if not fixed and h > 1e3 * shortest and _lets_go(s, w, x, controls[CONTACT_TOLERANCE]):
            error = max(error, 20.0)
        if error > 1.0 and not fixed and h > 4.0 * shortest:
            counts[REJECTED] += 1
            wanted = h * max(0.2, 0.85 * error ** (-1.0 / 3.0))
            continue
        if _remember(s, w, x, controls[FLOOR], controls[GRAZE], counts):
            fresh, held, previous, skipped = True, 0.0, 0.0, every
        _take_over(s, x, h, radius)
        _grow_units(x, s.elastic)
        x.before[:] = w.reports
        before, t = t, (target if h >= target - t else t + h)
        counts[STEPS] += 1
        skipped += 1
        if skipped >= every or t >= end - shortest:
            write(x, out, row, t, before)
            row, skipped = row + 1, 0
        previous = h
        if not fixed:
            held = max(error, 0.97 * held, 1e-6)
            grow = 0.8 * held ** (-1.0 / 3.0)
            if grow > 1.25 or grow < 0.85:
                wanted = max(wanted if h < 0.5 * wanted else 0.0, h * min(grow, 2.0))
        else:
            wanted = controls[FIRST_STEP]
    clock[0], clock[1], clock[2], clock[3], clock[4], clock[5] = t, wanted, held, previous, made, skipped
    counts[SAMPLES] = row


@inner
def begin(s, w, x, t):
    """Fill in what the first step needs to know of the start."""
    mass_matrix(s, x.q, x.mass)
    forces(s, w, t, x.q, x.v, x.lam, x.memory, 0.0, x.force, x.stiffness, x.damping, x.cross, False)
    x.before[:] = w.reports
