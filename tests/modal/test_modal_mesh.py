"""Modal links from mesh files: every kind of cell, curved cells, other axes and units, pin holes, wrong meshes."""

import itertools
from math import pi

import numpy as np
import pytest

pytest.importorskip("skfem")

import meshio
from meshed import FLAT, LENGTH, STEEL, TALL, THIN, WIDE

from buckler.mbs.elements.section import Section
from buckler.mbs.modal import AdamsDamping, BarModes, CraigBampton, EndFace, FreeModes, MeshFile, Modal, PinHole, reduced
from buckler.mbs.modal.mesh import KINDS, grid_of, read_mesh
from buckler.mbs.modal.reduction import moves_in_plane
from buckler.mbs.modal.solid import assemble, free_modes, rigid_motions

START, END = (0, 0, 0), (LENGTH, 0, 0)
SOLID = [kind for kind in KINDS if kind.startswith(("tetra", "hexa"))]
PLANAR = [kind for kind in KINDS if kind not in SOLID]
CURVED = [kind for kind in KINDS if kind[-1].isdigit()]
RING = ((0, 1), (1, 2), (2, 3), (3, 0))
BRICK = (*RING, *((a + 4, b + 4) for a, b in RING), *((k, k + 4) for k in range(4)))
FACES = ((0, 3, 4, 7), (1, 2, 5, 6), (0, 1, 4, 5), (2, 3, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))
EXTRA = {
    "tetra10": ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
    "hexahedron20": BRICK,
    "hexahedron27": (*BRICK, *FACES, tuple(range(8))),
    "triangle6": ((0, 1), (1, 2), (2, 0)),
    "quad8": RING,
    "quad9": (*RING, (0, 1, 2, 3)),
}
"""Corners between which the further nodes of a cell lie, in VTK's order."""
KUHN = [[0, *np.cumsum(step)] for step in itertools.permutations((1, 2, 4))]
"""Six tetrahedra of a cube whose corners are numbered x + 2 y + 4 z."""
CORNER = [0, 1, 3, 2, 4, 5, 7, 6]


def bent_box(kind, elements=(4, 2, 1), bow=0.0):
    """A box, or a rectangle, in cells of any kind, sheared to y + bow x^2: it keeps its volume, second-order cells its shape."""
    sides = [(0, LENGTH), (-WIDE / 2, WIDE / 2), (-THIN / 2, THIN / 2)][: 3 if kind in SOLID else 2]
    grid = np.meshgrid(*(np.linspace(*side, n + 1) for side, n in zip(sides, elements, strict=False)), indexing="ij")
    points = np.stack([*grid, *[0.0 * grid[0]] * (3 - len(sides))], axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(grid[0].shape)
    steps = [(0, 0), (1, 0), (1, 1), (0, 1)]
    steps = [(*s, z) for z in (0, 1) for s in steps] if kind in SOLID else steps
    shape = [n - 1 for n in number.shape]
    cells = np.stack([number[tuple(slice(k, k + n) for k, n in zip(s, shape, strict=True))].ravel() for s in steps], axis=1)
    if kind.startswith("tetra"):
        cells = np.concatenate([cells[:, [CORNER.index(c) for c in tet]] for tet in KUHN])
    if kind.startswith("triangle"):
        cells = np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])
    columns, corners = [cells], cells
    for group in EXTRA.get(kind, ()):
        columns.append(len(points) + np.arange(len(cells))[:, None])
        points = np.concatenate([points, points[corners[:, list(group)]].mean(axis=1)])
    cells = np.hstack(columns)
    _, first, same = np.unique(points.round(10), axis=0, return_index=True, return_inverse=True)
    points, cells = points[first], same.ravel()[cells]
    return points + np.outer(bow * points[:, 0] ** 2, [0, 1, 0]), cells


def solid_of(kind, points, cells):
    return assemble(grid_of(kind, points, cells), LENGTH, STEEL, width=THIN)


def written(path, kind, points, cells):
    meshio.Mesh(points, [(kind, cells)]).write(path)
    return MeshFile(str(path), START, END)


@pytest.mark.parametrize("kind", SOLID)
def test_every_kind_of_cell_gives_the_same_bar(kind):
    points, cells = bent_box(kind, (8, 1, 1))
    solid = solid_of(kind, points, cells)
    assert solid.mass.sum() == pytest.approx(7850 * LENGTH * WIDE * THIN, rel=1e-12)
    assert abs(solid.stiffness @ rigid_motions(solid.nodes)).max() < 1e-12 * abs(solid.stiffness).max()
    omega, _ = free_modes(solid, 3)
    flat, tall = (Modal(section, BarModes(2, 0)).frequencies(LENGTH) for section in (FLAT, TALL))  # Timoshenko's
    np.testing.assert_allclose(omega[:3] / (2 * pi), [*flat, tall[0]], rtol=0.04 if kind.startswith("tet") else 0.03)


@pytest.mark.parametrize("kind", CURVED)
def test_curved_cells_keep_their_curve(kind):
    """Only with all nodes in their right places is the sheared volume that of the box, and its centre at bow L^2/3."""
    bow = 2.0
    points, cells = bent_box(kind, (3, 2, 1), bow)
    solid = solid_of(kind, points, cells)
    assert solid.mass.sum() == pytest.approx(7850 * LENGTH * WIDE * THIN, rel=1e-12)
    np.testing.assert_allclose(solid.centre, [LENGTH / 2, bow * LENGTH**2 / 3, 0], atol=1e-14)
    # a curved element's rigid motion still costs nothing
    assert abs(solid.stiffness @ rigid_motions(solid.nodes, solid.dim)).max() < 1e-12 * abs(solid.stiffness).max()


# --- files of other programs ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", CURVED)
@pytest.mark.parametrize("seed", [1, 2])
def test_nodes_in_any_order_are_put_where_they_lie(kind, seed, tmp_path):
    """Every cell has its further nodes in an order of its own, beside the middles of its edges."""
    points, cells = bent_box(kind, (5, 2, 1), 1.5)
    chance, count = np.random.default_rng(seed), len(EXTRA[kind])
    shuffled = cells.copy()
    for row in shuffled:
        row[-count:] = chance.permutation(row[-count:])
    assert (shuffled != cells).any()
    omega = free_modes(solid_of(kind, points, cells), 4)[0]
    grid, length = read_mesh(written(tmp_path / "mixed.vtu", kind, points, shuffled))
    np.testing.assert_allclose(free_modes(assemble(grid, length, STEEL, width=THIN), 4)[0], omega, rtol=1e-8)


@pytest.mark.parametrize("kind", list(KINDS))
def test_cells_that_go_round_the_other_way_are_the_same_cells(kind, tmp_path):
    points, cells = bent_box(kind, (5, 2, 1))
    mirrored = {"tetra": [0, 2, 1, 3], "hexahedron": [4, 5, 6, 7, 0, 1, 2, 3], "triangle": [0, 2, 1], "quad": [0, 3, 2, 1]}
    order = next(each for name, each in mirrored.items() if kind.startswith(name))
    turned = cells.copy()
    chosen = np.random.default_rng(3).random(len(cells)) < 0.5
    turned[chosen, : len(order)] = cells[chosen][:, order]  # the further nodes stay as they were
    omega = free_modes(solid_of(kind, points, cells), 4)[0]
    grid, length = read_mesh(written(tmp_path / "mirror.vtu", kind, points, turned))
    np.testing.assert_allclose(free_modes(assemble(grid, length, STEEL, width=THIN), 4)[0], omega, rtol=1e-8)


@pytest.mark.parametrize(
    ("kind", "order"), [("hexahedron", [0, 1, 3, 2, 4, 5, 7, 6]), ("quad", [0, 2, 1, 3]), ("hexahedron20", [0, 1, 3, 2])]
)
@pytest.mark.parametrize("cell", [0, 5])
def test_a_twisted_cell_is_named_with_file_and_number(kind, order, cell, tmp_path):
    points, cells = bent_box(kind, (4, 2, 1))
    cells[cell, : len(order)] = cells[cell, order]
    with pytest.raises(ValueError, match=rf"mesh '.*twisted.vtu': inverted cells = 1, the first is number {cell + 1}: must be 0"):
        read_mesh(written(tmp_path / "twisted.vtu", kind, points, cells))


# --- planar meshes --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", PLANAR)
def test_a_planar_mesh_is_a_bar_in_plane_stress(kind, tmp_path):
    """Bending as Timoshenko's bar, axial as the wave's speed; three rigid modes; nothing moves out of the plane."""
    points, cells = bent_box(kind, (16, 4))
    mesh = written(tmp_path / "plate.vtu", kind, points, cells)
    model = reduced(Modal(TALL, FreeModes((1, 2, 3)), mesh=mesh), LENGTH)
    assert model.mass == pytest.approx(7850 * LENGTH * WIDE * THIN, rel=1e-12)
    assert model.kinds == ["in-plane bending"] * 2 + ["axial"] and moves_in_plane(model.participation).all()
    exact = Modal(TALL, BarModes(2, 1)).frequencies(LENGTH)
    np.testing.assert_allclose(model.omega, 2 * pi * exact, rtol=3e-3)
    seventh = reduced(Modal(TALL, FreeModes((3, 4), counting="free"), mesh=mesh), LENGTH)
    assert list(seventh.numbers) == [1]
    static = reduced(Modal(TALL, CraigBampton(fixed=0), mesh=mesh), LENGTH).plane
    assert len(static) == 3 and static.inertia == pytest.approx(model.mass * (LENGTH**2 + WIDE**2) / 12, rel=1e-9)


def test_a_planar_mesh_lies_in_the_plane_of_motion(tmp_path):
    points, cells = bent_box("quad", (8, 2))
    upright = 1e3 * points[:, [0, 2, 1]]  # in x and z, in mm
    meshio.Mesh(upright, [("line", cells[:1, :2]), ("quad", cells)]).write(tmp_path / "upright.vtu")
    mesh = MeshFile(str(tmp_path / "upright.vtu"), START, (1e3 * LENGTH, 0, 0), (0, -1, 0), 1e-3)
    found = reduced(Modal(TALL, FreeModes((1,)), mesh=mesh), LENGTH)
    assert found.omega[0] == pytest.approx(free_modes(solid_of("quad", points, cells), 1)[0][0], rel=1e-9)
    with pytest.raises(ValueError, match=r"its quad cells reach 0.02 m out of one plane: must lie in the plane of motion"):
        read_mesh(MeshFile(str(tmp_path / "upright.vtu"), START, (1e3 * LENGTH, 0, 0), scale=1e-3))


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
    read, length = read_mesh(mesh)
    assert length == pytest.approx(LENGTH, rel=1e-12)
    corners = points[np.unique(cells[:, : 4 if kind == "tetra10" else 8])]
    np.testing.assert_allclose(np.sort(read.p[:, np.unique(read.t)].T, axis=0), np.sort(corners, axis=0), atol=1e-9)
    found = reduced(Modal(TALL, FreeModes((1,), "in-plane"), mesh=mesh), LENGTH)
    direct = solid_of(kind, points, cells)
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
    start, end, centre = model.plane.shapes[:, :, 0]
    np.testing.assert_allclose(start[1:], [end[1], -end[2]], rtol=1e-6)  # symmetric
    assert start[1] * centre[1] < 0
    line = model.plane.line
    assert line[0, 0] == pytest.approx(-0.05) and line[-1, 0] == pytest.approx(0.05)


def test_wrong_meshes_are_named(tmp_path):
    points, cells = bent_box("hexahedron")
    apart = np.vstack([points, np.add(points, [1.0, 0, 0])])
    files = {
        "lines.vtu": meshio.Mesh(points, [("line", cells[:, :2])]),
        "mixed.vtu": meshio.Mesh(points, [("hexahedron", cells[:4]), ("tetra", cells[4:, :4])]),
        "two.vtu": meshio.Mesh(apart, [("hexahedron", np.vstack([cells, cells + len(points)]))]),
        "bar.vtu": meshio.Mesh(points, [("hexahedron", cells)]),
    }
    for name, mesh in files.items():
        mesh.write(tmp_path / name)
    for name, message in (
        ("lines.vtu", "cells = line: must be one kind of cells"),
        ("mixed.vtu", "cells = hexahedron, tetra: must be one kind"),
        ("two.vtu", "parts = 2: must be 1"),
    ):
        with pytest.raises(ValueError, match=message):
            read_mesh(MeshFile(str(tmp_path / name), START, END))
    bar = str(tmp_path / "bar.vtu")
    with pytest.raises(ValueError, match=r"distance of start and end = 0.0 file units"):
        read_mesh(MeshFile(bar, START, START))
    with pytest.raises(ValueError, match=r"cosine of normal and link axis = 0.*: must lie in"):
        read_mesh(MeshFile(bar, START, END, (0.1, 0, 1)))
    with pytest.raises(ValueError, match=r"distance of its joints = 0.175 m: must be the link's length, 0.2 m"):
        reduced(Modal(TALL, mesh=MeshFile(bar, START, END)), 0.2)
    with pytest.raises(ValueError, match=r"interface = EndFace.*: 0 nodes at the end joint"):
        reduced(Modal(TALL, mesh=MeshFile(bar, START, (0.15, 0, 0)), interface=EndFace()), 0.15)


# --- cells that do not share faces -----------------------------------------------------------------------------------


def split(points, cells, cell):
    """The mesh with one tetrahedron cut in two across an edge: the new node hangs in its neighbours' edge."""
    a, b, c, d = cells[cell]
    middle = len(points)
    halves = [[a, middle, c, d], [middle, b, c, d]]
    return np.vstack([points, (points[a] + points[b]) / 2]), np.vstack([np.delete(cells, cell, axis=0), halves])


def test_hanging_nodes_are_refused(tmp_path):
    points, cells = bent_box("tetra", (4, 2, 1))
    refused = 0
    for k in range(len(cells)):
        more, cut = split(points, cells, k)
        try:
            grid_of("tetra", more, cut)
        except ValueError as error:
            refused += "hanging nodes = 1, one at" in str(error)
    assert refused > len(cells) / 2  # the others' cut edge lies on the surface of their own cell alone
    with pytest.raises(
        ValueError, match=r"cut.vtu': hanging nodes = 1, one at .*: must be 0; touching cells are to share whole faces"
    ):
        read_mesh(written(tmp_path / "cut.vtu", "tetra", *split(points, cells, 7)))


def test_adams_damps_by_frequency():
    """1 % below 100 Hz, 10 % to 1 kHz, critical above; of the bar's own frequencies, which are public."""
    np.testing.assert_array_equal(AdamsDamping().ratios([50.0, 99.9, 100.1, 999.0, 1001.0]), [0.01, 0.01, 0.1, 0.1, 1.0])
    bar = Modal(Section(0.02, 0.005, STEEL), FreeModes((1, 2, 3, 4), "in-plane"), damping=AdamsDamping())
    found = bar.frequencies(0.5)
    clamped = np.array([4.73004074, 7.85320462, 10.9956078]) ** 2 / (2 * pi * 0.5**2)  # Euler-Bernoulli, free ends
    np.testing.assert_allclose(found[:3], clamped * np.sqrt(STEEL.modulus / STEEL.density * 0.005**2 / 12), rtol=0.015)
    model = reduced(bar, 0.5).plane
    np.testing.assert_array_equal(model.damping, AdamsDamping().ratios(found))
    assert set(model.damping) == {0.1} | ({0.01} if found[0] < 100 else set()) | ({1.0} if found[-1] > 1000 else set())
