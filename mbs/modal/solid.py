"""Solid links in three dimensions: meshes in the link's own axes, and their mass and stiffness by finite elements.

Link axes: origin at the start joint's centre, x towards the end joint's centre, y in the plane of motion to the left of
x, z normal to it. Assembly is scikit-fem's, files are meshio's; both come with pip install 'buckler[modal]'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from ..elements.section import Material
from ..geometry import Array
from ..validate import number, positive, whole

TETRA = tuple(combinations(range(4), 3))
HEXAHEDRON = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
"""Corners of a cell's faces; of a hexahedron in the order of its 27-node form: -x, +x, -y, +y, -z, +z."""
ON = 1e-6
"""Distance from a face, relative to its size, within which a node lies on it."""


def hanging(points: Array, cells: Array, kind: str) -> Array:
    """Corner nodes that lie on a face of a cell they are no corner of; none if the mesh is conforming.

    Faces are matched by their corners. Those that no second cell has are the surface: there, no other corner lies on a face.

    Parameters
    ----------
    points : array, shape (nodes, 3)
    cells : array of int, shape (cells, nodes a cell)
    kind : str
        'tetra...' or 'hexahedron...', corners first.

    Returns
    -------
    array of int
    """
    faces = np.concatenate([cells[:, list(face)] for face in (TETRA if kind.startswith("tetra") else HEXAHEDRON)])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    surface = faces[first[count == 1]]
    corners = np.unique(surface)
    triangles = surface if surface.shape[1] == 3 else np.concatenate([surface[:, [0, 1, 2]], surface[:, [0, 2, 3]]])
    owners = surface if surface.shape[1] == 3 else np.concatenate([surface, surface])
    a, b, c = (points[triangles[:, k]] for k in range(3))
    middle = (a + b + c) / 3
    radius = np.max([np.linalg.norm(corner - middle, axis=1) for corner in (a, b, c)], axis=0)
    near = scipy.spatial.cKDTree(points[corners]).query_ball_point(middle, radius * (1 + ON))
    face = np.repeat(np.arange(len(triangles)), [len(found) for found in near])
    node = corners[np.concatenate([np.asarray(found, dtype=int) for found in near])]
    foreign = (owners[face] != node[:, None]).all(axis=1)
    face, node = face[foreign], node[foreign]
    return np.unique(node[_on(points[node] - a[face], (b - a)[face], (c - a)[face])])


def _on(place: Array, u: Array, v: Array) -> Array:
    """Whether places lie on triangles with the corners 0, u, v."""
    normal = np.cross(u, v)
    square = (normal**2).sum(axis=1)
    size = np.sqrt(np.maximum((u**2).sum(axis=1), (v**2).sum(axis=1)))
    off = np.abs((place * normal).sum(axis=1)) / np.sqrt(square)
    s = (np.cross(place, v) * normal).sum(axis=1) / square
    t = (np.cross(u, place) * normal).sum(axis=1) / square
    found: Array = (off <= ON * size) & (s >= -ON) & (t >= -ON) & (s + t <= 1 + ON)
    return found


KINDS = {"tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20, "hexahedron27": 27}
"""Cells that are read, by meshio's names, with their numbers of nodes."""
RING = [(k, (k + 1) % 4) for k in range(4)]
EDGES = (*RING, *((a + 4, b + 4) for a, b in RING), *((k, k + 4) for k in range(4)))
"""Corners of a hexahedron's edges, in the order of the mid-edge nodes: below, above, between."""


@dataclass(frozen=True, eq=False)
class SolidMesh:
    """A solid mesh of one kind of cell, in link axes.

    Attributes
    ----------
    points : array, shape (nodes, 3)
        m; the joints' centres are (0, 0, 0) and (length, 0, 0).
    cells : array of int, shape (cells, nodes a cell)
        In meshio's order.
    kind : str
        One of `KINDS`.
    length : float
        Distance of the joints' centres, m.
    """

    points: Array
    cells: Array
    kind: str
    length: float


@dataclass(frozen=True, eq=False)
class Solid:
    """Finite-element matrices of a link; coordinates are node by node (ux, uy, uz).

    Attributes
    ----------
    nodes : array, shape (n, 3)
        All interpolation nodes in link axes, m; mid-edge, mid-face and centre ones too.
    mass : sparse matrix, shape (n, n)
        The same for each direction, kg.
    stiffness : sparse matrix, shape (3 n, 3 n)
        N/m.
    """

    nodes: Array
    mass: Any
    stiffness: Any
    length: float
    material: Material

    @cached_property
    def full_mass(self) -> Any:
        """Mass matrix of all coordinates, shape (3 n, 3 n)."""
        return scipy.sparse.kron(self.mass, scipy.sparse.identity(3), format="csc")

    @cached_property
    def weights(self) -> Array:
        """Nodal masses, kg: the diagonal of the mass matrix scaled to the total (positive, unlike row sums)."""
        diagonal = self.mass.diagonal()
        return diagonal * (self.mass.sum() / diagonal.sum())

    @cached_property
    def centre(self) -> Array:
        """Centre of mass in link axes, m, shape (3,)."""
        return np.asarray(self.mass.sum(axis=0)).ravel() @ self.nodes / self.mass.sum()


def box_mesh(length: float, depth: float, width: float, elements: Sequence[int] = (16, 2, 1)) -> SolidMesh:
    """Return a box of hexahedra between two joint centres, which are the centres of its end faces.

    Parameters
    ----------
    length : float
        Distance of the joints' centres, m: the bar ends there, with no eyes beyond.
    depth, width : float
        In the plane of motion and normal to it, m.
    elements : three ints
        Along length, depth and width, as `buckler.mbs.modal.Box` checks them.
    """
    size = [positive(name, value, "m") for name, value in (("length", length), ("depth", depth), ("width", width))]
    nx, ny, nz = elements
    steps = (np.linspace(0, 1, nx + 1), np.linspace(-0.5, 0.5, ny + 1), np.linspace(-0.5, 0.5, nz + 1))
    points = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3) * size
    index = np.arange(len(points)).reshape(nx + 1, ny + 1, nz + 1)
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = [index[i : nx + i, j : ny + j, k : nz + k].ravel() for i, j, k in corners]
    return SolidMesh(points, np.column_stack(cells), "hexahedron", size[0])


def read_mesh(
    path: str | Path, start: Sequence[float], end: Sequence[float], normal: Sequence[float] = (0.0, 0.0, 1.0), scale: float = 1.0
) -> SolidMesh:
    """Read a solid mesh of any format meshio knows (gmsh, Abaqus, VTU, ...) and turn it into link axes.

    Parameters
    ----------
    path : str or Path
    start, end : three floats
        Centres of the two joints, in the file's axes and unit.
    normal : three floats
        Direction normal to the plane of motion, in the file's axes; square to the line from start to end.
    scale : float
        Metres in the file's unit of length: 1e-3 for a mesh in mm.

    Raises
    ------
    ValueError
        If the file has no solid cells, several kinds of them or unsupported ones, if the joints coincide or the normal
        is not square to the link, if the mesh falls into parts, or if touching cells do not share whole faces.
    """
    import meshio

    if not Path(path).is_file():
        raise ValueError(f"mesh = '{path}': must be a file")
    mesh = meshio.read(path)
    kind, cells = _solid_cells(mesh, str(path))
    turn, length = _link_axes(start, end, normal, scale)
    points = (np.asarray(mesh.points, dtype=float) - np.asarray(start, dtype=float)) @ turn.T * scale
    used, compact = np.unique(cells, return_inverse=True)  # files keep points that no cell uses
    cells = compact.reshape(cells.shape)
    _check_connected(cells, str(path))
    loose = hanging(points[used], cells, kind)
    if len(loose):
        x, y, z = mesh.points[used][loose[0]]
        raise ValueError(
            f"mesh '{path}': hanging nodes = {len(loose)}, one at ({x:.6g}, {y:.6g}, {z:.6g}) in the file's axes: must be 0; "
            "touching cells are to share whole faces"
        )
    return SolidMesh(points[used], cells, kind, length)


def _solid_cells(mesh: Any, path: str) -> tuple[str, Array]:
    found = {block.type for block in mesh.cells if block.dim == 3 and len(block.data)}
    if len(found) != 1 or not found <= set(KINDS):
        have = ", ".join(sorted(found or {block.type for block in mesh.cells})) or "none"
        raise ValueError(f"mesh '{path}': cells = {have}: must be one kind of solid cells, one of {', '.join(KINDS)}")
    (kind,) = found
    return kind, np.concatenate([block.data for block in mesh.cells if block.type == kind])


def _link_axes(start: Sequence[float], end: Sequence[float], normal: Sequence[float], scale: float) -> tuple[Array, float]:
    """Rotation from the file's axes into the link's, and the link's length, m."""
    vectors = {}
    for name, value in (("start", start), ("end", end), ("normal", normal)):
        vectors[name] = np.array([number(name, c, -1e9, 1e9, "file units") for c in value])
    x, z = vectors["end"] - vectors["start"], vectors["normal"]
    span = positive("distance of start and end", float(np.linalg.norm(x)), "file units")
    x, z = x / span, z / positive("normal (length)", float(np.linalg.norm(z)), "1")
    number("cosine of normal and link axis", float(x @ z), -1e-6, 1e-6, "1")
    y = np.cross(z, x)
    return np.array([x, y / np.linalg.norm(y), np.cross(x, y / np.linalg.norm(y))]), span * scale


def _check_connected(cells: Array, path: str) -> None:
    count = int(cells.max()) + 1
    first = np.repeat(cells[:, 0], cells.shape[1])
    links = scipy.sparse.coo_matrix((np.ones(cells.size), (first, cells.ravel())), (count, count))
    parts, _ = scipy.sparse.csgraph.connected_components(links, directed=False)
    if parts != 1:
        raise ValueError(f"mesh '{path}': parts = {parts}: must be 1; touching cells are to share their nodes")


def _with_face_nodes(mesh: SolidMesh) -> SolidMesh:
    """Turn 20-node hexahedra into 27-node ones: the missing nodes lie where the serendipity map puts them."""
    corner, edge = mesh.points[mesh.cells[:, :8]], mesh.points[mesh.cells[:, 8:]]
    places = []
    for face in HEXAHEDRON:
        mids = [k for k, ends in enumerate(EDGES) if set(ends) <= set(face)]
        places.append(-corner[:, face].sum(axis=1) / 4 + edge[:, mids].sum(axis=1) / 2)
    places.append(-corner.sum(axis=1) / 4 + edge.sum(axis=1) / 4)
    middle = np.stack(places, axis=1)  # cells, 7, 3
    faces = np.sort(mesh.cells[:, np.array(HEXAHEDRON)], axis=2).reshape(-1, 4)
    _, first, shared = np.unique(faces, axis=0, return_index=True, return_inverse=True)
    start = len(mesh.points)
    on_faces = start + shared.reshape(-1, 6)
    inside = start + len(first) + np.arange(len(mesh.cells))[:, None]
    points = np.concatenate([mesh.points, middle[:, :6].reshape(-1, 3)[first], middle[:, 6]])
    return SolidMesh(points, np.hstack([mesh.cells, on_faces, inside]), "hexahedron27", mesh.length)


def assemble(mesh: SolidMesh, material: Material, order: int = 2) -> Solid:
    """Assemble mass and stiffness of linear elasticity.

    Parameters
    ----------
    mesh : SolidMesh
    material : Material
        Isotropic; Poisson's ratio below 0.5.
    order : int
        Of the displacement, 1 or 2; 2 also on a mesh of first-order cells, as first-order ones lock in bending.

    Notes
    -----
    K[(a,i),(b,j)] = lambda D_ij + mu D_ji + mu delta_ij sum_k D_kk with D_ij = int d_i N_a d_j N_b dV.
    """
    import meshio

    try:
        from skfem import Basis, BilinearForm, ElementHex1, ElementHex2, ElementTetP1, ElementTetP2
        from skfem.io import from_meshio
    except ModuleNotFoundError as error:
        raise ImportError("a Modal link needs scikit-fem: pip install 'buckler[modal]'") from error

    whole("order", order, 1, 2)
    nu = number("poisson", material.poisson, -0.999, 0.499, "1")
    if mesh.kind == "hexahedron20":
        mesh = _with_face_nodes(mesh)
    tet = mesh.kind.startswith("tetra")
    shape = (ElementTetP1, ElementTetP2)[order - 1]() if tet else (ElementHex1, ElementHex2)[order - 1]()
    grid = from_meshio(meshio.Mesh(mesh.points, [(mesh.kind, mesh.cells)]))
    basis = Basis(grid, shape, intorder=2 * order if mesh.kind in ("tetra", "hexahedron") else 2 * order + 2)
    mass = material.density * BilinearForm(lambda u, v, w: u * v).assemble(basis)
    gradients = {}
    for i in range(3):
        for j in range(i, 3):
            gradients[i, j] = BilinearForm(lambda u, v, w, i=i, j=j: v.grad[i] * u.grad[j]).assemble(basis)
            gradients[j, i] = gradients[i, j].T
    lame, shear = material.modulus * nu / ((1 + nu) * (1 - 2 * nu)), material.modulus / (2 * (1 + nu))
    trace = gradients[0, 0] + gradients[1, 1] + gradients[2, 2]
    stiffness = scipy.sparse.kron(shear * trace, scipy.sparse.identity(3))
    for (i, j), block in gradients.items():
        stiffness = stiffness + scipy.sparse.kron(lame * block + shear * gradients[j, i], _unit(i, j))
    return Solid(basis.doflocs.T.copy(), mass.tocsr(), stiffness.tocsc(), mesh.length, material)


def _unit(i: int, j: int) -> Any:
    return scipy.sparse.coo_matrix(([1.0], ([i], [j])), (3, 3))


def rigid_motions(places: Array) -> Array:
    """Displacements of the six rigid motions (three translations, three rotations) about the origin, shape (3 n, 6)."""
    x, y, z = np.asarray(places, dtype=float).T
    none, one = np.zeros_like(x), np.ones_like(x)
    rows = [[one, none, none, none, z, -y], [none, one, none, -z, none, x], [none, none, one, y, -x, none]]
    return np.array(rows).transpose(2, 0, 1).reshape(-1, 6)
