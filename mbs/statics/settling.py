"""The way to a rest that is far from the drawn pose: motion in which only damping resists, in ever longer implicit steps.

M q' = dt-weighted forces: [M/dt + K, G^T; G, 0] [dq; lambda] = [f; -g]. With dt the steps become Newton's.

References
----------
C. T. Kelley, D. E. Keyes, Convergence analysis of pseudo-transient continuation, SIAM J. Numer. Anal. 35 (1998) 508-523,
doi 10.1137/S0036142996304796.
"""

from __future__ import annotations

import numpy as np

from buckler.mbs.elements import Rope
from buckler.mbs.geometry import Array
from buckler.mbs.statics.problem import BALANCED, Problem, Rest, StaticsError, least, moving, solve

MOVE = 0.1
"""Way of a step, lengths or rad, where the mechanism is far from rest."""
AWAY = 60.0
"""Way, in sizes of the mechanism, after which a motion is taken for endless."""
SHORTEST = 1e-4
"""Smallest part of the load that is tried at once."""
CORRECTIONS = 4
"""Iterations of an implicit step: a strip that turns would be stretched by the first one."""
CHANGE = 0.2
"""Of a step, by the last of them, up to which it has converged well enough."""
STEPS = 6000
"""Most steps: along a stiff contact that bends they are short."""


class RunsAwayError(StaticsError):
    """Nothing stops a motion."""


class SlackError(StaticsError):
    """A rope would have to push."""


def settle(problem: Problem, rest: Rest) -> Rest:
    """The stable rest to which a motion leads that only damping resists.

    Raises
    ------
    RunsAwayError
        If it does not end.
    StaticsError
        If it has not ended after so many steps.
    """
    rest, span = rest._replace(multipliers=np.zeros_like(rest.multipliers)), 0.0
    begun, kicks, way = rest, 0, 0.0
    away = AWAY * float((problem.room / problem.units).max(initial=1.0))
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
    """A step that goes with the forces and moves nothing too far; the next span, s^2, and how far it went."""
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
            scaled, scale = problem.scaled(last, mass / span)
            out = solve(scaled, np.concatenate([dragged * units / scale, -last.residual]))
            new = Rest(new.q + out[:n] * units, out[n:] * scale, rest.parameter)
            step, change = new.q - rest.q, float(np.abs(out[:n]).max(initial=0.0))
            moved = float(np.abs(step / units).max(initial=0.0))
            ahead = float(step @ (a.force - a.jacobian.T @ new.multipliers))
            forward = ahead >= -1e-12 * abs(float(step @ (matrix @ step))) / span or moved < 1e-9
            if not (np.isfinite(moved) and moved <= 2 * MOVE and forward) or (corrected and change > CHANGE * moved):
                break
            force, _, last = problem.residual(new)
            if moved < 1e-9 or float(step @ force) >= -max(ahead, 0.0):  # else it went far into a contact that was open
                return new, span * min(4.0, max(1.2, MOVE / max(moved, 1e-300))), moved
        span *= max(0.1, min(0.5, MOVE / moved)) if np.isfinite(moved) and moved > 0.0 else 0.25
    raise StaticsError("the mechanism cannot be moved as its forces push: are its constraints impossible?")


def find(problem: Problem, start: Rest, near: bool) -> tuple[Rest, str]:
    """The rest, and how it was reached if that is worth a word; `near` it, all loads act at once."""
    load = start.parameter
    if near:
        return problem.newton(start), ""
    if problem.balanced(start._replace(multipliers=carried(problem, start))):
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
    """Raise an error if a rope would have to push, or one of its ends lies in a pulley, where it has no direction."""
    scene = problem.scene
    for name in (name for name, each in scene.mechanism.elements().items() if isinstance(each, Rope)):
        row = scene.row_names.index(name)
        first, _, count = scene.tables.rows[row]
        lengths = [scene.measured(i, rest.q) for i in range(first, first + count)]
        if min(lengths) < 1e-6 * scene.length:
            raise RunsAwayError(f"no equilibrium: '{name}' draws one of its ends into a pulley")
        if rest.multipliers[row] < -BALANCED * max(1.0, np.abs(rest.multipliers).max()):
            raise SlackError(f"'{name}' would have to push with {-rest.multipliers[row]:.4g} N: it goes slack")


def carried(problem: Problem, rest: Rest) -> Array:
    """Multipliers that balance the forces as well as they can."""
    if not len(rest.multipliers):
        return np.zeros(0)
    a, units = problem.assemble(rest, False), problem.units
    return least((a.jacobian * units).T, a.force * units, 1e-10)


def _grow(problem: Problem, load: float) -> tuple[Rest, float]:
    """Raise the load to its value in parts that converge; and the part of it that was reached."""
    rest, done, part = problem.start(0.0), 0.0, 1.0
    while done < 1.0:
        part = min(part, 1.0 - done)
        try:
            rest = problem.newton(rest._replace(parameter=load * (done + part)))
            done, part = done + part, 2.0 * part
        except StaticsError:
            part *= 0.5
            if part < SHORTEST:
                break
    return rest, done
