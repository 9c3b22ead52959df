"""Continuation of periodic motions by arc length, with critical points (Seydel 2010, doi 10.1007/978-1-4419-1740-9).

The unknowns are a state x of n coordinates and n rates, and the parameter p: P(x, p) = x for the map P over a period T.
Constraints leave f free coordinates. P(x, p) = x then has 2 f equations for 2 f + 1 changes: of free coordinates, of their rates
and of p. A tangent (2 n + 1,) has all coordinates over units, all rates over (units 2 pi/T), and p over its range `span`. The
length of a tangent, and so an arc, has another scale: coordinates and rates are also divided by the size of the motion.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import brentq

from ..geometry import Array
from ..progress import USER_STOPS, watching
from ..spectral.run import RunState
from .algebra import solve
from .answer import DEGREE_STEP
from .arc import CORNER, next_arc
from .cycles import Periodic, compare_multipliers, motion_of
from .problem import SEARCH_STOPS, Problem, Rest, StaticsError, prolong
from .shooting import BUDGET, CLOSED, ITERATIONS, Found, Shooting, SpentError, distances_to, find_multipliers
from .varied import Paced


class Orbit(NamedTuple):
    """Periodic motion on the curve, at a parameter.

    `basis` (n, f) spans the free coordinates, `jacobian` (2 f, 2 f + 1) is [dP/dx - 1, dP/dp]. `tangent` (2 n + 1,) is the scaled
    tangent of the curve. `size` is the largest range of a coordinate in a period, in the coordinate's unit.
    """

    found: Found
    parameter: float
    basis: Array
    jacobian: Array
    tangent: Array
    size: float

    @property
    def multipliers(self) -> Array:
        """Floquet multipliers."""
        return find_multipliers(self.found.monodromy)


@dataclass(frozen=True)
class CriticalMotion:
    """Critical motion: a 'fold' of the curve, or a 'doubling' or 'branching', where a multiplier passes -1 or 1.

    `rest` has coordinates at the start of a period, and the parameter with its `error`. `multiple` multipliers pass, always 1.
    """

    kind: str
    rest: Rest
    motion: Periodic
    error: float
    multiple: int = 1


@dataclass
class ResponseCurve:
    """Periodic motions over a parameter, up to `to`; refinement raises the degree of the strips unless it `keeps_degree`."""

    shooting: Shooting
    problem: Problem
    to: float
    keeps_degree: bool

    def __post_init__(self) -> None:
        self.start = self.problem.initial
        self.span = self.to - self.start  # range of the parameter, negative if `to` is below the start

    def set_parameter(self, parameter: float) -> None:
        """Set the parameter, and the period with it if the parameter is the frequency [Hz]."""
        self.problem.set_parameter(parameter)
        self.shooting.scene = self.problem.scene
        if isinstance(self.problem, Paced):
            self.shooting.period = 1.0 / parameter

    def _scaled_basis(self, basis: Array) -> Array:
        """Return the columns (2 n + 1, 2 f + 1), orthonormal in scaled unknowns, of free coordinates, their rates and p."""
        to_scaled = basis / self.shooting.units[:, None]
        return np.asarray(block_diag(to_scaled, to_scaled, 1.0))

    def compute_orbit(self, state: RunState, parameter: float, before: Array | None = None) -> Orbit:
        """Compute multipliers and tangent of a periodic motion; orient the tangent as that `before`, or towards the end."""
        self.set_parameter(parameter)
        shooting, changes = self.shooting, []
        basis, out = shooting.basis(state), shooting.run(state)
        monodromy = shooting.monodromy(state, basis, out)
        for side in (1.0, -1.0):  # the half width `width` of differences by x is also that by p over its range
            self.set_parameter(parameter + side * shooting.width * self.span)
            projected = shooting.project(state)
            changes.append(shooting.change(projected, basis, shooting.run(projected)))
        self.set_parameter(parameter)
        slope = (changes[0] - changes[1]) / (2 * shooting.width)  # by the parameter over its range
        jacobian = np.column_stack([monodromy - np.eye(len(slope)), slope])
        size = max(1e-3, shooting.largest_range(out))  # 1e-3: at rest the metric would be singular
        metric = np.append(np.full(len(slope), size**-2.0), 1.0)
        scaled = self._scaled_basis(basis)
        towards_end = np.append(np.zeros(len(slope)), 1.0)  # increases p over its range; the motion must not lie at a fold
        # `before @ scaled`: components of the earlier tangent in the basis; the normal gives the product with it in the metric
        normal = towards_end if before is None else metric * (before @ scaled)
        # jacobian @ direction = 0, normal @ direction = 1
        direction = solve(np.vstack([jacobian, normal]), np.append(np.zeros(len(slope)), 1.0))
        tangent = scaled @ direction / np.sqrt(metric @ direction**2)
        found = Found(state, shooting.period, residual=0.0, out=out, monodromy=monodromy)  # of an orbit no residual is read
        return Orbit(found, parameter, basis, jacobian, tangent, size)

    def find_on_plane(self, orbit: Orbit, arc: float) -> Orbit:
        """Find the motion on the plane normal to the tangent of another motion, at an arc along it, by Broyden's method."""
        self.set_parameter(orbit.parameter)
        shooting, basis, tangent = self.shooting, orbit.basis, orbit.tangent @ self._scaled_basis(orbit.basis)
        state = shooting.displace(orbit.found.state, basis, arc * tangent[:-1])
        parameter = orbit.parameter + arc * float(tangent[-1]) * self.span
        matrix = np.vstack([orbit.jacobian, np.append(tangent[:-1] / orbit.size**2, tangent[-1])])
        accepted, accepted_residual = (state, parameter), np.inf
        step = previous = np.zeros(len(matrix))
        for k in range(ITERATIONS):
            self.set_parameter(parameter)
            state = shooting.project(state)
            out = shooting.run(state, adaptive=k == 0)  # the first run chooses the steps, so that the others differ smoothly
            residual = np.append(shooting.change(state, basis, out), 0.0)  # 0: steps and, nearly, projections stay on the plane
            largest = float(np.abs(residual).max(initial=0.0))
            if k:  # Broyden's update: the matrix times the step is then the change of the residual
                matrix = matrix + np.outer(residual - previous - matrix @ step, step) / max(float(step @ step), 1e-300)
            # a closed motion is improved as long as steps halve the residual; before, the residual may double; both chosen
            factor = 0.5 if accepted_residual <= CLOSED else 2.0
            if not largest < factor * accepted_residual:
                break
            accepted, accepted_residual, previous = (state, parameter), largest, residual
            step = solve(matrix, -residual)
            state, parameter = shooting.displace(state, basis, step[:-1]), parameter + float(step[-1]) * self.span
        if accepted_residual > CLOSED:
            raise StaticsError(f"no periodic motion was found near {parameter:.6g}")
        return self.compute_orbit(*accepted, orbit.tangent)

    @cached_property
    def finer(self) -> "ResponseCurve":
        """Curve with finer steps, narrower differences, a higher degree unless `keeps_degree`; `refine` sets its parameter."""
        scene = self.shooting.scene
        increment = 0 if self.keeps_degree or not scene.strips else DEGREE_STEP
        problem = self.problem.with_degree(increment)
        shooting = replace(self.shooting.finer(scene.degree), scene=problem.scene)  # the scene of the problem has the new degree
        return replace(self, problem=problem, shooting=shooting)

    def refine(self, orbit: Orbit) -> tuple["ResponseCurve", RunState, Array]:
        """Return the finer curve at the parameter of a motion, and the motion's state and tangent prolonged to it."""
        self.set_parameter(orbit.parameter)
        curve, scene = self.finer, self.shooting.scene
        curve.set_parameter(orbit.parameter)
        curve.shooting.steps_left = BUDGET
        state = orbit.found.state
        parts = (state.q, state.v, *np.split(orbit.tangent[:-1], 2))
        q, v, *tangent = (prolong(scene, curve.shooting.scene, part) for part in parts)
        return curve, state._replace(q=q, v=v), np.concatenate([*tangent, orbit.tangent[-1:]])

    def make_motion(self, orbit: Orbit) -> Periodic:
        """Return the result of a motion, with errors from the finer curve; infinite ones if no motion is found there."""
        values, shooting, found, error = orbit.multipliers, self.shooting, orbit.found, np.inf
        errors = np.full(len(values), np.inf)
        with suppress(*SEARCH_STOPS):
            curve, start, _ = self.refine(orbit)
            refined = curve.shooting.newton(curve.shooting.project(start), found.monodromy)  # its best state, periodic or not
            if refined.residual <= CLOSED:
                shooting, found = curve.shooting, refined
                values, errors, error = compare_multipliers(shooting, start, refined, values)
        self.set_parameter(orbit.parameter)
        return motion_of(shooting, found, values, errors, error)

    def find_criticals(self, orbit: Orbit, new: Orbit, arc: float) -> Iterator[tuple[float, CriticalMotion]]:
        """Yield the critical points in a step between two motions, each with its arc."""
        has_fold = KINDS["fold"](orbit) * KINDS["fold"](new) < 0.0
        for kind, function in KINDS.items():
            if function(orbit) * function(new) < 0.0 and not (kind == "branching" and has_fold):  # 1 is passed at a fold, too
                root, critical = self.find_root(orbit, new, arc, function)
                # if the finer curve has no root, these stay: this curve, and the change of p in the step as the error
                curve, error = self, abs(new.parameter - orbit.parameter)
                with suppress(StaticsError):
                    finer, state, tangent = self.refine(orbit)  # at the parameter of the orbit
                    periodic = finer.shooting.search(state).state  # by Newton's method, from later periods if it fails
                    start = finer.compute_orbit(periodic, orbit.parameter, tangent)
                    refined = finer.refine_root(start, function, root, arc)
                    error = min(error, abs(refined.parameter - critical.parameter))
                    critical, curve = refined, finer
                # multipliers of a `Rest` are Lagrange's, of which none are kept here
                rest = Rest(critical.found.state.q, multipliers=np.empty(0), parameter=critical.parameter)
                yield root, CriticalMotion(kind, rest, curve.make_motion(critical), error)

    def find_root(self, orbit: Orbit, new: Orbit, arc: float, function: Callable[[Orbit], float]) -> tuple[float, Orbit]:
        """Find the root of a function in a step by Brent's method; return its arc and motion, or the nearest if that fails."""
        known = {0.0: orbit, arc: new}

        def evaluate(trial: float) -> float:
            """Evaluate the function at an arc, and keep the motion."""
            if trial not in known:
                known[trial] = self.find_on_plane(orbit, trial)
            return function(known[trial])

        try:
            root = float(brentq(evaluate, 0.0, arc, xtol=1e-8 * arc))
            evaluate(root)
        except StaticsError:
            root = min(known, key=lambda other: abs(function(known[other])))
        return root, known[root]

    def refine_root(self, orbit: Orbit, function: Callable[[Orbit], float], root: float, arc: float) -> Orbit:
        """Find the root of a function near the arc `root`, in a step of length `arc`, by three steps of Newton's method."""
        found, other = self.find_on_plane(orbit, root), self.find_on_plane(orbit, root - 0.05 * arc)
        slope = (function(found) - function(other)) / (0.05 * arc)  # once; smaller differences are rounding
        for _ in range(3):
            root -= float(np.clip(function(found) / slope, -arc, arc))
            found = self.find_on_plane(orbit, root)
        return found

    def angle(self, orbit: Orbit, new: Orbit) -> float:
        """Compute the angle between the tangents at two motions [rad], in the metric of the second."""
        # the metric divides coordinates by the size; all are multiplied by it here, which does not change angles
        a, b = (np.append(motion.tangent[:-1], new.size * motion.tangent[-1]) for motion in (orbit, new))
        return float(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1.0, 1.0)))

    def follow(self, state: RunState, steps: int, step: float, longest: float) -> tuple[list[Orbit], list[CriticalMotion], str]:
        """Follow the curve; return motions, critical points, and the reason of the end, see `explain_end`."""
        orbits, criticals, arc = [self.compute_orbit(state, self.start)], list[CriticalMotion](), step
        self.shooting.steps_left = 20 * BUDGET  # time steps of all runs: as many as 20 searches for a single motion may take
        while len(orbits) <= steps:
            last = orbits[-1]
            try:
                # share of the call that is done, from which the time left is shown; a curve may turn back
                watching.get().share = max(watching.get().share, self._fraction(last.parameter))
                new = self._advance(last, arc)
                found = sorted(self.find_criticals(last, new, arc), key=lambda critical: critical[0])
                criticals += [critical for _, critical in found]
            except SpentError:
                return orbits, criticals, "spent"
            except USER_STOPS:
                return orbits, criticals, "stopped"
            except StaticsError:
                if arc <= 1e-5:  # after some ten failures
                    return orbits, criticals, "singular"
                arc *= 0.4  # chosen; a shorter step may find the motion or the critical point that this one has not found
                continue
            orbits.append(new)
            arc = next_arc(arc, self.angle(last, new), longest)
            done = self._fraction(new.parameter)
            if not 0.0 < done < 1.0:
                ended, end = ("reached", self.to) if done >= 1.0 else ("back", self.start)
                criticals = [critical for critical in criticals if 0.0 < self._fraction(critical.rest.parameter) < 1.0]
                self.set_parameter(end)
                with suppress(StaticsError):  # else the curve ends near the parameter, with the motion found last
                    orbits[-1] = self.compute_orbit(self.shooting.search(new.found.state).state, end)
                return orbits, criticals, ended
        return orbits, criticals, "steps"

    def _advance(self, last: Orbit, arc: float) -> Orbit:
        """Find the next motion at an arc; raise a StaticsError if there is none, or if the step must be shorter."""
        new = self.find_on_plane(last, arc)
        narrow = 1e-3  # arc, or change of the parameter over its range, from which a step may not turn far or miss a resonance
        is_wide = abs(new.parameter - last.parameter) > narrow * abs(self.span)
        # a forced motion x = mu x + b has the size b/|1 - mu|: if 1 - mu changes by half, a narrow resonance may lie in between
        changes = distances_to(new.multipliers, last.multipliers)
        may_miss_resonance = is_wide and (changes > 0.5 * np.abs(new.multipliers - 1.0)).any()
        if arc > narrow and (self.angle(last, new) > CORNER or may_miss_resonance):
            raise StaticsError("the curve turns too far in the step, or may have a resonance within it")
        return new

    def _fraction(self, parameter: float) -> float:
        return (parameter - self.start) / self.span  # of the parameter's range: 0 at the start, 1 at the end


KINDS: dict[str, Callable[[Orbit], float]] = {
    "fold": lambda orbit: float(orbit.tangent[-1]),
    "doubling": lambda orbit: float(np.prod(orbit.multipliers + 1.0).real),
    "branching": lambda orbit: float(np.prod(orbit.multipliers - 1.0).real),
}
"""Functions of a motion whose signs change at critical points, but not if two multipliers pass together."""
