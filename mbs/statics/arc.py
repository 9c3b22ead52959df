"""Pseudo-arclength continuation of equilibria (Riks 1979, doi 10.1016/0020-7683(79)90081-7; Keller 1977), and roots in steps.

A state is the vector (q, lambda, p) of coordinates, multipliers and parameter, (n + r + 1,). The metric of the path is the mean
square of the coordinates over their extents (`Problem.extents`) plus the square of p over its range. A direction is a unit vector
in this metric. A step leads from an equilibrium to one on a plane normal to its direction. The arc is the distance of the plane
from the start.
"""

from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import KroghInterpolator
from scipy.optimize import brentq

from ..geometry import Array
from .problem import Plane, Problem, Rest, StaticsError

SHORTEST = 1e-7
"""Arc length below which continuation ends: chosen."""
NEAR = 1e-9
"""Change in the metric of the path that counts as zero: chosen."""
CORNER = 0.5
"""Largest angle between the tangents of successive steps [rad]; a larger one is a corner or a jump to a crossing path; chosen."""
ON_CURVE = 1e-2
"""Largest distance of an equilibrium from the curve of a step, relative to the step, at which it is on the path."""


class Step(NamedTuple):
    """Step along a direction from the equilibrium `rest`, or a corner near it, to `new` on the plane at a distance `arc`."""

    rest: Rest
    direction: Array
    new: Rest
    arc: float
    passes_corner: bool = False  # `direction` and `arc` begin at the corner, an arc of at most 1e-2 behind `rest`


class Arc:
    """Pseudo-arclength continuation of a problem over its parameter, from `start` to `to`."""

    def __init__(self, problem: Problem, start: float, to: float) -> None:
        self.problem, self.span = problem, to - start
        n, r = problem.scene.size, len(problem.scene.row_names)
        self.metric = np.concatenate([1.0 / problem.extents**2 / n, np.zeros(r), [1.0 / self.span**2]])

    def size(self, vector: Array) -> float:
        """Return the length of a change in the metric of the path."""
        return float(np.sqrt(self.metric @ vector**2))

    def direction(self, rest: Rest, before: Array | None) -> Array:
        """Return the unit tangent of the path at an equilibrium, oriented as the direction `before`, or towards the end."""
        towards_end = np.append(np.zeros(len(self.metric) - 1), 1.0 / self.span)
        normal = towards_end if before is None else self.metric * before
        tangent = self.problem.tangent(rest, normal, unit=abs(self.span))  # `unit` scales p in the linear system
        return np.asarray(tangent / self.size(tangent))

    def find_on_plane(self, rest: Rest, direction: Array, step: float, guess: Array | None = None) -> Rest:
        """Find the equilibrium on the plane at a distance along a direction by Newton's method from a guess.

        The default guess is the prediction, rest + step direction, from which Newton steps must decrease. Raise a StaticsError if
        the equilibrium is farther from the prediction than half the step.
        """
        problem, n = self.problem, len(rest.q)
        normal = self.metric * direction
        value = float(normal @ problem.vector(rest)) + step
        predicted = problem.vector(rest) + step * direction
        first, plane = self._rest(predicted if guess is None else guess), Plane(normal, value, unit=abs(self.span))
        new = problem.newton(first, plane, must_decrease=guess is None, origin=rest)
        weight = np.sqrt(self.metric)
        change, correction = weight * step * direction, weight * (problem.vector(new) - predicted)
        # of the whole state, and of coordinates alone, as a large change of p may hide theirs
        is_far = any(np.linalg.norm(correction[:m]) > 0.5 * np.linalg.norm(change[:m]) + NEAR for m in (None, n))
        if is_far:
            raise StaticsError("too far from where the path was expected")
        return new

    def advance(self, rest: Rest, direction: Array, arc: float) -> Step:
        """Find the next equilibrium at an arc, which is halved until that succeeds, or behind a corner; else raise an error."""
        while arc > SHORTEST:
            try:
                return Step(rest, direction, self.find_on_plane(rest, direction, arc), arc)
            except StaticsError:
                arc *= 0.5
        short_arcs = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)  # chosen: farthest corners in the search, and trial steps behind a corner
        for far in short_arcs:  # at a corner a contact closes or opens, so that the tangent turns at once
            corner = self._find_corner(rest, direction, far)
            if corner is None:
                continue
            after = self.direction(corner, direction)
            for trial in short_arcs:
                with suppress(StaticsError):
                    return Step(rest, after, self.find_on_plane(corner, after, trial), trial, passes_corner=True)
        raise StaticsError(f"the path cannot be followed beyond {rest.parameter:.6g}")

    def _find_corner(self, rest: Rest, direction: Array, far: float) -> Rest | None:
        """Locate a corner by bisection on the direction, up to an arc; return the state just behind it, None without a corner."""
        start = self.problem.vector(rest)  # states on the straight line are nearly equilibria, as arcs are short

        def is_behind(arc: float) -> bool:
            """Return True if the tangent has turned, or that of the coordinates alone, as a large change of p may hide theirs."""
            after = self.direction(self._rest(start + arc * direction), direction)
            return float(self.metric * direction @ after) < np.cos(CORNER) or self.turns(direction, after, far)

        if not is_behind(far):
            return None
        near = 0.0
        for _ in range(30):  # to a billionth of the arc
            middle = 0.5 * (near + far)
            near, far = (near, middle) if is_behind(middle) else (middle, far)
        return self._rest(start + far * direction)  # from which Newton's method finds the path behind the corner

    def _rest(self, vector: Array) -> Rest:
        """Split a vector (q, lambda, p) into a state."""
        n = self.problem.scene.size
        return Rest(vector[:n], vector[n:-1], float(vector[-1]))

    def equilibrium_at(self, step: Step, arc: float, known: Mapping[float, Rest] | None = None) -> Rest:
        """Find the equilibrium at an arc in a step, from a guess interpolated between its ends and equilibria `known` by arc."""
        if arc in (0.0, step.arc):
            return step.rest if arc == 0.0 else step.new
        return self.find_on_plane(step.rest, step.direction, arc, self._curve(step, arc, known))

    def is_on_step(self, step: Step, rest: Rest) -> bool:
        """Return True if an equilibrium lies on the curve of a step, after its start."""
        arc, tolerance = self.arc_of(step, rest), ON_CURVE * step.arc
        return tolerance < arc <= step.arc and self.size(self.problem.vector(rest) - self._curve(step, arc)) < tolerance

    def arc_of(self, step: Step, rest: Rest) -> float:
        """Return the arc at which an equilibrium lies in a step."""
        return float(self.metric * step.direction @ (self.problem.vector(rest) - self.problem.vector(step.rest)))

    def _curve(self, step: Step, arc: float, known: Mapping[float, Rest] | None = None) -> Array:
        """Interpolate a step at an arc, by the Hermite polynomial of start, direction and the three nearest known equilibria."""
        rests = {step.arc: step.new, **(known or {})}
        nearest = sorted(rests.keys() - {0.0}, key=lambda other: abs(other - arc))[:3]
        values = [self.problem.vector(step.rest), step.arc * step.direction, *(self.problem.vector(rests[x]) for x in nearest)]
        return np.asarray(KroghInterpolator(np.array([0.0, 0.0, *nearest]) / step.arc, values)(arc / step.arc))

    def find_root(self, step: Step, function: Callable[[Rest], float]) -> Rest | None:
        """Find the root of a function of the equilibria of a step by Brent's method; None without a change of sign."""
        known: dict[float, Rest] = {}
        values: dict[float, float] = {}

        def evaluate(arc: float) -> float:
            """Evaluate the function, and keep its value and the equilibrium."""
            rest = self.equilibrium_at(step, arc, known)
            known[arc], values[arc] = rest, function(rest)
            return values[arc]

        try:
            if evaluate(0.0) * evaluate(step.arc) > 0.0:
                return None
            root = brentq(evaluate, 0.0, step.arc, xtol=1e-13 * step.arc + 1e-300, rtol=1e-14, maxiter=60, disp=False)
            if root not in known:
                evaluate(root)
            return known[root]  # even if the function is not zero there: it may jump, with a change of sign
        except StaticsError:
            # known arcs by the sign of the function, which is assumed to change once in the step
            before = [arc for arc in known if values[arc] * values[0.0] > 0.0]
            behind = [arc for arc in known if values[arc] * values[0.0] < 0.0]
            if not (before and behind):
                return None
            a, b = max(before), min(behind)  # interpolate linearly between the nearest equilibria on both sides
            first, second = self.problem.vector(known[a]), self.problem.vector(known[b])
            return self._rest(first + values[a] / (values[a] - values[b]) * (second - first))

    def find_crossing(self, step: Step, function: Callable[[Rest], float]) -> Rest | None:
        """Find the root of a function that is zero where paths cross, by interpolation, as Newton's matrix is singular there."""
        if function(step.rest) * function(step.new) > 0.0:
            return None
        stencil = np.array([-1.0, 1.0, -2.0, 2.0, -3.0, 3.0])
        tolerance = 1e-2 * step.arc  # of the rough root; half the spacing of the points about it
        try:
            rough = self._find_rough_root(step, function, tolerance)
            rests = [self.equilibrium_at(step, rough + 2.0 * tolerance * point) for point in stencil]
        except StaticsError:
            return self.find_root(step, function)
        values = [function(rest) for rest in rests]
        root_4, root = (_root_of(stencil[:n], values[:n]) for n in (4, 6))
        if not abs(root - root_4) < 1e-3:  # relative to the spacing of the points; chosen
            return self.find_root(step, function)
        return self._rest(KroghInterpolator(stencil, [self.problem.vector(rest) for rest in rests])(root))

    def _find_rough_root(self, step: Step, function: Callable[[Rest], float], tolerance: float) -> float:
        """Find a root to a tolerance by Brent's method; where Newton's method fails, evaluate the function next to the arc."""

        def evaluate(arc: float) -> float:
            """Evaluate the function at an arc, or beside it."""
            for offset in (0.0, 0.3, -0.3):  # over the tolerance; 0.3: chosen
                try:
                    return function(self.equilibrium_at(step, min(max(arc + offset * tolerance, 0.0), step.arc)))
                except StaticsError as error:
                    last = error
            raise last  # of the last offset

        return float(brentq(evaluate, 0.0, step.arc, xtol=tolerance))

    def turns(self, before: Array, after: Array, arc: float) -> bool:
        """Return True if the coordinates' tangent turns beyond `CORNER`, and they change by more than `NEAR` over an arc."""
        n = len(self.problem.units)
        first, last = (np.sqrt(self.metric[:n]) * direction[:n] for direction in (before, after))
        size = float(np.linalg.norm(last))
        return arc * size > NEAR and float(first @ last) < np.cos(CORNER) * float(np.linalg.norm(first)) * size

    def angle(self, step: Step, after: Array) -> float:
        """Return the angle between the direction of a step and another direction [rad]."""
        return float(np.arccos(np.clip(self.metric * step.direction @ after, -1.0, 1.0)))


def next_arc(arc: float, angle: float, longest: float) -> float:
    """Return the arc in which the tangent turns by 0.15 rad, from its `angle` in this one; 0.3 to 1.6 times as long."""
    return min(longest, arc * float(np.clip(0.15 / max(angle, 1e-300), 0.3, 1.6)))  # the three numbers are chosen


def _root_of(x: Array, y: list[float]) -> float:
    """Return the real root of least magnitude of the polynomial through points (x, y)."""
    roots = Polynomial.fit(x, y, len(x) - 1).roots()
    return float(min(roots[np.abs(roots.imag) < 1e-9].real, key=abs, default=np.inf))
