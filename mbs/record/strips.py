"""Strains, velocities and shapes of flexible links of finite elements, from the nodal coordinates of a record.

The formulas of the elements are written here anew, so that the energy ledger checks the engine. Strains have the engine's
integration points, as a run conserves the discrete energy. In an element the natural coordinate xi goes from -1 to 1. Indices in
`einsum` are: t times, e elements, g integration points, k nodes of an element, c coordinates.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..elements.beam import Flexible
from ..geometry import Array, cross

GAUSS = {n: np.polynomial.legendre.leggauss(n) for n in (1, 2, 3, 4)}
"""Points and weights of the Gauss quadrature on [-1, 1], by the number of points."""


class Strain(NamedTuple):
    """Generalised strain at its integration points; its energy is 1/2 stiffness sum(weights strain^2)."""

    stiffness: float
    damping: float
    weights: Array  # lengths [m], (elements, points)
    value: Array  # (times, elements, points)
    rate: Array  # (times, elements, points)

    @property
    def energy(self) -> Array:
        """Stored energy, J, shape (times,)."""
        return 0.5 * self.stiffness * np.einsum("teg,eg->t", self.value**2, self.weights)

    @property
    def power(self) -> Array:
        """Power lost to damping, W, shape (times,)."""
        return self.damping * np.einsum("teg,eg->t", self.rate**2, self.weights)


def _lagrange(count: int, xi: Array) -> tuple[Array, Array]:
    """Evaluate two or three Lagrange shape functions and their derivatives at xi, each (points, count)."""
    xi = np.asarray(xi)[:, None]
    if count == 2:
        return np.hstack([1 - xi, 1 + xi]) / 2, np.hstack([-np.ones_like(xi), np.ones_like(xi)]) / 2
    values = [xi * (xi - 1) / 2, 1 - xi * xi, xi * (xi + 1) / 2]
    return np.hstack(values), np.hstack([xi - 0.5, -2 * xi, xi + 0.5])


def _hermite(length: Array, xi: Array) -> tuple[Array, Array, Array]:
    """Evaluate the cubic Hermite functions of (r, r') at both nodes and their first and second derivatives by arc length at xi.

    Each has the shape (elements, points, 4); `length` is that of the elements [m], (elements, 1).
    """
    z = np.broadcast_to((np.asarray(xi) + 1) / 2, (len(length), len(xi)))
    n = (1 - 3 * z**2 + 2 * z**3, length * (z - 2 * z**2 + z**3), 3 * z**2 - 2 * z**3, length * (z**3 - z**2))
    d = ((6 * z**2 - 6 * z) / length, 1 - 4 * z + 3 * z**2, (6 * z - 6 * z**2) / length, 3 * z**2 - 2 * z)
    dd = ((12 * z - 6) / length**2, (6 * z - 4) / length, (6 - 12 * z) / length**2, (6 * z - 2) / length)
    value, first, second = (np.stack(np.broadcast_arrays(*parts), axis=-1) for parts in (n, d, dd))
    return value, first, second


@dataclass(frozen=True, eq=False)
class StripMotion:
    """Motion of a flexible link of finite elements; base class for beams and cables."""

    body: Flexible  # its `node_stride` is the number of nodes from one element to the next
    pieces: Array  # stress-free lengths of the elements [m]
    reference: Array  # stress-free coordinates of nodes: (x, y, theta) of beams, (x, y, dx/ds, dy/ds) of cables
    nodes: Mapping[str, int]  # node numbers of the link's points
    q: Array  # (times, nodes, coordinates), as `q_t` and `q_tt`
    q_t: Array
    q_tt: Array

    @property
    def length(self) -> float:
        """Stress-free arc length, m."""
        return float(self.pieces.sum())

    @property
    def mass(self) -> float:
        """Mass of the link, kg."""
        return self.body.section.mass_per_length * self.length

    def by_element(self, nodal: Array) -> Array:
        """Arrange nodal values (..., nodes, coordinates) by element: (..., elements, nodes of the element, coordinates)."""
        step = self.body.node_stride
        return nodal[..., np.arange(len(self.pieces))[:, None] * step + np.arange(step + 1), :]

    def point(self, name: str) -> tuple[Array, Array]:
        """Return place and velocity of a point, each (times, 2)."""
        node = self.nodes[name]
        return self.q[:, node, :2], self.q_t[:, node, :2]

    def centre(self) -> tuple[Array, Array, Array]:
        """Compute place, velocity and acceleration of the centre of mass, each (times, 2)."""
        weights = centre_weights(self.body, self.pieces)
        # columns of x and of y; for cables of (x, dx/ds) and of (y, dy/ds)
        x, y = (slice(0, 1), slice(1, 2)) if self.body.has_angles else (slice(0, None, 2), slice(1, None, 2))
        place, velocity, acceleration = (
            np.stack([(values[:, :, columns] * weights).sum(axis=(1, 2)) for columns in (x, y)], axis=1)
            for values in (self.q, self.q_t, self.q_tt)
        )
        return place, velocity, acceleration

    def lengths(self, weights: Array) -> Array:
        """Scale quadrature weights on [-1, 1] to lengths [m], shape (elements, points)."""
        return np.outer(self.pieces / 2, weights)

    def axial_force(self) -> Array:
        """Compute the mean elastic normal force along the strip [N], tension positive, shape (times,)."""
        axial, *_ = self.strains()
        return axial.stiffness * np.einsum("teg,eg->t", axial.value, axial.weights) / self.length

    def strains(self) -> list[Strain]:
        """Compute the axial, shear (beams only) and bending strains with their rates."""
        raise NotImplementedError

    def _fields(self, nodal: Array, xi: Array) -> tuple[Array, ...]:
        """Interpolate fields, of which x and y come first, and their derivatives by arc length at xi."""
        raise NotImplementedError

    def places(self, xi: Array) -> Array:
        """Compute positions at the natural coordinates xi of each element, shape (times, elements, points, 2)."""
        return self._fields(self.q, xi)[0][..., :2]

    def line(self, per_element: int = 4) -> Array:
        """Compute positions along the link, shape (times, elements * per_element + 1, 2)."""
        place = self.places(np.linspace(-1, 1, per_element + 1))
        inner = place[:, :, :-1].reshape(len(place), -1, 2)
        return np.concatenate([inner, place[:, -1:, -1]], axis=1)

    def middle(self) -> Array:
        """Compute the position of mid-length, shape (times, 2)."""
        ends = np.cumsum(self.pieces)
        k = int(np.searchsorted(ends, self.length / 2))  # element that contains the middle
        xi = 1.0 + 2.0 * (self.length / 2 - ends[k]) / self.pieces[k]
        return self.places(np.array([xi]))[:, k, 0]

    def arcs(self, per_element: int = 4) -> Array:
        """Compute the stress-free arc length [m] of each place of `line`."""
        edges = np.concatenate([[0.0], np.cumsum(self.pieces)])
        parts = np.outer(self.pieces, np.arange(per_element) / per_element)
        return np.append((edges[:-1, None] + parts).ravel(), edges[-1])


class BeamMotion(StripMotion):
    """Motion of a link of geometrically exact beams; nodes have (x, y, theta)."""

    def turn(self, name: str) -> tuple[Array, Array]:
        """Return the angle of a point's node from its stress-free angle, and its rate, each (times,)."""
        node = self.nodes[name]
        return self.q[:, node, 2] - self.reference[node, 2], self.q_t[:, node, 2]

    def quadrature(self) -> tuple[Array, Array, Array]:
        """Return nodal lengths [m], (nodes,), for integrals along the beam; places, with the turns since stress-free; rates."""
        return nodal_lengths(self.body, self.pieces), self.q - self.reference * [0.0, 0.0, 1.0], self.q_t

    def _fields(self, nodal: Array, xi: Array) -> tuple[Array, Array]:
        """Interpolate (x, y, theta) and their derivatives by arc length at xi, each (times, elements, points, 3)."""
        n, d = _lagrange(self.body.node_stride + 1, xi)
        values = self.by_element(nodal)
        return np.einsum("gk,tekc->tegc", n, values), np.einsum("gk,tekc->tegc", d, values) * (2 / self.pieces)[:, None, None]

    def strains(self) -> list[Strain]:
        """Compute Reissner's strains: (1 + eps, gamma) = R(theta)^T r', kappa = theta' - kappa_0 (doi 10.1007/BF01602645)."""
        section, material = self.body.section, self.body.section.material
        xi, weights = GAUSS[self.body.node_stride]
        weights = self.lengths(weights)
        (value, slope), (rate, slope_t) = self._fields(self.q, xi), self._fields(self.q_t, xi)
        value_0, slope_0 = self._fields(self.reference[None], xi)
        turn = value[..., 2] - value_0[..., 2]
        theta = turn + np.arctan2(slope_0[..., 1], slope_0[..., 0])  # as in the engine: no initial shear
        c, s, spin = np.cos(theta), np.sin(theta), rate[..., 2]
        axial, shear = c * slope[..., 0] + s * slope[..., 1], -s * slope[..., 0] + c * slope[..., 1]
        axial_t = c * slope_t[..., 0] + s * slope_t[..., 1] + spin * shear
        shear_t = -s * slope_t[..., 0] + c * slope_t[..., 1] - spin * axial
        end_angles = self.by_element(self.reference)[:, [0, -1], 2]
        # the engine takes a constant for an element
        kappa_0 = ((end_angles[:, 1] - end_angles[:, 0]) / self.pieces)[None, :, None]
        bending, ea = section.bending_stiffness, section.axial_stiffness
        return [
            Strain(ea, ea * material.axial_damping, weights, axial - 1, axial_t),
            Strain(section.shear_stiffness, 0.0, weights, shear, shear_t),
            Strain(bending, bending * material.bending_damping, weights, slope[..., 2] - kappa_0, slope_t[..., 2]),
        ]

    def kinetic(self) -> Array:
        """Compute the kinetic energy [J], shape (times,)."""
        section, (xi, weights) = self.body.section, GAUSS[4]
        rate, _ = self._fields(self.q_t, xi)
        density = np.array([section.mass_per_length, section.mass_per_length, section.inertia_per_length])
        return 0.5 * np.einsum("tegc,eg,c->t", rate**2, self.lengths(weights), density)


class CableMotion(StripMotion):
    """Motion of a link of ANCF cables; nodes have (x, y, dx/ds, dy/ds)."""

    def turn(self, name: str) -> tuple[Array, Array]:
        """Return the angle of a point's node from its stress-free angle, and its rate, each (times,)."""
        node = self.nodes[name]
        slope, rate, slope_0 = self.q[:, node, 2:], self.q_t[:, node, 2:], self.reference[node, 2:]
        angle = np.unwrap(np.arctan2(slope[:, 1], slope[:, 0]))
        return angle - np.arctan2(slope_0[1], slope_0[0]), cross(slope, rate) / (slope**2).sum(axis=1)

    def _fields(self, nodal: Array, xi: Array) -> tuple[Array, Array, Array]:
        """Interpolate position, first and second derivative by arc length at xi, each (times, elements, points, 2)."""
        values = self.by_element(nodal)  # times, elements, 2 nodes, 4
        values = values.reshape(*values.shape[:2], 4, 2)  # r and r' of the first node, then of the second
        n, d, dd = _hermite(self.pieces[:, None], xi)
        return tuple(np.einsum("egk,tekc->tegc", f, values) for f in (n, d, dd))

    def strains(self) -> list[Strain]:
        """Compute the stretch |r'| and kappa = r' x r''/|r'|^2, less their reference values, as the engine's ANCF cable does."""
        section, material = self.body.section, self.body.section.material
        xi, axial_weights = np.array([-1.0, 0.0, 1.0]), np.array([1.0, 4.0, 1.0]) / 3  # Lobatto quadrature
        (_, d, _), (_, d0, _), (_, d_t, _) = (self._fields(q, xi) for q in (self.q, self.reference[None], self.q_t))
        norm = np.linalg.norm(d, axis=-1)
        axial, axial_t = norm - np.linalg.norm(d0, axis=-1), (d * d_t).sum(-1) / norm
        xi, bending_weights = GAUSS[2]
        (_, d, dd), (_, d0, dd0), (_, d_t, dd_t) = (self._fields(q, xi) for q in (self.q, self.reference[None], self.q_t))
        square = (d * d).sum(-1)
        curvature = cross(d, dd) / square
        curvature_t = (cross(d_t, dd) + cross(d, dd_t)) / square - curvature * 2 * (d * d_t).sum(-1) / square
        bending, ea = section.bending_stiffness, section.axial_stiffness
        return [
            Strain(ea, ea * material.axial_damping, self.lengths(axial_weights), axial, axial_t),
            Strain(
                bending, bending * material.bending_damping, self.lengths(bending_weights),
                curvature - cross(d0, dd0) / (d0 * d0).sum(-1), curvature_t,
            ),
        ]  # fmt: skip

    def kinetic(self) -> Array:
        """Compute the kinetic energy [J], shape (times,)."""
        xi, weights = GAUSS[4]
        velocity, _, _ = self._fields(self.q_t, xi)
        return 0.5 * self.body.section.mass_per_length * np.einsum("tegc,eg->t", velocity**2, self.lengths(weights))


def centre_weights(body: Flexible, pieces: Array) -> Array:
    """Return the weights of nodal positions, and of slopes of a cable, in the centre of mass, shape (nodes, 1 or 2)."""
    step = body.node_stride
    # integrals over [0, 1] of the shape functions of value and slope at each node; `hermite` serves linear beams, too: their
    # functions of values have the same integrals 1/2, and slopes are left out below
    hermite, quadratic = [[0.5, 1 / 12], [0.5, -1 / 12]], [[1 / 6, 0.0], [2 / 3, 0.0], [1 / 6, 0.0]]
    local = quadratic if step == 2 else hermite
    weights = np.zeros((len(pieces) * step + 1, 2))
    for e, piece in enumerate(pieces):
        weights[e * step : e * step + step + 1] += np.array(local) * (1.0, piece) * piece / pieces.sum()
    return weights[:, :1] if body.has_angles else weights


def nodal_lengths(body: Flexible, pieces: Array) -> Array:
    """Integrate the shape functions along a beam: lengths [m] that distribute a load over the nodes, (nodes,)."""
    return np.asarray(centre_weights(body, pieces)[:, 0] * pieces.sum())
