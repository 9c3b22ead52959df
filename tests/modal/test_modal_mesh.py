"""Modal links from mesh files: every kind of cell, curved cells, other axes and units, pin holes, wrong meshes."""

import itertools
from math import pi

import numpy as np
import pytest

pytest.importorskip("skfem")

import meshio
from meshed import LENGTH, STEEL, TALL, THIN, WIDE

from buckler.mbs.elements.section import Section
from buckler.mbs.modal import AdamsDamping, CraigBampton, EndFace, FreeModes, MeshFile, Modal, PinHole, reduced
from buckler.mbs.modal.modes import free_modes
from buckler.mbs.modal.solid import EDGES, SolidMesh, assemble, box_mesh, hanging, read_mesh, rigid_motions

KUHN = [[0, *np.cumsum(step)] for step in itertools.permutations((1, 2, 4))]
"""Six tetrahedra of a cube whose corners are numbered x + 2 y + 4 z."""
CORNER = [0, 1, 3, 2, 4, 5, 7, 6]


def bent_box(kind, elements=(4, 2, 1), bow=0.0):
    """A box in cells of any kind, sheared to y + bow x^2: it keeps its volume, and second-order cells its shape."""
    mesh = box_mesh(LENGTH, WIDE, THIN, elements)
    cells = mesh.cells
    if kind.startswith("tetra"):
        cells = np.concatenate([cells[:, [CORNER.index(c) for c in tet]] for tet in KUHN])
    points = mesh.points
    edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)] if kind == "tetra10" else EDGES
    groups = [*edges] if kind in ("tetra10", "hexahedron20", "hexahedron27") else []
    if kind == "hexahedron27":  # VTK order: faces -x, +x, -y, +y, -z, +z, then the centre
        groups += [(0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7), tuple(range(8))]
    columns = [cells]
    for group in groups:
        places = points[cells[:, list(group)]].mean(axis=1)
        columns.append(len(points) + np.arange(len(cells))[:, None])
        points = np.concatenate([points, places])
    cells = np.hstack(columns)
    _, first, same = np.unique(points.round(10), axis=0, return_index=True, return_inverse=True)
    points, cells = points[first], same.ravel()[cells]
    return points + np.outer(bow * points[:, 0] ** 2, [0, 1, 0]), cells


@pytest.mark.parametrize("kind", ["tetra", "hexahedron", "tetra10", "hexahedron20", "hexahedron27"])
def test_every_kind_of_cell_gives_the_same_bar(kind):
    points, cells = bent_box(kind, (8, 1, 1))
    solid = assemble(SolidMesh(points, cells, kind, LENGTH), STEEL)
    assert solid.mass.sum() == pytest.approx(7850 * LENGTH * WIDE * THIN, rel=1e-12)
    assert abs(solid.stiffness @ rigid_motions(solid.nodes)).max() < 1e-12 * abs(solid.stiffness).max()
    omega, _ = free_modes(solid, 3)
    np.testing.assert_allclose(omega[:3] / (2 * pi), [859.8, 2360.6, 3299.1], rtol=0.04 if kind.startswith("tet") else 0.03)


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "hexahedron27"])
def test_curved_cells_keep_their_curve(kind):
    """Only with all nodes in their right places is the sheared volume that of the box, and its centre at bow L^2/3."""
    bow = 2.0
    points, cells = bent_box(kind, (3, 2, 1), bow)
    solid = assemble(SolidMesh(points, cells, kind, LENGTH), STEEL)
    assert solid.mass.sum() == pytest.approx(7850 * LENGTH * WIDE * THIN, rel=1e-12)
    np.testing.assert_allclose(solid.centre, [LENGTH / 2, bow * LENGTH**2 / 3, 0], atol=1e-14)
    # a curved element's rigid motion still costs nothing
    assert abs(solid.stiffness @ rigid_motions(solid.nodes)).max() < 1e-12 * abs(solid.stiffness).max()


@pytest.mark.parametrize(
    ("suffix", "kind"), [(".vtu", "hexahedron27"), (".inp", "tetra10"), (".msh", "hexahedron"), (".vtk", "hexahedron20")]
)
def test_a_file_in_other_axes_and_millimetres_gives_the_same_link(tmp_path, suffix, kind):
    """A mesh turned, moved and in mm, with a point and a triangle that belong to no solid, is the bar again."""
    points, cells = bent_box(kind, (8, 1, 1))
    angle = 0.7
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    turn = turn @ [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    shift = np.array([5.0, -7.0, 11.0])
    placed = np.vstack([1e3 * points @ turn.T + shift, [[999.0, 0, 0]]])
    extra = [] if suffix in (".inp", ".msh") else [("triangle", np.array([[0, 1, 2]]))]
    path = tmp_path / f"bar{suffix}"
    meshio.Mesh(placed, [*extra, (kind, cells)]).write(path, **({"file_format": "gmsh22"} if suffix == ".msh" else {}))
    mesh = MeshFile(str(path), tuple(shift), tuple(shift + turn @ [1e3 * LENGTH, 0, 0]), tuple(turn @ [0, 0, 2.0]), 1e-3)
    read = read_mesh(path, mesh.start, mesh.end, mesh.normal, mesh.scale)
    assert len(read.points) == len(points) and read.length == pytest.approx(LENGTH, rel=1e-12)
    box, other = np.sort(points, axis=0), np.sort(read.points, axis=0)
    np.testing.assert_allclose(other, box, atol=1e-9)
    found = reduced(Modal(TALL, FreeModes((1,), "in-plane"), mesh=mesh), LENGTH)
    direct = assemble(SolidMesh(points, cells, kind, LENGTH), STEEL)
    same = [w for w in free_modes(direct, 4)[0] if abs(w / found.omega[0] - 1) < 1e-6]
    assert same and found.kinds == ["in-plane bending"]


def eyed_bar(path, pitch=0.1, side=0.02, hole=0.004, ring=16):
    """A link with two eyes: square blocks with a round hole about each joint, a strip between; written in mm."""
    angle = 2 * pi * (np.arange(ring) / ring) - 3 * pi / 4
    wall = hole * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    s = np.arange(ring // 4) / (ring // 4) - 0.5
    half = np.full_like(s, 0.5)
    square = side * np.concatenate([np.stack(e, axis=1) for e in ((s, -half), (half, s), (-s, half), (-half, -s))])
    quads, sheet = [], []
    for centre in (0.0, pitch):
        for t0, t1 in ((0.0, 0.5), (0.5, 1.0)):
            for k in range(ring):
                corners = [((1 - t) * wall + t * square)[j % ring] for t, j in ((t0, k), (t1, k), (t1, k + 1), (t0, k + 1))]
                quads.append(np.add(corners, [centre, 0]))
    x = np.linspace(side / 2, pitch - side / 2, 9)
    y = side * (np.arange(ring // 4 + 1) / (ring // 4) - 0.5)
    quads += [[(a, c), (b, c), (b, d), (a, d)] for a, b in itertools.pairwise(x) for c, d in itertools.pairwise(y)]
    sheet = np.array(quads)
    solid = np.concatenate([np.pad(sheet, ((0, 0), (0, 0), (0, 1)), constant_values=z) for z in (-THIN / 2, THIN / 2)], axis=1)
    points, cells = np.unique(solid.reshape(-1, 3).round(9), axis=0, return_inverse=True)
    meshio.Mesh(1e3 * points, [("hexahedron", cells.reshape(-1, 8))]).write(path)
    return THIN * (2 * (side**2 - ring / 2 * hole**2 * np.sin(2 * pi / ring)) + side * (pitch - side))


@pytest.mark.parametrize("basis", [FreeModes((1, 2), "in-plane"), CraigBampton()], ids=["free", "Craig-Bampton"])
def test_a_link_with_pin_holes(tmp_path, basis):
    volume = eyed_bar(tmp_path / "link.vtu")
    mesh = MeshFile(str(tmp_path / "link.vtu"), (0, 0, 0), (100.0, 0, 0), scale=1e-3)
    model = reduced(Modal(TALL, basis, mesh=mesh, interface=PinHole(0.004)), 0.1)
    assert model.mass == pytest.approx(7850 * volume, rel=1e-7)
    np.testing.assert_allclose(model.centre, [0.05, 0, 0], atol=1e-9)
    assert model.kinds[0] == "in-plane bending"
    start, end, centre = model.at_stations[:, 0]
    np.testing.assert_allclose(start[[1, 5]], [end[1], -end[5]], rtol=1e-6)  # symmetric
    assert start[1] * centre[1] < 0
    line = model.planar().line
    assert line[0, 0] == pytest.approx(-0.05) and line[-1, 0] == pytest.approx(0.05)


def test_wrong_meshes_are_named(tmp_path):
    points, cells = bent_box("hexahedron")
    apart = np.vstack([points, np.add(points, [1.0, 0, 0])])
    files = {
        "plate.vtu": meshio.Mesh(points, [("quad", cells[:, :4])]),
        "mixed.vtu": meshio.Mesh(points, [("hexahedron", cells[:4]), ("tetra", cells[4:, :4])]),
        "two.vtu": meshio.Mesh(apart, [("hexahedron", np.vstack([cells, cells + len(points)]))]),
        "bar.vtu": meshio.Mesh(points, [("hexahedron", cells)]),
    }
    for name, mesh in files.items():
        mesh.write(tmp_path / name)
    start, end = (0, 0, 0), (LENGTH, 0, 0)
    for name, message in (
        ("plate.vtu", "cells = quad: must be one kind of solid cells"),
        ("mixed.vtu", "cells = hexahedron, tetra: must be one kind"),
        ("two.vtu", "parts = 2: must be 1"),
    ):
        with pytest.raises(ValueError, match=message):
            read_mesh(tmp_path / name, start, end)
    bar = tmp_path / "bar.vtu"
    with pytest.raises(ValueError, match=r"distance of start and end = 0.0 file units"):
        read_mesh(bar, start, start)
    with pytest.raises(ValueError, match=r"cosine of normal and link axis = 0.*: must lie in"):
        read_mesh(bar, start, end, (0.1, 0, 1))
    with pytest.raises(ValueError, match=r"distance of its joints = 0.175 m: must be the link's length, 0.2 m"):
        reduced(Modal(TALL, mesh=MeshFile(str(bar), start, end)), 0.2)
    with pytest.raises(ValueError, match=r"interface = EndFace.*: 0 nodes at the end joint"):
        reduced(Modal(TALL, mesh=MeshFile(str(bar), start, (0.15, 0, 0)), interface=EndFace()), 0.15)


# --- cells that do not share faces -----------------------------------------------------------------------------------


def split(points, cells, cell):
    """The mesh with one tetrahedron cut in two across an edge: the new node hangs in its neighbours' edge."""
    a, b, c, d = cells[cell]
    middle = len(points)
    halves = [[a, middle, c, d], [middle, b, c, d]]
    return np.vstack([points, (points[a] + points[b]) / 2]), np.vstack([np.delete(cells, cell, axis=0), halves])


def test_hanging_nodes_are_refused(tmp_path):
    points, cells = bent_box("tetra", (4, 2, 1))
    assert len(hanging(points, cells, "tetra")) == 0
    inside = [k for k in range(len(cells)) if len(hanging(*split(points, cells, k), "tetra"))]
    assert len(inside) > len(cells) / 2  # the others' cut edge lies on the surface of their own cell alone
    more, cut = split(points, cells, inside[0])
    assert list(hanging(more, cut, "tetra")) == [len(points)]
    meshio.Mesh(more, [("tetra", cut)]).write(tmp_path / "cut.vtu")
    with pytest.raises(ValueError, match=r"hanging nodes = 1, one at .*: must be 0; touching cells are to share whole faces"):
        read_mesh(tmp_path / "cut.vtu", (0, 0, 0), (LENGTH, 0, 0))


def test_cells_of_other_kinds_are_matched_too():
    for kind in ("tetra10", "hexahedron", "hexahedron20", "hexahedron27"):
        points, cells = bent_box(kind, (4, 2, 1), bow=0.4)
        assert len(hanging(points, cells, kind)) == 0
    points, cells = bent_box("hexahedron", (4, 2, 1))
    fine, small = bent_box("hexahedron", (8, 4, 2))
    fine = np.add(fine, [LENGTH, 0, 0])  # a box of small cells on the end of one of large ones, corners shared
    both = np.vstack([points, fine])
    _, first, same = np.unique(both.round(9), axis=0, return_index=True, return_inverse=True)
    joined = same.ravel()[np.vstack([cells, small + len(points)])]
    assert len(hanging(both[first], joined, "hexahedron")) == 5 * 3 - 3 * 2


def test_adams_damps_by_frequency():
    """1 % below 100 Hz, 10 % to 1 kHz, critical above; of the bar's own frequencies, which are public."""
    np.testing.assert_array_equal(AdamsDamping().ratios([50.0, 99.9, 100.1, 999.0, 1001.0]), [0.01, 0.01, 0.1, 0.1, 1.0])
    bar = Modal(Section(0.02, 0.005, STEEL), FreeModes((1, 2, 3, 4), "in-plane"), damping=AdamsDamping())
    found = bar.frequencies(0.5)
    clamped = np.array([4.73004074, 7.85320462, 10.9956078]) ** 2 / (2 * pi * 0.5**2)  # Euler-Bernoulli, free ends
    np.testing.assert_allclose(found[:3], clamped * np.sqrt(STEEL.modulus / STEEL.density * 0.005**2 / 12), rtol=0.015)
    model = reduced(bar, 0.5).planar()
    np.testing.assert_array_equal(model.damping, AdamsDamping().ratios(found))
    assert set(model.damping) == {0.1} | ({0.01} if found[0] < 100 else set()) | ({1.0} if found[-1] > 1000 else set())
