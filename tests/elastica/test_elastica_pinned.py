"""The closed-form strip against 40-digit elliptic integrals, its own differential equation and its limits."""

import numpy as np
import pytest
from mpmath import mp, mpf

from buckler.elastica import pinned

FUNCTIONS = (pinned.load, pinned.stiffness, pinned.energy, pinned.end_angle, pinned.mid_deflection, pinned.curvature_max)


@pytest.fixture(autouse=True)
def forty_digits():
    with mp.workdps(40):
        yield


def parameters():
    """Elliptic parameters m from u = 1e-12 to an end angle of 179 degrees."""
    nearly_straight = [mpf(10) ** -k for k in range(1, 13)]
    return nearly_straight + [mp.sin(mp.radians(angle) / 2) ** 2 for angle in range(20, 180, 3)]


def exact(m):
    """Shortening, load, stiffness, energy, end angle, deflection and curvature by their definitions."""
    K, E = mp.ellipk(m), mp.ellipe(m)
    du = (E**2 / (1 - m) - 2 * E * K + K**2) / (m * K**2)
    dp = 4 * K * (E / (1 - m) - K) / m
    k = mp.sqrt(m)
    return 2 - 2 * E / K, 4 * K**2, dp / du, 8 * K * (E - (1 - m) * K), 2 * mp.asin(k), k / K, 4 * k * K


def relative(values, references):
    return max(abs(float(v / r - 1)) for v, r in zip(values, references, strict=True))


def test_every_function_of_shortening_matches_mpmath():
    shortening, *references = zip(*(exact(m) for m in parameters()), strict=True)
    u = np.array(shortening, dtype=float)
    assert u.min() < 1.1e-12 and u.max() > 1.67
    for function, reference in zip(FUNCTIONS, references, strict=True):
        assert relative(function(u), reference) < 1e-14, function.__name__


def test_shortening_matches_mpmath():
    shortening, load, *_ = zip(*(exact(m) for m in parameters()), strict=True)
    ours = pinned.shortening(np.array(load, float))
    error = np.abs([float(a - b) for a, b in zip(ours, shortening, strict=True)])
    # 2e-15 is what rounding the load itself costs: du/dp = 2/pi^2 however small the shortening
    assert np.all(error < 1e-14 * np.array(shortening, float) + 2e-15)


@pytest.mark.parametrize(
    ("angle", "tolerance"), [(1e-6, 2e-15), (0.01, 2e-15), (11.5, 2e-15), (60, 2e-15), (120, 5e-15), (150, 5e-14), (179, 1e-12)]
)
def test_shape_matches_mpmath(angle, tolerance):
    m = mp.sin(mp.radians(mpf(angle)) / 2) ** 2
    K, k, s = mp.ellipk(m), mp.sqrt(m), np.linspace(0.0, 1.0, 65)
    x, y, theta = pinned.shape(float(exact(m)[0]), s)
    for i, arc in enumerate(s):
        v = 2 * K * (mpf(arc) - mpf("0.5"))
        sn, cn = mp.ellipfun("sn", v, m=m), mp.ellipfun("cn", v, m=m)
        am = mp.atan2(sn, cn)
        x_exact = ((2 * mp.ellipe(am, m) - v) + (2 * mp.ellipe(m) - K)) / (2 * K)
        assert abs(x[i] - x_exact) < tolerance
        assert abs(y[i] - k * cn / K) < tolerance * k / K
        assert abs(theta[i] + 2 * mp.asin(k * sn)) < 2 * tolerance * mp.asin(k)


def test_shape_meets_its_ends_and_its_summaries():
    u, s = np.linspace(0.0, 1.7, 35)[:, None], np.linspace(0.0, 1.0, 33)
    x, y, theta = pinned.shape(u, s)
    assert x.shape == y.shape == theta.shape == (35, 33)
    assert np.all(x[:, 0] == 0.0) and np.all(y[:, [0, -1]] == 0.0) and np.all(y >= 0.0)
    np.testing.assert_allclose(x[:, -1], 1.0 - u[:, 0], atol=1e-15)
    np.testing.assert_allclose(theta[:, 0], pinned.end_angle(u[:, 0]), atol=1e-13)
    np.testing.assert_array_equal(theta, -theta[:, ::-1])
    np.testing.assert_allclose(y[:, 16], pinned.mid_deflection(u[:, 0]), atol=1e-12)
    np.testing.assert_allclose(pinned.curvature_max(u[:, 0]), pinned.load(u[:, 0]) * y[:, 16], rtol=2e-12)


def test_load_is_the_derivative_of_energy_and_stiffness_that_of_load():
    u, h = np.linspace(0.01, 1.5, 50), 1e-3

    def slope(f):  # central difference of order 6
        return (45 * (f(u + h) - f(u - h)) - 9 * (f(u + 2 * h) - f(u - 2 * h)) + f(u + 3 * h) - f(u - 3 * h)) / (60 * h)

    np.testing.assert_allclose(slope(pinned.energy), pinned.load(u), rtol=1e-11)
    np.testing.assert_allclose(slope(pinned.load), pinned.stiffness(u), rtol=1e-11)


def test_published_contact_force_of_the_slider_crank():
    """120 degree stop, L = 310 mm, strip 30 x 0.3 mm steel at the outer dead centre: 1.72465 N, 376 MPa."""
    L, stop = 0.31, 0.355307
    u = 1.0 - (stop - 0.14) / L
    assert pinned.load(u) * 210e9 * 0.0675e-12 / L**2 == pytest.approx(1.72465, abs=1e-4)
    assert pinned.surface_stress(u, thickness=0.3e-3, length=L, modulus=210e9) == pytest.approx(376e6, rel=2e-3)


def test_scalars_give_floats_and_arrays_keep_their_shape():
    for function in FUNCTIONS:
        assert type(function(0.3)) is float and type(function(np.float64(0.3))) is float
        assert type(function(0)) is float and type(function(np.array(0.3))) is float
        assert function([[0.1, 0.2, 0.3]]).shape == (1, 3) and function(np.empty((0, 2))).shape == (0, 2)
        assert function(np.array([0.1, 0.3]))[1] == function(0.3)
    assert type(pinned.shortening(12.0)) is float
    assert all(type(v) is float for v in pinned.shape(0.3, 0.2))
    assert pinned.surface_stress([0.1, 0.2], 1e-3, 0.3, 2e11).shape == (2,)


@pytest.mark.parametrize("wrong", [-1e-9, 1.7001, np.nan, np.inf])
def test_shortening_out_of_range_is_named(wrong):
    for function in FUNCTIONS:
        with pytest.raises(ValueError, match=r"shortening = .* outside 0 to 1\.7.* \(end shortening/L\)"):
            function(np.array([0.1, wrong]))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: pinned.shortening(9.8), r"load = 9\.8 is outside 9\.8696.* to 180 \(P L\^2/\(E I\)\)"),
        (lambda: pinned.shape(0.1, 1.1), r"s = 1\.1 is outside 0 to 1 \(arc length/L\)"),
        (lambda: pinned.surface_stress(0.1, 0.0, 0.3, 2e11), r"thickness = 0\.0 .*\(m\)"),
    ],
)
def test_other_wrong_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()
