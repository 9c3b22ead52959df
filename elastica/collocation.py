"""Chebyshev collocation in two pieces that meet at a point load, and Newton's method, for `strip`.

The error falls geometrically with the number of points. Rounding stays at 1e-15, as there are integration matrices only, no
differentiation matrices.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
Angle = Callable[[Array], Array]
"""Stress-free tangent angle, rad, of an array of stress-free arc lengths over L, 0 to 1."""


class RodError(RuntimeError):
    """No equilibrium was found, or another one than the buckled one."""


class NewtonDivergedError(RodError):
    """Newton's iteration did not converge."""


class Grid(NamedTuple):
    """Collocation points s of both pieces, matrix J that integrates from 0, stress-free angle; 1 beyond the load, else 0."""

    s: Array
    J: Array
    angle: Array
    beyond: Array


class Fields(NamedTuple):
    """Fields along a strip: sin and cos of theta, nx, ny, x', y', the moment, and the rotation of the start."""

    sin: Array
    cos: Array
    nx: Array
    ny: Array
    dx: Array
    dy: Array
    m: Array
    phi: float


@cache
def integration(nodes: int) -> tuple[Array, Array]:
    """Return two or more Chebyshev-Lobatto points on [0, 1], and the matrix that integrates from 0 to each of them."""
    points = -np.cos(pi * np.arange(nodes) / (nodes - 1))
    primitives = chebyshev.chebint(np.eye(nodes), lbnd=-1, axis=0)
    to_coefficients = np.linalg.inv(chebyshev.chebvander(points, nodes - 1))
    J = chebyshev.chebvander(points, nodes) @ primitives @ to_coefficients / 2.0
    return (points + 1.0) / 2.0, J


def two_pieces(at: float, nodes: int, angle: Angle | None) -> Grid:
    """Return the grid of a strip with its point load at arc length `at` over L and `nodes` points in each piece."""
    unit, J = integration(nodes)
    left, right = at, 1.0 - at
    s = np.concatenate((left * unit, left + right * unit))
    s[-1] = 1.0
    whole = np.zeros((2 * nodes, 2 * nodes))
    whole[:nodes, :nodes], whole[nodes:, nodes:], whole[nodes:, :nodes] = left * J, right * J, left * J[-1]
    angles = np.zeros_like(s) if angle is None else np.asarray(angle(s), dtype=float)
    return Grid(s, whole, angles, np.repeat((0.0, 1.0), nodes))


def newton(step: Callable[[Array], Array], unknowns: Array) -> Array:
    """Subtract steps until one is below 1e-9, so that the next would be below rounding.

    Raises
    ------
    NewtonDivergedError
        If 25 steps were not enough, a matrix was singular, or a step was above 1e3.
    """
    scale = np.ones_like(unknowns)
    for _ in range(25):
        try:
            change = step(unknowns)
        except np.linalg.LinAlgError as error:
            raise NewtonDivergedError("the equations are singular here: a branching, or a strip that can move freely") from error
        size = float(np.max(np.abs(change) / np.maximum(scale, np.abs(unknowns))))
        unknowns = unknowns - change
        if not size < 1e3:
            break
        if size <= 1e-9:
            return unknowns
    raise NewtonDivergedError(f"the last Newton step was still {size:.1e}")


def resample(values: Array, nodes: int) -> Array:
    """Interpolate values at Chebyshev-Lobatto points to a larger number of such points."""
    coarse = 2.0 * integration(values.size)[0] - 1.0
    coefficients = np.linalg.solve(chebyshev.chebvander(coarse, values.size - 1), values)
    return chebyshev.chebval(2.0 * integration(nodes)[0] - 1.0, coefficients)


def require(name: str, value: object, valid: bool, allowed: str) -> None:
    """Raise a ValueError with name, value and allowed values.

    Raises
    ------
    ValueError
        If the value is not valid.
    """
    if not valid:
        raise ValueError(f"{name} = {value} must be {allowed}")
