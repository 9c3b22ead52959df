"""Parameters of a chain fitted to measured segments, each of whose starts is free; how far off, and what it predicts of others.

Standard errors are those of blocks of time: what a model leaves is no noise, neighbours in time err alike, and the usual
covariance would be far too small (sandwich of block sums; H. White, doi 10.2307/1912934).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from buckler.mbs.geometry import Array
from buckler.studies.measured.chain import LEAST, Chain

CHANGE = 1e-3
"""Of a parameter for its derivative, in its scale."""
START = np.array([0.01, 0.1])
"""Scales of a start's angle, rad, and speed, rad/s."""


class Data(NamedTuple):
    """Segments of equal length: angles and speeds, (segments, times, arms), and the step, s."""

    angle: Array
    speed: Array
    step: float

    @property
    def scatter(self) -> float:
        """Of a measured angle, rad: third differences of neighbours, in which a smooth motion cancels."""
        third = np.diff(self.angle, 3, axis=1)
        return float(np.sqrt(np.mean(third**2) / 20))

    def some(self, which: Array | slice, times: int | None = None) -> Data:
        """Some segments, or their first samples."""
        return Data(self.angle[which, :times], self.speed[which, :times], self.step)


class Fit(NamedTuple):
    """What a fit found.

    Attributes
    ----------
    chain : Chain
    errors : dict of float
        Standard errors of the parameters, by name.
    starts : array, shape (segments, 2, arms)
    residual : float
        Root mean square of what is left, rad.
    """

    chain: Chain
    errors: dict[str, float]
    starts: Array
    residual: float


def fitted(chain: Chain, data: Data, free: Sequence[str], blocks: int = 1, starts: Array | None = None) -> Fit:
    """Fit parameters and starts by least squares; frictions stay at least 0.

    Parameters
    ----------
    free : sequence of str
        Names of the parameters.
    blocks : int
        Pieces of a segment that are taken to err apart.
    starts : array, optional
        First values, shape (segments, 2, arms); else the first samples.
    """
    places = [chain.names.index(name) for name in free]
    count, _, arms = data.angle.shape
    begin = np.stack([data.angle[:, 0], data.speed[:, 0]], 1) if starts is None else starts
    scales = np.concatenate([chain.scales[places], np.tile(np.repeat(START, arms), count)])
    low = [LEAST.get(name[0], -np.inf) for name in free] + [-np.inf] * begin.size
    kept: dict[bytes, tuple[Array, Array]] = {}

    def left(x: Array) -> tuple[Array, Array]:
        if x.tobytes() not in kept:
            kept.clear()
            kept[x.tobytes()] = _residuals(chain, data, places, x)
        return kept[x.tobytes()]

    inner = np.maximum(np.concatenate([chain.vector[places], begin.ravel()]), np.array(low) + 1e-3 * scales)
    found = least_squares(
        lambda x: left(x)[0], inner, jac=lambda x: left(x)[1], bounds=(low, np.inf), x_scale=scales, ftol=1e-7, max_nfev=40
    )
    vector = chain.vector
    vector[places] = found.x[: len(places)]
    errors = dict(zip(free, _errors(found.jac, found.fun, count, blocks, len(places)), strict=True))
    return Fit(chain.of(vector), errors, found.x[len(places) :].reshape(count, 2, arms), float(np.sqrt(np.mean(found.fun**2))))


def _residuals(chain: Chain, data: Data, places: Sequence[int], x: Array) -> tuple[Array, Array]:
    """Angles less the measured ones, and their derivatives by differences; all runs side by side."""
    count, times, arms = data.angle.shape
    vector = chain.vector
    vector[places] = x[: len(places)]
    starts = x[len(places) :].reshape(count, 2 * arms)
    n = 1 + len(places) + 2 * arms
    vectors = np.tile(vector, (n, count, 1))
    begin = np.tile(starts, (n, 1, 1))
    steps = np.concatenate([chain.scales[places], np.repeat(START, arms)]) * CHANGE
    for i, place in enumerate(places):
        vectors[1 + i, :, place] += steps[i]
    for j in range(2 * arms):
        begin[1 + len(places) + j, :, j] += steps[len(places) + j]
    runs = chain.moved(vectors, begin[..., :arms], begin[..., arms:], times, data.step)  # (times, n, segments, arms)
    runs = np.moveaxis(runs, 0, 2)  # (n, segments, times, arms)
    slopes = (runs[1:] - runs[0]) / steps[:, None, None, None]
    jacobian = np.zeros((*data.angle.shape, x.size))
    jacobian[..., : len(places)] = np.moveaxis(slopes[: len(places)], 0, -1)
    for segment in range(count):
        own = len(places) + segment * 2 * arms
        jacobian[segment, ..., own : own + 2 * arms] = np.moveaxis(slopes[len(places) :, segment], 0, -1)
    return (runs[0] - data.angle).ravel(), jacobian.reshape(-1, x.size)


def _errors(jacobian: Array, left: Array, count: int, blocks: int, parameters: int) -> Array:
    """Standard errors of the parameters, the sums of blocks of each segment taken to be independent."""
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    size = left.size // count
    edges = np.linspace(0, size, blocks + 1).astype(int)
    pieces = [slice(s * size + a, s * size + b) for s in range(count) for a, b in pairwise(edges)]
    sums = np.array([jacobian[piece].T @ left[piece] for piece in pieces])
    n = len(pieces)
    spread = bread @ (sums.T @ sums * n / max(1, n - parameters)) @ bread
    return np.asarray(np.sqrt(np.diag(spread)[:parameters]))


def predicted(chain: Chain, data: Data) -> Array:
    """Angles of each segment from its first sample alone, (segments, times, arms)."""
    vectors = np.tile(chain.vector, (len(data.angle), 1))
    return np.moveaxis(chain.moved(vectors, data.angle[:, 0], data.speed[:, 0], data.angle.shape[1], data.step), 0, 1)


def apart(angle: Array, data: Data) -> float:
    """Root mean square of the distance from the measured angles, rad."""
    return float(np.sqrt(np.mean((angle - data.angle) ** 2)))
