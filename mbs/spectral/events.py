"""Events of the implicit integrator, compiled: contacts that close or open, edges (jumps or kinks) of laws, restarts."""

from __future__ import annotations

from .compiling import compiled, copy
from .contacts import compute_time_past_events, is_at_edge, is_contact, update_onset
from .fronts import solve
from .kernel import compute_changes, compute_forces, compute_rows
from .lawtable import JUST_AFTER
from .radau import factor_saddle
from .samples import write_after_jump
from .tables import ForceKind, Forces, Instant, Memory, Report

FORCE_DECAY = 0.8
"""Factor by which a contact's largest force is reduced in each step: errors of a force are compared with recent ones."""
MOST_JUMP = 0.1
"""Longest Euler step past a face, as a share of the last step and as a share of the time left."""


@compiled
def _compute_accelerations(model, t):
    """Solve M a + G^T lambda = f, G a = change just after time t; the state's a and lambda may jump there."""
    tables, orders, work, state = model.tables, model.orders, model.work, model.state
    n = state.q.size
    work.kept_gradients[:] = 0.0  # forces of strips follow from the state's stresses alone
    copy(state.stress, work.stress)
    compute_forces(tables, work, Instant(t, 0.0, state.q, state.v, state.lam, state.memory), state.force)
    compute_rows(tables, work, t, state.violation, state.start_jacobian, state.speed)
    compute_changes(tables, work, t, JUST_AFTER, state.change)
    copy(state.force, state.right_side[:n]), copy(state.change, state.right_side[n:])
    factor_saddle(tables, orders, work, state, state.q, state.start_jacobian)
    solve(orders.mass, state.saddle_factors, state.saddle_swaps, state.right_side, state.front_work)
    copy(state.right_side[:n], state.a), copy(state.right_side[n:], state.lam)
    copy(work.reports, state.start_reports)


@compiled
def update_memories(tables, work, state, controls, counts):
    """Update the forces' memories after an accepted step; return True if a contact closed or opened, or an edge is reached."""
    is_event = is_at_edge(tables, state.start_reports, work.reports, controls)
    for k in range(tables.forces.shape[0]):
        kind, m = tables.forces[k, Forces.KIND], state.memory[k]
        copy(m, state.start_memory[k])
        state.largest_force[k] = max(FORCE_DECAY * state.largest_force[k], abs(work.reports[k, Report.VALUE]))
        if is_contact(tables, k):
            event = update_onset(tables, state.start_reports, work.reports, k, m, controls)
            is_event = is_event or event != 0
            if event > 0:
                counts.onsets += 1
        if kind == ForceKind.JOURNAL or kind == ForceKind.FRICTION:
            m[Memory.BRISTLE], m[Memory.SLIDING] = work.reports[k, Report.BRISTLE], work.reports[k, Report.SLIP]
    return is_event


@compiled
def restart_past_event(model, clock, controls, out, counts):
    """Restart past an event, where accelerations and multipliers jump.

    An Euler step moves contacts that are about to close beyond their face, and measures beyond their edge.
    """
    state = model.state
    h = compute_time_past_events(model.tables, state.start_reports, controls.closing_gap)
    h = min(h, MOST_JUMP * clock.previous, MOST_JUMP * (controls.end - clock.time))
    for i in range(state.q.size):
        state.q[i] += h * state.v[i]
    clock.time, clock.previous, clock.needs_matrix = clock.time + h, 0.0, True
    _compute_accelerations(model, clock.time)
    if controls.writes_within_steps:
        write_after_jump(state, clock, controls, out, counts)
