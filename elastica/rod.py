"""The pinned strip as a boundary value problem, extensible and shearable: an independent check of `elastica.pinned`.

By symmetry only half of it is solved, a `Strip` clamped at mid-span, its other end free to move across the chord. Quantities are
normalised by E I and by the whole stress-free arc length L: p = P L^2/(E I), axial = E A L^2/(E I), shear = G A L^2/(E I).
Newton's method begins with a one-term Galerkin solution theta = alpha cos(pi s), and must converge to the same branch.

References
----------
E. Reissner, On one-dimensional finite-strain beam theory: the plane problem, doi 10.1007/BF01602645.
A. Magnusson, M. Ristinmaa, C. Ljung, Behaviour of the extensible elastica solution, doi 10.1016/S0020-7683(01)00089-0.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi, sqrt
from typing import NamedTuple

import numpy as np

from .collocation import Array, RodError, require
from .strip import Load, Strip, StripEquilibrium

APPROACH = Load(move=(-1.0, 0.0, 0.0))
"""Load parameter: shortening of the half over its length."""


class WrongBranchError(RodError):
    """Newton's method converged to the straight rod or to a higher buckling mode."""


class RodSolution(NamedTuple):
    """Load P L^2/(E I), compressive positive, and equilibrium of the half beyond mid-span, normalised by the half's length."""

    load: float
    half: StripEquilibrium


@dataclass(frozen=True)
class Rod:
    """A straight rod on two pins, with normalised axial and shear stiffness.

    `nodes` are collocation points of each of the two pieces of the half. A ValueError names what lies outside its range.
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

        Raises
        ------
        ValueError
            If the rod has that shortening without buckling.
        NewtonDivergedError, WrongBranchError
            If no buckled equilibrium was found.
        """
        half = Strip("clamped", "rail", axial=self.axial / 4, shear=self.shear / 4, nodes=self.nodes)
        lowest = self.critical_load / self.axial
        require("shortening", shortening, lowest < shortening <= 1.5, f"above {lowest:.12g}, to 1.5 (end shortening/L)")
        guess = self._guess(half, shortening)
        found = half.equilibrium(APPROACH, shortening, guess)
        end, expected = float(found.theta[-1]), float(guess[-4])
        if np.any(found.theta[1:] * expected <= 0.0) or end / expected < 0.5:
            raise WrongBranchError(f"end angle {-end:.3g} rad where about {-expected:.3g} was expected; the rod is {self}")
        return RodSolution(-4.0 * float(found.force[0, 0]), found)

    def _guess(self, half: Strip, shortening: float) -> Array:
        """Return the half's unknowns for theta = alpha cos(pi s), whose alpha has this shortening by Galerkin's method."""
        whole, mode = half.grid.J[-1], np.sin(pi / 2 * half.grid.s)
        angles = np.geomspace(1e-6, 3.0, 200)
        sin, cos = np.sin(np.outer(angles, mode)), np.cos(np.outer(angles, mode))
        bending = angles * pi**2  # = linear * p + quadratic * p^2
        linear, quadratic = 2.0 * (sin * mode) @ whole, 2.0 * self.softness * (sin * cos * mode) @ whole
        discriminant = linear**2 + 4.0 * quadratic * bending
        known = np.logical_and.accumulate(discriminant >= 0.0)  # at larger angles no load balances the bending
        angles, loads = angles[known], 2.0 * bending[known] / (linear + np.sqrt(np.abs(discriminant)))[known]
        shortened = 1.0 - cos[known] @ whole + loads * ((cos**2 / self.axial + sin**2 / self.shear)[known] @ whole)
        alpha, load = np.interp(shortening, shortened, angles), np.interp(shortening, shortened, loads)
        return np.concatenate((-alpha * mode, (-alpha * pi / 2, -load / 4, 0.0)))
