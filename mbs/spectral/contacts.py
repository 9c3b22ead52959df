"""Contacts over a step, compiled: when they close and open, and their memories."""

from __future__ import annotations

from ..laws.table import LawColumn, NormalKind
from .compiling import draft
from .tables import ForceKind, Forces, Memory, Report


@draft
def touches(tables, k):
    """Return True if force k is a contact."""
    return tables.forces[k, Forces.KIND] == ForceKind.CONTACT or tables.forces[k, Forces.KIND] == ForceKind.JOURNAL


@draft
def begins_smoothly(tables, k):
    """Return True if a contact's force begins without a kink and without onset speed: no step need end at its onset."""
    law = tables.forces[k, Forces.LAW]
    return tables.laws[law, LawColumn.KIND] == NormalKind.IMPACT and tables.law_numbers[law, 1] > 1.0


@draft
def depth_of(tables, reports, k):
    """Depth of contact k, from its report."""
    if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL:
        return reports[k, Report.LENGTH]
    side, face = tables.data[tables.forces[k, Forces.NUMBERS]], tables.data[tables.forces[k, Forces.NUMBERS] + 1]
    return side * (reports[k, Report.LENGTH] - face)


@draft
def rate_of_depth(tables, reports, k):
    """Rate of contact k's depth, from its report."""
    side = 1.0 if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL else tables.data[tables.forces[k, Forces.NUMBERS]]
    return side * reports[k, Report.RATE]


@draft
def hermite(x, h, start, start_rate, end, end_rate):
    """Value at the fraction x of a step of length h of the cubic with these values and slopes at its ends."""
    first, last = (1.0 + 2.0 * x) * start + x * h * start_rate, (3.0 - 2.0 * x) * end + (x - 1.0) * h * end_rate
    return (1.0 - x) ** 2 * first + x * x * last


@draft
def crossing(h, start, start_rate, end, end_rate):
    """First fraction of the step at which the cubic, negative at its start, passes zero; 2 if it does not."""
    high = 2.0
    if end > 0.0:
        high = 1.0
    elif start_rate > 0.0 and end_rate < 0.0:
        # both ends are negative: find the maximum between them
        a, b = 0.0, 1.0
        for _ in range(40):
            m1, m2 = a + (b - a) / 3.0, b - (b - a) / 3.0
            if hermite(m1, h, start, start_rate, end, end_rate) < hermite(m2, h, start, start_rate, end, end_rate):
                a = m1
            else:
                b = m2
        if hermite(0.5 * (a + b), h, start, start_rate, end, end_rate) > 0.0:
            high = 0.5 * (a + b)
    if high > 1.0:
        return 2.0
    low = 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if hermite(middle, h, start, start_rate, end, end_rate) > 0.0:
            high = middle
        else:
            low = middle
    return high


@draft
def first_onset(tables, before, reports, h, landing, outside, smooth):
    """Fraction of the step at which the first open contact closes; 2 if none does.

    The step is to end at the distance `outside` before the face, with an error up to that, as the last node of a step that ends a
    rounding error inside has a contact force. If `outside` is zero, the error is up to `landing`. Contacts whose force begins
    smoothly count if `smooth`, or if they also open within the step, whose stages may have missed them.
    """
    first, miss = 2.0, outside if outside > 0.0 else landing
    for k in range(tables.forces.shape[0]):
        if touches(tables, k):
            d0, d1 = depth_of(tables, before, k), depth_of(tables, reports, k)
            counts = smooth or d1 <= 0.0 or not begins_smoothly(tables, k)
            if counts and d0 < -landing and abs(d1 + outside) > miss:
                rates = rate_of_depth(tables, before, k), rate_of_depth(tables, reports, k)
                first = min(first, crossing(h, d0 + outside, rates[0], d1 + outside, rates[1]))
    return first


@draft
def first_edge(tables, before, reports, h, landing, outside):
    """Fraction of the step at which a measure first reaches an edge of its law, from either side; 2 if none does.

    As at a contact's face the step is to end at the distance `outside` before the edge.
    """
    first = 2.0
    for i in range(tables.edges.shape[0]):
        k, edge = int(tables.edges[i, 0]), tables.edges[i, 1]
        start, end = before[k, Report.LENGTH] - edge, reports[k, Report.LENGTH] - edge
        side = -1.0 if start > 0.0 else 1.0
        if abs(start) > landing and abs(side * end + outside) > outside:
            rates = side * before[k, Report.RATE], side * reports[k, Report.RATE]
            first = min(first, crossing(h, side * start + outside, rates[0], side * end + outside, rates[1]))
    return first


@draft
def _past_edge(tables, reports, i):
    """Distance of a measure beyond edge i of its law in its direction of motion, negative before it, and its speed."""
    k = int(tables.edges[i, 0])
    rate = reports[k, Report.RATE]
    return (reports[k, Report.LENGTH] - tables.edges[i, 1]) * (1.0 if rate > 0.0 else -1.0), abs(rate)


@draft
def reaches_edge(tables, before, reports, landing, near):
    """Return True if a measure is up to `near` before an edge of its law, and moves towards it."""
    for i in range(tables.edges.shape[0]):
        k, edge = int(tables.edges[i, 0]), tables.edges[i, 1]
        if abs(before[k, Report.LENGTH] - edge) > landing and -near <= _past_edge(tables, reports, i)[0] <= 0.0:
            return True
    return False


@draft
def time_to_edges(tables, reports, near):
    """Time until all measures up to `near` before an edge of their law are 0.1 `near` beyond it."""
    time = 0.0
    for i in range(tables.edges.shape[0]):
        past, speed = _past_edge(tables, reports, i)
        if -near <= past <= 0.0 and speed > 0.0:
            time = max(time, (0.1 * near - past) / speed)
    return time


@draft
def time_to_faces(tables, reports, near):
    """Time until all contacts about to close, up to `near` before their face, are 0.1 `near` deep."""
    time = 0.0
    for k in range(tables.forces.shape[0]):
        if touches(tables, k):
            depth, rate = depth_of(tables, reports, k), rate_of_depth(tables, reports, k)
            if -near <= depth <= 0.0 and rate > 0.0:
                time = max(time, (0.1 * near - depth) / rate)
    return time


@draft
def lets_go(tables, before, reports, largest, share, landing):
    """Return True if the step must be shortened to a kink: a contact lost a share of its largest force so far, or is passed
    through within the step.
    """
    for k in range(tables.forces.shape[0]):
        if touches(tables, k):
            if reports[k, Report.VALUE] == 0.0 and abs(before[k, Report.VALUE]) > share * largest[k]:
                return True
            if (
                abs(depth_of(tables, before, k)) <= landing
                and depth_of(tables, reports, k) < -landing
                and rate_of_depth(tables, before, k) > 0.0
            ):
                return True
    return False


@draft
def remember_onset(tables, before, reports, k, m, controls, near):
    """Update memory m of contact k after a step: return 1 if it closed, -1 if it opened, else 0.

    As steps end where a contact closes, the onset speed is that at the end of the step which is nearer to the face. A contact
    counts as closed, too, if it comes up to `near` before the face and is about to close.
    """
    old, new, rate = depth_of(tables, before, k), depth_of(tables, reports, k), rate_of_depth(tables, reports, k)
    if new > -old >= 0.0:
        rate = rate_of_depth(tables, before, k)
    if new <= 0.0 or old <= 0.0:
        m[Memory.ONSET] = max(rate, controls.least_onset, controls.graze * m[Memory.FASTEST])
    if (new > 0.0 and old <= 0.0) or (old < -near <= new and rate > 0.0 and near > 0.0):
        if tables.forces[k, Forces.KIND] == ForceKind.CONTACT:
            m[Memory.FASTEST] = max(m[Memory.FASTEST], m[Memory.ONSET])
        return 1
    return -1 if reports[k, Report.VALUE] == 0.0 and before[k, Report.VALUE] != 0.0 else 0


@draft
def closing(tables, before, reports, least):
    """Time from a step's start, or, negative, from its end, to where a closing contact is as far beyond the face as it is before
    it there, or the reverse; 0 if none closes.
    """
    for k in range(tables.forces.shape[0]):
        if touches(tables, k):
            old, new = depth_of(tables, before, k), depth_of(tables, reports, k)
            if new > 0.0 >= old:
                near = new > -old
                rate = rate_of_depth(tables, before if near else reports, k)
                if rate > 0.0:
                    return (least if near else -least) - 2.0 * (old if near else new) / rate
    return 0.0


@draft
def bend_of_depths(tables, before, reports, h):
    """Largest deviation of closed contacts' depths over a step from a straight line, over the depth."""
    most = 0.0
    for k in range(tables.forces.shape[0]):
        if touches(tables, k):
            deep = max(depth_of(tables, before, k), depth_of(tables, reports, k))
            if deep > 0.0:
                most = max(most, 0.125 * h * abs(rate_of_depth(tables, reports, k) - rate_of_depth(tables, before, k)) / deep)
    return most


@draft
def error_of_depth(tables, state, shifted, h, k, least, noise):
    """Error of contact k's depth over the largest of that depth, its change in the step, and `least`; 0 below the noise.

    `shifted` are the reports at the state plus its error, `state.end_reports` those of the step's end.
    """
    before, reports = state.start_reports, state.end_reports
    old, new = depth_of(tables, before, k), depth_of(tables, reports, k)
    deep = max(old, new)
    if deep <= 0.0:
        return 0.0
    change = h * max(abs(rate_of_depth(tables, before, k)), abs(rate_of_depth(tables, reports, k)))
    error = abs(depth_of(tables, shifted, k) - new)
    return error / max(deep, change, least) if error > noise else 0.0
