"""Rows that the implicit integrator writes, compiled: at the ends of steps, within them, and after a jump.

Between a step's ends coordinates are the quintic with their values, rates and accelerations there, multipliers the cubic through
the nodes. There are enough rows for linear interpolation between them.
"""

from __future__ import annotations

import numpy as np

from .compiling import copy, draft
from .radau import lagrange, size_of
from .tables import Memory

STRAIGHT = 0.75
"""Straight lines between samples may err by the tolerance to this power, in units of coordinates, and of depths of contacts."""
MOST_SAMPLES = 40
"""Largest number of rows in a step."""
JUMP = 0.1
"""The moment after a jump, of the shortest step."""


@draft
def write(state, out, counts, t, before):
    """Write the present state as a row; bristles and sliding speeds are those of the step before, at time `before`."""
    row = counts.samples
    out.time[row] = t
    copy(state.q, out.q[row]), copy(state.v, out.v[row]), copy(state.a, out.a[row]), copy(state.lam, out.lam[row])
    _write_memory(state, out, row, before)
    for k in range(state.start_memory.shape[0]):
        out.memory[row, k, Memory.ONSET] = state.memory[k, Memory.ONSET]
    counts.samples += 1


@draft
def write_after_jump(state, clock, controls, out, counts):
    """Write a row just after an event, as accelerations and multipliers may jump there."""
    moment = JUMP * controls.shortest
    if clock.time >= controls.end - 2.0 * moment:
        return
    write(state, out, counts, clock.time + moment, clock.time)
    row = counts.samples - 1
    for i in range(state.q.size):
        out.q[row, i], out.v[row, i] = state.q[i] + moment * state.v[i], state.v[i] + moment * state.a[i]


@draft
def write_at_face(state, out, counts, t, h, moment):
    """Write a row `moment` after a step's start at time t or, if negative, before its end, where a force jumps."""
    row, end = counts.samples, moment < 0.0
    q, v, a, lam = (
        (state.node_q[2], state.node_v[2], state.node_a[2], state.node_lam[2]) if end else (state.q, state.v, state.a, state.lam)
    )
    out.time[row] = t + (h if end else 0.0) + moment
    copy(v, out.v[row]), copy(a, out.a[row]), copy(lam, out.lam[row])
    for i in range(q.size):
        out.q[row, i] = q[i] + moment * v[i]
    _write_memory(state, out, row, t)
    counts.samples += 1


@draft
def _write_memory(state, out, row, before):
    """Write the memories of forces used in the step to this row; `write` overwrites onset speeds by later ones."""
    for k in range(state.start_memory.shape[0]):
        m = out.memory[row, k]
        m[Memory.ONSET], m[Memory.STEP_START] = state.start_memory[k, Memory.ONSET], before
        m[Memory.BRISTLE], m[Memory.SLIDING] = state.start_memory[k, Memory.BRISTLE], state.start_memory[k, Memory.SLIDING]


@draft
def samples_in(state, elastic, h, controls, deep):
    """Number of parts of the step for linear interpolation; `deep` is the relative deviation of depths from a line."""
    for i in range(state.q.size):
        state.dq[0, i] = 0.125 * h * h * max(abs(state.a[i]), abs(state.node_a[2, i]))
    bend = max(size_of(state, elastic, state.dq[0]) / controls.tolerance**STRAIGHT, deep / controls.contact_tolerance**STRAIGHT)
    return int(min(MOST_SAMPLES, np.ceil(np.sqrt(bend) + 1e-9)))


@draft
def write_between(state, out, counts, t, h, parts):
    """Write rows within the step from the present state to its end, all parts but the last."""
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
        for j in range(4):
            factor, lam = lagrange(y, j), state.lam if j == 0 else state.node_lam[j - 1]
            for k in range(state.lam.size):
                out.lam[row, k] += factor * lam[k]
        _write_memory(state, out, row, t)
        counts.samples += 1


@draft
def dense(controls):
    """Return True if rows are written within steps."""
    return not controls.fixed and controls.every == 1
