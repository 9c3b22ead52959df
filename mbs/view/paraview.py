"""Export of the motion of a run to ParaView: a mesh of all links at the first time and its displacements, as an XDMF time series.

A flexible link is a chain of hexahedra of the strip's width and thickness, a rigid link a prism on its outline. Shapes come from
a `Movie`: outlines of rigid links are fixed in frames (x, y, angle) that move; a band has the bent line of a flexible link.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..geometry import Array
from ..record.result import Result
from .drawing import Outline
from .movie import Movie, make_movie, to_ground


class MeshSolid(NamedTuple):
    """Mesh of a link."""

    nodes: Array  # places [m], (times, n, 3)
    cell_type: str  # meshio's name
    cells: Array  # numbers of the nodes of each cell
    values: dict[str, Array]  # at the nodes, by name, (times, n)


def write_paraview(result: Result, path: str | Path, times: ArrayLike | None = None) -> Path:
    """Write the motion of a run as an .xdmf file, at the times of its movie or at others [s]; see `Result.write_paraview`."""
    from meshio.xdmf import TimeSeriesWriter

    path = Path(path)
    if path.suffix != ".xdmf":
        raise ValueError(f"path = '{path}': must end in .xdmf")
    movie = result.movie
    if times is not None:
        record = result.film.record  # all states of the run; None after pickling, which keeps the movie alone
        if record is None:
            raise ValueError("times: a pickled result holds its movie's times only")
        movie = make_movie(record, np.atleast_1d(np.asarray(times, dtype=float)))
    solids = list(_solids(movie))
    nodes = np.concatenate([solid.nodes for solid in solids], axis=1)
    counts = [solid.nodes.shape[1] for solid in solids]
    first_nodes = np.cumsum([0, *counts])[:-1]  # number of each solid's first node
    link_number = np.repeat(np.arange(len(solids)), counts)
    # a rigid link has no such values: they are 0 there
    columns = {name: np.concatenate([solid.values.get(name, np.zeros(solid.nodes.shape[:2])) for solid in solids], axis=1)
               for name in ("curvature", "axial_force", "stress")}  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    with TimeSeriesWriter(path, data_format="XML") as writer:
        cells = [(solid.cell_type, solid.cells + first) for solid, first in zip(solids, first_nodes, strict=True)]
        writer.write_points_cells(nodes[0], cells)
        for k, t in enumerate(movie.time):
            values = {name: column[k].astype(np.float32) for name, column in columns.items()}
            values |= {"displacement": nodes[k] - nodes[0], "link": link_number.astype(np.int32)}
            writer.write_data(float(t), point_data=values)
    return path


def _solids(movie: Movie) -> Iterator[MeshSolid]:
    """Yield the meshes of all links, of rigid links first."""
    outlines = [mark for mark in movie.marks if isinstance(mark, Outline) and mark.closed]
    for mark in [each for each in outlines if each.width > 0]:  # of rigid links: symbols have no width
        outline = np.stack([to_ground(frame, mark.points) for frame in movie.frames[mark.frame]])
        fan = np.array([[0, k, k + 1] for k in range(1, len(mark.points) - 1)])  # triangles: outlines of links are convex
        sides = [_at_height(outline, z) for z in (-mark.width / 2, mark.width / 2)]
        yield MeshSolid(np.concatenate(sides, axis=1), "wedge", np.hstack([fan, fan + len(mark.points)]), {})
    for band in movie.bands.values():  # of flexible links: `points` are (times, stations, 2)
        along = np.gradient(band.points, axis=1)
        size = np.maximum(np.hypot(along[..., 0], along[..., 1]), 1e-300)  # above 0, for a division
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
        right, left = (band.points + side * band.thickness / 2 * normal for side in (-1.0, 1.0))
        bottom, top = -band.width / 2, band.width / 2
        section = [_at_height(right, bottom), _at_height(left, bottom), _at_height(right, top), _at_height(left, top)]
        nodes = np.stack(section, axis=2).reshape(len(movie.time), -1, 3)
        # nodes 0 to 3 are at a station, 4 to 7 at the next; VTK lists the four of one face, then those opposite to them
        hexahedron = np.array([0, 4, 5, 1, 2, 6, 7, 3])
        cells = 4 * np.arange(band.points.shape[1] - 1)[:, None] + hexahedron
        values = {"curvature": band.bending, "axial_force": band.axial_force, "stress": band.stress}  # bending [1/m]
        yield MeshSolid(nodes, "hexahedron", cells, {key: np.repeat(column, 4, axis=1) for key, column in values.items()})


def _at_height(places: Array, height: float) -> Array:
    """Add the coordinate `height` [m], normal to the plane, to places (times, n, 2)."""
    return np.concatenate([places, np.full((*places.shape[:2], 1), height)], axis=2)
