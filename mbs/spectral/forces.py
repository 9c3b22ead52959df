"""Forces between markers, compiled: along a measure, of a pin in a bush, and at a marker; each with its derivatives.

Tangents of a force along a measure are (2) of docs/theory-spectral.md.
"""

from __future__ import annotations

import numpy as np

from ..laws.table import LawColumn, call
from .compiling import draft, inline
from .lawtable import friction_now, friction_slope, normal_force, normal_slopes, slopes_along, value_along
from .markers import (
    add_entries,
    add_force,
    add_geometric,
    add_gradient,
    add_pair,
    clear_block,
    hessian,
    measure,
    put_gradient,
    rate_of,
)  # fmt: skip
from .stateful import add_stateful, add_stateful_tangents
from .tables import ForceKind, Forces, Markers, Measures, Memory, Report, State


@draft
def _pressing(tables, work, k, now):
    """Normal force of force k if that is friction: a constraint's multiplier, or the force of a contact; else 0."""
    row = tables.forces[k, Forces.ROW]
    if row >= 0:
        return now.lam[row]
    return work.reports[tables.forces[k, Forces.B], Report.VALUE] if tables.forces[k, Forces.KIND] == ForceKind.FRICTION else 0.0


@inline
def _along(tables, work, k, now, f):
    """Add force k, along a measure, and report it."""
    number, grad, reaction = tables.forces[k, Forces.A], work.grad, _pressing(tables, work, k, now)
    value, rate = measure(tables, work, number, grad)
    force = tables.factors[k] * value_along(tables, k, now, value, rate, reaction)
    out = work.reports[k]
    out[Report.VALUE], out[Report.LENGTH], out[Report.RATE], out[Report.SLIP] = force, value, rate, rate
    if tables.forces[k, Forces.KIND] == ForceKind.FRICTION:
        out[Report.BRISTLE] = friction_now(tables, tables.forces[k, Forces.FRICTION], rate, now.memory[k], now.since)[1]
    add_gradient(tables, work, number, grad, force, f)


@draft
def _add_tangents_along(tables, work, k, now, mass):
    """Add derivatives of a force along a measure; of friction also those by its normal force."""
    number, grad, hess, reaction = tables.forces[k, Forces.A], work.grad, work.hess, _pressing(tables, work, k, now)
    a, b, factor = tables.measures[number, Measures.A], tables.measures[number, Measures.B], tables.factors[k]
    force = work.reports[k, Report.VALUE]
    value, rate = measure(tables, work, number, grad)
    hessian(tables, work, number, grad, hess)
    by_value, by_rate = slopes_along(tables, k, now, value, rate, reaction)
    h, c = work.by_place, work.by_rate
    for i in range(6):
        bend = 0.0
        for j in range(6):
            bend += hess[i, j] * rate_of(work, a, b, j)
        work.hess_rate[i] = bend
    for i in range(6):
        for j in range(6):
            c[i, j] = factor * by_rate * grad[i] * grad[j]
            h[i, j] = factor * (by_value * grad[i] * grad[j] + by_rate * grad[i] * work.hess_rate[j]) + force * hess[i, j]
    add_pair(tables, work, (a, b, 0), h, -1.0, work.slope, work.stiff)
    add_geometric(tables, work, a, now.q, (-force * grad[0], -force * grad[1], -force * grad[2]), work.stiff, 0)
    across = tables.markers[a, Markers.COUNT]
    add_geometric(tables, work, b, now.q, (-force * grad[3], -force * grad[4], -force * grad[5]), work.stiff, across)
    if by_rate != 0.0:
        add_pair(tables, work, (a, b, 0), c, -1.0, work.slope, work.damp)
        add_pair(tables, work, (a, b, 0), c, -1.0, work.drift, work.stiff)
    if tables.forces[k, Forces.KIND] == ForceKind.FRICTION and reaction != 0.0:
        if tables.forces[k, Forces.ROW] >= 0:
            _add_cross(tables, work, k, number, grad, -force / reaction, mass)
        else:
            _follow_contact(tables, work, k, now, force / reaction)


@draft
def _follow_contact(tables, work, k, now, share):
    """Add derivatives of friction along a face, `share` times its contact's force, by those of that force."""
    contact, number, grad, h, c = tables.forces[k, Forces.B], tables.forces[k, Forces.A], work.grad, work.by_place, work.by_rate
    across, factor = tables.forces[contact, Forces.A], share * tables.factors[contact]
    a, b = tables.measures[across, Measures.A], tables.measures[across, Measures.B]
    value, rate = measure(tables, work, across, grad)
    hessian(tables, work, across, grad, work.hess)
    by_value, by_rate = slopes_along(tables, contact, now, value, rate, 0.0)
    for i in range(6):
        bend = 0.0
        for j in range(6):
            bend += work.hess[i, j] * rate_of(work, a, b, j)
        h[0, i], c[0, i] = factor * (by_value * grad[i] + by_rate * bend), factor * by_rate * grad[i]
    measure(tables, work, number, grad)
    for i in range(5, -1, -1):
        for j in range(6):
            h[i, j], c[i, j] = grad[i] * h[0, j], grad[i] * c[0, j]
    add_pair(tables, work, (a, b, 0), h, -1.0, work.slope, work.stiff)
    add_pair(tables, work, (a, b, 0), c, -1.0, work.slope, work.damp)
    add_pair(tables, work, (a, b, 0), c, -1.0, work.drift, work.stiff)


@draft
def _add_cross(tables, work, k, number, grad, factor, mass):
    """Add factor times the gradient of a measure to the column of the multiplier that force k follows."""
    block = tables.rows.shape[0] + k
    _, m, slot = tables.blocks[block]
    put_gradient(tables, work, number, grad, factor, work.scratch, 0)
    for i in range(m - 1):
        mass[tables.slots[slot + i * m + m - 1]] += work.scratch[i]


@inline
def report_pin(tables, work, k, mem, since, out):
    """Pin in a bush: fill out with normal and tangential force, depth, rate, sliding, bristle, normal's direction.

    e = r_pin - r_bush, n = e/|e|; the force acts on both bodies at the pin's surface r_pin + R n, so that moments balance.
    """
    a, b = work.state[tables.forces[k, Forces.A]], work.state[tables.forces[k, Forces.B]]
    number = tables.forces[k, Forces.NUMBERS]
    radius, gap = tables.data[number], tables.data[number + 1]
    ex, ey, ux, uy = a[State.X] - b[State.X], a[State.Y] - b[State.Y], a[State.VX] - b[State.VX], a[State.VY] - b[State.VY]
    e = np.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / e, ey / e) if e > 1e-300 else (1.0, 0.0)
    depth, rate = e - gap, nx * ux + ny * uy
    sliding = nx * uy - ny * ux + a[State.SPIN] * radius - b[State.SPIN] * (e + radius)
    out[Report.VALUE], out[Report.FRICTION], out[Report.BRISTLE], out[Report.FX], out[Report.FY] = 0.0, 0.0, 0.0, nx, ny
    out[Report.LENGTH], out[Report.RATE], out[Report.SLIP] = depth, rate, sliding
    if depth > 0.0:
        out[Report.VALUE] = normal_force(tables, tables.forces[k, Forces.LAW], depth, rate, mem[Memory.ONSET])
        coefficient, out[Report.BRISTLE] = friction_now(tables, tables.forces[k, Forces.FRICTION], sliding, mem, since)
        out[Report.FRICTION] = coefficient * out[Report.VALUE]
    elif since < 0.0:
        out[Report.BRISTLE] = mem[Memory.BRISTLE]


@inline
def _push_of_pin(tables, k, number, out):
    """Pin's radius, eccentricity, friction and total force on the pin of a closed contact."""
    nx, ny = out[Report.FX], out[Report.FY]
    push, drag = tables.factors[k] * out[Report.VALUE], tables.factors[k] * out[Report.FRICTION]
    return tables.data[number], out[Report.LENGTH] + tables.data[number + 1], drag, drag * ny - push * nx, -push * ny - drag * nx


@inline
def _journal(tables, work, k, mem, since, f):
    """Add the force of a pin in a bush."""
    ma, mb, out = tables.forces[k, Forces.A], tables.forces[k, Forces.B], work.reports[k]
    number = tables.forces[k, Forces.NUMBERS]
    report_pin(tables, work, k, mem[k], since, out)
    if out[Report.LENGTH] <= 0.0:
        return
    radius, e, drag, fx, fy = _push_of_pin(tables, k, number, out)
    add_force(tables, work, ma, fx, fy, -radius * drag, f)
    add_force(tables, work, mb, -fx, -fy, (e + radius) * drag, f)


@draft
def _add_journal_tangents(tables, work, k, q, mem, since):
    """Add derivatives of the force of a pin in a bush."""
    ma, mb, out = tables.forces[k, Forces.A], tables.forces[k, Forces.B], work.reports[k]
    number = tables.forces[k, Forces.NUMBERS]
    if out[Report.LENGTH] <= 0.0:
        return
    factor, tx, ty = tables.factors[k], -out[Report.FY], out[Report.FX]
    (radius, e, drag, fx, fy), nx, ny = _push_of_pin(tables, k, number, out), out[Report.FX], out[Report.FY]
    push = factor * out[Report.VALUE]
    law = tables.forces[k, Forces.LAW]
    by_depth, by_rate = normal_slopes(tables, law, out[Report.LENGTH], out[Report.RATE], mem[k, Memory.ONSET])
    coefficient = drag / push if push != 0.0 else 0.0
    by_slide = push * friction_slope(tables, tables.forces[k, Forces.FRICTION], out[Report.SLIP], mem[k], since)
    sway = (work.state[ma, State.VX] - work.state[mb, State.VX]) * tx + (work.state[ma, State.VY] - work.state[mb, State.VY]) * ty
    h, c = work.by_place, work.by_rate
    for j in range(6):
        # derivatives by x_j, then by its rate: e along n and t, sliding speed
        sign = 1.0 if j < 3 else -1.0
        kx, ky, ka = (1.0 if j % 3 == 0 else 0.0), (1.0 if j % 3 == 1 else 0.0), (1.0 if j % 3 == 2 else 0.0)
        along, across = sign * (kx * nx + ky * ny), sign * (kx * tx + ky * ty)
        slide_x = -out[Report.RATE] * across / e - work.state[mb, State.SPIN] * along
        slide_v = across + ka * (radius if j < 3 else -(e + radius))
        push_x = factor * (by_depth * along + by_rate * sway * across / e)
        push_v = factor * by_rate * along
        drag_x, drag_v = coefficient * push_x + by_slide * slide_x, coefficient * push_v + by_slide * slide_v
        # n turns by across/e towards t
        turn = across / e
        dx = -push_x * nx - drag_x * tx + turn * (drag * nx - push * tx)
        dy = -push_x * ny - drag_x * ty + turn * (drag * ny - push * ty)
        h[0, j], h[1, j], h[2, j] = dx, dy, -radius * drag_x
        h[3, j], h[4, j], h[5, j] = -dx, -dy, (e + radius) * drag_x + along * drag
        vx, vy = -push_v * nx - drag_v * tx, -push_v * ny - drag_v * ty
        c[0, j], c[1, j], c[2, j] = vx, vy, -radius * drag_v
        c[3, j], c[4, j], c[5, j] = -vx, -vy, (e + radius) * drag_v
    add_pair(tables, work, (ma, mb, 0), h, -1.0, work.slope, work.stiff)
    add_pair(tables, work, (ma, mb, 0), c, -1.0, work.slope, work.damp)
    add_pair(tables, work, (ma, mb, 0), c, -1.0, work.drift, work.stiff)
    add_geometric(tables, work, ma, q, (-fx, -fy, radius * drag), work.stiff, 0)
    add_geometric(tables, work, mb, q, (fx, fy, -(e + radius) * drag), work.stiff, tables.markers[ma, Markers.COUNT])


@draft
def _moment(tables, work, k, push_x, push_y):
    """Moment of a force about its marker if its line of action goes through a fixed point."""
    a, number = tables.forces[k, Forces.A], tables.forces[k, Forces.NUMBERS]
    rx, ry = tables.data[number + 4] - work.state[a, State.X], tables.data[number + 5] - work.state[a, State.Y]
    return tables.data[number + 3] * (rx * push_y - ry * push_x)


@inline
def _push(tables, work, k, t, f):
    """Add a force at marker a, whose direction turns with marker b; its line of action may go through a fixed point."""
    a, b, number = tables.forces[k, Forces.A], tables.forces[k, Forces.B], tables.forces[k, Forces.NUMBERS]
    law = tables.forces[k, Forces.LAW]
    px, py = tables.data[number], tables.data[number + 1]
    if law >= 0:
        px, py = call(tables.laws[law, LawColumn.CALL], (t,)), call(tables.laws[law, LawColumn.CALL_TOO], (t,))
    angle = work.state[b, State.TURN] - tables.data[number + 2]
    c, sn = np.cos(angle), np.sin(angle)
    fx, fy = tables.factors[k] * (c * px - sn * py), tables.factors[k] * (sn * px + c * py)
    work.reports[k, Report.VALUE], work.reports[k, Report.FX], work.reports[k, Report.FY] = np.sqrt(fx * fx + fy * fy), fx, fy
    add_force(tables, work, a, fx, fy, _moment(tables, work, k, fx, fy), f)


@draft
def _add_push_tangents(tables, work, k, q):
    """Add derivatives of a force at a marker."""
    a, b, fx, fy = tables.forces[k, Forces.A], tables.forces[k, Forces.B], work.reports[k, Report.FX], work.reports[k, Report.FY]
    h = work.by_place
    add_geometric(tables, work, a, q, (-fx, -fy, -_moment(tables, work, k, fx, fy)), work.stiff, 0)
    for i in range(6):
        for j in range(6):
            h[i, j] = 0.0
    held = tables.data[tables.forces[k, Forces.NUMBERS] + 3]
    h[0, 5], h[1, 5], h[2, 5] = -fy, fx, _moment(tables, work, k, -fy, fx)
    h[2, 0], h[2, 1] = -held * fy, held * fx
    add_pair(tables, work, (a, b, 0), h, -1.0, work.slope, work.stiff)


@inline
def add_one(tables, work, k, now, f):
    """Add force k; see `add_forces`."""
    kind = tables.forces[k, Forces.KIND]
    if kind == ForceKind.JOURNAL:
        _journal(tables, work, k, now.memory, now.since, f)
    elif kind == ForceKind.POINT_FORCE:
        _push(tables, work, k, tables.time_factor[0] * now.time, f)
    elif kind == ForceKind.STATEFUL:
        add_stateful(tables, work, k, tables.time_factor[0] * now.time, f)
    else:
        _along(tables, work, k, now, f)


@draft
def add_forces(tables, work, now, f):
    """Add all forces between markers at an instant to f. Markers are placed."""
    for k in range(tables.forces.shape[0]):
        add_one(tables, work, k, now, f)


@draft
def add_forces_tangents(tables, work, now, mass, damp, stiff):
    """Add -df/dq to stiff, -df/dv to damp, -df/dlambda to mass, of the forces that were added last."""
    for k in range(tables.forces.shape[0]):
        kind, block = tables.forces[k, Forces.KIND], tables.rows.shape[0] + k
        clear_block(tables, work, block)
        if kind == ForceKind.JOURNAL:
            _add_journal_tangents(tables, work, k, now.q, now.memory, now.since)
        elif kind == ForceKind.POINT_FORCE:
            _add_push_tangents(tables, work, k, now.q)
        elif kind == ForceKind.STATEFUL:
            add_stateful_tangents(tables, work, k, tables.time_factor[0] * now.time, now.q)
        else:
            _add_tangents_along(tables, work, k, now, mass)
        add_entries(tables, block, work.stiff, stiff)
        add_entries(tables, block, work.damp, damp)
