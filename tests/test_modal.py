"""Modal links without the engine: meshes, finite elements against beam theory, modes, reduction, planar kinematics."""

import itertools
import pickle
from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

pytest.importorskip("skfem")
meshio = pytest.importorskip("meshio")

from scipy.linalg import eigh  # noqa: E402

from mbs.modal import Box, CraigBampton, EndFace, FreeModes, MeshFile, Modal, Nearest, PinHole, reduced  # noqa: E402
from mbs.modal.modes import free_modes, participation, rigid_fit  # noqa: E402
from mbs.modal.solid import EDGES, SolidMesh, assemble, box_mesh, read_mesh, rigid_motions  # noqa: E402
from mbs.sections import Material, Section  # noqa: E402

STEEL = Material(modulus=207e9, density=7850.0, poisson=0.29)
LENGTH, WIDE, THIN = 0.175, 0.020, 0.005
FLAT = Section(width=WIDE, thickness=THIN, material=STEEL)  # bends over its 5 mm
TALL = Section(width=THIN, thickness=WIDE, material=STEEL)  # bends over its 20 mm
NO_CONTRACTION = replace(STEEL, poisson=0.0)


# --- finite elements --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def bar():
    return assemble(box_mesh(LENGTH, WIDE, THIN, (8, 2, 1)), STEEL)


def test_matrices_are_symmetric_and_rigid_motion_is_free(bar):
    stiffness = bar.stiffness
    assert abs(stiffness - stiffness.T).max() < 1e-14 * abs(stiffness).max()
    assert abs(bar.mass - bar.mass.T).max() < 1e-14 * abs(bar.mass).max()
    assert abs(stiffness @ rigid_motions(bar.nodes)).max() < 1e-13 * abs(stiffness).max()
    lowest = np.linalg.eigvalsh(stiffness.toarray())[:8]
    assert abs(lowest[:6]).max() < 1e-6 * lowest[6] and lowest[6] > 0  # six, and no seventh


def test_mass_centre_and_inertia_are_those_of_the_box(bar):
    mass = 7850.0 * LENGTH * WIDE * THIN
    assert bar.mass.sum() == pytest.approx(mass, rel=1e-13)
    assert bar.weights.sum() == pytest.approx(mass, rel=1e-13) and bar.weights.min() > 0
    np.testing.assert_allclose(bar.centre, [LENGTH / 2, 0, 0], atol=1e-15)
    turn = rigid_motions(bar.nodes - bar.centre)[:, 3:]
    inertia = turn.T @ (bar.full_mass @ turn)
    sides = np.array([LENGTH, WIDE, THIN]) ** 2
    np.testing.assert_allclose(inertia, np.diag(mass / 12 * (sides.sum() - sides)), atol=1e-12 * mass * LENGTH**2)


def test_uniform_strain_stores_the_exact_energy(bar):
    """A linear displacement field: the patch test, with the full Hooke tensor."""
    rng = np.random.default_rng(3)
    gradient = 1e-3 * rng.standard_normal((3, 3))
    strain = (gradient + gradient.T) / 2
    field = (bar.nodes @ gradient.T).ravel()
    lame, shear = 207e9 * 0.29 / (1.29 * 0.42), 207e9 / 2.58
    density = shear * (strain**2).sum() + lame / 2 * np.trace(strain) ** 2
    assert 0.5 * field @ (bar.stiffness @ field) == pytest.approx(density * LENGTH * WIDE * THIN, rel=1e-12)


def axial_error(n, order):
    solid = assemble(box_mesh(LENGTH, WIDE, THIN, (n, 1, 1)), NO_CONTRACTION, order)
    omega, modes = free_modes(solid, 24)
    axial = participation(solid, modes)[:, 0] > 0.9
    return omega[axial][0] / (pi / LENGTH * sqrt(207e9 / 7850.0)) - 1


@pytest.mark.parametrize(("order", "rate", "bound"), [(1, 2, 7e-3), (2, 4, 1.2e-5)])
def test_axial_frequency_converges_to_the_wave_speed_at_the_elements_rate(order, rate, bound):
    """Without lateral contraction omega = pi c/L is exact in three dimensions."""
    errors = np.array([axial_error(n, order) for n in (4, 8)])
    assert (errors > 0).all() and errors[1] < bound
    assert np.log2(errors[0] / errors[1]) == pytest.approx(rate, abs=0.2)


def timoshenko(section, length, count):
    """Free-free bending frequencies, rad/s: Ritz with Legendre polynomials of degree 20."""
    degree = 20
    x, w = np.polynomial.legendre.leggauss(degree + 2)
    basis = np.polynomial.legendre.legvander(x, degree)
    slope = np.stack([np.polynomial.legendre.Legendre.basis(k).deriv()(x) for k in range(degree + 1)], axis=1) * 2 / length
    w = w * length / 2
    none = np.zeros_like(basis)
    shear, bend = np.hstack([slope, -basis]), np.hstack([none, slope])
    move, turn = np.hstack([basis, none]), np.hstack([none, basis])
    stiffness = section.shear_stiffness * shear.T * w @ shear + section.bending_stiffness * bend.T * w @ bend
    mass = section.mass_per_length * move.T * w @ move + section.inertia_per_length * turn.T * w @ turn
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True)[2 : 2 + count])


@pytest.mark.parametrize("section", [FLAT, TALL], ids=["5 mm", "20 mm"])
def test_bending_frequencies_are_timoshenkos(section):
    model = reduced(Modal(section, FreeModes((1, 2), "in-plane"), mesh=Box((24, 2, 1))), LENGTH)
    assert model.kinds == ["in-plane bending"] * 2
    np.testing.assert_allclose(model.omega, timoshenko(section, LENGTH, 2), rtol=2.5e-3)
    euler = 22.3733 / LENGTH**2 * sqrt(section.bending_stiffness / section.mass_per_length)
    thin = model.omega[0] / euler
    assert thin == pytest.approx(1, abs=3e-3) if section is FLAT else thin < 0.97


def test_bending_frequency_converges_from_above_without_locking():
    """Each halving of the element divides the error by 2^4; first-order elements lock and are far too stiff."""
    def first(elements, order=2):
        return free_modes(assemble(box_mesh(LENGTH, THIN, WIDE, elements), STEEL, order), 1)[0][0]

    exact = first((48, 2, 2))
    errors = np.array([first((n, n // 4, n // 4)) for n in (4, 8, 16)]) / exact - 1
    rates = np.log2(errors[:-1] / errors[1:])
    assert (errors > 0).all() and errors[-1] < 5e-4
    assert (rates > 2.5).all(), rates
    assert first((16, 2, 1), order=1) / exact > 1.5


def test_torsion_frequency_is_saint_venants():
    model = reduced(Modal(TALL, FreeModes((4,)), mesh=Box((24, 6, 2))), LENGTH)
    ratio = THIN / WIDE
    torsion_constant = WIDE * THIN**3 * (1 / 3 - 0.21 * ratio * (1 - ratio**4 / 12))
    polar = WIDE * THIN * (WIDE**2 + THIN**2) / 12
    shear_modulus = 207e9 / 2.58
    assert model.kinds == ["torsion"] and model.participation[0, 3] > 0.99
    assert model.omega[0] == pytest.approx(pi / LENGTH * sqrt(shear_modulus * torsion_constant / (7850 * polar)), rel=1e-2)
    assert not model.moves_in_plane.any()


# --- statics of the Craig-Bampton modes -------------------------------------------------------------------------------


def deformation(model, forces):
    """Modal amplitudes under forces (fx, fy, moment) at start, end and centre that balance each other."""
    return np.einsum("scm,sc->m", model.shapes, forces) / model.stiffness


@pytest.mark.parametrize("section", [FLAT, TALL], ids=["5 mm", "20 mm"])
def test_static_modes_alone_carry_end_loads_exactly(section):
    """Opposite end moments bend to a circle, opposite end forces stretch: three static modes hold both."""
    section = replace(section, material=NO_CONTRACTION)  # rigid end faces disturb no section that keeps its shape
    model = reduced(Modal(section, CraigBampton(fixed=0)), LENGTH).planar()
    assert len(model) == 3
    q = deformation(model, np.array([[0, 0, -1.0], [0, 0, 1.0], [0, 0, 0]]))
    start, end, centre = model.shapes @ q
    curvature = 1 / section.bending_stiffness
    assert (end - start)[2] == pytest.approx(LENGTH * curvature, rel=1e-9)
    assert centre[1] - (start[1] + end[1]) / 2 == pytest.approx(-(LENGTH**2) / 8 * curvature, rel=1e-9)
    q = deformation(model, np.array([[-1.0, 0, 0], [1.0, 0, 0], [0, 0, 0]]))
    start, end, _ = model.shapes @ q
    assert (end - start)[0] == pytest.approx(LENGTH / section.axial_stiffness, rel=1e-9)


def test_mid_force_bends_the_bar_as_timoshenko_says():
    """F L^3/(48 E I) + F L/(4 k G A) at the middle of the pinned bar; vibrating modes bring it there."""
    section, force = FLAT, np.array([[0, 0.5, 0], [0, 0.5, 0], [0, -1.0, 0]])
    exact = LENGTH**3 / (48 * section.bending_stiffness) + LENGTH / (4 * section.shear_stiffness)
    found = {}
    for modes in (CraigBampton(fixed=0), CraigBampton(fixed=12), FreeModes((1, 2, 3), "in-plane")):
        model = reduced(Modal(section, modes), LENGTH).planar()
        start, end, centre = model.shapes @ deformation(model, force)
        found[modes] = ((start[1] + end[1]) / 2 - centre[1]) / exact - 1
    guyan, full, free = found.values()
    assert abs(full) < 2e-3
    assert guyan < -0.2  # a force inside the bar is not among the static loads: 3/4 of it is what the chord's parabola gives
    assert -0.1 < free < -1e-3


# --- choosing modes ---------------------------------------------------------------------------------------------------


def test_modes_counted_from_the_six_rigid_ones_carry_no_flexibility():
    model = reduced(Modal(FLAT, FreeModes((4, 5, 6), counting="free")), LENGTH)
    assert len(model.omega) == 0 and len(model.planar()) == 0 and model.table() == []
    assert model.planar().inertia == pytest.approx(model.mass * (LENGTH**2 + THIN**2) / 12, rel=1e-12)
    seventh = reduced(Modal(FLAT, FreeModes((6, 7, 8), counting="free")), LENGTH)
    assert list(seventh.numbers) == [1, 2]


def test_same_numbers_in_three_countings():
    """The 5 mm bar's flexible modes 4 to 6: torsion and two in the plane; the 20 mm bar's: none in the plane."""
    flat = reduced(Modal(FLAT, FreeModes((4, 5, 6))), LENGTH)
    assert flat.kinds == ["torsion", "in-plane bending", "in-plane bending"]
    assert list(flat.planar().numbers) == [5, 6]
    tall = reduced(Modal(TALL, FreeModes((4, 5, 6))), LENGTH)
    assert tall.kinds == ["torsion", "out-of-plane bending", "out-of-plane bending"] and len(tall.planar()) == 0
    planar = reduced(Modal(TALL, FreeModes((4, 5, 6), "in-plane")), LENGTH)
    assert len(planar.planar()) == 3 and planar.frequencies.min() > 15e3
    assert planar.kinds == ["in-plane bending"] * 3
    third = reduced(Modal(TALL, FreeModes((3,), "in-plane")), LENGTH)
    assert third.kinds == ["axial"]
    assert third.omega[0] == pytest.approx(pi / LENGTH * sqrt(207e9 / 7850), rel=2e-3)  # contraction's inertia lowers it


def test_order_of_numbers_and_their_damping_are_kept():
    model = reduced(Modal(FLAT, FreeModes((5, 1, 3)), damping=(0.05, 0.01, 0.03)), LENGTH)
    assert list(model.numbers) == [5, 1, 3]
    assert list(model.planar().damping) == [0.05, 0.01]  # mode 3 moves out of the plane


def test_a_square_bar_has_its_mixed_modes_parted():
    square = Section(width=0.01, thickness=0.01, material=STEEL)
    model = reduced(Modal(square, FreeModes((1, 2, 3, 4)), mesh=Box((12, 1, 1))), LENGTH)
    assert model.kinds == ["in-plane bending", "out-of-plane bending"] * 2
    assert model.omega[0] == pytest.approx(model.omega[1], rel=1e-9)
    assert model.participation[0, 1] > 0.999 and model.participation[1, 2] > 0.999


@pytest.mark.parametrize("modes", [FreeModes((1, 2, 3, 4), "in-plane"), CraigBampton()], ids=["free", "Craig-Bampton"])
def test_modes_keep_to_mean_axes_and_diagonalise_both_matrices(modes):
    modal = Modal(FLAT, modes)
    solid = assemble(box_mesh(LENGTH, THIN, WIDE, modal.mesh.elements), STEEL)
    model = reduced(modal, LENGTH)
    vectors = model.modes.reshape(len(model.omega), -1).T
    np.testing.assert_allclose(vectors.T @ (solid.full_mass @ vectors), np.eye(len(model.omega)), atol=1e-9)
    stiffness = vectors.T @ (solid.stiffness @ vectors)
    scale = np.outer(model.omega, model.omega)
    np.testing.assert_allclose(stiffness / scale, np.eye(len(model.omega)), atol=1e-6)
    planar = model.planar()
    assert abs(planar.translation).max() < 1e-12 and abs(planar.turning).max() < 1e-12
    assert abs(planar.gyration + planar.gyration.T).max() < 1e-12
    # lateral contraction has a little of the kinetic energy, out of the plane
    assert (np.diag(planar.gram) <= 1).all() and (np.diag(planar.gram) > 0.99).all()


def test_reduction_is_repeatable_kept_and_its_specification_pickles():
    modal = Modal(FLAT, FreeModes((1, 2, 3)))
    first = reduced(modal, LENGTH)
    assert reduced(pickle.loads(pickle.dumps(modal)), LENGTH) is first
    again = reduced(replace(modal, damping=0.02), LENGTH)
    np.testing.assert_array_equal(first.modes, again.modes)
    assert first.at_stations[0, 0, 1] > 0  # signs are settled: up at the start


# --- meshes -----------------------------------------------------------------------------------------------------------

KUHN = [[0, *np.cumsum(step)] for step in itertools.permutations((1, 2, 4))]
"""Six tetrahedra of a cube whose corners are numbered x + 2 y + 4 z."""
CORNER = [0, 1, 3, 2, 4, 5, 7, 6]


def bent_box(kind, elements=(4, 2, 1), bow=0.0):
    """A box in cells of any kind, sheared to y + bow x^2: its volume stays, its cells of second order hold it exactly."""
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


@pytest.mark.parametrize(("suffix", "kind"), [(".vtu", "hexahedron27"), (".inp", "tetra10"), (".msh", "hexahedron"), (".vtk", "hexahedron20")])
def test_a_file_in_other_axes_and_millimetres_gives_the_same_link(tmp_path, suffix, kind):
    """A mesh turned, moved and in mm, with a point and a triangle that belong to no solid, is the bar again."""
    points, cells = bent_box(kind, (8, 1, 1))
    angle = 0.7
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    turn = turn @ [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    shift = np.array([5.0, -7.0, 11.0])
    placed = np.vstack([1e3 * points @ turn.T + shift, [[999.0, 0, 0]]])
    extra = [] if suffix == ".inp" else [("triangle", np.array([[0, 1, 2]]))]
    path = tmp_path / f"bar{suffix}"
    meshio.Mesh(placed, [*extra, (kind, cells)]).write(path, **({"file_format": "gmsh"} if suffix == ".msh" else {}))
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
                quads.append(np.array(corners) + [centre, 0])
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
    assert model.mass == pytest.approx(7850 * volume, rel=1e-9)
    np.testing.assert_allclose(model.centre, [0.05, 0, 0], atol=1e-9)
    assert model.kinds[0] == "in-plane bending"
    start, end, centre = model.at_stations[:, 0]
    np.testing.assert_allclose(start[[1, 5]], [end[1], -end[5]], rtol=1e-6)  # symmetric
    assert start[1] * centre[1] < 0
    line = model.planar().line
    assert line[0, 0] == pytest.approx(-0.05) and line[-1, 0] == pytest.approx(0.05)


# --- planar kinematics ------------------------------------------------------------------------------------------------


def random_state(model, seed=0, times=5):
    rng = np.random.default_rng(seed)
    scale = 1e-3 * LENGTH * sqrt(model.mass)
    q, v, a = (rng.standard_normal((times, 3 + len(model))) for _ in range(3))
    for values, factor in ((q, 1.0), (v, 1e4), (a, 1e8)):
        values[:, 3:] *= scale * factor
    return q, 10 * v, 1e3 * a


@pytest.mark.parametrize("modes", [FreeModes((1, 2, 3, 4), "in-plane"), CraigBampton()], ids=["free", "Craig-Bampton"])
def test_energies_and_momenta_are_those_of_the_whole_mesh(modes):
    """Every node of the mesh moved in the plane: 1/2 v^T M v, 1/2 u^T K u and the sums of momentum are the reduced model's."""
    model = reduced(Modal(FLAT, modes), LENGTH)
    solid = assemble(box_mesh(LENGTH, THIN, WIDE, Box().elements), STEEL)
    planar = model.planar()
    q, v, _ = random_state(planar)
    shapes = model.modes[model.moves_in_plane]
    strain = []
    for row, rate in zip(q, v, strict=True):
        c, s = np.cos(row[2]), np.sin(row[2])
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        local = np.einsum("k,kna->na", row[3:], shapes)
        place = solid.nodes - solid.centre + local
        slip = np.einsum("k,kna->na", rate[3:], shapes)
        speed = [*rate[:2], 0] + (slip + rate[2] * np.cross([0, 0, 1], place)) @ turn.T
        where = [*row[:2], 0] + place @ turn.T
        heavy = solid.mass @ speed
        strain.append(0.5 * local.ravel() @ (solid.stiffness @ local.ravel()))
        assert planar.kinetic(row[None], rate[None])[0] == pytest.approx(0.5 * (speed * heavy).sum(), rel=1e-9)
        linear, angular = planar.momentum(row[None], rate[None])
        np.testing.assert_allclose(linear[0], heavy.sum(axis=0)[:2], rtol=1e-9)
        assert angular[0] == pytest.approx(np.cross(where, heavy)[:, 2].sum(), rel=1e-9)
    np.testing.assert_allclose(planar.strain(q), strain, rtol=1e-6)
    power = (2 * planar.damping * planar.frequency * v[:, 3:] ** 2).sum(axis=1)
    np.testing.assert_allclose(planar.damping_power(v), power)


def test_velocity_and_acceleration_of_stations_are_derivatives():
    planar = reduced(Modal(FLAT, CraigBampton()), LENGTH).planar()
    q0, v0, a0 = (row[0] for row in random_state(planar, seed=4))
    h = 1e-7
    times = np.array([-h, 0, h])[:, None]
    q, v = q0 + v0 * times + a0 * times**2 / 2, v0 + a0 * times
    for station in ("start", "end", "centre"):
        motion = planar.motion(station, q, v, np.tile(a0, (3, 1)))
        for lower, upper in (("position", "velocity"), ("velocity", "acceleration"), ("angle", "spin"), ("spin", "spin_rate")):
            values = getattr(motion, lower)
            np.testing.assert_allclose((values[2] - values[0]) / (2 * h), getattr(motion, upper)[1], rtol=1e-6)


def test_ends_middle_and_line_agree_at_rest_and_in_bending():
    planar = reduced(Modal(FLAT), LENGTH).planar()
    q = np.zeros((1, 6))
    for station, x in (("start", -LENGTH / 2), ("end", LENGTH / 2), ("centre", 0.0)):
        np.testing.assert_allclose(planar.motion(station, q).position, [[x, 0]], atol=1e-15)
    q[0, 2:4] = pi / 2, 1e-4
    line = planar.points(q)[0]
    np.testing.assert_allclose(line[0], planar.motion("start", q).position[0], atol=1e-12)
    np.testing.assert_allclose(line[-1], planar.motion("end", q).position[0], atol=1e-12)
    middle = planar.motion("centre", q).position[0]
    assert np.abs(line - middle).min() < 1e-6 and line[0, 0] * middle[0] < 0  # bends to both sides of the mean axis


def test_rigid_fit_finds_translation_and_rotation(bar):
    nodes, about = np.arange(40), np.array([0.01, 0.02, 0.03])
    motion = np.array([1.0, -2, 3, 0.4, -0.5, 0.6])
    field = (rigid_motions(bar.nodes - about) @ motion).reshape(1, -1, 3)
    move, turn = rigid_fit(bar, nodes, about, field)
    np.testing.assert_allclose(np.hstack([move, turn])[0], motion, atol=1e-10)


# --- wrong input ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FreeModes(()), r"numbers = \(\): must be one mode at least"),
        (lambda: FreeModes((1, 1)), r"numbers = \(1, 1\): .* none of them twice"),
        (lambda: FreeModes((0, 1)), r"numbers = 0: must be a whole number in \[1, 1000\]"),
        (lambda: FreeModes((1.5,)), r"numbers = 1.5: must be a whole number"),
        (lambda: FreeModes((1,), "bending"), r"counting = 'bending': must be one of 'flexible', 'free', 'in-plane'"),
        (lambda: CraigBampton(fixed=-1), r"fixed = -1: must be a whole number in \[0, 1000\]"),
        (lambda: Modal(FLAT, modes=(1, 2)), r"modes = \(1, 2\): must be FreeModes"),
        (lambda: Modal(FLAT, damping=-0.1), r"damping = -0.1: must lie in \[0, 10\]"),
        (lambda: Modal(FLAT, FreeModes((1, 2)), damping=(0.1,)), r"damping = \(0.1,\): must be one ratio, or one for each"),
        (lambda: Modal(FLAT, CraigBampton(), damping=(0.1,)), r"damping = \(0.1,\)"),
        (lambda: Modal(replace(FLAT, material=replace(STEEL, poisson=0.5))), r"poisson = 0.5: must lie in \[-0.999, 0.499\]"),
        (lambda: Modal(FLAT, order=3), r"order = 3: must be a whole number in \[1, 2\]"),
        (lambda: Box((4, 0, 1)), r"elements\[1\] = 0: must be a whole number in \[1, 1000\]"),
        (lambda: Box((4, 1)), r"elements = \(4, 1\): must be three numbers"),
        (lambda: PinHole(0.0), r"radius = 0.0 m: must lie in \(0, inf\] m"),
        (lambda: Nearest(2), r"count = 2: must be a whole number in \[3"),
        (lambda: MeshFile("x.vtu", (0, 0), (1, 0, 0)), r"start = \(0.0, 0.0\): must be three numbers"),
        (lambda: MeshFile("x.vtu", (0, 0, 0), (1, 0, 0), scale=0), r"scale = 0 m: must lie in \(0, inf\] m"),
        (lambda: reduced(Modal(FLAT), 0.0), r"length = 0.0 m: must lie in"),
        (lambda: reduced(Modal(FLAT, FreeModes((900,)), mesh=Box((2, 1, 1))), 0.1), r"numbers = \(900,\): must lie in \[1, 127\]"),
        (lambda: reduced(Modal(FLAT, CraigBampton(fixed=900), mesh=Box((2, 1, 1))), 0.1), r"fixed = 900: must lie in \[0, 79\]"),
        (lambda: reduced(Modal(FLAT, CraigBampton((9,), fixed=2)), 0.1), r"numbers = \(9,\): must lie in \[1, 8\]"),
        (lambda: reduced(Modal(FLAT, interface=PinHole(1e-4)), 0.1), r"interface = PinHole\(radius=0.0001\): \d+ nodes at the start"),
        (lambda: reduced(Modal(FLAT, interface=Nearest(2000)), 0.1), r"interface = Nearest\(count=2000\): the two joints share"),
        (lambda: reduced(Modal(FLAT, mesh=MeshFile("nowhere.vtu", (0, 0, 0), (1, 0, 0))), 0.1), r"mesh = 'nowhere.vtu': must be a file"),
    ],
)  # fmt: skip
def test_wrong_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_wrong_meshes_are_named(tmp_path):
    points, cells = bent_box("hexahedron")
    apart = np.vstack([points, points + [1.0, 0, 0]])
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
    with pytest.raises(ValueError, match="distance of start and end = 0.0 file units"):
        read_mesh(bar, start, start)
    with pytest.raises(ValueError, match="cosine of normal and link axis = 0.*: must lie in"):
        read_mesh(bar, start, end, (0.1, 0, 1))
    with pytest.raises(ValueError, match=r"distance of its joints = 0.175 m: must be the link's length, 0.2 m"):
        reduced(Modal(TALL, mesh=MeshFile(str(bar), start, end)), 0.2)
    with pytest.raises(ValueError, match=r"interface = EndFace.*: 0 nodes at the end joint"):
        reduced(Modal(TALL, mesh=MeshFile(str(bar), start, (0.15, 0, 0)), interface=EndFace()), 0.15)
