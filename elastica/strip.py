"""The strip between any two ends as a boundary value problem: clamped or pinned, straight or curved, under dead loads.

A planar rod of Reissner's theory: bending stiffness E I, axial stiffness E A, shear stiffness G A, stress-free tangent angle
theta0(s). Everything is normalised by E I and by the stress-free arc length L: s in [0, 1], force F L^2/(E I), moment M L/(E I),
a = E I/(E A L^2), g = E I/(G A L^2). Let theta be the angle from the x axis to the normal of the cross-section, without shear the
tangent angle. Let m be the bending moment. Let n = (nx, ny) be the force which the part beyond s exerts on the part before it; n
is constant but for a jump at a point load. Then:

    x' = cos + nx (a cos^2 + g sin^2) + ny (a - g) sin cos;                                              (1)
    y' = sin + nx (a - g) sin cos + ny (a sin^2 + g cos^2);                                              (2)
    m' = nx y' - ny x',    theta' - theta0' = m.                                                         (3)

Let J[f](s) be the integral of f from 0 to s. Integrated twice:

    theta = theta0 + phi + J[m],    m = m0 + J[nx y' - ny x'].                                           (4)

phi is the rotation of the start from its stress-free direction, 0 where it is clamped; m0 is the moment there, 0 where it is
pinned. The other one of the two is the unknown b. Equation (4) is collocated at Chebyshev points of two pieces that meet at the
point load. Newton's method finds the unknowns: theta at all points, b, nx(0) and ny(0), in this order in every array of unknowns.
At s = 1 each of x, y and theta is prescribed, or else the force or moment on it.

References
----------
E. Reissner, On one-dimensional finite-strain beam theory: the plane problem, doi 10.1007/BF01602645.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from .collocation import Angle, Array, CollocationGrid, Fields, NewtonDivergedError, make_grid, newton, require, resample

PRESCRIBED = {"free": (), "rail": (0,), "roller": (1,), "guided": (1, 2), "pinned": (0, 1), "clamped": (0, 1, 2)}
"""Indices of x, y and the rotation that each support at s = 1 prescribes."""
LARGEST = 1e6
"""Largest load, displacement and load factor; above it the collocation cannot resolve the boundary layers."""
MOST_ROTATION = 0.6
"""Largest rotation of a section in one step of the load [rad], chosen. A larger one may lead to another equilibrium."""
MOST_CORRECTION = 0.3
"""Largest correction by Newton's method, over the rotation predicted by the tangent: chosen. A larger one may lead elsewhere."""


@dataclass(frozen=True)
class Load:
    """Dead loads and displacements of the end, all in proportion to the load factor; their numbers lie in -1e6 to 1e6.

    Attributes
    ----------
    end : (float, float), F L^2/(E I), force on the end s = 1, in the directions that its support leaves free
    moment : float, M L/(E I), moment on the end s = 1, anticlockwise positive, if the support leaves the rotation free
    inner : (float, float), F L^2/(E I), force on the point `Strip.at`
    move : (float, float, float), displacement over L in x and y, and rotation, rad, of the end s = 1 as far as prescribed
    """

    end: tuple[float, float] = (0.0, 0.0)
    moment: float = 0.0
    inner: tuple[float, float] = (0.0, 0.0)
    move: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        for name, size, unit in (("end", 2, "F L^2/(E I)"), ("inner", 2, "F L^2/(E I)"), ("move", 3, "over L and rad")):
            value = getattr(self, name)
            valid = len(value) == size and all(isfinite(v) and abs(v) <= LARGEST for v in value)
            require(name, value, valid, f"{size} numbers from -1e6 to 1e6 ({unit})")
        require("moment", self.moment, abs(self.moment) <= LARGEST, "-1e6 to 1e6 (M L/(E I))")


@dataclass(frozen=True, eq=False)
class StripEquilibrium:
    """One equilibrium of a `Strip`, at the collocation points; the point `at` occurs twice, once for each piece.

    Attributes
    ----------
    factor : float, load factor
    s : array (nodes,), stress-free arc length over L
    x, y : array (nodes,), centreline over L from (0, 0)
    theta : array (nodes,), rotation of the cross-section, rad; the tangent angle where shear is infinite
    moment : array (nodes,), bending moment M L/(E I)
    force : array (nodes, 2), n = (nx, ny), F L^2/(E I): force of the part beyond s on the part before it
    inner : (float, float), x and y of the point `Strip.at`
    end : (float, float, float), x, y and theta at s = 1
    residual : float, largest defect of equation (4) and of the end conditions between the collocation points
    unknowns : array, solution of Newton's method; a start for the next solution
    """

    factor: float
    s: Array
    x: Array
    y: Array
    theta: Array
    moment: Array
    force: Array
    inner: tuple[float, float]
    end: tuple[float, float, float]
    residual: float
    unknowns: Array


@dataclass(frozen=True)
class Strip:
    """A strip from (0, 0), normalised by its stress-free length and its bending stiffness.

    A straight inextensible strip between two fixed ends has no unique axial force: give it a finite axial stiffness or a bow. An
    attribute outside its range raises a ValueError.

    Attributes
    ----------
    start : "clamped" or "pinned", support at s = 0
    end : support at s = 1: "free", "rail" (fixed in x), "roller" (fixed in y), "guided" (x free), "pinned" or "clamped"
    angle : stress-free tangent angle, rad, as a function of s over L; smooth on either side of `at`; None is a straight strip
    axial : float, E A L^2/(E I), positive; infinite for an inextensible strip
    shear : float, G A L^2/(E I), positive; infinite for an unshearable strip
    at : float, arc length over L of the inner load, 0.01 to 0.99
    nodes : int, collocation points of each of the two pieces, 4 to 200
    """

    start: str = "clamped"
    end: str = "free"
    angle: Angle | None = None
    axial: float = inf
    shear: float = inf
    at: float = 0.5
    nodes: int = 32

    def __post_init__(self) -> None:
        require("start", self.start, self.start in ("clamped", "pinned"), "clamped or pinned")
        require("end", self.end, self.end in PRESCRIBED, "one of " + ", ".join(PRESCRIBED))
        movable = self.start == "pinned" and self.end in ("free", "rail")
        require("end", self.end, not movable, "fixed in y at least: a strip pinned at its start turns freely with this end")
        require("axial", self.axial, self.axial > 0.0, "above 0 (E A L^2/(E I))")
        require("shear", self.shear, self.shear > 0.0, "above 0 (G A L^2/(E I))")
        require("at", self.at, 0.01 <= self.at <= 0.99, "0.01 to 0.99 (arc length over L)")
        require("nodes", self.nodes, self.nodes in range(4, 201), "a whole number from 4 to 200")
        angles = self.grid.angle
        fits = angles.shape == self.grid.s.shape and bool(np.all(np.isfinite(angles)))
        require("angle", self.angle, fits, "a function that gives one finite angle, rad, for each s")

    @cached_property
    def grid(self) -> CollocationGrid:
        """Collocation points, integration matrix and stress-free angle."""
        return make_grid(self.at, self.nodes, self.angle)

    @property
    def is_prescribed(self) -> NDArray[np.bool_]:
        """Mask (3,) of x, y and the rotation at s = 1 that are prescribed."""
        return np.isin(range(3), PRESCRIBED[self.end])

    @cached_property
    def rest(self) -> tuple[float, float, float]:
        """x, y over L and tangent angle, rad, of the end s = 1 in the stress-free shape."""
        integral, angle = self.grid.J[-1], self.grid.angle
        return float(integral @ np.cos(angle)), float(integral @ np.sin(angle)), float(angle[-1])

    def equilibrium(self, load: Load, factor: float = 1.0, guess: Array | None = None) -> StripEquilibrium:
        """Find the equilibrium under `factor`, -1e6 to 1e6, times a load.

        Newton's method starts from `guess`, the `unknowns` of a neighbouring equilibrium. Without it the load increases from zero
        in steps, and the path that begins at the stress-free shape is followed. A NewtonDivergedError says that no equilibrium
        was found: the load is beyond a limit point, or the guess is too far away.
        """
        require("factor", factor, abs(factor) <= LARGEST, "-1e6 to 1e6 (load factor)")
        if guess is not None:
            return self.at_unknowns(load, factor, self._newton(load, factor, guess))
        reached, step, unknowns = 0.0, 1.0, self.stress_free()
        while reached < 1.0:
            found = self._follow(load, factor * reached, factor * min(reached + step, 1.0), unknowns)
            if found is not None:
                reached, step, unknowns = reached + step, 1.5 * step, found
            elif step < 1e-6:  # halved twenty times, and still no equilibrium near the tangent to the path
                raise NewtonDivergedError(f"no next equilibrium at {reached:.6g} of the load: a limit point, or a branching")
            else:
                step /= 2.0
        unknowns = self._newton(load, factor, unknowns)  # one step more removes what the tolerance of the last one left
        return self.at_unknowns(load, factor, unknowns)

    def stress_free(self) -> Array:
        """Return the unknowns of the stress-free shape."""
        return np.concatenate((self.grid.angle, (0.0, 0.0, 0.0)))

    def at_unknowns(self, load: Load, factor: float, unknowns: Array) -> StripEquilibrium:
        """Return shape, forces and residual for a solution."""
        fields, grid, theta = self.fields(load, factor, unknowns), self.grid, unknowns[:-3]
        x, y = grid.J @ fields.x_prime, grid.J @ fields.y_prime
        force = np.column_stack((fields.nx, fields.ny))
        loaded = self.nodes  # index of the point `at`, first of the second piece
        inner, end = (float(x[loaded]), float(y[loaded])), (float(x[-1]), float(y[-1]), float(theta[-1]))
        residual = self._residual(load, factor, unknowns)
        return StripEquilibrium(float(factor), grid.s, x, y, theta, fields.m, force, inner, end, residual, unknowns)

    def fields(self, load: Load, factor: float | Array, unknowns: Array) -> Fields:
        """Compute slopes, force and moment along the strip, equations (1) to (3)."""
        a, g, grid = 1.0 / self.axial, 1.0 / self.shear, self.grid
        theta, (b, start_nx, start_ny) = unknowns[..., :-3], (unknowns[..., k, None] for k in (-3, -2, -1))
        # equilibrium of the part beyond s: n is the sum of the loads on it, without the point load on the second piece
        passed = np.asarray(factor)[..., None] * grid.beyond  # load factor at the points of the second piece, else 0
        nx, ny = start_nx - load.inner[0] * passed, start_ny - load.inner[1] * passed
        sin, cos = np.sin(theta), np.cos(theta)
        x_prime = cos + nx * (a * cos**2 + g * sin**2) + ny * (a - g) * sin * cos
        y_prime = sin + nx * (a - g) * sin * cos + ny * (a * sin**2 + g * cos**2)
        zero = np.zeros(1)
        phi, m0 = (zero, b) if self.start == "clamped" else (b, zero)
        return Fields(nx, ny, x_prime, y_prime, m0 + grid.integrate(nx * y_prime - ny * x_prime), phi)

    def defect(self, load: Load, factor: float | Array, unknowns: Array) -> Array:
        """Compute left minus right side of (4) and of the three end conditions, shape (..., 2 nodes + 3).

        `unknowns` is (..., 2 nodes + 3) and `factor` (...): more axes are for several sets of them.
        """
        f, theta, factors = self.fields(load, factor, unknowns), unknowns[..., :-3], np.asarray(factor)[..., None]
        balance = theta - self.grid.angle - f.phi - self.grid.integrate(f.m)
        x, y = ((slopes * self.grid.J[-1]).sum(axis=-1) for slopes in (f.x_prime, f.y_prime))  # at s = 1
        place = np.stack((x, y, theta[..., -1]), axis=-1) - self.rest - factors * load.move
        force = np.stack((f.nx[..., -1], f.ny[..., -1], f.m[..., -1]), axis=-1) - factors * (*load.end, load.moment)
        return np.concatenate((balance, np.where(self.is_prescribed, place, force)), axis=-1)

    def jacobian(self, load: Load, factor: float, unknowns: Array) -> Array:
        """Compute the derivative of `defect` by the unknowns and the load factor, shape (2 nodes + 3, 2 nodes + 4).

        It is exact but for rounding, by imaginary steps (W. Squire, G. Trapp, doi 10.1137/S003614459631241X).
        """
        size = 1e-30  # so that its square is lost beside 1: chosen
        stepped = np.append(unknowns, factor) + 1j * size * np.eye(unknowns.size + 1)
        return self.defect(load, stepped[:, -1], stepped[:, :-1]).imag.T / size

    def _newton(self, load: Load, factor: float, unknowns: Array) -> Array:
        return newton(lambda z: np.linalg.solve(self.jacobian(load, factor, z)[:, :-1], self.defect(load, factor, z)), unknowns)

    def _follow(self, load: Load, before: float, after: float, unknowns: Array) -> Array | None:
        """Follow the path from one load factor to another; return None if Newton's method leaves the tangent's prediction."""
        matrix = self.jacobian(load, before, unknowns)
        try:
            change = -(after - before) * np.linalg.solve(matrix[:, :-1], matrix[:, -1])
            found = self._newton(load, after, unknowns + change)
        except (np.linalg.LinAlgError, NewtonDivergedError):
            return None
        rotation, correction = np.max(np.abs(change[:-3])), np.max(np.abs((found - unknowns - change)[:-3]))  # of theta
        is_near = correction <= MOST_CORRECTION * rotation + 1e-9  # 1e-9 is Newton's tolerance
        return found if is_near and rotation <= MOST_ROTATION else None

    def _residual(self, load: Load, factor: float, unknowns: Array) -> float:
        """Compute the largest defect of the interpolated solution on a grid of 1.5 times as many points, at most 200.

        With 200 points in each piece it shows Newton's convergence alone.
        """
        fine = replace(self, nodes=min(3 * self.nodes // 2, 200))
        pieces = [resample(piece, fine.nodes) for piece in (unknowns[: self.nodes], unknowns[self.nodes : -3])]
        return float(np.max(np.abs(fine.defect(load, factor, np.concatenate((*pieces, unknowns[-3:]))))))
