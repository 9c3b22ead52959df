"""Events of the implicit integrator, compiled: contacts that close or open, edges (jumps or kinks) of laws, restarts.

G is the Jacobian of the constraints; G v = speed and G a = change are their first and second time derivatives. Reports of forces
(forces, 8) have the columns `Report`: `state.start_reports` at the start of the step, `work.reports` at its end.
"""

from .compiling import copy, kernel_function
from .contacts import compute_time_past_events, is_at_edge, is_contact, update_onset
from .fronts import solve
from .kernel import compute_changes, compute_forces, compute_rows
from .lawtable import JUST_AFTER
from .radau import factor_saddle
from .samples import write_after_jump
from .tables import ForceKind, Forces, Instant, Memory, Report


@kernel_function
def compute_start(model, t):
    """Compute forces, their reports and the constraints at the start of a step, the present state at time t."""
    tables, work, state = model.tables, model.work, model.state
    work.kept_gradients[:] = 0.0  # B0 of `strips`, so that their forces are those of the stresses alone, without residual
    copy(state.stress, work.stress)
    since = 0.0  # time since the start of the step
    compute_forces(tables, work, Instant(t, since, state.q, state.v, state.lam, state.memory), state.force)
    compute_rows(tables, work, t, state.violation, state.start_jacobian, state.speed)
    copy(work.reports, state.start_reports)


@kernel_function
def update_memories(tables, work, state, controls, counts):
    """Update the forces' memories after an accepted step; return True if a contact closed or opened, or an edge is reached."""
    is_event = is_at_edge(tables, state.start_reports, work.reports, controls)
    for k in range(tables.forces.shape[0]):
        kind, m = tables.forces[k, Forces.KIND], state.memory[k]
        copy(m, state.start_memory[k])  # m becomes the memory after the step
        # of recent steps, for the error control: with 0.8, chosen, a third of a force counts after five steps
        state.largest_force[k] = max(0.8 * state.largest_force[k], abs(work.reports[k, Report.VALUE]))
        if is_contact(tables, k):
            has_closed, has_opened = update_onset(tables, state.start_reports, work.reports, k, m, controls)
            is_event = is_event or has_closed or has_opened
            if has_closed:
                counts.onsets += 1
        if kind == ForceKind.JOURNAL or kind == ForceKind.FRICTION:
            m[Memory.BRISTLE], m[Memory.SLIDING] = work.reports[k, Report.BRISTLE], work.reports[k, Report.SLIP]
    return is_event


@kernel_function
def restart_past_event(model, clock, controls, out, counts):
    """Restart past an event, where accelerations and multipliers jump.

    A step ends just before a face or edge. The coordinates are moved just beyond it at constant rates: the depth of the contact
    changes by at most 1.1 `closing_gap`. This is so little that neither constraints nor rates are corrected.
    """
    tables, orders, state = model.tables, model.orders, model.state
    # state.start_reports are those of the present state, at which the last step has ended
    h = compute_time_past_events(tables, state.start_reports, controls.closing_gap)
    h = min(h, 0.1 * clock.previous, 0.1 * (controls.end - clock.time))  # 0.1: chosen
    n = state.q.size
    for i in range(n):
        state.q[i] += h * state.v[i]
    clock.time, clock.needs_matrix = clock.time + h, True
    clock.previous = 0.0  # the next step starts from the accelerations, not from the polynomial of the last step
    compute_start(model, clock.time)
    compute_changes(tables, model.work, clock.time, JUST_AFTER, state.change)  # of a drive whose acceleration jumps: after it
    copy(state.force, state.right_side[:n])  # friction has taken lambda from before the jump
    copy(state.change, state.right_side[n:])
    factor_saddle(tables, orders, model.work, state, state.q, state.start_jacobian)
    solve(orders.mass, state.saddle_factors, state.saddle_swaps, state.right_side, state.front_work)
    copy(state.right_side[:n], state.a)
    copy(state.right_side[n:], state.lam)
    if controls.writes_within_steps:  # then rows are interpolated linearly, so the jump needs a row on either side
        write_after_jump(state, clock, controls, out, counts)
