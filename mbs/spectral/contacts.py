"""Contacts with faces, and edges of laws, over a step, compiled: onsets, releases, errors of depths.

An edge is a value of a measure at which the law of its force has a jump or kink. `start` and `end` are the forces' reports at
both ends of the step, arrays (forces, 8) of the columns `Report`. A depth is positive inside a face, or beyond an edge. Between
the ends of a step a depth follows the cubic with its values and rates there.

An implicit step to a face or edge aims at `controls.stop_gap` [m] before it: a node inside the face would already have the
contact's force. The step's end has an error of at most `stop_gap`. So the step ends outside, at most `controls.closing_gap` =
2 `stop_gap` before the face. The contact then counts as closed, and `events` moves the coordinates past the face. An explicit
step ends at the face: both gaps are 0. A contact within `controls.face_tolerance` [m] counts as at its face.
"""

from enum import IntEnum

import numpy as np

from ..laws.table import LawColumn, NormalKind
from .compiling import kernel_function
from .tables import ForceKind, Forces, Memory, Report

NEVER = 2.0
"""Fraction of a step returned if nothing happens in it; any number above 1."""
ContactData = IntEnum("ContactData", "SIDE FACE", start=0)
"""Numbers of a contact with a face in `tables.data`. SIDE is 1 if the measure grows into the face, else -1. FACE is the value of
the measure at the face."""


@kernel_function
def is_contact(tables, k):
    """Return True if force k is a contact."""
    return tables.forces[k, Forces.KIND] == ForceKind.CONTACT or tables.forces[k, Forces.KIND] == ForceKind.JOURNAL


@kernel_function
def has_smooth_onset(tables, k):
    """Return True if no step need end at the onset of contact k: its force has no kink there, its law no onset speed."""
    law = tables.forces[k, Forces.LAW]
    exponent = tables.law_numbers[law, 1]  # numbers of IMPACT: stiffness, exponent of the depth, damping, damping depth
    # laws of a coefficient of restitution divide by the onset speed, and users' laws may use it
    return tables.laws[law, LawColumn.KIND] == NormalKind.IMPACT and exponent > 1.0


@kernel_function
def get_depth(tables, reports, k):
    """Return the depth of contact k [m], negative outside, and its rate [m/s]."""
    length, rate = reports[k, Report.LENGTH], reports[k, Report.RATE]
    if tables.forces[k, Forces.KIND] == ForceKind.JOURNAL:
        return length, rate  # the report of a pin has the depth in the column LENGTH
    number = tables.forces[k, Forces.NUMBERS]
    side, face = tables.data[number + ContactData.SIDE], tables.data[number + ContactData.FACE]
    return side * (length - face), side * rate


@kernel_function
def _get_distance(tables, reports, i):
    """Return a measure less its value at edge i, and its rate."""
    k, edge = int(tables.edges[i, 0]), tables.edges[i, 1]
    return reports[k, Report.LENGTH] - edge, reports[k, Report.RATE]


@kernel_function
def _get_depth_ahead(tables, reports, i):
    """Return the depth beyond edge i in the direction in which the measure moves, and the speed; at rest it counts as falling."""
    distance, rate = _get_distance(tables, reports, i)
    return distance if rate > 0.0 else -distance, abs(rate)


@kernel_function
def evaluate_cubic(x, h, start, end):
    """Evaluate, at fraction x of a step of length h, Hermite's cubic with these pairs (value, rate) at its ends."""
    from_start = (1.0 + 2.0 * x) * start[0] + x * h * start[1]
    from_end = (3.0 - 2.0 * x) * end[0] + (x - 1.0) * h * end[1]
    return (1.0 - x) ** 2 * from_start + x * x * from_end


@kernel_function
def find_zero(h, start, end):
    """Find a fraction of the step at which a cubic of `evaluate_cubic`, negative at the start, passes zero; NEVER if none."""
    low, high = 0.0, 1.0
    if not end[0] > 0.0:  # nan counts as negative; then it must rise at the start and fall at the end
        if not (start[1] > 0.0 and end[1] < 0.0):
            return NEVER
        high = _find_maximum(h, start, end)
        if not evaluate_cubic(high, h, start, end) > 0.0:
            return NEVER
    for _ in range(60):  # bisection down to rounding
        middle = 0.5 * (low + high)
        if evaluate_cubic(middle, h, start, end) > 0.0:
            high = middle
        else:
            low = middle
    return high


@kernel_function
def _find_maximum(h, start, end):
    """Find the fraction of the step at which a cubic, rising at its start and falling at its end, is largest."""
    # its derivative by the fraction, a x^2 + b x + c, passes zero once: from c > 0 to a + b + c < 0
    rise, c = 6.0 * (end[0] - start[0]), h * start[1]
    a, b = 3.0 * h * (start[1] + end[1]) - rise, rise - 4.0 * c - 2.0 * h * end[1]
    root = np.sqrt(b * b - 4.0 * a * c)
    return 2.0 * c / (root - b) if b < 0.0 else -(b + root) / (2.0 * a)  # without cancellation


@kernel_function
def find_first_event(tables, start, end, h, controls):
    """Find the fraction of the step at which the first contact closes, or the first measure reaches an edge; NEVER if none.

    A smooth onset counts only if the contact opens again before the end of the step, or if `controls.stops_at_all_onsets`.
    Explicit runs have no edges in their tables.
    """
    first = NEVER
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            old, new = get_depth(tables, start, k), get_depth(tables, end, k)
            ends_open = new[0] <= 0.0
            if controls.stops_at_all_onsets or ends_open or not has_smooth_onset(tables, k):
                first = min(first, _find_arrival(h, old, new, controls))
    for i in range(tables.edges.shape[0]):
        old, new = _get_distance(tables, start, i), _get_distance(tables, end, i)
        side = -1.0 if old[0] > 0.0 else 1.0  # so that the depth is negative at the start
        first = min(first, _find_arrival(h, (side * old[0], side * old[1]), (side * new[0], side * new[1]), controls))
    return first


@kernel_function
def _find_arrival(h, old, new, controls):
    """Find the fraction of the step at which a depth reaches the aim, `stop_gap` before the face; NEVER if it does not.

    `old` and `new` are the depth and its rate at the start and end. A depth that starts at the face does not arrive. A step that
    ends at its aim, but for the error allowed there, need not be shortened.
    """
    gap = controls.stop_gap
    error_allowed = gap if gap > 0.0 else controls.face_tolerance
    starts_outside, ends_off_aim = old[0] < -controls.face_tolerance, abs(new[0] + gap) > error_allowed
    if not (starts_outside and ends_off_aim):
        return NEVER
    return find_zero(h, (old[0] + gap, old[1]), (new[0] + gap, new[1]))


@kernel_function
def is_at_edge(tables, start, end, controls):
    """Return True if the step has brought a measure within `closing_gap` before an edge of its law."""
    for i in range(tables.edges.shape[0]):
        started_off_edge = abs(_get_distance(tables, start, i)[0]) > controls.face_tolerance
        depth, _ = _get_depth_ahead(tables, end, i)
        if started_off_edge and -controls.closing_gap <= depth <= 0.0:
            return True
    return False


@kernel_function
def compute_time_past_events(tables, reports, gap):
    """Return the time [s] in which depths within `gap` before a face or edge pass it by a tenth of `gap`; 0 for none."""
    time = 0.0
    for i in range(tables.edges.shape[0]):
        time = max(time, _compute_time_past(_get_depth_ahead(tables, reports, i), gap))
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            time = max(time, _compute_time_past(get_depth(tables, reports, k), gap))
    return time


@kernel_function
def _compute_time_past(place, gap):
    """Return the time [s] of `compute_time_past_events` for one depth; `place` is the depth and its rate."""
    depth, rate = place
    return (0.1 * gap - depth) / rate if -gap <= depth <= 0.0 and rate > 0.0 else 0.0


@kernel_function
def has_released(tables, state, end, controls):
    """Return True if a contact opens in the step, which must then end nearer to the opening: the force has a kink there."""
    start, face_tolerance = state.start_reports, controls.face_tolerance
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            negligible = controls.contact_tolerance * state.largest_force[k]  # of recent steps
            (old, rate), (new, _) = get_depth(tables, start, k), get_depth(tables, end, k)
            is_moved = abs(new - old) > controls.rounding  # else a shorter step would not move it at all
            opens = is_moved and end[k, Report.VALUE] == 0.0 and abs(start[k, Report.VALUE]) > negligible
            # also one that starts at its face, moves inwards and ends outside
            if opens or (abs(old) <= face_tolerance and rate > 0.0 and new < -face_tolerance):
                return True
    return False


@kernel_function
def update_onset(tables, start, end, k, memory, controls):
    """Update the `memory` (4,) of contact k after a step; return whether it closed in the step, and whether it opened.

    Steps end where a contact closes. So the onset speed is the rate at that end of the step which is nearer to the face. Laws
    divide by it, so it is at least `least_onset`, and at least a share of FASTEST, the fastest onset so far. While the contact is
    open it follows the rate, as there is no force.
    """
    (old, old_rate), (new, new_rate) = get_depth(tables, start, k), get_depth(tables, end, k)
    is_start_nearer = old <= 0.0 and -old < new
    rate = old_rate if is_start_nearer else new_rate
    if new <= 0.0 or old <= 0.0:  # else it stays closed
        memory[Memory.ONSET] = max(rate, controls.least_onset, controls.least_onset_ratio * memory[Memory.FASTEST])
    # an implicit step ends within `closing_gap` before the face
    comes_near = controls.closing_gap > 0.0 and old < -controls.closing_gap <= new and rate > 0.0
    has_closed = new > 0.0 >= old or comes_near
    if has_closed and tables.forces[k, Forces.KIND] == ForceKind.CONTACT:  # of a pin only `least_onset` counts
        memory[Memory.FASTEST] = max(memory[Memory.FASTEST], memory[Memory.ONSET])
    has_opened = end[k, Report.VALUE] == 0.0 and start[k, Report.VALUE] != 0.0  # damping ends a force before the depth is 0
    return has_closed, has_opened and not has_closed


@kernel_function
def find_time_past_face(tables, start, end, least):
    """Return the time [s] of a row just past the face of a contact that closes in the step; 0 if none does.

    The force jumps at the face, so a record needs a row on either side: the step's nearer end, and one at twice the time from
    there to the face, plus `least`; a negative time is counted back from the step's end.
    """
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            (old, old_rate), (new, new_rate) = get_depth(tables, start, k), get_depth(tables, end, k)
            if new > 0.0 >= old:
                is_start_nearer = -old < new
                rate = old_rate if is_start_nearer else new_rate
                if rate > 0.0:
                    time = 2.0 * min(-old, new) / rate + least
                    return time if is_start_nearer else -time
    return 0.0


@kernel_function
def compute_depth_deviation(tables, start, end, h):
    """Return the largest deviation of a closed contact's depth from the line between its ends, over the deeper end."""
    largest = 0.0  # h^2/8 times the second rate, (change of the rate)/h
    for k in range(tables.forces.shape[0]):
        if is_contact(tables, k):
            (old, old_rate), (new, new_rate) = get_depth(tables, start, k), get_depth(tables, end, k)
            deepest = max(old, new)
            if deepest > 0.0:
                largest = max(largest, 0.125 * h * abs(new_rate - old_rate) / deepest)
    return largest


@kernel_function
def estimate_depth_error(tables, state, shifted, h, k, controls):
    """Return the error of contact k's depth, relative to the largest of depth, its change in the step, and face tolerance."""
    (old, old_rate), (new, new_rate) = get_depth(tables, state.start_reports, k), get_depth(tables, state.end_reports, k)
    deepest = max(old, new)
    error = abs(get_depth(tables, shifted, k)[0] - new)  # shifted: reports at the end state plus its estimated error
    if deepest > 0.0 and error > controls.rounding:
        return error / max(deepest, h * max(abs(old_rate), abs(new_rate)), controls.face_tolerance)
    return 0.0
