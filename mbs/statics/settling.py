"""Pseudo-transient continuation to an equilibrium far from the drawn pose.

Implicit Euler steps on M q' = f - G^T lambda grow: [M/dt + K, G^T; G, 0] [dq; lambda] = [f; -g]. For large dt they are Newton's.

References
----------
C. T. Kelley, D. E. Keyes, Convergence analysis of pseudo-transient continuation, SIAM J. Numer. Anal. 35 (1998) 508-523,
doi 10.1137/S0036142996304796.
"""

from __future__ import annotations

import numpy as np

from ..elements import Rope
from .algebra import solve
from .problem import BALANCED, Problem, Rest, StaticsError, moving

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
    """Find a stable equilibrium by pseudo-transient continuation; raise a RunsAwayError of a motion farther than `AWAY`."""
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


def find(problem: Problem, load: float) -> tuple[Rest, str]:
    """Find the equilibrium under a factor of the loads, and a note on the method if not the default."""
    start = problem.start(load)
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
