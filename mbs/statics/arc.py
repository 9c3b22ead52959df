"""Pseudo-arclength continuation of equilibria (Riks 1979, doi 10.1016/0020-7683(79)90081-7; Keller 1977), and roots."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import KroghInterpolator
from scipy.optimize import brentq

from ..geometry import Array
from .problem import Problem, Rest, StaticsError

SHORTEST = 1e-7
"""Arc length below which continuation ends."""
NEAR = 1e-9
"""Arc length, in the metric of the path, that counts as zero."""
TARGET_TURN = 0.15
"""Angle between the tangents of successive steps [rad] for which the length of the next step is chosen."""
CORNER = 0.5
"""Largest angle between the tangents of successive steps [rad]; with a larger one the step has jumped to a crossing path."""
STENCIL = 1e-2
"""Half width, over the step, of the stencil for a crossing."""
ALIKE = 1e-3
"""Largest difference of the roots by 4 and by 6 points, over the spacing of the stencil; above it `root` is used."""
ON_CURVE = 1e-2
"""Largest distance of an equilibrium from the curve of a step, over the step, at which it is on the path."""
KNOWN_POINTS = 3
"""Number of known equilibria through which a step is interpolated."""
BEYOND = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Arc lengths at which a contact that opens or closes is looked for, and lengths of the first step behind it."""
HALVINGS = 30
"""Number of halvings that locate this contact: a billionth of the arc."""
NONE: Mapping[float, Rest] = MappingProxyType({})


class Step(NamedTuple):
    """Step from an equilibrium along a direction, (n + r + 1,), to the one on the plane an arc away."""

    rest: Rest
    direction: Array
    new: Rest
    arc: float


class Arc:
    """Metric, planes and directions of a path."""

    def __init__(self, problem: Problem, begun: float, to: float) -> None:
        self.problem, self.span = problem, to - begun
        n, r = problem.scene.size, len(problem.scene.row_names)
        self.metric = np.concatenate([1.0 / problem.extents**2 / n, np.zeros(r), [1.0 / self.span**2]])

    def size(self, vector: Array) -> float:
        """Return the length of a change in the metric of the path."""
        return float(np.sqrt(self.metric @ vector**2))

    def direction(self, rest: Rest, before: Array | None) -> Array:
        """Return the unit tangent of the path, oriented as the one before or towards the end."""
        normal = self.metric * before if before is not None else np.zeros(len(self.metric))
        if before is None:
            normal[-1] = 1.0 / self.span
        out = self.problem.tangent(rest, normal, abs(self.span))
        return np.asarray(out / self.size(out))

    def on_plane(self, rest: Rest, direction: Array, step: float, guess: Array | None = None) -> Rest:
        """Find the equilibrium on the plane at a distance along a direction; the default guess lies on the direction."""
        problem, n = self.problem, len(rest.q)
        normal = self.metric * direction
        value = float(normal @ problem.vector(rest)) + step
        moved = problem.vector(rest) + step * direction
        begun = moved if guess is None else guess
        begin = Rest(begun[:n], begun[n:-1], float(begun[-1]))
        new = problem.newton(begin, (normal, value, abs(self.span)), near=guess is None, origin=rest)
        predicted, correction = step * direction, problem.vector(new) - moved
        for part in (slice(None), slice(n)):  # also coordinates alone, as a large load would hide their change
            expected, found = (float(np.sqrt(self.metric[part] @ x[part] ** 2)) for x in (predicted, correction))
            if found > 0.5 * expected + NEAR:
                raise StaticsError("too far from where the path was expected")
        return new

    def advance(self, rest: Rest, direction: Array, arc: float) -> Step:
        """Find the next equilibrium, at the arc or, by halving it, nearer; raise a StaticsError below `SHORTEST`."""
        while arc > SHORTEST:
            try:
                return Step(rest, direction, self.on_plane(rest, direction, arc), arc)
            except StaticsError:
                arc *= 0.5
        raise StaticsError(f"the path cannot be followed beyond {rest.parameter:.6g}")

    def corner(self, rest: Rest, direction: Array) -> Step:
        """Step around a corner just ahead, where a contact closes or opens, along the tangent behind it."""
        start, n = self.problem.vector(rest), len(rest.q)

        def ahead(arc: float) -> tuple[Rest, Array, bool]:
            """Return the state at an arc along the direction, its tangent, and if that has turned."""
            moved = start + arc * direction
            state = Rest(moved[:n], moved[n:-1], float(moved[-1]))
            after = self.direction(state, direction)
            return state, after, float(self.metric * direction @ after) < np.cos(CORNER)

        for over in BEYOND:
            if not ahead(over)[2]:
                continue
            near, far = 0.0, over
            for _ in range(HALVINGS):
                middle = 0.5 * (near + far)
                near, far = (near, middle) if ahead(middle)[2] else (middle, far)
            state, after, _ = ahead(far)
            for arc in BEYOND:
                try:
                    return Step(rest, after, self.on_plane(state, after, arc), arc)
                except StaticsError:
                    continue
        raise StaticsError("there is no corner")

    def along(self, step: Step, arc: float, known: Mapping[float, Rest] = NONE) -> Rest:
        """Find the equilibrium at an arc within a step, from an interpolant of its ends and of the `known`."""
        if arc in (0.0, step.arc):
            return step.rest if arc == 0.0 else step.new
        return self.on_plane(step.rest, step.direction, arc, self._curve(step, arc, known))

    def passes(self, step: Step, rest: Rest) -> bool:
        """Return True if an equilibrium lies on the curve of a step, after its start."""
        arc, near = self.reach(step, rest), ON_CURVE * step.arc
        return near < arc <= step.arc and self.size(self.problem.vector(rest) - self._curve(step, arc)) < near

    def reach(self, step: Step, rest: Rest) -> float:
        """Return the coordinate of an equilibrium along the direction of a step."""
        return float(self.metric * step.direction @ (self.problem.vector(rest) - self.problem.vector(step.rest)))

    def _curve(self, step: Step, arc: float, known: Mapping[float, Rest] = NONE) -> Array:
        """Interpolate a step at an arc: start and direction by Hermite, and the nearest known equilibria."""
        rests = {step.arc: step.new, **known}
        near = sorted(rests.keys() - {0.0}, key=lambda each: abs(each - arc))[:KNOWN_POINTS]
        values = [self.problem.vector(step.rest), step.arc * step.direction, *(self.problem.vector(rests[x]) for x in near)]
        return np.asarray(KroghInterpolator(np.array([0.0, 0.0, *near]) / step.arc, values)(arc / step.arc))

    def root(self, step: Step, function: Callable[[Rest], float]) -> Rest | None:
        """Find the root of a function of the equilibria of a step by Brent's method; None without a change of sign."""
        known: dict[float, Rest] = {}
        value: dict[float, float] = {}

        def at(arc: float) -> float:
            """Evaluate the function at an arc."""
            rest = self.along(step, arc, known)
            known[arc], value[arc] = rest, function(rest)
            return value[arc]

        try:
            if at(0.0) * at(step.arc) > 0.0:
                return None
            found = brentq(at, 0.0, step.arc, xtol=1e-13 * step.arc + 1e-300, rtol=1e-14, maxiter=60, disp=False)
            if found not in known:
                at(found)
            return known[found]  # a function may jump there
        except StaticsError:  # interpolate linearly between the nearest known equilibria on both sides
            sides = [[arc for arc in known if value[arc] * value[0.0] * sign > 0.0] for sign in (1.0, -1.0)]
            if not all(sides):
                return None
            a, b = max(sides[0]), min(sides[1])
            ends, n = (self.problem.vector(known[a]), self.problem.vector(known[b])), len(step.rest.q)
            between = ends[0] + value[a] / (value[a] - value[b]) * (ends[1] - ends[0])
            return Rest(between[:n], between[n:-1], float(between[-1]))

    def crossing(self, step: Step, function: Callable[[Rest], float]) -> Rest | None:
        """Find the root of a function that is zero where paths cross, by interpolation, as Newton's matrix is singular there.

        Polynomials of two degrees interpolate equilibria on both sides of a rough root; if their roots differ, `root` is used.
        """
        if function(step.rest) * function(step.new) > 0.0:
            return None
        parts = np.array([-1.0, 1.0, -2.0, 2.0, -3.0, 3.0])
        try:
            rough = self._rough(step, function, STENCIL * step.arc)
            rests = [self.along(step, rough + 2.0 * STENCIL * step.arc * part) for part in parts]
        except StaticsError:
            return self.root(step, function)
        found = [function(rest) for rest in rests]
        few, root = (_root_of(parts[:n], found[:n]) for n in (4, 6))
        if not abs(root - few) < ALIKE:
            return self.root(step, function)
        weights = [np.prod([(root - b) / (a - b) for b in parts if b != a]) for a in parts]
        return Rest(*(sum(w * x for w, x in zip(weights, each, strict=True)) for each in zip(*rests, strict=True)))

    def _rough(self, step: Step, function: Callable[[Rest], float], near: float) -> float:
        """Find a root to within `near`; if Newton's method fails, as at the crossing itself, evaluate next to it."""

        def value(arc: float) -> float:
            """Evaluate the function at an arc, or next to it."""
            for part in (0.0, 0.3, -0.3):
                try:
                    return function(self.along(step, min(max(arc + part * near, 0.0), step.arc)))
                except StaticsError as error:
                    last = error
            raise last

        return float(brentq(value, 0.0, step.arc, xtol=near))

    def may_have_jumped(self, step: Step, after: Array) -> bool:
        """Return True if the tangent turns so much in a step that it may be on another path, and the step can be shorter."""
        n = len(step.rest.q)
        before, now = (np.sqrt(self.metric[:n]) * direction[:n] for direction in (step.direction, after))
        size = float(np.linalg.norm(now))
        turns = float(before @ now) < np.cos(CORNER) * float(np.linalg.norm(before)) * size
        return step.arc > 10.0 * SHORTEST and step.arc * size > NEAR and turns

    def angle(self, step: Step, after: Array) -> float:
        """Return the angle between the direction of a step and another one [rad]."""
        return float(np.arccos(np.clip(self.metric * step.direction @ after, -1.0, 1.0)))


def next_arc(arc: float, turned: float, longest: float) -> float:
    """Return the length of the step after one that turned by an angle [rad], 0.3 to 1.6 times as long."""
    return min(longest, arc * float(np.clip(TARGET_TURN / max(turned, 1e-300), 0.3, 1.6)))


def _root_of(x: Array, y: list[float]) -> float:
    """Return the real root of least magnitude of the polynomial through points."""
    roots = Polynomial.fit(x, y, len(x) - 1).roots()
    return float(min(roots[np.abs(roots.imag) < 1e-9].real, key=abs, default=np.inf))
