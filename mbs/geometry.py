"""Plane vectors as arrays, x and y along their last axis, and the times at which contacts begin and end."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

Array = np.ndarray[Any, Any]
"""Array of any shape and type."""


def rotate(angle: Array, vectors: ArrayLike) -> Array:
    """Rotate vectors (..., 2), or one vector (2,), by angles [rad] of shape (...)."""
    c, s, (x, y) = np.cos(angle), np.sin(angle), np.moveaxis(np.asarray(vectors), -1, 0)
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def rotate_left(vectors: Array) -> Array:
    """Rotate vectors (..., 2) by a quarter turn to the left."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def cross(a: Array, b: Array) -> Array:
    """Compute cross products of vectors (..., 2): the moments of forces b at arms a."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def unit(vectors: Array) -> tuple[Array, Array]:
    """Return lengths (times,) and directions (times, 2) of vectors; a vector of length zero has the direction zero."""
    size = np.hypot(*vectors.T)
    return size, vectors / np.where(size > 0, size, 1.0)[:, None]


def find_sign_changes(time: Array, depth: Array, rate: Array) -> Array:
    """Find the times [s] at which a contact begins or ends, by bisection of the cubic Hermite polynomials of depth and rate."""
    k = np.flatnonzero((depth[:-1] > 0) != (depth[1:] > 0))
    step, start, end = time[k + 1] - time[k], depth[k], depth[k + 1]
    linear, end_slope = step * rate[k], step * rate[k + 1]
    square, cubic = 3 * (end - start) - 2 * linear - end_slope, linear + end_slope - 2 * (end - start)
    low, high = np.zeros(len(k)), np.ones(len(k))
    for _ in range(52):  # each halves the interval: the number of binary digits of a float
        s = (low + high) / 2  # time in the step, 0 to 1
        same = (start + s * (linear + s * (square + s * cubic)) > 0) == (start > 0)
        low, high = np.where(same, s, low), np.where(same, high, s)
    return np.asarray(time[k] + step * high)
