"""Modal links without the engine: meshes, finite elements against beam theory, modes, reduction, planar kinematics."""

import pickle
from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

pytest.importorskip("skfem")

from scipy.linalg import eigh

from buckler.mbs.elements.section import Material, Section
from buckler.mbs.modal import Box, CraigBampton, FreeModes, MeshFile, Modal, Nearest, PinHole, reduced
from buckler.mbs.modal.modes import free_modes, participation, rigid_fit
from buckler.mbs.modal.solid import assemble, box_mesh, rigid_motions

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
    small = assemble(box_mesh(LENGTH, WIDE, THIN, (2, 1, 1)), STEEL).stiffness.toarray()
    lowest = np.linalg.eigvalsh(small)[:7]
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


@pytest.mark.parametrize(("order", "rate", "bound"), [(1, 2, 7e-3), (2, 4, 2e-5)])
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
    np.testing.assert_allclose(model.omega, timoshenko(section, LENGTH, 2), rtol=3e-3)  # a wide bar is stiffer: 0.27 %
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
    assert guyan == pytest.approx(-0.25, abs=0.01)  # the cubic between the ends: F L^3/64
    assert abs(full) < 4e-3 and -0.012 < free < -0.008


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
    assert planar.kinds == ["in-plane bending", "in-plane bending", "axial"]
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
    """All nodes of the mesh moved in the plane: their energies and momenta by M and K are the reduced model's."""
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
    v0[2], v0[3:], a0[3:] = 300.0, v0[3:] / 10, a0[3:] / 1e7  # all terms of one size: 1e3 to 1e4 m/s^2
    h = 1e-7
    times = np.array([-h, 0, h])[:, None]
    q, v = q0 + v0 * times + a0 * times**2 / 2, v0 + a0 * times
    for station in ("start", "end", "centre"):
        motion = planar.motion(station, q, v, np.tile(a0, (3, 1)))
        for lower, upper in (
            ("position", "velocity"),
            ("velocity", "acceleration"),
            ("angle", "spin"),
            ("spin", "spin_rate"),
        ):
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
    assert (
        np.linalg.norm(line - middle, axis=1).min() < 0.04 * LENGTH and line[0, 0] * middle[0] < 0
    )  # bends to both sides of the mean axis


def test_rigid_fit_finds_translation_and_rotation(bar):
    nodes, about = np.arange(40), np.array([0.01, 0.02, 0.03])
    motion = np.array([1.0, -2, 3, 0.4, -0.5, 0.6])
    field = (rigid_motions(bar.nodes - about) @ motion).reshape(1, -1, 3)
    move, turn = rigid_fit(bar, nodes, about, field)
    np.testing.assert_allclose(np.hstack([move, turn])[0], motion, atol=1e-10)


# --- wrong input ------------------------------------------------------------------------------------------------------

SMALL, NOWHERE = Box((2, 1, 1)), MeshFile("nowhere.vtu", (0, 0, 0), (1, 0, 0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FreeModes(()), r"numbers = \(\): must be a list of at least 1"),
        (lambda: FreeModes((1, 1)), r"numbers = \(1, 1\): must be given once each"),
        (lambda: FreeModes((0, 1)), r"numbers\[0\] = 0: must be a whole number in \[1, 1000\]"),
        (lambda: FreeModes((1.5,)), r"numbers\[0\] = 1.5: must be a whole number"),
        (lambda: FreeModes((1,), "bending"), r"counting = 'bending': must be one of 'flexible', 'free', 'in-plane'"),
        (lambda: CraigBampton(fixed=-1), r"fixed = -1: must be a whole number in \[0, 1000\]"),
        (lambda: Modal(FLAT, modes=(1, 2)), r"modes = \(1, 2\): must be FreeModes"),
        (lambda: Modal(FLAT, damping=-0.1), r"damping = -0.1: must lie in \[0, 10\]"),
        (lambda: Modal(FLAT, FreeModes((1, 2)), damping=(0.1,)), r"damping = \(0.1,\): must be one ratio, or one for"),
        (lambda: Modal(FLAT, CraigBampton(), damping=(0.1,)), r"damping = \(0.1,\)"),
        (lambda: Modal(replace(FLAT, material=replace(STEEL, poisson=0.5))), r"poisson = 0.5: must lie in \[-0.999"),
        (lambda: Modal(FLAT, order=3), r"order = 3: must be a whole number in \[1, 2\]"),
        (lambda: Box((4, 0, 1)), r"elements\[1\] = 0: must be a whole number in \[1, 1000\]"),
        (lambda: Box((4, 1)), r"elements = \(4, 1\): must be a list of 3"),
        (lambda: PinHole(0.0), r"radius = 0.0 m: must lie in \(0, inf\) m"),
        (lambda: Nearest(2), r"count = 2: must be a whole number in \[3"),
        (lambda: MeshFile("x.vtu", (0, 0), (1, 0, 0)), r"start = \(0, 0\): must be a list of 3"),
        (lambda: MeshFile("x.vtu", (0, 0, 0), (1, 0, 0), scale=0), r"scale = 0 m: must lie in \(0, inf\) m"),
        (lambda: reduced(Modal(FLAT), 0.0), r"length = 0.0 m: must lie in"),
        (lambda: reduced(Modal(FLAT, FreeModes((900,)), mesh=SMALL), 0.1), r"numbers = \(900,\): must lie in"),
        (lambda: reduced(Modal(FLAT, CraigBampton(fixed=900), mesh=SMALL), 0.1), r"fixed = 900: must lie in \[0, 79\]"),
        (lambda: reduced(Modal(FLAT, CraigBampton((9,), fixed=2)), 0.1), r"numbers = \(9,\): must lie in \[1, 8\]"),
        (lambda: reduced(Modal(FLAT, interface=PinHole(1e-4)), 0.1), r"interface = PinHole.*: \d+ nodes at the start"),
        (lambda: reduced(Modal(FLAT, interface=Nearest(2000)), 0.1), r"interface = Nearest.*: the two joints share"),
        (lambda: reduced(Modal(FLAT, mesh=NOWHERE), 0.1), r"mesh = 'nowhere.vtu': must be a file"),
    ],
)  # fmt: skip
def test_wrong_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()
