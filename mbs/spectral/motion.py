"""Motion of strips of the compiled solver as plain arrays, for records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..elements.section import Profile, Section
from ..geometry import Array, cross
from ..record.strips import Strain
from .basis import basis, gauss


@dataclass(frozen=True)
class Piece:
    """One polynomial piece."""

    start: float  # along the stress-free arc [m]
    end: float  # likewise
    places: Array  # of its coefficients among the strip's coordinates, (fields, members)

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return int(self.places.shape[1]) - 1

    @property
    def jacobian(self) -> float:
        """Arc per unit of the polynomial's variable, m."""
        return 0.5 * (self.end - self.start)


@dataclass(frozen=True, eq=False)
class SpectralStrip:
    """A flexible link of polynomials: Reissner's strip with three fields (x, y, angle), Kirchhoff's with two."""

    section: Section | Profile
    pieces: Sequence[Piece]
    stations: Mapping[str, float]  # arc length of each of the link's points [m]
    reference: Array  # stress-free coordinates, (coordinates,)
    q: Array  # (times, coordinates); its rates and second rates follow
    q_t: Array
    q_tt: Array

    @property
    def length(self) -> float:
        """Stress-free arc length, m."""
        return self.pieces[-1].end

    @property
    def mass(self) -> float:
        """Mass of the link [kg]."""
        return self.section.mass_per_length * self.length

    @property
    def shears(self) -> bool:
        """True for Reissner's strip, whose angle is a field."""
        return self.pieces[0].places.shape[0] == 3

    def _at(self, arc: float) -> tuple[Piece, float]:
        piece = next((p for p in self.pieces if arc <= p.end * (1 + 1e-12)), self.pieces[-1])
        return piece, float(np.clip((arc - piece.start) / piece.jacobian - 1.0, -1.0, 1.0))

    def _fields(self, values: Array, piece: Piece, x: Array, order: int = 0) -> Array:
        """Fields of coordinates (times, n) at x of a piece, or their derivatives by the arc: (times, points, fields)."""
        members = basis(piece.degree, x, order) / piece.jacobian**order
        return np.asarray((values[:, piece.places] @ members.T).swapaxes(1, 2))

    def point(self, name: str) -> tuple[Array, Array]:
        """Place and velocity of one of its points, each (times, 2)."""
        piece, x = self._at(self.stations[name])
        place, velocity = (self._fields(q, piece, np.array([x]))[:, 0, :2] for q in (self.q, self.q_t))
        return place, velocity

    def turn(self, name: str) -> tuple[Array, Array]:
        """Angle turned there since t = 0 and its rate, each (times,)."""
        piece, x = self._at(self.stations[name])
        at = np.array([x])
        if self.shears:
            before = self._fields(self.reference[None], piece, at)[0, 0, 2]
            return self._fields(self.q, piece, at)[:, 0, 2] - before, self._fields(self.q_t, piece, at)[:, 0, 2]
        slope, rate = (self._fields(q, piece, at, 1)[:, 0] for q in (self.q, self.q_t))
        first = self._fields(self.reference[None], piece, at, 1)[0, 0]
        angle = np.unwrap(np.arctan2(slope[:, 1], slope[:, 0])) - np.arctan2(first[1], first[0])
        angle = angle - 2 * np.pi * np.round(angle[0] / (2 * np.pi))
        return angle, cross(slope, rate) / (slope**2).sum(axis=1)

    def centre(self) -> tuple[Array, Array, Array]:
        """Place, velocity and acceleration of the centre of mass, each (times, 2)."""
        out = []
        for values in (self.q, self.q_t, self.q_tt):
            total = np.zeros((len(values), 2))
            for piece in self.pieces:
                x, w = gauss(piece.degree + 1)
                total += piece.jacobian * np.einsum("tgf,g->tf", self._fields(values, piece, x)[..., :2], w)
            out.append(total / self.length)
        return out[0], out[1], out[2]

    def kinetic(self) -> Array:
        """Kinetic energy, J, (times,)."""
        density = np.array([self.section.mass_per_length] * 2 + [self.section.inertia_per_length] * self.shears)
        total = np.zeros(len(self.q_t))
        for piece in self.pieces:
            x, w = gauss(piece.degree + 1)
            total += 0.5 * piece.jacobian * np.einsum("tgf,g,f->t", self._fields(self.q_t, piece, x) ** 2, w, density)
        return total

    def strains(self) -> list[Strain]:
        """Axial, shear (Reissner's only) and bending strains with their rates, at the points of all pieces."""
        parts = [self._strains(piece) for piece in self.pieces]
        weights = np.concatenate([p[0] for p in parts])[None]
        section, material = self.section, self.section.material
        ea, ei = section.axial_stiffness, section.bending_stiffness
        stiffness = (ea, section.shear_stiffness, ei)
        damping = (ea * material.axial_damping, 0.0, ei * material.bending_damping)
        out = []
        for i in range(3):
            if i == 1 and not self.shears:
                continue
            value, rate = (np.concatenate([p[k][i] for p in parts], axis=1)[:, None] for k in (1, 2))
            out.append(Strain(stiffness[i], damping[i], weights, value, rate))
        return out

    def _strains(self, piece: Piece) -> tuple[Array, list[Array], list[Array]]:
        """Weights; strains and their rates (axial, shear, bending), each (times, points), at the kernel's own points."""
        x, w = gauss(piece.degree if self.shears else piece.degree + 1)
        of = reissner if self.shears else kirchhoff
        order = 1 if self.shears else 2

        def fields(values: Array) -> list[Array]:
            """Return the displacement's derivatives by the arc, from order 0 up."""
            return [self._fields(values, piece, x, i) for i in range(order + 1)]

        value, rate = of(fields(self.q), fields(self.q_t))
        free, _ = of(fields(self.reference[None]), fields(0.0 * self.reference[None]))
        return w * piece.jacobian, [a - b for a, b in zip(value, free, strict=True)], rate

    def stations_of(self) -> tuple[Array, Array, Array]:
        """Gauss points of line loads: lengths (k,), (x, y, angle since t = 0) and their rates, (times, k, 3)."""
        lengths, fields, rates = [], [], []
        for piece in self.pieces:
            x, w = gauss(piece.degree + 3)
            free = self._fields(self.reference[None], piece, x) * [0.0, 0.0, 1.0]
            lengths.append(w * piece.jacobian)
            fields.append(self._fields(self.q, piece, x) - free)
            rates.append(self._fields(self.q_t, piece, x))
        return np.concatenate(lengths), np.concatenate(fields, axis=1), np.concatenate(rates, axis=1)

    def axial_force(self) -> Array:
        """Mean elastic normal force along the strip, N, tension positive, (times,)."""
        axial = self.strains()[0]
        return np.asarray(axial.stiffness * np.einsum("teg,eg->t", axial.value, axial.weights) / self.length)

    def line(self, per_element: int = 4) -> Array:
        """Positions along the link at equal distances along the arc, 8 `per_element` + 1 of them, (times, stations, 2)."""
        found = []
        for arc in self.arcs(per_element):
            piece, x = self._at(float(arc))
            found.append(self._fields(self.q, piece, np.array([x]))[:, 0, :2])
        return np.stack(found, axis=1)

    def middle(self) -> Array:
        """Position of mid-length, (times, 2)."""
        piece, x = self._at(self.length / 2)
        return self._fields(self.q, piece, np.array([x]))[:, 0, :2]

    def arcs(self, per_element: int = 4) -> Array:
        """Stress-free arc length, m, at each place of `line`."""
        return np.linspace(0.0, self.length, 8 * per_element + 1)


def reissner(q: list[Array], v: list[Array]) -> tuple[list[Array], list[Array]]:
    """Strains (axial, shear, bending) and rates of fields and their derivatives by the arc, q[order] (..., 3), rates v."""
    c, s, spin = np.cos(q[0][..., 2]), np.sin(q[0][..., 2]), v[0][..., 2]
    x, y, xt, yt = q[1][..., 0], q[1][..., 1], v[1][..., 0], v[1][..., 1]
    axial, shear = c * x + s * y, -s * x + c * y
    rates = [c * xt + s * yt + spin * shear, -s * xt + c * yt - spin * axial, v[1][..., 2]]
    return [axial - 1.0, shear, q[1][..., 2]], rates


def kirchhoff(q: list[Array], v: list[Array]) -> tuple[list[Array], list[Array]]:
    """Strains and rates of a strip without shear, likewise; fields (..., 2)."""
    d, dd, d_t, dd_t = q[1], q[2], v[1], v[2]
    square = (d**2).sum(axis=-1)
    norm, bend = np.sqrt(square), cross(d, dd) / square
    rate = (cross(d_t, dd) + cross(d, dd_t)) / square - bend * 2 * (d * d_t).sum(axis=-1) / square
    none = np.zeros_like(norm)
    return [norm - 1.0, none, bend], [(d * d_t).sum(axis=-1) / norm, none, rate]
