"""Further equilibria beside known ones, by deflation.

Newton's step on F(q)/m(q), m small near known solutions, is the plain step times a number: it is driven away from them.

References
----------
P. E. Farrell, A. Birkisson, S. W. Funke, Deflation techniques for finding distinct solutions of nonlinear partial differential
equations, SIAM J. Sci. Comput. 37 (2015) A2026-A2045, doi 10.1137/140984798.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.statics.problem import ITERATIONS, Problem, Rest, StaticsError
from buckler.mbs.statics.settling import settle

APART = 1e-6
"""Distance, in units of the coordinates, up to which two states are the same."""
KICKS = (0.03, 0.3)
SHAPES = 4
"""From each equilibrium the search begins that far along so many of its lowest shapes, to both sides; damped motion, which is
long, the farther way only from the first."""


def others(problem: Problem, rest: Rest, further: list[Rest]) -> list[Rest]:
    """Further equilibria, and those that deflation, or damped motion, finds from the lowest shapes of all that are known."""
    known = [rest]
    known += [each for each in further if _new(problem, each, known)]
    for base in known:
        for start, kick in _starts(problem, base):
            for way in (_deflated, _settled) if base is rest or kick == KICKS[0] else (_deflated,):
                found = way(problem, start, known)
                if found is not None and len(known) < 30:
                    known.append(found)
    return known[1:]


def _starts(problem: Problem, rest: Rest) -> Iterator[tuple[Rest, float]]:
    shapes = np.real(problem.spectrum(rest).shapes[:, :SHAPES])
    for shape in shapes.T:
        shape = shape / max(float(np.abs(shape / problem.room).max()), 1e-300)
        for kick in KICKS:
            for side in (kick, -kick):
                yield rest._replace(q=rest.q + side * shape), kick


def _new(problem: Problem, found: Rest, known: list[Rest]) -> Rest | None:
    """A state, if it is not known; angles may differ by whole turns."""
    whole = np.where(problem.scene.units == 1.0, 2 * np.pi, np.inf)
    for other in known:
        change = found.q - other.q
        turns = np.where(np.isfinite(whole), np.round(change / np.where(np.isfinite(whole), whole, 1.0)) * 2 * np.pi, 0.0)
        if np.abs((change - turns) / problem.units).max() < APART:
            return None
    return found


def _deflated(problem: Problem, rest: Rest, known: list[Rest]) -> Rest | None:
    for _ in range(2 * ITERATIONS):
        new, size = problem.step(rest)
        if not np.isfinite(size):
            return None
        step, slope = (new.q - rest.q) / problem.units, 0.0
        for other in known:
            away = (rest.q - other.q) / problem.units
            square = float(away @ away)
            slope += -2.0 * float(away @ step) / (square * (1.0 + square))
        factor = 1.0 / (1.0 - slope) if slope != 1.0 else 1.0
        factor = float(np.sign(factor)) * min(abs(factor), 5.0)
        moved = (rest.q + factor * (new.q - rest.q), rest.multipliers + factor * (new.multipliers - rest.multipliers))
        rest = Rest(*moved, rest.parameter)
        if size < 1e-8:
            break
    try:
        found = problem.newton(rest)
    except StaticsError:
        return None
    return _new(problem, found, known)


def _settled(problem: Problem, start: Rest, known: list[Rest]) -> Rest | None:
    try:
        return _new(problem, settle(problem, start), known)
    except StaticsError:
        return None
