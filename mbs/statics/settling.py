"""Pseudo-transient continuation to an equilibrium far from the drawn pose, and deflation to find further ones.

Implicit Euler steps on M q' = f - G^T lambda grow: [M/dt + K, G^T; G, 0] [dq; lambda] = [f; -g]. For large dt they are Newton's.
Deflation solves F(q)/m(q) = 0, with m small near known solutions. Its step is Newton's times a number that avoids them.

References
----------
C. T. Kelley, D. E. Keyes, Convergence analysis of pseudo-transient continuation, SIAM J. Numer. Anal. 35 (1998) 508-523,
doi 10.1137/S0036142996304796.
P. E. Farrell, A. Birkisson, S. W. Funke, Deflation techniques for finding distinct solutions of nonlinear partial differential
equations, SIAM J. Sci. Comput. 37 (2015) A2026-A2045, doi 10.1137/140984798.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..elements import Rope
from .algebra import solve
from .problem import BALANCED, ITERATIONS, Problem, Rest, StaticsError, moving

MOVE = 0.1
"""Intended change in a step far from rest [lengths or rad]."""
AWAY = 60.0
"""Distance, over the size of the mechanism, after which a motion counts as endless."""
SHORTEST = 1e-4
"""Smallest increment of the load, over the load."""
LOAD_STEP = 0.1
"""Largest change in a load increment [lengths or rad]: from farther Newton's method may reach another branch."""
CORRECTIONS = 4
"""Iterations of an implicit step: the first one stretches a strip that turns."""
CHANGE = 0.2
"""Largest last iteration of an implicit step, over the step."""
STEPS = 6000
"""Most implicit steps: along a stiff curved contact they are short."""


class RunsAwayError(StaticsError):
    """Error of a motion that nothing stops."""


class SlackError(StaticsError):
    """Error of a rope that would have to push."""


def settle(problem: Problem, rest: Rest) -> Rest:
    """Find a stable equilibrium by pseudo-transient continuation.

    Raises
    ------
    RunsAwayError
        If the mechanism moves farther than `AWAY`.
    StaticsError
        If it still moves after `STEPS` steps.
    """
    rest, span = rest._replace(multipliers=np.zeros_like(rest.multipliers)), 0.0
    begun, kicks, way = rest, 0, 0.0
    away = AWAY * float((problem.extents / problem.units).max(initial=1.0))
    for _ in range(STEPS):
        new, span, moved = _step(problem, rest, span)
        way += moved
        if moved < 1e-3:
            try:
                found = problem.newton(new, near=True)
            except StaticsError:
                found = None
            if found is not None and float(np.abs((found.q - new.q) / problem.units).max()) < MOVE:
                spectrum = problem.spectrum(found)
                if spectrum.stable or kicks > 20:
                    return found
                worst = int(np.argmax(spectrum.growth))
                shape, kicks = np.real(spectrum.shapes[:, worst]), kicks + 1
                kick = 1e-2 * shape / np.abs(shape / problem.units).max()
                new, span = found._replace(q=found.q + kick), 1.0 / float(spectrum.growth[worst]) ** 2
        rest = new
        if way > away:
            name = moving(problem.scene, rest.q, rest.q - begun.q)
            raise RunsAwayError(f"no equilibrium: '{name}' is free to move, and its load is not balanced on the way")
    raise StaticsError(f"'{moving(problem.scene, rest.q, rest.q - begun.q)}' still moves after {STEPS} damped steps")


def _step(problem: Problem, rest: Rest, span: float) -> tuple[Rest, float, float]:
    """Take an implicit step along the forces and of limited size; return state, next span [s^2] and largest change."""
    n, units = problem.scene.size, problem.units
    a, mass = problem.assemble(rest), problem.scene.mass_entries(rest.q)
    matrix = a.made(mass)[:n, :n]
    if span == 0.0:
        ratio = np.abs(a.stiffness.diagonal()) / matrix.diagonal()
        span = 1.0 / max(float(np.median(ratio)), 1e-6)
    for _ in range(60):
        new, last = rest, a
        for corrected in range(CORRECTIONS):
            dragged = last.force - matrix @ (new.q - rest.q) / span
            scaled, scale = problem.scale_matrix(last, mass / span)
            out = solve(scaled, np.concatenate([dragged * units / scale, -last.residual]))
            new = Rest(new.q + out[:n] * units, out[n:] * scale, rest.parameter)
            step, change = new.q - rest.q, float(np.abs(out[:n]).max(initial=0.0))
            moved = float(np.abs(step / units).max(initial=0.0))
            ahead = float(step @ (a.force - a.jacobian.T @ new.multipliers))
            forward = ahead >= -1e-12 * abs(float(step @ (matrix @ step))) / span or moved < 1e-9
            if not (np.isfinite(moved) and moved <= 2 * MOVE and forward) or (corrected and change > CHANGE * moved):
                break
            force, _, last = problem.residual(new)
            if moved < 1e-9 or float(step @ force) >= -max(ahead, 0.0):  # otherwise it went deep into an open contact
                return new, span * min(4.0, max(1.2, MOVE / max(moved, 1e-300))), moved
        span *= max(0.1, min(0.5, MOVE / moved)) if np.isfinite(moved) and moved > 0.0 else 0.25
    raise StaticsError("the mechanism cannot be moved as its forces push: are its constraints impossible?")


def find(problem: Problem, start: Rest, near: bool) -> tuple[Rest, str]:
    """Find the equilibrium, and a note on the method if not the default; from a `near` guess all loads act at once."""
    load = start.parameter
    if near:
        return problem.newton(start), ""
    if problem.is_balanced(start._replace(multipliers=problem.balancing(start))):
        return problem.newton(start), ""
    loose = problem.spectrum(problem.start(0.0), 1).neutral.any()
    reached = 0.0
    if not loose:
        rest, reached = _grow(problem, load)
        if reached == 1.0:
            return rest, ""
    try:
        rest = settle(problem, start)
    except RunsAwayError:
        raise
    except StaticsError as error:
        raise StaticsError(f"Newton's method reached {reached:.4g} of the load; beyond it, {error}") from None
    return rest, f"beyond {reached:.4g} of the load by damped motion" if not loose else "by damped motion from the drawn pose"


def check_ropes(problem: Problem, rest: Rest) -> None:
    """Raise an error if a rope would have to push, or one of its ends lies in a pulley."""
    scene = problem.scene
    for name in (name for name, each in scene.source.elements.items() if isinstance(each, Rope)):
        row = scene.row_names.index(name)
        first, _, count = scene.tables.rows[row]
        lengths = [scene.measure(i, rest.q) for i in range(first, first + count)]
        if min(lengths) < 1e-6 * scene.length:
            raise RunsAwayError(f"no equilibrium: '{name}' draws one of its ends into a pulley")
        if rest.multipliers[row] < -BALANCED * max(1.0, np.abs(rest.multipliers).max()):
            raise SlackError(f"'{name}' would have to push with {-rest.multipliers[row]:.4g} N: it goes slack")


def _grow(problem: Problem, load: float) -> tuple[Rest, float]:
    """Increase the load from zero to its value; return the equilibrium and the share that was reached.

    An increment is halved where it moves the mechanism far or loses stability: Newton's method may have left the path. Where the
    shortest increment still loses stability the path itself does.
    """
    rest, done, part = problem.start(0.0), 0.0, 1.0
    stable = problem.spectrum(rest, 1).stable
    while done < 1.0:
        part = min(part, 1.0 - done)
        try:
            new = problem.newton(rest._replace(parameter=load * (done + part)))
            near = float(np.abs((new.q - rest.q) / problem.extents).max(initial=0.0)) <= LOAD_STEP
            keeps = near and problem.spectrum(new, 1).stable
        except StaticsError:
            near = keeps = False
        if near and (keeps or not stable or part < SHORTEST):
            rest, done, part, stable = new, done + part, 2.0 * part, keeps
        elif part < SHORTEST:
            break
        else:
            part *= 0.5
    return rest, done


APART = 1e-6
"""Distance, in units of the coordinates, up to which two states are the same."""
KICKS = (0.03, 0.3)
"""Offsets along a shape, to both sides, at which a search starts; settling uses the second from the first equilibrium only."""
SHAPES = 4
"""Number of lowest shapes of each equilibrium along which searches start."""


def others(problem: Problem, rest: Rest, further: list[Rest]) -> list[Rest]:
    """Find further equilibria by deflation and by settling, from offsets along the lowest shapes of all known ones."""
    known = [rest]
    known += [each for each in further if _new(problem, each, known)]
    for base in known:
        for start, kick in _starts(problem, base):
            for way in (_deflate, _settle_damped) if base is rest or kick == KICKS[0] else (_deflate,):
                found = way(problem, start, known)
                if found is not None and len(known) < 30:
                    known.append(found)
    return known[1:]


def _starts(problem: Problem, rest: Rest) -> Iterator[tuple[Rest, float]]:
    shapes = np.real(problem.spectrum(rest).shapes[:, :SHAPES])
    for shape in shapes.T:
        shape = shape / max(float(np.abs(shape / problem.extents).max()), 1e-300)
        for kick in KICKS:
            for side in (kick, -kick):
                yield rest._replace(q=rest.q + side * shape), kick


def _new(problem: Problem, found: Rest, known: list[Rest]) -> Rest | None:
    """Return a state unless it is known up to whole turns, else None."""
    whole = np.where(problem.scene.units == 1.0, 2 * np.pi, np.inf)
    for other in known:
        change = found.q - other.q
        turns = np.where(np.isfinite(whole), np.round(change / np.where(np.isfinite(whole), whole, 1.0)) * 2 * np.pi, 0.0)
        if np.abs((change - turns) / problem.units).max() < APART:
            return None
    return found


def _deflate(problem: Problem, rest: Rest, known: list[Rest]) -> Rest | None:
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


def _settle_damped(problem: Problem, start: Rest, known: list[Rest]) -> Rest | None:
    try:
        return _new(problem, settle(problem, start), known)
    except StaticsError:
        return None
