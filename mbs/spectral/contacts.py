"""Contacts, and edges of laws (where a law has a jump or kink), over a step, compiled: onsets, releases, errors of depths.

Reports are arrays (forces, 8) of the columns `Report`. `start` are those at the step's start, `end` those at its end; depth is
positive inside a face. Onsets and edges are zeros of the cubic through both values and rates.
"""

from __future__ import annotations

from ..laws.table import LawColumn, NormalKind
from .compiling import compiled
from .tables import ForceKind, Forces, Memory, Report


@compiled
def is_contact(tables, k):
    """Return True if force k is a contact."""
    return tables.forces[k, Forces.KIND] == ForceKind.CONTACT or tables.forces[k, Forces.KIND] == ForceKind.JOURNAL


@compiled
def has_smooth_onset(tables, k):
    """Return True if no step need end at the onset of contact k: its force has no kink there and no onset speed in its law."""
    law = tables.forces[k, Forces.LAW]
    exponent = tables.law_numbers[law, 1]
    return tables.laws[law, LawColumn.KIND] == NormalKind.IMPACT and exponent > 1.0


@compiled
def get_depth(tables, reports, k):
    """Return the depth of contact k [m], negative outside; `side` is 1 if the measure grows into the face, else -1."""
    if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL:
        return reports[k, Report.LENGTH]
    side, face = tables.data[tables.forces[k, Forces.NUMBERS]], tables.data[tables.forces[k, Forces.NUMBERS] + 1]
    return side * (reports[k, Report.LENGTH] - face)


@compiled
def get_depth_rate(tables, reports, k):
    """Return the rate of contact k's depth [m/s]."""
    side = 1.0 if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL else tables.data[tables.forces[k, Forces.NUMBERS]]
    return side * reports[k, Report.RATE]


@compiled
def evaluate_cubic(x, h, start, start_rate, end, end_rate):
    """Evaluate, at fraction x of a step of length h, the Hermite cubic with these values and rates at its ends."""
    first, last = (1.0 + 2.0 * x) * start + x * h * start_rate, (3.0 - 2.0 * x) * end + (x - 1.0) * h * end_rate
    return (1.0 - x) ** 2 * first + x * x * last


@compiled
def find_zero(h, start, start_rate, end, end_rate):
    """Find the first fraction of the step at which the cubic, negative at its start, passes zero; 2 if it does not."""
    high = 2.0
    if end > 0.0:
        high = 1.0
    elif start_rate > 0.0 and end_rate < 0.0:
        # both ends are negative: ternary search for the maximum between them
        a, b = 0.0, 1.0
        for _ in range(40):  # to (2/3)^40 = 1e-7: the maximum is flat
            m1, m2 = a + (b - a) / 3.0, b - (b - a) / 3.0
            if evaluate_cubic(m1, h, start, start_rate, end, end_rate) < evaluate_cubic(m2, h, start, start_rate, end, end_rate):
                a = m1
            else:
                b = m2
        if evaluate_cubic(0.5 * (a + b), h, start, start_rate, end, end_rate) > 0.0:
            high = 0.5 * (a + b)
    if high > 1.0:
        return 2.0
    low = 0.0
    for _ in range(60):  # bisection down to rounding
        middle = 0.5 * (low + high)
        if evaluate_cubic(middle, h, start, start_rate, end, end_rate) > 0.0:
            high = middle
        else:
            low = middle
    return high


@compiled
def find_first_onset(tables, start, end, h, controls):
    """Find the fraction of the step at which the first open contact closes; 2 if none does.

    The step shall end `stop_gap` [m] before the face, with an error up to this gap or, if it is 0, to `face_tolerance`.
    Smooth onsets count if the contact also opens in the step, or if `controls.stops_at_all_onsets` asks for all onsets.
    """
    face_tolerance, gap = controls.face_tolerance, controls.stop_gap
    first, allowed = 2.0, gap if gap > 0.0 else face_tolerance
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            d0, d1 = get_depth(tables, start, k), get_depth(tables, end, k)
            is_wanted = controls.stops_at_all_onsets or d1 <= 0.0 or not has_smooth_onset(tables, k)
            if is_wanted and d0 < -face_tolerance and abs(d1 + gap) > allowed:
                rates = get_depth_rate(tables, start, k), get_depth_rate(tables, end, k)
                first = min(first, find_zero(h, d0 + gap, rates[0], d1 + gap, rates[1]))
    return first


@compiled
def find_first_edge(tables, start, end, h, controls):
    """Find the fraction of the step at which a measure is first `stop_gap` before an edge of its law; 2 if none comes there."""
    first, gap = 2.0, controls.stop_gap
    for i in range(tables.edges.shape[0]):
        k, edge = int(tables.edges[i, 0]), tables.edges[i, 1]
        d0, d1 = start[k, Report.LENGTH] - edge, end[k, Report.LENGTH] - edge
        side = -1.0 if d0 > 0.0 else 1.0
        if abs(d0) > controls.face_tolerance and abs(side * d1 + gap) > gap:
            rates = side * start[k, Report.RATE], side * end[k, Report.RATE]
            first = min(first, find_zero(h, side * d0 + gap, rates[0], side * d1 + gap, rates[1]))
    return first


@compiled
def _measure_past_edge(tables, reports, i):
    """Return the distance of a measure beyond edge i in its direction of motion, negative before it, and its speed."""
    k = int(tables.edges[i, 0])
    rate = reports[k, Report.RATE]
    return (reports[k, Report.LENGTH] - tables.edges[i, 1]) * (1.0 if rate > 0.0 else -1.0), abs(rate)


@compiled
def is_at_edge(tables, start, end, controls):
    """Return True if a measure has come near an edge of its law, and moves towards it."""
    for i in range(tables.edges.shape[0]):
        k, edge = int(tables.edges[i, 0]), tables.edges[i, 1]
        is_near = -controls.closing_gap <= _measure_past_edge(tables, end, i)[0] <= 0.0
        if is_near and abs(start[k, Report.LENGTH] - edge) > controls.face_tolerance:
            return True
    return False


@compiled
def compute_time_past_events(tables, reports, near):
    """Return the time [s] until contacts, and measures, that are `near` before their face or edge are 0.1 `near` beyond it."""
    time = 0.0
    for i in range(tables.edges.shape[0]):
        past, speed = _measure_past_edge(tables, reports, i)
        if -near <= past <= 0.0 and speed > 0.0:
            time = max(time, (0.1 * near - past) / speed)
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            depth, rate = get_depth(tables, reports, k), get_depth_rate(tables, reports, k)
            if -near <= depth <= 0.0 and rate > 0.0:
                time = max(time, (0.1 * near - depth) / rate)
    return time


@compiled
def has_released(tables, state, end, controls):
    """Return True if the step must be shortened to a kink: a contact opens from a large enough force, or closes and opens."""
    start, face_tolerance = state.start_reports, controls.face_tolerance
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            if end[k, Report.VALUE] == 0.0 and abs(start[k, Report.VALUE]) > controls.contact_tolerance * state.largest_force[k]:
                return True
            old, rate = get_depth(tables, start, k), get_depth_rate(tables, start, k)
            if abs(old) <= face_tolerance and rate > 0.0 and get_depth(tables, end, k) < -face_tolerance:
                return True
    return False


@compiled
def update_onset(tables, start, end, k, m, controls):
    """Update memory m of contact k after a step: return 1 if it closed, -1 if it opened, else 0.

    Steps end where a contact closes, so the onset speed is the rate at that end of the step which is nearer to the face. A
    contact also counts as closed near its face if it is about to close.
    """
    old, new, rate = get_depth(tables, start, k), get_depth(tables, end, k), get_depth_rate(tables, end, k)
    if new > -old >= 0.0:
        rate = get_depth_rate(tables, start, k)
    if new <= 0.0 or old <= 0.0:
        m[Memory.ONSET] = max(rate, controls.least_onset, controls.least_onset_ratio * m[Memory.FASTEST])
    is_about_to_close = old < -controls.closing_gap <= new and rate > 0.0 and controls.closing_gap > 0.0
    if new > 0.0 >= old or is_about_to_close:
        if tables.forces[k, Forces.KIND] == ForceKind.CONTACT:
            m[Memory.FASTEST] = max(m[Memory.FASTEST], m[Memory.ONSET])
        return 1
    return -1 if end[k, Report.VALUE] == 0.0 and start[k, Report.VALUE] != 0.0 else 0


@compiled
def find_face_row(tables, start, end, least):
    """Return the time of a row just past the face of a closing contact, from the step's start, or, negative, its end; else 0.

    The contact passes the face near one end of the step. The row is twice as far from this end, plus `least` [s].
    """
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            old, new = get_depth(tables, start, k), get_depth(tables, end, k)
            if new > 0.0 >= old:
                at_start = new > -old
                rate = get_depth_rate(tables, start if at_start else end, k)
                if rate > 0.0:
                    return (least if at_start else -least) - 2.0 * (old if at_start else new) / rate
    return 0.0


@compiled
def compute_depth_bending(tables, start, end, h):
    """Return the largest deviation of closed contacts' depths from a line over a step, h/8 |change of rate|, over the depth."""
    largest = 0.0
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            deep = max(get_depth(tables, start, k), get_depth(tables, end, k))
            if deep > 0.0:
                rate_change = get_depth_rate(tables, end, k) - get_depth_rate(tables, start, k)
                largest = max(largest, 0.125 * h * abs(rate_change) / deep)
    return largest


@compiled
def estimate_depth_error(tables, state, shifted, h, k, controls):
    """Return the error of contact k's depth, relative to the largest of depth, its change in the step, and face tolerance.

    Rounding counts as 0. `shifted` are the reports at the end of the step plus its error, `state.end_reports` those without.
    """
    start, end = state.start_reports, state.end_reports
    old, new = get_depth(tables, start, k), get_depth(tables, end, k)
    deep = max(old, new)
    if deep <= 0.0:
        return 0.0
    change = h * max(abs(get_depth_rate(tables, start, k)), abs(get_depth_rate(tables, end, k)))
    error = abs(get_depth(tables, shifted, k) - new)
    return error / max(deep, change, controls.face_tolerance) if error > controls.rounding else 0.0
