"""Planar modes of the rocker as a floating frame of reference needs them, from any source, or from beam theory."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import eigh

from buckler.mbs.validate import non_negative, number, positive, whole

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, eq=False)
class ModalData:
    """A bar and m of its planar modes, in the frame of its undeformed centre; the x axis points from its start to its end.

    A material point X moves to X + sum phi_i(X) q_i. Modes may be scaled as you like. Free-free modes (mean axes) have
    translation = turning = 0. The first four integrals couple modes and frame, see docs/theory-clearance.md.

    Parameters
    ----------
    length, mass, inertia : float
        m, kg, kg m^2 about the centre.
    shapes : array, shape (3, 3, m)
        phi_x, phi_y and the turn of the section (rad), at start, end and centre; second index the component.
    frequency : array, shape (m,)
        Angular, of each mode, rad/s.
    damping : array, shape (m,)
        Damping ratio of each mode.
    modal_mass : array, shape (m,)
        Integral of phi_i . phi_i dm, kg. That of phi_i . phi_j is taken to be 0: modes are orthogonal.
    translation : array, shape (2, m)
        Integral of phi_i dm, kg.
    turning, radial : array, shape (m,)
        Integrals of X x phi_i dm and of X . phi_i dm, kg m.
    gyration : array, shape (m, m)
        Integral of phi_i x phi_j dm, kg; antisymmetric.
    """

    length: float
    mass: float
    inertia: float
    shapes: Array
    frequency: Array
    damping: Array
    modal_mass: Array
    translation: Array
    turning: Array
    radial: Array
    gyration: Array

    def __post_init__(self) -> None:
        for name, unit in (("length", "m"), ("mass", "kg"), ("inertia", "kg m^2")):
            positive(name, getattr(self, name), unit)
        m = len(self.frequency)
        shapes = {
            "shapes": (3, 3, m), "frequency": (m,), "damping": (m,), "modal_mass": (m,), "translation": (2, m),
            "turning": (m,), "radial": (m,), "gyration": (m, m),
        }  # fmt: skip
        for name, shape in shapes.items():
            value = np.asarray(getattr(self, name), dtype=float)
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(f"{name} of shape {value.shape}: must be finite, of shape {shape}")
            object.__setattr__(self, name, value)
        if (self.frequency <= 0).any() or (self.modal_mass <= 0).any() or (self.damping < 0).any():
            raise ValueError("frequency and modal_mass must be positive, damping not negative: leave out rigid-body modes")
        if m and (abs(self.gyration + self.gyration.T).max() > 1e-9 * self.mass * abs(self.shapes).max() ** 2):
            raise ValueError("gyration must be antisymmetric: integral of phi_i x phi_j dm")

    def __len__(self) -> int:
        return len(self.frequency)

    @property
    def stiffness(self) -> Array:
        """Of each mode, mass times frequency squared, shape (m,)."""
        return self.modal_mass * self.frequency**2

    @property
    def table(self) -> Array:
        """Everything as one array of shape (16 + m, m), in the order of the equations of motion."""
        drag = 2 * self.damping * self.frequency * self.modal_mass
        rows = [*self.shapes.reshape(9, -1), *self.translation, self.turning, self.radial, self.modal_mass, self.stiffness, drag]
        return np.ascontiguousarray(np.vstack([*rows, self.gyration]))


def beam_modes(
    length: float = 0.175,
    width: float = 0.005,
    thickness: float = 0.020,
    *,
    bending: int = 2,
    axial: int = 1,
    damping: float = 0.01,
    density: float = 7850.0,
    modulus: float = 207e9,
    poisson: float = 0.29,
    shear: bool = True,
    degree: int = 24,
) -> ModalData:
    """Free-free modes of a uniform bar: bending in the plane, then axial; Ritz with Legendre polynomials.

    Polynomials hold the rigid motions exactly, so the modes keep to mean axes to rounding, and converge exponentially.

    Parameters
    ----------
    length, width, thickness : float
        m; width out of the plane, thickness in it.
    bending, axial : int
        Number of modes of each kind.
    damping : float
        Damping ratio of every mode.
    density, modulus, poisson : float
        kg/m^3, Pa, 1.
    shear : bool
        Timoshenko (shear deformation and rotary inertia); otherwise Euler-Bernoulli without either.
    degree : int
        Of the polynomials.
    """
    for name, value in (("length", length), ("width", width), ("thickness", thickness)):
        positive(name, value, "m")
    positive("density", density, "kg/m^3"), positive("modulus", modulus, "Pa")
    number("poisson", poisson, -1.0, 0.5, "1", open_low=True), non_negative("damping", damping, "1")
    whole("bending", bending, 0, degree // 3), whole("axial", axial, 0, degree // 3), whole("degree", degree, 4, 40)
    bar = _Bar(length, width * thickness, width * thickness**3 / 12, density, modulus, poisson, degree)
    wb, v, turn = bar.timoshenko(bending) if shear else bar.euler_bernoulli(bending)
    wa, u = bar.axial(axial)
    m = bending + axial
    along, across, turns = (np.zeros((len(bar.x), m)) for _ in range(3))
    across[:, :bending], turns[:, :bending], along[:, bending:] = v, turn, u
    shapes = np.stack([along[-3:], across[-3:], turns[-3:]], axis=1)
    line, spin = bar.line, bar.spin * shear
    inertia = line @ bar.x**2 + bar.spin.sum()
    coupling = along.T @ (line[:, None] * across)
    return ModalData(
        length, float(line.sum()), float(inertia), shapes, np.concatenate([wb, wa]), np.full(m, damping),
        modal_mass=line @ (along**2 + across**2) + spin @ turns**2,
        translation=np.array([line @ along, line @ across]),
        turning=(line * bar.x) @ across + spin @ turns, radial=(line * bar.x) @ along,
        gyration=coupling - coupling.T,
    )  # fmt: skip


class _Bar:
    """Legendre polynomials, orthonormal in mass, at Gauss points and (with weight 0) at start, end and centre."""

    def __init__(self, length: float, area: float, second: float, density: float, modulus: float, poisson: float, degree: int):
        points, weights = legendre.leggauss(degree + 2)
        xi, weights = np.append(points, [-1.0, 1.0, 0.0]), np.append(weights, np.zeros(3)) * length / 2
        scale = np.sqrt((2 * np.arange(degree + 1) + 1) / length)
        derived = [legendre.legval(xi, legendre.legder(np.diag(scale), k)).T * (2 / length) ** k for k in range(3)]
        self.p, self.dp, self.ddp = derived
        self.x, self.weights = xi * length / 2, weights
        self.line, self.spin = density * area * weights, density * second * weights
        self.density, self.area, self.second, self.modulus = density, area, second, modulus
        # Cowper's shear coefficient of a rectangle, doi 10.1115/1.3625046
        self.shear = 10 * (1 + poisson) / (12 + 11 * poisson) * modulus / (2 * (1 + poisson)) * area

    def _gram(self, a: Array, b: Array) -> Array:
        return a.T @ (self.weights[:, None] * b)

    def _modes(self, stiffness: Array, rigid: int, count: int) -> tuple[Array, Array]:
        """Frequencies and coefficients, the rigid motions left out."""
        squares, vectors = eigh(stiffness, subset_by_index=(0, rigid + count - 1))
        return np.sqrt(squares[rigid:]), vectors[:, rigid:]

    def axial(self, count: int) -> tuple[Array, Array]:
        """Frequencies, displacement."""
        w, c = self._modes(self.modulus / self.density * self._gram(self.dp, self.dp), 1, count)
        return w, _unit_end(self.p @ c)[0]

    def euler_bernoulli(self, count: int) -> tuple[Array, Array, Array]:
        """Frequencies, deflection, slope."""
        rigidity = self.modulus * self.second / (self.density * self.area)
        w, c = self._modes(rigidity * self._gram(self.ddp, self.ddp), 2, count)
        v, slope = _unit_end(self.p @ c, self.dp @ c)
        return w, v, slope

    def timoshenko(self, count: int) -> tuple[Array, Array, Array]:
        """Frequencies, deflection, turn of the section."""
        a, b = np.sqrt(self.density * self.area), np.sqrt(self.density * self.second)
        slip = np.hstack([self.dp / a, -self.p / b])
        bend = np.hstack([np.zeros_like(self.p), self.dp / b])
        stiffness = self.shear * self._gram(slip, slip) + self.modulus * self.second * self._gram(bend, bend)
        w, c = self._modes(stiffness, 2, count)
        n = self.p.shape[1]
        v, turn = _unit_end(self.p @ c[:n] / a, self.p @ c[n:] / b)
        return w, v, turn


def _unit_end(*shapes: Array) -> tuple[Array, ...]:
    """Scale modes to a displacement of 1 at the bar's end, which is the first shape's last point but one."""
    return tuple(shape / shapes[0][-2] for shape in shapes)
