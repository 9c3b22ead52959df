"""The strip as a boundary value problem: a second opinion on `buckler.elastica.pinned`, extensible and imperfect.

A planar rod of Reissner's theory between two pins: bending stiffness E I, axial stiffness E A, shear
stiffness G A, and a stress-free shape that may be a half-sine. Everything is normalised by E I and by the
stress-free arc length L: s in [0, 1], p = P L^2/(E I), axial = E A L^2/(E I), shear = G A L^2/(E I). With c =
1/shear - 1/axial and theta the rotation of the cross-section, equilibrium of the cut-off piece and the linear
material give

    x' = cos(theta) - p (cos^2(theta)/axial + sin^2(theta)/shear)              (1)
    y' = sin(theta) (1 + c p cos(theta))                                       (2)
    theta' - theta0' = -p y                                                    (3)

with y = 0 at both pins; the pin reactions then lie on the chord, which is the x axis. Integrated once more,
(3) becomes the integral equation solved here, with J[f](s) the integral of f from 0 to s,

    theta = theta0 + beta - p J[J[y']],   J[y'](1) = 0,                        (4)

collocated at Chebyshev points and solved by Newton for theta, beta and p. Integration matrices, unlike
differentiation matrices, keep rounding at 1e-15 while the error falls geometrically with the number of nodes.

References
----------
E. Reissner, On one-dimensional finite-strain beam theory: the plane problem, doi 10.1007/BF01602645.
A. Magnusson, M. Ristinmaa, C. Ljung, Behaviour of the extensible elastica solution,
doi 10.1016/S0020-7683(01)00089-0.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import inf, pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

Array = NDArray[np.floating]

SHORTENING_MAX = 1.5
LOAD_MAX = 80.0


class RodError(RuntimeError):
    """No buckled equilibrium was found."""


class NewtonDivergedError(RodError):
    """Newton's iteration did not settle."""


class WrongBranchError(RodError):
    """Newton's iteration settled on the straight rod or on a higher buckling mode."""


@dataclass(frozen=True, eq=False)
class RodSolution:
    """One equilibrium of a `Rod`, at Chebyshev points along the arc.

    Attributes
    ----------
    load : float, P L^2/(E I), compressive positive
    shortening : float, 1 - x(1), the length the chord lacks, over L
    s : array (nodes,), stress-free arc length over L, 0 to 1
    x, y : array (nodes,), centreline over L, from (0, 0) to (1 - shortening, 0)
    theta : array (nodes,), rotation of the cross-section, rad; the tangent angle where shear is infinite
    residual : float, largest defect of equations (4) and of the prescribed value between the nodes
    """

    load: float
    shortening: float
    s: Array
    x: Array
    y: Array
    theta: Array
    residual: float


@dataclass(frozen=True)
class Rod:
    """A pinned-pinned rod, normalised by its length and bending stiffness.

    Attributes
    ----------
    axial : float, E A L^2/(E I), positive; infinite for an inextensible rod
    shear : float, G A L^2/(E I), positive; infinite for an unshearable rod
    imperfection : float, stress-free shape y0 = imperfection * sin(pi s) over L, -0.3 to 0.3; its sign is the
        side to which the rod bows, a perfect rod bows to positive y
    nodes : int, collocation points, even (so that none sits at mid-span, where theta changes sign), 8 to 400

    Raises
    ------
    ValueError
        If an attribute lies outside its range or is not a number.
    """

    axial: float = inf
    shear: float = inf
    imperfection: float = 0.0
    nodes: int = 96

    def __post_init__(self) -> None:
        _require("axial", self.axial, self.axial > 0.0, "above 0 (E A L^2/(E I))")
        _require("shear", self.shear, self.shear > 0.0, "above 0 (G A L^2/(E I))")
        _require("imperfection", self.imperfection, abs(self.imperfection) <= 0.3, "-0.3 to 0.3 (amplitude/L)")
        _require("nodes", self.nodes, self.nodes in range(8, 401, 2), "an even number from 8 to 400")

    @property
    def softness(self) -> float:
        """The compliance that matters to buckling, c = 1/shear - 1/axial."""
        return 1.0 / self.shear - 1.0 / self.axial

    @property
    def critical_load(self) -> float:
        """Load at which the perfect rod buckles, the smaller root of p (1 + c p) = pi^2 (Haringx' form).

        Shear lowers it; axial compression raises it, for the pins approach before the rod bends.

        Raises
        ------
        ValueError
            If 1 + 4 c pi^2 < 0: so soft a rod shortens without ever buckling.
        """
        discriminant = 1.0 + 4.0 * self.softness * pi**2
        _require("axial", self.axial, discriminant >= 0.0, f"large enough to buckle at all, shear being {self.shear}")
        return 2.0 * pi**2 / (1.0 + sqrt(discriminant))

    def at_load(self, load: float) -> RodSolution:
        """Buckled equilibrium under a prescribed end load.

        A stocky rod (unshearable, axial below 53) sheds load once it buckles: prescribe its shortening instead.

        Parameters
        ----------
        load : float, P L^2/(E I), up to 80; above `critical_load` if the rod is perfect, above 0 if not

        Raises
        ------
        ValueError
            If the load lies outside the range or is not a number.
        NewtonDivergedError, WrongBranchError
            If no buckled equilibrium was found.
        """
        lowest = 0.0 if self.imperfection else self.critical_load
        _require("load", load, lowest < load <= LOAD_MAX, f"above {lowest:.12g}, to {LOAD_MAX:g} (P L^2/(E I))")
        return _solve(self, _Prescribed(1.0, 0.0, load))

    def at_shortening(self, shortening: float) -> RodSolution:
        """Buckled equilibrium at a prescribed end shortening.

        Parameters
        ----------
        shortening : float, 1 - chord/L, up to 1.5; above what the rod has without buckling: the axial
            compression at the critical load if it is perfect, the stress-free sagitta's share if not

        Raises
        ------
        ValueError
            If the shortening lies outside the range or is not a number.
        NewtonDivergedError, WrongBranchError
            If no buckled equilibrium was found.
        """
        lowest = _stress_free_shortening(self) if self.imperfection else self.critical_load / self.axial
        valid = lowest < shortening <= SHORTENING_MAX
        _require("shortening", shortening, valid, f"above {lowest:.12g}, to {SHORTENING_MAX:g} (end shortening/L)")
        return _solve(self, _Prescribed(0.0, 1.0, shortening))


class _Prescribed(NamedTuple):
    """The end condition load * p + shortening * u = value."""

    load: float
    shortening: float
    value: float

    def defect(self, load: float, shortening: float) -> float:
        return self.load * load + self.shortening * shortening - self.value


class Grid(NamedTuple):
    """Chebyshev-Lobatto points on [0, 1] and the matrix J that integrates from 0 to each of them."""

    s: Array
    J: Array


@cache
def integration(nodes: int) -> Grid:
    """Collocation points and integration matrix for a number of points from 2 upwards."""
    points = -np.cos(pi * np.arange(nodes) / (nodes - 1))
    primitives = chebyshev.chebint(np.eye(nodes), lbnd=-1, axis=0)
    to_coefficients = np.linalg.inv(chebyshev.chebvander(points, nodes - 1))
    J = chebyshev.chebvander(points, nodes) @ primitives @ to_coefficients / 2.0
    return Grid((points + 1.0) / 2.0, J)


def _stress_free(rod: Rod, grid: Grid) -> Array:
    """theta0 along the half-sine y0 = a sin(pi s), for which sin(theta0) = y0'."""
    return np.arcsin(rod.imperfection * pi * np.cos(pi * grid.s))


def _stress_free_shortening(rod: Rod) -> float:
    grid = integration(rod.nodes)
    return _shortening(rod, grid, _stress_free(rod, grid), 0.0)


def _slopes(rod: Rod, theta: Array, load: float) -> tuple[Array, Array]:
    """Equations (1) and (2): x' and y', each of shape (nodes,)."""
    sin, cos = np.sin(theta), np.cos(theta)
    return cos - load * (cos**2 / rod.axial + sin**2 / rod.shear), sin * (1.0 + rod.softness * load * cos)


def _shortening(rod: Rod, grid: Grid, theta: Array, load: float) -> float:
    return float(1.0 - grid.J[-1] @ _slopes(rod, theta, load)[0])


def _defect(rod: Rod, grid: Grid, end: _Prescribed, z: Array) -> Array:
    """Left minus right sides of (4) and of the end condition at z = (theta, beta, p), shape (nodes + 2,)."""
    theta, beta, load = z[:-2], z[-2], z[-1]
    y = grid.J @ _slopes(rod, theta, load)[1]
    balance = theta - _stress_free(rod, grid) - beta + load * (grid.J @ y)
    return np.concatenate((balance, (y[-1], end.defect(load, _shortening(rod, grid, theta, load)))))


def _jacobian(rod: Rod, grid: Grid, end: _Prescribed, z: Array) -> Array:
    """Derivative of `_defect` by z, shape (nodes + 2, nodes + 2)."""
    theta, load, c, J = z[:-2], z[-1], rod.softness, grid.J
    sin, cos = np.sin(theta), np.cos(theta)
    y_by_theta = J * (cos + c * load * np.cos(2.0 * theta))
    y_by_load = J @ (c * sin * cos)
    shortening_by_theta = J[-1] * sin * (1.0 + 2.0 * c * load * cos)
    shortening_by_load = J[-1] @ (cos**2 / rod.axial + sin**2 / rod.shear)
    y = J @ _slopes(rod, theta, load)[1]

    n = theta.size
    jacobian = np.zeros((n + 2, n + 2))
    jacobian[:n, :n] = np.eye(n) + load * J @ y_by_theta
    jacobian[:n, n] = -1.0
    jacobian[:n, n + 1] = J @ (y + load * y_by_load)
    jacobian[n, :n] = y_by_theta[-1]
    jacobian[n, n + 1] = y_by_load[-1]
    jacobian[n + 1, :n] = end.shortening * shortening_by_theta
    jacobian[n + 1, n + 1] = end.load + end.shortening * shortening_by_load
    return jacobian


def _guess(rod: Rod, grid: Grid, end: _Prescribed) -> Array:
    """One-term Galerkin solution theta = alpha cos(pi s) of (3) that meets the end condition, as z."""
    mode = np.cos(pi * grid.s)
    start = abs(np.arcsin(pi * rod.imperfection))
    rows = []
    for alpha in start + np.geomspace(1e-6, 3.0 - start, 200):
        bending = (alpha - start) * pi**2  # = linear * p + quadratic * p^2
        sin, cos = np.sin(alpha * mode), np.cos(alpha * mode)
        linear, quadratic = 2.0 * grid.J[-1] @ (sin * mode), 2.0 * rod.softness * grid.J[-1] @ (sin * cos * mode)
        discriminant = linear**2 + 4.0 * quadratic * bending
        if discriminant < 0.0:  # compressed past the point where bending can balance a load
            break
        load = 2.0 * bending / (linear + sqrt(discriminant))
        rows.append((alpha, load, end.defect(load, _shortening(rod, grid, alpha * mode, load))))
    angles, loads, defects = np.array(rows).T
    alpha, load = np.interp(0.0, defects, angles), np.interp(0.0, defects, loads)
    sense = -1.0 if rod.imperfection < 0.0 else 1.0
    return np.concatenate((sense * alpha * mode, (0.0, load)))


def _solve(rod: Rod, end: _Prescribed) -> RodSolution:
    grid = integration(rod.nodes)
    guess = _guess(rod, grid, end)
    z = _newton(lambda z: np.linalg.solve(_jacobian(rod, grid, end, z), _defect(rod, grid, end, z)), guess)
    theta, load = z[:-2], float(z[-1])
    if np.count_nonzero(np.diff(np.sign(theta))) != 1 or theta[0] / guess[0] < 0.5:
        raise WrongBranchError(f"end angle {theta[0]:.3g} rad where about {guess[0]:.3g} was expected; the rod is {rod}")
    dx, dy = _slopes(rod, theta, load)
    shortening = _shortening(rod, grid, theta, load)
    return RodSolution(load, shortening, grid.s, grid.J @ dx, grid.J @ dy, theta, _residual(rod, end, z))


def _newton(step: Callable[[Array], Array], z: Array) -> Array:
    """Subtract steps until the next one would be below rounding: they shrink quadratically."""
    for _ in range(30):
        change = step(z)
        z = z - change
        if np.max(np.abs(change)) <= 1e-8:
            return z
    raise NewtonDivergedError(f"the last of 30 Newton steps was still {np.max(np.abs(change)):.1e}")


def _residual(rod: Rod, end: _Prescribed, z: Array) -> float:
    """Largest defect of the interpolated solution on a grid half as fine again."""
    coarse, fine = integration(rod.nodes), integration(3 * rod.nodes // 2)
    coefficients = np.linalg.solve(chebyshev.chebvander(2.0 * coarse.s - 1.0, rod.nodes - 1), z[:-2])
    theta = chebyshev.chebval(2.0 * fine.s - 1.0, coefficients)
    return float(np.max(np.abs(_defect(rod, fine, end, np.concatenate((theta, z[-2:]))))))


def _require(name: str, value: float, valid: bool, allowed: str) -> None:
    if not valid:
        raise ValueError(f"{name} = {value} must be {allowed}")
