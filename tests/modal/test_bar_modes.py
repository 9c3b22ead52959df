"""Modes of beam theory: frequencies and integrals against closed forms, convergence, bad input."""

import numpy as np
import pytest
from exact.columns import member
from exact.vibration import beam_frequencies

from buckler.mbs import Material, Section
from buckler.mbs.modal import BarModes, Modal
from buckler.mbs.modal.bar import bar_model

L, E, RHO, NU = 0.175, 207e9, 7850.0, 0.29
ROOTS = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464, 17.27875965739948])
"""cos(x) cosh(x) = 1."""


def beam_modes(width=0.005, thickness=0.020, *, bending=2, axial=1, damping=0.01, shear=True, degree=None, length=L):
    bar = Section(width, thickness, Material(modulus=E, density=RHO, poisson=NU))
    modal = Modal(bar, BarModes(bending, axial, shear), damping)
    return bar_model(modal, modal.modes, length, degree)


def section(thickness, width):
    return width * thickness, width * thickness**3 / 12


@pytest.mark.parametrize(("thickness", "width"), [(0.020, 0.005), (0.005, 0.020)])
def test_euler_bernoulli_and_axial_frequencies(thickness, width):
    area, second = section(thickness, width)
    data = beam_modes(width, thickness, bending=5, axial=2, shear=False)
    np.testing.assert_allclose(data.frequency[:5], (ROOTS / L) ** 2 * np.sqrt(E * second / (RHO * area)), rtol=1e-8)
    np.testing.assert_allclose(data.frequency[5:], np.array([1, 2]) * np.pi / L * np.sqrt(E / RHO), rtol=1e-10)


@pytest.mark.parametrize(("thickness", "width"), [(0.020, 0.005), (0.005, 0.020)])
def test_frequencies_are_timoshenkos(thickness, width):
    bar = Section(width, thickness, Material(modulus=E, density=RHO, poisson=NU))
    found = beam_modes(width, thickness, bending=5, axial=0).frequency
    assert found == pytest.approx(beam_frequencies(member(bar, L), "free-free", 5), rel=1e-9)


def test_integrals_of_the_slender_bar_are_those_of_the_closed_form_shapes():
    """All integrals, by quadrature of cosh, cos and sin instead of polynomials."""
    data = beam_modes(0.005, 0.020, bending=3, axial=2, shear=False)
    x, weights = np.polynomial.legendre.leggauss(60)
    x, weights = x * L / 2, weights * L / 2 * RHO * 0.005 * 0.020
    s = x + L / 2

    def bending(k, s):
        b = k / L
        ratio = (np.cosh(k) - np.cos(k)) / (np.sinh(k) - np.sin(k))
        return np.cosh(b * s) + np.cos(b * s) - ratio * (np.sinh(b * s) + np.sin(b * s))

    end = np.concatenate([data.shapes[1, 1, :3], data.shapes[1, 0, 3:]])  # of modes of unit mass
    v = np.array([bending(k, s) / bending(k, L) for k in ROOTS[:3]])
    u = np.array([np.cos(n * np.pi * s / L) / np.cos(n * np.pi) for n in (1, 2)])
    phi = np.zeros((5, 2, 60))
    phi[:3, 1], phi[3:, 0] = v * end[:3, None], u * end[3:, None]
    scale = 1.0
    gram = np.einsum("icx,jcx,x->ij", phi, phi, weights)
    np.testing.assert_allclose(data.gram, gram, atol=1e-9 * scale)
    np.testing.assert_allclose(data.radial, phi[:, 0] @ (weights * x), atol=1e-9 * scale * L)
    cross = phi[:, None, 0] * phi[None, :, 1] - phi[:, None, 1] * phi[None, :, 0]
    np.testing.assert_allclose(data.gyration, cross @ weights, atol=1e-9 * scale)
    np.testing.assert_allclose(np.diag(data.gram), 1, rtol=1e-9)
    assert abs(data.gyration).max() > 0.01 * scale and abs(data.radial).max() > 0.01 * scale * L
    np.testing.assert_allclose(data.shapes[2, 1, :3] / end[:3], [bending(k, L / 2) / bending(k, L) for k in ROOTS[:3]], atol=1e-7)
    np.testing.assert_allclose(data.shapes[0, 1, :3] / end[:3], [bending(k, 0) / bending(k, L) for k in ROOTS[:3]], atol=1e-7)
    slope = [(bending(k, L) - bending(k, L - 1e-6)) / 1e-6 / bending(k, L) for k in ROOTS[:3]]
    np.testing.assert_allclose(data.shapes[1, 2, :3] / end[:3], slope, rtol=1e-3)


@pytest.mark.parametrize("thickness", [0.020, 0.005])
def test_modes_are_orthogonal_to_rigid_motion(thickness):
    data = beam_modes(1e-4 / thickness, thickness, bending=4, axial=2)
    x, phi = data.line[:, 0], data.line_shapes
    rule = np.array([1.0, *[4.0, 2.0] * ((len(x) - 3) // 2), 4.0, 1.0]) * np.ptp(x) / (len(x) - 1) / 3  # Simpson's
    assert abs(rule @ phi.reshape(len(x), -1)).max() < 1e-4 * abs(phi).max() * L
    np.testing.assert_allclose(data.gram, np.eye(6), atol=1e-9)
    assert data.mass == pytest.approx(RHO * 1e-4 * L, rel=1e-13)
    assert data.inertia == pytest.approx(data.mass * (L**2 + thickness**2) / 12, rel=1e-13)
    for ends in (data.shapes[:2, 1, :4], data.shapes[:2, 0, 4:]):
        np.testing.assert_allclose(np.abs(ends[0]), np.abs(ends[1]), rtol=1e-9)


def test_damping_goes_to_the_modes_in_their_order():
    assert beam_modes(bending=1, axial=1, damping=(0.02, 0.03)).damping.tolist() == [0.02, 0.03]
    assert beam_modes(damping=0.02).damping.tolist() == [0.02] * 3


def test_bad_input_is_named():
    bar = Section(0.005, 0.02)
    with pytest.raises(ValueError, match=r"length = -1"):
        Modal(bar, BarModes()).planar(-1)
    with pytest.raises(ValueError, match=r"bending = 14"):
        BarModes(14)
    with pytest.raises(ValueError, match=r"bending \+ axial = 0"):
        BarModes(0, 0)
    with pytest.raises(ValueError, match="damping"):
        Modal(bar, BarModes(1, 1), (0.1,))
