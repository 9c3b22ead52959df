"""Paths of equilibria as a load, a drive or any number changes, with limit points, branchings, flutter, and their errors."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from ..declare import Vector
from ..geometry import Array
from ..mechanism import Mechanism
from ..process import one_thread
from ..progress import STOPS, watch, watching
from ..spectral.start import slopes
from ..validate import one_of
from .answer import CRITICAL, FIRST, HIGHEST, LONGEST, RISE, Ending, Path, check, check_way, ending
from .arc import ON_CURVE, Arc, Step, next_arc
from .critical import Critical, TangentState, criticals, state_at
from .problem import Problem, Rest, StaticsError, has_strips, loads_of, places
from .rest import find, settle
from .varied import Varied, problem_over

Branch = tuple[str, str, tuple[float, float]]
DEGREE = 12
"""First degree of strips."""
STEPS = 250
"""Most steps, by default."""
COARSE = "its errors are not known: strips of a higher degree were not followed to the end"
"""Sentence on a path whose refinement was stopped."""
OFFSET = 1e-8
"""Offset of the parameter from a branching where paths leave it, over the range."""


@watch("steps")
@one_thread()
def path(
    mechanism: Mechanism, *, to: float, load: str | list[str] | None = None, drive: str | None = None,
    parameter: str | None = None, steps: int = STEPS, step: float = FIRST,
    longest: float = LONGEST, branch: Branch | None = None, branches: bool = False,
    degree: int | None = None, timeout: float | None = None, progress: bool | None = None,
) -> Path:  # fmt: skip
    """Follow the equilibria of a mechanism as loads grow, a drive moves or any number changes.

    Loads and drives start at 0, from the stress-free pose; a mechanism that can move freely there starts at the equilibrium under
    the first step of the load. A number starts at its value. Constant loads are applied before.

    Parameters
    ----------
    mechanism : Mechanism
    to : float
        Parameter at which the path ends: factor of the load, travel of the drive, rad or m, or value of the number.
    load : str or list of str, optional
        Names of the loads that grow ('gravity', 'force.A', ...), by default all. Others are constant.
    drive : str, optional
        Name of the drive that moves ('drive').
    parameter : str, optional
        Path of any number, as in files: 'links.strip.body.section.thickness'.
    steps : int
        Most steps; a path that does not reach `to` has the status TOO_MANY_STEPS.
    step, longest : float
        First and longest arc length: root mean square of changes, in units of the longest link, rad and the range of the
        parameter. Other steps follow from the curvature of the path.
    branch : (link, point, (x, y)), optional
        Leave the path at the first branching whose shape moves this point, to the side on which it moves in this direction.
    branches : bool
        Also follow all paths that leave the branchings, to both sides.
    degree : int, optional
        Degree of the strips; by default it is increased until critical points change by less than 1e-6. A body's `elements`
        apply to the engine only.
    timeout, progress
        Limit of time [s], after which the best so far is the answer; how long it takes is shown, by default in terminals.

    Raises
    ------
    ValueError
        If an argument is invalid.
    """
    check(mechanism, degree)
    check_way(to, steps, step, longest, load=load, drive=drive, parameter=parameter)
    one_of("branches", branches, (bool,))
    if branch is not None:
        _check_branch(mechanism, branch)
    if load is not None and not load:
        raise ValueError("load = []: name at least one")

    def run(degree: int) -> Path:
        """Follow the path with strips of a degree."""
        problem = problem_over(mechanism, degree, load, drive, parameter)
        try:
            return _Follower(problem, float(to), branch, steps, step, longest).whole(branches)
        except STOPS:
            none = np.empty((0, problem.scene.size))
            return Path(Ending.NOT_REACHED, "its start was not found yet", "stopped", problem.scene, np.empty(0), none, [])
        finally:
            problem.set(problem.drawn)

    watching.get().most = 2 * steps
    return _refine(run, degree)


def _check_branch(mechanism: Mechanism, branch: Branch) -> None:
    links = {link.name: link for link in mechanism.links}
    try:
        link, point, way = branch
        known = point in links[link].points and any(Vector("").read("", way))
    except (KeyError, TypeError, ValueError):
        known = False
    if not known:
        raise ValueError(f"branch = {branch!r}: must be (link, point of it, (x, y)); links: {', '.join(links)}")


def _refine(run: Callable[[int], Path], degree: int | None) -> Path:
    """Increase the degree until critical points and the end do not change."""
    found, fixed = run(degree or DEGREE), degree is not None
    while has_strips(found.scene) and not watching.get().ended:
        finer = run(found.scene.degree + RISE)
        if watching.get().ended:
            return replace(found, message=COARSE)
        errors = _errors(found, finer)
        answer = found if fixed else finer
        worst = max((float(np.max(each, initial=0.0)) for each in errors.values()), default=0.0)
        scale = max(np.abs(finer.parameter).max(), 1e-300)
        if fixed or worst <= CRITICAL * scale or finer.scene.degree > HIGHEST - 10:
            answer.errors.update({name: np.maximum(each, answer.rounding(name, len(each))) for name, each in errors.items()})
            return answer
        found = finer
    found.errors.update(_errors(found, found))
    return found


def _errors(a: Path, b: Path) -> dict[str, Array]:
    """Return differences of the critical points of two degrees; infinite for points of one path only."""
    out = {}
    for name in ("limits", "branchings", "flutter"):
        points = [np.array(getattr(path, name)) for path in (a, b)]
        count = max(map(len, points))
        padded = [np.concatenate([x, np.full(count - len(x), np.nan)]) for x in points]
        out[name] = np.nan_to_num(np.abs(padded[0] - padded[1]), nan=np.inf)
    if a.ended != "reached" or b.ended != "reached":  # they do not end at the same parameter
        return out
    link = next(link for link in a.scene.mechanism.links if not link.body.massless)
    ends = np.array([[places(each.scene, each.q[-1], link.name, point).position for point in link.points] for each in (a, b)])
    out["end"] = np.array([np.abs(ends[0] - ends[1]).max() / a.scene.length])
    return out


class _Follower:
    """Continuation of a path, and of those that leave it."""

    def __init__(self, problem: Problem, to: float, branch: Branch | None, steps: int, step: float, longest: float) -> None:
        self.problem, self.to, self.branch = problem, to, branch
        self.begun = problem.drawn if isinstance(problem, Varied) else 0.0
        self.steps, self.step, self.longest = steps, step, longest
        if to == self.begun:
            raise ValueError(f"to = {to:g}: the path begins there")
        self.arc = Arc(problem, self.begun, to)

    def whole(self, branches: bool) -> Path:
        """Follow the path from the start, and the paths that leave it."""
        first = self.run(self._start(), None)
        if branches:
            ways = ((each, way) for each in first.points if each.kind == "branching" for way in self._ways(each))
            for point, shape in ways:
                if not watching.get().ended:
                    first.branches.append(self.run(self._offset_load(point), self._unit(shape)))
        return first

    def _start(self) -> Rest:
        """Find the equilibrium at the start under the other loads; of a free mechanism, that under the first step."""
        problem = self.problem
        problem.set(self.begun)
        others = Problem(problem.scene, [i for i in loads_of(problem.scene) if i not in problem.loads])
        rest = find(others, 1.0)[0]._replace(parameter=self.begun)
        if problem.loads and problem.spectrum(rest).neutral.any():
            return settle(problem, rest._replace(parameter=self.step * self.to))
        return rest

    def run(self, rest: Rest, direction: Array | None) -> Path:
        """Follow the path from an equilibrium, or from a branching in a direction."""
        rests, states, points = [rest], [state_at(self.problem, rest)], list[Critical]()
        try:
            ended = self._follow(rests, states, points, direction)
        except STOPS:
            ended = "stopped"
        return self._path(rests, states, points, ended)

    def _follow(self, rests: list[Rest], states: list[TangentState], points: list[Critical], direction: Array | None) -> str:
        """Append equilibria, their stability and critical points to those of the start; return the reason of the end."""
        rest = rests[0]
        arc, left = (self.step, False) if direction is None else (min(self.step, 1e-2), True)
        direction = self.arc.direction(rest, None) if direction is None else direction
        last = None
        for _ in range(self.steps):
            turned = False
            try:
                watching.get().step((rest.parameter - self.begun) / (self.to - self.begun))
                done = self.arc.advance(rest, direction, arc)
            except StaticsError:
                try:
                    done, turned = self.arc.corner(rest, direction), True
                except StaticsError:
                    return "singular"
            after = self.arc.direction(done.new, done.direction)
            if self.arc.may_have_jumped(done, after):
                arc = 0.3 * done.arc
                continue
            state = state_at(self.problem, done.new)
            found = [] if left or turned else criticals(self.arc, done, states[-1], state, after, last)
            if way := self._leaves(found):
                points += found[: way[0] + 1]
                rest, direction, left, last, self.branch = self._offset_load(found[way[0]]), way[1], True, None, None
                arc = min(self.step, 1e-2)
                rests.append(rest)
                states.append(state_at(self.problem, rest))
                continue
            points += found
            last = None if turned else (done, states[-1])
            rest, direction, arc, left = done.new, after, next_arc(done.arc, self.arc.angle(done, after), self.longest), False
            rests.append(rest)
            states.append(state)
            if why := self._over(done, rests, points, len(found)):
                return why
        return "steps"

    def _offset_load(self, point: Critical) -> Rest:
        """Return the state of a branching at a slightly higher load, at which the tangent is no longer singular."""
        return point.rest._replace(parameter=point.rest.parameter + OFFSET * (self.to - self.begun))

    def _over(self, last: Step, rests: list[Rest], points: list[Critical], new: int) -> str:
        """Return the reason of the end, '' if none, and correct the last equilibrium; `new` points are from the last step."""
        way = (rests[-1].parameter - self.begun) / (self.to - self.begun)
        if way >= 1.0:
            try:
                rests[-1] = self.problem.newton(rests[-1]._replace(parameter=self.to))
            except StaticsError:
                return "singular"
            while points and (points[-1].rest.parameter - self.to) / (self.to - self.begun) > 0.0:
                points.pop()
            return "reached"
        if not self.arc.passes(last, rests[0]):
            return ""
        home = self.arc.reach(last, rests[0]) - ON_CURVE * last.arc
        while new and self.arc.reach(last, points[-1].rest) > home:  # the start may be a branching itself
            points.pop()
            new -= 1
        rests[-1] = rests[0]
        return "closed"

    def _path(self, rests: list[Rest], states: list[TangentState], points: list[Critical], ended: str) -> Path:
        q, multipliers, parameter = (np.array(x) for x in zip(*rests, strict=True))
        states[-1] = state_at(self.problem, rests[-1])
        how = ending(ended, parameter[-1], self.begun, self.to, self.steps)
        growth, unstable = np.array([x.growth for x in states]), np.array([x.negative for x in states])
        return Path(
            *how, ended, self.problem.scene, parameter, q, points, {}, multipliers, growth, unstable
        )  # fmt: skip

    def _leaves(self, found: list[Critical]) -> tuple[int, Array] | None:
        """Find the first branching whose shapes move the point of `branch`, and the direction there."""
        if self.branch is None:
            return None
        for i, each in enumerate(found):
            if each.kind == "branching":
                link, point, along = self.branch
                shape = self._towards(each, link, point, np.array(along, dtype=float))
                if shape is not None:
                    return i, self._unit(shape)
        return None

    def _towards(self, point: Critical, link: str, name: str, along: Array) -> Array | None:
        """Return the critical shape that moves a point of a link most in a direction; None if none moves it."""
        self.problem.set(point.rest.parameter)
        scene = self.problem.scene
        shapes = point.shapes / np.abs(point.shapes / self.problem.units[:, None]).max(axis=0)
        moves = along @ slopes(scene, scene.marker(link, name), point.rest.q)[:2] @ shapes / np.linalg.norm(along) / scene.length
        return shapes @ moves if np.abs(moves).max() > 1e-4 else None

    def _ways(self, point: Critical) -> Iterator[Array]:
        """Yield the directions in which paths leave a branching; for a multiple one those that move a point most."""
        ways: list[Array] = list(point.shapes.T) if point.multiple == 1 else []
        for link in self.problem.scene.mechanism.links if not ways else ():
            for name in () if link.body.massless else link.points:
                for along in np.eye(2):
                    shape = self._towards(point, link.name, name, along)
                    if shape is None:
                        continue
                    shape = shape / np.linalg.norm(shape / self.problem.units)
                    if all(abs(float(shape / self.problem.units**2 @ other)) < 0.999 for other in ways):
                        ways.append(shape)
        yield from (side * shape for shape in ways for side in (1.0, -1.0))

    def _unit(self, shape: Array) -> Array:
        """Return the unit direction along a shape of the coordinates."""
        out = np.concatenate([shape, np.zeros(len(self.arc.metric) - len(shape))])
        return np.asarray(out / self.arc.size(out))
