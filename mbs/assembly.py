"""Assembly: places of points from the lengths and angles of links.

Linear equations are solved first, the remaining lengths |E - S|^2 = L^2 by the Levenberg-Marquardt method from random starts.
"""

from __future__ import annotations

from cmath import phase, rect
from collections.abc import Iterable, Iterator, Mapping
from math import hypot
from typing import Any, NamedTuple

import numpy as np

from .declare import RefusalError
from .geometry import Array
from .validate import short

Pair = tuple[float, float]
AGREE = 1e-9
"""Largest relative contradiction of places, lengths and angles that are given: rounding of numbers that people write."""
STARTS, ROUNDS, ITERATIONS = 48, 8, 60
SAME_POSE = 1e-6
"""Distance, over the longest link, below which two poses are the same."""
SINGULAR = 1e-6
"""Ratio of the least to the largest singular value below which a pose is a dead centre: there places have half of the digits."""


class Assembly(NamedTuple):
    """Places of the points that were left out, m.

    Attributes
    ----------
    points : dict of str to (float, float)
    others : tuple of such dicts
        The other poses of the same lengths and angles, from the topmost down.
    """

    points: dict[str, Pair]
    others: tuple[dict[str, Pair], ...] = ()


def assemble(
    points: Mapping[str, Pair], links: Iterable[Any], guides: Iterable[Any] = (), near: Mapping[str, Pair] | None = None
) -> Assembly:
    """Find the points that are determined by lengths and angles of links.

    Parameters
    ----------
    points : dict of str to (float, float)
        Places that are given, m.
    links : iterable of Link
    guides : iterable of Guide
        Those with `through` keep their point on a line.
    near : dict of str to (float, float), optional
        Rough places, m: of several poses the one with the least sum of squared distances from them is taken. By default it is
        the one whose first differing point is highest, then farthest right.

    Raises
    ------
    ValueError
        If lengths and angles are too few or contradict each other; in one line that names links.
    """
    links, near = list(links), near or {}
    lengths = {link.name: given for link in links if (given := _length(link, points)) is not None}
    deciding = [link for link in links if link.length is not None or link.angle is not None]
    concerned = [point for link in deciding for point in (link.start, link.end)]
    concerned += [point for link in links if link.name in lengths for point in link.carried_places(1.0)]
    unknown = list(dict.fromkeys(point for point in concerned if point not in points))
    for point in near:
        if point not in unknown:
            raise ValueError(
                f"near.{point}: no point whose place follows from lengths; those are: {', '.join(unknown) or 'none'}"
            )
    if not deciding or not unknown:
        return Assembly({})
    at = _places(points, unknown)
    guided = [each for each in guides if each.through and {each.point, each.through} <= set(at)]
    lines = [((at[each.point] - at[each.through]) * complex(*each.along).conjugate()).imag for each in guided]
    base, free = _linear([*_rows(at, links, lengths), *lines], 2 * len(unknown))
    size = max(lengths.values(), default=0.0) or 1.0
    open_links = [link for link in deciding if link.angle is None and link.start in at and link.end in at]
    ends = np.array([at[link.end] - at[link.start] for link in open_links], dtype=complex).reshape(-1, 2 * len(unknown) + 1)
    poses = _Poses(ends, np.array([link.length for link in open_links]), base, free)
    poses.check_decided(open_links)
    coordinates, met = poses.all(size)
    found = [_by_name(unknown, x) for x in coordinates]
    if not met:
        raise _out_of_reach(open_links, {**points, **found[0]})
    kept = [pose for pose in found if all(_has_sense(link, {**points, **pose}) for link in deciding)] or found
    first, *others = sorted(sorted(kept, key=_topmost(unknown, size)), key=_nearest(near, size))
    for link in deciding:
        _check(link, {**points, **first})
    poses.check_regular(unknown, first, open_links)
    return Assembly(first, tuple(sorted(others, key=_topmost(unknown, size))))


def carried_points(points: Mapping[str, Pair], links: Iterable[Any]) -> dict[str, Pair]:
    """Complete places with those of the points that links carry; ValueError if one that is given lies elsewhere."""
    found = dict(points)
    for link in links:
        if link.start not in found or link.end not in found:
            continue  # the link's own check names it
        for point, (x, y) in link.inner(found[link.start], found[link.end]).items():
            distance = hypot(found[point][0] - x, found[point][1] - y) if point in found else 0.0
            if distance > AGREE * abs(_vector(link, found)):
                right = f"link '{link.name}' carries it at ({x:.9g}, {y:.9g}) m; leave it out"
                raise ValueError(f"points['{point}'] = {short(found[point])} m: {right}")
            found[point] = (x, y)
    return found


# --- equations ----------------------------------------------------------------------------------------------------------


def _length(link: Any, points: Mapping[str, Pair]) -> float | None:
    """Return the length of a link, as given or from the places of its ends; None if it is unknown."""
    if link.length is not None or not {link.start, link.end} <= set(points):
        return link.length
    return abs(_vector(link, points))


def _vector(link: Any, points: Mapping[str, Pair]) -> complex:
    return complex(*points[link.end]) - complex(*points[link.start])


def _places(points: Mapping[str, Pair], unknown: list[str]) -> dict[str, Array]:
    """Return places x + i y as complex linear forms: coefficients of the unknown coordinates, then the constant."""
    at = {point: np.zeros(2 * len(unknown) + 1, dtype=complex) for point in (*unknown, *points)}
    for k, point in enumerate(unknown):
        at[point][2 * k : 2 * k + 2] = 1.0, 1j
    for point, place in points.items():
        at[point][-1] = complex(*place)
    return at


def _rows(at: Mapping[str, Array], links: list[Any], lengths: Mapping[str, float]) -> Iterator[Array]:
    """Yield the equations of links that are linear in the places, each a linear form that must vanish."""
    for link in links:
        if link.start not in at or link.end not in at:
            continue
        vector, equations = at[link.end] - at[link.start], []
        if link.angle is not None and link.length is not None:
            equation = vector.copy()
            equation[-1] -= rect(link.length, link.angle)
            equations.append(equation)
        elif link.angle is not None:
            yield (vector * rect(1.0, -link.angle)).imag
        if length := lengths.get(link.name):
            carried = link.carried_places(length).items()
            equations += [at[point] - at[link.start] - vector * complex(x, y) / length for point, (x, y) in carried]
        for each in equations:
            yield each.real
            yield each.imag


def _linear(rows: list[Array], count: int) -> tuple[Array, Array]:
    """Return a least-squares solution of the linear rows, and a basis of their null space, (count, open)."""
    if not rows:
        return np.zeros(count), np.eye(count)
    matrix = np.array(rows)
    u, values, vt = np.linalg.svd(matrix[:, :-1])
    rank = int((values > AGREE * max(1.0, values[0])).sum())
    base = vt[:rank].T @ (-(u.T @ matrix[:, -1])[:rank] / values[:rank])
    return base, vt[rank:].T


class _Poses:
    """Poses of the links whose length alone is given: solutions z of |M z + c| = L, M and c complex."""

    def __init__(self, ends: Array, lengths: Array, base: Array, free: Array) -> None:
        self.base, self.free, self.lengths = base, free, lengths
        self.matrix, self.constant = ends[:, :-1] @ free, ends[:, :-1] @ base + ends[:, -1]

    def residual(self, coordinates: Array) -> tuple[Array, Array]:
        """Compute (|v|^2 - L^2) / 2 L, v = M z + c [m], and its derivatives, for z of shape (starts, open)."""
        vectors = coordinates @ self.matrix.T + self.constant
        value = (np.abs(vectors) ** 2 - self.lengths**2) / (2 * self.lengths)
        return value, (vectors.conj()[..., None] * self.matrix).real / self.lengths[:, None]

    def check_decided(self, links: list[Any]) -> None:
        """Raise a ValueError if there are fewer equations than unknowns."""
        count = self.free.shape[1]
        slopes = self.residual(np.random.default_rng(1).normal(size=(1, count)))[1][0]
        ways = count - (int(np.linalg.matrix_rank(slopes)) if slopes.size else 0)
        if ways:
            example = f", as links.{links[0].name}.angle = '60 deg'" if links else ""
            more = "an angle" if ways == 1 else f"{ways} angles"
            left = "1 way" if ways == 1 else f"{ways} ways"
            raise ValueError(f"links: lengths and angles leave {left} open; give {more} more{example}, or places of points")

    def all(self, size: float) -> tuple[list[Array], bool]:
        """Return the coordinates of every pose found, and True; without any, of the one with the least gap, and False."""
        found: list[Array] = []
        random = np.random.default_rng(1)
        if not self.free.shape[1] or not len(self.lengths):
            return [self.base], True
        for _ in range(ROUNDS):
            z, gaps = self._descend(size * random.normal(size=(STARTS, self.free.shape[1])))
            poses = self.base + z @ self.free.T
            met = [x for x, gap in zip(poses, gaps, strict=True) if gap < 1e-12 * size]
            before = len(found)
            for x in met:
                if all(np.abs(x - other).max() > SAME_POSE * size for other in found):
                    found.append(x)
            if len(found) == before:
                return found or [poses[np.argmin(gaps)]], bool(found)
        return found, True

    def _descend(self, coordinates: Array) -> tuple[Array, Array]:
        """Iterate by Levenberg-Marquardt from all starts at once; return the ends and the largest residual of each [m]."""
        damping = np.full(len(coordinates), 1e-2)
        value, slopes = self.residual(coordinates)
        for _ in range(ITERATIONS):
            square = np.einsum("sqi,sqj->sij", slopes, slopes)
            square += (damping[:, None] + 1e-14)[..., None] * np.eye(coordinates.shape[1])
            right = np.einsum("sqi,sq->si", slopes, value)
            trial = coordinates - np.linalg.solve(square, right[..., None])[..., 0]
            new_value, new_slopes = self.residual(trial)
            better = (new_value**2).sum(axis=1) <= (value**2).sum(axis=1)
            coordinates = np.where(better[:, None], trial, coordinates)
            value, slopes = np.where(better[:, None], new_value, value), np.where(better[:, None, None], new_slopes, slopes)
            damping = np.where(better, damping / 10, damping * 10).clip(1e-15, 1e6)
            if (np.abs(value) < 1e-14 * self.lengths.max()).all():
                break
        return coordinates, np.abs(value).max(axis=1)

    def check_regular(self, unknown: list[str], pose: Mapping[str, Pair], links: list[Any]) -> None:
        """Raise a ValueError if a pose is a dead centre, where places are not differentiable in the lengths."""
        if not self.free.shape[1]:
            return
        x = np.concatenate([pose[point] for point in unknown])
        slopes = self.residual(((x - self.base) @ self.free)[None])[1][0]
        values = np.linalg.svd(slopes, compute_uv=False)
        if values[-1] < SINGULAR * values[0]:
            names = ", ".join(f"'{link.name}'" for link in links)
            raise ValueError(f"links {names}: are at a dead centre, in line; start from another angle, or give places of points")


# --- poses --------------------------------------------------------------------------------------------------------------


def _by_name(unknown: list[str], x: Array) -> dict[str, Pair]:
    return {point: (float(px), float(py)) for point, (px, py) in zip(unknown, x.reshape(-1, 2), strict=True)}


def _nearest(near: Mapping[str, Pair], size: float) -> Any:
    """Make a key that orders poses by the sum of squared distances from rough places; others keep their order."""
    step = SAME_POSE * size**2
    return lambda pose: round(sum((pose[p][0] - x) ** 2 + (pose[p][1] - y) ** 2 for p, (x, y) in near.items()) / step)


def _topmost(unknown: list[str], size: float) -> Any:
    """Make a key that orders poses: first the one whose first differing point is highest, then farthest right."""
    step = SAME_POSE * size
    return lambda pose: [-round(part / step) for point in unknown for part in reversed(pose[point])]


def _has_sense(link: Any, points: Mapping[str, Pair]) -> bool:
    """Return True if a link has the direction of its angle, not the opposite one."""
    return link.angle is None or (_vector(link, points) * rect(1.0, -link.angle)).real >= 0


def check_links(points: Mapping[str, Pair], links: Iterable[Any]) -> None:
    """Raise a ValueError if the places of a link's ends contradict its length or angle."""
    for link in links:
        if {link.start, link.end} <= set(points):
            _check(link, points)


def _out_of_reach(links: list[Any], points: Mapping[str, Pair]) -> ValueError:
    """Make the error for lengths that no pose has, from the pose with the least gap."""
    best = {link.name: abs(_vector(link, points)) for link in links}
    wrong = [link for link in links if abs(best[link.name] - link.length) > 1e-3 * link.length] or links
    each = ", ".join(f"'{link.name}' {best[link.name]:.4g} m for {link.length:.4g} m" for link in wrong)
    return ValueError(f"links: out of reach, no pose has these lengths; at best {each}; a plain number is in m")


def _check(link: Any, points: Mapping[str, Pair]) -> None:
    vector, where = _vector(link, points), f"'{link.start}' and '{link.end}'"
    if link.length is not None and abs(abs(vector) - link.length) > AGREE * link.length:
        why = f"{where} are {abs(vector):.9g} m apart"
        raise RefusalError(f"length of link '{link.name}' = {link.length:.9g} m: {why}", f"links.{link.name}")
    if link.angle is not None:
        across = (vector * rect(1.0, -link.angle)).imag
        if abs(across) > AGREE * abs(vector) or not _has_sense(link, points):
            why = f"{where} lie in the direction of {phase(vector):.9g} rad"
            raise RefusalError(f"angle of link '{link.name}' = {link.angle:.9g} rad: {why}", f"links.{link.name}")
