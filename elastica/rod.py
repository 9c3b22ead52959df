"""The pinned strip as a boundary value problem, extensible and shearable: an independent check of `elastica.pinned`.

By symmetry one half is solved: a `Strip` that is clamped at mid-span and whose other end may turn and move across the chord.
Quantities are normalised by E I and the stress-free length L of both halves: p = P L^2/(E I), axial = E A L^2/(E I),
shear = G A L^2/(E I). The `Strip` of the half is normalised by its own length L/2, hence the factors 4 below. Newton's method
begins with a one-term Galerkin solution theta = -alpha sin(pi s/2), s = 0 at mid-span, and must converge to the same branch.

References
----------
E. Reissner, On one-dimensional finite-strain beam theory: the plane problem, doi 10.1007/BF01602645.
A. Magnusson, M. Ristinmaa, C. Ljung, Behaviour of the extensible elastica solution, doi 10.1016/S0020-7683(01)00089-0.
"""

from dataclasses import dataclass
from math import inf, pi, sqrt
from typing import NamedTuple

import numpy as np

from .collocation import Array, RodError, require
from .strip import Load, Strip, StripEquilibrium


class WrongBranchError(RodError):
    """Newton's method converged to the straight rod or to a higher buckling mode."""


class RodSolution(NamedTuple):
    """Load P L^2/(E I), compressive positive, and equilibrium of the half beyond mid-span, normalised by the half's length."""

    load: float
    half: StripEquilibrium


@dataclass(frozen=True)
class Rod:
    """A straight rod on two pins, with normalised axial and shear stiffness.

    `nodes` is the number of collocation points in each of the two pieces into which `Strip` divides the half. A number outside
    its range raises a ValueError.
    """

    axial: float = inf
    shear: float = inf
    nodes: int = 24

    def __post_init__(self) -> None:
        require("axial, shear", (self.axial, self.shear), self.axial > 0.0 and self.shear > 0.0, "above 0")

    @property
    def softness(self) -> float:
        """Compliance in the buckling equation, c = 1/shear - 1/axial."""
        return 1.0 / self.shear - 1.0 / self.axial

    @property
    def critical_load(self) -> float:
        """Buckling load of the perfect rod, the smaller root of p (1 + c p) = pi^2 (Haringx' form)."""
        discriminant = 1.0 + 4.0 * self.softness * pi**2
        require("axial", self.axial, discriminant >= 0.0, f"large enough to buckle at all, shear being {self.shear}")
        return 2.0 * pi**2 / (1.0 + sqrt(discriminant))

    def at_shortening(self, shortening: float) -> RodSolution:
        """Find the buckled equilibrium at an end shortening, 1 - chord/L, up to 1.5.

        With the default `nodes` the residual is 1e-14 at 1.5; at 1.7, near the closed loop, it would be 1e-11. A shortening that
        the rod has without buckling raises a ValueError, an equilibrium that is not found a RodError.
        """
        half = Strip("clamped", "rail", axial=self.axial / 4, shear=self.shear / 4, nodes=self.nodes)  # rail: x alone is fixed
        lowest = self.critical_load / self.axial  # compression P/(E A) of the straight rod at its buckling load
        allowed = f"larger: the rod buckles at the end shortening {lowest:.4g}, and 1.5 is the largest"
        require("axial", self.axial, lowest < 1.5, allowed)
        allowed = f"above {lowest:.12g}, to 1.5 (end shortening/L): the rod buckles at the first of these"
        require("shortening", shortening, lowest < shortening <= 1.5, allowed)
        guess, end_angle = self._guess(half, shortening)
        towards_middle = Load(move=(-1.0, 0.0, 0.0))  # of the half's end; the load factor is the shortening
        found = half.equilibrium(towards_middle, shortening, guess)
        end = -float(found.theta[-1])
        # theta of a higher mode changes sign, a straight rod has the end angle 0; half of the expected angle is chosen
        if np.any(found.theta[1:] >= 0.0) or end < 0.5 * end_angle:
            raise WrongBranchError(f"end angle {end:.3g} rad where about {end_angle:.3g} was expected; the rod is {self}")
        axial_force = float(found.force[0, 0])  # in x at mid-span, normalised by the half's length
        return RodSolution(-4.0 * axial_force, found)

    def _guess(self, half: Strip, shortening: float) -> tuple[Array, float]:
        """Return the half's unknowns and the end angle alpha [rad] at a shortening, by Galerkin's method with one mode.

        In units of the half the equation of buckling is theta'' + p/4 sin(theta) (1 + c p cos(theta)) = 0, with the softness c.
        Insert theta = -alpha mode, multiply by the mode, integrate over s from 0 to 1, and use int mode'^2 ds = pi^2/8:

            alpha pi^2 = 2 p int mode sin(alpha mode) ds + 2 c p^2 int mode sin(alpha mode) cos(alpha mode) ds.

        This is bending = linear p + quadratic p^2 below. By equation (1) of `strip` the shortening is the integral of
        1 - x' = 1 - cos(theta) + p (cos(theta)^2/axial + sin(theta)^2/shear). A table over alpha is interpolated.
        """
        weights = half.grid.J[-1]  # `weights @ f` is the integral of f over s from 0 to 1
        mode = np.sin(pi / 2 * half.grid.s)
        angles = np.geomspace(1e-6, 3.0, 200)  # alpha [rad]: chosen, from nearly straight to nearly a closed loop
        sin, cos = np.sin(np.outer(angles, mode)), np.cos(np.outer(angles, mode))
        bending = angles * pi**2
        linear, quadratic = 2.0 * (sin * mode) @ weights, 2.0 * self.softness * (sin * cos * mode) @ weights
        discriminant = linear**2 + 4.0 * quadratic * bending
        has_load = np.logical_and.accumulate(discriminant >= 0.0)  # at larger angles no load balances the bending
        angles, sin, cos, bending = angles[has_load], sin[has_load], cos[has_load], bending[has_load]
        loads = 2.0 * bending / (linear[has_load] + np.sqrt(discriminant[has_load]))
        shortened = 1.0 - cos @ weights + loads * ((cos**2 / self.axial + sin**2 / self.shear) @ weights)
        # beyond the table, 1.26 for an inextensible rod, its last row is the guess; `shortened` need not increase for soft rods.
        # `at_shortening` checks to which branch Newton's method converges from there
        alpha, load = (float(np.interp(shortening, shortened, column)) for column in (angles, loads))
        moment, nx, ny = -alpha * pi / 2, -load / 4, 0.0  # at mid-span
        return np.concatenate((-alpha * mode, (moment, nx, ny))), alpha
