"""Forces between markers, compiled: along a measure, of a pin in a bush, and at a marker; with their derivatives.

Let y(q) (6,) be (x, y, angle) of markers a and b, F (6,) the forces on them, J = dy/dq, and J' = dJ/dt. Local names: h = dF/dy
and c = dF/dy', (6, 6). As f = J^T F and y' = J v, the stiffness -df/dq has the terms -J^T h J, -J^T c J' and the geometric
stiffness -F . d2y/dq2. The damping -df/dv has the term -J^T c J. For a force along a measure see (2) of
docs/theory-spectral.md. `now` is an `Instant`; `memory` and `since` are fields of it, `mem` is one row of the memory. `since` is
the time since the step began, over which bristles deflect; below 0 bristles are states of the integrator.

The column `Forces.A` of a force is its measure or marker a, `Forces.B` its marker b or, of friction at a face, the contact that
presses. tables.factors[k] multiplies force k; statics varies it. tables.data has the force's numbers from index `number` on.
"""

from enum import IntEnum

import numpy as np

from ..laws.table import LawColumn, call
from . import lawtable, markers
from .compiling import inline, kernel_function
from .stateful import add_stateful, add_stateful_tangents
from .tables import BlockColumn, ForceKind, Forces, Markers, Measures, Memory, PushData, Report, State

JournalData = IntEnum("JournalData", "RADIUS CLEARANCE", start=0)
"""Numbers of a pin in a bush [m]."""


@kernel_function
def _get_normal_force(tables, work, k, now):
    """Return the normal force if force k is friction: a constraint's multiplier or the force of a contact; else 0."""
    row = tables.forces[k, Forces.ROW]
    if row >= 0:
        return now.lam[row]
    return work.reports[tables.forces[k, Forces.B], Report.VALUE] if tables.forces[k, Forces.KIND] == ForceKind.FRICTION else 0.0


@inline
def _add_along(tables, work, k, now, f):
    """Add force k, along a measure, and report it."""
    measure, grad, normal_force = tables.forces[k, Forces.A], work.grad, _get_normal_force(tables, work, k, now)
    value, rate = markers.compute_measure(tables, work, measure, grad)
    force = tables.factors[k] * lawtable.evaluate_along(tables, k, now, value, rate, normal_force)
    out = work.reports[k]
    out[Report.VALUE], out[Report.LENGTH], out[Report.RATE], out[Report.SLIP] = force, value, rate, rate
    if tables.forces[k, Forces.KIND] == ForceKind.FRICTION:
        law = tables.forces[k, Forces.FRICTION]
        out[Report.BRISTLE] = lawtable.evaluate_friction(tables, law, rate, now.memory[k], now.since)[1]
    a, b = tables.measures[measure, Measures.A], tables.measures[measure, Measures.B]
    markers.add_force(tables, work, a, force * grad[0], force * grad[1], force * grad[2], f)
    markers.add_force(tables, work, b, force * grad[3], force * grad[4], force * grad[5], f)


@kernel_function
def _differentiate_along(tables, work, k, now, normal_force):
    """Return the derivatives of force k by its measure and rate; fill grad, hess and hess_rate of `work` for the measure."""
    measure = tables.forces[k, Forces.A]
    a, b = tables.measures[measure, Measures.A], tables.measures[measure, Measures.B]
    value, rate = markers.compute_measure(tables, work, measure, work.grad)
    markers.compute_hessian(tables, work, measure, work.grad, work.hess)
    for i in range(6):
        total = 0.0
        for j in range(6):
            total += work.hess[i, j] * markers.get_rate(work, a, b, j)
        work.hess_rate[i] = total  # derivative of the measure's rate by (x, y, angle)
    return lawtable.differentiate_along(tables, k, now, value, rate, normal_force)


@kernel_function
def _add_tangents_along(tables, work, k, now, saddle):
    """Add derivatives of force k along a measure. Friction depends on lambda by its normal force: add -df/dlambda to `saddle`."""
    measure, grad, hess = tables.forces[k, Forces.A], work.grad, work.hess
    normal_force = _get_normal_force(tables, work, k, now)
    a, b, factor = tables.measures[measure, Measures.A], tables.measures[measure, Measures.B], tables.factors[k]
    force = work.reports[k, Report.VALUE]
    by_value, by_rate = _differentiate_along(tables, work, k, now, normal_force)
    h, c = work.by_place, work.by_rate
    for i in range(6):
        for j in range(6):
            c[i, j] = factor * by_rate * grad[i] * grad[j]
            h[i, j] = factor * (by_value * grad[i] * grad[j] + by_rate * grad[i] * work.hess_rate[j]) + force * hess[i, j]
    stiffness, size = work.block_stiffness, tables.markers[a, Markers.COUNT]
    _add_derivatives(tables, work, a, b)
    markers.add_geometric(tables, work, a, now.q, (-force * grad[0], -force * grad[1], -force * grad[2]), stiffness, 0)
    markers.add_geometric(tables, work, b, now.q, (-force * grad[3], -force * grad[4], -force * grad[5]), stiffness, size)
    if tables.forces[k, Forces.KIND] == ForceKind.FRICTION and normal_force != 0.0:
        if tables.forces[k, Forces.ROW] >= 0:
            block = tables.blocks[tables.rows.shape[0] + k]  # blocks of constraints come first
            width, entry = block[BlockColumn.WIDTH], block[BlockColumn.ENTRIES]
            last = width - 1  # the last unknown of the block is the multiplier of the constraint that presses
            markers.write_gradient(tables, work, measure, grad, -force / normal_force, work.scratch, 0)
            for i in range(last):
                saddle[tables.slots[entry + i * width + last]] += work.scratch[i]
        else:
            _add_contact_friction(tables, work, k, now, force / normal_force)


@kernel_function
def _add_derivatives(tables, work, a, b):
    """Add -J^T h J - J^T c J' to the stiffness and -J^T c J to the damping of a force on markers a and b."""
    pair = (a, b, 0)  # 0: the block begins with the coordinates of a
    markers.add_pair(tables, work, pair, work.by_place, -1.0, work.jacobian, work.block_stiffness)
    markers.add_pair(tables, work, pair, work.by_rate, -1.0, work.jacobian, work.block_damping)
    markers.add_pair(tables, work, pair, work.by_rate, -1.0, work.jacobian_rate, work.block_stiffness)


@kernel_function
def _add_contact_friction(tables, work, k, now, ratio):
    """Add derivatives of friction along a face, `ratio` times its contact's force; both are between the same markers."""
    contact, along = tables.forces[k, Forces.B], tables.forces[k, Forces.A]  # force, and measure along the face
    by_value, by_rate = _differentiate_along(tables, work, contact, now, 0.0)
    factor, h, c = ratio * tables.factors[contact], work.by_place, work.by_rate
    across_grad, along_grad = work.grad, work.hess[0]  # the Hessian is not used any more
    markers.compute_measure(tables, work, along, along_grad)
    for j in range(6):
        push_by_place = factor * (by_value * across_grad[j] + by_rate * work.hess_rate[j])  # of the contact's force
        push_by_rate = factor * by_rate * across_grad[j]
        for i in range(6):
            h[i, j], c[i, j] = along_grad[i] * push_by_place, along_grad[i] * push_by_rate
    _add_derivatives(tables, work, tables.measures[along, Measures.A], tables.measures[along, Measures.B])


@inline
def report_pin(tables, work, k, mem, since, out):
    """Fill `out`, a report, for a pin in a bush: LENGTH is the depth, FX and FY the normal n = e/|e|, e = r_pin - r_bush."""
    a, b = work.state[tables.forces[k, Forces.A]], work.state[tables.forces[k, Forces.B]]
    number = tables.forces[k, Forces.NUMBERS]
    radius, clearance = tables.data[number + JournalData.RADIUS], tables.data[number + JournalData.CLEARANCE]
    ex, ey, ux, uy = a[State.X] - b[State.X], a[State.Y] - b[State.Y], a[State.VX] - b[State.VX], a[State.VY] - b[State.VY]
    e = np.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / e, ey / e) if e > 1e-300 else (1.0, 0.0)
    depth, rate = e - clearance, nx * ux + ny * uy
    sliding = nx * uy - ny * ux + a[State.SPIN] * radius - b[State.SPIN] * (e + radius)
    out[Report.VALUE], out[Report.FRICTION], out[Report.BRISTLE], out[Report.FX], out[Report.FY] = 0.0, 0.0, 0.0, nx, ny
    out[Report.LENGTH], out[Report.RATE], out[Report.SLIP] = depth, rate, sliding
    if depth > 0.0:
        out[Report.VALUE] = lawtable.normal_force(tables, tables.forces[k, Forces.LAW], depth, rate, mem[Memory.ONSET])
        friction = tables.forces[k, Forces.FRICTION]
        coefficient, out[Report.BRISTLE] = lawtable.evaluate_friction(tables, friction, sliding, mem, since)
        out[Report.FRICTION] = coefficient * out[Report.VALUE]
    elif since < 0.0:  # the bristle, a state of the integrator, keeps its deflection while the pin is free
        out[Report.BRISTLE] = mem[Memory.BRISTLE]


@inline
def _compute_pin_force(tables, k, number, out):
    """Return radius R, eccentricity e, friction, and x and y of the force on the pin of a closed contact, from its report."""
    nx, ny = out[Report.FX], out[Report.FY]
    push, drag = tables.factors[k] * out[Report.VALUE], tables.factors[k] * out[Report.FRICTION]
    radius, e = tables.data[number + JournalData.RADIUS], out[Report.LENGTH] + tables.data[number + JournalData.CLEARANCE]
    return radius, e, drag, drag * ny - push * nx, -push * ny - drag * nx


@inline
def _add_journal(tables, work, k, memory, since, f):
    """Add the force of a pin in a bush, on both bodies at the pin's surface r_pin + R n, so that moments balance."""
    ma, mb, out = tables.forces[k, Forces.A], tables.forces[k, Forces.B], work.reports[k]
    number = tables.forces[k, Forces.NUMBERS]
    report_pin(tables, work, k, memory[k], since, out)
    if out[Report.LENGTH] <= 0.0:
        return
    radius, e, drag, fx, fy = _compute_pin_force(tables, k, number, out)
    markers.add_force(tables, work, ma, fx, fy, -radius * drag, f)
    markers.add_force(tables, work, mb, -fx, -fy, (e + radius) * drag, f)


@kernel_function
def _add_journal_tangents(tables, work, k, q, memory, since):
    """Add derivatives of the force of a pin in a bush.

    The force on the pin is -push n - drag t: normal force and friction, t being the normal n turned by a right angle. The sliding
    speed is t . (v_pin - v_bush) + R spin_pin - (e + R) spin_bush, e the eccentricity. Column j is x, y, angle of the pin (0 to
    2) and of the bush (3 to 5), (kx, ky, ka) its direction. Derivatives by coordinate j are: of e `along`, of n `turn` times t,
    of t minus `turn` times n. Names on _x are derivatives by coordinate j, on _v by its rate.
    """
    ma, mb, out = tables.forces[k, Forces.A], tables.forces[k, Forces.B], work.reports[k]
    number = tables.forces[k, Forces.NUMBERS]
    if out[Report.LENGTH] <= 0.0:
        return
    radius, e, drag, fx, fy = _compute_pin_force(tables, k, number, out)
    nx, ny, factor = out[Report.FX], out[Report.FY], tables.factors[k]
    tx, ty, push = -ny, nx, factor * out[Report.VALUE]
    law, friction = tables.forces[k, Forces.LAW], tables.forces[k, Forces.FRICTION]
    by_depth, by_rate = lawtable.differentiate_normal(tables, law, out[Report.LENGTH], out[Report.RATE], memory[k, Memory.ONSET])
    coefficient = drag / push if push != 0.0 else 0.0
    by_slide = push * lawtable.differentiate_friction(tables, friction, out[Report.SLIP], memory[k], since)
    a, b = work.state[ma], work.state[mb]
    across_rate = (a[State.VX] - b[State.VX]) * tx + (a[State.VY] - b[State.VY]) * ty
    h, c = work.by_place, work.by_rate
    for j in range(6):
        sign = 1.0 if j < 3 else -1.0
        kx, ky, ka = (1.0 if j % 3 == 0 else 0.0), (1.0 if j % 3 == 1 else 0.0), (1.0 if j % 3 == 2 else 0.0)
        along, across = sign * (kx * nx + ky * ny), sign * (kx * tx + ky * ty)
        turn = across / e
        slide_x = -out[Report.RATE] * turn - b[State.SPIN] * along
        slide_v = across + ka * (radius if j < 3 else -(e + radius))
        push_x = factor * (by_depth * along + by_rate * across_rate * turn)
        push_v = factor * by_rate * along
        drag_x, drag_v = coefficient * push_x + by_slide * slide_x, coefficient * push_v + by_slide * slide_v
        dx = -push_x * nx - drag_x * tx + turn * (drag * nx - push * tx)
        dy = -push_x * ny - drag_x * ty + turn * (drag * ny - push * ty)
        h[0, j], h[1, j], h[2, j] = dx, dy, -radius * drag_x
        h[3, j], h[4, j], h[5, j] = -dx, -dy, (e + radius) * drag_x + along * drag
        vx, vy = -push_v * nx - drag_v * tx, -push_v * ny - drag_v * ty
        c[0, j], c[1, j], c[2, j] = vx, vy, -radius * drag_v
        c[3, j], c[4, j], c[5, j] = -vx, -vy, (e + radius) * drag_v
    _add_derivatives(tables, work, ma, mb)
    stiffness, size = work.block_stiffness, tables.markers[ma, Markers.COUNT]
    markers.add_geometric(tables, work, ma, q, (-fx, -fy, radius * drag), stiffness, 0)
    markers.add_geometric(tables, work, mb, q, (fx, fy, -(e + radius) * drag), stiffness, size)


@kernel_function
def _compute_moment(tables, work, k, push_x, push_y):
    """Return the moment of a force about its marker, if its line of action goes through a fixed point; else 0."""
    a, number = tables.forces[k, Forces.A], tables.forces[k, Forces.NUMBERS]
    rx = tables.data[number + PushData.LINE_X] - work.state[a, State.X]
    ry = tables.data[number + PushData.LINE_Y] - work.state[a, State.Y]
    return tables.data[number + PushData.HAS_LINE] * (rx * push_y - ry * push_x)


@inline
def _add_push(tables, work, k, t, f):
    """Add a force at marker a, whose direction turns with marker b; its line of action may go through a fixed point."""
    a, b, number = tables.forces[k, Forces.A], tables.forces[k, Forces.B], tables.forces[k, Forces.NUMBERS]
    law = tables.forces[k, Forces.LAW]
    px, py = tables.data[number + PushData.X], tables.data[number + PushData.Y]
    if law >= 0:
        px, py = call(tables.laws[law, LawColumn.FIRST_ADDRESS], (t,)), call(tables.laws[law, LawColumn.SECOND_ADDRESS], (t,))
    angle = work.state[b, State.ANGLE] - tables.data[number + PushData.ANGLE]
    c, sn = np.cos(angle), np.sin(angle)
    fx, fy = tables.factors[k] * (c * px - sn * py), tables.factors[k] * (sn * px + c * py)
    work.reports[k, Report.VALUE], work.reports[k, Report.FX], work.reports[k, Report.FY] = np.sqrt(fx * fx + fy * fy), fx, fy
    markers.add_force(tables, work, a, fx, fy, _compute_moment(tables, work, k, fx, fy), f)


@kernel_function
def _add_push_tangents(tables, work, k, q):
    """Add derivatives of a force at a marker."""
    a, b, fx, fy = tables.forces[k, Forces.A], tables.forces[k, Forces.B], work.reports[k, Report.FX], work.reports[k, Report.FY]
    h = work.by_place
    markers.add_geometric(tables, work, a, q, (-fx, -fy, -_compute_moment(tables, work, k, fx, fy)), work.block_stiffness, 0)
    h[:] = 0.0
    has_line = tables.data[tables.forces[k, Forces.NUMBERS] + PushData.HAS_LINE]  # 1 or 0
    h[0, 5], h[1, 5], h[2, 5] = -fy, fx, _compute_moment(tables, work, k, -fy, fx)  # by the angle of b, with which it turns
    h[2, 0], h[2, 1] = -has_line * fy, has_line * fx  # its moment by x and y of a
    markers.add_pair(tables, work, (a, b, 0), h, -1.0, work.jacobian, work.block_stiffness)


@inline
def apply_force(tables, work, k, now, f):
    """Add force k to f, and write its report."""
    kind = tables.forces[k, Forces.KIND]
    t = tables.time_factor[0] * now.time  # argument of functions of time: a factor of 2 makes all drives twice as fast
    if kind == ForceKind.JOURNAL:
        _add_journal(tables, work, k, now.memory, now.since, f)
    elif kind == ForceKind.POINT_FORCE:
        _add_push(tables, work, k, t, f)
    elif kind == ForceKind.STATEFUL:
        add_stateful(tables, work, k, t, f)
    else:
        _add_along(tables, work, k, now, f)


@inline
def add_forces(tables, work, now, f):
    """Add all forces between markers at an instant to f. Markers are placed. Inlined: a call takes a tenth of a rattling run."""
    for k in range(tables.forces.shape[0]):
        apply_force(tables, work, k, now, f)


@kernel_function
def add_forces_tangents(tables, work, now, saddle, damp, stiff):
    """Add -df/dq to stiff, -df/dv to damp, -df/dlambda to saddle ([M G^T; G 0]), of the forces that were added last."""
    for k in range(tables.forces.shape[0]):
        kind, block = tables.forces[k, Forces.KIND], tables.rows.shape[0] + k
        markers.clear_block(tables, work, block)
        if kind == ForceKind.JOURNAL:
            _add_journal_tangents(tables, work, k, now.q, now.memory, now.since)
        elif kind == ForceKind.POINT_FORCE:
            _add_push_tangents(tables, work, k, now.q)
        elif kind == ForceKind.STATEFUL:
            add_stateful_tangents(tables, work, k, tables.time_factor[0] * now.time, now.q)
        else:
            _add_tangents_along(tables, work, k, now, saddle)
        markers.add_entries(tables, block, work.block_stiffness, stiff)
        markers.add_entries(tables, block, work.block_damping, damp)
