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
from ..spectral.start import differentiate_marker
from .algebra import SPARSE_COORDINATES
from .arc import Arc, Step
from .problem import Problem, Rest, StaticsError
from .spectrum import Spectrum, spectrum


class TangentState(NamedTuple):
    """Stability of an equilibrium: spectrum of K and M alone, and spectrum with damping."""

    undamped: Spectrum
    damped: Spectrum

    @property
    def is_negative(self) -> Array:
        """True for eigenvalues mu that are real and below zero, (m,)."""
        return np.asarray((self.undamped.growth > 0.0) & (self.undamped.values.imag == 0.0))

    def count_flutters(self, threshold: float = 1.0) -> int:
        """Count oscillations whose growth rate, over its rounding error, is above a threshold."""
        values, rounding = self.damped.values, self.damped.rounding
        return int(((values.real > threshold * rounding) & (np.abs(values.imag) > rounding)).sum())


def state_at(problem: Problem, rest: Rest, count: int = 1) -> TangentState:
    """Compute the stability of an equilibrium; with many unknowns only `count` eigenvalues above zero, the next to pass it."""
    tangent = problem.linearise(rest)
    undamped = spectrum(replace(tangent, damping=0.0 * tangent.damping), problem.shift, count)
    problem.shift = undamped.shift  # by which `spectrum` inverts K + shift M: the next state begins with it
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


class PathPiece(NamedTuple):
    """Step or a part of it, with the stability at both ends and the direction of the path at the second end."""

    step: Step
    before: TangentState
    after: TangentState
    direction_after: Array


def find_criticals(arc: Arc, whole: PathPiece, last: PathPiece | None) -> list[Critical]:
    """Find the critical points within a whole step, in their order; `last` is the step before."""
    found = [critical for piece in _pieces(arc, whole, last) for critical in _zeros(arc, piece)]
    if whole.before.count_flutters() != whole.after.count_flutters():
        found += _flutters(arc, whole)
    found = [replace(critical, rounding=arc.problem.rounding(critical.rest)) for critical in found]
    return sorted(found, key=lambda critical: arc.arc_of(whole.step, critical.rest))


def _zeros(arc: Arc, piece: PathPiece) -> list[Critical]:
    """Find the limit point and the branchings within a piece, where eigenvalues pass zero."""
    limits, ahead = list[Critical](), piece.step.direction
    turns_back = ahead[-1] * piece.direction_after[-1] < 0.0  # the last component of a direction is that of the parameter
    if turns_back and (rest := arc.find_root(piece.step, lambda rest: float(arc.direction(rest, ahead)[-1]))):
        eigenvector = arc.direction(rest, ahead)[: len(rest.q), None]  # at a limit point only q and lambda change
        limits.append(Critical("limit", rest, 1, eigenvector))
    pairs = _pairs(arc.problem, piece)
    return [*limits, *_branchings(arc, piece.step, pairs.momenta[:, pairs.crosses].T, limits)]


def _pieces(arc: Arc, piece: PathPiece, last: PathPiece | None) -> Iterator[PathPiece]:
    """Halve a piece until no eigenvalue decreases by more than half in it, also at the rate of decrease in the `last` piece.

    An eigenvalue may touch zero, or pass it and come back, while its signs at the ends of a piece are equal. Before that it
    decreases fast: the parabola (2 - x)^2, which touches zero at x = 2, by 3/4 from x = 0 to 1.
    """
    pairs = _pairs(arc.problem, piece)
    decreases = (pairs.before - pairs.after) / np.where(pairs.before, pairs.before, np.inf)  # inf: 0 instead of 0/0
    if last is not None:
        pairs = _pairs(arc.problem, last)
        relative = (pairs.before - pairs.after) / np.where(pairs.after, pairs.after, np.inf)  # `after` is where the piece begins
        decreases = np.append(decreases, relative * piece.step.arc / last.step.arc)
    is_long = piece.step.arc >= 1.6e-3  # the longest step by default, 0.1, is halved six times
    halves = _halve(arc, piece.step) if is_long and (decreases > 0.5).any() else None
    if halves is None:
        yield piece
        return
    between = state_at(arc.problem, halves[1].rest)
    first = PathPiece(halves[0], piece.before, between, halves[1].direction)
    yield from _pieces(arc, first, last)
    yield from _pieces(arc, PathPiece(halves[1], between, piece.after, piece.direction_after), first)


def _halve(arc: Arc, step: Step) -> tuple[Step, Step] | None:
    """Halve a step; return None near a corner of the path, or if the equilibrium in the middle lies on another path."""
    try:
        rest = arc.equilibrium_at(step, 0.5 * step.arc)
        direction = arc.direction(rest, step.direction)
    except StaticsError:
        return None
    vector = arc.problem.vector(step.new) - arc.problem.vector(rest)
    second = Step(rest, direction, step.new, float(arc.metric * direction @ vector))
    is_on_path = 0.25 * step.arc < second.arc < step.arc  # half of the step, with a wide margin for curvature
    return (Step(step.rest, step.direction, rest, 0.5 * step.arc), second) if is_on_path else None


class Pairs(NamedTuple):
    """Pairs of eigenvalues at both ends of a piece: real parts of mu [1/s^2], nan if zero to rounding.

    `crosses` is True if the sign changes. `momenta` (n, pairs) are M times means of both eigenvectors of modal mass 1.
    """

    before: Array
    after: Array
    crosses: Array
    momenta: Array


def _pairs(problem: Problem, piece: PathPiece) -> Pairs:
    """Pair eigenvalues at the ends of a piece by the overlap of their shapes, as their order changes where two cross."""
    ends = []
    for rest, state in ((piece.step.rest, piece.before), (piece.step.new, piece.after)):
        found = state.undamped
        mass = problem.scene.mass_at(rest.q, sparse=len(rest.q) >= SPARSE_COORDINATES)
        shapes = np.real(found.shapes)
        shapes = shapes / np.sqrt(np.maximum(np.einsum("ij,ij->j", shapes, mass @ shapes), 1e-300))
        values = np.where(found.neutral, np.nan, -(found.values**2).real)
        ends.append((values, state.is_negative, shapes, mass @ shapes))
    (mu_a, negative_a, _, momentum_a), (mu_b, negative_b, shapes_b, momentum_b) = ends
    overlap = momentum_a.T @ shapes_b
    i, j = linear_sum_assignment(-np.abs(overlap))
    momenta = (momentum_a[:, i] + np.sign(overlap[i, j]) * momentum_b[:, j]) / 2
    return Pairs(mu_a[i], mu_b[j], negative_a[i] != negative_b[j], momenta)


def _branchings(arc: Arc, step: Step, momenta: Array, limits: list[Critical]) -> list[Critical]:
    """Find the branchings at which the eigenvalues of pairs with given momenta, (pairs, n), pass zero, except limit points."""
    rests = []
    for momentum in momenta:

        def eigenvalue(rest: Rest, momentum: Array = momentum) -> float:
            """Return the eigenvalue mu whose shape is most like that of the pair."""
            found = state_at(arc.problem, rest, len(momenta) + 1).undamped
            mass = arc.problem.scene.mass_at(rest.q, sparse=len(rest.q) >= SPARSE_COORDINATES)
            size = np.sqrt(np.einsum("ij,ij->j", found.shapes.real, mass @ found.shapes.real))
            most_alike = np.argmax(np.abs(momentum @ found.shapes.real) / size)
            return float(-(found.values[most_alike] ** 2).real)  # mu = -s^2

        rest = arc.find_crossing(step, eigenvalue)  # not `find_root`: at a crossing of paths Newton's matrix is singular
        rests += [rest] if rest is not None else []
    for limit in limits:
        distances = [abs(arc.arc_of(step, rest) - arc.arc_of(step, limit.rest)) for rest in rests]
        if min(distances, default=np.inf) < 1e-2 * step.arc:  # chosen; the root is that of the limit point itself
            rests.pop(int(np.argmin(distances)))
    if not rests:
        return []
    rests.sort(key=lambda rest: arc.arc_of(step, rest))
    gaps, found = np.diff([arc.arc_of(step, rest) for rest in rests]), []
    starts = np.flatnonzero(gaps >= 1e-5 * step.arc) + 1  # chosen: nearer roots are one multiple branching
    for group in np.split(np.arange(len(rests)), starts):
        rest, count = rests[group[0]], len(group)
        spectrum_at = state_at(arc.problem, rest, count + 1).undamped
        nearest = np.argsort(np.abs(spectrum_at.values))[:count]
        found.append(Critical("branching", rest, count, np.real(spectrum_at.shapes[:, nearest])))
    return found


def _flutters(arc: Arc, piece: PathPiece) -> list[Critical]:
    """Find where oscillations begin or cease to grow: where the number of rates above a threshold changes."""
    # Near its onset a rate often grows like a square root, and passes a low threshold sooner. The thresholds are multiples of the
    # rounding error. The numbers of rates above it differ at the ends, see `find_criticals`, those above 1e-3 of it may not.
    for threshold in (1e-3, 1.0):

        def sign(rest: Rest, threshold: float = threshold) -> float:
            """Return 1 while the number of growing oscillations is that at the start of the step, else -1."""
            is_same = state_at(arc.problem, rest).count_flutters(threshold) == piece.before.count_flutters(threshold)
            return 1.0 if is_same else -1.0

        if (rest := arc.find_root(piece.step, sign)) is not None:  # values are 1 and -1: Brent's method bisects
            change = abs(piece.after.count_flutters() - piece.before.count_flutters())
            return [Critical("flutter", rest, change, np.empty((len(rest.q), 0)))]
    return []


def shape_towards(problem: Problem, critical: Critical, link: str, point: str, along: Array) -> Array | None:
    """Return the weighted sum of critical shapes that moves a point most along a direction; None if none moves it."""
    problem.set_parameter(critical.rest.parameter)
    scene = problem.scene
    shapes = critical.shapes / np.abs(critical.shapes / problem.units[:, None]).max(axis=0)
    by_coordinates = differentiate_marker(scene, scene.marker(link, point), critical.rest.q)[:2]  # of the point's x and y
    displacements = by_coordinates @ shapes
    moves = along @ displacements / np.linalg.norm(along) / scene.length
    # of all weights with the same sum of squares, those in proportion to the moves give the largest move
    return shapes @ moves if np.abs(moves).max() > 1e-4 else None  # 1e-4 of the longest link: above rounding


def leaving_shapes(problem: Problem, critical: Critical) -> list[Array]:
    """Return the shapes with which paths leave a branching; at a multiple one the sums of shapes that move a point most."""
    if critical.multiple == 1:
        return [critical.shapes[:, 0]]
    shapes: list[Array] = []  # for each point of a link along x and y
    links = [link for link in problem.scene.mechanism.links if not link.body.massless]  # massless ones have no coordinates
    for name, point, along in ((link.name, point, along) for link in links for point in link.points for along in np.eye(2)):
        shape = shape_towards(problem, critical, name, point, along)
        if shape is not None:
            shape = shape / np.linalg.norm(shape / problem.units)
            cosines = [float(shape / problem.units**2 @ other) for other in shapes]  # of angles between shapes
            if np.abs(cosines).max(initial=0.0) < 0.999:  # else another point gave the same shape
                shapes.append(shape)
    return shapes
