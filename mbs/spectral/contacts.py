"""Contacts, and edges of laws (where a law has a jump or kink), over a step, compiled: onsets, releases, errors of depths.

Reports are arrays (forces, 8) of the columns `Report`. `start` are those at the step's start, `end` those at its end; depth is
positive inside a face. Onsets and edges are zeros of the cubic through both values and rates.

Distances [m] in `controls`: a contact counts as at its face within `face_tolerance`. An implicit step to a face or edge ends
`stop_gap` before it, so that the error of the step cannot reach the force behind it; a motion towards the face then counts as
arrived within `closing_gap`. The explicit method ends such steps at the face: both gaps are 0.
"""

from ..laws.table import LawColumn, NormalKind
from .compiling import kernel_function
from .tables import ForceKind, Forces, Memory, Report

BEYOND = 0.1
"""Distance beyond a face or edge to which a restart moves, over `closing_gap`: above 0, so that the contact counts as closed."""


@kernel_function
def is_contact(tables, k):
    """Return True if force k is a contact."""
    return tables.forces[k, Forces.KIND] == ForceKind.CONTACT or tables.forces[k, Forces.KIND] == ForceKind.JOURNAL


@kernel_function
def has_smooth_onset(tables, k):
    """Return True if no step need end at the onset of contact k: its force has no kink there and no onset speed in its law."""
    law = tables.forces[k, Forces.LAW]
    exponent = tables.law_numbers[law, 1]  # of the depth
    return tables.laws[law, LawColumn.KIND] == NormalKind.IMPACT and exponent > 1.0


@kernel_function
def get_depth(tables, reports, k):
    """Return the depth of contact k [m], negative outside; `side` is 1 if the measure grows into the face, else -1."""
    if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL:
        return reports[k, Report.LENGTH]
    number = tables.forces[k, Forces.NUMBERS]
    side, face = tables.data[number], tables.data[number + 1]
    return side * (reports[k, Report.LENGTH] - face)


@kernel_function
def get_depth_rate(tables, reports, k):
    """Return the rate of contact k's depth [m/s]."""
    side = 1.0 if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL else tables.data[tables.forces[k, Forces.NUMBERS]]
    return side * reports[k, Report.RATE]


@kernel_function
def evaluate_cubic(x, h, start, start_rate, end, end_rate):
    """Evaluate, at fraction x of a step of length h, the Hermite cubic with these values and rates at its ends."""
    from_start = (1.0 + 2.0 * x) * start + x * h * start_rate
    from_end = (3.0 - 2.0 * x) * end + (x - 1.0) * h * end_rate
    return (1.0 - x) ** 2 * from_start + x * x * from_end


@kernel_function
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


@kernel_function
def find_first_onset(tables, start, end, h, controls):
    """Find the fraction of the step at which the first open contact closes; 2 if none does.

    A contact that starts within `face_tolerance` of its face counts as closed. None is looked for if the step already ends near
    enough to where a step to the face should, `stop_gap` before it. A smooth onset counts only if the contact also opens in the
    step, or if `controls.stops_at_all_onsets`.
    """
    face_tolerance, gap = controls.face_tolerance, controls.stop_gap
    first, allowed = 2.0, gap if gap > 0.0 else face_tolerance  # allowed: error of the step's end [m]
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            d0, d1 = get_depth(tables, start, k), get_depth(tables, end, k)
            is_wanted = controls.stops_at_all_onsets or d1 <= 0.0 or not has_smooth_onset(tables, k)
            is_open, ends_elsewhere = d0 < -face_tolerance, abs(d1 + gap) > allowed
            if is_wanted and is_open and ends_elsewhere:
                start_rate, end_rate = get_depth_rate(tables, start, k), get_depth_rate(tables, end, k)
                first = min(first, find_zero(h, d0 + gap, start_rate, d1 + gap, end_rate))
    return first


@kernel_function
def find_first_edge(tables, start, end, h, controls):
    """Find the fraction of the step at which a measure is first `stop_gap` before an edge of its law; 2 if none comes there."""
    first, gap = 2.0, controls.stop_gap
    for i in range(tables.edges.shape[0]):
        k, edge = int(tables.edges[i, 0]), tables.edges[i, 1]
        side = -1.0 if start[k, Report.LENGTH] > edge else 1.0
        d0, d1 = side * (start[k, Report.LENGTH] - edge), side * (end[k, Report.LENGTH] - edge)  # positive beyond the edge
        is_before, ends_elsewhere = abs(d0) > controls.face_tolerance, abs(d1 + gap) > gap
        if is_before and ends_elsewhere:
            start_rate, end_rate = side * start[k, Report.RATE], side * end[k, Report.RATE]
            first = min(first, find_zero(h, d0 + gap, start_rate, d1 + gap, end_rate))
    return first


@kernel_function
def _measure_past_edge(tables, reports, i):
    """Return the distance of a measure beyond edge i in its direction of motion, negative before it, and its speed."""
    k, edge = int(tables.edges[i, 0]), tables.edges[i, 1]
    rate, distance = reports[k, Report.RATE], reports[k, Report.LENGTH] - edge
    return distance if rate > 0.0 else -distance, abs(rate)


@kernel_function
def is_at_edge(tables, start, end, controls):
    """Return True if a measure has come near an edge of its law, and moves towards it."""
    for i in range(tables.edges.shape[0]):
        k, edge = int(tables.edges[i, 0]), tables.edges[i, 1]
        past, _ = _measure_past_edge(tables, end, i)
        came_from_afar = abs(start[k, Report.LENGTH] - edge) > controls.face_tolerance
        if came_from_afar and -controls.closing_gap <= past <= 0.0:
            return True
    return False


@kernel_function
def compute_time_past_events(tables, reports, gap):
    """Return the time [s] in which all that moves towards a face or edge within `gap` passes it, by `BEYOND`; 0 for none."""
    time = 0.0
    for i in range(tables.edges.shape[0]):
        past, speed = _measure_past_edge(tables, reports, i)
        if -gap <= past <= 0.0 and speed > 0.0:
            time = max(time, (BEYOND * gap - past) / speed)
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            depth, rate = get_depth(tables, reports, k), get_depth_rate(tables, reports, k)
            if -gap <= depth <= 0.0 and rate > 0.0:
                time = max(time, (BEYOND * gap - depth) / rate)
    return time


@kernel_function
def has_released(tables, state, end, controls):
    """Return True if the step must be shortened to a kink: a contact opens from a large enough force, or closes and opens."""
    start, face_tolerance = state.start_reports, controls.face_tolerance
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            negligible = controls.contact_tolerance * state.largest_force[k]
            opens = end[k, Report.VALUE] == 0.0 and abs(start[k, Report.VALUE]) > negligible
            is_closing = abs(get_depth(tables, start, k)) <= face_tolerance and get_depth_rate(tables, start, k) > 0.0
            if opens or (is_closing and get_depth(tables, end, k) < -face_tolerance):
                return True
    return False


@kernel_function
def update_onset(tables, start, end, k, m, controls):
    """Update memory m of contact k after a step; return whether it closed in the step, and whether it opened.

    Steps end where a contact closes, so the onset speed is the rate at that end of the step which is nearer to the face. In the
    implicit method a contact counts as closed when it comes within `closing_gap` of its face.
    """
    old, new = get_depth(tables, start, k), get_depth(tables, end, k)
    is_start_nearer = new > -old >= 0.0
    rate = get_depth_rate(tables, start if is_start_nearer else end, k)
    if new <= 0.0 or old <= 0.0:  # else it stays closed
        m[Memory.ONSET] = max(rate, controls.least_onset, controls.least_onset_ratio * m[Memory.FASTEST])
    comes_near = controls.closing_gap > 0.0 and old < -controls.closing_gap <= new and rate > 0.0
    has_closed = new > 0.0 >= old or comes_near
    if has_closed and tables.forces[k, Forces.KIND] == ForceKind.CONTACT:  # of pins FASTEST keeps its least value
        m[Memory.FASTEST] = max(m[Memory.FASTEST], m[Memory.ONSET])
    has_opened = end[k, Report.VALUE] == 0.0 and start[k, Report.VALUE] != 0.0
    return has_closed, has_opened and not has_closed


@kernel_function
def find_face_row(tables, start, end, least):
    """Return the time of a row beside the face of a contact that closes in the step [s]; 0 if none does.

    A contact passes its face near one end of the step. The row is on the other side of the face, twice as far from this end,
    plus `least` [s], so that a record has rows close to the face on both sides: the force jumps there. The time is positive from
    the start of the step, negative from its end.
    """
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            old, new = get_depth(tables, start, k), get_depth(tables, end, k)
            if new > 0.0 >= old:
                is_start_nearer = new > -old
                distance, rate = -old, get_depth_rate(tables, start, k)
                if not is_start_nearer:
                    distance, rate = new, get_depth_rate(tables, end, k)
                if rate > 0.0:
                    time = 2.0 * distance / rate + least
                    return time if is_start_nearer else -time
    return 0.0


@kernel_function
def compute_depth_bending(tables, start, end, h):
    """Return the largest deviation of a closed contact's depth from a straight line, h/8 |rate change|, over the depth."""
    largest = 0.0
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            deep = max(get_depth(tables, start, k), get_depth(tables, end, k))
            if deep > 0.0:
                rate_change = get_depth_rate(tables, end, k) - get_depth_rate(tables, start, k)
                largest = max(largest, 0.125 * h * abs(rate_change) / deep)
    return largest


@kernel_function
def estimate_depth_error(tables, state, shifted, h, k, controls):
    """Return the error of contact k's depth, relative to the largest of depth, its change in the step, and face tolerance.

    An error up to `controls.rounding` counts as 0. The reports `state.end_reports` are those at the end of the step, `shifted`
    those at the end plus its estimated error.
    """
    start, end = state.start_reports, state.end_reports
    old, new = get_depth(tables, start, k), get_depth(tables, end, k)
    deep = max(old, new)
    if deep <= 0.0:
        return 0.0
    change = h * max(abs(get_depth_rate(tables, start, k)), abs(get_depth_rate(tables, end, k)))
    error = abs(get_depth(tables, shifted, k) - new)
    return error / max(deep, change, controls.face_tolerance) if error > controls.rounding else 0.0
