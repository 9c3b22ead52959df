"""Forces whose law has states, compiled, with their derivatives.

Each state has an extra coordinate of unit mass, whose velocity is the state. The force on this coordinate is the rate of the
state. Each extra coordinate is the angle of an extra marker. Let q be all coordinates and v their rates. The list p has x and y,
or the angle, of the force's marker, followed by the extra coordinates; J_c = dp_c/dq. F_r(t, p, p') is component r of the force
or the rate of a state:

    dF_r = sum over c of dF_r/dp_c dp_c + dF_r/dp'_c dp'_c,    dp_c = J_c dq,    dp'_c = J_c dv + J'_c dq.
"""

import numpy as np

from ..laws.table import LawColumn, call
from .compiling import kernel_function
from .markers import add_force, add_geometric
from .tables import Forces, Markers, Report, State, StatefulData


@kernel_function
def _read_counts(tables, k):
    """Return for force k the first column, State.X or State.ANGLE; the number of components, 2 or 1; the number of states."""
    d = tables.forces[k, Forces.NUMBERS]  # index of its first number
    return int(tables.data[d]), int(tables.data[d + StatefulData.COUNT]), int(tables.data[d + StatefulData.STATES])


@kernel_function
def _evaluate(tables, work, k, r, count):
    """Evaluate component r of the force if r < count, else the rate of state r - count, at the arguments in work.scratch."""
    factor = tables.factors[k] if r < count else 1.0  # statics scales the force, not the rates of its states
    # components, `count` of them, then rates have consecutive laws
    return factor * call(tables.laws[tables.forces[k, Forces.LAW] + r, LawColumn.FIRST_ADDRESS], work.scratch)


@kernel_function
def _find_coordinate(tables, k, first, count, component):
    """Return of component p_c the marker, the row of work.jacobian, and the row of the marker's first coordinate in the block."""
    a, state = tables.forces[k, Forces.A], component - count
    if state < 0:  # rows of work.jacobian are x, y, angle, as the first columns of `State`
        return a, first + component, 0
    b = tables.forces[k, Forces.B]  # first marker of a state; in the block the coordinates of states, one each, follow those of a
    return b + state, State.ANGLE, tables.markers[a, Markers.COUNT] + state * tables.markers[b, Markers.COUNT]


@kernel_function
def _fill_arguments(tables, work, k, t):
    """Fill work.scratch with the arguments of force k: time, x and y or the angle since t = 0, their rates, states."""
    first, count, states = _read_counts(tables, k)
    a, b, arguments = tables.forces[k, Forces.A], tables.forces[k, Forces.B], work.scratch
    arguments[0] = t
    for i in range(count):  # rates are three columns behind: `State` begins with X Y ANGLE VX VY SPIN
        arguments[1 + i], arguments[1 + count + i] = work.state[a, State.X + first + i], work.state[a, State.VX + first + i]
    arguments[1] -= tables.data[tables.forces[k, Forces.NUMBERS] + StatefulData.OFFSET]  # angle at t = 0; 0 for x
    for i in range(states):
        arguments[1 + 2 * count + i] = work.state[b + i, State.SPIN]


@kernel_function
def add_stateful(tables, work, k, t, f):
    """Add the force and the rates of its states to f, and report the force."""
    _, count, states = _read_counts(tables, k)
    a, out = tables.forces[k, Forces.A], work.reports[k]
    _fill_arguments(tables, work, k, t)  # in work.scratch, for _evaluate
    out[Report.FX], out[Report.FY] = 0.0, 0.0  # a torque has none
    out[Report.VALUE] = _evaluate(tables, work, k, 0, count)
    if count > 1:
        out[Report.FX], out[Report.FY] = out[Report.VALUE], _evaluate(tables, work, k, 1, count)
        out[Report.VALUE] = np.sqrt(out[Report.FX] * out[Report.FX] + out[Report.FY] * out[Report.FY])
    add_force(tables, work, a, out[Report.FX], out[Report.FY], out[Report.VALUE] if count == 1 else 0.0, f)
    for i in range(states):
        marker = tables.forces[k, Forces.B] + i
        f[tables.dofs[tables.markers[marker, Markers.FIRST]]] += _evaluate(tables, work, k, count + i, count)


@kernel_function
def add_stateful_tangents(tables, work, k, t, q):
    """Add the derivatives of the force and of the rates of its states, by central differences; the force was added before."""
    first, count, states = _read_counts(tables, k)
    arguments, out = work.scratch, work.reports[k]
    _fill_arguments(tables, work, k, t)
    for c in range(count + count + states):
        is_coordinate = c < count  # arguments: `count` coordinates, their rates, states, which are rates of extra coordinates
        component = c if is_coordinate else c - count
        marker_c, column_c, first_c = _find_coordinate(tables, k, first, count, component)
        x = arguments[1 + c]
        h = 1e-6 * max(abs(x), 1e-3)  # chosen, for small rounding and truncation; 1e-3, in the unit of x: h > 0 at x = 0
        for r in range(count + states):
            arguments[1 + c] = x + h
            slope = _evaluate(tables, work, k, r, count)
            arguments[1 + c] = x - h
            slope = (slope - _evaluate(tables, work, k, r, count)) / (2.0 * h)
            marker_r, column_r, first_r = _find_coordinate(tables, k, first, count, r)
            for i in range(tables.markers[marker_r, Markers.COUNT]):
                push = slope * work.jacobian[column_r, tables.markers[marker_r, Markers.FIRST] + i]
                for j in range(tables.markers[marker_c, Markers.COUNT]):
                    at = tables.markers[marker_c, Markers.FIRST] + j
                    if is_coordinate:  # the signs: the stiffness is -df/dq, the damping -df/dv
                        work.block_stiffness[first_r + i, first_c + j] -= push * work.jacobian[column_c, at]
                    else:
                        work.block_damping[first_r + i, first_c + j] -= push * work.jacobian[column_c, at]
                        work.block_stiffness[first_r + i, first_c + j] -= push * work.jacobian_rate[column_c, at]
        arguments[1 + c] = x
    moment = out[Report.VALUE] if count == 1 else 0.0
    opposite = -out[Report.FX], -out[Report.FY], -moment  # as the stiffness is -df/dq
    # the term with dJ/dq, at the coordinates of the force's marker, which are the first in the block
    add_geometric(tables, work, tables.forces[k, Forces.A], q, opposite, work.block_stiffness, 0)
