"""Continuation of periodic motions over a parameter by arc length, with critical points.

Unknown are a state x that returns and the parameter p: P(x, p) = x. The monodromy matrix dP/dx is that of `shooting`. Roots along
the arc are found where its eigenvalues pass 1, -1 or the unit circle.

References
----------
R. Seydel, Practical Bifurcation and Stability Analysis (2010), ch. 4 and 7, doi 10.1007/978-1-4419-1740-9.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..geometry import Array
from ..progress import after_step
from ..spectral.run import State
from .algebra import solve
from .answer import CRITICAL, RISE
from .arc import CORNER, next_arc
from .cycles import Periodic, Turn, branching, compare_multipliers, doubling, motion_of, torus
from .problem import Problem, Rest, StaticsError, has_strips, prolong
from .shooting import BUDGET, CLOSED, ITERATIONS, Found, Shooting, SpentError, values_of
from .varied import Paced

SHORTEST = 1e-5
"""Arc below which continuation is given up."""
SMALL = 1e-3
"""Least size of a motion in the metric, in units of coordinates."""
LEAP = 0.5
"""Largest change of a multiplier in a step over its distance from 1; a longer step may miss a narrow resonance."""
NARROW = 1e-3
"""Arc, or share of the parameter's range, below which a multiplier may change more, as at a fold."""
SPENT = 20 * BUDGET
"""Most integration steps of all runs of a curve."""
FINER = 2
"""Most refinements of a critical point."""


class Orbit(NamedTuple):
    """Periodic motion on the curve, basis of its free coordinates, [dP/dx - 1, dP/dp], and unit tangent, (2 f + 1,)."""

    found: Found
    parameter: float
    basis: Array
    matrix: Array
    ahead: Array
    size: float


@dataclass
class Curve:
    """Periodic motions over the parameter of a problem, to a last value; the degree of strips is `fixed` or raised for errors."""

    shooting: Shooting
    problem: Problem
    to: float
    fixed: bool

    @property
    def begun(self) -> float:
        """Parameter at which the curve begins."""
        return self.problem.drawn

    def at(self, parameter: float) -> None:
        """Set the parameter, and the period with it."""
        self.problem.set(parameter)
        self.shooting.scene = self.problem.scene
        if isinstance(self.problem, Paced):
            self.shooting.period = 1.0 / parameter

    def returning(self, state: State, parameter: float, matrix: Array, normal: Array, basis: Array) -> tuple[State, float]:
        """Find the periodic motion on the plane across a direction by Broyden's method, from [dP/dx - 1, dP/dp] nearby."""
        shooting, span, best = self.shooting, self.to - self.begun, (np.inf, state, parameter)
        whole = np.vstack([matrix, normal])
        step = before = np.zeros(len(whole))
        for k in range(ITERATIONS):
            self.at(parameter)
            state = shooting.project(state)
            miss = np.append(shooting.change(state, basis, shooting.run(state, adaptive=k == 0)), 0.0)
            left = float(np.abs(miss).max(initial=0.0))
            if k:
                whole = whole + np.outer(miss - before - whole @ step, step) / max(float(step @ step), 1e-300)
            if not left < (2.0 if best[0] > CLOSED else 0.5) * best[0]:
                break
            best, before = (left, state, parameter), miss
            step = solve(whole, -miss)
            state, parameter = shooting.displace(state, basis, step[:-1]), parameter + float(step[-1]) * span
        if best[0] > CLOSED:
            raise StaticsError(f"no periodic motion was found near {parameter:.6g}")
        return best[1:]

    def orbit(self, state: State, parameter: float, before: tuple[Array, Array, float] | None = None) -> Orbit:
        """Compute multipliers and tangent of a motion; oriented as the `heading` before, or towards the end."""
        self.at(parameter)
        shooting = self.shooting
        basis = shooting.basis(state)
        out, monodromy = shooting.monodromy(state, basis)
        found = Found(state, shooting.period, 0.0, out, monodromy)
        n = 2 * basis.shape[1]
        matrix = self.matrix(found, parameter, basis)
        size = max(SMALL, float((np.ptp(out.q, axis=0) / shooting.units).max(initial=0.0)))
        metric = np.append(np.full(n, size**-2.0), 1.0)
        normal = np.append(np.zeros(n), 1.0)
        if before is not None:
            back = basis.T / shooting.units**2
            normal = metric * np.concatenate([back @ before[0], back @ before[1] / shooting.pace, before[2:]])
        ahead = solve(np.vstack([matrix, normal]), np.append(np.zeros(n), 1.0))
        return Orbit(found, parameter, basis, matrix, ahead / np.sqrt(metric @ ahead**2), size)

    def matrix(self, found: Found, parameter: float, basis: Array) -> Array:
        """Compute [dP/dx - 1, dP/dp], p over its range."""
        shooting, span = self.shooting, self.to - self.begun
        ends = []
        for side in (1.0, -1.0):
            self.at(parameter + side * shooting.width * span)
            state = shooting.project(found.state)
            ends.append(shooting.change(state, basis, shooting.run(state)))
        self.at(parameter)
        slope = (ends[0] - ends[1]) / (2 * shooting.width)
        return np.column_stack([found.matrix - np.eye(len(slope)), slope])

    def onto(self, orbit: Orbit, arc: float) -> Orbit:
        """Find the motion at an arc along the direction of another one."""
        self.at(orbit.parameter)
        shooting, f = self.shooting, orbit.basis.shape[1]
        way = self.heading(orbit)
        state = shooting.displace(orbit.found.state, orbit.basis, arc * orbit.ahead[:-1])
        metric = np.append(np.full(2 * f, orbit.size**-2.0), 1.0)
        guess = orbit.parameter + arc * float(orbit.ahead[-1]) * (self.to - self.begun)
        found = self.returning(state, guess, orbit.matrix, metric * orbit.ahead, orbit.basis)
        return self.orbit(*found, way)

    def heading(self, orbit: Orbit) -> tuple[Array, Array, float]:
        """Return the tangent: of coordinates and rates, (n,) each, and of the parameter over its range."""
        self.at(orbit.parameter)
        q, v = (orbit.basis @ part for part in np.split(orbit.ahead[:-1], 2))
        return q, self.shooting.pace * v, float(orbit.ahead[-1])

    def angle_between(self, orbit: Orbit, new: Orbit) -> float:
        """Compute the angle between the directions of two motions [rad]."""
        ends = []
        for each in (orbit, new):
            q, v, p = self.heading(each)
            ends.append(np.concatenate([q / self.shooting.units, v / self.shooting.units / self.shooting.pace, [new.size * p]]))
        one, other = ends
        return float(np.arccos(np.clip(one @ other / np.linalg.norm(one) / np.linalg.norm(other), -1.0, 1.0)))

    @cached_property
    def fine(self) -> Curve:
        """Return the curve with finer steps and a higher degree."""
        one = self.shooting.scene
        problem = self.problem.raised(0 if self.fixed or not has_strips(one) else RISE)
        return replace(self, problem=problem, shooting=replace(self.shooting.finer(one.degree), scene=problem.scene))

    def finer(self, orbit: Orbit) -> tuple[Curve, State, tuple[Array, Array, float]]:
        """Refine steps and degree at the parameter of a motion; return curve, state and heading."""
        self.at(orbit.parameter)
        curve, one = self.fine, self.shooting.scene
        curve.at(orbit.parameter)
        curve.shooting.left = BUDGET
        state = orbit.found.state
        q, v, *way = (prolong(one, curve.shooting.scene, each) for each in (state.q, state.v, *self.heading(orbit)[:2]))
        return curve, state._replace(q=q, v=v), (way[0], way[1], float(orbit.ahead[-1]))

    def motion(self, orbit: Orbit) -> Periodic:
        """Return the motion with errors, from finer steps, narrower differences and a higher degree."""
        values, shooting, found, error = values_of(orbit.found.matrix), self.shooting, orbit.found, np.inf
        errors = np.full(len(values), np.inf)
        with suppress(StaticsError):
            curve, start, _ = self.finer(orbit)
            finer = curve.shooting.newton(curve.shooting.project(start), found.matrix)
            if finer.open <= CLOSED:
                shooting, found = curve.shooting, finer
                values, errors, error = compare_multipliers(shooting, start, finer, values)
        self.at(orbit.parameter)
        return motion_of(shooting, found, values, errors, error)

    def criticals(self, orbit: Orbit, new: Orbit, arc: float) -> Iterator[tuple[float, Turn, float]]:
        """Find critical points in a step: the arc, the point, its error."""
        turns = KINDS["fold"](orbit) * KINDS["fold"](new) < 0.0
        for kind, function in KINDS.items():
            one, other = function(orbit), function(new)
            none = (kind == "branching" and turns) or (kind == "torus" and max(one, other) < CRITICAL)
            if one * other < 0.0 and not none:
                at, found, error = self.crossing(orbit, new, arc, function)
                curve, here = self, orbit
                for _ in range(FINER if error < np.inf else 0):
                    try:
                        finer, state, way = curve.finer(here)
                        there = finer.orbit(finer.shooting.search(state).state, here.parameter, way)
                        again = finer.near(there, function, at, arc)
                    except StaticsError:
                        break
                    error, found, curve, here = abs(again.parameter - found.parameter), again, finer, there
                    if error <= CRITICAL * abs(found.parameter):
                        break
                error = min(error, abs(new.parameter - orbit.parameter))
                yield at, Turn(kind, Rest(found.found.state.q, np.empty(0), found.parameter), curve.motion(found)), error

    def crossing(self, orbit: Orbit, new: Orbit, arc: float, function: Callable[[Orbit], float]) -> tuple[float, Orbit, float]:
        """Find the root of a function in a step: arc, motion, error; the nearer end with an infinite error if none is found."""
        seen = {0.0: orbit, arc: new}

        def value(at: float) -> float:
            """Evaluate the function at an arc."""
            if at not in seen:
                seen[at] = self.onto(orbit, at)
            return function(seen[at])

        try:
            at = float(brentq(value, 0.0, arc, xtol=1e-8 * arc))
            value(at)
        except StaticsError:
            at = min(seen, key=lambda each: abs(function(seen[each])))
            return at, seen[at], np.inf
        return at, seen[at], abs(new.parameter - orbit.parameter)

    def near(self, orbit: Orbit, function: Callable[[Orbit], float], at: float, arc: float) -> Orbit:
        """Find the root of a function near an arc by Newton's method with a fixed slope, as close differences are rounding."""
        found, aside = self.onto(orbit, at), self.onto(orbit, at - 0.05 * arc)
        slope = (function(found) - function(aside)) / (0.05 * arc)
        for _ in range(3):
            at -= float(np.clip(function(found) / slope, -arc, arc))
            found = self.onto(orbit, at)
        return found

    def leaps(self, orbit: Orbit, new: Orbit) -> bool:
        """Check whether a multiplier changed so much that a resonance may have been missed."""
        one, other = (values_of(each.found.matrix) for each in (orbit, new))
        near = np.abs(other - 1.0)
        moved = np.abs(other[:, None] - one[None]).min(axis=1, initial=np.inf)
        far = abs(new.parameter - orbit.parameter) > NARROW * abs(self.to - self.begun)
        return far and bool((moved > LEAP * near).any())

    def follow(self, state: State, steps: int, step: float, longest: float) -> tuple[list[Orbit], list[tuple[Turn, float]], str]:
        """Follow the curve to its end; return motions, critical points with errors, and the reason of the end."""
        orbits, found, ended, arc = [self.orbit(state, self.begun)], list[tuple[Turn, float]](), "steps", step
        self.shooting.left = SPENT
        while len(orbits) <= steps and ended == "steps":
            after_step.get()()
            try:
                new = self.onto(orbits[-1], arc)
                turned = self.angle_between(orbits[-1], new)
                if arc > NARROW and (turned > CORNER or self.leaps(orbits[-1], new)):
                    raise StaticsError("a shorter step is needed")
                found += [each[1:] for each in sorted(self.criticals(orbits[-1], new, arc), key=lambda each: each[0])]
            except SpentError:
                ended = "spent"
                break
            except StaticsError:
                arc, ended = 0.4 * arc, "steps" if arc > SHORTEST else "singular"
                continue
            way = (new.parameter - self.begun) / (self.to - self.begun)
            if not 0.0 < way < 1.0:
                ended, end = ("reached", self.to) if way >= 1.0 else ("back", self.begun)
                found = [each for each in found if 0.0 < (each[0].rest.parameter - self.begun) / (self.to - self.begun) < 1.0]
                self.at(end)
                with suppress(StaticsError):  # else the curve ends beside it, with the motion found last
                    new = self.orbit(self.shooting.search(new.found.state).state, end)
            orbits.append(new)
            arc = next_arc(arc, turned, longest)
        return orbits, found, ended


KINDS: dict[str, Callable[[Orbit], float]] = {
    "fold": lambda orbit: float(orbit.ahead[-1]),
    "doubling": lambda orbit: doubling(values_of(orbit.found.matrix)),
    "branching": lambda orbit: branching(values_of(orbit.found.matrix)),
    "torus": lambda orbit: torus(values_of(orbit.found.matrix)),
}
"""Functions of a motion that are zero at critical points."""
