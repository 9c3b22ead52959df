"""Free modes of a uniform bar in the plane by beam theory, for modal links of `BarModes`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

from ..elements.modal import BarModes, Modal
from ..geometry import Array
from .planar import PlanarModel
from .reduction import reduced

STATIONS = 33
"""Number of points along the bar at which its modes are stored for drawing."""


def bar_model(modal: Modal, modes: BarModes, length: float, degree: int | None = None) -> PlanarModel:
    """Free-free modes of a uniform bar: bending in the plane, then axial; Ritz with Legendre polynomials.

    Polynomials hold the rigid motions exactly, so the modes keep to mean axes to rounding, and converge exponentially. Their
    degree is 24 by default, and more for more than six modes of a kind.
    """
    section, bending = modal.section, modes.bending
    degree = degree or min(40, max(24, 3 * max(bending, modes.axial) + 4))
    bar = _Bar(section, length, degree)
    wb, v, turn = bar.timoshenko(bending) if modes.shear else bar.euler_bernoulli(bending)
    wa, u = bar.axial(modes.axial)
    m, frequency = bending + modes.axial, np.concatenate([wb, wa])
    along, across, turns = (np.zeros((len(bar.x), m)) for _ in range(3))
    across[:, :bending], turns[:, :bending], along[:, bending:] = v, turn, u
    line, spin = bar.line, bar.spin * modes.shear
    mass = line @ (along**2 + across**2) + spin @ turns**2
    along, across, turns = (values / np.sqrt(mass) for values in (along, across, turns))
    swirl = along.T @ (line[:, None] * across)
    ends = slice(-3 - STATIONS, -STATIONS)
    return PlanarModel(
        length=length,
        mass=float(line.sum()),
        inertia=float(line @ bar.x**2 + bar.spin.sum()),
        centre=np.array([length / 2, 0.0]),
        numbers=np.arange(1, m + 1),
        frequency=frequency,
        damping=np.broadcast_to(modal.ratios(frequency), m).astype(float),
        shapes=np.stack([along[ends], across[ends], turns[ends]], axis=1),
        radial=(line * bar.x) @ along,
        gram=along.T @ (line[:, None] * along) + across.T @ (line[:, None] * across) + turns.T @ (spin[:, None] * turns),
        gyration=swirl - swirl.T,
        line=np.column_stack([bar.x[-STATIONS:], np.zeros(STATIONS)]),
        line_shapes=np.stack([along[-STATIONS:], across[-STATIONS:]], axis=1),
    )


class _Bar:
    """Legendre polynomials, orthonormal in mass, at Gauss points and (with weight 0) at start, end, centre and along the bar."""

    def __init__(self, section: Any, length: float, degree: int):
        points, weights = legendre.leggauss(degree + 2)
        xi = np.concatenate([points, [-1.0, 1.0, 0.0], np.linspace(-1.0, 1.0, STATIONS)])
        weights = np.append(weights, np.zeros(3 + STATIONS)) * length / 2
        scale = np.sqrt((2 * np.arange(degree + 1) + 1) / length)
        derived = [legendre.legval(xi, legendre.legder(np.diag(scale), k)).T * (2 / length) ** k for k in range(3)]
        self.p, self.dp, self.ddp = derived
        self.section, self.x, self.weights = section, xi * length / 2, weights
        self.line, self.spin = section.mass_per_length * weights, section.inertia_per_length * weights

    def _gram(self, one: Array, other: Array) -> Array:
        return one.T @ (self.weights[:, None] * other)

    def _modes(self, stiffness: Array, rigid: int, count: int) -> tuple[Array, Array]:
        """Frequencies and coefficients without the rigid motions."""
        squares, vectors = eigh(stiffness, subset_by_index=(0, rigid + count - 1))
        return np.sqrt(squares[rigid:]), vectors[:, rigid:]

    def axial(self, count: int) -> tuple[Array, Array]:
        """Frequencies, displacement."""
        w, c = self._modes(self.section.material.modulus / self.section.material.density * self._gram(self.dp, self.dp), 1, count)
        return w, _unit_end(self.p @ c)[0]

    def euler_bernoulli(self, count: int) -> tuple[Array, Array, Array]:
        """Frequencies, deflection, slope."""
        rigidity = self.section.bending_stiffness / self.section.mass_per_length
        w, c = self._modes(rigidity * self._gram(self.ddp, self.ddp), 2, count)
        v, slope = _unit_end(self.p @ c, self.dp @ c)
        return w, v, slope

    def timoshenko(self, count: int) -> tuple[Array, Array, Array]:
        """Frequencies, deflection, turn of the section."""
        section = self.section
        a, b = np.sqrt(section.mass_per_length), np.sqrt(section.inertia_per_length)
        slip = np.hstack([self.dp / a, -self.p / b])
        bend = np.hstack([np.zeros_like(self.p), self.dp / b])
        stiffness = section.shear_stiffness * self._gram(slip, slip) + section.bending_stiffness * self._gram(bend, bend)
        w, c = self._modes(stiffness, 2, count)
        n = self.p.shape[1]
        v, turn = _unit_end(self.p @ c[:n] / a, self.p @ c[n:] / b)
        return w, v, turn


def _unit_end(*shapes: Array) -> tuple[Array, ...]:
    """Scale modes to a displacement of 1 at the bar's end."""
    return tuple(shape / shapes[0][-STATIONS - 2] for shape in shapes)


def planar_model(modal: Modal, length: float) -> PlanarModel:
    """Reduce a link of this length [m] to the plane of motion."""
    return bar_model(modal, modal.modes, length) if isinstance(modal.modes, BarModes) else reduced(modal, length).plane
