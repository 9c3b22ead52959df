"""Chebyshev collocation on two pieces of a strip that meet at a point load, and Newton's method, for `strip`.

The error falls geometrically with the number of points. Integration matrices alone are used: they keep rounding at 1e-15,
which differentiation matrices would not.
"""

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
    """No equilibrium of a strip was found, or not the one that was sought, e.g. the straight one."""


class NewtonDivergedError(RodError):
    """Newton's iteration did not converge."""


class CollocationGrid(NamedTuple):
    """Collocation points of both pieces, in one array of shape (2 nodes,); the point of the load occurs twice.

    `s` is the stress-free arc length over L, `angle` the stress-free tangent angle [rad]. `J @ f` is the integral of f from s = 0
    to each point. `beyond` is 1 at the points beyond the load, which are those of the second piece, and 0 at the others.
    """

    s: Array
    J: Array
    angle: Array
    beyond: Array

    def integrate(self, values: Array) -> Array:
        """Integrate values (..., 2 nodes) from s = 0 to each point; of complex ones in two parts, whose products are quicker."""
        if np.iscomplexobj(values):
            return self.integrate(values.real) + 1j * self.integrate(values.imag)
        return values @ self.J.T


class Fields(NamedTuple):
    """Fields at the collocation points, (..., 2 nodes), normalised by length L and bending stiffness E I of the strip.

    (nx, ny) [E I/L^2] is the force of the part beyond s on the part before it, m [E I/L] the bending moment. `x_prime` and
    `y_prime` are the derivatives of the centreline by s, equations (1) and (2) of `strip`. `phi` (..., 1) is the rotation of the
    section at s = 0 from its stress-free direction [rad].
    """

    nx: Array
    ny: Array
    x_prime: Array
    y_prime: Array
    m: Array
    phi: Array


@cache
def integration(nodes: int) -> tuple[Array, Array]:
    """Return Chebyshev-Lobatto points on [0, 1], at least two, and the matrix that integrates from 0 to each of them."""
    points = -np.cos(pi * np.arange(nodes) / (nodes - 1))
    primitives = chebyshev.chebint(np.eye(nodes), lbnd=-1, axis=0)
    to_coefficients = np.linalg.inv(chebyshev.chebvander(points, nodes - 1))
    # values to coefficients, to those of the primitive, to its values; 1/2 from [-1, 1] to [0, 1]
    J = chebyshev.chebvander(points, nodes) @ primitives @ to_coefficients / 2.0
    return (points + 1.0) / 2.0, J


def make_grid(load_point: float, nodes: int, angle: Angle | None) -> CollocationGrid:
    """Return the grid of a strip with a point load at an arc length over L and `nodes` points in each piece."""
    unit, J = integration(nodes)
    left, right = load_point, 1.0 - load_point
    s = np.concatenate((left * unit, left + right * unit))
    s[-1] = 1.0
    both = np.zeros((2 * nodes, 2 * nodes))
    both[:nodes, :nodes], both[nodes:, nodes:] = left * J, right * J
    both[nodes:, :nodes] = left * J[-1]  # integral over the whole first piece
    angles = np.zeros_like(s) if angle is None else np.asarray(angle(s), dtype=float)
    return CollocationGrid(s, both, angles, np.repeat((0.0, 1.0), nodes))


def newton(step: Callable[[Array], Array], unknowns: Array) -> Array:
    """Subtract Newton steps until one is below 1e-9: steps shrink quadratically, so the next would be below rounding.

    The size of a step is the largest change, relative to unknowns above 1. After 25 steps, a step above 1e3 (both chosen) or a
    singular matrix it raises a NewtonDivergedError.
    """
    for _ in range(25):
        try:
            change = step(unknowns)
        except np.linalg.LinAlgError as error:
            raise NewtonDivergedError("the equations are singular here: a branching, or a strip that can move freely") from error
        size = float(np.max(np.abs(change) / np.maximum(1.0, np.abs(unknowns))))
        unknowns = unknowns - change
        if not size < 1e3:
            break
        if size <= 1e-9:
            return unknowns
    raise NewtonDivergedError(f"the last Newton step was still {size:.1e}")


def resample(values: Array, nodes: int) -> Array:
    """Interpolate values at Chebyshev-Lobatto points to a larger number of such points."""
    (coarse, _), (fine, _) = integration(values.size), integration(nodes)
    coefficients = np.linalg.solve(chebyshev.chebvander(2.0 * coarse - 1.0, values.size - 1), values)
    return chebyshev.chebval(2.0 * fine - 1.0, coefficients)


def require(name: str, value: object, valid: bool, allowed: str) -> None:
    """Raise a ValueError with name, value and allowed values if the value is not valid."""
    if not valid:
        raise ValueError(f"{name} = {value} must be {allowed}")
