"""Contacts, and edges of laws (where a law has a jump or kink), over a step, compiled: onsets, releases, errors of depths.

`start` and `end` are the forces' reports at both ends of the step, arrays (forces, 8) of the columns `Report`. A depth is
positive inside a face. Onsets and edges are zeros of the cubic through the values and rates at both ends.

Distances in `controls` [m]: a contact counts as at its face within `face_tolerance`. An implicit step to a face or edge aims at
`stop_gap` before it, as a node inside the face would have the contact's force. Its error is at most `stop_gap`, so it ends within
`closing_gap` = 2 `stop_gap` of the face and outside; then the contact counts as closed, and `events` moves the coordinates past
the face (restart). Explicit steps end at the face: both gaps are 0.
"""

from enum import IntEnum

import numpy as np

from ..laws.table import LawColumn, NormalKind
from .compiling import kernel_function
from .tables import ForceKind, Forces, Memory, Report

BEYOND = 0.1
"""Distance beyond a face or edge to which a restart moves, over `closing_gap`: above 0, so that the contact counts as closed."""
NEVER = 2.0
"""Fraction of a step returned if nothing happens in it; any number above 1."""
ContactData = IntEnum("ContactData", "SIDE FACE", start=0)
"""Numbers of a contact with a face in `tables.data`: 1 if its measure grows into the face, else -1; the measure at the face."""


@kernel_function
def is_contact(tables, k):
    """Return True if force k is a contact."""
    return tables.forces[k, Forces.KIND] == ForceKind.CONTACT or tables.forces[k, Forces.KIND] == ForceKind.JOURNAL


@kernel_function
def has_smooth_onset(tables, k):
    """Return True if no step need end at the onset of contact k: its force has no kink there and no onset speed in its law."""
    law = tables.forces[k, Forces.LAW]
    exponent = tables.law_numbers[law, 1]  # numbers of IMPACT: stiffness, exponent of the depth, damping, damping depth
    return tables.laws[law, LawColumn.KIND] == NormalKind.IMPACT and exponent > 1.0


@kernel_function
def get_depth(tables, reports, k):
    """Return the depth of contact k [m], negative outside."""
    if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL:
        return reports[k, Report.LENGTH]  # of a pin this column has the depth, of other forces their measure
    number = tables.forces[k, Forces.NUMBERS]
    side, face = tables.data[number + ContactData.SIDE], tables.data[number + ContactData.FACE]
    return side * (reports[k, Report.LENGTH] - face)


@kernel_function
def get_depth_rate(tables, reports, k):
    """Return the rate of contact k's depth [m/s]."""
    if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL:
        return reports[k, Report.RATE]
    return tables.data[tables.forces[k, Forces.NUMBERS] + ContactData.SIDE] * reports[k, Report.RATE]


@kernel_function
def evaluate_cubic(x, h, start, start_rate, end, end_rate):
    """Evaluate, at fraction x of a step of length h, the Hermite cubic with these values and rates at its ends."""
    from_start = (1.0 + 2.0 * x) * start + x * h * start_rate
    from_end = (3.0 - 2.0 * x) * end + (x - 1.0) * h * end_rate
    return (1.0 - x) ** 2 * from_start + x * x * from_end


@kernel_function
def find_zero(h, start, start_rate, end, end_rate):
    """Find a fraction of the step at which the cubic, negative at its start, passes zero; NEVER if it does not.

    If it ends below zero, too, only a cubic that rises at the start and falls at the end is examined.
    """
    low, high = 0.0, 1.0
    if not end > 0.0:  # nan counts as negative
        if not (start_rate > 0.0 and end_rate < 0.0):
            return NEVER
        high = _find_maximum(h, start, start_rate, end, end_rate)
        if not evaluate_cubic(high, h, start, start_rate, end, end_rate) > 0.0:
            return NEVER
    for _ in range(60):  # bisection down to rounding
        middle = 0.5 * (low + high)
        if evaluate_cubic(middle, h, start, start_rate, end, end_rate) > 0.0:
            high = middle
        else:
            low = middle
    return high


@kernel_function
def _find_maximum(h, start, start_rate, end, end_rate):
    """Find the fraction of the step at which the cubic, rising at its start and falling at its end, is largest."""
    # its derivative by the fraction, a x^2 + b x + c, passes zero once: from c > 0 to a + b + c < 0
    rise, c = 6.0 * (end - start), h * start_rate
    a, b = 3.0 * h * (start_rate + end_rate) - rise, rise - 4.0 * c - 2.0 * h * end_rate
    root = np.sqrt(b * b - 4.0 * a * c)
    return 2.0 * c / (root - b) if b < 0.0 else -(b + root) / (2.0 * a)  # without cancellation


@kernel_function
def find_first_onset(tables, start, end, h, controls):
    """Find the fraction of the step at which the first open contact closes; NEVER if none does.

    A contact that starts within `face_tolerance` of its face counts as closed. A step that already ends `stop_gap` before the
    face, up to an error, need not end there again. A smooth onset counts only if the contact opens again before the end of the
    step, or if `controls.stops_at_all_onsets`.
    """
    first, face_tolerance, gap = NEVER, controls.face_tolerance, controls.stop_gap
    allowed = gap if gap > 0.0 else face_tolerance  # error of the place at which a step to a face ends [m]
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            d0, d1 = get_depth(tables, start, k), get_depth(tables, end, k)
            ends_open = d1 <= 0.0
            is_wanted = controls.stops_at_all_onsets or ends_open or not has_smooth_onset(tables, k)
            is_open, ends_elsewhere = d0 < -face_tolerance, abs(d1 + gap) > allowed
            if is_wanted and is_open and ends_elsewhere:
                start_rate, end_rate = get_depth_rate(tables, start, k), get_depth_rate(tables, end, k)
                first = min(first, find_zero(h, d0 + gap, start_rate, d1 + gap, end_rate))
    return first


@kernel_function
def find_first_edge(tables, start, end, h, controls):
    """Find the fraction of an implicit step at which a measure is first `stop_gap` before an edge of its law, or NEVER."""
    first, gap = NEVER, controls.stop_gap  # above 0
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
    """Return the time [s] in which depths and measures within `gap` before a face or edge pass it by BEYOND * gap; 0 for none."""
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
    """Return True if a contact opens in the step, which must then end nearer to the opening: the force has a kink there.

    A release from a negligible force does not count. A contact also opens that starts at its face, moves inwards, ends outside.
    """
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

    Steps end where a contact closes, so the onset speed is the rate at that end of the step which is nearer to the face. Laws
    divide by it, so it has a least value. Outside it follows the rate, as there is no force.
    """
    old, new = get_depth(tables, start, k), get_depth(tables, end, k)
    is_start_nearer = new > -old >= 0.0
    rate = get_depth_rate(tables, start if is_start_nearer else end, k)
    if new <= 0.0 or old <= 0.0:  # else it stays closed
        m[Memory.ONSET] = max(rate, controls.least_onset, controls.least_onset_ratio * m[Memory.FASTEST])
    # an implicit step ends within `closing_gap` before the face
    comes_near = controls.closing_gap > 0.0 and old < -controls.closing_gap <= new and rate > 0.0
    has_closed = new > 0.0 >= old or comes_near
    if has_closed and tables.forces[k, Forces.KIND] == ForceKind.CONTACT:  # not of pins: FASTEST stays as the run began
        m[Memory.FASTEST] = max(m[Memory.FASTEST], m[Memory.ONSET])
    has_opened = end[k, Report.VALUE] == 0.0 and start[k, Report.VALUE] != 0.0  # damping ends a force before the depth is 0
    return has_closed, has_opened and not has_closed


@kernel_function
def find_time_past_face(tables, start, end, least):
    """Return the time [s] of a sample just past the face of a contact that closes in the step; 0 if none does.

    The force jumps at the face, so a record needs a sample close to it on either side. One is the end of the step that is near
    the face. The other lies past the face, at twice the time from there, plus `least` [s]: negative if before the step's end.
    """
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            old, new = get_depth(tables, start, k), get_depth(tables, end, k)
            if new > 0.0 >= old:
                is_start_nearer = new > -old
                rate = get_depth_rate(tables, start if is_start_nearer else end, k)
                if rate > 0.0:
                    time = 2.0 * min(-old, new) / rate + least
                    return time if is_start_nearer else -time
    return 0.0


@kernel_function
def compute_depth_deviation(tables, start, end, h):
    """Return the largest deviation of a closed contact's depth from the line between its ends, over the deeper end.

    It is h^2/8 times the second rate, (change of the rate)/h, and decides how many samples the step needs.
    """
    largest = 0.0
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            deepest = max(get_depth(tables, start, k), get_depth(tables, end, k))
            if deepest > 0.0:
                rate_change = get_depth_rate(tables, end, k) - get_depth_rate(tables, start, k)
                largest = max(largest, 0.125 * h * abs(rate_change) / deepest)
    return largest


@kernel_function
def estimate_depth_error(tables, state, shifted, h, k, controls):
    """Return the error of contact k's depth, relative to the largest of depth, its change in the step, and face tolerance.

    An error up to `controls.rounding` counts as 0. `shifted` are reports at the end of the step plus its estimated error.
    """
    start, end = state.start_reports, state.end_reports
    old, new = get_depth(tables, start, k), get_depth(tables, end, k)
    deepest = max(old, new)
    if deepest <= 0.0:
        return 0.0
    change = h * max(abs(get_depth_rate(tables, start, k)), abs(get_depth_rate(tables, end, k)))
    error = abs(get_depth(tables, shifted, k) - new)
    return error / max(deepest, change, controls.face_tolerance) if error > controls.rounding else 0.0
