"""Links, symbols and forces for ParaView: binary XML files of unstructured grids, one a time and kind, and a `.pvd` list.

Flexible links are chains of hexahedra across their true width and thickness, rigid links
prisms of their outline. Numbers are raw, little-endian, appended.
"""

from __future__ import annotations

from pathlib import Path as FilePath
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from ..elements.modal import Modal
from ..geometry import Array
from ..mechanism import Mechanism
from ..record.record import Record
from ..record.result import Result
from .drawing import INKS, Arrow, Disc, Path
from .movie import Movie, corners, filmed

HEXAHEDRON, TETRA, VERTEX, POLYGON = 12, 10, 1, 7


def write_paraview(result: Result, folder: str | FilePath, times: ArrayLike | None = None) -> FilePath:
    """Write a run; see `Result.write_paraview`."""
    folder = FilePath(folder)
    folder.mkdir(parents=True, exist_ok=True)
    movie: Movie = result.movie
    if times is not None:
        if result.film.record is None:
            raise ValueError("times: a result from a file holds its movie's times only")
        movie = filmed(result.film.record, np.atleast_1d(np.asarray(times, dtype=float)))
    forces = [mark for mark in movie.marks if isinstance(mark, Arrow) and all(name in result.signals for name in mark.signals)]
    deformed = solids(result.film.record, movie.time)
    entries = []
    for k, t in enumerate(movie.time):
        parts = {"links": links(movie, k, deformed), "symbols": symbols(movie, k), "forces": _forces(result, movie, forces, k)}
        for number, (name, grid) in enumerate(parts.items()):
            if len(grid.points):
                file = f"{name}_{k:05d}.vtu"
                (folder / file).write_bytes(vtu(grid))
                entries.append(f'<DataSet timestep="{float(t)!r}" part="{number}" name="{name}" file="{file}"/>')
    collection = folder / "mechanism.pvd"
    body = "\n".join(entries)
    collection.write_text(
        f'<?xml version="1.0"?>\n<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">\n'
        f"<Collection>\n{body}\n</Collection>\n</VTKFile>\n",
        encoding="utf-8",
    )
    return collection


class Grid(NamedTuple):
    """Points (n, 3), m; cells as lists of point numbers with their VTK type; data of points and of cells."""

    points: Array
    cells: list[Array]
    kinds: list[int]
    of_points: dict[str, Array]
    of_cells: dict[str, Array]


class Deformed(NamedTuple):
    """A modal link's mesh: cells by the numbers of their corners and their VTK type; corners (times, n, 2), z (n,), m."""

    cells: Array
    kind: int
    corners: Array
    height: Array


def solids(record: Record, times: Array) -> dict[str, Deformed]:
    """Meshes of modal links over time, by link: r = R + A(theta) (X + sum phi_k q_k) at the corners of their cells.

    Without a record, as in a result from a file, there are none, and such a link is drawn along its line.
    """
    found: dict[str, Deformed] = {}
    if record is None or len(record.time) < 2:
        return found
    for name, motion in record.at(times).links.items():
        if isinstance(body := record.mechanism.link(name).body, Modal) and body.modes.of_solid:
            found[name] = _deformed(record.mechanism, name, motion.q)
    return found


def _deformed(mechanism: Mechanism, name: str, q: Array) -> Deformed:
    from scipy.spatial import cKDTree

    from ..modal.reduction import reduced, solid_mesh

    body, length = cast(Modal, mechanism.link(name).body), mechanism.length(name)
    mesh, model = solid_mesh(body, length), reduced(body, length)
    hexahedra = mesh.kind.startswith("hexahedron")
    used, cells = np.unique(mesh.cells[:, : 8 if hexahedra else 4], return_inverse=True)
    nodes = cKDTree(model.nodes).query(mesh.points[used])[1]
    modes = model.modes[model.moves_in_plane][:, nodes, :2]
    local = mesh.points[used, :2] - model.centre[:2] + np.einsum("kna,tk->tna", modes, q[:, 3:])
    c, s = np.cos(q[:, 2])[:, None], np.sin(q[:, 2])[:, None]
    x, y = local[..., 0], local[..., 1]
    corners = q[:, None, :2] + np.stack([c * x - s * y, s * x + c * y], axis=-1)
    return Deformed(cells.reshape(len(mesh.cells), -1), HEXAHEDRON if hexahedra else TETRA, corners, mesh.points[used, 2])


def links(movie: Movie, k: int, deformed: dict[str, Deformed]) -> Grid:
    """All links as solids, with curvature, axial force and stress of strips; others have zeros."""
    points: list[Array] = []
    cells: list[Array] = []
    kinds: list[int] = []
    values: dict[str, list[Array]] = {"curvature": [], "axial_force": [], "stress": []}
    owners: list[int] = []
    first = 0
    for number, (places, own, kind, data) in enumerate(_solids(movie, k, deformed)):
        points.append(places)
        cells += [cell + first for cell in own]
        kinds += [kind] * len(own)
        owners += [number] * len(own)
        for name, column in values.items():
            column.append(data.get(name, np.zeros(len(places))))
        first += len(places)
    if not points:
        return Grid(np.empty((0, 3)), [], [], {}, {})
    joined = {name: np.concatenate(column) for name, column in values.items()}
    return Grid(np.concatenate(points), cells, kinds, joined, {"link": np.array(owners, dtype=float)})


def _solids(movie: Movie, k: int, deformed: dict[str, Deformed]) -> Any:
    for mark in movie.marks:
        if isinstance(mark, Path) and mark.closed and mark.width > 0:
            yield *_prism(corners(movie, mark, k), mark.width), POLYGON, {}
    for solid in deformed.values():
        yield np.column_stack([solid.corners[k], solid.height]), list(solid.cells), solid.kind, {}
    for name, band in movie.bands.items():
        if name in deformed:
            continue
        line = band.points[k]
        along = np.gradient(line, axis=0)
        left = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.maximum(np.hypot(*along.T), 1e-300)[:, None]
        sides = [line + side * band.thickness / 2 * left for side in (-1.0, 1.0)]
        half = band.width / 2
        places = np.stack([np.pad(sides[j], ((0, 0), (0, 1)), constant_values=z) for z in (-half, half) for j in (0, 1)], axis=1)
        base = 4 * np.arange(len(line) - 1)[:, None]
        hexahedra = base + np.array([0, 4, 5, 1, 2, 6, 7, 3])
        data = {"curvature": band.bending[k], "axial_force": band.axial_force[k], "stress": band.stress[k]}
        yield places.reshape(-1, 3), list(hexahedra), HEXAHEDRON, {key: np.repeat(column, 4) for key, column in data.items()}


def _prism(outline: Array, width: float) -> tuple[Array, list[Array]]:
    """Two faces and the walls between them."""
    n = len(outline)
    points = np.concatenate([np.pad(outline, ((0, 0), (0, 1)), constant_values=z) for z in (-width / 2, width / 2)])
    ring = np.arange(n)
    walls = [np.array([j, (j + 1) % n, n + (j + 1) % n, n + j]) for j in ring]
    return points, [ring[::-1].copy(), ring + n, *walls]


def symbols(movie: Movie, k: int) -> Grid:
    """Pins, blocks and stops as flat outlines a little before the links."""
    before = max((mark.width for mark in movie.marks if isinstance(mark, Path)), default=0.0)
    before = 0.55 * max([before, *(band.width for band in movie.bands.values())])
    points: list[Array] = []
    cells: list[Array] = []
    inks: list[float] = []
    first, names = 0, list(INKS)
    for mark in movie.marks:
        if isinstance(mark, Disc) or (isinstance(mark, Path) and mark.closed and not mark.width):
            flat = corners(movie, mark, k)
            points.append(np.pad(flat, ((0, 0), (0, 1)), constant_values=before))
            cells.append(np.arange(len(flat)) + first)
            inks.append(float(names.index(mark.ink)))
            first += len(flat)
    joined = np.concatenate(points) if points else np.empty((0, 3))
    return Grid(joined, cells, [POLYGON] * len(cells), {}, {"symbol": np.array(inks)})


def _forces(result: Result, movie: Movie, arrows: list[Arrow], k: int) -> Grid:
    """Forces of joints, stops and loads as vectors at their points, N."""
    t, places, vectors = movie.time[k], [], []
    for mark in arrows:
        values = [float(result.at(name, t)) for name in mark.signals]
        vector = np.array(values if len(values) == 2 else [values[0] * c for c in mark.along])
        if len(values) == 1:
            turn = movie.frames[mark.within][k, 2]
            vector = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ vector
        places.append([*movie.frames[mark.frame][k, :2], 0.0])
        vectors.append([*vector, 0.0])
    points = np.array(places).reshape(-1, 3)
    cells = [np.array([j]) for j in range(len(points))]
    return Grid(points, cells, [VERTEX] * len(cells), {"force": np.array(vectors).reshape(-1, 3)}, {})


def vtu(grid: Grid) -> bytes:
    """The bytes of a `.vtu` file."""
    blobs: list[bytes] = []
    size = 0

    def array(name: str, values: Array, kind: str, components: int = 1) -> str:
        nonlocal size
        raw = np.ascontiguousarray(values, dtype={"Float64": "<f8", "Int64": "<i8", "UInt8": "u1"}[kind]).tobytes()
        blob = np.array([len(raw)], dtype="<u8").tobytes() + raw
        blobs.append(blob)
        at, size = size, size + len(blob)
        parts = f' NumberOfComponents="{components}"' if components > 1 else ""
        return f'<DataArray type="{kind}" Name="{name}"{parts} format="appended" offset="{at}"/>'

    def fields(values: dict[str, Array]) -> str:
        return "".join(array(name, column, "Float64", 1 if column.ndim == 1 else 3) for name, column in values.items())

    ends = np.cumsum([len(cell) for cell in grid.cells])
    text = (
        f'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f'<UnstructuredGrid><Piece NumberOfPoints="{len(grid.points)}" NumberOfCells="{len(grid.cells)}">\n'
        f"<Points>{array('Points', grid.points, 'Float64', 3)}</Points>\n"
        f"<Cells>{array('connectivity', np.concatenate(grid.cells), 'Int64')}{array('offsets', ends, 'Int64')}"
        f"{array('types', np.array(grid.kinds), 'UInt8')}</Cells>\n"
        f"<PointData>{fields(grid.of_points)}</PointData>\n<CellData>{fields(grid.of_cells)}</CellData>\n"
        f'</Piece></UnstructuredGrid>\n<AppendedData encoding="raw">\n_'
    )
    return text.encode("ascii") + b"".join(blobs) + b"\n</AppendedData>\n</VTKFile>\n"
