"""The strip between two pins as a boundary value problem: a second opinion on `elastica.pinned`, extensible and imperfect.

A `buckler.elastica.strip.Strip` whose stress-free shape may be a half-sine, normalised by E I and by the stress-free arc length
L: s in [0, 1], p = P L^2/(E I), axial = E A L^2/(E I), shear = G A L^2/(E I). The pin reactions lie on the chord, which is the
x axis. With c = 1/shear - 1/axial and theta the rotation of the cross-section its equations (1) to (3) are

    x' = cos(theta) - p (cos^2(theta)/axial + sin^2(theta)/shear)              (1)
    y' = sin(theta) (1 + c p cos(theta))                                       (2)
    theta' - theta0' = -p y                                                    (3)

with y = 0 at both pins. Both halves are alike: one is solved for, clamped at mid-span, its other end free to move across the
chord. What stands here leads to the buckled branch: a one-term Galerkin solution to begin with, and the check that Newton's
method has not left it.

References
----------
E. Reissner, On one-dimensional finite-strain beam theory: the plane problem, doi 10.1007/BF01602645.
A. Magnusson, M. Ristinmaa, C. Ljung, Behaviour of the extensible elastica solution,
doi 10.1016/S0020-7683(01)00089-0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi, sqrt

import numpy as np

from .collocation import Array, NewtonDivergedError, RodError, require
from .strip import Load, Strip

__all__ = ["NewtonDivergedError", "Rod", "RodError", "RodSolution", "WrongBranchError"]

SHORTENING_MAX = 1.5
LOAD_MAX = 80.0
PUSH, APPROACH = Load(end=(-0.25, 0.0)), Load(move=(-1.0, 0.0, 0.0))
"""A load P L^2/(E I) on a half, by its own length L/2, and a shortening of it over that."""


class WrongBranchError(RodError):
    """Newton's iteration settled on the straight rod or on a higher buckling mode."""


@dataclass(frozen=True, eq=False)
class RodSolution:
    """One equilibrium of a `Rod`, at Chebyshev points along each quarter of the arc; where quarters meet a point occurs twice.

    Attributes
    ----------
    load : float, P L^2/(E I), compressive positive
    shortening : float, 1 - x(1), the length the chord lacks, over L
    s : array (nodes,), stress-free arc length over L, 0 to 1
    x, y : array (nodes,), centreline over L, from (0, 0) to (1 - shortening, 0)
    theta : array (nodes,), rotation of the cross-section, rad; the tangent angle where shear is infinite
    residual : float, largest defect of the equations and of the prescribed value between the nodes
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
    nodes : int, collocation points, a quarter of them in each quarter of the rod, a multiple of 4, 16 to 400

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
        require("imperfection", self.imperfection, abs(self.imperfection) <= 0.3, "-0.3 to 0.3 (amplitude/L)")
        require("nodes", self.nodes, self.nodes in range(16, 401, 4), "a multiple of 4 from 16 to 400")
        require("axial", self.axial, self.axial > 0.0, "above 0 (E A L^2/(E I))")
        require("shear", self.shear, self.shear > 0.0, "above 0 (G A L^2/(E I))")

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
        require("axial", self.axial, discriminant >= 0.0, f"large enough to buckle at all, shear being {self.shear}")
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
        require("load", load, lowest < load <= LOAD_MAX, f"above {lowest:.12g}, to {LOAD_MAX:g} (P L^2/(E I))")
        return self._solved(PUSH, load, lambda p, _: p - load)

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
        free = 1.0 - self._half("rail").rest[0]
        lowest = free if self.imperfection else self.critical_load / self.axial
        valid = lowest < shortening <= SHORTENING_MAX
        require("shortening", shortening, valid, f"above {lowest:.12g}, to {SHORTENING_MAX:g} (end shortening/L)")
        return self._solved(APPROACH, shortening - free, lambda _, u: u - shortening)

    def _half(self, end: str) -> Strip:
        """The half beyond mid-span, by its own length."""
        rise, stiff = -self.imperfection * pi, (self.axial / 4, self.shear / 4)
        return Strip("clamped", end, lambda s: np.arcsin(rise * np.sin(pi / 2 * s)), *stiff, nodes=self.nodes // 4)

    def _solved(self, load: Load, factor: float, defect: Callable[[Array, Array], Array]) -> RodSolution:
        """Both halves next to the first guess whose load and shortening have no defect, if they are on its branch."""
        strip = self._half("free" if load is PUSH else "rail")
        guess = _guess(self, strip, defect)
        found = strip.equilibrium(load, factor, guess)
        theta, expected = found.theta, float(guess[-4])
        if np.any(theta[1:] * expected <= 0.0) or theta[-1] / expected < 0.5:
            raise WrongBranchError(f"end angle {-theta[-1]:.3g} rad where about {-expected:.3g} was expected; the rod is {self}")
        arc, x, y = 0.5 * found.s, 0.5 * found.x, 0.5 * (found.y - found.end[1])
        both = [np.concatenate((sign * values[::-1], values)) for sign, values in ((-1, arc), (-1, x), (1, y), (-1, theta))]
        pushed, shortening = -4.0 * float(found.force[0, 0]), 1.0 - found.end[0]
        return RodSolution(pushed, shortening, 0.5 + both[0], 0.5 * found.end[0] + both[1], both[2], both[3], found.residual)


def _guess(rod: Rod, strip: Strip, defect: Callable[[Array, Array], Array]) -> Array:
    """Unknowns of a half in the one-term Galerkin solution theta = alpha cos(pi s) of (3) whose load and shortening fit."""
    whole, mode = strip.grid.J[-1], np.sin(pi / 2 * strip.grid.s)
    start = abs(np.arcsin(pi * rod.imperfection))
    angles = start + np.geomspace(1e-6, 3.0 - start, 200)
    sin, cos = np.sin(np.outer(angles, mode)), np.cos(np.outer(angles, mode))
    bending = (angles - start) * pi**2  # = linear * p + quadratic * p^2
    linear, quadratic = 2.0 * (sin * mode) @ whole, 2.0 * rod.softness * (sin * cos * mode) @ whole
    discriminant = linear**2 + 4.0 * quadratic * bending
    known = np.logical_and.accumulate(discriminant >= 0.0)  # till it is compressed so far that bending can balance no load
    angles, loads = angles[known], 2.0 * bending[known] / (linear + np.sqrt(np.abs(discriminant)))[known]
    shortened = 1.0 - cos[known] @ whole + loads * ((cos**2 / rod.axial + sin**2 / rod.shear)[known] @ whole)
    defects = defect(loads, shortened)
    alpha, load = np.interp(0.0, defects, angles), np.interp(0.0, defects, loads)
    sense = -1.0 if rod.imperfection < 0.0 else 1.0
    return np.concatenate((-sense * alpha * mode, (-sense * (alpha - start) * pi / 2, -load / 4, 0.0)))
