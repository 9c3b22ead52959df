"""Small motions about a state: eigenvalues of its whole tangent, each with the error that rounding leaves in it.

Solutions z exp(s t) of M z'' + C z' + K z + (G - X)^T l = 0, G z = 0. Neither K nor C need be symmetric: forces that follow the
motion make K unsymmetric, a steady turn adds the gyroscopic part to C. A state is unstable where an s has a positive real part.

Eigenvalues are those of the inverse at a shift near the lowest ones: of M, K themselves, the lowest ones of a thin strip drown in
the rounding of the highest. An eigenvalue s with vectors z, y moves by |y|^T (|s^2 M| + |s C| + |K|) |z| / |y^H (2 s M + C) z|
relative to the rounding of the matrices' entries; what is not larger than that is told as zero.

Of a large tangent without damping, sparse matrices and Lanczos's method give the lowest eigenvalues and those below zero. A
factorisation K + c M = L D L^T has as many negative pivots as there are eigenvalues -s^2 below -c (Sylvester's law of inertia):
that tells how many grow, and that none is missing.

References
----------
T. Ericsson, A. Ruhe, The spectral transformation Lanczos method, Math. Comp. 35 (1980) 1251-1268,
doi 10.1090/S0025-5718-1980-0583502-2.
F. Tisseur, K. Meerbergen, The quadratic eigenvalue problem, SIAM Review 43 (2001) 235-286, doi 10.1137/S0036144500381988.
V. V. Bolotin, Nonconservative Problems of the Theory of Elastic Stability (1963), ch. 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.linalg import solve  # SciPy's triangular solves take twenty times as long where threads share a core
from scipy.linalg import eig, eigh
from scipy.sparse import block_diag, csc_array, csr_array, diags_array, eye_array, issparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu

from buckler.mbs.geometry import Array

EPS = float(np.finfo(float).eps)
ROUNDING = 16 * EPS
"""Relative error of a matrix entry that is a sum of some dozen products."""

UNKNOWN = 1e-4
"""Relative error of -s^2 beyond which it is sought again."""
LARGE = 220
"""Unknowns from which on matrices are sparse: there both ways take as long."""
MANY = 300
"""Coordinates from which on the lowest eigenvalues of sparse matrices are found alone."""
COUNT = 20
"""How many of them, where nothing else is asked."""
SPARE = 8
"""How many more are sought than are asked for."""
BLOCK = 8
"""Vectors of a step of Lanczos's method."""
CONVERGED = 1e-8
"""Residual of an inverse's eigenvector, over its eigenvalue."""


@dataclass(frozen=True)
class Tangent:
    """The equations of small motions on what the constraints leave free, z = free x.

    Attributes
    ----------
    mass, damping, stiffness : arrays, shape (n, n)
        On all coordinates; sparse where there are many.
    free : array, shape (n, f)
        Spans the motions that the constraints allow, each coordinate in its unit.
    test : array, shape (n, f)
        Spans what the constraints' forces do no work on: the same, but for friction that follows these forces.
    summands : array, shape (n, n)
        How large those of K's entries are: across a strip it is next to nothing, a sum of what is large along it.
    """

    mass: Any
    damping: Any
    stiffness: Any
    free: Any
    test: Any
    summands: Any

    @classmethod
    def at(cls, scene: Any, q: Array, lam: Array, v: Array | None = None) -> Tangent:
        """Of a scene at coordinates q, multipliers lam and rates v (zero by default)."""
        sparse = len(q) >= MANY
        a = scene.assemble(q, v, lam=lam, sparse=sparse)
        if sparse and (_any(a.cross) or _any(a.damping) or not _symmetric(a.stiffness)):  # Lanczos's method is for symmetric ones
            sparse, a = False, scene.assemble(q, v, lam=lam)
        span = sparse_null_space if sparse else null_space
        free = span(a.jacobian, scene.units)
        test = span(a.jacobian - a.cross, scene.units) if _any(a.cross) else free
        large = abs(a.stiffness).diagonal().copy()
        for x, y in scene.twins:
            large[x] = large[y] = np.maximum(large[x], large[y])
        summands = abs(a.stiffness) + (diags_array(large) if sparse else np.diag(large))
        return cls(scene.mass_at(q, sparse), a.damping, a.stiffness, free, test, summands)

    def rounding(self, left: Array, right: Array) -> Array:
        """What rounding of K leaves in its products with vectors of what is free, (f, m)."""
        return ROUNDING * np.einsum("ij,ij->j", np.abs(self.test @ left), self.summands @ np.abs(self.free @ right))

    @property
    def conservative(self) -> bool:
        """Whether K alone decides stability: it is symmetric, and nothing but damping, if any, depends on rates."""
        k, c = self.reduced(self.stiffness), self.reduced(self.damping)
        both = _symmetric(k) and _symmetric(c)
        return both and not (_any(c) and np.linalg.eigvalsh(c).min() < -1e3 * EPS * np.abs(c).max())

    def undamped(self) -> Tangent:
        """The same without what depends on rates."""
        return replace(self, damping=0.0 * self.damping)

    def reduced(self, matrix: Any) -> Any:
        """A matrix on what is free."""
        return self.test.T @ matrix @ self.free


@dataclass(frozen=True)
class Spectrum:
    """Eigenvalues of a tangent, lowest first; what decays without swinging comes last.

    Attributes
    ----------
    values : array of complex, shape (m,)
        s, 1/s, of the upper half-plane; of s and -s, where nothing damps, the one that grows.
    shapes : array of complex, shape (n, m)
    rounding : array, shape (m,)
        Error of the values by rounding, 1/s.
    shift : float
        -s^2 about which they were found, 1/s^2.
    """

    values: Array
    shapes: Array
    rounding: Array
    shift: float = 0.0

    @property
    def neutral(self) -> Array:
        """Which are zero within rounding: rigid motions, and states at which stability is lost.

        What lies above the shift is not zero, however little is known of it.
        """
        size = np.abs(self.values)
        return (size <= self.rounding) & (size**2 <= self.shift)

    @property
    def growth(self) -> Array:
        """Real parts, 1/s, zero where they are within rounding."""
        real = self.values.real
        return np.where(np.abs(real) > self.rounding, real, 0.0)

    @property
    def unstable(self) -> int:
        """How many small motions grow."""
        return int((self.growth > 0.0).sum())

    @property
    def stable(self) -> bool:
        """Whether none grows."""
        return not self.unstable


def spectrum(tangent: Tangent, near: float = 0.0, count: int = COUNT) -> Spectrum:
    """All eigenvalues of a tangent; `near`, the shift of a state nearby, spares the search for one.

    Of one with sparse matrices at least the `count` lowest values of -s^2, and all that are below zero.
    """
    m, c, k = (tangent.reduced(x) for x in (tangent.mass, tangent.damping, tangent.stiffness))
    if not m.shape[0]:
        return Spectrum(np.empty(0, complex), np.empty((tangent.mass.shape[0], 0), complex), np.empty(0))
    values, left, right, inverse, shift = _damped(tangent, m, c, k) if _any(c) else _undamped(tangent, m, k, near, count)
    rounding = np.maximum(inverse, _rounding(tangent, values, tangent.test @ left, tangent.free @ right))
    creeps = (values.imag == 0.0) & (values.real < -rounding)  # a damped strip has no end of them near -1/(retardation time)
    order = np.lexsort((np.abs(values), creeps))
    return Spectrum(values[order], (tangent.free @ right)[:, order], rounding[order], shift)


def squares(tangent: Tangent, shift: float, count: int) -> Array:
    """-s^2 of a tangent without what depends on rates, by their real parts, from the inverse about a shift: no vectors.

    Of one with sparse matrices at least the `count` lowest.
    """
    m, k = tangent.reduced(tangent.mass), tangent.reduced(tangent.stiffness)
    if issparse(k):
        return np.sort(_nearest(m, k, shift, count)[0])
    if not _symmetric(k):
        return np.sort((_turned_over(np.linalg.eigvals(solve(k + shift * m, m))) - shift).real)
    low = np.linalg.cholesky((m + m.T) / 2)
    inner = low.T @ solve((k + k.T) / 2 + shift * m, low)
    return np.sort(_turned_over(np.linalg.eigvalsh((inner + inner.T) / 2)) - shift)


def _rounding(tangent: Tangent, values: Array, left: Array, right: Array) -> Array:
    """What rounding leaves in each eigenvalue; the root of it where a value is double and has one vector, as zero is."""
    size = np.abs(values)
    total, lever = np.zeros(len(values)), np.zeros(len(values), complex)
    bend = np.abs(np.einsum("ij,ij->j", left.conj(), tangent.mass @ right))
    for power, matrix in enumerate((tangent.summands, tangent.damping, tangent.mass)):
        total += size**power * np.einsum("ij,ij->j", np.abs(left), abs(matrix) @ np.abs(right))
        if power:
            lever += power * values ** (power - 1) * np.einsum("ij,ij->j", left.conj(), matrix @ right)
    moved = ROUNDING * total
    with np.errstate(all="ignore"):
        return np.minimum(moved / np.maximum(np.abs(lever), 1e-300), np.sqrt(moved / np.maximum(bend, 1e-300)))


def _undamped(tangent: Tangent, m: Any, k: Any, near: float, count: int) -> tuple[Array, Array, Array, Array, float]:
    """Of s^2 M z + K z = 0: s, left and right vectors, errors of s; of s and -s one, see `Spectrum`."""
    symmetric = _symmetric(k)
    k, m, shift = (k + k.T) / 2 if symmetric else k, (m + m.T) / 2, near or _shift(m, k)
    find = partial(_nearest, count=count) if issparse(k) else _inverted if symmetric else _unsymmetric
    for _ in range(4):
        squared, left, right = find(m, k, shift)
        lowest = _lowest(tangent, m, squared, left, right, shift)
        apart = float(np.abs(squared + shift).min())
        if lowest <= 1e2 * shift and (apart >= 0.2 * shift if near else lowest >= 1.5 * shift):
            break
        shift = 0.6 * shift if near and apart < 0.2 * shift else 0.5 * lowest  # no eigenvalue is between that and zero
    moved = _by_inverse(
        1.0 / np.where(squared == -shift, EPS, squared + shift), np.einsum("ij,ij->j", left.conj(), m @ right), left, m @ right
    )
    if symmetric:
        squared, moved, right = _by_quotient(m, k, right, squared, moved)
        left = right
    values = np.sqrt(-np.asarray(squared, dtype=complex))
    values = np.where(values.imag < 0.0, -values, values)
    if symmetric:
        values = np.where(squared > 0.0, 1j * values.imag, values.real)
    return values, left, right, np.minimum(moved / (2 * np.abs(values) + 1e-300), np.sqrt(moved)), shift


def _by_quotient(m: Any, k: Any, vectors: Array, squared: Array, moved: Array) -> tuple[Array, Array, Array]:
    """Rayleigh's quotients, with the residual's norm as their error, where that is less: for the high ones.

    Those that the inverse does not know, far above its shift, come from M and K themselves.
    """
    inner = splu(csc_array(m)).solve if issparse(m) else partial(solve, m)
    for plain in (False, True):
        if plain:
            if issparse(k) or (moved <= UNKNOWN * np.abs(squared)).all():
                break
            order = np.argsort(squared)
            squared, moved, vectors = squared[order], moved[order], vectors[:, order]
        tried = eigh(k, m)[1] if plain else vectors
        quotient = np.einsum("ij,ij->j", tried, k @ tried)
        residual = k @ tried - m @ tried * quotient
        error = np.sqrt(np.abs(np.einsum("ij,ij->j", residual, inner(residual))))
        better = error < moved
        squared, moved = np.where(better, quotient, squared), np.where(better, error, moved)
        vectors = np.where(better, tried, vectors)
    return squared, moved, vectors


def _by_inverse(theta: Array, product: Array, left: Array, right: Array) -> Array:
    """Errors of 1/theta, eigenvalues of an inverse that is known to the rounding of its largest."""
    condition = np.linalg.norm(left, axis=0) * np.linalg.norm(right, axis=0) / np.maximum(np.abs(product), 1e-300)
    with np.errstate(all="ignore"):
        return np.asarray(ROUNDING * np.abs(theta).max() * condition / np.abs(theta) ** 2)


def _lowest(tangent: Tangent, m: Any, squared: Array, left: Array, right: Array, shift: float) -> float:
    """The smallest |s^2| that is not rounding; the shift where all are."""
    weight = np.abs(np.einsum("ij,ij->j", left.conj(), m @ right))
    moved, size = tangent.rounding(left, right), np.abs(squared)
    with np.errstate(all="ignore"):
        return float(min(size[(size * weight > moved) & np.isfinite(size)], default=shift))


def _unsymmetric(m: Array, k: Array, shift: float) -> tuple[Array, Array, Array]:
    """-s^2, left and right vectors, from the inverse of K + shift M."""
    theta, left, right = eig(solve(k + shift * m, m), left=True)
    return _turned_over(theta) - shift, solve((k + shift * m).T, left), right


def _turned_over(theta: Array) -> Array:
    """1/theta; finite, far above all that is known, where theta is rounding."""
    least = EPS**2 * np.abs(theta).max(initial=1e-300)
    return np.asarray(1.0 / np.where(np.abs(theta) < least, least, theta))


def _inverted(m: Array, k: Array, shift: float) -> tuple[Array, Array, Array]:
    """The same of a symmetric K."""
    moved = k + shift * m
    try:
        root = np.linalg.cholesky(moved)
        inner = solve(root, solve(root, m).T)
        theta, vectors = eigh((inner + inner.T) / 2)
        vectors = solve(root.T, vectors)
    except np.linalg.LinAlgError:  # more unstable than the shift
        low = np.linalg.cholesky(m)
        inner = low.T @ solve(moved, low)
        theta, vectors = eigh((inner + inner.T) / 2)
        vectors = solve(moved, low @ vectors)
    squared = _turned_over(theta) - shift
    vectors = vectors / np.sqrt(np.abs(np.einsum("ij,ij->j", vectors, m @ vectors)))
    return squared, vectors, vectors


def _nearest(m: csr_array, k: csr_array, shift: float, count: int) -> tuple[Array, Array, Array]:
    """At least so many of the lowest -s^2 of sparse symmetric matrices, and all below the shift's negative; vectors."""
    size = m.shape[0]
    while 4 * (count + SPARE) < size:
        try:
            factors, below = _factors(m, k, -shift)
            squared, vectors = _krylov(m, factors, shift, below, count + SPARE)
            ends = np.arange(below + count, len(squared))
            kept = int(ends[np.argmax(squared[ends] - squared[ends - 1])])
            if _factors(m, k, 0.5 * (squared[kept - 1] + squared[kept]))[1] == kept:
                return squared[:kept], vectors[:, :kept], vectors[:, :kept]
        except ArithmeticError:
            break
        count *= 2
    return _inverted(m.toarray(), k.toarray(), shift)


def _krylov(m: csr_array, factors: SuperLU, shift: float, below: int, above: int) -> tuple[Array, Array]:
    """The -s^2 nearest to the negative of a shift, ascending, so many on each side, and vectors, by Lanczos's method in blocks.

    Whole blocks find eigenvalues that are equal; all vectors are kept and made orthogonal.

    Raises
    ------
    ArithmeticError
        If half as many vectors as there are coordinates do not do.
    """
    size = m.shape[0]
    room = size // 2 // BLOCK * BLOCK
    basis, images, projected, known = np.empty((size, room)), np.empty((size, room)), np.empty((room, room)), 0
    block = factors.solve(m @ np.random.default_rng(0).standard_normal((size, BLOCK)))
    while known < room:
        new, done = slice(known, known + BLOCK), slice(known)
        for _ in range(2):
            block = block - basis[:, done] @ (basis[:, done].T @ (m @ block))
            block = np.linalg.qr(block)[0]  # columns may be as good as equal
            block = np.linalg.solve(np.linalg.cholesky(block.T @ (m @ block)), block.T).T
        basis[:, new], block = block, factors.solve(m @ block)
        known += BLOCK
        images[:, new] = block
        projected[:known, new] = basis[:, :known].T @ (m @ block)
        projected[new, :known] = projected[:known, new].T
        if known < 2 * (below + above) or (known // BLOCK) % 4:
            continue
        theta, mix = eigh(projected[:known, :known])
        near = np.r_[0:below, known - above : known]
        theta, vectors = theta[near], basis[:, :known] @ mix[:, near]
        miss = images[:, :known] @ mix[:, near] - vectors * theta
        least = np.maximum(CONVERGED * np.abs(theta), 1e2 * EPS * np.abs(theta).max())
        if (np.einsum("ij,ij->j", miss, m @ miss) <= least**2).all():
            order = np.argsort(squared := _turned_over(theta) - shift)
            return squared[order], vectors[:, order]
    raise ArithmeticError("too many vectors")


def _factors(m: csr_array, k: csr_array, value: float) -> tuple[SuperLU, int]:
    """Factors of K - value M, and how many eigenvalues are below the value: as many as pivots on the diagonal are negative."""
    moved = csc_array(k - value * m)
    factors = splu(moved, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    if (factors.perm_r != factors.perm_c).any():
        raise ArithmeticError("a pivot on the diagonal is zero")
    return factors, int((factors.U.diagonal() < 0.0).sum())


def _any(matrix: Any) -> bool:
    """Whether an entry is not zero."""
    return bool(matrix.count_nonzero() if issparse(matrix) else matrix.any())


def _symmetric(matrix: Any) -> bool:
    """Whether a matrix is symmetric within rounding."""
    return bool(not min(matrix.shape) or abs(matrix - matrix.T).max() <= 1e3 * EPS * abs(matrix).max())


def _damped(tangent: Tangent, m: Array, c: Array, k: Array) -> tuple[Array, Array, Array, Array, float]:
    """Of s^2 M z + s C z + K z = 0, by the inverse at a positive real shift: s of the upper half-plane, vectors, errors."""
    n, shift = len(m), float(np.sqrt(_shift(m, k)))
    for _ in range(3):
        across = solve(k + shift * c + shift**2 * m, np.hstack([-(c + shift * m), -shift * m]))
        below = across.copy()  # of the rates over the shift: both halves of the state in one unit
        below[:, :n] += np.eye(n) / shift
        theta, left, right = eig(np.vstack([across, below]), left=True)
        values = shift + _turned_over(theta)
        kept = values.imag >= 0.0
        moved = _by_inverse(theta, np.einsum("ij,ij->j", left.conj(), right), left, right)[kept]
        values, left, right = values[kept], solve(m, left[n:, kept]), right[:n, kept]
        lowest = np.sqrt(_lowest(tangent, m, np.abs(values) ** 2, left, right, shift**2))
        if 1.5 * shift <= lowest <= 10.0 * shift:
            break
        shift = 0.5 * lowest
    return values, left, right, moved, shift**2


def _shift(m: Any, k: Any) -> float:
    """A shift of -s^2 where the lowest eigenvalues are not rounding of the highest."""
    highest = float(np.max(np.abs(k.diagonal()) / m.diagonal()))
    return max(1e3 * EPS * highest, 1e-12)


def null_space(jacobian: Array, units: Array) -> Array:
    """Columns that span the z with G z = 0, each coordinate in its unit."""
    if not len(jacobian):
        return np.diag(units)
    _, s, vh = np.linalg.svd(jacobian * units)
    rank = int((s > 1e-10 * s[0]).sum())
    return np.asarray(units[:, None] * vh[rank:].T)


def sparse_null_space(jacobian: csr_array, units: Array) -> csr_array:
    """The same of a sparse G, sparse: rows that hold no coordinate in common are looked at apart."""
    scaled = csr_array(jacobian * units)
    held = np.unique(scaled.indices)
    rows, at = scaled[:, held], np.setdiff1d(np.arange(len(units)), held)
    _, group = connected_components(rows.T @ rows, directed=False)
    order = np.argsort(group, kind="stable")
    spans: list[Any] = [eye_array(len(at))]
    for one in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        some = rows[:, one].toarray()
        spans.append(null_space(some[some.any(axis=1)], np.ones(len(one))))
    places = np.concatenate([at, held[order]])
    return csr_array(units[:, None] * csr_array(block_diag(spans))[np.argsort(places)])
