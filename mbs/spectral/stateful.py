"""Forces whose law has states, compiled, with their derivatives.

A state is the velocity of an extra coordinate of unit mass, and its rate the force on that; each such coordinate is the angle of
an extra marker. Let p be the coordinates of the marker that the force acts on, one angle or x and y, and p_c these and the extra
ones. Component r of the force, or the rate of a state, is F_r:

    dF_r = dF_r/dp_c dp_c + dF_r/dp'_c dp'_c,    dp'_c = J_c dv + J'_c dq.
"""

from __future__ import annotations

import numpy as np

from ..laws.table import LawColumn, call
from .compiling import draft
from .markers import add_force, add_geometric
from .tables import Forces, Markers, Report, State, StatefulData

SMALL = 1e-3
"""Least size of a law's argument in difference quotients."""


@draft
def _counts(tables, k):
    """First column of the marker that force k acts on, number of columns, number of states."""
    number = tables.forces[k, Forces.NUMBERS]
    return int(tables.data[number]), int(tables.data[number + StatefulData.COUNT]), int(tables.data[number + StatefulData.STATES])


@draft
def _value(tables, work, k, r, count):
    """Component r of the force, or the rate of a state; the arguments of its law are in work.scratch."""
    factor = tables.factors[k] if r < count else 1.0
    return factor * call(tables.laws[tables.forces[k, Forces.LAW] + r, LawColumn.CALL], work.scratch)


@draft
def _of(tables, k, first, count, component):
    """Marker of a coordinate that is an argument of the law, its column there, and its first row in the force's block."""
    a, state = tables.forces[k, Forces.A], component - count
    if state < 0:
        return a, first + component, 0
    b = tables.forces[k, Forces.B]
    return b + state, State.ANGLE, tables.markers[a, Markers.COUNT] + state * tables.markers[b, Markers.COUNT]


@draft
def _fill(tables, work, k, t):
    """Put the arguments of the law of force k into work.scratch: time, coordinates, their rates, states."""
    first, count, states = _counts(tables, k)
    a, b, given = tables.forces[k, Forces.A], tables.forces[k, Forces.B], work.scratch
    given[0] = t
    for i in range(count):
        given[1 + i], given[1 + count + i] = work.state[a, State.X + first + i], work.state[a, State.VX + first + i]
    given[1] -= tables.data[tables.forces[k, Forces.NUMBERS] + StatefulData.OFFSET]
    for i in range(states):
        given[1 + 2 * count + i] = work.state[b + i, State.SPIN]


@draft
def add_stateful(tables, work, k, t, f):
    """The force, and the rates of its states."""
    _, count, states = _counts(tables, k)
    a, out = tables.forces[k, Forces.A], work.reports[k]
    _fill(tables, work, k, t)
    out[Report.FX], out[Report.FY] = 0.0, 0.0
    out[Report.VALUE] = _value(tables, work, k, 0, count)
    if count > 1:
        out[Report.FX], out[Report.FY] = out[Report.VALUE], _value(tables, work, k, 1, count)
        out[Report.VALUE] = np.sqrt(out[Report.FX] * out[Report.FX] + out[Report.FY] * out[Report.FY])
    add_force(tables, work, a, out[Report.FX], out[Report.FY], out[Report.VALUE] if count == 1 else 0.0, f)
    for i in range(states):
        marker = tables.forces[k, Forces.B] + i
        f[tables.places[tables.markers[marker, Markers.FIRST]]] += _value(tables, work, k, count + i, count)


@draft
def add_stateful_tangents(tables, work, k, t, q):
    """Derivatives of the force and of the rates of its states, by central differences of the law."""
    first, count, states = _counts(tables, k)
    given, out = work.scratch, work.reports[k]
    _fill(tables, work, k, t)
    for c in range(count + count + states):
        component, place = (c, True) if c < count else (c - count, False)
        mc, column, across = _of(tables, k, first, count, component)
        x = given[1 + c]
        h = 1e-6 * max(abs(x), SMALL)
        for r in range(count + states):
            given[1 + c] = x + h
            slope = _value(tables, work, k, r, count)
            given[1 + c] = x - h
            slope = (slope - _value(tables, work, k, r, count)) / (2.0 * h)
            mr, row, down = _of(tables, k, first, count, r)
            for i in range(tables.markers[mr, Markers.COUNT]):
                push = slope * work.jacobian[row, tables.markers[mr, Markers.FIRST] + i]
                for j in range(tables.markers[mc, Markers.COUNT]):
                    at = tables.markers[mc, Markers.FIRST] + j
                    if place:
                        work.block_stiffness[down + i, across + j] -= push * work.jacobian[column, at]
                    else:
                        work.block_damping[down + i, across + j] -= push * work.jacobian[column, at]
                        work.block_stiffness[down + i, across + j] -= push * work.jacobian_rate[column, at]
        given[1 + c] = x
    add_geometric(
        tables,
        work,
        tables.forces[k, Forces.A],
        q,
        (-out[Report.FX], -out[Report.FY], -out[Report.VALUE] if count == 1 else 0.0),
        work.block_stiffness,
        0,
    )
