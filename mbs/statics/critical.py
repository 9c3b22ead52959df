"""Critical points in a step along a path: limit points, branchings, simple or multiple, and onsets of flutter.

At limit points and branchings an eigenvalue of K z = mu M z passes zero. Flutter begins where two eigenvalues meet, or, with
damping, where a complex exponent s passes the imaginary axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..geometry import Array
from .algebra import MANY
from .arc import Arc, Step
from .problem import Problem, Rest, StaticsError
from .spectrum import Spectrum, Tangent, spectrum

FEW = 1
"""Number of eigenvalues above zero computed for a large tangent: the next ones to pass zero."""
MOST_DECREASE = 0.5
"""Largest relative decrease of an eigenvalue in a piece. Before a parabola dips below zero it decreases by 3/4 in a piece."""
SHORTEST_PIECE = 1.6e-3
"""Arc length at which the halving of pieces ends."""
SAME_POINT = 1e-5
"""Distance, over the step, within which critical points are one multiple point."""
UNSURE = (1e-3, 1.0)
"""Growth rates, over their rounding error, from which an oscillation counts as growing: where flutter begins, two values meet and
the rate is as a square root."""


class TangentState(NamedTuple):
    """Stability of an equilibrium: spectra of K and M alone, and of the whole tangent."""

    squares: Spectrum
    whole: Spectrum

    @property
    def growth(self) -> float:
        """Largest growth rate [1/s]."""
        return float(self.whole.growth.max(initial=0.0))

    @property
    def negative(self) -> int:
        """Number of eigenvalues mu that are real and below zero."""
        return int(((self.squares.growth > 0.0) & (self.squares.values.imag == 0.0)).sum())

    def count_flutters(self, sure: float = 1.0) -> int:
        """Count oscillations whose growth rate is above a share of its rounding error."""
        values, rounding = self.whole.values, self.whole.rounding
        return int(((values.real > sure * rounding) & (np.abs(values.imag) > rounding)).sum())


def state_at(problem: Problem, rest: Rest, count: int = FEW) -> TangentState:
    """Compute the stability of an equilibrium; with many unknowns only `count` eigenvalues above zero."""
    problem.set(rest.parameter)
    tangent = Tangent.at(problem.scene, rest.q, rest.multipliers)
    plain = spectrum(replace(tangent, damping=0.0 * tangent.damping), problem.shift, count)
    problem.shift = plain.shift
    return TangentState(plain, plain if tangent.conservative else spectrum(tangent))


@dataclass(frozen=True)
class Critical:
    """Critical point of a path, a 'limit', 'branching' or 'flutter', at which `multiple` eigenvalues pass zero.

    `shapes` (n, multiple) are the critical eigenvectors of a limit or a branching; `rounding` is the error of the parameter.
    """

    kind: str
    rest: Rest
    multiple: int
    shapes: Array
    rounding: float = 0.0


def _rate(arc: Arc, ahead: Array, rest: Rest) -> float:
    """Compute the rate of the parameter along the curve of equilibria at one of them."""
    return float(arc.direction(rest, ahead)[-1])


def criticals(
    arc: Arc, step: Step, before: TangentState, after: TangentState, turned: Array, last: tuple[Step, TangentState] | None
) -> list[Critical]:  # fmt: skip
    """Find the critical points within a step that ends in the direction `turned`, in their order.

    `last` is the step before, with the stability at its start.
    """
    found = []
    for part, one, other, way in _pieces(arc, step, before, after, turned, last):
        limits = list[Critical]()
        if part.direction[-1] * way[-1] < 0.0:  # the parameter turns back
            rest = arc.root(part, partial(_rate, arc, part.direction))
            limits += [Critical("limit", rest, 1, arc.direction(rest, part.direction)[: len(rest.q), None])] if rest else []
        pairs = _pairs(arc.problem, part, one, other)
        found += [*limits, *_branchings(arc, part, pairs.shapes[:, pairs.crosses].T, limits)]
    if before.count_flutters() != after.count_flutters():
        found += _flutters(arc, step, before, after)
    found = [replace(each, rounding=arc.problem.rounding(each.rest)) for each in found]
    return sorted(found, key=lambda each: arc.reach(step, each.rest))


Piece = tuple[Step, TangentState, TangentState, Array]
"""Part of a step, stability at both its ends, and the direction at the second one."""


def _pieces(
    arc: Arc, step: Step, before: TangentState, after: TangentState, turned: Array, last: tuple[Step, TangentState] | None
) -> Iterator[Piece]:  # fmt: skip
    """Halve a step until no eigenvalue decreases by more than `MOST_DECREASE`, so that none passes zero twice in a piece.

    The decrease extrapolated from the piece before is limited likewise.
    """
    mu, later = _pairs(arc.problem, step, before, after)[:2]
    shares = (mu - later) / np.where(mu, mu, np.inf)
    if last is not None:
        mu, later = _pairs(arc.problem, last[0], last[1], before)[:2]
        shares = np.append(shares, (mu - later) / np.where(later, later, np.inf) * step.arc / last[0].arc)
    try:
        if step.arc < SHORTEST_PIECE or not (shares > MOST_DECREASE).any():
            raise StaticsError("short enough")
        rest = arc.along(step, 0.5 * step.arc)
        way = arc.direction(rest, step.direction)
        second = Step(rest, way, step.new, float(arc.metric * way @ (arc.problem.vector(step.new) - arc.problem.vector(rest))))
        if not 0.25 * step.arc < second.arc < step.arc:
            raise StaticsError("on another path")
        between = state_at(arc.problem, rest)
    except StaticsError:
        yield step, before, after, turned
        return
    first = Step(step.rest, step.direction, rest, 0.5 * step.arc)
    yield from _pieces(arc, first, before, between, way, last)
    yield from _pieces(arc, second, between, after, turned, (first, before))


class Pairs(NamedTuple):
    """Eigenvalues at both ends of a step, real parts of mu = -s^2 [1/s^2], nan if zero to rounding; True if the sign changes.

    The `shapes`, (n, pairs), are means of both ends times the mass matrix, each of modal mass 1.
    """

    before: Array
    after: Array
    crosses: Array
    shapes: Array


def _pairs(problem: Problem, step: Step, before: TangentState, after: TangentState) -> Pairs:
    """Pair eigenvalues at the ends of a step by their shapes, as their order changes where two cross."""
    ends = []
    for rest, state in ((step.rest, before), (step.new, after)):
        found = state.squares
        mass = problem.scene.mass_at(rest.q, sparse=len(rest.q) >= MANY)
        shapes = np.real(found.shapes)
        shapes = shapes / np.sqrt(np.maximum(np.einsum("ij,ij->j", shapes, mass @ shapes), 1e-300))
        values = np.where(found.neutral, np.nan, -(found.values**2).real)
        ends.append((values, (found.growth > 0.0) & (found.values.imag == 0.0), shapes, mass @ shapes))
    (mu_a, negative_a, _, momentum_a), (mu_b, negative_b, shapes_b, momentum_b) = ends
    overlap = momentum_a.T @ shapes_b
    i, j = linear_sum_assignment(-np.abs(overlap))
    shapes = (momentum_a[:, i] + np.sign(overlap[i, j]) * momentum_b[:, j]) / 2
    return Pairs(mu_a[i], mu_b[j], negative_a[i] != negative_b[j], shapes)


def _branchings(arc: Arc, step: Step, crossing: Array, limits: list[Critical]) -> list[Critical]:
    """Find the branchings at which eigenvalues with these shapes pass zero, except at limit points."""
    rests = []
    for each in crossing:

        def passing(rest: Rest, shape: Array = each) -> float:
            """Return the eigenvalue mu whose shape is most like that of the pair."""
            squares = state_at(arc.problem, rest, len(crossing) + FEW).squares
            mass = arc.problem.scene.mass_at(rest.q, sparse=len(rest.q) >= MANY)
            size = np.sqrt(np.einsum("ij,ij->j", squares.shapes.real, mass @ squares.shapes.real))
            return float(-(squares.values[np.argmax(np.abs(shape @ squares.shapes.real) / size)] ** 2).real)

        rest = arc.crossing(step, passing)
        rests += [rest] if rest is not None else []
    at = [arc.reach(step, rest) for rest in rests]
    for limit in limits:  # there the eigenvalue belongs to the limit point
        there = arc.reach(step, limit.rest)
        if at:
            k = int(np.argmin(np.abs(np.array(at) - there)))
            if abs(at[k] - there) < 1e-2 * step.arc:
                at.pop(k)
                rests.pop(k)
    order, found = np.argsort(at), []
    for group in np.split(order, np.flatnonzero(np.diff(np.array(at)[order]) >= SAME_POINT * step.arc) + 1) if at else ():
        rest, count = rests[group[0]], len(group)
        squares = state_at(arc.problem, rest, count + FEW).squares
        nearest = np.argsort(np.abs(squares.values))[:count]
        found.append(Critical("branching", rest, count, np.real(squares.shapes[:, nearest])))
    return found


def _flutters(arc: Arc, step: Step, before: TangentState, after: TangentState) -> list[Critical]:
    """Find where oscillations begin or cease to grow, by the change of their number, first below the rounding error."""
    for sure in UNSURE:

        def keeps(rest: Rest, sure: float = sure) -> float:
            """Return 1 while the number of growing oscillations is that at the start of the step, else -1."""
            return 1.0 if state_at(arc.problem, rest).count_flutters(sure) == before.count_flutters(sure) else -1.0

        if (rest := arc.root(step, keeps)) is not None:
            change = abs(after.count_flutters() - before.count_flutters())
            return [Critical("flutter", rest, change, np.empty((len(rest.q), 0)))]
    return []
