"""Which modes a modal link takes, and their motion in the plane."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

pytest.importorskip("skfem")
from meshed import FLAT, LENGTH, STEEL, TALL, THIN, WIDE, solid_bar

from buckler.mbs.elements.section import Section
from buckler.mbs.modal import Box, CraigBampton, FreeModes, MeshFile, Modal, PinHole, reduced
from buckler.mbs.modal.reduction import moves_in_plane
from buckler.mbs.modal.solid import rigid_motions

# --- choosing modes ---------------------------------------------------------------------------------------------------


def test_modes_counted_from_the_six_rigid_ones_carry_no_flexibility():
    model = reduced(Modal(FLAT, FreeModes((4, 5, 6), counting="free")), LENGTH)
    assert len(model.omega) == 0 and len(model.plane) == 0 and model.table() == []
    assert model.plane.inertia == pytest.approx(model.mass * (LENGTH**2 + THIN**2) / 12, rel=1e-12)
    seventh = reduced(Modal(FLAT, FreeModes((6, 7, 8), counting="free")), LENGTH)
    assert list(seventh.numbers) == [1, 2]


def test_same_numbers_in_three_countings():
    """The 5 mm bar's flexible modes 4 to 6: torsion and two in the plane; the 20 mm bar's: none in the plane."""
    flat = reduced(Modal(FLAT, FreeModes((4, 5, 6))), LENGTH)
    assert flat.kinds == ["torsion", "in-plane bending", "in-plane bending"]
    assert list(flat.plane.numbers) == [5, 6]
    tall = reduced(Modal(TALL, FreeModes((4, 5, 6))), LENGTH)
    assert tall.kinds == ["torsion", "out-of-plane bending", "out-of-plane bending"] and len(tall.plane) == 0
    planar = reduced(Modal(TALL, FreeModes((4, 5, 6), "in-plane")), LENGTH)
    assert len(planar.plane) == 3 and planar.omega.min() > 2 * pi * 15e3
    assert planar.kinds == ["in-plane bending", "in-plane bending", "axial"]
    third = reduced(Modal(TALL, FreeModes((3,), "in-plane")), LENGTH)
    assert third.kinds == ["axial"]
    assert third.omega[0] == pytest.approx(pi / LENGTH * sqrt(207e9 / 7850), rel=2e-3)  # contraction's inertia lowers it


def test_order_of_numbers_and_their_damping_are_kept():
    model = reduced(Modal(FLAT, FreeModes((5, 1, 3)), damping=(0.05, 0.01, 0.03)), LENGTH)
    assert list(model.numbers) == [5, 1, 3]
    assert list(model.plane.damping) == [0.05, 0.01]  # mode 3 moves out of the plane


def test_a_square_bar_has_its_mixed_modes_parted():
    square = Section(width=0.01, thickness=0.01, material=STEEL)
    model = reduced(Modal(square, FreeModes((1, 2, 3, 4)), mesh=Box((12, 1, 1))), LENGTH)
    assert model.kinds == ["in-plane bending", "out-of-plane bending"] * 2
    assert model.omega[0] == pytest.approx(model.omega[1], rel=1e-9)
    assert model.participation[0, 1] > 0.999 and model.participation[1, 2] > 0.999


@pytest.mark.parametrize("modes", [FreeModes((1, 2, 3, 4), "in-plane"), CraigBampton()], ids=["free", "Craig-Bampton"])
def test_modes_keep_to_mean_axes_and_diagonalise_both_matrices(modes):
    modal = Modal(FLAT, modes)
    solid = solid_bar(THIN, WIDE, modal.mesh.elements)
    model = reduced(modal, LENGTH)
    vectors = model.modes.reshape(len(model.omega), -1).T
    np.testing.assert_allclose(vectors.T @ (solid.full_mass @ vectors), np.eye(len(model.omega)), atol=1e-9)
    stiffness = vectors.T @ (solid.stiffness @ vectors)
    scale = np.outer(model.omega, model.omega)
    np.testing.assert_allclose(stiffness / scale, np.eye(len(model.omega)), atol=1e-6)
    planar = model.plane
    momentum = rigid_motions(solid.nodes - solid.centre).T @ (solid.full_mass @ vectors)
    assert abs(momentum).max() < 1e-12
    assert abs(planar.gyration + planar.gyration.T).max() < 1e-12
    # lateral contraction has a little of the kinetic energy, out of the plane
    assert (np.diag(planar.gram) <= 1).all() and (np.diag(planar.gram) > 0.99).all()


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
    solid = solid_bar(THIN, WIDE, Box().elements)
    planar = model.plane
    q, v, _ = random_state(planar)
    shapes = model.modes[moves_in_plane(model.participation)]
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
        # momenta are the derivatives of the kinetic energy, which is quadratic in the rates
        ahead, behind = (planar.kinetic(np.tile(row, (3, 1)), rate + step * np.eye(3, len(rate))) for step in (1, -1))
        px, py, spin = (ahead - behind) / 2
        np.testing.assert_allclose([px, py], heavy.sum(axis=0)[:2], rtol=1e-9)
        assert row[0] * py - row[1] * px + spin == pytest.approx(np.cross(where, heavy)[:, 2].sum(), rel=1e-9)
    np.testing.assert_allclose(planar.strain(q), strain, rtol=1e-6)
    power = (2 * planar.damping * planar.frequency * v[:, 3:] ** 2).sum(axis=1)
    np.testing.assert_allclose(planar.damping_power(v), power)


def test_velocity_and_acceleration_of_stations_are_derivatives():
    planar = reduced(Modal(FLAT, CraigBampton()), LENGTH).plane
    q0, v0, a0 = (row[0] for row in random_state(planar, seed=4))
    v0[2], v0[3:], a0[3:] = 300.0, v0[3:] / 10, a0[3:] / 1e7  # all terms of one size: 1e3 to 1e4 m/s^2
    h = 1e-7
    times = np.array([-h, 0, h])[:, None]
    q, v = q0 + v0 * times + a0 * times**2 / 2, v0 + a0 * times
    for station in ("start", "end", "middle"):
        motion = planar.motion(station, q, v, np.tile(a0, (3, 1)))
        for lower, upper in (("position", "velocity"), ("velocity", "acceleration"), ("angle", "spin")):
            values = getattr(motion, lower)
            np.testing.assert_allclose((values[2] - values[0]) / (2 * h), getattr(motion, upper)[1], rtol=1e-6)


# --- wrong input ------------------------------------------------------------------------------------------------------


SMALL, NOWHERE = Box((2, 1, 1)), MeshFile("nowhere.vtu", (0, 0, 0), (1, 0, 0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: FreeModes(()), r"numbers = \(\): must be a list of at least 1"),
        (lambda: FreeModes((1, 1)), r"numbers = \(1, 1\): must not contain an item twice"),
        (lambda: FreeModes((1,), "bending"), r"counting = 'bending': must be one of 'flexible', 'free', 'in-plane'"),
        (lambda: Modal(FLAT, modes=(1, 2)), r"modes = \(1, 2\): must be FreeModes"),
        (lambda: Modal(FLAT, FreeModes((1, 2)), damping=(0.1,)), r"damping = \(0.1,\): must be one ratio, or one for"),
        (lambda: Modal(FLAT, CraigBampton(), damping=(0.1,)), r"damping = \(0.1,\)"),
        (lambda: Modal(replace(FLAT, material=replace(STEEL, poisson=0.5))), r"poisson = 0.5: must lie in \[-0.999"),
        (lambda: Box((4, 1)), r"elements = \(4, 1\): must be a list of 3"),
        (lambda: MeshFile("x.vtu", (0, 0), (1, 0, 0)), r"start = \(0, 0\): must be a list of 3"),
        (lambda: reduced(Modal(FLAT, FreeModes((900,)), mesh=SMALL), 0.1), r"numbers = \(900,\): must lie in"),
        (lambda: reduced(Modal(FLAT, CraigBampton(fixed=900), mesh=SMALL), 0.1), r"fixed = 900: must lie in \[0, 79\]"),
        (lambda: reduced(Modal(FLAT, CraigBampton((9,), fixed=2)), 0.1), r"numbers = \(9,\): must lie in \[1, 8\]"),
        (lambda: reduced(Modal(FLAT, interface=PinHole(1e-4)), 0.1), r"interface = PinHole.*: \d+ nodes at the start"),
        (lambda: reduced(Modal(FLAT, interface=lambda n, _: n[:, 0] < 1), 0.1), r"interface = .*: the two joints share"),
        (lambda: reduced(Modal(FLAT, mesh=NOWHERE), 0.1), r"mesh = 'nowhere.vtu': must be a file"),
    ],
)  # fmt: skip
def test_wrong_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()
