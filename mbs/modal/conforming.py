"""Whether touching cells of a solid mesh share whole faces: across a face that they do not share, the solid can gape."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import scipy

from buckler.mbs.geometry import Array

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
