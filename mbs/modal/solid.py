"""Mass, stiffness and modes of links by finite elements of scikit-fem: linear elasticity, plane stress of planar meshes.

Modes are normalised to modal masses of 1, are orthogonal to rigid motions, and have the shape (modes, nodes, 3).
"""

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
"""Motions of cross-sections by which modes are classified; the first two are in the plane of motion."""
SLABS = 24
"""Number of slices, normal to the link, whose rigid motions classify a mode: four in a half-wave of the sixth bending mode."""


@dataclass(frozen=True, eq=False)
class Solid:
    """Finite-element matrices of a link with n nodes of d coordinates (ux, uy, uz), without uz for a planar mesh.

    `nodes` (n, 3) are in link axes [m]. `mass` (n, n) [kg] is the same for each direction; `stiffness` (d n, d n) [N/m] is
    ordered node by node. `length` is the distance of the joints [m].
    """

    nodes: Array
    mass: Any
    stiffness: Any
    length: float
    material: Material

    @property
    def dim(self) -> int:
        """Number d of coordinates of a node: 3, or 2 for a planar mesh."""
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
        """Lumped masses of the nodes [kg]: diagonal of the mass matrix, scaled to the total mass, as row sums can be negative."""
        diagonal = self.mass.diagonal()
        return diagonal * (self.mass.sum() / diagonal.sum())

    @cached_property
    def centre(self) -> Array:
        """Centre of mass in link axes [m], shape (3,)."""
        return np.asarray(self.mass.sum(axis=0)).ravel() @ self.nodes / self.mass.sum()


def assemble(grid: Any, length: float, material: Material, width: float = 1.0) -> Solid:
    """Assemble mass and stiffness matrices with elements of second order, as elements of first order lock in bending.

    The mesh is in link axes [m]; a planar mesh is `width` [m] thick normal to its plane. Poisson's ratio is below 0.5.
    """
    fem = skfem()
    from skfem.models.elasticity import lame_parameters, linear_elasticity, plane_stress

    nu = number("poisson", material.poisson, -0.999, 0.499, "1")
    mesh, degree = type(grid).__name__[:-1], type(grid).__name__[-1]  # MeshTet1 has straight cells, MeshTet2 curved ones
    second_order = {"MeshTet": "TetP2", "MeshHex": "Hex2", "MeshTri": "TriP2", "MeshQuad": "Quad2"}
    element = getattr(fem, f"Element{second_order[mesh]}")()
    order = 4 if degree == "1" else 6  # of the quadrature; more for curved cells
    basis, vectors = (fem.Basis(grid, kind, intorder=order) for kind in (element, fem.ElementVector(element)))
    planar = grid.p.shape[0] == 2
    thickness, compute_lame = (width, plane_stress) if planar else (1.0, lame_parameters)  # both give Lame's two parameters
    mass = thickness * material.density * fem.BilinearForm(lambda u, v, _: u * v).assemble(basis)
    stiffness = thickness * linear_elasticity(*compute_lame(material.modulus, nu)).assemble(vectors)
    nodes = np.pad(basis.doflocs.T, ((0, 0), (0, 3 - grid.p.shape[0])))
    return Solid(nodes, mass.tocsr(), stiffness.tocsc(), length, material)


def rigid_motions(places: Array, dim: int = 3) -> Array:
    """Return the displacements of n places in 3 translations and 3 rotations, (3 n, 6); in the plane in 3 motions, (2 n, 3)."""
    x, y, z = np.asarray(places, dtype=float).T
    o, one = np.zeros_like(x), np.ones_like(x)
    motions = np.array([[one, o, o, o, z, -y], [o, one, o, -z, o, x], [o, o, one, y, -x, o]])
    motions = motions if dim == 3 else motions[:2, [0, 1, 5]]
    return motions.transpose(2, 0, 1).reshape(-1, motions.shape[1])


def free_modes(solid: Solid, count: int) -> tuple[Array, Array]:
    """Compute the lowest flexible modes of the unsupported link: frequencies [rad/s], shapes (count, nodes, 3) [1/sqrt(kg)]."""
    stiffness, mass = solid.stiffness, solid.full_mass
    speed = np.sqrt(solid.material.modulus / solid.material.density)
    # below 0, so that K - shift M is regular; its size is chosen: the first eigenvalue of a free bar with length/thickness = 650
    shift = -1e-4 * (speed / solid.length) ** 2
    factors = scipy.sparse.linalg.splu((stiffness - shift * mass).tocsc())
    squares, vectors = _lowest(stiffness, mass, count + solid.rigid, shift, factors)
    flexible = np.argsort(squares)[solid.rigid :]
    return _normalise(solid, np.sqrt(squares[flexible]), vectors[:, flexible])


def craig_bampton(solid: Solid, interfaces: tuple[Array, Array], fixed: int) -> tuple[Array, Array]:
    """Compute Craig-Bampton modes (doi 10.2514/3.4741): static modes of rigid interfaces, and vibrations with fixed ones.

    An interface is an array of node numbers. `fixed` is the number of vibrations. Each of the two interfaces has 6 static modes
    (in the plane 3). The eigenvalue problem in the span of all makes them orthogonal. Without the rigid motions of the link
    6 + `fixed` modes are left (in the plane 3 + `fixed`). They are returned as by `free_modes`.
    """
    dim, static = solid.dim, 2 * solid.rigid  # number of static modes: each interface has as many as the link has rigid ones
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
    basis = basis / np.sqrt(np.einsum("ij,ij->j", basis, mass @ basis))  # unit modal masses: columns differ in unit and size
    squares, mix = scipy.linalg.eigh(basis.T @ (stiffness @ basis), basis.T @ (mass @ basis))
    return _normalise(solid, np.sqrt(squares[solid.rigid :]), basis @ mix[:, solid.rigid :])


def _lowest(stiffness: Any, mass: Any, count: int, shift: float, factors: Any) -> tuple[Array, Array]:
    """Compute eigenvalues next to a shift, and eigenvectors; `factors` is the LU decomposition of K - shift M."""
    inverse = scipy.sparse.linalg.LinearOperator(stiffness.shape, factors.solve)
    start = np.cos(np.arange(mass.shape[0]))  # not random: the same modes in each run
    return scipy.sparse.linalg.eigsh(stiffness, count, mass, shift, v0=start, OPinv=inverse)


def participation(solid: Solid, shapes: Array) -> Array:
    """Compute shares of each mode's kinetic energy in `MOTIONS` of rigid sections, (modes, 4); the rest deforms sections."""
    return np.stack([np.einsum("kk->k", form) for form in _section_forms(solid, shapes)], axis=1)


def rigid_fit(solid: Solid, nodes: Array, about: Array, shapes: Array) -> tuple[Array, Array]:
    """Fit displacement of the point `about` and rotation, (modes, 3) each, to some nodes by least squares weighted by mass."""
    motion = rigid_motions(solid.nodes[nodes] - about)
    weights = np.repeat(np.sqrt(solid.weights[nodes]), 3)
    size = np.array([1.0, 1, 1, *np.full(3, 1 / solid.length)])  # the unknowns are displacements, and rotations times length
    field = shapes[:, nodes].reshape(len(shapes), 3 * len(nodes))
    fitted = size[:, None] * np.linalg.lstsq(weights[:, None] * motion * size, (weights * field).T, rcond=None)[0]
    return fitted[:3].T, fitted[3:].T


def slices(solid: Solid) -> list[Array]:
    """Divide the nodes into `SLABS` slices of equal thickness along x; return the node numbers of each that has nodes."""
    x = solid.nodes[:, 0]
    number = np.minimum(((x - x.min()) / np.ptp(x) * SLABS + 1e-9).astype(int), SLABS - 1)  # 1e-9: against rounding
    return [nodes for nodes in (np.flatnonzero(number == k) for k in range(SLABS)) if len(nodes)]


def _section_forms(solid: Solid, shapes: Array) -> Array:
    """Compute parts of the modes' mass matrix by rigid motions of slices, (4, modes, modes), in the order of `MOTIONS`."""
    forms = np.zeros((4, len(shapes), len(shapes)))
    for nodes in slices(solid):
        weights = solid.weights[nodes]
        mass = weights.sum()
        arms = solid.nodes[nodes] - weights @ solid.nodes[nodes] / mass
        moments = np.einsum("n,na,nb->ab", weights, arms, arms)
        inertia = np.trace(moments) * np.eye(3) - moments
        translation = np.einsum("n,kna->ka", weights, shapes[:, nodes]) / mass
        spin_momentum = np.einsum("n,kna->ka", weights, np.cross(arms, shapes[:, nodes]))
        rotation = spin_momentum @ np.linalg.pinv(inertia, rcond=1e-9)  # singular for nodes on a line
        linear = mass * np.einsum("ka,la->akl", translation, translation)
        rotary = np.einsum("ka,la->akl", rotation, spin_momentum)
        # the sum over the axes is symmetric; the part of one axis is not, as the inertia of a slice may couple them
        rotary = 0.5 * (rotary + rotary.transpose(0, 2, 1))
        bending, out_of_plane = linear[1] + rotary[2], linear[2] + rotary[1]  # along y and about z; along z and about y
        forms += [linear[0], bending, out_of_plane, rotary[0]]
    return forms


def _normalise(solid: Solid, omega: Array, vectors: Array) -> tuple[Array, Array]:
    """Remove the rigid motion that rounding left, scale to modal masses of 1, make linear combinations and signs unique.

    Of modes with equal frequencies, the combination with most motion in the plane comes first. Of a mode's displacements, summed
    over the nodes in the first 5 % (chosen) of the length, the largest component is positive.
    """
    mass, dim = solid.full_mass, solid.dim
    motions = rigid_motions(solid.nodes - solid.centre, dim)
    vectors = vectors - motions @ np.linalg.solve(motions.T @ (mass @ motions), motions.T @ (mass @ vectors))
    shapes = (vectors / np.sqrt(np.einsum("ij,ij->j", vectors, mass @ vectors))).T.reshape(len(omega), -1, dim)
    shapes = np.pad(shapes, ((0, 0), (0, 0), (0, 3 - dim)))
    breaks = np.flatnonzero(np.diff(omega) > 1e-3 * omega[1:]) + 1  # up to 1e-3, chosen, frequencies count as equal
    for group in np.split(np.arange(len(omega)), breaks):
        if len(group) > 1:
            forms = _section_forms(solid, shapes[group])
            in_plane = forms[0] + forms[1]  # axial motion and in-plane bending
            if np.trace(in_plane) < 1e-6 * len(group):  # no share to sort the modes by; rounding gives 1e-12
                continue
            # eigenvalues ascend: the most motion in the plane is first; the small term orders axial before bending
            _, mix = np.linalg.eigh(-in_plane - 1e-3 * forms[0])
            shapes[group] = np.einsum("kl,kna->lna", mix, shapes[group])
            omega[group] = np.sqrt(mix.T**2 @ omega[group] ** 2)  # Rayleigh quotients
    x = solid.nodes[:, 0]
    sums = shapes[:, x <= x.min() + 0.05 * np.ptp(x)].sum(axis=1)
    largest = np.take_along_axis(sums, np.argmax(np.abs(sums), axis=1)[:, None], axis=1)
    return omega, shapes * np.where(largest < 0, -1.0, 1.0)[:, :, None]
