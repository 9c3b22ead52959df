"""Paths of equilibria over a load, a drive or any number, with limit points, branchings and flutter, and their errors.

A path is followed by the steps of `arc`, with strips of a higher degree until the critical points of `critical` do not change.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import zip_longest

import numpy as np

from ..declare import Vector
from ..geometry import Array
from ..mechanism import Mechanism
from ..process import one_thread
from ..progress import USER_STOPS, watch, watching
from ..validate import one_of
from .answer import CRITICAL_ACCURACY, DEGREE_STEP, FIRST_STEP, MAX_STEP, Ending, Path, check, check_path, explain_end
from .arc import ON_CURVE, SHORTEST, Arc, Step, next_arc
from .critical import Critical, PathPiece, find_criticals, leaving_shapes, shape_towards, state_at
from .problem import Problem, Rest, StaticsError, loads_of
from .rest import find_equilibrium, settle
from .varied import Varied, problem_over

Branch = tuple[str, str, tuple[float, float]]
"""Link, point and direction (x, y): the branch along which the point moves in the direction is followed."""


@watch("steps")
@one_thread()
def path(
    mechanism: Mechanism, *, to: float, load: str | list[str] | None = None, drive: str | None = None,
    parameter: str | None = None, steps: int = 250, step: float = FIRST_STEP,
    longest: float = MAX_STEP, branch: Branch | None = None, branches: bool = False,
    degree: int | None = None, timeout: float | None = None, progress: bool | None = None,
) -> Path:  # fmt: skip
    """Follow the equilibria of a mechanism as loads grow, a drive moves or any number changes.

    Loads and drives start at 0, from the stress-free pose; a mechanism that can move freely there starts at the equilibrium under
    the first step of the load. A number starts at its value in the mechanism. Other loads act in full from the start. Raise a
    ValueError for an invalid argument or an unknown name.

    Parameters
    ----------
    to : float
        Parameter at which the path ends: factor of the load, travel of the drive, rad or m, or value of the number.
    load : str or list of str, optional
        Names of the loads that grow ('gravity', 'force.A', ...), by default all. Others are constant.
    drive : str, optional
        Name of the drive that moves ('drive').
    parameter : str, optional
        Path of any number, as in files: 'links.strip.body.section.thickness'.
    steps : int
        Largest number of steps; a path that does not reach `to` by then has the status TOO_MANY_STEPS.
    step, longest : float
        Lengths of the first and the longest step: root mean square of changes, in units of the longest link, rad and the range
        of the parameter. Other lengths follow from the curvature of the path.
    branch : (link, point, (x, y)), optional
        Leave the path at the first branching whose shape moves the point, to the side on which the point moves along (x, y).
    branches : bool
        Also follow all paths that leave the branchings, to both sides.
    degree : int, optional
        Degree of the strips; by default it is increased until critical points change by less than 1e-6.
    timeout, progress
        Time limit [s], after which the best so far is the answer; True shows the expected time, by default in terminals.
    """
    check(mechanism, degree)
    check_path(to, steps, step, longest, load=load, drive=drive, parameter=parameter)
    one_of("branches", branches, (bool,))
    if branch is not None:
        _check_branch(mechanism, branch)
    if load is not None and not load:
        raise ValueError("load = []: name at least one")

    def run(degree: int) -> Path:
        """Follow the path with strips of a degree."""
        problem = problem_over(mechanism, degree, load=load, drive=drive, parameter=parameter)
        try:
            return _Follower(problem, float(to), branch, steps, step, longest).run_all(branches)
        except USER_STOPS:
            none = np.empty((0, problem.scene.size))
            return Path(Ending.NOT_REACHED, "its start was not found yet", "stopped", problem.scene, np.empty(0), none, [])
        finally:
            problem.set_parameter(problem.initial)

    watching.get().most = 2 * steps  # for the time that is shown: at least two paths, of different degrees
    return _refine(run, degree)


def _check_branch(mechanism: Mechanism, branch: Branch) -> None:
    """Raise a ValueError unless a branch is a link, a point of it and a direction."""
    links = {link.name: link for link in mechanism.links}
    with suppress(KeyError, TypeError, ValueError):
        link, point, direction = branch
        vector = Vector("").read("", direction)  # raises unless it is a pair of numbers; the texts are for its message only
        if point in links[link].points and vector != (0.0, 0.0):
            return
    raise ValueError(f"branch = {branch!r}: must be (link, point of it, (x, y)); links: {', '.join(links)}")


def _refine(run: Callable[[int], Path], degree: int | None) -> Path:
    """Increase the degree, unless it is given, until critical points and the end do not change."""
    found, keeps_degree = run(degree or 12), degree is not None  # 12, chosen: of the first path; refined ones have a higher one
    if not found.scene.strips:
        found.errors.update(_errors(found, found))  # zeros: nothing depends on the degree
        return found
    while not watching.get().ended:  # by the user; then `watch` gives the path its status
        finer = run(found.scene.degree + DEGREE_STEP)
        if watching.get().ended:
            return replace(found, message="its errors are not known: strips of a higher degree were not followed to the end")
        errors = _errors(found, finer)
        answer = found if keeps_degree else finer
        worst = max((float(np.max(of_kind, initial=0.0)) for of_kind in errors.values()), default=0.0)
        # errors of parameters are compared with the largest parameter; by convention so is errors['end'], a relative error
        scale = max(np.abs(finer.parameter).max(), 1e-300)
        is_highest = finer.scene.degree > 30  # chosen: less than for one equilibrium, as a path has many
        if keeps_degree or worst <= CRITICAL_ACCURACY * scale or is_highest:
            for name, each in errors.items():
                least = answer.rounding(name)  # least errors, of the points of `answer`; the other path may have more points
                each[: len(least)] = np.maximum(each[: len(least)], least)
            answer.errors.update(errors)
            return answer
        found = finer
    return found


def _errors(a: Path, b: Path) -> dict[str, Array]:
    """Return differences of parameters at critical points by name, infinite for points of one path only, and of the 'end'."""
    out = {}
    for name in ("limits", "branchings", "flutter"):
        pairs = zip_longest(getattr(a, name), getattr(b, name), fillvalue=np.inf)
        out[name] = np.array([abs(x - y) for x, y in pairs])
    if a.ended != "reached" or b.ended != "reached":  # the paths end at different parameters
        return out
    # by convention the points of the first link with mass stand for the whole pose
    link = next(link for link in a.scene.mechanism.links if not link.body.massless)
    scenes = [(path.scene, path.q[-1]) for path in (a, b)]
    ends = np.array([[s.read(s.marker(link.name, point), q).position for point in link.points] for s, q in scenes])
    out["end"] = np.array([np.abs(ends[0] - ends[1]).max() / a.scene.length])
    return out


class _Follower:
    """Continuation of a path from the start to the parameter `to`, and of the paths that leave it at branchings.

    `rests`, `states` and `points` are the equilibria, their stability and the critical points of the path being followed.
    """

    def __init__(self, problem: Problem, to: float, branch: Branch | None, steps: int, step: float, longest: float) -> None:
        self.problem, self.to, self.branch = problem, to, branch
        self.start = problem.initial if isinstance(problem, Varied) else 0.0  # loads and drives begin at 0
        self.steps, self.step, self.longest = steps, step, longest
        if to == self.start:
            raise ValueError(f"to = {to:g}: the path begins there")
        if isinstance(problem, Varied):
            problem.mechanism_at(to)  # it raises before the path is followed to a value that no mechanism has
        self.arc = Arc(problem, self.start, to)

    def run_all(self, branches: bool) -> Path:
        """Follow the path from the start and, if `branches`, the paths that leave it to both sides."""
        first = self._run(self._find_start(), None)
        branchings = [critical for critical in first.points if branches and critical.kind == "branching"]
        left_out: list[str] = []
        for branching in branchings:
            shapes = leaving_shapes(self.problem, branching)  # at a multiple branching only those that move a point of a link
            left_out += [] if shapes else [f"{branching.rest.parameter:.6g}"]
            for shape in shapes:
                for side in (1.0, -1.0):
                    if not watching.get().ended:
                        first.branches.append(self._run(self._offset_parameter(branching), self._unit(side * shape)))
        if not left_out:
            return first
        why = "no named point moves there; let each strip that bends carry a point, as carries = { M = 0.5 }"
        message = f"paths that leave the branching at {', '.join(left_out)} were not followed: {why}"
        return replace(first, message="; ".join(filter(None, (first.message, message))))

    def _find_start(self) -> Rest:
        """Find the equilibrium under the constant loads; for a movable mechanism, under the first step of the load as well."""
        problem = self.problem
        problem.set_parameter(self.start)
        constant = Problem(problem.scene, [i for i in loads_of(problem.scene) if i not in problem.loads])
        rest, _ = find_equilibrium(constant, load=1.0)
        rest = rest._replace(parameter=self.start)
        if problem.loads and problem.spectrum(rest).neutral.any():
            # in the metric of the path the whole load has the length 1: a first step applies the fraction `step` of the load
            return settle(problem, rest._replace(parameter=self.step * self.to))
        return rest

    def _run(self, rest: Rest, leaving: Array | None) -> Path:
        """Follow the path from an equilibrium, or from a branching in the direction `leaving`."""
        self.rests, self.states, self.points = [rest], [state_at(self.problem, rest)], list[Critical]()
        try:
            ended = self._follow(leaving)
        except USER_STOPS:
            ended = "stopped"
        q, multipliers, parameter = (np.array(column) for column in zip(*self.rests, strict=True))
        self.states[-1] = state_at(self.problem, self.rests[-1])  # `_find_end` may have replaced the last equilibrium
        growth = np.array([state.damped.growth.max(initial=0.0) for state in self.states])
        unstable = np.array([int(state.is_negative.sum()) for state in self.states])  # numbers of negative eigenvalues
        status = explain_end(ended, parameter[-1], self.start, self.to, self.steps)
        return Path(
            *status, ended, self.problem.scene, parameter, q, self.points, {}, self.problem.label, multipliers, growth, unstable
        )

    def _follow(self, leaving: Array | None) -> str:
        """Follow the path step by step; return the reason of its end, see `explain_end`."""
        branch_step = min(self.step, 1e-2)  # first step behind a branching; 1e-2: chosen
        direction = self.arc.direction(self.rests[0], None) if leaving is None else leaving
        length = self.step if leaving is None else branch_step
        at_branching, last = leaving is not None, None  # last: piece of the step before, if eigenvalues are known along it
        for _ in range(self.steps):
            watching.get().step(self._fraction(self.rests[-1]))
            try:
                step = self.arc.advance(self.rests[-1], direction, length)
            except StaticsError:
                return "singular"
            after = self.arc.direction(step.new, step.direction)
            if step.arc > 10.0 * SHORTEST and self.arc.turns(step.direction, after, step.arc):
                length = 0.3 * step.arc  # repeat the step, which may have jumped; 0.3: chosen; the shortest steps count as right
                continue
            piece, found = PathPiece(step, self.states[-1], state_at(self.problem, step.new), after), list[Critical]()
            # at a branching eigenvalues are zero; they jump at a corner, where a contact closes or opens
            if not (at_branching or step.passes_corner):
                found = find_criticals(self.arc, piece, last)
            if branch := self._find_branch(found):  # go on from the branching
                number, direction = branch
                self.branch = None  # the path leaves only the first branching
                self.points += found[: number + 1]
                self.rests.append(self._offset_parameter(found[number]))
                self.states.append(state_at(self.problem, self.rests[-1]))
                at_branching, last, length = True, None, branch_step
                continue
            self.points += found
            self.rests.append(step.new)
            self.states.append(piece.after)
            if reason := self._find_end(step, len(found)):
                return reason
            last = None if step.passes_corner else piece
            direction, at_branching = after, False
            length = next_arc(step.arc, self.arc.angle(step, after), self.longest)
        return "steps"

    def _fraction(self, rest: Rest) -> float:
        return (rest.parameter - self.start) / (self.to - self.start)  # of the parameter's range

    def _offset_parameter(self, point: Critical) -> Rest:
        """Return a branching with its parameter shifted towards the end, as the tangent is singular at the branching itself."""
        # 1e-8 of the range is less than the error of the branching's parameter
        return point.rest._replace(parameter=point.rest.parameter + 1e-8 * (self.to - self.start))

    def _find_end(self, step: Step, found_count: int) -> str:
        """Return the reason if the path ends with the last step, in which so many critical points were found; else ''."""
        if self._fraction(self.rests[-1]) >= 1.0:  # replace the last equilibrium, remove critical points beyond `to`
            try:
                self.rests[-1] = self.problem.newton(self.rests[-1]._replace(parameter=self.to))
            except StaticsError:
                return "singular"
            while self.points and self._fraction(self.points[-1].rest) > 1.0:
                self.points.pop()
            return "reached"
        if not self.arc.is_on_step(step, self.rests[0]):  # it excludes a step's start, so the first step closes no path
            return ""
        # the path is back at its start; a critical point there, found again with an error up to the tolerance, is removed as well
        closing_arc = self.arc.arc_of(step, self.rests[0]) - ON_CURVE * step.arc
        while found_count and self.arc.arc_of(step, self.points[-1].rest) > closing_arc:
            self.points.pop()
            found_count -= 1
        self.rests[-1] = self.rests[0]
        return "closed"

    def _find_branch(self, found: list[Critical]) -> tuple[int, Array] | None:
        """Find the first branching whose shapes move the point of `branch`; return its index and the direction to leave it."""
        for i, critical in enumerate(found):
            if self.branch is not None and critical.kind == "branching":
                link, point, along = self.branch
                shape = shape_towards(self.problem, critical, link, point, np.array(along, dtype=float))
                if shape is not None:
                    return i, self._unit(shape)
        return None

    def _unit(self, shape: Array) -> Array:
        """Return a shape (n,) as a direction of (q, lambda, p) of unit length in the metric of the path."""
        vector = np.concatenate([shape, np.zeros(len(self.arc.metric) - len(shape))])
        return np.asarray(vector / self.arc.size(vector))
