"""Steps along a path of equilibria by arc length, and the roots of functions along a step.

References
----------
E. Riks, An incremental approach to the solution of snapping and buckling problems, Int. J. Solids Structures 15 (1979) 529-551,
doi 10.1016/0020-7683(79)90081-7.
H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, in: P. Rabinowitz (ed.), Applications of
Bifurcation Theory (1977) 359-384.
"""

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
"""Arc below which a step is given up."""
NEAR = 1e-9
"""Arc, in the measure of the path, that is not told apart from none."""
BEND = 0.15
"""Angle by which the path may turn in a step, rad: the next one is as long as that asks for."""
CORNER = 0.5
"""Angle, rad, by which places may turn in a step: where paths cross, one that turns more has reached over to another."""
ASIDE = (1e-2, 1e-3, 5e-2)
"""Shares of a step within which a crossing is sought at first; the last where paths part before they cross."""
ALIKE = 1e-3
"""Difference of two polynomials' roots, over twice that."""
SAME = 1e-2
"""Distance of an equilibrium from a step's curve, over the step, within which it lies on the path."""
CLOUD = 3
"""Known equilibria of a step that others are sought between."""
NONE: Mapping[float, Rest] = MappingProxyType({})
SHARP = 1e-7
"""The same over the step, from which no nearer equilibria are looked at: of the better of the two it is an upper bound."""


class Step(NamedTuple):
    """From an equilibrium along a direction (n + r + 1,) to the next one, an arc away on the plane across it."""

    rest: Rest
    direction: Array
    new: Rest
    arc: float


class Arc:
    """The measure of a path, its planes and directions."""

    def __init__(self, problem: Problem, begun: float, to: float) -> None:
        self.problem, self.span = problem, to - begun
        n, r = problem.scene.size, len(problem.scene.row_names)
        self.metric = np.concatenate([1.0 / problem.room**2 / n, np.zeros(r), [1.0 / self.span**2]])

    def size(self, vector: Array) -> float:
        """Length of a change."""
        return float(np.sqrt(self.metric @ vector**2))

    def direction(self, rest: Rest, before: Array | None) -> Array:
        """Unit tangent of the path, on from the one before, or towards the end."""
        normal = self.metric * before if before is not None else np.zeros(len(self.metric))
        if before is None:
            normal[-1] = 1.0 / self.span
        out = self.problem.tangent(rest, normal, abs(self.span))
        return np.asarray(out / self.size(out))

    def on_plane(self, rest: Rest, direction: Array, step: float, guess: Array | None = None) -> Rest:
        """The equilibrium at a distance along a direction, sought from a guess, by default on that direction."""
        problem, n = self.problem, len(rest.q)
        normal = self.metric * direction
        value = float(normal @ problem.vector(rest)) + step
        moved = problem.vector(rest) + step * direction
        begun = moved if guess is None else guess
        begin = Rest(begun[:n], begun[n:-1], float(begun[-1]))
        new = problem.newton(begin, (normal, value, abs(self.span)), near=guess is None, origin=rest)
        way, apart = step * direction, problem.vector(new) - moved
        for part in (slice(None), slice(n)):  # places on their own too: beside a large load their way is short
            expected, off = (float(np.sqrt(self.metric[part] @ x[part] ** 2)) for x in (way, apart))
            if off > 0.5 * expected + NEAR:
                raise StaticsError("too far from where the path was expected")
        return new

    def advance(self, rest: Rest, direction: Array, arc: float) -> Step:
        """The next equilibrium, at the arc or as near as it must be.

        Raises
        ------
        StaticsError
            If it would be nearer than SHORTEST.
        """
        while arc > SHORTEST:
            try:
                return Step(rest, direction, self.on_plane(rest, direction, arc), arc)
            except StaticsError:
                arc *= 0.5
        raise StaticsError(f"the path cannot be followed beyond {rest.parameter:.6g}")

    def along(self, step: Step, arc: float, known: Mapping[float, Rest] = NONE) -> Rest:
        """The equilibrium at an arc within a step, sought between its ends and others known by their arcs."""
        if arc in (0.0, step.arc):
            return step.rest if arc == 0.0 else step.new
        return self.on_plane(step.rest, step.direction, arc, self._curve(step, arc, known))

    def passes(self, step: Step, rest: Rest) -> bool:
        """Whether an equilibrium lies on the curve of a step: of many links others may be nearer than a step is long."""
        arc = self.reach(step, rest)
        return 0.0 < arc <= step.arc and self.size(self.problem.vector(rest) - self._curve(step, arc)) < SAME * step.arc

    def reach(self, step: Step, rest: Rest) -> float:
        """How far along a step's direction an equilibrium lies."""
        return float(self.metric * step.direction @ (self.problem.vector(rest) - self.problem.vector(step.rest)))

    def _curve(self, step: Step, arc: float, known: Mapping[float, Rest] = NONE) -> Array:
        """Where the polynomial from a step's start, in its direction, through the nearest known equilibria is at an arc."""
        rests = {step.arc: step.new, **known}
        near = sorted(rests.keys() - {0.0}, key=lambda each: abs(each - arc))[:CLOUD]
        values = [self.problem.vector(step.rest), step.arc * step.direction, *(self.problem.vector(rests[x]) for x in near)]
        return np.asarray(KroghInterpolator(np.array([0.0, 0.0, *near]) / step.arc, values)(arc / step.arc))

    def root(self, step: Step, function: Callable[[Rest], float]) -> Rest | None:
        """Where in a step a function of its equilibria is zero; None where it has one sign."""
        seen: dict[float, Rest] = {}
        value: dict[float, float] = {}

        def at(arc: float) -> float:
            rest = self.along(step, arc, seen)
            seen[arc], value[arc] = rest, function(rest)
            return value[arc]

        try:
            if at(0.0) * at(step.arc) > 0.0:
                return None
            found = brentq(at, 0.0, step.arc, xtol=1e-13 * step.arc + 1e-300, rtol=1e-14, maxiter=60, disp=False)
            if found not in seen:
                at(found)
            return seen[found]  # a function may jump there
        except StaticsError:  # where it has been sought so far, a straight line between the nearest on both sides
            sides = [[arc for arc in seen if value[arc] * value[0.0] * sign > 0.0] for sign in (1.0, -1.0)]
            if not all(sides):
                return None
            a, b = max(sides[0]), min(sides[1])
            one, other = value[a], value[b]
            ends, n = (self.problem.vector(seen[a]), self.problem.vector(seen[b])), len(step.rest.q)
            between = ends[0] + one / (one - other) * (ends[1] - ends[0])
            return Rest(between[:n], between[n:-1], float(between[-1]))

    def crossing(self, step: Step, function: Callable[[Rest], float]) -> Rest | None:
        """The same of what is zero where paths cross: there Newton's matrix is singular, so that the root is that of polynomials.

        They go through equilibria on both sides of a rough root; where two of them do not agree, it is sought there after all.
        """
        if function(step.rest) * function(step.new) > 0.0:
            return None
        parts = np.array([-1.0, 1.0, -2.0, 2.0, -3.0, 3.0])
        best: tuple[float, float, list[Rest]] = (np.inf, 0.0, [])
        for aside in ASIDE:
            try:
                rough = self._rough(step, function, aside * step.arc)
                rests = [self.along(step, rough + 2.0 * aside * step.arc * part) for part in parts]
            except StaticsError:
                continue
            found = [function(rest) for rest in rests]
            few, all_ = (_root_of(parts[:n], found[:n]) for n in (4, 6))
            if abs(all_ - few) < ALIKE:
                best = min(best, (2.0 * aside * abs(all_ - few), all_, rests), key=lambda each: each[0])
            if best[0] < SHARP or (best[2] and aside < ASIDE[0]):
                break
        _, root, rests = best
        if not rests:
            return self.root(step, function)
        weights = [np.prod([(root - b) / (a - b) for b in parts if b != a]) for a in parts]
        return Rest(*(sum(w * x for w, x in zip(weights, each, strict=True)) for each in zip(*rests, strict=True)))

    def _rough(self, step: Step, function: Callable[[Rest], float], near: float) -> float:
        """A root to within about `near`: at the crossing itself, on which a secant may fall, none is found, but beside it."""

        def value(arc: float) -> float:
            for part in (0.0, 0.3, -0.3):
                try:
                    return function(self.along(step, min(max(arc + part * near, 0.0), step.arc)))
                except StaticsError as error:
                    last = error
            raise last

        return float(brentq(value, 0.0, step.arc, xtol=near))

    def reaches_over(self, step: Step, after: Array) -> bool:
        """Whether a step that could be shorter turns so much that it may have ended on another path."""
        n = len(step.rest.q)
        one, other = (np.sqrt(self.metric[:n]) * way[:n] for way in (step.direction, after))
        moves = float(np.linalg.norm(other))
        turns = float(one @ other) < np.cos(CORNER) * float(np.linalg.norm(one)) * moves
        return step.arc > 10.0 * SHORTEST and step.arc * moves > NEAR and turns

    def next_arc(self, step: Step, after: Array, longest: float) -> float:
        """Length of the next step, by how far this one turned."""
        turned = float(np.arccos(np.clip(self.metric * step.direction @ after, -1.0, 1.0)))
        return next_arc(step.arc, turned, longest)


def next_arc(arc: float, turned: float, longest: float) -> float:
    """Length of the next step after one that turned so much, rad: at most some times shorter or longer."""
    return min(longest, arc * float(np.clip(BEND / max(turned, 1e-300), 0.3, 1.6)))


def _root_of(x: Array, y: list[float]) -> float:
    """The least root of the polynomial through points."""
    roots = Polynomial.fit(x, y, len(x) - 1).roots()
    return float(min(roots[np.abs(roots.imag) < 1e-9].real, key=abs, default=np.inf))
