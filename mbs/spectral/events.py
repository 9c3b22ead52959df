"""Events of the implicit integrator, compiled: contacts that close or open, edges (jumps or kinks) of laws, restarts."""

from __future__ import annotations

from .compiling import copy, draft
from .contacts import compute_time_to_edges, compute_time_to_faces, is_at_edge, is_contact, update_onset
from .fronts import solve
from .kernel import compute_changes, compute_forces, compute_rows
from .lawtable import AFTER
from .radau import factor_saddle
from .samples import write_after_jump, writes_within_steps
from .tables import ForceKind, Forces, Instant, Memory, Report

FORCE_DECAY = 0.8
"""Factor by which a contact's largest force so far is reduced in each step."""
LANDING = 1e-2
"""Distance from its face at which a contact counts as at it, over the tolerance and the longest link."""
MOST_JUMP = 0.1
"""Longest Euler step past a face, over the last step and over the time left."""
OUTSIDE = 0.1
"""Distance before a face at which a step to an onset ends, over the landing distance: ten times the error left by Newton's
method. A last node inside the face would already have the contact's force."""
ROUNDING = 1e-15
"""Least distance before a face, over the longest link: rounding."""


@draft
def _compute_accelerations(model, t):
    """Compute accelerations and multipliers after a jump of them, from M a + G^T lambda = f, G a = change."""
    tables, orders, work, state = model.tables, model.orders, model.work, model.state
    n, r = state.q.size, state.lam.size
    work.b0[:] = 0.0
    copy(state.stress, work.stress)
    compute_forces(tables, work, Instant(t, 0.0, state.q, state.v, state.lam, state.memory), state.force)
    compute_rows(tables, work, t, state.violation, state.start_jacobian, state.speed)
    compute_changes(tables, work, t, AFTER, state.change)
    for i in range(n):
        state.right_side[i] = state.force[i]
    for k in range(r):
        state.right_side[n + k] = state.change[k]
    factor_saddle(tables, orders, work, state, state.q, state.start_jacobian)
    solve(orders.mass, state.saddle_factors, state.saddle_swaps, state.right_side, state.front_work)
    for i in range(n):
        state.a[i] = state.right_side[i]
    for k in range(r):
        state.lam[k] = state.right_side[n + k]
    copy(work.reports, state.start_reports)


@draft
def compute_landing(state, controls):
    """Return the distance up to which a contact counts as at its face [m]."""
    return LANDING * controls.tolerance * state.full_unit.max()


@draft
def compute_outside(state, controls):
    """Return the distance before its face at which a step to an onset ends [m]."""
    return max(OUTSIDE * compute_landing(state, controls), ROUNDING * state.full_unit.max())


@draft
def update_memories(tables, work, state, controls, counts):
    """Update the forces' memories after an accepted step; return True if a contact closed or opened, or an edge is reached."""
    near = 2.0 * compute_outside(state, controls)
    is_event = is_at_edge(tables, state.start_reports, work.reports, compute_landing(state, controls), near)
    for k in range(tables.forces.shape[0]):
        kind, m = tables.forces[k, Forces.KIND], state.memory[k]
        copy(m, state.start_memory[k])
        state.largest_force[k] = max(FORCE_DECAY * state.largest_force[k], abs(work.reports[k, Report.VALUE]))
        if is_contact(tables, k):
            event = update_onset(tables, state.start_reports, work.reports, k, m, controls, near)
            is_event = is_event or event != 0
            if event > 0:
                counts.onsets += 1
        if kind == ForceKind.JOURNAL or kind == ForceKind.FRICTION:
            m[Memory.BRISTLE], m[Memory.SLIDING] = work.reports[k, Report.BRISTLE], work.reports[k, Report.SLIP]
    return is_event


@draft
def restart_past_event(model, clock, controls, out, counts):
    """Restart after a jump of accelerations and multipliers, past the event.

    An Euler step moves contacts that are about to close beyond their face, and measures beyond their edge.
    """
    state, near = model.state, 2.0 * compute_outside(model.state, controls)
    to_faces = compute_time_to_faces(model.tables, state.start_reports, near)
    h = max(to_faces, compute_time_to_edges(model.tables, state.start_reports, near))
    h = min(h, MOST_JUMP * clock.previous, MOST_JUMP * (controls.end - clock.time))
    for i in range(state.q.size):
        state.q[i] += h * state.v[i]
    clock.time, clock.previous, clock.needs_matrix = clock.time + h, 0.0, True
    _compute_accelerations(model, clock.time)
    if writes_within_steps(controls):
        write_after_jump(state, clock, controls, out, counts)
