"""Assembly: places of points from the lengths and angles of links.

The unknowns x are the coordinates of the points whose places are not given. Places are complex numbers. Angles, guides and points
that links carry give linear equations, which are solved first: x = base + free z, with free coordinates z. The lengths |E - S| =
L of links from S to E remain. The Levenberg-Marquardt method solves them for z from random starts, to find all poses.
"""

from cmath import phase, rect
from collections.abc import Iterable, Iterator, Mapping
from math import hypot
from typing import Any, NamedTuple

import numpy as np

from .declare import RefusalError
from .geometry import Array
from .validate import short

Pair = tuple[float, float]
"""Coordinates x and y [m]."""
AGREE = 1e-9
"""Largest relative contradiction of places, lengths and angles that are given; linear equations that differ by less are one."""
SAME_POSE = 1e-6
"""Distance, over the longest link, below which two poses are the same."""
SINGULAR = 1e-6
"""Ratio of the least to the largest singular value below which a pose is a dead centre: places then lose half of their digits."""


class Assembly(NamedTuple):
    """Places of the points that lengths and angles determine [m], by name; in `others` the other poses, the topmost first."""

    points: dict[str, Pair]
    others: tuple[dict[str, Pair], ...] = ()


def assemble(
    points: Mapping[str, Pair], links: Iterable[Any], guides: Iterable[Any] = (), near: Mapping[str, Pair] | None = None
) -> Assembly:
    """Find the places of points by lengths and angles of links; raise a ValueError if these are too few or contradict each other.

    `points` are the given places [m]. A guide with a second point `through` keeps its own point on a line through that point, in
    the direction `along`. `near` are rough places [m]: the pose with the least sum of squared distances from them is taken. By
    default it is the pose whose first differing point is highest, then farthest right.
    """
    links, near = list(links), near or {}
    placed = [link for link in links if {link.start, link.end} <= set(points)]
    lengths = {link.name: abs(_vector(link, points)) for link in placed}  # [m]
    lengths |= {link.name: link.length for link in links if link.length is not None}
    deciding = [link for link in links if link.length is not None or link.angle is not None]
    concerned = [point for link in deciding for point in (link.start, link.end)]
    # points carried by links of known length; their names are the same for any length
    concerned += [point for link in links if link.name in lengths for point in link.carried_places(1.0)]
    unknown = list(dict.fromkeys(point for point in concerned if point not in points))
    for point in near:
        if point not in unknown:
            known = ", ".join(unknown) or "none"
            raise ValueError(f"near.{point}: no point whose place follows from lengths; those are: {known}")
    if not deciding or not unknown:
        return Assembly({})
    places = _as_linear_forms(points, unknown)
    linear = list(_linear_equations(places, links, lengths, guides))
    of_length = [link for link in deciding if link.angle is None and {link.start, link.end} <= set(places)]
    equations = _LengthEquations(of_length, places, *_solve_linear(linear, 2 * len(unknown)))
    equations.check_decided()
    size = max(lengths.values(), default=0.0) or 1.0  # [m]
    solutions, solved = equations.find_all(size)
    poses = [dict(zip(unknown, [(x, y) for x, y in each.reshape(-1, 2).tolist()], strict=True)) for each in solutions]
    if not solved:
        raise _out_of_reach(of_length, {**points, **poses[0]})
    # an angle as an equation allows the opposite direction, too; if no pose has all given directions, `check_links` raises below
    directed = [pose for pose in poses if all(_has_direction(link, {**points, **pose}) for link in deciding)]
    # Poses are sorted by coordinates, and the nearest one is chosen by squares of distances. Both are rounded, so that equal
    # poses have equal numbers. A change of a coordinate by `step` changes a square by about `step * size`.
    step = SAME_POSE * size  # [m]
    # first comes the pose whose first differing point is highest, then farthest right
    candidates = sorted(directed or poses, key=lambda pose: [-round(x / step) for p in unknown for x in reversed(pose[p])])
    squares = [sum((pose[p][0] - x) ** 2 + (pose[p][1] - y) ** 2 for p, (x, y) in near.items()) for pose in candidates]
    distances = [round(square / (step * size)) for square in squares]
    first = candidates[distances.index(min(distances))]  # of several equally near ones, or without `near`, the topmost
    check_links({**points, **first}, deciding)
    equations.check_regular(unknown, first)
    return Assembly(first, tuple(pose for pose in candidates if pose is not first))


def carried_points(points: Mapping[str, Pair], links: Iterable[Any]) -> dict[str, Pair]:
    """Add the places of the points that links carry; raise a ValueError if such a point is given elsewhere."""
    found = dict(points)
    for link in links:
        if link.start not in found or link.end not in found:
            continue  # the check of the link names the missing point
        for point, (x, y) in link.locate_carried(found[link.start], found[link.end]).items():
            distance = hypot(found[point][0] - x, found[point][1] - y) if point in found else 0.0
            if distance > AGREE * abs(_vector(link, found)):
                fault = f"link '{link.name}' carries it at ({x:.9g}, {y:.9g}) m; leave it out"
                raise ValueError(f"points['{point}'] = {short(found[point])} m: {fault}")
            found[point] = (x, y)
    return found


def _vector(link: Any, points: Mapping[str, Pair]) -> complex:
    return complex(*points[link.end]) - complex(*points[link.start])


def _as_linear_forms(points: Mapping[str, Pair], unknown: list[str]) -> dict[str, Array]:
    """Return places as linear forms of the unknowns, complex, shape (unknowns + 1,): coefficients, then the constant."""
    places = {point: np.zeros(2 * len(unknown) + 1, dtype=complex) for point in (*unknown, *points)}
    for k, point in enumerate(unknown):
        places[point][2 * k : 2 * k + 2] = 1.0, 1j
    for point, place in points.items():
        places[point][-1] = complex(*place)
    return places


def _linear_equations(
    places: Mapping[str, Array], links: list[Any], lengths: Mapping[str, float], guides: Iterable[Any]
) -> Iterator[Array]:
    """Yield real linear forms that must vanish: of guided points, of angles of links, and of the points that links carry."""
    for guide in guides:
        if guide.through and guide.point in places and guide.through in places:  # distance from the line through a second point
            yield ((places[guide.point] - places[guide.through]) * complex(*guide.along).conjugate()).imag
    for link in links:
        if link.start not in places or link.end not in places:
            continue
        vector = places[link.end] - places[link.start]
        if link.angle is not None and link.length is not None:
            error = vector.copy()
            error[-1] -= rect(link.length, link.angle)
            yield from (error.real, error.imag)
        elif link.angle is not None:
            yield (vector * rect(1.0, -link.angle)).imag
        if length := lengths.get(link.name):
            for point, (x, y) in link.carried_places(length).items():
                error = places[point] - places[link.start] - vector * complex(x, y) / length
                yield from (error.real, error.imag)


def _solve_linear(equations: list[Array], count: int) -> tuple[Array, Array]:
    """Return a least-squares solution of linear equations, (count,), and an orthonormal basis of their null space as columns."""
    if not equations:
        return np.zeros(count), np.eye(count)
    matrix = np.array(equations)
    u, values, vt = np.linalg.svd(matrix[:, :-1])
    rank = int((values > AGREE * max(1.0, values[0])).sum())  # number of independent equations
    base = vt[:rank].T @ (-(u.T @ matrix[:, -1])[:rank] / values[:rank])
    return base, vt[rank:].T


class _LengthEquations:
    """Equations |M z + c| = L of the links whose length alone is given, with M and c complex; each solution z is a pose."""

    def __init__(self, links: list[Any], places: Mapping[str, Array], base: Array, free: Array) -> None:
        self.links, self.base, self.free = links, base, free
        self.lengths = np.array([link.length for link in links])
        chords = np.array([places[link.end] - places[link.start] for link in links], dtype=complex)  # linear forms of E - S
        chords = chords.reshape(-1, len(base) + 1)  # also without links
        self.matrix, self.constant = chords[:, :-1] @ free, chords[:, :-1] @ base + chords[:, -1]

    def residual(self, z: Array) -> tuple[Array, Array]:
        """Compute (|v|^2 - L^2) / 2 L, v = M z + c [m], and its derivatives by z, for z of shape (starts, free)."""
        v = z @ self.matrix.T + self.constant
        value = (np.abs(v) ** 2 - self.lengths**2) / (2 * self.lengths)
        return value, (v.conj()[..., None] * self.matrix).real / self.lengths[:, None]

    def check_decided(self) -> None:
        """Raise a ValueError if there are fewer equations than unknowns, by the rank of the derivatives in a random pose."""
        count = self.free.shape[1]
        _, (slopes,) = self.residual(np.random.default_rng(1).normal(size=(1, count)))
        missing = count - (int(np.linalg.matrix_rank(slopes)) if slopes.size else 0)
        if missing:
            example = f", as links.{self.links[0].name}.angle = '60 deg'" if self.links else ""
            left, more = ("1 way", "an angle") if missing == 1 else (f"{missing} ways", f"{missing} angles")
            raise ValueError(f"links: lengths and angles leave {left} open; give {more} more{example}, or places of points")

    def find_all(self, size: float) -> tuple[list[Array], bool]:
        """Find all poses from random starts: return their unknowns x and True, or that with the least residual and False."""
        found: list[Array] = []
        random = np.random.default_rng(1)
        if not self.free.shape[1] or not len(self.lengths):
            return [self.base], True  # nothing is free; `check_links` checks the lengths
        for _ in range(8):  # the first round that finds no further pose is the last
            starts = random.normal(size=(48, self.free.shape[1]))  # more starts cost time, fewer may miss a pose
            z, residuals = self._iterate(size * starts)
            poses, before = self.base + z @ self.free.T, len(found)
            for x in poses[residuals < 1e-12 * size]:  # converged to rounding
                if all(np.abs(x - other).max() > SAME_POSE * size for other in found):
                    found.append(x)
            if len(found) == before:
                return found or [poses[np.argmin(residuals)]], bool(found)
        return found, True

    def _iterate(self, z: Array) -> tuple[Array, Array]:
        """Iterate by the Levenberg-Marquardt method from starts z, (starts, free); return last z and largest residual [m]."""
        damping = np.full(len(z), 1e-2)
        value, slopes = self.residual(z)
        for _ in range(60):  # at most
            square = np.einsum("sqi,sqj->sij", slopes, slopes)  # axes: starts s, links q, free coordinates i and j
            square += (damping[:, None] + 1e-14)[..., None] * np.eye(z.shape[1])  # 1e-14: so that the matrix is regular
            gradient = np.einsum("sqi,sq->si", slopes, value)
            trial = z - np.linalg.solve(square, gradient[..., None])[..., 0]
            new_value, new_slopes = self.residual(trial)
            is_better = (new_value**2).sum(axis=1) <= (value**2).sum(axis=1)
            z, value = np.where(is_better[:, None], trial, z), np.where(is_better[:, None], new_value, value)
            slopes = np.where(is_better[:, None, None], new_slopes, slopes)
            damping = np.where(is_better, damping / 10, damping * 10).clip(1e-15, 1e6)
            if (np.abs(value) < 1e-14 * self.lengths.max()).all():
                break
        return z, np.abs(value).max(axis=1)

    def check_regular(self, unknown: list[str], pose: Mapping[str, Pair]) -> None:
        """Raise a ValueError if a pose is a dead centre, where places are not differentiable in the lengths."""
        if not self.free.shape[1]:
            return
        x = np.concatenate([pose[point] for point in unknown])
        z = (x - self.base) @ self.free  # inverse of x = base + free z, as the basis is orthonormal
        _, (slopes,) = self.residual(z[None])
        values = np.linalg.svd(slopes, compute_uv=False)
        if values[-1] < SINGULAR * values[0]:
            names = ", ".join(f"'{link.name}'" for link in self.links)
            raise ValueError(f"links {names}: are at a dead centre, in line; start from another angle, or give places of points")


def _has_direction(link: Any, points: Mapping[str, Pair]) -> bool:
    """Return True if a link has the direction of its angle, not the opposite one."""
    return link.angle is None or (_vector(link, points) * rect(1.0, -link.angle)).real >= 0


def check_links(points: Mapping[str, Pair], links: Iterable[Any]) -> None:
    """Raise a RefusalError if the places of a link's ends contradict its length or angle."""
    for link in links:
        if link.start not in points or link.end not in points:
            continue
        vector, where = _vector(link, points), f"'{link.start}' and '{link.end}'"
        if link.length is not None and abs(abs(vector) - link.length) > AGREE * link.length:
            why = f"{where} are {abs(vector):.9g} m apart"
            raise RefusalError(f"length of link '{link.name}' = {link.length:.9g} m: {why}", f"links.{link.name}")
        if link.angle is not None:
            across = (vector * rect(1.0, -link.angle)).imag
            if abs(across) > AGREE * abs(vector) or not _has_direction(link, points):
                why = f"{where} lie in the direction of {phase(vector):.9g} rad"
                raise RefusalError(f"angle of link '{link.name}' = {link.angle:.9g} rad: {why}", f"links.{link.name}")


def _out_of_reach(links: list[Any], points: Mapping[str, Pair]) -> ValueError:
    """Make the error for lengths that no pose has, from the pose with the least residual."""
    best = {link.name: abs(_vector(link, points)) for link in links}
    # 1e-3 is chosen: the message names the links that are farther off, or all if none is
    wrong = [link for link in links if abs(best[link.name] - link.length) > 1e-3 * link.length] or links
    each = ", ".join(f"'{link.name}' {best[link.name]:.4g} m for {link.length:.4g} m" for link in wrong)
    return ValueError(f"links: out of reach, no pose has these lengths; at best {each}; a plain number is in m")
