"""Error-controlled Runge-Kutta integration with contacts: DOPRI5(4), compiled, dense output, a step on every onset.

Steps are chosen by a PI controller on the embedded error. A step on which a depth rises through zero is cut there, so that
each impact begins at a step, knows its onset speed, and no step straddles the kink in the force.

References
----------
J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19-26, doi 10.1016/0771-050X(80)90013-3.
E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I (1993), ch. II.4-6,
doi 10.1007/978-3-540-78862-1.
"""

from __future__ import annotations

import math

import numpy as np
from numba import float64, void

from buckler.mbs.reference.compiled import COUNTS, FRICTION, MOTION, NORMAL, T, V, borrowed, entry, jit

OK, UNDERFLOW, NOT_FINITE, TOO_MANY = 0, 1, 2, 3
STATUS, STEPS, REJECTED, EVALUATIONS, SAMPLES, IMPACTS, COUNTERS = 0, 1, 2, 3, 4, 5, 6
"""Places in the counts."""
MOVING, RTOL, ATOL, LONGEST, FLOOR, LANDING, BUDGET, CONTROLS = 0, 1, 2, 3, 4, 5, 6, 7
"""Places in the controls: components that move, tolerances, longest step, slowest onset speed, how near zero an onset must
land, most steps."""
SPARE = 7
"""Further rows of the outputs, to work in."""
TINY = 1e-15
"""Shortest step, as a part of the run's end."""
FIRST_STEP = 1e-7
"""s; grows fivefold a step where it may."""
IMPACT = ("joint", "start", "speed", "end", "rebound", "force")
"""Columns of the table of impacts: joint, onset time and speed, end time and speed, peak force; nan while it lasts."""


@jit
def _stages(rhs, t, h, n, y, k, new, trial, bar, modes, onset, report, watch, normal, friction):
    """The seven stages k; new becomes the fifth-order solution, report and watch are those of its end.

    Rates depend on the first n components only; the others, integrals, need no values within the step.
    """
    for i in range(n):
        trial[i] = y[i] + h * (k[0, i] / 5.0)
    rhs(t + h / 5.0, trial, k[1], bar, modes, onset, report, watch, normal, friction)
    for i in range(n):
        trial[i] = y[i] + h * (3.0 / 40.0 * k[0, i] + 9.0 / 40.0 * k[1, i])
    rhs(t + 0.3 * h, trial, k[2], bar, modes, onset, report, watch, normal, friction)
    for i in range(n):
        trial[i] = y[i] + h * (44.0 / 45.0 * k[0, i] - 56.0 / 15.0 * k[1, i] + 32.0 / 9.0 * k[2, i])
    rhs(t + 0.8 * h, trial, k[3], bar, modes, onset, report, watch, normal, friction)
    for i in range(n):
        trial[i] = y[i] + h * (
            19372.0 / 6561.0 * k[0, i] - 25360.0 / 2187.0 * k[1, i] + 64448.0 / 6561.0 * k[2, i] - 212.0 / 729.0 * k[3, i]
        )
    rhs(t + h / 1.125, trial, k[4], bar, modes, onset, report, watch, normal, friction)
    for i in range(n):
        trial[i] = y[i] + h * (
            9017.0 / 3168.0 * k[0, i] - 355.0 / 33.0 * k[1, i] + 46732.0 / 5247.0 * k[2, i]
            + 49.0 / 176.0 * k[3, i] - 5103.0 / 18656.0 * k[4, i]
        )  # fmt: skip
    rhs(t + h, trial, k[5], bar, modes, onset, report, watch, normal, friction)
    for i in range(y.size):
        new[i] = y[i] + h * (
            35.0 / 384.0 * k[0, i] + 500.0 / 1113.0 * k[2, i] + 125.0 / 192.0 * k[3, i]
            - 2187.0 / 6784.0 * k[4, i] + 11.0 / 84.0 * k[5, i]
        )  # fmt: skip
    rhs(t + h, new, k[6], bar, modes, onset, report, watch, normal, friction)


@jit
def _error(h, n, y, new, k, rtol, atol):
    """Root mean square of the embedded error of the first n components over its tolerance."""
    total = 0.0
    for i in range(n):
        error = h * (
            71.0 / 57600.0 * k[0, i] - 71.0 / 16695.0 * k[2, i] + 71.0 / 1920.0 * k[3, i]
            - 17253.0 / 339200.0 * k[4, i] + 22.0 / 525.0 * k[5, i] - 1.0 / 40.0 * k[6, i]
        )  # fmt: skip
        total += (error / (atol + rtol * max(abs(y[i]), abs(new[i])))) ** 2
    return math.sqrt(total / n)


@jit
def _dense(x, h, y, new, k, out):
    """Fill out with the state at the fraction x of the step: Shampine's fourth-order interpolant."""
    for i in range(y.size):
        rise = new[i] - y[i]
        bend = h * k[0, i] - rise
        snap = h * (
            -12715105075.0 / 11282082432.0 * k[0, i] + 87487479700.0 / 32700410799.0 * k[2, i]
            - 10690763975.0 / 1880347072.0 * k[3, i] + 701980252875.0 / 199316789632.0 * k[4, i]
            - 1453857185.0 / 822651844.0 * k[5, i] + 69997945.0 / 29380423.0 * k[6, i]
        )  # fmt: skip
        out[i] = y[i] + x * (rise + (1.0 - x) * (bend + x * (rise - h * k[6, i] - bend + (1.0 - x) * snap)))


@jit
def _crossing(h, d0, v0, d1, v1):
    """Fraction of the step at which the cubic with these depths and rates at its ends passes zero, d0 <= 0 < d1."""
    low, high, x = 0.0, 1.0, d0 / (d0 - d1)
    for _ in range(60):
        depth = (1.0 - x) ** 2 * ((1.0 + 2.0 * x) * d0 + x * h * v0) + x**2 * ((3.0 - 2.0 * x) * d1 + (x - 1.0) * h * v1)
        slope = 6.0 * x * (1.0 - x) * (d1 - d0) + (1.0 - x) * (1.0 - 3.0 * x) * h * v0 + x * (3.0 * x - 2.0) * h * v1
        if depth > 0.0:
            high = x
        else:
            low = x
        guess = x - depth / slope
        if not low < guess < high:
            guess = 0.5 * (low + high)
        if abs(guess - x) < 1e-15:
            break
        x = guess
    return x


@jit
def _first_crossing(h, before, report, inside, landing):
    """Smallest fraction of the step at which a free joint goes in by more than the landing; 1 if none does."""
    first = 1.0
    for j in range(inside.size):
        if inside[j] < 0 and report[j, 0] > landing:
            first = min(first, _crossing(h, min(before[j, 0], 0.0), before[j, 1], report[j, 0], report[j, 1]))
    return first


@jit
def _contacts(t, report, watch, inside, onset, impacts, counts, floor, landing):
    """Book contacts that begin or end here; return True if an onset speed changed."""
    changed = False
    for j in range(inside.size):
        depth, rate = report[j, 0], report[j, 1]
        row = inside[j]
        if row < 0 and (depth > landing or (depth >= -landing and rate > 0.0)):
            onset[j], changed = max(rate, floor), True
            inside[j] = row = min(counts[IMPACTS], impacts.shape[0] - 1)
            counts[IMPACTS] += 1
            impacts[row, :] = math.nan
            impacts[row, 0], impacts[row, 1], impacts[row, 2], impacts[row, 5] = j, t, rate, 0.0
        elif row >= 0 and depth <= 0.0 and rate <= 0.0:
            impacts[row, 3], impacts[row, 4] = t, -rate
            inside[j] = -1
        elif row >= 0:
            impacts[row, 5] = max(impacts[row, 5], watch[j])
    return changed


@jit
def _raise(peaks, s, values):
    """Keep the larger of what row s holds and values."""
    for i in range(values.size):
        peaks[s, i] = max(peaks[s, i], values[i])


@jit
def _shorter(h, error, part, shortest, counts):
    """Length of the next attempt after one whose error is too large, or one to be cut at an onset."""
    counts[REJECTED] += 1
    if error <= 1.0:
        return max(h * part, shortest)
    if h < shortest:
        counts[STATUS] = UNDERFLOW if math.isfinite(error) else NOT_FINITE
    return h * (max(0.2, 0.9 * error**-0.2) if math.isfinite(error) else 0.2)


@entry(void(MOTION, V, V, V, T, V, V, T, T, float64[:, :, ::1], T, T, COUNTS, NORMAL, FRICTION))
def integrate(rhs, y, times, bar, modes, onset, controls, states, rates, reports, peaks, impacts, counts, normal, friction):
    """Integrate from times[0] to times[-1], leaving the final state in y.

    Parameters
    ----------
    rhs, bar, modes, onset, normal, friction : see `equations.motion`; onset.size is the number of contacts
    y : array, shape (n,), changed; the first controls[MOVING] decide the rates and the steps, the others are integrals
    times : array, shape (samples,), ascending
    controls : array, shape (CONTROLS,)
    states, rates : array, shape (samples + SPARE, n), filled
    reports : array, shape (samples + SPARE, rows, columns), filled
    peaks : array, shape (samples + SPARE, watched), filled: the largest since the sample before; the spare rows are for work
    impacts : array, shape (capacity, 6), filled
    counts : array of int, shape (COUNTERS,), filled
    """
    y, bar, modes, onset, states = borrowed(y), borrowed(bar), borrowed(modes), borrowed(onset), borrowed(states)
    rates, reports, peaks, impacts, counts = (
        borrowed(rates), borrowed(reports), borrowed(peaks), borrowed(impacts), borrowed(counts)
    )  # fmt: skip
    last, t, stop, shortest = times.size, times[0], times[-1], TINY * times[-1]
    k, new, trial = rates[last:], states[last], states[last + 1]
    report, before, watch, spare = reports[last], reports[last + 1], peaks[last], peaks[last + 1]
    inside = np.full(onset.size, -1)
    n, rtol, atol, landing, floor = int(controls[MOVING]), controls[RTOL], controls[ATOL], controls[LANDING], controls[FLOOR]
    rhs(t, y, k[0], bar, modes, onset, report, watch, normal, friction)
    states[0], rates[0], reports[0], peaks[0] = y, k[0], report, watch
    counts[SAMPLES] = counts[EVALUATIONS] = 1
    _contacts(t, report, watch, inside, onset, impacts, counts, floor, landing)
    h, previous, kept = FIRST_STEP, 1e-4, 0.0
    while t < stop and counts[STATUS] == OK:
        before[:] = report
        h = min(h, controls[LONGEST], stop - t)
        _stages(rhs, t, h, n, y, k, new, trial, bar, modes, onset, report, watch, normal, friction)
        counts[EVALUATIONS] += 6
        error = _error(h, n, y, new, k, rtol, atol)
        part = _first_crossing(h, before, report, inside, landing) if error <= 1.0 else 1.0
        if not error <= 1.0 or h * part < h - shortest:
            kept = max(kept, h) if error <= 1.0 else kept
            h = _shorter(h, error, part, shortest, counts)
            report[:] = before
            continue
        end = stop if h >= stop - t else t + h
        while counts[SAMPLES] < last and times[counts[SAMPLES]] <= end:
            s = counts[SAMPLES]
            _dense((times[s] - t) / h, h, y, new, k, states[s])
            rhs(times[s], states[s], rates[s], bar, modes, onset, reports[s], spare, normal, friction)
            _raise(peaks, s, spare)
            counts[SAMPLES] += 1
        _raise(peaks, min(counts[SAMPLES], last - 1), watch)
        t = end
        for i in range(y.size):
            y[i], k[0, i] = new[i], k[6, i]
        if _contacts(t, report, watch, inside, onset, impacts, counts, floor, landing):
            rhs(t, y, k[0], bar, modes, onset, report, watch, normal, friction)
        h *= min(5.0, max(0.2, 0.9 * max(error, 1e-10) ** -0.14 * previous**0.08))
        h, kept, previous = max(h, kept), 0.0, max(error, 1e-4)
        counts[STEPS] += 1
        if t < stop and counts[STEPS] + counts[REJECTED] >= controls[BUDGET]:
            counts[STATUS] = TOO_MANY
