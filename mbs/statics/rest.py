"""Equilibrium of a mechanism under its loads, with stability and error, by load steps or pseudo-transient continuation.

The latter takes implicit Euler steps of growing length on M q' = f - G^T lambda:

    [M/dt + K, G^T; G, 0] [dq; lambda] = [f; -g].

For large dt they are steps of Newton's method (Kelley and Keyes 1998, doi 10.1137/S0036142996304796).
"""

from __future__ import annotations

import numpy as np

from ..elements import Rope
from ..mechanism import Mechanism
from ..process import one_thread
from ..progress import STOPS, watch, watching
from ..spectral.scene import CompiledScene
from ..spectral.tables import ForceKind
from ..validate import number
from .algebra import solve
from .answer import HIGHEST, PLACES, RISE, Ending, Equilibrium, check, list_omissions
from .problem import BALANCED, ENDS, Problem, Rest, StaticsError, distance_between, has_strips, loads_of, moving

TARGET_MOVE = 0.1
"""Change per step for which the length of the next one is chosen [lengths or rad]."""
ENDLESS = 60.0
"""Length of the path, over the size of the mechanism, after which a motion counts as endless."""
SHORTEST = 1e-4
"""Smallest increment of the load, over the load."""
LOAD_STEP = 0.1
"""Largest change in a load increment [lengths or rad]: after a larger one Newton's method may reach another branch."""
CORRECTIONS = 4
"""Most iterations of an implicit step: the first one stretches a strip that rotates."""
CONVERGED = 0.2
"""Largest iterate of an implicit step, over the step, with which it is accepted."""
STEPS = 6000
"""Most implicit steps: along a stiff curved contact they are short."""
FRICTION = "friction may hold it elsewhere"


class RunsAwayError(StaticsError):
    """Error of a motion without an equilibrium."""


class SlackError(StaticsError):
    """Error of a rope that would have to push."""


@watch("steps")
@one_thread()
def equilibrium(
    mechanism: Mechanism, load: float = 1.0, *, degree: int | None = None,
    timeout: float | None = None, progress: bool | None = None,
) -> Equilibrium:  # fmt: skip
    """Find the equilibrium of a mechanism with its drives fixed at t = 0 and its loads multiplied by `load`.

    Loads grow from zero, from the stress-free start. If the mechanism is movable, or the path ends, pseudo-transient continuation
    leads to a stable equilibrium.

    Parameters
    ----------
    mechanism : Mechanism
    load : float
        Factor of all forces, torques and gravity, not of springs, contacts and strips.
    degree : int, optional
        Degree of the strips; by default it is increased until the error is below 1e-8 of the longest link.
    timeout, progress
        Limit of time [s], after which the best so far is the answer; how long it takes is shown, by default in terminals.

    Returns
    -------
    Equilibrium
        The status is OK for a stable equilibrium, UNSTABLE for an unstable one.

    Raises
    ------
    ValueError
        If an argument is invalid.
    """
    check(mechanism, degree)
    number("load", load, -np.inf, np.inf, "1")
    scene = CompiledScene.of(mechanism, degree)
    problem, watching.get().best = Problem(scene, loads_of(scene)), None
    try:
        rest, message = find(problem, load)
        return _answer(*_refine(problem, rest, degree is not None), message)
    except ENDS as why:
        if isinstance(why, StaticsError) or watching.get().best is None:
            return _make_failure(problem, why, load)
        return _answer(*watching.get().best)
    finally:
        problem.set(1.0)


def settle(problem: Problem, rest: Rest) -> Rest:
    """Find a stable equilibrium by pseudo-transient continuation; raise a RunsAwayError for a motion beyond `ENDLESS`.

    An unstable equilibrium is left along its fastest growing shape.
    """
    rest, span = rest._replace(multipliers=np.zeros_like(rest.multipliers)), 0.0
    begun, kicks, distance, watching.get().most = rest, 0, 0.0, STEPS
    endless = ENDLESS * float((problem.extents / problem.units).max(initial=1.0))
    for _ in range(STEPS):
        watching.get().step()
        new, span, moved = _step(problem, rest, span)
        distance += moved
        if moved < 1e-3:
            try:
                found = problem.newton(new, near=True)
            except StaticsError:
                found = None
            if found is not None and float(np.abs((found.q - new.q) / problem.units).max()) < TARGET_MOVE:
                spectrum = problem.spectrum(found)
                if spectrum.stable or kicks > 20:
                    return found
                worst = int(np.argmax(spectrum.growth))
                shape, kicks = np.real(spectrum.shapes[:, worst]), kicks + 1
                kick = 1e-2 * shape / np.abs(shape / problem.units).max()
                new, span = found._replace(q=found.q + kick), 1.0 / float(spectrum.growth[worst]) ** 2
        rest = new
        if distance > endless:
            name = moving(problem.scene, rest.q, rest.q - begun.q)
            raise RunsAwayError(f"no equilibrium: '{name}' is free to move, and its load is not balanced on the way")
    raise StaticsError(f"'{moving(problem.scene, rest.q, rest.q - begun.q)}' still moves after {STEPS} damped steps")


def _step(problem: Problem, rest: Rest, span: float) -> tuple[Rest, float, float]:
    """Take an implicit step along the forces and of limited size; return state, next span [s^2] and largest change."""
    n, units = problem.scene.size, problem.units
    a, mass = problem.assemble(rest), problem.scene.mass_entries(rest.q)
    matrix = a.build(mass)[:n, :n]
    if span == 0.0:
        ratio = np.abs(a.stiffness.diagonal()) / matrix.diagonal()
        span = 1.0 / max(float(np.median(ratio)), 1e-6)
    for _ in range(60):
        new, last = rest, a
        for corrected in range(CORRECTIONS):
            force = last.force - matrix @ (new.q - rest.q) / span
            scaled, scale = problem.scale_matrix(last, mass / span)
            out = solve(scaled, np.concatenate([force * units / scale, -last.residual]))
            new = Rest(new.q + out[:n] * units, out[n:] * scale, rest.parameter)
            step, change = new.q - rest.q, float(np.abs(out[:n]).max(initial=0.0))
            moved = float(np.abs(step / units).max(initial=0.0))
            work = float(step @ (a.force - a.jacobian.T @ new.multipliers))
            forward = work >= -1e-12 * abs(float(step @ (matrix @ step))) / span or moved < 1e-9
            if not (np.isfinite(moved) and moved <= 2 * TARGET_MOVE and forward) or (corrected and change > CONVERGED * moved):
                break
            force, _, last = problem.residual(new)
            if moved < 1e-9 or float(step @ force) >= -max(work, 0.0):  # otherwise the step went deep into an open contact
                return new, span * min(4.0, max(1.2, TARGET_MOVE / max(moved, 1e-300))), moved
        span *= max(0.1, min(0.5, TARGET_MOVE / moved)) if np.isfinite(moved) and moved > 0.0 else 0.25
    raise StaticsError("the mechanism cannot be moved as its forces push: are its constraints impossible?")


def find(problem: Problem, load: float) -> tuple[Rest, str]:
    """Find the equilibrium under a factor of the loads; return also a note on the method, '' for load steps."""
    start = problem.start(load)
    if problem.is_balanced(start._replace(multipliers=problem.balancing(start))):
        return problem.newton(start), ""
    movable = problem.spectrum(problem.start(0.0), 1).neutral.any()
    reached = 0.0
    if not movable:
        rest, reached = _grow(problem, load)
        if reached == 1.0:
            return rest, ""
    try:
        rest = settle(problem, start)
    except RunsAwayError:
        raise
    except StaticsError as error:
        raise StaticsError(f"Newton's method reached {reached:.4g} of the load; beyond it, {error}") from None
    return rest, f"beyond {reached:.4g} of the load by damped motion" if not movable else "by damped motion from the drawn pose"


def check_ropes(problem: Problem, rest: Rest) -> None:
    """Raise an error if a rope would have to push, or one of its ends coincides with a pulley."""
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

    An increment that moves the mechanism far or loses stability is halved, as Newton's method may have left the path.
    """
    rest, done, part = problem.start(0.0), 0.0, 1.0
    stable = problem.spectrum(rest, 1).stable
    while done < 1.0:
        part = min(part, 1.0 - done)
        try:
            watching.get().best = problem, rest, np.inf, f"this is the equilibrium at {done:.4g} of the load"
            watching.get().step(done)
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


def _refine(problem: Problem, rest: Rest, fixed: bool) -> tuple[Problem, Rest, float]:
    """Increase the degree, unless `fixed`, until the error is small."""
    error, before = 0.0, np.inf
    while has_strips(problem.scene):
        finer, guess = problem.refine(rest, RISE)
        watching.get().best = problem, rest, error or np.inf, f"strips of the degree {problem.scene.degree} may not be enough"
        try:
            new = finer.newton(guess)
        except StaticsError:
            return problem, rest, np.inf
        error = distance_between(finer.scene, guess.q, new.q)
        if fixed:
            break
        problem, rest = finer, new
        if error <= PLACES or error > 0.5 * before or problem.scene.degree > HIGHEST:
            break
        before = error
    return problem, rest, error


def _answer(problem: Problem, rest: Rest, error: float, message: str) -> Equilibrium:
    """Make the result: equilibrium with error and stability; of a search that was stopped with that status."""
    check_ropes(problem, rest)
    error = max(error, problem.step(rest)[1])
    spectrum = problem.spectrum(rest)
    neutral = tuple(moving(problem.scene, rest.q, np.real(shape)) for shape in spectrum.shapes[:, spectrum.neutral].T)
    growth = float(spectrum.growth.max(initial=0.0))
    status = Ending.INACCURATE if error >= 1e-4 else Ending.UNSTABLE if growth else Ending.OK
    notes = [message] if message else []
    notes += [f"one of many: nothing holds {', '.join(dict.fromkeys(map(repr, neutral)))}"] if neutral else []
    notes += [f"unstable: a small motion grows at {growth:.4g} 1/s"] if growth else []
    if status is Ending.INACCURATE and error < np.inf:
        hint = "; give a higher degree, or points along the strip" if has_strips(problem.scene) else ""
        notes.append(f"its error is {error:.1e} of the longest link{hint}")
    problem.set(1.0)
    notes += list_omissions(problem.scene.mechanism, FRICTION)
    return Equilibrium(
        status, "; ".join(notes), problem.scene, rest.q, rest.multipliers, rest.parameter, growth == 0.0, growth, neutral, error
    )  # fmt: skip


def _make_failure(problem: Problem, error: BaseException, load: float) -> Equilibrium:
    """Make the result of a search that failed."""
    scene = problem.scene
    pairs = zip(scene.force_names, scene.tables.forces, strict=True)
    contacts = [name for name, force in pairs if force[0] in (ForceKind.CONTACT, ForceKind.JOURNAL)]
    status, message = Ending.NOT_REACHED, str(error)
    if isinstance(error, RunsAwayError):
        status = Ending.OPEN_CONTACT if contacts else Ending.FREE_MOTION
        message += f"; open: {', '.join(contacts)}" if contacts else ""
    elif isinstance(error, SlackError):
        status = Ending.SLACK
    elif isinstance(error, STOPS):
        message = "no equilibrium was found yet"
    message = "; ".join([message, *list_omissions(scene.mechanism, FRICTION)])
    nowhere = np.full(scene.size, np.nan), np.full(len(scene.row_names), np.nan)
    return Equilibrium(status, message, scene, *nowhere, load, False, float("nan"), (), float("inf"))
