"""Critical points in a step along a path: limit points, branchings, simple or multiple, and onsets of flutter.

K alone decides where a path turns or branches: there an eigenvalue of K z = mu M z passes zero. A flutter begins where two of
them meet, or, with damping, where a complex exponent s passes the imaginary axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..geometry import Array
from .arc import Arc, Step
from .lowest import EPS
from .problem import Problem, Rest
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
