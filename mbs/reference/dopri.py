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

from mbs.reference.compiled import COUNTS, MOTION, NORMAL, SCALAR, T, V, entry, jit

OK, UNDERFLOW, NOT_FINITE, TOO_MANY = 0, 1, 2, 3
STATUS, STEPS, REJECTED, EVALUATIONS, SAMPLES, IMPACTS, COUNTERS = 0, 1, 2, 3, 4, 5, 6
"""Places in the counts."""
RTOL, LONGEST, FLOOR, LANDING, BUDGET, CONTROLS = 0, 1, 2, 3, 4, 5
"""Places in the controls: tolerance, longest step, slowest onset speed, how near zero an onset must land, most steps."""
IMPACT = ("joint", "start", "speed", "end", "rebound", "force")
"""Columns of the table of impacts: joint, onset time and speed, end time and speed, peak force; nan while it lasts."""


@jit
def _stages(rhs, t, h, y, k, new, trial, bar, modes, onset, report, watch, normal, elastic, friction):
    """The seven stages k; new becomes the fifth-order solution, report and watch are those of its end."""
    n = y.size
    for i in range(n):
        trial[i] = y[i] + h * (k[0, i] / 5.0)
    rhs(t + h / 5.0, trial, k[1], bar, modes, onset, report, watch, normal, elastic, friction)
    for i in range(n):
        trial[i] = y[i] + h * (3.0 / 40.0 * k[0, i] + 9.0 / 40.0 * k[1, i])
    rhs(t + 0.3 * h, trial, k[2], bar, modes, onset, report, watch, normal, elastic, friction)
    for i in range(n):
        trial[i] = y[i] + h * (44.0 / 45.0 * k[0, i] - 56.0 / 15.0 * k[1, i] + 32.0 / 9.0 * k[2, i])
    rhs(t + 0.8 * h, trial, k[3], bar, modes, onset, report, watch, normal, elastic, friction)
    for i in range(n):
        trial[i] = y[i] + h * (
            19372.0 / 6561.0 * k[0, i] - 25360.0 / 2187.0 * k[1, i] + 64448.0 / 6561.0 * k[2, i] - 212.0 / 729.0 * k[3, i]
        )
    rhs(t + h / 1.125, trial, k[4], bar, modes, onset, report, watch, normal, elastic, friction)
    for i in range(n):
        trial[i] = y[i] + h * (
            9017.0 / 3168.0 * k[0, i] - 355.0 / 33.0 * k[1, i] + 46732.0 / 5247.0 * k[2, i]
            + 49.0 / 176.0 * k[3, i] - 5103.0 / 18656.0 * k[4, i]
        )  # fmt: skip
    rhs(t + h, trial, k[5], bar, modes, onset, report, watch, normal, elastic, friction)
    for i in range(n):
        new[i] = y[i] + h * (
            35.0 / 384.0 * k[0, i] + 500.0 / 1113.0 * k[2, i] + 125.0 / 192.0 * k[3, i]
            - 2187.0 / 6784.0 * k[4, i] + 11.0 / 84.0 * k[5, i]
        )  # fmt: skip
    rhs(t + h, new, k[6], bar, modes, onset, report, watch, normal, elastic, friction)


@jit
def _error(h, y, new, k, rtol, atol):
    """Root mean square of the embedded error over its tolerance; components with an infinite one do not count."""
    total, counted = 0.0, 0
    for i in range(y.size):
        if math.isinf(atol[i]):
            continue
        error = h * (
            71.0 / 57600.0 * k[0, i] - 71.0 / 16695.0 * k[2, i] + 71.0 / 1920.0 * k[3, i]
            - 17253.0 / 339200.0 * k[4, i] + 22.0 / 525.0 * k[5, i] - 1.0 / 40.0 * k[6, i]
        )  # fmt: skip
        total += (error / (atol[i] + rtol * max(abs(y[i]), abs(new[i])))) ** 2
        counted += 1
    return math.sqrt(total / counted)


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
        if row < 0 and rate > 0.0 and depth >= -landing:
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


@entry(void(MOTION, V, V, V, V, T, V, V, T, T, float64[:, :, ::1], T, T, COUNTS, NORMAL, SCALAR, SCALAR))
def integrate(
    rhs, y, times, atol, bar, modes, onset, controls, states, rates, reports, peaks, impacts, counts, normal, elastic, friction
):
    """Integrate from times[0] to times[-1], leaving the final state in y.

    Parameters
    ----------
    rhs, bar, modes, onset, normal, elastic, friction : see `equations.motion`; onset.size is the number of contacts
    y : array, shape (n,), changed
    times : array, shape (samples,), ascending
    atol : array, shape (n,), infinite where the error does not count
    controls : array, shape (CONTROLS,)
    states, rates : array, shape (samples, n), filled
    reports : array, shape (samples, rows, columns), filled
    peaks : array, shape (samples, watched), filled: the largest since the sample before
    impacts : array, shape (capacity, 6), filled
    counts : array of int, shape (COUNTERS,), filled
    """
    n, t, stop = y.size, times[0], times[-1]
    k, new, trial = np.zeros((7, n)), np.empty(n), np.empty(n)
    report, watch, spare = np.zeros(reports.shape[1:]), np.zeros(peaks.shape[1]), np.zeros(peaks.shape[1])
    inside = np.full(onset.size, -1)
    rtol, landing, floor = controls[RTOL], controls[LANDING], controls[FLOOR]
    counts[:] = 0
    peaks[:] = 0.0
    rhs(t, y, k[0], bar, modes, onset, report, watch, normal, elastic, friction)
    states[0], rates[0], reports[0], peaks[0] = y, k[0], report, watch
    counts[SAMPLES] = counts[EVALUATIONS] = 1
    before = report.copy()
    h, previous, cut = min(controls[LONGEST], 1e-3 * (stop - t)), 1e-4, False
    h = min(h, 1e-7)
    while t < stop:
        if counts[STEPS] + counts[REJECTED] >= controls[BUDGET]:
            counts[STATUS] = TOO_MANY
            return
        h = min(h, controls[LONGEST], stop - t)
        _stages(rhs, t, h, y, k, new, trial, bar, modes, onset, report, watch, normal, elastic, friction)
        counts[EVALUATIONS] += 6
        error = _error(h, y, new, k, rtol, atol)
        if not error <= 1.0:
            counts[REJECTED] += 1
            h *= max(0.2, 0.9 * error**-0.2) if math.isfinite(error) else 0.2
            cut = True
            if h < 1e-15 * max(stop, 1e-3):
                counts[STATUS] = UNDERFLOW if math.isfinite(error) else NOT_FINITE
                return
            continue
        part = _first_crossing(h, before, report, inside, landing)
        if part < 1.0 and h * part > 1e-15 * stop:
            counts[REJECTED] += 1
            h *= part
            continue
        end = stop if h >= stop - t else t + h
        while counts[SAMPLES] < times.size and times[counts[SAMPLES]] <= end:
            s = counts[SAMPLES]
            _dense((times[s] - t) / h, h, y, new, k, states[s])
            rhs(times[s], states[s], rates[s], bar, modes, onset, reports[s], spare, normal, elastic, friction)
            counts[SAMPLES] += 1
            counts[EVALUATIONS] += 1
            peaks[s] = np.maximum(peaks[s], spare)
        s = min(counts[SAMPLES], times.size - 1)
        for i in range(watch.size):
            peaks[s, i] = max(peaks[s, i], watch[i])
        t = end
        counts[STEPS] += 1
        y[:] = new
        k[0] = k[6]
        before[:] = report
        if _contacts(t, report, watch, inside, onset, impacts, counts, floor, landing):
            rhs(t, y, k[0], bar, modes, onset, report, watch, normal, elastic, friction)
            counts[EVALUATIONS] += 1
        grow = 0.9 * max(error, 1e-10) ** -0.14 * previous**0.08
        h *= min(1.0 if cut else 5.0, max(0.2, grow))
        previous, cut = max(error, 1e-4), False
