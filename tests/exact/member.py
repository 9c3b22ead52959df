"""A piece of a Timoshenko member that vibrates: its exact dynamic stiffness. `exact.vibration` tells the equations."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, isfinite, pi, sqrt

import numpy as np

from buckler.elastica.collocation import Array


@dataclass(frozen=True)
class Member:
    """A uniform straight member.

    Attributes
    ----------
    length : float, m, positive
    bending : float, E I, N m^2, positive
    mass : float, rho A, kg/m, positive
    shear : float, k G A, N, positive; infinite without shear deformation
    rotary : float, rho I, kg m, 0 or positive
    axial : float, E A, N, positive; infinite where only bending is asked for
    """

    length: float
    bending: float
    mass: float
    shear: float = inf
    rotary: float = 0.0
    axial: float = inf

    @classmethod
    def rectangle(cls, thickness: float) -> Member:
        """Member of unit length, width, modulus and density that bends across its thickness, k = 5/6, nu = 0.3."""
        shear = 5 / 6 / 2.6 * thickness
        return cls(1.0, thickness**3 / 12.0, thickness, shear, thickness**3 / 12.0, thickness)

    @property
    def unit(self) -> float:
        """sqrt(E I/(rho A L^4)), rad/s: what the frequencies of a slender member are numbers of."""
        return sqrt(self.bending / self.mass) / self.length**2


def pieces(member: Member, frequency: float) -> int:
    """Into how many pieces a member is cut so that none, both ends held, vibrates below the frequency.

    Half of the lowest clamped frequency of bending alone, of shear alone, of stretching and of turning each stay above.
    """
    per_length = [sqrt(2.0 * frequency * sqrt(member.mass / member.bending) / 22.37)]
    per_length.append(2.0 * frequency * sqrt(member.mass / member.shear) / pi)
    per_length.append(2.0 * frequency * sqrt(member.rotary / member.bending) / pi)
    per_length.append(2.0 * frequency * sqrt(member.mass / member.axial) / pi)
    return max(1, ceil(member.length * sqrt(sum(value**2 for value in per_length))))


def _entire(A: float) -> tuple[float, float]:
    """cosh(sqrt(A)) and sinh(sqrt(A))/sqrt(A), entire functions of A."""
    root = sqrt(abs(A))
    if root < 1e-4:
        return 1.0 + A / 2.0, 1.0 + A / 6.0
    return (float(np.cosh(root)), float(np.sinh(root)) / root) if A > 0.0 else (float(np.cos(root)), float(np.sin(root)) / root)


def _exponents(b2: float, b2r2: float, q: float) -> list[tuple[float, float]]:
    """(A, A + q) of both exponents of (1), without cancellation: the products are -b^2 (1 - q r^2) and -b^2."""
    root = sqrt((q - b2r2) ** 2 / 4.0 + b2)
    low = -(q + b2r2) / 2.0 - root
    high = -(b2 - q * b2r2) / low
    plus = (q - b2r2) / 2.0
    if plus > 0.0:
        return [(low, -b2 / (plus + root)), (high, plus + root)]
    return [(low, plus - root), (high, -b2 / (plus - root))]


def piece_stiffness(member: Member, length: float, frequency: float) -> Array:
    """Dynamic stiffness (u, w, theta at both ends) of a piece in its own axes, N, N m and so on, shape (6, 6)."""
    b2 = member.mass * frequency**2 * length**4 / member.bending
    b2r2 = member.rotary * frequency**2 * length**2 / member.bending
    q = member.mass * frequency**2 * length**2 / member.shear
    motion, force = np.zeros((4, 4)), np.zeros((4, 4))
    for k, (A, Aq) in enumerate(_exponents(b2, b2r2, q)):
        for row, (C, S), sense in ((0, (1.0, 0.0), -1.0), (2, _entire(A), 1.0)):
            motion[row : row + 2, 2 * k : 2 * k + 2] = ((C, A * S), (Aq * S, Aq * C))
            force[row : row + 2, 2 * k : 2 * k + 2] = ((-sense * b2 * S, -sense * b2 * C), (sense * Aq * C, sense * Aq * A * S))
    bending = np.linalg.solve(motion.T, force.T).T
    scale = np.tile((1.0 / length, 1.0), 2)
    bending = (bending + bending.T) / 2.0 * np.outer(scale, scale) * member.bending / length
    whole = np.zeros((6, 6))
    across = np.array((1, 2, 4, 5))
    whole[np.ix_(across, across)] = bending
    if isfinite(member.axial):
        angle = frequency * length * sqrt(member.mass / member.axial)
        cot, inverse = angle / np.tan(angle), angle / np.sin(angle)
        whole[np.ix_((0, 3), (0, 3))] = member.axial / length * np.array(((cot, -inverse), (-inverse, cot)))
    return whole


def turned(stiffness: Array, along: Array) -> Array:
    """A piece's stiffness in the axes of the frame, for the direction cosines of its axis."""
    c, s = along
    turn = np.kron(np.eye(2), np.array(((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0))))
    return turn.T @ stiffness @ turn
