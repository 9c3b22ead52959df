"""Meshes of links for scikit-fem: regular meshes of bars, and meshes from files by meshio; pip install 'buckler[modal]'.

Link axes: origin at the start joint's centre, x towards the end joint's centre, y to the left of x in the plane of motion.
"""

import io
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from ..elements.modal import MeshFile
from ..geometry import Array
from ..validate import number, positive

SHAPES = {"tetra": ("Tet", 4), "hexahedron": ("Hex", 8), "triangle": ("Tri", 3), "quad": ("Quad", 4)}
"""scikit-fem's name and the number of corners of a cell, by its shape."""
KINDS = {
    "tetra": "TetP1", "tetra10": "TetP2", "hexahedron": "Hex1", "hexahedron20": "HexS2", "hexahedron27": "Hex2",
    "triangle": "TriP1", "triangle6": "TriP2", "quad": "Quad1", "quad8": "QuadS2", "quad9": "Quad2",
}  # fmt: skip
"""scikit-fem's element with the nodes of a cell, by meshio's name of the cell."""
ON_FACE = 1e-6
"""Largest distance from a face over its size, or from the plane of motion over the link's length, that counts as zero."""


def skfem() -> Any:
    """Import scikit-fem; an ImportError says how to install it."""
    try:
        import skfem as module
    except ModuleNotFoundError as error:
        raise ImportError("a Modal link needs scikit-fem: pip install 'buckler[modal]'") from error
    return module


def bar_grid(length: float, depth: float, width: float, elements: Sequence[int]) -> Any:
    """Mesh a bar, joints at the centres of its end faces, by hexahedra: sizes [m] and numbers of `elements` along x, y, z."""
    size = [(0.0, length), (-depth / 2, depth / 2), (-width / 2, width / 2)]
    return skfem().MeshHex.init_tensor(*(np.linspace(*ends, n + 1) for ends, n in zip(size, elements, strict=True)))


def read_mesh(file: MeshFile) -> tuple[object, float]:
    """Read a mesh in any format of meshio; return it in link axes [m], with the distance of the joints [m]."""
    where = f"mesh '{file.path}'"
    mesh = _read(file.path)
    kind, cells = _cells_of(mesh, where)
    rotation, length = _link_axes(file)
    points = np.asarray(mesh.points, dtype=float)
    places = (np.pad(points, ((0, 0), (0, 3 - points.shape[1]))) - np.array(file.start)) @ rotation.T * file.scale
    used, renumbered = np.unique(cells, return_inverse=True)  # files may have points that no cell uses
    out_of_plane = np.ptp(places[used, 2])
    if kind.startswith(("triangle", "quad")) and out_of_plane > ON_FACE * length:
        found = f"its {kind} cells reach {out_of_plane:.3g} m out of one plane"
        raise ValueError(f"{where}: {found}: must lie in the plane of motion")
    return grid_of(kind, places[used], renumbered.reshape(cells.shape), where), length


def _read(path: str) -> Any:
    """Read a file by meshio; on an error meshio prints its message and exits, which becomes a ValueError with that message."""
    import meshio

    if not Path(path).is_file():
        raise ValueError(f"mesh = '{path}': must be a file")
    printed = io.StringIO()
    try:
        with redirect_stderr(printed), redirect_stdout(printed):
            return meshio.read(path)
    except (Exception, SystemExit) as error:
        reason = " ".join(printed.getvalue().split()) or f"{type(error).__name__}: {error}"
        advice = "write it in another format, as .vtu or .inp"
        raise ValueError(f"mesh '{path}': meshio cannot read it ({reason}); {advice}") from error


def _cells_of(mesh: Any, where: str) -> tuple[str, Array]:
    """Return kind and node numbers of the cells of the highest dimension."""
    dimension = max((block.dim for block in mesh.cells if len(block.data)), default=0)
    found = {block.type for block in mesh.cells if block.dim == dimension and len(block.data)}
    if len(found) != 1 or not found <= set(KINDS):
        have = ", ".join(sorted(found)) or "none"
        raise ValueError(f"{where}: cells = {have}: must be one kind of cells, one of {', '.join(KINDS)}")
    (kind,) = found
    return kind, np.concatenate([block.data for block in mesh.cells if block.type == kind])


def _link_axes(file: MeshFile) -> tuple[Array, float]:
    """Return the rotation from the file's axes into the link's, and the link's length [m]."""
    # 1e9: chosen, above any real size
    start, end, z = (
        np.array([number(name, component, -1e9, 1e9, "file units") for component in getattr(file, name)])
        for name in ("start", "end", "normal")
    )
    x = end - start
    span = positive("distance of start and end", float(np.linalg.norm(x)), "file units")
    x, z = x / span, z / positive("normal (length)", float(np.linalg.norm(z)), "1")
    number("cosine of normal and link axis", float(x @ z), -1e-6, 1e-6, "1")  # 1e-6 is chosen
    y = np.cross(z, x)
    y = y / np.linalg.norm(y)  # z is normal to x up to the tolerance above
    return np.array([x, y, np.cross(x, y)]), span * file.scale


def grid_of(kind: str, points: Array, cells: Array, where: str = "mesh") -> Any:
    """Make scikit-fem's mesh from cells of a kind of `KINDS`: node numbers (cells, n) of points (nodes, 3) [m].

    Corners come first, in meshio's order, other nodes in any order. Each point belongs to a cell. For planar cells z is ignored.
    """
    import meshio
    from skfem.io import from_meshio

    first_order = next(name for name in SHAPES if kind.startswith(name))
    shape, corner_count = SHAPES[first_order]
    used, renumbered = np.unique(cells[:, :corner_count], return_inverse=True)
    straight = from_meshio(meshio.Mesh(points[used], [(first_order, renumbered.reshape(-1, corner_count))]))
    _check_connected(straight, where)
    extra = points[cells[:, corner_count:]]
    grid = straight if kind == first_order else _add_second_order_nodes(straight, shape, KINDS[kind], extra)
    _check_inverted(straight, grid, where)
    if len(nodes := find_hanging_nodes(straight)):
        at = ", ".join(f"{x:.6g}" for x in straight.p[:, nodes[0]])
        advice = "must be 0; touching cells are to share whole faces"
        raise ValueError(f"{where}: hanging nodes = {len(nodes)}, one at ({at}) m in link axes: {advice}")
    return grid


def _add_second_order_nodes(straight: Any, shape: str, element: str, extra: Array) -> Any:
    """Add second-order nodes, given as `extra` (cells, nodes, 3) [m], in each cell in any order.

    The places of such nodes in the straight cell are known. The Hungarian method assigns a given node to each place, with the
    smallest sum of squared distances.
    """
    fem, dim = skfem(), straight.p.shape[0]
    linear, file_element = straight.elem(), getattr(fem, f"Element{element}")()  # of straight cells; of the file
    corners = straight.p[:, straight.t].transpose(2, 1, 0)  # cells, corners, dim
    extra_places = file_element.doflocs[corners.shape[1] :]  # in the reference cell
    straight_nodes = np.einsum("ik,cid->ckd", _values(linear, extra_places), corners)
    distance = np.linalg.norm(straight_nodes[:, :, None] - extra[:, None, :, :dim], axis=3)
    assigned = np.array([scipy.optimize.linear_sum_assignment(costs)[1] for costs in distance**2])
    nodes = np.concatenate([corners, np.take_along_axis(extra[..., :dim], assigned[..., None], axis=1)], axis=1)
    grid = getattr(fem, f"Mesh{shape}2").from_mesh(straight)
    full_element = grid.elem()  # with all inner nodes
    if len(full_element.doflocs) != len(file_element.doflocs):  # serendipity cells lack inner nodes: interpolate them
        nodes = np.einsum("ik,cid->ckd", _values(file_element, full_element.doflocs), nodes)
    places = grid.doflocs.copy()
    places[:, grid.dofs.element_dofs] = nodes.transpose(2, 1, 0)  # cells that share a node agree on its place
    return replace(grid, doflocs=places)


def _values(element: Any, places: Array) -> Array:
    """Evaluate the shape functions of an element at places of the reference cell, shape (functions, places)."""
    return np.array([element.lbasis(places.T, i)[0] for i in range(len(element.doflocs))])


def _check_connected(grid: Any, where: str) -> None:
    """Raise a ValueError if the mesh has separate parts."""
    corners, count = grid.t, grid.p.shape[1]  # (corners of a cell, cells); nodes
    first_corners = np.tile(corners[0], len(corners))  # in a graph, edges from there to all corners connect those of a cell
    graph = scipy.sparse.coo_matrix((np.ones(corners.size), (first_corners, corners.ravel())), shape=(count, count))
    parts, _ = scipy.sparse.csgraph.connected_components(graph, directed=False)
    if parts != 1:
        raise ValueError(f"{where}: parts = {parts}: must be 1; touching cells are to share their nodes")


def _check_inverted(straight: Any, grid: Any, where: str) -> None:
    """Raise a ValueError for inverted cells: the determinant of the map from the reference cell changes sign or is 0 everywhere.

    Cells that overlap a neighbour count as inverted, too. `_find_overlaps` finds them, as the determinant shows no overlap.
    A cell whose nodes are numbered in the mirrored order is not inverted: its determinant is negative everywhere.
    """
    element, nodes = grid.elem(), grid.doflocs[:, grid.dofs.element_dofs]
    places = element.doflocs.T  # of the nodes in the reference cell
    slopes = np.array([np.broadcast_to(element.lbasis(places, i)[1], places.shape) for i in range(len(element.doflocs))])
    # derivatives of place a by reference coordinate e in cell c at node p, summed over the shape functions k
    determinant = np.linalg.det(np.einsum("akc,kep->cpae", nodes, slopes))
    least = 1e-9 * np.abs(determinant).max(axis=1)  # what counts as zero, as where corners coincide
    changes_sign = (determinant.min(axis=1) < -least) & (determinant.max(axis=1) > least)
    is_inverted = changes_sign | (least == 0.0) | _find_overlaps(straight)
    if is_inverted.any():
        found = f"inverted cells = {is_inverted.sum()}, the first is number {np.argmax(is_inverted) + 1}"
        advice = "its corners are in no order of meshio's, or a node lies across a face"
        raise ValueError(f"{where}: {found}: must be 0; {advice}")


def _find_overlaps(grid: Any) -> Array:
    """Return the mask of cells that lie on the same side of a shared face as their neighbour, (cells,)."""
    shared = np.flatnonzero(grid.f2t[1] >= 0)
    pairs, corners = grid.f2t[:, shared], grid.p[:, grid.facets[:, shared]]  # cells (2, faces); (dim, corners, faces)
    edge = corners[:, 1] - corners[:, 0]
    normal = np.cross(edge.T, (corners[:, 2] - corners[:, 0]).T).T if len(edge) == 3 else np.stack([-edge[1], edge[0]])
    middle, centres = corners.mean(axis=1), grid.p[:, grid.t].mean(axis=1)  # of faces; of cells
    side = np.stack([(normal * (centres[:, cells] - middle)).sum(axis=0) for cells in pairs])  # height over the face * |normal|
    # a cell lower than this over the face is flat: it lies on no side
    lowest = ON_FACE * np.linalg.norm(normal, axis=0) * np.linalg.norm(edge, axis=0)
    overlapping = pairs[:, (side[0] * side[1] > 0) & (np.abs(side).min(axis=0) > lowest)]
    count = grid.t.shape[1]  # of cells
    bad_faces, shared_faces = (np.bincount(cells.ravel(), minlength=count) for cells in (overlapping, pairs))
    # Of two overlapping cells, the one with the larger share of bad faces is marked, or both if the shares are equal. A right
    # cell has bad faces only where it meets a wrong cell; a wrong cell may overlap several right ones. Shares are compared, not
    # counts, as cells at the boundary have fewer shared faces.
    first_share, second_share = (bad_faces / shared_faces.clip(1))[overlapping]
    is_marked = np.zeros(count, dtype=bool)
    is_marked[overlapping[0, first_share >= second_share]] = True
    is_marked[overlapping[1, second_share >= first_share]] = True
    return is_marked


def find_hanging_nodes(grid: Any) -> Array:
    """Find the nodes that lie on a boundary face without being its corners; none if the mesh is conforming.

    Boundary faces are those of one cell alone. Where cells touch without sharing a whole face, their faces are among them.
    """
    faces = grid.facets[:, grid.boundary_facets()].T
    dim, nodes = len(grid.p), np.unique(faces)
    # all choices of `dim` corners of a face: an edge, a triangle, or the four triangles of a quadrilateral
    choices = list(combinations(range(faces.shape[1]), dim))
    simplices = np.concatenate([faces[:, list(corners)] for corners in choices])
    face_of_simplex = np.tile(faces, (len(choices), 1))
    places = grid.p.T[simplices]
    middle = places.mean(axis=1)
    radius = np.linalg.norm(places - middle[:, None], axis=2).max(axis=1)
    near = scipy.spatial.cKDTree(grid.p.T[nodes]).query_ball_point(middle, radius * (1 + ON_FACE))
    # pairs of a simplex and a node near it, as two arrays of numbers
    simplex = np.repeat(np.arange(len(simplices)), [len(found) for found in near])
    node = nodes[np.concatenate([np.asarray(found, dtype=int) for found in near])]
    is_no_corner = (face_of_simplex[simplex] != node[:, None]).all(axis=1)
    simplex, node = simplex[is_no_corner], node[is_no_corner]
    # the place c_0 + sum s_i (c_i - c_0) is inside the simplex with corners c_i if s_i >= 0 and sum s_i <= 1
    edges = (places[simplex, 1:] - places[simplex, :1]).transpose(0, 2, 1)
    offset = grid.p.T[node] - places[simplex, 0]
    s = np.einsum("pij,pj->pi", np.linalg.pinv(edges), offset)
    distance = np.linalg.norm(offset - np.einsum("pij,pj->pi", edges, s), axis=1)
    is_inside = (s.min(axis=1) >= -ON_FACE) & (s.sum(axis=1) <= 1 + ON_FACE)
    return np.unique(node[(distance <= ON_FACE * radius[simplex]) & is_inside])
