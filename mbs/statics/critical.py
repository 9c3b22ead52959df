"""Critical points in a step along a path: limit points, branchings, simple or multiple, and onsets of flutter.

K alone decides where a path turns or branches: there an eigenvalue of K z = mu M z passes zero. A flutter begins where two of
them meet, or, with damping, where a complex exponent s passes the imaginary axis.

At a double branching two shapes are free, and paths leave in some of the directions between them. The state at a small distance
in a direction is found with one more force, across it in the plane of both shapes. Where that force is zero a path leaves: the
reduction of Liapunov and Schmidt, done numerically.

References
----------
M. Golubitsky, D. G. Schaeffer, Singularities and Groups in Bifurcation Theory I (1985), ch. VII and X,
doi 10.1007/978-1-4612-5034-0.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from ..geometry import Array
from .arc import Arc, Step
from .lowest import EPS
from .problem import ITERATIONS, Problem, Rest, StaticsError
from .spectrum import Spectrum, Tangent, spectrum, squares

FEW = 1
"""Number of eigenvalues above zero computed of a large tangent: the next ones to pass zero."""
SAME = 1e-5
"""Distance, over the step, within which critical points are one multiple point."""


class State(NamedTuple):
    """Stability of an equilibrium.

    Attributes
    ----------
    squares : Spectrum
        Of K and M alone.
    growth : float
        Largest rate of growth of the whole tangent, 1/s.
    flutters : int
        Number of oscillations that grow.
    """

    squares: Spectrum
    growth: float
    flutters: int

    @property
    def negative(self) -> int:
        """Number of eigenvalues mu that are real and below zero."""
        grows = (self.squares.growth > 0.0) & (self.squares.values.imag == 0.0)
        return int(grows.sum())


def state_at(problem: Problem, rest: Rest, count: int = FEW) -> State:
    """Compute the stability of an equilibrium, of many unknowns with `count` eigenvalues above zero."""
    problem.set(rest.parameter)
    tangent = Tangent.at(problem.scene, rest.q, rest.multipliers)
    plain = spectrum(tangent.without_damping(), problem.shift, count)
    problem.shift = plain.shift
    whole = plain if tangent.conservative else spectrum(tangent)
    swings = (whole.growth > 0.0) & (np.abs(whole.values.imag) > whole.rounding)
    return State(plain, float(whole.growth.max(initial=0.0)), int(swings.sum()))


@dataclass(frozen=True)
class Critical:
    """Critical point of a path.

    Attributes
    ----------
    kind : str
        'limit', 'branching' or 'flutter'.
    rest : Rest
    multiple : int
        Number of eigenvalues that pass zero there.
    shapes : array, shape (n, multiple)
        Critical eigenvectors of a limit or a branching.
    rounding : float
        Rounding error of its parameter.
    """

    kind: str
    rest: Rest
    multiple: int
    shapes: Array
    rounding: float = 0.0


def criticals(arc: Arc, step: Step, before: State, after: State, turned: Array) -> list[Critical]:
    """Find the critical points within a step that ends in the direction `turned`, in their order."""
    found = list(_limits(arc, step, turned))
    found += _branchings(arc, step, before, after, found)
    if before.flutters != after.flutters:
        found += _flutters(arc, step, before, after)
    found = [replace(each, rounding=arc.problem.rounding(each.rest)) for each in found]
    return sorted(found, key=lambda each: arc.reach(step, each.rest))


def _limits(arc: Arc, step: Step, turned: Array) -> Iterator[Critical]:
    """Find where the parameter turns back."""
    if step.direction[-1] * turned[-1] >= 0.0:
        return
    rest = arc.root(step, lambda rest: float(arc.direction(rest, step.direction)[-1]))
    if rest is not None:
        yield Critical("limit", rest, 1, arc.direction(rest, step.direction)[: len(rest.q), None])


def _mu(problem: Problem, rest: Rest, count: int) -> Array:
    """Return real parts of at least `count` eigenvalues mu = -s^2, ascending; those that pass zero are real there."""
    problem.set(rest.parameter)
    return squares(Tangent.at(problem.scene, rest.q, rest.multipliers), problem.shift, count)


def _branchings(arc: Arc, step: Step, before: State, after: State, limits: list[Critical]) -> list[Critical]:
    """Find where eigenvalues pass zero and the parameter does not turn back."""
    low, high = sorted((before.negative, after.negative))
    rests = []
    for k in range(low, high):

        def passing(rest: Rest, k: int = k) -> float:
            """Return the k-th eigenvalue mu."""
            return float(_mu(arc.problem, rest, k + 1)[k])

        rest = arc.crossing(step, passing)
        rests += [rest] if rest is not None else []
    at = [arc.reach(step, rest) for rest in rests]
    for limit in limits:  # the eigenvalue that passes zero at the limit is no branching
        there = arc.reach(step, limit.rest)
        if at:
            k = int(np.argmin(np.abs(np.array(at) - there)))
            if abs(at[k] - there) < 1e-2 * step.arc:
                at.pop(k)
                rests.pop(k)
    groups: list[list[Rest]] = []
    last = -np.inf
    for k in np.argsort(at):
        if groups and at[k] - last < SAME * step.arc:
            groups[-1].append(rests[k])
        else:
            groups.append([rests[k]])
        last = at[k]
    return [_branching(arc, group) for group in groups]


def _branching(arc: Arc, group: list[Rest]) -> Critical:
    rest = group[0]
    squares = state_at(arc.problem, rest, len(group) + FEW).squares
    order = np.argsort(np.abs(squares.values))[: len(group)]
    return Critical("branching", rest, len(group), np.real(squares.shapes[:, order]))


def _flutters(arc: Arc, step: Step, before: State, after: State) -> list[Critical]:
    """Find where oscillations begin or cease to grow."""
    problem = arc.problem
    problem.set(step.rest.parameter)
    damped = Tangent.at(problem.scene, step.rest.q, step.rest.multipliers).damping.any()
    rest = arc.root(step, (lambda rest: _fastest(problem, rest)) if damped else _meeting(arc, step, before, after))
    return (
        []
        if rest is None
        else [Critical("flutter", rest, abs(after.flutters - before.flutters), np.empty((len(step.rest.q), 0)))]
    )


def _fastest(problem: Problem, rest: Rest) -> float:
    """Return the largest real part of an oscillating exponent; below zero where none oscillates."""
    problem.set(rest.parameter)
    found = spectrum(Tangent.at(problem.scene, rest.q, rest.multipliers))
    swings = np.abs(found.values.imag) > found.rounding
    known = swings & (found.rounding < 0.1 * np.abs(found.values))
    return float(found.values.real[known].max(initial=-np.abs(found.values).max()))


def _meeting(arc: Arc, step: Step, before: State, after: State) -> Any:
    """Make the function ((mu_1 - mu_2)/2)^2 of the two mu that meet: positive while real, negative beyond."""
    unstable = before if before.flutters > after.flutters else after
    mu = -(unstable.squares.values**2)
    order = np.argsort(mu.real, kind="stable")
    mu, grows = mu[order], (unstable.squares.growth > 0.0)[order] & (mu.imag != 0.0)
    known = [i for i in np.flatnonzero(grows) if i or len(mu) > 1]
    first = int(known[0]) if known else 0
    if first + 1 >= len(mu) or abs(mu[first + 1].real - mu[first].real) > 1e-6 * abs(mu[first]) + EPS:
        first = max(first - 1, 0)

    def discriminant(rest: Rest) -> float:
        """Compute the discriminant of the two eigenvalues at an equilibrium."""
        values = -(state_at(arc.problem, rest).squares.values ** 2)
        values = values[np.argsort(values.real, kind="stable")]
        a, b = values[first], values[min(first + 1, len(values) - 1)]
        return float(-(a.imag**2) if a.imag else (a - b).real ** 2 / 4)

    return discriminant


DISTANCE = 0.05
"""Distance from the branching at which directions are scanned, in units of the coordinates."""
ANGLES = 64
"""Number of directions that are scanned; two paths within one interval are missed."""
CONVERGED = 1e-11
"""Last step of Newton's method, in units of the coordinates."""
NOTHING = 1e-15
"""Force, over the tangent's entries, that counts as rounding: no direction is preferred."""


def partings(problem: Problem, rest: Rest, shapes: Array, unit: float) -> list[Array]:
    """Find directions, (n,) each, in which paths leave a branching of two shapes, (n, 2); none where all are alike.

    `unit` is that of the parameter.
    """
    plane = np.linalg.qr(shapes / problem.units[:, None])[0]
    turns = np.linspace(0.0, 2 * np.pi, ANGLES + 1) + 0.1

    def across(turn: float) -> float:
        """Compute the transverse force at an angle in the plane."""
        return _across(problem, rest, plane, unit, turn)

    try:
        found = [across(turn) for turn in turns]
        if np.abs(found).max() < NOTHING:
            return []
        low = np.flatnonzero(np.diff(np.sign(found)))
        roots = [float(brentq(across, turns[k], turns[k + 1], xtol=1e-6)) for k in low]
    except StaticsError:
        return []
    return [problem.units * (plane @ [np.cos(turn), np.sin(turn)]) for turn in roots]


def _across(problem: Problem, rest: Rest, plane: Array, unit: float, turn: float) -> float:
    """Compute the transverse force, over the tangent's entries, that holds the state at a distance in a direction."""
    n, held, units = problem.scene.size, 0.0, problem.units
    along, side = plane @ [np.cos(turn), np.sin(turn)], plane @ [-np.sin(turn), np.cos(turn)]
    new = rest._replace(q=rest.q + DISTANCE * units * along)
    for _ in range(ITERATIONS):
        force, gap, a = problem.residual(new)
        slope = problem.slope(new, (force, gap))
        matrix, scale = problem.scale_matrix(a)
        if not isinstance(matrix, np.ndarray):
            raise StaticsError("too many unknowns")
        columns, rows = np.zeros((len(matrix), 2)), np.zeros((2, len(matrix)))
        columns[:, 0] = -np.concatenate([slope[:n] * units / scale, -slope[n:]]) * unit
        columns[:n, 1], rows[:, :n] = -side, plane.T
        off = np.array([DISTANCE * np.cos(turn), DISTANCE * np.sin(turn)]) - plane.T @ ((new.q - rest.q) / units)
        right = np.concatenate([force * units / scale + held * side, -gap, off])
        step = np.linalg.lstsq(np.block([[matrix, columns], [rows, np.zeros((2, 2))]]), right)[0]
        new = Rest(new.q + step[:n] * units, new.multipliers + step[n:-2] * scale, new.parameter + step[-2] * unit)
        held += float(step[-1])
        if np.abs(step[:n]).max(initial=0.0) < CONVERGED:
            return held
    raise StaticsError("no state near")
