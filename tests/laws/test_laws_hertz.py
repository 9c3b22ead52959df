"""Hertzian stiffness against hand calculation, limits, and the numbers of the crank-rocker paper."""

import math

import pytest

from buckler.mbs.laws import effective_modulus, hertz_external, hertz_internal

PER_MM = 1e3**1.5  # N/m^1.5 in N/mm^1.5
STEEL = effective_modulus(207e9, 0.29)


def test_effective_modulus():
    assert STEEL == pytest.approx(207e9 / (2.0 * (1.0 - 0.29**2)), rel=1e-14)
    assert effective_modulus(207e9, 0.29, 207e9, 0.29) == STEEL
    assert effective_modulus(207e9, 0.29, 1e30, 0.0) == pytest.approx(207e9 / (1.0 - 0.29**2), rel=1e-12)
    assert effective_modulus(70e9, 0.33, 207e9, 0.29) == pytest.approx(effective_modulus(207e9, 0.29, 70e9, 0.33), rel=1e-15)
    assert effective_modulus(70e9, 0.33, 207e9, 0.29) == pytest.approx(5.82933e10, rel=1e-6)


def test_stiffness_of_the_crank_rocker_paper():
    """The paper's 2.53e5 N/mm^1.5 is the rule for two convex bodies, not for a pin in a bush."""
    assert hertz_external(STEEL, 5.64e-3, 5.64e-3) / PER_MM == pytest.approx(2.53e5, rel=5e-4)


@pytest.mark.parametrize(("clearance", "published"), [(0.1e-3, 2.4e6), (0.25e-3, 1.5e6), (0.5e-3, 1.1e6)])
def test_pin_in_bush(clearance, published):
    got = hertz_internal(STEEL, 5e-3, 5e-3 + clearance) / PER_MM
    assert got == pytest.approx(published, abs=0.05e6)
    by_hand = 4.0 / 3.0 * STEEL * math.sqrt(5e-3 * (5e-3 + clearance) / clearance) / PER_MM
    assert got == pytest.approx(by_hand, rel=1e-12)


def test_a_flat_wall_is_the_limit_of_both():
    flat = 4.0 / 3.0 * STEEL * math.sqrt(5e-3)
    for radius in (1e3, 1e5):
        gap = 2.5e-3 / radius
        assert hertz_external(STEEL, 5e-3, radius) / flat == pytest.approx(1.0 - gap, abs=2.0 * gap**2 + 1e-15)
        assert hertz_internal(STEEL, 5e-3, radius) / flat == pytest.approx(1.0 + gap, abs=2.0 * gap**2 + 1e-15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: effective_modulus(0.0, 0.3), r"young1 = 0\.0 Pa: must lie in \(0, inf\) Pa"),
        (lambda: effective_modulus(1e9, 0.6), r"poisson1 = 0\.6.*\[0, 0\.5\]"),
        (lambda: effective_modulus(1e9, 0.3, -1.0, 0.3), r"young2 = -1\.0"),
        (lambda: effective_modulus(1e9, 0.3, 1e9, -0.1), r"poisson2 = -0\.1"),
        (lambda: hertz_external(1e11, 0.0, 1.0), r"radius1 = 0\.0 m"),
        (lambda: hertz_external(1e11, 1.0, -1.0), r"radius2 = -1\.0"),
        (lambda: hertz_external(-1e11, 1.0, 1.0), r"modulus = -1"),
        (lambda: hertz_internal(1e11, 5e-3, 5e-3), r"bush = 0\.005 m: must lie in \(0\.005, inf\) m"),
        (lambda: hertz_internal(1e11, 5e-3, 4e-3), r"bush = 0\.004"),
        (lambda: hertz_internal(1e11, 0.0, 4e-3), r"pin = 0\.0"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()
