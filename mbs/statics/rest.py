"""Equilibrium of a mechanism under its loads, with stability and error, by load steps or pseudo-transient continuation.

Pseudo-transient continuation takes implicit Euler steps of growing length tau [s^2] on the flow M dq/dtau = f - G^T lambda:

    [M/tau + K, G^T; G, 0] [dq; lambda] = [f; -g].

For large tau they are steps of Newton's method (Kelley and Keyes 1998, doi 10.1137/S0036142996304796). Symbols: see `problem`.
"""

from contextlib import suppress

import numpy as np

from ..elements import Rope
from ..geometry import Array
from ..mechanism import Mechanism
from ..process import one_thread
from ..progress import USER_STOPS, watch, watching
from ..spectral.linear import Equations
from ..spectral.scene import CompiledScene
from ..spectral.tables import ForceKind, RowColumn
from ..validate import number
from .algebra import solve
from .answer import ACCURACY, DEGREE_STEP, LARGEST_ERROR, MAX_DEGREE, Ending, Equilibrium, check, list_omissions
from .problem import BALANCED, SEARCH_STOPS, Problem, Rest, StaticsError, distance_between, find_moving_link, loads_of

TARGET_MOVE = 0.1
"""Change of the pose for which tau of the next implicit step is chosen, in units of the coordinates."""
STEPS = 6000
"""Most implicit steps: along a stiff curved contact they are short."""


class RunsAwayError(StaticsError):
    """Failure of the search because a mechanism moves on under its load, or a rope draws its end into a pulley."""


class SlackError(StaticsError):
    """Failure of the search because a rope would have to push."""


@watch("steps")
@one_thread()
def equilibrium(
    mechanism: Mechanism, load: float = 1.0, *, degree: int | None = None,
    timeout: float | None = None, progress: bool | None = None,
) -> Equilibrium:  # fmt: skip
    """Find the equilibrium of a mechanism with its drives fixed at t = 0 and its loads multiplied by `load`.

    Loads grow from zero, from the stress-free pose. If the mechanism is movable, or if Newton's method fails, pseudo-transient
    continuation leads to a stable equilibrium. Raise a ValueError for an invalid argument.

    Parameters
    ----------
    load : float
        Factor of all forces, torques and gravity, not of springs, contacts and strips.
    degree : int, optional
        Degree of the strips; by default it is increased until the error is below 1e-8 of the longest link.
    timeout, progress
        Time limit [s], after which the best so far is the answer; True shows the expected time, by default in terminals.
    """
    check(mechanism, degree)
    number("load", load, -np.inf, np.inf, "1")
    scene = CompiledScene.of(mechanism, degree)
    problem = Problem(scene, loads_of(scene))
    watching.get().best = None  # later (problem, state, error, message) of the best state: arguments of `_answer`
    try:
        try:
            rest, message = find_equilibrium(problem, load)
            found = *_refine(problem, rest, degree is not None), message
        except USER_STOPS:
            found = watching.get().best
            if found is None:
                raise
        return _answer(*found)
    except SEARCH_STOPS as error:  # a failure, also of the best state, or a stop before there is one
        return _make_failure(problem, error, load)
    finally:
        problem.set_parameter(1.0)  # the scene, which results have, is then that of the mechanism as given


def settle(problem: Problem, rest: Rest) -> Rest:
    """Find a stable equilibrium from a state; raise a StaticsError if that fails, a RunsAwayError if the mechanism moves on."""
    start = rest = rest._replace(multipliers=np.zeros_like(rest.multipliers))  # each step computes new ones
    tau, way, displacements = 0.0, 0.0, 0
    # sum of all changes of the pose after which a motion counts as endless; 60 times the size of the mechanism: chosen
    longest = 60.0 * float((problem.extents / problem.units).max(initial=1.0))
    watching.get().most = STEPS
    for _ in range(STEPS):
        watching.get().step()
        new, tau, change = _step(problem, rest, tau)
        way += change
        found = None
        if change < TARGET_MOVE / 100:  # near rest; 100 is chosen, and only begins a try of Newton's method
            with suppress(StaticsError):  # Newton steps must decrease: growing ones would lead to another equilibrium
                found = problem.newton(new, must_decrease=True)
        if found is not None and float(np.abs((found.q - new.q) / problem.units).max()) < TARGET_MOVE:
            spectrum = problem.spectrum(found)
            if spectrum.stable or displacements > 20:  # 20 is chosen: an unstable equilibrium is then the answer
                return found
            fastest = int(np.argmax(spectrum.growth))
            # from an unstable equilibrium the search goes on along the fastest growing shape
            shape = np.real(spectrum.shapes[:, fastest])
            displacement = 1e-2 * shape / np.abs(shape / problem.units).max()  # a tenth of TARGET_MOVE
            new, tau = found._replace(q=found.q + displacement), 1.0 / float(spectrum.growth[fastest]) ** 2
            displacements += 1
        rest = new
        if way > longest:
            name = find_moving_link(problem.scene, rest.q, rest.q - start.q)
            raise RunsAwayError(f"no equilibrium: '{name}' is free to move, and its load is not balanced on the way")
    raise StaticsError(f"'{find_moving_link(problem.scene, rest.q, rest.q - start.q)}' still moves after {STEPS} damped steps")


def _step(problem: Problem, rest: Rest, tau: float) -> tuple[Rest, float, float]:
    """Take an implicit step, with a smaller tau if it is refused; return state, next tau [s^2], largest change in units."""
    begin, mass = problem.assemble(rest), problem.scene.mass_entries(rest.q)
    if tau == 0.0:  # of the first step: estimate it
        masses = begin.build(mass).diagonal()[: problem.scene.size]
        ratio = float(np.median(np.abs(begin.stiffness.diagonal()) / masses))  # square of a frequency [1/s^2]
        tau = 1.0 / max(ratio, 1e-6)  # 1e-6: without stiffness; any small one, as tau adapts
    for _ in range(60):  # each at least halves tau
        new, change = _iterate(problem, rest, begin, mass, tau)
        if new is not None:
            growth = min(4.0, max(1.2, TARGET_MOVE / max(change, 1e-300)))  # by 1.2 at least, towards steps of Newton's method
            return new, growth * tau, change
        tau *= max(0.1, min(0.5, TARGET_MOVE / change)) if np.isfinite(change) and change > 0.0 else 0.25
    raise StaticsError("the mechanism cannot be moved as its forces push: are its constraints impossible?")


def _iterate(problem: Problem, rest: Rest, begin: Equations, mass: Array, tau: float) -> tuple[Rest | None, float]:
    """Solve for an implicit step by Newton's method; return the state, None if the step is refused, and the change in units.

    The forces f - G^T lambda at the start of the step must do positive work along it. Those at its end may do negative work of
    the same amount at most: more of it means that the step went deep into a contact that was open.
    """
    n, units = problem.scene.size, problem.units
    mass_matrix, new, last = begin.build(mass)[:n, :n], rest, begin
    for iteration in range(4):  # until the work at the end is accepted; one linear iteration stretches a strip that rotates
        force = last.force - mass_matrix @ (new.q - rest.q) / tau
        matrix, force_unit = problem.scale_matrix(last, mass / tau)  # for dq over units, dlambda over force_unit
        out = solve(matrix, np.concatenate([force * units / force_unit, -last.residual]))
        new = Rest(new.q + out[:n] * units, out[n:] * force_unit, rest.parameter)
        step = new.q - rest.q
        change = float(np.abs(step / units).max(initial=0.0))
        is_short = np.isfinite(change) and change <= 2 * TARGET_MOVE
        work_at_start = float(step @ (begin.force - begin.jacobian.T @ new.multipliers))  # multipliers belong to the step
        rounding = 1e-12 * abs(float(step @ (mass_matrix @ step))) / tau
        is_rounding = change < 1e-9  # chosen: the sign of the work is then rounding
        goes_forward = work_at_start >= -rounding or is_rounding
        diverges = iteration > 0 and float(np.abs(out[:n]).max(initial=0.0)) > 0.2 * change  # 0.2: chosen
        if not (is_short and goes_forward) or diverges:
            return None, change
        balance, _, last = problem.residual(new)  # f - G^T lambda
        work_at_end = float(step @ balance)
        if work_at_end >= -max(work_at_start, 0.0) or is_rounding:
            return new, change
    return None, change


def find_equilibrium(problem: Problem, load: float) -> tuple[Rest, str]:
    """Find the equilibrium under loads times `load`; return it with a note on the method, '' if by load steps."""
    start = problem.start(load)
    # the pose as given may be an equilibrium: with multipliers by least squares
    if problem.is_balanced(start._replace(multipliers=problem.compute_multipliers(start))):
        return problem.newton(start), ""
    is_movable = problem.spectrum(problem.start(0.0), count=1).neutral.any()  # the lowest eigenvalue is zero: a rigid motion
    reached = 0.0
    if not is_movable:
        rest, reached = _grow(problem, load)
        if reached == 1.0:
            return rest, ""
    try:
        rest = settle(problem, start)
    except StaticsError as error:
        if isinstance(error, RunsAwayError):
            raise
        raise StaticsError(f"Newton's method reached {reached:.4g} of the load; beyond it, {error}") from None
    return rest, "by damped motion from the drawn pose" if is_movable else f"beyond {reached:.4g} of the load by damped motion"


def check_ropes(problem: Problem, rest: Rest) -> None:
    """Raise an error if a rope would have to push, or one of its ends coincides with a pulley."""
    scene = problem.scene
    for name in (name for name, element in scene.source.elements.items() if isinstance(element, Rope)):
        row = scene.row_names.index(name)
        first, count = scene.tables.rows[row, [RowColumn.FIRST, RowColumn.TERMS]]  # of the measures, which are contiguous
        lengths = [scene.measure(i, rest.q) for i in range(first, first + count)]
        if min(lengths) < 1e-6 * scene.length:
            raise RunsAwayError(f"no equilibrium: '{name}' draws one of its ends into a pulley")
        largest = max(1.0, np.abs(rest.multipliers).max())  # [N or N m]; 1 is a floor
        if rest.multipliers[row] < -BALANCED * largest:
            raise SlackError(f"'{name}' would have to push with {-rest.multipliers[row]:.4g} N: it goes slack")


def _grow(problem: Problem, load: float) -> tuple[Rest, float]:
    """Increase the load from zero to its value; return the last equilibrium and the fraction of the load that was reached."""
    rest, reached, increment = problem.start(0.0), 0.0, 1.0
    stable = problem.spectrum(rest, count=1).stable
    while reached < 1.0:
        increment = min(increment, 1.0 - reached)
        try:
            watching.get().best = problem, rest, np.inf, f"this is the equilibrium at {reached:.4g} of the load"
            watching.get().step(reached)
            new = problem.newton(rest._replace(parameter=load * (reached + increment)))
            # 0.1, chosen: after a larger change of the pose, over the extents, it may be on another branch
            is_near = float(np.abs((new.q - rest.q) / problem.extents).max(initial=0.0)) <= 0.1
            stays_stable = is_near and problem.spectrum(new, count=1).stable
        except StaticsError:
            is_near = stays_stable = False
        is_least = increment < 1e-4  # of the load: chosen
        may_be_unstable = not stable or is_least  # it was unstable, or becomes so in any increment
        if is_near and (stays_stable or may_be_unstable):
            rest, reached, increment, stable = new, reached + increment, 2.0 * increment, stays_stable
        elif is_least:
            break
        else:  # it moved far or lost stability: Newton's method may have left the path
            increment *= 0.5
    return rest, reached


def _refine(problem: Problem, rest: Rest, keeps_degree: bool) -> tuple[Problem, Rest, float]:
    """Increase the degree, unless it `keeps_degree`, until the error is small; return problem, equilibrium and error."""
    error = previous = np.inf
    while problem.scene.strips:
        finer, guess = problem.refine(rest, DEGREE_STEP)
        watching.get().best = problem, rest, error, f"strips of the degree {problem.scene.degree} may not be enough"
        try:
            new = finer.newton(guess)
        except StaticsError:
            return problem, rest, np.inf
        error = distance_between(finer.scene, guess.q, new.q)
        if keeps_degree:
            break
        problem, rest = finer, new
        is_rounding = error > 0.5 * previous  # a higher degree does not halve it
        if error <= ACCURACY or is_rounding or problem.scene.degree > MAX_DEGREE:
            break
        previous = error
    return problem, rest, error if problem.scene.strips else 0.0


def _answer(problem: Problem, rest: Rest, error: float, message: str) -> Equilibrium:
    """Make the result from a state with its stability; its error is at least the next step of Newton's method."""
    check_ropes(problem, rest)
    _, next_change = problem.step(rest)  # in units of the coordinates
    error = max(error, next_change)
    spectrum = problem.spectrum(rest)
    neutral = tuple(find_moving_link(problem.scene, rest.q, np.real(shape)) for shape in spectrum.shapes[:, spectrum.neutral].T)
    growth = float(spectrum.growth.max(initial=0.0))
    status = Ending.INACCURATE if error >= LARGEST_ERROR else Ending.UNSTABLE if growth else Ending.OK
    notes = [message] if message else []
    notes += [f"one of many: nothing holds {', '.join(dict.fromkeys(map(repr, neutral)))}"] if neutral else []
    notes += [f"unstable: a small motion grows at {growth:.4g} 1/s"] if growth else []
    if status is Ending.INACCURATE:
        hint = "; give a higher degree, or points along the strip" if problem.scene.strips else ""
        size = f"{error:.1e} of the longest link" if error < np.inf else "not known"  # no refinement has succeeded
        notes.append(f"its error is {size}{hint}")
    problem.set_parameter(1.0)  # also in the scene of a higher degree, which is that of the result
    notes += list_omissions(problem.scene.mechanism)
    return Equilibrium(status, "; ".join(notes), problem.scene, *rest, growth == 0.0, growth, neutral, error)


def _make_failure(problem: Problem, error: BaseException, load: float) -> Equilibrium:
    """Make the result of a search that failed."""
    scene = problem.scene
    pairs = zip(scene.force_names, scene.tables.forces, strict=True)
    contacts = [name for name, (kind, *_) in pairs if kind in (ForceKind.CONTACT, ForceKind.JOURNAL)]
    status, message = Ending.NOT_REACHED, str(error)
    if isinstance(error, RunsAwayError):
        status = Ending.OPEN_CONTACT if contacts else Ending.FREE_MOTION
        message += f"; open: {', '.join(contacts)}" if contacts else ""  # all contacts: none has stopped the motion
    elif isinstance(error, SlackError):
        status = Ending.SLACK
    elif isinstance(error, USER_STOPS):
        message = "no equilibrium was found yet"
    message = "; ".join([message, *list_omissions(scene.mechanism)])
    q, multipliers = np.full(scene.size, np.nan), np.full(len(scene.row_names), np.nan)
    return Equilibrium(status, message, scene, q, multipliers, load, stable=False, growth=np.nan, neutral=(), error=np.inf)
