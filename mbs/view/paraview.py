"""Export of the motion of a run to ParaView: a mesh of all links at the first time and its displacements, as an XDMF time series.

A flexible link is a chain of hexahedra of the strip's width and thickness, a rigid link a prism on its outline.
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
    """Mesh of a link: nodes (times, n, 3) [m], meshio's type and node numbers of its cells, named values at nodes (times, n)."""

    corners: Array
    kind: str
    cells: Array
    data: dict[str, Array]


def write_paraview(result: Result, path: str | Path, times: ArrayLike | None = None) -> Path:
    """Write the motion of a run as an .xdmf file, at the times of its movie or at others [s]; see `Result.write_paraview`."""
    from meshio.xdmf import TimeSeriesWriter

    path = Path(path)
    if path.suffix != ".xdmf":
        raise ValueError(f"path = '{path}': must end in .xdmf")
    movie = result.movie
    if times is not None:
        record = result.film.record  # of the run, from which a movie at any times can be made
        if record is None:
            raise ValueError("times: a pickled result holds its movie's times only")
        movie = make_movie(record, np.atleast_1d(np.asarray(times, dtype=float)))
    solids = list(_solids(movie))
    corners = np.concatenate([solid.corners for solid in solids], axis=1)
    counts = [solid.corners.shape[1] for solid in solids]
    first, link_number = np.cumsum([0, *counts]), np.repeat(np.arange(len(solids)), counts)
    # a rigid link has no such values: they are 0 there
    data = {name: np.concatenate([solid.data.get(name, np.zeros(solid.corners.shape[:2])) for solid in solids], axis=1)
            for name in ("curvature", "axial_force", "stress")}  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    with TimeSeriesWriter(path, data_format="XML") as writer:
        writer.write_points_cells(corners[0], [(s.kind, s.cells + k) for s, k in zip(solids, first[:-1], strict=True)])
        for k, t in enumerate(movie.time):
            values = {name: column[k].astype(np.float32) for name, column in data.items()}
            values |= {"displacement": corners[k] - corners[0], "link": link_number.astype(np.int32)}
            writer.write_data(float(t), point_data=values)
    return path


def _solids(movie: Movie) -> Iterator[MeshSolid]:
    """Yield the meshes of all links, of rigid links first."""
    for mark in movie.marks:
        if isinstance(mark, Outline) and mark.closed and mark.width > 0:  # the outline of a rigid link, no symbol
            outline = np.stack([to_ground(frame, mark.points) for frame in movie.frames[mark.frame]])
            fan = np.array([[0, k, k + 1] for k in range(1, len(mark.points) - 1)])  # triangles: outlines of links are convex
            sides = [_at_height(outline, z) for z in (-mark.width / 2, mark.width / 2)]
            yield MeshSolid(np.concatenate(sides, axis=1), "wedge", np.hstack([fan, fan + len(mark.points)]), {})
    for band in movie.bands.values():  # of flexible links: `points` are (times, stations, 2), `bending` is (times, stations)
        along = np.gradient(band.points, axis=1)
        size = np.maximum(np.hypot(along[..., 0], along[..., 1]), 1e-300)
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
        right, left = (band.points + side * band.thickness / 2 * normal for side in (-1.0, 1.0))
        bottom, top = -band.width / 2, band.width / 2
        section = [_at_height(right, bottom), _at_height(left, bottom), _at_height(right, top), _at_height(left, top)]
        corners = np.stack(section, axis=2)
        # corners 0 to 3 at a station, 4 to 7 at the next; VTK lists the four of one face, then those opposite to them
        hexahedron = np.array([0, 4, 5, 1, 2, 6, 7, 3])
        cells = 4 * np.arange(band.points.shape[1] - 1)[:, None] + hexahedron
        values = {"curvature": band.bending, "axial_force": band.axial_force, "stress": band.stress}
        data = {key: np.repeat(column, 4, axis=1) for key, column in values.items()}
        yield MeshSolid(corners.reshape(len(movie.time), -1, 3), "hexahedron", cells, data)


def _at_height(plane: Array, height: ArrayLike) -> Array:
    """Add the coordinate normal to the plane [m] to places (times, n, 2)."""
    return np.concatenate([plane, np.broadcast_to(np.reshape(height, (1, -1, 1)), (*plane.shape[:2], 1))], axis=2)
