"""Friction laws: odd, opposing, continuous, and right at their corners."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from buckler.mbs.laws import AdamsFriction, Ambrosio, Coulomb, FrictionLaw, LuGre, NoFriction, Stribeck, Threlfall, step

LAWS = (
    NoFriction(),
    Coulomb(0.2),
    Coulomb(0.2, v_reg=0.01, viscous=0.3),
    AdamsFriction(0.3, 0.1),
    Ambrosio(0.2, 1e-3, 1e-2),
    Ambrosio(0.2, 0.0, 1e-2),
    Threlfall(0.2, 1e-2),
    Stribeck(0.3, 0.1, 0.05),
    Stribeck(0.3, 0.1, 0.05, exponent=0.5, v_reg=2e-3, viscous=0.1),
)
SPEEDS = np.concatenate([-np.logspace(3, -8, 400), [0.0], np.logspace(-8, 3, 400)])


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_odd_opposing_and_at_rest_nothing(law):
    assert isinstance(law, FrictionLaw)
    mu = law.coefficient(SPEEDS)
    np.testing.assert_array_equal(law.coefficient(-SPEEDS), -mu)
    assert law.coefficient(0.0) == 0.0
    assert np.all(mu * SPEEDS >= 0.0)  # friction takes power, never gives any


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_bounded_and_settling_to_the_dynamic_coefficient(law):
    sliding = law.coefficient(SPEEDS) - getattr(law, "viscous", 0.0) * SPEEDS
    highest = getattr(law, "static", getattr(law, "dynamic", 0.0))
    assert np.max(np.abs(sliding)) <= highest + 1e-9
    # At 1e3 m/s a term proportional to speed is 1e3 times larger than mu: it leaves 1e-13 of rounding behind.
    assert sliding[-1] == pytest.approx(getattr(law, "dynamic", 0.0), abs=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_continuous(law):
    """Across every corner the jump over a gap shrinks with the gap (for Stribeck with delta < 1, with its power)."""
    corners = [getattr(law, name) for name in ("v_reg", "v_s", "v_d", "v0", "v1", "v_stribeck") if hasattr(law, name)]
    order = min(1.0, getattr(law, "exponent", 1.0))
    for corner in [0.0, *corners]:
        jump = [abs(law.coefficient(corner + gap) - law.coefficient(corner - gap)) for gap in (1e-6, 1e-9)]
        assert jump[1] <= 3.0 * 1e-3**order * jump[0] + 1e-15


def test_coulomb_values():
    law = Coulomb(0.2, v_reg=0.01, viscous=0.3)
    assert law.coefficient(0.005) == pytest.approx(0.1 + 0.0015, rel=1e-14)
    assert law.coefficient(-2.0) == pytest.approx(-0.2 - 0.6, rel=1e-14)


def test_adams_values_and_steps():
    law = AdamsFriction(0.3, 0.1, v_s=0.1, v_d=1.0)
    assert law.coefficient(0.1) == pytest.approx(0.3, rel=1e-15)
    assert law.coefficient(0.55) == pytest.approx(0.2, rel=1e-14)
    assert law.coefficient(-7.0) == pytest.approx(-0.1, rel=1e-15)
    v = np.linspace(-0.1, 0.1, 41)
    np.testing.assert_allclose(law.coefficient(v), step(v, -0.1, -0.3, 0.1, 0.3), atol=1e-16)
    v = np.linspace(0.1, 1.2, 41)
    np.testing.assert_allclose(law.coefficient(v), step(v, 0.1, 0.3, 1.0, 0.1), rtol=1e-14)
    assert AdamsFriction(0.3, 0.1) == law  # the defaults of ADAMS


def test_ambrosio_values():
    law = Ambrosio(0.2, v0=1e-3, v1=3e-3)
    assert law.coefficient(0.9e-3) == 0.0
    assert law.coefficient(2e-3) == pytest.approx(0.1, rel=1e-13)
    assert law.coefficient(-2.5e-3) == pytest.approx(-0.15, rel=1e-13)
    assert law.coefficient(0.4) == pytest.approx(0.2, rel=1e-14)


def test_threlfall_values():
    law = Threlfall(0.2, v0=0.01)
    assert law.coefficient(0.01) == pytest.approx(0.2 * (1.0 - math.exp(-3.0)), rel=1e-14)
    assert law.coefficient(-1e-9) / 1e-9 == pytest.approx(-0.2 * 3.0 / 0.01, rel=1e-6)
    assert law.coefficient(1.0) == pytest.approx(0.2, rel=1e-14)


def test_stribeck_values():
    law = Stribeck(0.3, 0.1, v_stribeck=0.05, exponent=1.0, v_reg=1e-4, viscous=0.2)
    assert law.coefficient(0.05) == pytest.approx(0.1 + 0.2 * math.exp(-1.0) + 0.01, rel=1e-14)
    assert law.coefficient(-0.5e-4) == pytest.approx(-0.5 * (0.1 + 0.2 * math.exp(-1e-3)) - 1e-5, rel=1e-12)
    assert Stribeck(0.3, 0.1, 0.05).coefficient(0.1) == pytest.approx(0.1 + 0.2 * math.exp(-4.0), rel=1e-14)


def test_lugre_settles_at_the_stribeck_curve():
    law = LuGre(0.3, 0.1, 0.05, bristle_stiffness=1e4, bristle_damping=10.0, viscous=0.2)
    for speed in (0.01, -0.05, 0.2):
        run = solve_ivp(lambda _, z, v=speed: law.rate(z, v), (0.0, 0.05), [0.0], method="Radau", rtol=1e-9, atol=1e-13)
        settled = law.coefficient(speed, run.y[0, -1])
        expected = (0.1 + 0.2 * math.exp(-((speed / 0.05) ** 2))) * math.copysign(1.0, speed) + 0.2 * speed
        assert settled == pytest.approx(expected, rel=1e-6)


def test_lugre_bristles_stay_bounded_and_odd():
    law = LuGre(0.3, 0.1, 0.05, bristle_stiffness=1e4, bristle_damping=1.0, viscous=0.2)
    speed, most = SPEEDS[SPEEDS != 0.0], 0.3 / 1e4
    assert np.all(law.rate(most, speed) <= 1e-9 * abs(speed))  # |z| never passes mu_s/s0
    assert np.all(law.rate(-most, speed) >= -1e-9 * abs(speed))
    np.testing.assert_array_equal(law.coefficient(-speed, -most / 2), -law.coefficient(speed, most / 2))
    assert law.rate(1e-5, 0.02) == pytest.approx(0.02 - 1e4 * 0.02 * 1e-5 / (0.1 + 0.2 * math.exp(-0.16)), rel=1e-14)
    assert law.coefficient(0.02, 1e-5) == pytest.approx(0.1 + law.rate(1e-5, 0.02) + 0.2 * 0.02, rel=1e-14)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: AdamsFriction(0.1, 0.3), r"static = 0\.1.*\[0\.3, inf\)"),
        (lambda: AdamsFriction(0.3, 0.1, v_s=0.1, v_d=0.1), r"v_d = 0\.1 m/s: must lie in \(0\.1, inf\)"),
        (lambda: Ambrosio(0.1, 1e-2, 1e-3), r"v1 = 0\.001 m/s: must lie in \(0\.01, inf\)"),
        (lambda: Stribeck(0.1, 0.2, 0.05), r"static = 0\.1.*\[0\.2, inf\)"),
        (lambda: LuGre(0.3, 0.0, 0.05), r"dynamic = 0\.0.*\(0, inf\)"),
        (lambda: LuGre(0.1, 0.3, 0.05), r"static = 0\.1.*\[0\.3, inf\)"),
        (lambda: LuGre(0.3, 0.1, 0.0), r"v_stribeck = 0\.0 m/s"),
        (lambda: LuGre(0.3, 0.1, 0.05, bristle_stiffness=0.0), r"bristle_stiffness = 0\.0 1/m"),
        (lambda: LuGre(0.3, 0.1, 0.05, bristle_damping=-1.0), r"bristle_damping = -1\.0 s/m"),
        (lambda: LuGre(0.3, 0.1, 0.05, viscous=-1.0), r"viscous = -1\.0 s/m"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()
