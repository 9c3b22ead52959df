"""Rows that the implicit integrator writes, compiled: at the ends of steps, within them, and after a jump.

Within a step coordinates follow the polynomial of fifth degree with the values, rates and accelerations of both ends.
Multipliers follow the cubic through the step's start and nodes. Rows are close enough for linear interpolation between them.
Where accelerations jump there is a row on either side of the jump. `state` is a `RadauState`, `out` the `Output`, t and h are a
step's start and length [s]. The module `output` defines the records `clock`, `controls`, `counts`; counts.samples is the number
of rows so far. A row has the forces' memories, from which forces are computed again: onset speeds, and bristles and sliding
speeds at the start of a step.
"""

import numpy as np

from .compiling import copy, kernel_function
from .radau import evaluate_lagrange, measure_change
from .tables import STEP_START, Memory

LINE_EXPONENT = 0.75
"""Error allowed of linear interpolation between rows: the tolerance to this power, as the error of a run falls more slowly than
its tolerance. With 1 a run at tolerance 1e-5 would have four times as many rows."""
MOST_SAMPLES = 40
"""Largest number of parts of a step, each with a row; chosen. In a longer step linear interpolation errs by more than asked."""
ROWS_OF_A_STEP = MOST_SAMPLES + 5
"""Most rows of a step: up to 3 after close kinks at its start, MOST_SAMPLES - 1 between its parts, and one each at a face, at its
end and after an event. A call of the integrator begins no step for which its `out` may lack rows."""
JUMP = 0.1
"""Time from a jump of accelerations to the row just after it, over the shortest step; chosen: well before the next row."""
END = 2
"""Index of the node at the end of a step."""


@kernel_function
def write(state, out, counts, t, start):
    """Write the present state as a row at time t, after a step that began at `start`; onset speeds are those after the step."""
    row = counts.samples
    out.time[row] = t
    copy(state.q, out.q[row]), copy(state.v, out.v[row]), copy(state.a, out.a[row]), copy(state.lam, out.lam[row])
    _end_row(state, state.memory, out, counts, start)


@kernel_function
def write_after_jump(state, clock, controls, out, counts):
    """Write a row `JUMP` after an event, with the accelerations and multipliers that it left; q and v by Euler's method."""
    moment = JUMP * controls.shortest
    if clock.time >= controls.end - 2.0 * moment:  # less than `moment` would be left to the row at the end
        return
    write(state, out, counts, clock.time + moment, clock.time)  # then replace q and v
    row = counts.samples - 1
    for i in range(state.q.size):
        out.q[row, i], out.v[row, i] = state.q[i] + moment * state.v[i], state.v[i] + moment * state.a[i]


@kernel_function
def write_at_face(state, out, counts, t, h, moment):
    """Write a row within a step in which a contact closes, just past its face: the force jumps at the face.

    The row's time is t + `moment` or, if `moment` is negative, t + h + `moment`: so near the step's start or end that only the
    coordinates move. Onset speeds are those before the step, with which its forces were computed.
    """
    row, is_near_end = counts.samples, moment < 0.0
    q, v, a, lam = state.q, state.v, state.a, state.lam
    if is_near_end:
        q, v, a, lam = state.node_q[END], state.node_v[END], state.node_a[END], state.node_lam[END]
    out.time[row] = t + h + moment if is_near_end else t + moment
    copy(v, out.v[row]), copy(a, out.a[row]), copy(lam, out.lam[row])
    for i in range(q.size):
        out.q[row, i] = q[i] + moment * v[i]
    _end_row(state, state.start_memory, out, counts, t)


@kernel_function
def _end_row(state, onset_memory, out, counts, start):
    """Write forces' memories to a row: onset speeds from `onset_memory`, the others as they were at the step's `start` [s]."""
    for k in range(state.start_memory.shape[0]):
        m = out.memory[counts.samples, k]
        m[Memory.ONSET], m[STEP_START] = onset_memory[k, Memory.ONSET], start
        m[Memory.BRISTLE], m[Memory.SLIDING] = state.start_memory[k, Memory.BRISTLE], state.start_memory[k, Memory.SLIDING]
    counts.samples += 1


@kernel_function
def count_parts(state, elastic, h, controls, depth_deviation):
    """Return the number of parts of a step in each of which linear interpolation between its ends is accurate enough.

    In a step of length h a quantity deviates from the line between its ends by at most h^2/8 times its second derivative, in k
    parts by 1/k^2 of this. `depth_deviation` is that of a contact's depth over the depth, for k = 1. `elastic` lists the
    deformations to which the error control gives units of their own.
    """
    deviations = state.dq[0]  # of the coordinates, in an array that serves as work space
    for i in range(state.q.size):
        deviations[i] = 0.125 * h * h * max(abs(state.a[i]), abs(state.node_a[END, i]))
    largest = measure_change(state, elastic, deviations)  # in units of the error control, as the tolerance
    of_coordinates = largest / controls.tolerance**LINE_EXPONENT
    of_depth = depth_deviation / controls.contact_tolerance**LINE_EXPONENT
    parts = np.ceil(np.sqrt(max(of_coordinates, of_depth)) + 1e-9)  # 1e-9: one part if both are 0
    return int(min(MOST_SAMPLES, parts))


@kernel_function
def write_between(state, out, counts, t, h, parts):
    """Write rows within a step from time t, at the ends of all parts but the last, by Hermite's quintic in y = (time - t)/h."""
    for part in range(1, parts):
        y, row = part / parts, counts.samples
        for i in range(state.q.size):
            # q + v0 y + a0 y^2/2 + c3 y^3 + c4 y^4 + c5 y^5
            v0, v1 = h * state.v[i], h * state.node_v[END, i]  # dq/dy at both ends
            a0, a1 = h * h * state.a[i], h * h * state.node_a[END, i]  # the second derivatives
            # differences from the quadratic q + v0 y + a0 y^2/2 at y = 1: of the value and both derivatives
            d0, d1, d2 = state.node_q[END, i] - state.q[i] - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0
            c3, c4, c5 = 10.0 * d0 - 4.0 * d1 + 0.5 * d2, -15.0 * d0 + 7.0 * d1 - d2, 6.0 * d0 - 3.0 * d1 + 0.5 * d2
            out.q[row, i] = state.q[i] + y * (v0 + y * (0.5 * a0 + y * (c3 + y * (c4 + y * c5))))
            out.v[row, i] = (v0 + y * (a0 + y * (3.0 * c3 + y * (4.0 * c4 + y * 5.0 * c5)))) / h
            out.a[row, i] = (a0 + y * (6.0 * c3 + y * (12.0 * c4 + y * 20.0 * c5))) / (h * h)
        out.time[row], out.lam[row] = t + y * h, 0.0
        for j in range(4):  # start and three nodes
            factor, lam = evaluate_lagrange(y, j), state.lam if j == 0 else state.node_lam[j - 1]
            for k in range(state.lam.size):
                out.lam[row, k] += factor * lam[k]
        _end_row(state, state.start_memory, out, counts, t)
