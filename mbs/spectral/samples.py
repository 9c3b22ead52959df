"""Rows that the implicit integrator writes, compiled: at the ends of steps, within them, and after a jump.

Within a step coordinates follow the polynomial of fifth degree with the values, rates and accelerations of both ends.
Multipliers follow the cubic through the step's start and nodes. Rows are close enough for linear interpolation between them.
Where accelerations jump there is a row on either side of the jump. `state` is a `RadauState`, `out` an `Output`.
"""

import numpy as np

from .compiling import copy, kernel_function
from .radau import evaluate_lagrange, measure_change
from .tables import Memory

LINE_EXPONENT = 0.75
"""Exponent of the tolerance in the error allowed of linear interpolation between rows; errors of runs go as tol^(3/4)."""
MOST_SAMPLES = 40
"""Largest number of rows in a step: room for so many must be left in the output when a step begins."""
JUMP = 0.1
"""Time between a jump of accelerations and the row beside it, over the shortest step."""


@kernel_function
def write(state, out, counts, t, start):
    """Write the present state as a row: onset speeds are those after the step, bristles those at its `start` [s]."""
    row = counts.samples
    out.time[row] = t
    copy(state.q, out.q[row]), copy(state.v, out.v[row]), copy(state.a, out.a[row]), copy(state.lam, out.lam[row])
    _write_memory(state, out, row, start)
    for k in range(state.start_memory.shape[0]):
        out.memory[row, k, Memory.ONSET] = state.memory[k, Memory.ONSET]
    counts.samples += 1


@kernel_function
def write_after_jump(state, clock, controls, out, counts):
    """Write a row `JUMP` after an event, at which accelerations and multipliers jumped, from an Euler step."""
    moment = JUMP * controls.shortest
    if clock.time >= controls.end - 2.0 * moment:  # the end has a row of its own
        return
    write(state, out, counts, clock.time + moment, clock.time)
    row = counts.samples - 1
    for i in range(state.q.size):
        out.q[row, i], out.v[row, i] = state.q[i] + moment * state.v[i], state.v[i] + moment * state.a[i]


@kernel_function
def write_at_face(state, out, counts, t, h, moment):
    """Write a row within a step in which a contact closes, just past its face: the force jumps at the face.

    The row is `moment` [s] after the step's start or, if that is negative, before its end. In this short time only coordinates
    move, with constant rates.
    """
    row, is_end = counts.samples, moment < 0.0
    q, v, a, lam = state.q, state.v, state.a, state.lam
    if is_end:
        q, v, a, lam = state.node_q[2], state.node_v[2], state.node_a[2], state.node_lam[2]
    out.time[row] = t + (h if is_end else 0.0) + moment
    copy(v, out.v[row]), copy(a, out.a[row]), copy(lam, out.lam[row])
    for i in range(q.size):
        out.q[row, i] = q[i] + moment * v[i]
    _write_memory(state, out, row, t)
    counts.samples += 1


@kernel_function
def _write_memory(state, out, row, start):
    """Write to this row the memories that forces had at the start of the step, and the time of this start."""
    for k in range(state.start_memory.shape[0]):
        m = out.memory[row, k]
        m[Memory.ONSET], m[Memory.STEP_START] = state.start_memory[k, Memory.ONSET], start
        m[Memory.BRISTLE], m[Memory.SLIDING] = state.start_memory[k, Memory.BRISTLE], state.start_memory[k, Memory.SLIDING]


@kernel_function
def count_parts(state, elastic, h, controls, depth_deviation):
    """Return the number of parts of the step between whose ends linear interpolation is accurate enough.

    A quantity deviates from its chord by at most h^2/8 times its second derivative. `depth_deviation` is this deviation of a
    contact's depth, over the depth.
    """
    for i in range(state.q.size):
        state.dq[0, i] = 0.125 * h * h * max(abs(state.a[i]), abs(state.node_a[2, i]))
    coordinates = measure_change(state, elastic, state.dq[0]) / controls.tolerance**LINE_EXPONENT
    deviation = max(coordinates, depth_deviation / controls.contact_tolerance**LINE_EXPONENT)
    return int(min(MOST_SAMPLES, np.ceil(np.sqrt(deviation) + 1e-9)))


@kernel_function
def write_between(state, out, counts, t, h, parts):
    """Write rows within a step from time t, at the ends of all parts but the last."""
    for part in range(1, parts):
        y, row = part / parts, counts.samples
        for i in range(state.q.size):
            v0, a0, v1, a1 = h * state.v[i], h * h * state.a[i], h * state.node_v[2, i], h * h * state.node_a[2, i]
            # q + v0 y + a0 y^2/2 + c3 y^3 + c4 y^4 + c5 y^5
            d0, d1, d2 = state.node_q[2, i] - state.q[i] - v0 - 0.5 * a0, v1 - v0 - a0, a1 - a0
            c3, c4, c5 = 10.0 * d0 - 4.0 * d1 + 0.5 * d2, -15.0 * d0 + 7.0 * d1 - d2, 6.0 * d0 - 3.0 * d1 + 0.5 * d2
            out.q[row, i] = state.q[i] + y * (v0 + y * (0.5 * a0 + y * (c3 + y * (c4 + y * c5))))
            out.v[row, i] = (v0 + y * (a0 + y * (3.0 * c3 + y * (4.0 * c4 + y * 5.0 * c5)))) / h
            out.a[row, i] = (a0 + y * (6.0 * c3 + y * (12.0 * c4 + y * 20.0 * c5))) / (h * h)
        out.time[row], out.lam[row] = t + y * h, 0.0
        for j in range(4):  # start and three nodes
            factor, lam = evaluate_lagrange(y, j), state.lam if j == 0 else state.node_lam[j - 1]
            for k in range(state.lam.size):
                out.lam[row, k] += factor * lam[k]
        _write_memory(state, out, row, t)
        counts.samples += 1
