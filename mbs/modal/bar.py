"""Free modes of a uniform bar in the plane by beam theory, for modal links with `BarModes`.

The method is that of Ritz (doi 10.1515/crll.1909.135.1) with Legendre polynomials, which contain the rigid motions and converge
exponentially. The polynomials are orthonormal. So the mass matrix is the unit matrix if stiffnesses are divided by the mass per
length. `timoshenko` divides the polynomials instead: those of the deflection by the square root of the mass per length, those of
the rotation by that of the rotary inertia per length.
"""

from typing import Any

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

from ..elements.modal import BarModes, Modal
from ..geometry import Array
from .planar import PlanarModel
from .reduction import reduced

LINE_POINTS = 33
"""Number of points along the bar at which its modes are stored for drawing."""


def bar_model(modal: Modal, modes: BarModes, length: float, degree: int | None = None) -> PlanarModel:
    """Compute bending modes, then axial ones, of a bar with free ends; `degree` is that of the polynomials.

    With the default the highest frequencies are right to 1e-8, the lowest to 1e-6, as rounding is relative to the highest one.
    """
    section, bending = modal.section, modes.bending
    degree = degree or min(40, max(24, 3 * max(bending, modes.axial) + 4))  # chosen; `BarModes` allows 13 modes of each kind
    bar = _Bar(section, length, degree)
    bending_omega, deflection, turn = bar.timoshenko(bending) if modes.shear else bar.euler_bernoulli(bending)
    axial_omega, displacement = bar.axial(modes.axial)
    turn, deflection = turn / deflection[bar.end], deflection / deflection[bar.end]  # 1 at the end: this fixes the modes' signs
    displacement = displacement / displacement[bar.end]
    m, frequency = bending + modes.axial, np.concatenate([bending_omega, axial_omega])
    shapes = np.zeros((len(bar.x), 3, m))  # at each point: displacements along and across the bar, rotation; of each mode
    shapes[:, 1, :bending], shapes[:, 2, :bending], shapes[:, 0, bending:] = deflection, turn, displacement
    inertias = bar.inertias * modes.shear  # Euler and Bernoulli neglect the sections' rotary inertia
    weights = np.column_stack([bar.masses, bar.masses, inertias])[:, :, None]
    shapes /= np.sqrt((weights * shapes**2).sum(axis=(0, 1)))  # modal masses of 1
    by_mass = weights * shapes
    products = shapes[:, 0].T @ by_mass[:, 1]  # integrals of phi_ix phi_jy dm
    return PlanarModel(
        length=length, mass=float(bar.masses.sum()),
        inertia=float(bar.masses @ bar.x**2 + bar.inertias.sum()),  # of the rigid bar, in either theory
        centre=np.array([length / 2, 0.0]), numbers=np.arange(1, m + 1),
        frequency=frequency, damping=np.broadcast_to(modal.ratios(frequency), m).astype(float),
        shapes=shapes[bar.stations],
        radial=bar.x @ by_mass[:, 0],  # integrals of X . phi_i dm, with X = (x, 0) from the bar's middle [m]
        gram=np.einsum("pci,pcj->ij", shapes, by_mass),  # of phi_i . phi_j dm
        gyration=products - products.T,  # of phi_i x phi_j dm
        line=np.column_stack([bar.x[bar.line], np.zeros(LINE_POINTS)]), line_shapes=shapes[bar.line, :2],
    )  # fmt: skip


class _Bar:
    """Legendre polynomials `p`, orthonormal over the length, and derivatives `dp`, `ddp`, each (points, degree + 1).

    The points are those of Gauss quadrature, then three `stations` (start, end, middle) and those of the `line` for drawing. The
    bar's end has the index `end`. `x` has their places from the bar's middle [m]. `weights` [m], `masses` [kg] and rotary
    `inertias` [kg m^2] are their weights in integrals, 0 beyond the Gauss points.
    """

    def __init__(self, section: Any, length: float, degree: int):
        points, weights = legendre.leggauss(degree + 2)
        xi = np.concatenate([points, [-1.0, 1.0, 0.0], np.linspace(-1.0, 1.0, LINE_POINTS)])
        gauss = len(points)
        self.stations, self.line = slice(gauss, gauss + 3), slice(gauss + 3, None)
        self.end = gauss + 1
        weights = np.append(weights, np.zeros(3 + LINE_POINTS)) * length / 2
        scale = np.sqrt((2 * np.arange(degree + 1) + 1) / length)
        self.p, self.dp, self.ddp = (
            legendre.legval(xi, legendre.legder(np.diag(scale), order)).T * (2 / length) ** order for order in range(3)
        )
        self.section, self.x, self.weights = section, xi * length / 2, weights
        self.masses, self.inertias = section.mass_per_length * weights, section.inertia_per_length * weights

    def _gram(self, first: Array, second: Array) -> Array:
        """Integrate the products of two sets of functions along the bar."""
        return first.T @ (self.weights[:, None] * second)

    def _modes(self, stiffness: Array, rigid: int, count: int) -> tuple[Array, Array]:
        """Solve the eigenvalue problem; return frequencies [rad/s] and coefficients without the first `rigid` modes."""
        squares, vectors = eigh(stiffness, subset_by_index=(0, rigid + count - 1))
        return np.sqrt(squares[rigid:]), vectors[:, rigid:]

    def axial(self, count: int) -> tuple[Array, Array]:
        """Compute frequencies and displacements of axial modes."""
        material = self.section.material
        omega, c = self._modes(material.modulus / material.density * self._gram(self.dp, self.dp), 1, count)
        return omega, self.p @ c

    def euler_bernoulli(self, count: int) -> tuple[Array, Array, Array]:
        """Compute frequencies, deflections and slopes of bending modes without shear."""
        rigidity = self.section.bending_stiffness / self.section.mass_per_length
        omega, c = self._modes(rigidity * self._gram(self.ddp, self.ddp), 2, count)
        return omega, self.p @ c, self.dp @ c

    def timoshenko(self, count: int) -> tuple[Array, Array, Array]:
        """Compute frequencies, deflections and rotations of bending modes with shear, by polynomials for each of the two."""
        section = self.section
        a, b = np.sqrt(section.mass_per_length), np.sqrt(section.inertia_per_length)  # divisors of the polynomials
        shear, bend = np.hstack([self.dp / a, -self.p / b]), np.hstack([np.zeros_like(self.p), self.dp / b])
        stiffness = section.shear_stiffness * self._gram(shear, shear) + section.bending_stiffness * self._gram(bend, bend)
        omega, c = self._modes(stiffness, 2, count)
        n = self.p.shape[1]
        return omega, self.p @ c[:n] / a, self.p @ c[n:] / b


def planar_model(modal: Modal, length: float) -> PlanarModel:
    """Compute the planar model of a modal link of a length [m]: of a bar by beam theory, else by finite elements."""
    return bar_model(modal, modal.modes, length) if isinstance(modal.modes, BarModes) else reduced(modal, length).plane
