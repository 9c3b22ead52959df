"""Modal links without the engine: meshes, finite elements against beam theory, modes, reduction, planar kinematics."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

pytest.importorskip("skfem")
from meshed import FLAT, LENGTH, STEEL, TALL, THIN, WIDE, solid_bar

from buckler.mbs.modal import BarModes, Box, CraigBampton, FreeModes, Modal, reduced
from buckler.mbs.modal.reduction import moves_in_plane
from buckler.mbs.modal.solid import free_modes, participation, rigid_motions

NO_CONTRACTION = replace(STEEL, poisson=0.0)


# --- finite elements --------------------------------------------------------------------------------------------------


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


def axial_error(n):
    solid = solid_bar(WIDE, THIN, (n, 1, 1), NO_CONTRACTION)
    omega, modes = free_modes(solid, 24)
    axial = participation(solid, modes)[:, 0] > 0.9
    return omega[axial][0] / (pi / LENGTH * sqrt(207e9 / 7850.0)) - 1


def test_axial_frequency_converges_to_the_wave_speed_at_the_elements_rate():
    """Without lateral contraction omega = pi c/L is exact in three dimensions."""
    errors = np.array([axial_error(n) for n in (4, 8)])
    assert (errors > 0).all() and errors[1] < 2e-5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.2)


@pytest.mark.parametrize("section", [FLAT, TALL], ids=["5 mm", "20 mm"])
def test_bending_frequencies_are_timoshenkos(section):
    model = reduced(Modal(section, FreeModes((1, 2), "in-plane"), mesh=Box((24, 2, 1))), LENGTH)
    assert model.kinds == ["in-plane bending"] * 2
    timoshenko = 2 * pi * Modal(section, BarModes(2, 0)).frequencies(LENGTH)  # `test_bar_modes` has it exact
    np.testing.assert_allclose(model.omega, timoshenko, rtol=3e-3)  # a wide bar is stiffer: 0.27 %
    euler = 22.3733 / LENGTH**2 * sqrt(section.bending_stiffness / section.mass_per_length)
    thin = model.omega[0] / euler
    assert thin == pytest.approx(1, abs=3e-3) if section is FLAT else thin < 0.97


@pytest.mark.slow
def test_bending_frequency_converges_from_above_without_locking():
    """Each halving of the element divides the error by 2^4."""

    def first(elements):
        return free_modes(solid_bar(THIN, WIDE, elements, STEEL), 1)[0][0]

    exact = first((48, 2, 2))
    errors = np.array([first((n, n // 4, n // 4)) for n in (4, 8, 16)]) / exact - 1
    rates = np.log2(errors[:-1] / errors[1:])
    assert (errors > 0).all() and errors[-1] < 5e-4
    assert (rates > 2.5).all(), rates


@pytest.mark.slow
def test_torsion_frequency_is_saint_venants():
    model = reduced(Modal(TALL, FreeModes((4,)), mesh=Box((24, 6, 2))), LENGTH)
    ratio = THIN / WIDE
    torsion_constant = WIDE * THIN**3 * (1 / 3 - 0.21 * ratio * (1 - ratio**4 / 12))
    polar = WIDE * THIN * (WIDE**2 + THIN**2) / 12
    shear_modulus = 207e9 / 2.58
    assert model.kinds == ["torsion"] and model.participation[0, 3] > 0.99
    assert model.omega[0] == pytest.approx(pi / LENGTH * sqrt(shear_modulus * torsion_constant / (7850 * polar)), rel=1e-2)
    assert not moves_in_plane(model.participation).any()


# --- statics of the Craig-Bampton modes -------------------------------------------------------------------------------


def deformation(model, forces):
    """Modal amplitudes under forces (fx, fy, moment) at start, end and centre that balance each other."""
    return np.einsum("scm,sc->m", model.shapes, forces) / model.stiffness


@pytest.mark.parametrize("section", [FLAT, TALL], ids=["5 mm", "20 mm"])
def test_static_modes_alone_carry_end_loads_exactly(section):
    """Opposite end moments bend to a circle, opposite end forces stretch: three static modes hold both."""
    section = replace(section, material=NO_CONTRACTION)  # rigid end faces disturb no section that keeps its shape
    model = reduced(Modal(section, CraigBampton(fixed=0)), LENGTH).plane
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
        model = reduced(Modal(section, modes), LENGTH).plane
        start, end, centre = model.shapes @ deformation(model, force)
        found[modes] = ((start[1] + end[1]) / 2 - centre[1]) / exact - 1
    guyan, full, free = found.values()
    assert guyan == pytest.approx(-0.25, abs=0.01)  # the cubic between the ends: F L^3/64
    assert abs(full) < 4e-3 and -0.012 < free < -0.008
