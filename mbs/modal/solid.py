"""Mass, stiffness and modes of links by scikit-fem: linear elasticity of solids, plane stress of planar meshes.

All modes are mass-normalised, orthogonal to the rigid motions, and have the shape (modes, nodes, 3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from ..elements.section import Material
from ..geometry import Array
from ..validate import number
from .mesh import skfem

MOTIONS = ("axial", "in-plane bending", "out-of-plane bending", "torsion")
"""Motions of a mode; the first two move the link in the plane."""
SLABS = 24
"""Number of slices across the link by which modes are classified."""
IN_PLANE = 1e-6
"""Mean share of energy in the plane below which modes of equal frequency are not rotated: rounding leaves 1e-12."""
CLUSTER = 1e-3
"""Relative distance of frequencies that count as equal: two bending modes of a square bar may be any linear combinations."""


@dataclass(frozen=True, eq=False)
class Solid:
    """Finite-element matrices of a link; coordinates are node by node (ux, uy, uz), without uz for a planar mesh.

    `nodes` (n, 3) are all interpolation nodes in link axes [m]. `mass` (n, n) is the same for each direction [kg], `stiffness`
    (d n, d n) in N/m, `length` the distance of the joints [m].
    """

    nodes: Array
    mass: Any
    stiffness: Any
    length: float
    material: Material

    @property
    def dim(self) -> int:
        """Coordinates of a node: 3, or 2 for a planar mesh."""
        return int(self.stiffness.shape[0] // self.mass.shape[0])

    @property
    def rigid(self) -> int:
        """Number of rigid modes: 6, or 3 in the plane."""
        return self.dim * (self.dim + 1) // 2

    @cached_property
    def full_mass(self) -> Any:
        """Mass matrix of all coordinates, shape (d n, d n)."""
        return scipy.sparse.kron(self.mass, scipy.sparse.identity(self.dim), format="csc")

    @cached_property
    def weights(self) -> Array:
        """Nodal masses [kg]: the diagonal of the mass matrix scaled to the total (positive, unlike row sums)."""
        diagonal = self.mass.diagonal()
        return diagonal * (self.mass.sum() / diagonal.sum())

    @cached_property
    def centre(self) -> Array:
        """Centre of mass in link axes [m], shape (3,)."""
        return np.asarray(self.mass.sum(axis=0)).ravel() @ self.nodes / self.mass.sum()


def assemble(grid: Any, length: float, material: Material, width: float = 1.0) -> Solid:
    """Assemble mass and stiffness of linear elasticity with elements of second order, as first-order ones lock in bending.

    The mesh, in link axes [m], has one kind of cells; a planar one is `width` [m] thick normal to its plane, in plane stress.
    Poisson's ratio is below 0.5.
    """
    fem = skfem()
    from skfem.models.elasticity import lame_parameters, linear_elasticity, plane_stress

    nu = number("poisson", material.poisson, -0.999, 0.499, "1")
    shape, degree = type(grid).__name__[4:-1], type(grid).__name__[-1]  # MeshTet1, MeshHex2, ...
    element = getattr(fem, f"Element{shape}{'P' if shape in ('Tet', 'Tri') else ''}2")()
    points = 4 if degree == "1" else 6
    basis, vectors = (fem.Basis(grid, each, intorder=points) for each in (element, fem.ElementVector(element)))
    planar = grid.p.shape[0] == 2
    size, moduli = (width, plane_stress) if planar else (1.0, lame_parameters)
    mass = size * material.density * fem.BilinearForm(lambda u, v, _: u * v).assemble(basis)
    stiffness = size * linear_elasticity(*moduli(material.modulus, nu)).assemble(vectors)
    nodes = np.pad(basis.doflocs.T, ((0, 0), (0, 3 - grid.p.shape[0])))
    return Solid(nodes, mass.tocsr(), stiffness.tocsc(), length, material)


def rigid_motions(places: Array, dim: int = 3) -> Array:
    """Displacements of the six rigid motions (three translations, three rotations) about the origin, shape (3 n, 6).

    In two dimensions of the three in the plane, shape (2 n, 3).
    """
    x, y, z = np.asarray(places, dtype=float).T
    none, one = np.zeros_like(x), np.ones_like(x)
    rows = np.array([[one, none, none, none, z, -y], [none, one, none, -z, none, x], [none, none, one, y, -x, none]])
    kept = rows if dim == 3 else rows[:2, [0, 1, 5]]
    return kept.transpose(2, 0, 1).reshape(-1, kept.shape[1])


def free_modes(solid: Solid, count: int) -> tuple[Array, Array]:
    """Compute the lowest flexible modes of the unsupported link: frequencies [rad/s], shapes (count, nodes, 3) [1/sqrt(kg)]."""
    stiffness, mass = solid.stiffness, solid.full_mass
    speed = np.sqrt(solid.material.modulus / solid.material.density)
    shift = -1e-4 * (speed / solid.length) ** 2  # below all of them; the unshifted stiffness is singular
    factors = scipy.sparse.linalg.splu((stiffness - shift * mass).tocsc())
    squares, vectors = _lowest(stiffness, mass, count + solid.rigid, shift, factors)
    flexible = np.argsort(squares)[solid.rigid :]
    return _tidy(solid, np.sqrt(squares[flexible]), vectors[:, flexible])


def craig_bampton(solid: Solid, interfaces: tuple[Array, Array], fixed: int) -> tuple[Array, Array]:
    """Compute flexible Craig-Bampton modes (doi 10.2514/3.4741), made orthogonal: 6 static (3 in the plane) and vibrating ones.

    Each of two interfaces, given by its nodes, moves as a rigid body; `fixed` is the number of fixed-interface modes. The result
    is that of `free_modes`, as many as static and fixed ones.
    """
    dim, static = solid.dim, 2 * solid.rigid
    boundary = np.concatenate([np.add.outer(dim * nodes, np.arange(dim)).ravel() for nodes in interfaces])
    inner = np.setdiff1d(np.arange(dim * len(solid.nodes)), boundary)
    centred = (solid.nodes[nodes] - solid.nodes[nodes].mean(axis=0) for nodes in interfaces)
    motion = scipy.linalg.block_diag(*(rigid_motions(places, dim) for places in centred))
    stiffness, mass = solid.stiffness.tocsr(), solid.full_mass.tocsr()
    inside = stiffness[inner][:, inner].tocsc()
    factors = scipy.sparse.linalg.splu(inside)
    basis = np.zeros((dim * len(solid.nodes), static + fixed))
    basis[boundary, :static] = motion
    basis[inner, :static] = -factors.solve(stiffness[inner][:, boundary] @ motion)
    if fixed:
        _, basis[inner, static:] = _lowest(inside, mass[inner][:, inner].tocsc(), fixed, 0.0, factors)
    scale = np.sqrt(np.einsum("ij,ij->j", basis, mass @ basis))
    basis = basis / scale
    squares, mix = scipy.linalg.eigh(basis.T @ (stiffness @ basis), basis.T @ (mass @ basis))
    return _tidy(solid, np.sqrt(squares[solid.rigid :]), basis @ mix[:, solid.rigid :])


def _lowest(stiffness: Any, mass: Any, count: int, shift: float, factors: Any) -> tuple[Array, Array]:
    """Eigenvalues next to the shift, included in the factors, and eigenvectors."""
    inverse = scipy.sparse.linalg.LinearOperator(stiffness.shape, factors.solve)
    start = np.cos(np.arange(mass.shape[0]))  # a fixed vector: the same modes in each run
    found: tuple[Array, Array] = scipy.sparse.linalg.eigsh(stiffness, count, mass, shift, v0=start, OPinv=inverse)
    return found


def participation(solid: Solid, shapes: Array) -> Array:
    """Shares of each mode's kinetic energy by `MOTIONS`, shape (modes, 4): the cross-sections' rigid motion.

    What is missing to 1 deforms the sections.
    """
    return np.stack([np.einsum("kk->k", form) for form in _section_forms(solid, shapes)], axis=1)


def rigid_fit(solid: Solid, nodes: Array, about: Array, shapes: Array) -> tuple[Array, Array]:
    """Fit the mean motion of some nodes: mass-weighted least squares of a translation of the point `about` and a rotation.

    Both have the shape (modes, 3).
    """
    motion = rigid_motions(solid.nodes[nodes] - about)
    weights = np.repeat(np.sqrt(solid.weights[nodes]), 3)
    size = np.array([1.0, 1, 1, *np.full(3, 1 / solid.length)])  # one unit for all six columns
    field = shapes[:, nodes].reshape(len(shapes), 3 * len(nodes))
    fitted = size[:, None] * np.linalg.lstsq(weights[:, None] * motion * size, (weights * field).T, rcond=None)[0]
    return fitted[:3].T, fitted[3:].T


def slices(solid: Solid, count: int = SLABS) -> list[Array]:
    """Nodes of the slices across the link, from its one end to the other."""
    x = solid.nodes[:, 0]
    place = (x - x.min()) / np.ptp(x)
    number = np.minimum((place * count + 1e-9).astype(int), count - 1)
    return [found for found in (np.flatnonzero(number == k) for k in range(count)) if len(found)]


def _section_forms(solid: Solid, shapes: Array) -> Array:
    """Kinetic forms of the slices' rigid motion, shape (4, modes, modes), in the order of `MOTIONS`."""
    forms = np.zeros((4, len(shapes), len(shapes)))
    for nodes in slices(solid):
        weights = solid.weights[nodes]
        mass = weights.sum()
        arms = solid.nodes[nodes] - weights @ solid.nodes[nodes] / mass
        moments = np.einsum("n,na,nb->ab", weights, arms, arms)
        inertia = np.trace(moments) * np.eye(3) - moments
        move = np.einsum("n,kna->ka", weights, shapes[:, nodes]) / mass
        spin = np.einsum("n,kna->ka", weights, np.cross(arms, shapes[:, nodes]))
        turn = spin @ np.linalg.pinv(inertia, rcond=1e-9)
        linear = mass * np.einsum("ka,la->akl", move, move)
        rotary = 0.5 * np.einsum("ka,la->akl", turn, spin)
        rotary = rotary + rotary.transpose(0, 2, 1)
        forms += [linear[0], linear[1] + rotary[2], linear[2] + rotary[1], rotary[0]]
    return forms


def _tidy(solid: Solid, omega: Array, vectors: Array) -> tuple[Array, Array]:
    """Remove rigid motion left by rounding, normalise, fix linear combinations and signs."""
    mass, dim = solid.full_mass, solid.dim
    rigid = rigid_motions(solid.nodes - solid.centre, dim)
    vectors = vectors - rigid @ np.linalg.solve(rigid.T @ (mass @ rigid), rigid.T @ (mass @ vectors))
    shapes = (vectors / np.sqrt(np.einsum("ij,ij->j", vectors, mass @ vectors))).T.reshape(len(omega), -1, dim)
    shapes = np.pad(shapes, ((0, 0), (0, 0), (0, 3 - dim)))
    breaks = np.flatnonzero(np.diff(omega) > CLUSTER * omega[1:]) + 1
    # of modes of equal frequency the combination with most motion in the plane comes first
    for group in np.split(np.arange(len(omega)), breaks):
        if len(group) > 1:
            forms = _section_forms(solid, shapes[group])
            if np.trace(forms[0] + forms[1]) < IN_PLANE * len(group):
                continue
            _, mix = np.linalg.eigh(-(forms[0] + forms[1]) - 1e-3 * forms[0])
            shapes[group] = np.einsum("kl,kna->lna", mix, shapes[group])
            omega[group] = np.sqrt(mix.T**2 @ omega[group] ** 2)
    x = solid.nodes[:, 0]
    first = shapes[:, x <= x.min() + 0.05 * np.ptp(x)].sum(axis=1)
    strongest = np.take_along_axis(first, np.argmax(np.abs(first), axis=1)[:, None], axis=1)
    return omega, shapes * np.where(strongest < 0, -1.0, 1.0)[:, :, None]
