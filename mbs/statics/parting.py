"""In which directions paths leave a double branching.

There two shapes are free, and paths leave in some of the directions between them. The state at a small distance in a direction is
found with one force more, across it in the plane of both shapes: where that force is zero, a path leaves (the reduction of
Liapunov and Schmidt, by numbers).

References
----------
M. Golubitsky, D. G. Schaeffer, Singularities and Groups in Bifurcation Theory I (1985), ch. VII and X,
doi 10.1007/978-1-4612-5034-0.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from buckler.mbs.geometry import Array
from buckler.mbs.statics.problem import ITERATIONS, Problem, Rest, StaticsError

DISTANCE = 0.05
"""How far from the point it is looked around, in units of the coordinates, of a shape of length 1."""
ANGLES = 64
"""Directions that are looked at: two paths in less than a turn over this are taken for none."""
CONVERGED = 1e-11
"""Last step of Newton's method, in the same units."""
NOTHING = 1e-15
"""Force, over the tangent's entries, that is rounding: all directions alike, none is preferred."""


def ways(problem: Problem, rest: Rest, shapes: Array, unit: float) -> list[Array]:
    """Directions, (n,) each, in which paths leave a branching of two shapes, (n, 2); none where they cannot be told apart.

    `unit` is that of the parameter.
    """
    plane = np.linalg.qr(shapes / problem.units[:, None])[0]
    turns = np.linspace(0.0, 2 * np.pi, ANGLES + 1) + 0.1

    def across(turn: float) -> float:
        return _across(problem, rest, plane, unit, turn)

    try:
        found = [across(turn) for turn in turns]
        if np.abs(found).max() < NOTHING:
            return []
        low = np.flatnonzero(np.diff(np.sign(found)))
        roots = [float(brentq(across, turns[k], turns[k + 1], xtol=1e-6)) for k in low]
    except StaticsError:
        return []
    return [problem.units * (plane @ [np.cos(turn), np.sin(turn)]) for turn in roots]


def _across(problem: Problem, rest: Rest, plane: Array, unit: float, turn: float) -> float:
    """Force across a direction that holds the state at the distance in it, over the tangent's entries."""
    n, held, units = problem.scene.size, 0.0, problem.units
    along, side = plane @ [np.cos(turn), np.sin(turn)], plane @ [-np.sin(turn), np.cos(turn)]
    new = rest._replace(q=rest.q + DISTANCE * units * along)
    for _ in range(ITERATIONS):
        force, gap, a = problem.residual(new)
        slope = problem.slope(new, (force, gap))
        matrix, scale = problem.scaled(a)
        if not isinstance(matrix, np.ndarray):
            raise StaticsError("too many unknowns")
        columns, rows = np.zeros((len(matrix), 2)), np.zeros((2, len(matrix)))
        columns[:, 0] = -np.concatenate([slope[:n] * units / scale, -slope[n:]]) * unit
        columns[:n, 1], rows[:, :n] = -side, plane.T
        off = np.array([DISTANCE * np.cos(turn), DISTANCE * np.sin(turn)]) - plane.T @ ((new.q - rest.q) / units)
        right = np.concatenate([force * units / scale + held * side, -gap, off])
        step = np.linalg.lstsq(np.block([[matrix, columns], [rows, np.zeros((2, 2))]]), right)[0]
        new = Rest(new.q + step[:n] * units, new.multipliers + step[n:-2] * scale, new.parameter + step[-2] * unit)
        held += float(step[-1])
        if np.abs(step[:n]).max(initial=0.0) < CONVERGED:
            return held
    raise StaticsError("no state near")
