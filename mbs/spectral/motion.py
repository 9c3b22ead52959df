"""Motion of a strip of the compiled solver in a record: positions, strains and energies from the coefficients of its polynomials.

A piece has one polynomial of degree p for each field, x and y [m] and, with shear, the angle [rad]. Its variable xi runs from -1
to 1 along the piece. Derivatives are by the stress-free arc length. `times` are the rows of a run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..elements.section import Profile, Section
from ..geometry import Array, cross
from ..record.strips import Strain
from .basis import basis, gauss


@dataclass(frozen=True)
class Piece:
    """Polynomial piece of a strip."""

    start: float  # stress-free arc length at its start [m]
    end: float  # stress-free arc length at its end [m]
    dofs: Array  # indices of its coefficients among the coordinates, (fields, p + 1)

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return int(self.dofs.shape[1]) - 1

    @property
    def half_length(self) -> float:
        """Half of its arc length, which is the arc length per unit of xi [m]."""
        return 0.5 * (self.end - self.start)


def locate(pieces: Sequence[Piece], arc: float) -> tuple[Piece, float]:
    """Find the piece at an arc length [m], the first of two that meet there, and xi there; 1e-12 allows for rounding."""
    piece = next((p for p in pieces if arc <= p.end * (1 + 1e-12)), pieces[-1])
    return piece, float(np.clip((arc - piece.start) / piece.half_length - 1.0, -1.0, 1.0))


@dataclass(frozen=True, eq=False)
class SpectralStrip:
    """Motion of a flexible link: Reissner's strip with three fields (x, y, angle), Kirchhoff's with two."""

    section: Section | Profile
    pieces: Sequence[Piece]
    stations: Mapping[str, float]  # arc length of each of the link's points [m]
    reference: Array  # stress-free coordinates, which are those at t = 0, (coordinates,)
    q: Array  # coordinates, (times, coordinates)
    q_t: Array  # their rates
    q_tt: Array  # their second rates

    @property
    def length(self) -> float:
        """Stress-free arc length [m]."""
        return self.pieces[-1].end

    @property
    def mass(self) -> float:
        """Mass of the link [kg]."""
        return self.section.mass_per_length * self.length

    @property
    def shears(self) -> bool:
        """True for Reissner's strip, whose angle is a field."""
        return self.pieces[0].dofs.shape[0] == 3

    def _evaluate_fields(self, q: Array, piece: Piece, xi: Array, order: int = 0) -> Array:
        """Evaluate the fields of coordinates q (times, n) at xi, or derivatives of this order: (times, points, fields)."""
        functions = basis(piece.degree, xi, order) / piece.half_length**order
        return np.asarray((q[:, piece.dofs] @ functions.T).swapaxes(1, 2))

    def _evaluate_at(self, arc: float, q: Array, order: int = 0) -> Array:
        """Evaluate the fields of coordinates q (times, n) at an arc length [m], or derivatives of this order: (times, fields)."""
        piece, xi = locate(self.pieces, arc)
        return self._evaluate_fields(q, piece, np.array([xi]), order)[:, 0]

    def point(self, name: str) -> tuple[Array, Array]:
        """Return position [m] and velocity [m/s] of one of the link's points, each (times, 2)."""
        arc = self.stations[name]
        return self._evaluate_at(arc, self.q)[:, :2], self._evaluate_at(arc, self.q_t)[:, :2]

    def turn(self, name: str) -> tuple[Array, Array]:
        """Return the angle [rad] by which the strip has turned at a point since t = 0, and its rate, each (times,)."""
        arc, order = self.stations[name], 0 if self.shears else 1
        (start,), fields, rate = (self._evaluate_at(arc, q, order) for q in (self.reference[None], self.q, self.q_t))
        if self.shears:
            return fields[:, 2] - start[2], rate[:, 2]
        tangent = fields  # (x', y')
        angle = np.unwrap(np.arctan2(tangent[:, 1], tangent[:, 0])) - np.arctan2(start[1], start[0])
        angle = angle - 2 * np.pi * np.round(angle[0] / (2 * np.pi))  # so that the first one is within half a turn
        return angle, cross(tangent, rate) / (tangent**2).sum(axis=1)

    def centre(self) -> tuple[Array, Array, Array]:
        """Integrate position, velocity and acceleration of the centre of mass, each (times, 2)."""
        out = []
        for values in (self.q, self.q_t, self.q_tt):
            total = np.zeros((len(values), 2))
            for piece in self.pieces:
                xi, w = gauss(piece.degree + 1)
                total += piece.half_length * np.einsum("tgf,g->tf", self._evaluate_fields(values, piece, xi)[..., :2], w)
            out.append(total / self.length)
        return out[0], out[1], out[2]

    def kinetic(self) -> Array:
        """Integrate the kinetic energy [J], (times,)."""
        # a third entry, for the angle, if the strip shears: Kirchhoff's strip has no rotary inertia
        density = np.array([self.section.mass_per_length] * 2 + [self.section.inertia_per_length] * self.shears)
        total = np.zeros(len(self.q_t))
        for piece in self.pieces:
            xi, w = gauss(piece.degree + 1)  # exact for squares of polynomials
            squares = self._evaluate_fields(self.q_t, piece, xi) ** 2
            total += 0.5 * piece.half_length * np.einsum("tgf,g,f->t", squares, w, density)
        return total

    def strains(self) -> list[Strain]:
        """Compute axial, shear (Reissner's only) and bending strains and their rates at the Gauss points of all pieces."""
        weights, strains, rates = zip(*(self._compute_strains(piece) for piece in self.pieces), strict=True)  # of each piece
        section, material = self.section, self.section.material
        ea, ei = section.axial_stiffness, section.bending_stiffness
        stiffness = (ea, section.shear_stiffness, ei)
        damping = (ea * material.axial_damping, 0.0, ei * material.bending_damping)  # a `Material` has none for shear
        out = []
        for i in (0, 1, 2) if self.shears else (0, 2):
            value = np.concatenate([strain[i] for strain in strains], axis=1)
            rate = np.concatenate([strain_rate[i] for strain_rate in rates], axis=1)
            # `Strain` has an axis for finite elements: the strip counts as one
            out.append(Strain(stiffness[i], damping[i], np.concatenate(weights)[None], value[:, None], rate[:, None]))
        return out

    def _compute_strains(self, piece: Piece) -> tuple[Array, list[Array], list[Array]]:
        """Compute weights [m], strains (axial, shear, bending) less stress-free ones, and rates of a piece, (times, points)."""
        # the solver's points, see docs/theory-spectral.md, Bodies
        xi, w = gauss(piece.degree if self.shears else piece.degree + 1)
        strains_of, order = (reissner, 1) if self.shears else (kirchhoff, 2)
        states = (self.q, self.q_t, self.reference[None])
        fields, field_rates, free_fields = ([self._evaluate_fields(q, piece, xi, i) for i in range(order + 1)] for q in states)
        strain, rate = strains_of(fields, field_rates)
        free, _ = strains_of(free_fields, [0.0 * each for each in free_fields])
        return w * piece.half_length, [a - b for a, b in zip(strain, free, strict=True)], rate

    def quadrature(self) -> tuple[Array, Array, Array]:
        """Evaluate weights [m] (points,), (x, y, turn) (times, points, 3) and their rates at the Gauss points of line loads."""
        weights, fields, rates = [], [], []
        for piece in self.pieces:  # of Reissner's strip, the only one that takes line loads; its turn is that since t = 0
            xi, w = gauss(piece.degree + 3)  # the points at which `registry.add_line_load` puts the load
            start_angle = self._evaluate_fields(self.reference[None], piece, xi) * [0.0, 0.0, 1.0]
            weights.append(w * piece.half_length)
            fields.append(self._evaluate_fields(self.q, piece, xi) - start_angle)
            rates.append(self._evaluate_fields(self.q_t, piece, xi))
        return np.concatenate(weights), np.concatenate(fields, axis=1), np.concatenate(rates, axis=1)

    def axial_force(self) -> Array:
        """Compute the mean elastic normal force along the strip [N, tension positive], (times,)."""
        axial = self.strains()[0]
        return np.asarray(axial.stiffness * np.einsum("teg,eg->t", axial.value, axial.weights) / self.length)

    def line(self, per_element: int = 4) -> Array:
        """Evaluate positions along the link at the arc lengths of `arcs`, (times, arc lengths, 2)."""
        return np.stack([self._evaluate_at(float(arc), self.q)[:, :2] for arc in self.arcs(per_element)], axis=1)

    def middle(self) -> Array:
        """Evaluate the position of mid-length, (times, 2)."""
        return self._evaluate_at(self.length / 2, self.q)[:, :2]

    def arcs(self, per_element: int = 4) -> Array:
        """Return the equally spaced stress-free arc lengths [m] of `line`: as many as of 8 finite elements, a chosen number."""
        return np.linspace(0.0, self.length, 8 * per_element + 1)


def reissner(q: list[Array], v: list[Array]) -> tuple[list[Array], list[Array]]:
    """Compute Reissner's strains (axial, shear, bending) and their rates from fields (..., 3).

    q[i] is the derivative of order i of the fields (x, y, theta) by the arc length, v[i] its rate:

        eps = cos theta x' + sin theta y' - 1,   gamma = -sin theta x' + cos theta y',   kappa = theta'.
    """
    c, s, spin = np.cos(q[0][..., 2]), np.sin(q[0][..., 2]), v[0][..., 2]
    x, y, xt, yt = q[1][..., 0], q[1][..., 1], v[1][..., 0], v[1][..., 1]
    # x, y are the derivatives x', y'; xt, yt their rates
    axial, shear = c * x + s * y, -s * x + c * y
    rates = [c * xt + s * yt + spin * shear, -s * xt + c * yt - spin * axial, v[1][..., 2]]
    return [axial - 1.0, shear, q[1][..., 2]], rates


def kirchhoff(q: list[Array], v: list[Array]) -> tuple[list[Array], list[Array]]:
    """Compute Kirchhoff's strains and rates, r = (x, y): eps = |r'| - 1, no shear, kappa = (x' y'' - y' x'')/|r'|^2."""
    d, dd, d_t, dd_t = q[1], q[2], v[1], v[2]
    square = (d**2).sum(axis=-1)
    norm, curvature = np.sqrt(square), cross(d, dd) / square
    rate = (cross(d_t, dd) + cross(d, dd_t)) / square - curvature * 2 * (d * d_t).sum(axis=-1) / square
    shear = np.zeros_like(norm)
    return [norm - 1.0, shear, curvature], [(d * d_t).sum(axis=-1) / norm, shear, rate]
