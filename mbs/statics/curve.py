"""Continuation of periodic motions by arc length, with critical points (Seydel 2010, doi 10.1007/978-1-4419-1740-9).

The unknowns are a state x and the parameter p, with P(x, p) = x for the map P of a period. The monodromy matrix dP/dx is that of
`shooting`. Critical points are roots along the arc at which its eigenvalues pass 1 or -1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import brentq

from ..geometry import Array
from ..progress import STOPS, watching
from ..spectral.run import RunState
from .algebra import solve
from .answer import RISE
from .arc import CORNER, next_arc
from .cycles import Periodic, compare_multipliers, motion_of
from .problem import ENDS, Problem, Rest, StaticsError, has_strips, prolong
from .shooting import BUDGET, CLOSED, ITERATIONS, Found, Shooting, SpentError, distances_to, values_of
from .varied import Paced

SHORTEST = 1e-5
"""Arc length below which continuation ends."""
SMALL = 1e-3
"""Least size of a motion in the metric, in units of coordinates."""
MOST_CHANGE = 0.5
"""Largest change of a multiplier in a step over its distance from 1; a longer step may miss a narrow resonance."""
NARROW = 1e-3
"""Arc length, or share of the parameter's range, below which a multiplier may change more, as at a fold."""
CURVE_BUDGET = 20 * BUDGET
"""Most integration steps of all runs of a curve."""


class Orbit(NamedTuple):
    """Periodic motion on the curve, basis of its free coordinates, [dP/dx - 1, dP/dp], scaled tangent, (2 n + 1,), and size."""

    found: Found
    parameter: float
    basis: Array
    matrix: Array
    way: Array
    size: float

    @property
    def values(self) -> Array:
        """Floquet multipliers."""
        return values_of(self.found.matrix)


@dataclass(frozen=True)
class CriticalMotion:
    """Critical point of a response: a 'fold', 'doubling' (a multiplier passes -1) or 'branching' (1, and the curve goes on).

    `rest` has the coordinates at the start of a period, and the parameter.
    """

    kind: str
    rest: Rest
    motion: Periodic
    multiple: int = 1


@dataclass
class ResponseCurve:
    """Periodic motions over the parameter of a problem, up to `to`; the degree of strips is `fixed` or increased for errors."""

    shooting: Shooting
    problem: Problem
    to: float
    fixed: bool

    def __post_init__(self) -> None:
        self.begun = self.problem.drawn
        self.span = self.to - self.begun

    def at(self, parameter: float) -> None:
        """Set the parameter, and the period with it."""
        self.problem.set(parameter)
        self.shooting.scene = self.problem.scene
        if isinstance(self.problem, Paced):
            self.shooting.period = 1.0 / parameter

    def _spread(self, basis: Array) -> Array:
        """Return the matrix from free coordinates, rates and the parameter to all scaled ones, (2 n + 1, 2 f + 1)."""
        part = basis / self.shooting.units[:, None]
        return np.asarray(block_diag(part, part, 1.0))

    def orbit(self, state: RunState, parameter: float, before: Array | None = None) -> Orbit:
        """Compute multipliers and tangent of a motion; oriented as the one `before`, or towards the end."""
        self.at(parameter)
        shooting, ends = self.shooting, []
        basis = shooting.basis(state)
        out, monodromy = shooting.monodromy(state, basis)
        for side in (1.0, -1.0):
            self.at(parameter + side * shooting.width * self.span)
            moved = shooting.project(state)
            ends.append(shooting.change(moved, basis, shooting.run(moved)))
        self.at(parameter)
        slope = (ends[0] - ends[1]) / (2 * shooting.width)
        matrix = np.column_stack([monodromy - np.eye(len(slope)), slope])
        size = max(SMALL, float((np.ptp(out.q, axis=0) / shooting.units).max(initial=0.0)))
        metric, last, spread = np.append(np.full(len(slope), size**-2.0), 1.0), np.eye(len(slope) + 1)[-1], self._spread(basis)
        ahead = solve(np.vstack([matrix, last if before is None else metric * (before @ spread)]), last)
        way = spread @ ahead / np.sqrt(metric @ ahead**2)
        return Orbit(Found(state, shooting.period, 0.0, out, monodromy), parameter, basis, matrix, way, size)

    def onto(self, orbit: Orbit, arc: float) -> Orbit:
        """Find the motion on the plane at an arc length along the tangent of another one, by Broyden's method."""
        self.at(orbit.parameter)
        shooting, basis, ahead = self.shooting, orbit.basis, orbit.way @ self._spread(orbit.basis)
        state = shooting.displace(orbit.found.state, basis, arc * ahead[:-1])
        parameter = orbit.parameter + arc * float(ahead[-1]) * self.span
        whole = np.vstack([orbit.matrix, np.append(ahead[:-1] / orbit.size**2, ahead[-1])])
        best, step, before = (np.inf, state, parameter), np.zeros(len(whole)), np.zeros(len(whole))
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
            state, parameter = shooting.displace(state, basis, step[:-1]), parameter + float(step[-1]) * self.span
        if best[0] > CLOSED:
            raise StaticsError(f"no periodic motion was found near {parameter:.6g}")
        return self.orbit(*best[1:], orbit.way)

    @cached_property
    def fine(self) -> ResponseCurve:
        """Return the curve with finer steps and a higher degree."""
        one = self.shooting.scene
        problem = self.problem.with_degree(0 if self.fixed or not has_strips(one) else RISE)
        return replace(self, problem=problem, shooting=replace(self.shooting.finer(one.degree), scene=problem.scene))

    def finer(self, orbit: Orbit) -> tuple[ResponseCurve, RunState, Array]:
        """Refine steps and degree at the parameter of a motion; return curve, state and tangent."""
        self.at(orbit.parameter)
        curve, one = self.fine, self.shooting.scene
        curve.at(orbit.parameter)
        curve.shooting.left = BUDGET
        state = orbit.found.state
        parts = (state.q, state.v, *np.split(orbit.way[:-1], 2))
        q, v, *way = (prolong(one, curve.shooting.scene, each) for each in parts)
        return curve, state._replace(q=q, v=v), np.concatenate([*way, orbit.way[-1:]])

    def motion(self, orbit: Orbit) -> Periodic:
        """Return the motion with errors, from finer steps, narrower differences and a higher degree."""
        values, shooting, found, error = orbit.values, self.shooting, orbit.found, np.inf
        errors = np.full(len(values), np.inf)
        with suppress(*ENDS):
            curve, start, _ = self.finer(orbit)
            finer = curve.shooting.newton(curve.shooting.project(start), found.matrix)
            if finer.open <= CLOSED:
                shooting, found = curve.shooting, finer
                values, errors, error = compare_multipliers(shooting, start, finer, values)
        self.at(orbit.parameter)
        return motion_of(shooting, found, values, errors, error)

    def criticals(self, orbit: Orbit, new: Orbit, arc: float) -> Iterator[tuple[float, CriticalMotion, float]]:
        """Find critical points in a step: the arc, the point, its error."""
        turns = KINDS["fold"](orbit) * KINDS["fold"](new) < 0.0
        for kind, function in KINDS.items():
            one, other = function(orbit), function(new)
            if one * other < 0.0 and not (kind == "branching" and turns):
                at, found, error = self.crossing(orbit, new, arc, function)
                curve = self
                with suppress(StaticsError):  # else the error is the step
                    finer, state, way = self.finer(orbit)
                    there = finer.orbit(finer.shooting.search(state).state, orbit.parameter, way)
                    again = finer.near(there, function, at, arc)
                    error, found, curve = min(error, abs(again.parameter - found.parameter)), again, finer
                yield (
                    at,
                    CriticalMotion(kind, Rest(found.found.state.q, np.empty(0), found.parameter), curve.motion(found)),
                    error,
                )

    def crossing(self, orbit: Orbit, new: Orbit, arc: float, function: Callable[[Orbit], float]) -> tuple[float, Orbit, float]:
        """Find the root of a function in a step: arc, motion, error; the nearer end if none is found. The error is the step."""
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
        return at, seen[at], abs(new.parameter - orbit.parameter)

    def near(self, orbit: Orbit, function: Callable[[Orbit], float], at: float, arc: float) -> Orbit:
        """Find the root of a function near an arc by Newton's method with a fixed slope, as close differences are rounding."""
        found, aside = self.onto(orbit, at), self.onto(orbit, at - 0.05 * arc)
        slope = (function(found) - function(aside)) / (0.05 * arc)
        for _ in range(3):
            at -= float(np.clip(function(found) / slope, -arc, arc))
            found = self.onto(orbit, at)
        return found

    def turns(self, orbit: Orbit, new: Orbit) -> float:
        """Compute the angle between the tangents at two motions [rad], the parameter weighted by the size of the second."""
        a, b = (np.append(each.way[:-1], new.size * each.way[-1]) for each in (orbit, new))
        return float(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1.0, 1.0)))

    def leaps(self, orbit: Orbit, new: Orbit) -> bool:
        """Return True if a multiplier changed so much that a resonance may have been missed."""
        wide = abs(new.parameter - orbit.parameter) > NARROW * abs(self.span)
        return wide and bool((distances_to(new.values, orbit.values) > MOST_CHANGE * np.abs(new.values - 1.0)).any())

    def follow(
        self, state: RunState, steps: int, step: float, longest: float
    ) -> tuple[list[Orbit], list[tuple[CriticalMotion, float]], str]:
        """Follow the curve to its end; return motions, critical points with errors, and the reason of the end."""
        orbits, found, ended, arc = [self.orbit(state, self.begun)], list[tuple[CriticalMotion, float]](), "steps", step
        self.shooting.left = CURVE_BUDGET
        while len(orbits) <= steps and ended == "steps":
            try:
                watching.get().share = max(watching.get().share, (orbits[-1].parameter - self.begun) / self.span)
                new = self.onto(orbits[-1], arc)
                turned = self.turns(orbits[-1], new)
                if arc > NARROW and (turned > CORNER or self.leaps(orbits[-1], new)):
                    raise StaticsError("a shorter step is needed")
                found += [each[1:] for each in sorted(self.criticals(orbits[-1], new, arc), key=lambda each: each[0])]
            except (SpentError, *STOPS) as error:
                ended = "spent" if isinstance(error, SpentError) else "stopped"
                break
            except StaticsError:
                arc, ended = 0.4 * arc, "steps" if arc > SHORTEST else "singular"
                continue
            way = (new.parameter - self.begun) / self.span
            if not 0.0 < way < 1.0:
                ended, end = ("reached", self.to) if way >= 1.0 else ("back", self.begun)
                found = [each for each in found if 0.0 < (each[0].rest.parameter - self.begun) / self.span < 1.0]
                self.at(end)
                with suppress(StaticsError):  # else the curve ends near the parameter, with the motion found last
                    new = self.orbit(self.shooting.search(new.found.state).state, end)
            orbits.append(new)
            arc = next_arc(arc, turned, longest)
        return orbits, found, ended


KINDS: dict[str, Callable[[Orbit], float]] = {
    "fold": lambda orbit: float(orbit.way[-1]),
    "doubling": lambda orbit: float(np.prod(orbit.values + 1.0).real),
    "branching": lambda orbit: float(np.prod(orbit.values - 1.0).real),
}
"""Functions of a motion that are zero at critical points."""
