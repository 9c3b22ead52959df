"""Mass and stiffness of links by scikit-fem: linear elasticity of solids, plane stress of planar meshes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from ..elements.section import Material
from ..geometry import Array
from ..validate import number, whole
from .mesh import corners_of, skfem


@dataclass(frozen=True, eq=False)
class Solid:
    """Finite-element matrices of a link; coordinates are node by node (ux, uy, uz), without uz for a planar mesh.

    Attributes
    ----------
    nodes : array, shape (n, 3)
        All interpolation nodes in link axes [m]: corners first, then mid-edge, mid-face and centre ones.
    cells : str, array of int, shape (cells, corners)
        Shape of the cells, and the nodes at their corners, as meshio has them.
    mass : sparse matrix, shape (n, n)
        The same for each direction [kg].
    stiffness : sparse matrix, shape (d n, d n)
        [N/m].
    length : float
        Distance of the joints [m].
    material : Material
    """

    nodes: Array
    cells: tuple[str, Array]
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
        """Modes of the free body that carry no flexibility: 6, or 3 in the plane."""
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


def assemble(grid: Any, length: float, material: Material, order: int = 2, width: float = 1.0) -> Solid:
    """Assemble mass and stiffness of linear elasticity.

    Parameters
    ----------
    grid : skfem.Mesh
        In link axes [m], of one kind of cells.
    length : float
        Distance of the joints [m].
    material : Material
        Isotropic; Poisson's ratio below 0.5.
    order : int
        Of the displacement, 1 or 2; 2 also on a mesh of first-order cells, as first-order ones lock in bending.
    width : float
        Size of a planar mesh normal to the plane [m], in plane stress.
    """
    fem = skfem()
    from skfem.models.elasticity import lame_parameters, linear_elasticity, plane_stress

    whole("order", order, 1, 2)
    nu = number("poisson", material.poisson, -0.999, 0.499, "1")
    shape, degree = type(grid).__name__[4:-1], type(grid).__name__[-1]  # MeshTet1, MeshHex2, ...
    element = getattr(fem, f"Element{shape}{'P' if shape in ('Tet', 'Tri') else ''}{order}")()
    points = 2 * order if degree == "1" else 2 * order + 2
    basis, vectors = (fem.Basis(grid, each, intorder=points) for each in (element, fem.ElementVector(element)))
    planar = grid.p.shape[0] == 2
    size, moduli = (width, plane_stress) if planar else (1.0, lame_parameters)
    mass = size * material.density * fem.BilinearForm(lambda u, v, _: u * v).assemble(basis)
    stiffness = size * linear_elasticity(*moduli(material.modulus, nu)).assemble(vectors)
    nodes = np.pad(basis.doflocs.T, ((0, 0), (0, 3 - grid.p.shape[0])))
    return Solid(nodes, corners_of(grid), mass.tocsr(), stiffness.tocsc(), length, material)


def rigid_motions(places: Array, dim: int = 3) -> Array:
    """Displacements of the six rigid motions (three translations, three rotations) about the origin, shape (3 n, 6).

    In two dimensions of the three in the plane, shape (2 n, 3).
    """
    x, y, z = np.asarray(places, dtype=float).T
    none, one = np.zeros_like(x), np.ones_like(x)
    rows = np.array([[one, none, none, none, z, -y], [none, one, none, -z, none, x], [none, none, one, y, -x, none]])
    kept = rows if dim == 3 else rows[:2, [0, 1, 5]]
    return kept.transpose(2, 0, 1).reshape(-1, kept.shape[1])
