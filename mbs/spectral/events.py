"""Events of the implicit integrator, compiled: contacts that close or open, and jumps of accelerations. See `radau`."""

from __future__ import annotations

from .compiling import copy, draft
from .contacts import reaches_edge, remember_onset, time_to_edges, time_to_faces, touches
from .fronts import solve
from .kernel import changes_at, forces, rows_at
from .lawtable import AFTER
from .radau import renew_heavy
from .samples import dense, write_after_jump
from .tables import ForceKind, Forces, Instant, Memory, Report

FORCE_DECAY = 0.8
"""Share of its largest force that a contact keeps from step to step."""
LANDING = 1e-2
"""Distance from its face at which a contact is at it, over the tolerance and the longest link."""
MOST_JUMP = 0.1
"""Share of the last step, and of the time left, that the step past a face takes at most."""
OUTSIDE = 0.1
"""Distance from a face at which a step to an onset ends, over the landing: ten times what Newton's method leaves. A last node
that its last change moved out of the contact would have the contact's force."""
ROUNDING = 1e-15
"""Least such distance, over the longest link: it is rounding."""


@draft
def restart(model, t):
    """Compute accelerations and multipliers after a jump of them, from M a + G^T lambda = f, G a = change."""
    tables, orders, work, state = model.tables, model.orders, model.work, model.state
    n, r = state.q.size, state.lam.size
    work.b0[:] = 0.0
    copy(state.stress, work.stress)
    forces(tables, work, Instant(t, 0.0, state.q, state.v, state.lam, state.memory), state.force)
    rows_at(tables, work, t, state.gap, state.start_jacobian, state.speed)
    changes_at(tables, work, t, AFTER, state.change)
    for i in range(n):
        state.right[i] = state.force[i]
    for k in range(r):
        state.right[n + k] = state.change[k]
    renew_heavy(tables, orders, work, state, state.q, state.start_jacobian)
    solve(orders.mass, state.saddle_factors, state.saddle_swaps, state.right, state.part)
    for i in range(n):
        state.a[i] = state.right[i]
    for k in range(r):
        state.lam[k] = state.right[n + k]
    copy(work.reports, state.start_reports)


@draft
def landing(state, controls):
    """Distance up to which a contact counts as at its face."""
    return LANDING * controls.tolerance * state.full_unit.max()


@draft
def outside(state, controls):
    """Distance before its face at which a step to an onset ends."""
    return max(OUTSIDE * landing(state, controls), ROUNDING * state.full_unit.max())


@draft
def remember(tables, work, state, controls, counts):
    """Update memories after an accepted step; return True if a contact closed or opened, or an edge is reached."""
    near = 2.0 * outside(state, controls)
    changed = reaches_edge(tables, state.start_reports, work.reports, landing(state, controls), near)
    for k in range(tables.forces.shape[0]):
        kind, m = tables.forces[k, Forces.KIND], state.memory[k]
        copy(m, state.start_memory[k])
        state.largest_force[k] = max(FORCE_DECAY * state.largest_force[k], abs(work.reports[k, Report.VALUE]))
        if touches(tables, k):
            event = remember_onset(tables, state.start_reports, work.reports, k, m, controls, near)
            changed = changed or event != 0
            if event > 0:
                counts.onsets += 1
        if kind == ForceKind.JOURNAL or kind == ForceKind.FRICTION:
            m[Memory.BRISTLE], m[Memory.SLIDING] = work.reports[k, Report.BRISTLE], work.reports[k, Report.SLIP]
    return changed


@draft
def jump(model, clock, controls, out, counts):
    """Restart after a jump of accelerations and multipliers, an Euler step beyond faces of contacts and edges of laws."""
    state, near = model.state, 2.0 * outside(model.state, controls)
    past = max(time_to_faces(model.tables, state.start_reports, near), time_to_edges(model.tables, state.start_reports, near))
    past = min(past, MOST_JUMP * clock.previous, MOST_JUMP * (controls.end - clock.time))
    for i in range(state.q.size):
        state.q[i] += past * state.v[i]
    clock.time, clock.previous, clock.needs_matrix = clock.time + past, 0.0, True
    restart(model, clock.time)
    if dense(controls):
        write_after_jump(state, clock, controls, out, counts)
