"""Critical points in a step along a path: limit points, branchings, simple or multiple, and onsets of flutter.

At limit points and branchings an eigenvalue mu = -s^2 of K z = mu M z passes zero; at a limit point the parameter turns back.
Flutter begins where two eigenvalues meet, or, with damping, where a complex exponent s passes the imaginary axis.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from ..geometry import Array
from .algebra import MANY
from .arc import Arc, Step
from .problem import Problem, Rest, StaticsError
from .spectrum import Spectrum, Tangent, spectrum

FEW = 1
"""Number of eigenvalues above zero that are computed if coordinates are many (`MANY`): the next ones to pass zero."""
MOST_DECREASE = 0.5
"""Largest relative decrease of an eigenvalue in a piece: a parabola that touches zero in the next piece decreases by 3/4."""
SHORTEST_PIECE = 1.6e-3
"""Arc length below which pieces are not halved: the longest step by default, 0.1, is halved six times."""
NEAR_LIMIT = 1e-2
"""Distance from a limit point, over the step, within which a root of an eigenvalue is that of the limit point itself."""
SAME_POINT = 1e-5
"""Distance, over the step, within which critical points are one multiple point."""
GROWTH_THRESHOLDS = (1e-3, 1.0)
"""Growth rates, over their rounding error, above which an oscillation counts as growing: tried in this order.

Where two eigenvalues meet the rate grows like a square root, so that the lower threshold locates the onset better."""


class TangentState(NamedTuple):
    """Stability of an equilibrium: spectrum of K and M alone, and spectrum with damping."""

    undamped: Spectrum
    damped: Spectrum

    @property
    def growth(self) -> float:
        """Largest growth rate [1/s]."""
        return float(self.damped.growth.max(initial=0.0))

    @property
    def is_negative(self) -> Array:
        """True for eigenvalues mu that are real and below zero, (m,)."""
        return np.asarray((self.undamped.growth > 0.0) & (self.undamped.values.imag == 0.0))

    def count_flutters(self, threshold: float = 1.0) -> int:
        """Count oscillations whose growth rate, over its rounding error, is above a threshold."""
        values, rounding = self.damped.values, self.damped.rounding
        return int(((values.real > threshold * rounding) & (np.abs(values.imag) > rounding)).sum())


def state_at(problem: Problem, rest: Rest, count: int = FEW) -> TangentState:
    """Compute the stability of an equilibrium; with many unknowns only `count` eigenvalues above zero."""
    problem.set_parameter(rest.parameter)
    tangent = Tangent.at(problem.scene, rest.q, rest.multipliers)
    undamped = spectrum(replace(tangent, damping=0.0 * tangent.damping), problem.shift, count)
    problem.shift = undamped.shift  # with which the search at the next state begins
    return TangentState(undamped, undamped if tangent.conservative else spectrum(tangent))


@dataclass(frozen=True)
class Critical:
    """Critical point of a path, a 'limit', 'branching' or 'flutter', at which `multiple` eigenvalues pass zero.

    `shapes` (n, multiple) are the critical eigenvectors of a limit point or a branching, `rounding` the error of the parameter.
    """

    kind: str
    rest: Rest
    multiple: int
    shapes: Array
    rounding: float = 0.0


def find_criticals(
    arc: Arc, step: Step, before: TangentState, after: TangentState, end: Array, last: tuple[Step, TangentState] | None
) -> list[Critical]:  # fmt: skip
    """Find the critical points within a step, in their order.

    `before` and `after` are the stabilities at the ends of the step, `end` is the direction of the path at the second end. `last`
    is the step before, with the stability at its start.
    """
    found = []
    for piece, first, second, direction in _pieces(arc, step, before, after, end, last):

        def parameter_rate(rest: Rest, ahead: Array = piece.direction) -> float:
            """Compute the rate of the parameter along the path, oriented as the piece."""
            return float(arc.direction(rest, ahead)[-1])

        limits = list[Critical]()
        if piece.direction[-1] * direction[-1] < 0.0 and (rest := arc.find_root(piece, parameter_rate)):
            limits.append(Critical("limit", rest, 1, arc.direction(rest, piece.direction)[: len(rest.q), None]))
        pairs = _pairs(arc.problem, piece, first, second)
        found += [*limits, *_branchings(arc, piece, pairs.shapes[:, pairs.crosses].T, limits)]
    if before.count_flutters() != after.count_flutters():
        found += _flutters(arc, step, before, after)
    found = [replace(critical, rounding=arc.problem.rounding(critical.rest)) for critical in found]
    return sorted(found, key=lambda critical: arc.arc_of(step, critical.rest))


Piece = tuple[Step, TangentState, TangentState, Array]
"""Part of a step, stability at both its ends, and direction of the path at the second end."""


def _pieces(
    arc: Arc, step: Step, before: TangentState, after: TangentState, end: Array, last: tuple[Step, TangentState] | None
) -> Iterator[Piece]:  # fmt: skip
    """Halve a step until no eigenvalue decreases more than `MOST_DECREASE` in a piece, nor by extrapolation of the last."""
    mu, mu_after, *_ = _pairs(arc.problem, step, before, after)
    decreases = (mu - mu_after) / np.where(mu, mu, np.inf)
    if last is not None:
        last_step, last_state = last
        mu_last, mu, *_ = _pairs(arc.problem, last_step, last_state, before)
        decreases = np.append(decreases, (mu_last - mu) / np.where(mu, mu, np.inf) * step.arc / last_step.arc)
    must_be_halved = step.arc >= SHORTEST_PIECE and (decreases > MOST_DECREASE).any()
    halves = _halve(arc, step) if must_be_halved else None
    if halves is None:
        yield step, before, after, end
        return
    first, second = halves
    between = state_at(arc.problem, second.rest)
    yield from _pieces(arc, first, before, between, second.direction, last)
    yield from _pieces(arc, second, between, after, end, (first, before))


def _halve(arc: Arc, step: Step) -> tuple[Step, Step] | None:
    """Halve a step; return None near a corner of the path, or if the equilibrium in the middle lies on another path."""
    try:
        rest = arc.equilibrium_at(step, 0.5 * step.arc)
        direction = arc.direction(rest, step.direction)
    except StaticsError:
        return None
    vector = arc.problem.vector(step.new) - arc.problem.vector(rest)
    second = Step(rest, direction, step.new, float(arc.metric * direction @ vector))
    is_on_path = 0.25 * step.arc < second.arc < step.arc
    return (Step(step.rest, step.direction, rest, 0.5 * step.arc), second) if is_on_path else None


class Pairs(NamedTuple):
    """Pairs of eigenvalues at both ends of a step: real parts of mu [1/s^2], nan if zero to rounding.

    `crosses` is True if the sign changes. `shapes` (n, pairs) are M times means of both eigenvectors, which have the
    modal mass 1.
    """

    before: Array
    after: Array
    crosses: Array
    shapes: Array


def _pairs(problem: Problem, step: Step, before: TangentState, after: TangentState) -> Pairs:
    """Pair eigenvalues at the ends of a step by the overlap of their shapes, as their order changes where two cross."""
    ends = []
    for rest, state in ((step.rest, before), (step.new, after)):
        found = state.undamped
        mass = problem.scene.mass_at(rest.q, sparse=len(rest.q) >= MANY)
        shapes = np.real(found.shapes)
        shapes = shapes / np.sqrt(np.maximum(np.einsum("ij,ij->j", shapes, mass @ shapes), 1e-300))
        values = np.where(found.neutral, np.nan, -(found.values**2).real)
        ends.append((values, state.is_negative, shapes, mass @ shapes))
    (mu_a, negative_a, _, momentum_a), (mu_b, negative_b, shapes_b, momentum_b) = ends
    overlap = momentum_a.T @ shapes_b
    i, j = linear_sum_assignment(-np.abs(overlap))
    shapes = (momentum_a[:, i] + np.sign(overlap[i, j]) * momentum_b[:, j]) / 2
    return Pairs(mu_a[i], mu_b[j], negative_a[i] != negative_b[j], shapes)


def _branchings(arc: Arc, step: Step, shapes: Array, limits: list[Critical]) -> list[Critical]:
    """Find the branchings at which the eigenvalues of pairs with given shapes, (pairs, n), pass zero, except limit points."""
    rests = []
    for shape in shapes:

        def eigenvalue(rest: Rest, shape: Array = shape) -> float:
            """Return the eigenvalue mu whose shape is most like that of the pair."""
            found = state_at(arc.problem, rest, len(shapes) + FEW).undamped
            mass = arc.problem.scene.mass_at(rest.q, sparse=len(rest.q) >= MANY)
            size = np.sqrt(np.einsum("ij,ij->j", found.shapes.real, mass @ found.shapes.real))
            return float(-(found.values[np.argmax(np.abs(shape @ found.shapes.real) / size)] ** 2).real)

        rest = arc.find_crossing(step, eigenvalue)
        rests += [rest] if rest is not None else []
    arcs = [arc.arc_of(step, rest) for rest in rests]
    for limit in limits:
        distances = np.abs(np.array(arcs) - arc.arc_of(step, limit.rest))
        if arcs and distances.min() < NEAR_LIMIT * step.arc:
            k = int(np.argmin(distances))
            arcs.pop(k)
            rests.pop(k)
    order, found = np.argsort(arcs), []
    for group in np.split(order, np.flatnonzero(np.diff(np.array(arcs)[order]) >= SAME_POINT * step.arc) + 1) if arcs else ():
        rest, count = rests[group[0]], len(group)
        spectrum_at = state_at(arc.problem, rest, count + FEW).undamped
        nearest = np.argsort(np.abs(spectrum_at.values))[:count]
        found.append(Critical("branching", rest, count, np.real(spectrum_at.shapes[:, nearest])))
    return found


def _flutters(arc: Arc, step: Step, before: TangentState, after: TangentState) -> list[Critical]:
    """Find where oscillations begin or cease to grow: where the number of growing ones changes, at either threshold."""
    for threshold in GROWTH_THRESHOLDS:

        def is_as_before(rest: Rest, threshold: float = threshold) -> float:
            """Return 1 while the number of growing oscillations is that at the start of the step, else -1."""
            return 1.0 if state_at(arc.problem, rest).count_flutters(threshold) == before.count_flutters(threshold) else -1.0

        if (rest := arc.find_root(step, is_as_before)) is not None:
            change = abs(after.count_flutters() - before.count_flutters())
            return [Critical("flutter", rest, change, np.empty((len(rest.q), 0)))]
    return []
