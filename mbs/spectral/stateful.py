"""Forces whose law has states, compiled, with their derivatives.

A state is the velocity of a coordinate of unit mass, and its rate the force there: each has a marker of its own, whose angle is
that coordinate. With p the places of the marker that is pushed, one angle or x and y, and c all of these coordinates and p,

    dF_r = dF_r/dp_c dp_c + dF_r/dp'_c dp'_c,    dp'_c = J_c dv + J'_c dq,

F_r a component of the force, or the rate of a state.
"""

from __future__ import annotations

import numpy as np

from .compiling import aside, call_array, inner
from .markers import add_force, add_geometric
from .tables import CALL, COUNT, FIRST, FX, FY, LAW_OF, NUMBERS, SPIN, STATES, TURN, VALUE, VX, A, B, X

SMALL = 1e-3
"""What derivatives take for the size of a smaller argument of a law."""


@inner
def _counts(s, k):
    """Of force k: first column of its marker that it pushes, how many, and how many states it has."""
    number = s.forces[k, NUMBERS]
    return int(s.data[number]), int(s.data[number + 1]), int(s.data[number + STATES])


@inner
def _value(s, w, k, r, count):
    """Component r of the force, or the rate of a state; what its law is a function of stands in w.element."""
    factor = s.factors[k] if r < count else 1.0
    return factor * call_array(s.laws[s.forces[k, LAW_OF] + r, CALL], w.element)


@inner
def _of(s, k, first, count, component):
    """Marker of a coordinate that the law sees or pushes, its column there, and where it stands in the force's block."""
    a, state = s.forces[k, A], component - count
    if state < 0:
        return a, first + component, 0
    return s.forces[k, B] + state, TURN, s.markers[a, COUNT] + state * s.markers[s.forces[k, B], COUNT]


@inner
def _fill(s, w, k, t):
    """Put what the law of force k is a function of into w.element: time, places, their rates, states."""
    first, count, states = _counts(s, k)
    a, b, given = s.forces[k, A], s.forces[k, B], w.element
    given[0] = t
    for i in range(count):
        given[1 + i], given[1 + count + i] = w.state[a, X + first + i], w.state[a, VX + first + i]
    given[1] -= s.data[s.forces[k, NUMBERS] + 3]
    for i in range(states):
        given[1 + 2 * count + i] = w.state[b + i, SPIN]


@inner
def add_stateful(s, w, k, t, f):
    """The force, and the rates of its states."""
    _, count, states = _counts(s, k)
    a, out = s.forces[k, A], w.reports[k]
    _fill(s, w, k, t)
    out[FX], out[FY] = 0.0, 0.0
    out[VALUE] = _value(s, w, k, 0, count)
    if count > 1:
        out[FX], out[FY] = out[VALUE], _value(s, w, k, 1, count)
        out[VALUE] = np.sqrt(out[FX] * out[FX] + out[FY] * out[FY])
    add_force(s, w, a, out[FX], out[FY], out[VALUE] if count == 1 else 0.0, f)
    for i in range(states):
        f[s.places[s.markers[s.forces[k, B] + i, FIRST]]] += _value(s, w, k, count + i, count)


@aside
def bend_stateful(s, w, k, t, q):
    """Derivatives of the same, by central differences of its law."""
    first, count, states = _counts(s, k)
    given, out = w.element, w.reports[k]
    _fill(s, w, k, t)
    for c in range(count + count + states):
        component, place = (c, True) if c < count else (c - count, False)
        mc, column, across = _of(s, k, first, count, component)
        x = given[1 + c]
        h = 1e-6 * max(abs(x), SMALL)
        for r in range(count + states):
            given[1 + c] = x + h
            slope = _value(s, w, k, r, count)
            given[1 + c] = x - h
            slope = (slope - _value(s, w, k, r, count)) / (2.0 * h)
            mr, row, down = _of(s, k, first, count, r)
            for i in range(s.markers[mr, COUNT]):
                push = slope * w.slope[row, s.markers[mr, FIRST] + i]
                for j in range(s.markers[mc, COUNT]):
                    at = s.markers[mc, FIRST] + j
                    if place:
                        w.stiff[down + i, across + j] -= push * w.slope[column, at]
                    else:
                        w.damp[down + i, across + j] -= push * w.slope[column, at]
                        w.stiff[down + i, across + j] -= push * w.drift[column, at]
        given[1 + c] = x
    add_geometric(s, w, s.forces[k, A], q, -out[FX], -out[FY], -out[VALUE] if count == 1 else 0.0, w.stiff, 0)
