"""The law of true stiction: elastic while stuck, the limit while sliding, never more; what it stores it gives back."""

import numpy as np
import pytest

from buckler.mbs.laws import LuGre, Stiction

LAW = Stiction(0.3, 0.2, 0.01, bristle_stiffness=1e4, bristle_damping=5.0, viscous=0.1)
SPEEDS = np.linspace(-0.1, 0.1, 41)


def test_stuck_bristle_is_a_spring_and_does_not_forget():
    z = 0.0
    for step in (1e-5, 5e-6, -2e-5, 1e-5):
        z = LAW.after(z, step, 1.0)
    assert z == pytest.approx(5e-6, abs=1e-20)
    assert LAW.after(z, 0.0, 1e6) == z
    assert LAW.coefficient(0.0, z) == pytest.approx(1e4 * z, rel=1e-14)


@pytest.mark.parametrize("kind", [Stiction, LuGre])
def test_by_default_a_stuck_body_gives_way_by_micrometres(kind):
    law = kind(0.3, 0.2, 0.01)
    assert law.coefficient(0.0, 3e-6) == pytest.approx(0.3, rel=1e-12)


@pytest.mark.parametrize("bristle", [-3e-5, -1e-6, 0.0, 2e-5, 3e-5])
def test_force_stays_between_its_limits(bristle):
    plain = LAW.coefficient(SPEEDS, bristle) - 0.1 * SPEEDS
    assert (np.abs(plain) <= LAW.limit(SPEEDS) * (1 + 1e-14)).all()
    np.testing.assert_allclose(LAW.coefficient(-SPEEDS, -bristle), -LAW.coefficient(SPEEDS, bristle), rtol=1e-14)


def test_sliding_settles_at_the_stribeck_curve():
    for speed in (0.002, -0.02, 0.5):
        z = LAW.after(0.0, speed, 1.0)
        assert LAW.coefficient(speed, z) == pytest.approx(LAW.limit(speed) * np.sign(speed) + LAW.viscous * speed, rel=1e-12)
    assert LAW.limit(0.0) == pytest.approx(0.3) and LAW.limit(10.0) == pytest.approx(0.2)


def test_it_takes_energy_and_never_makes_it():
    """Over any path, work done on it is no less than what it then holds."""
    rng = np.random.default_rng(3)
    z, work, h = 0.0, 0.0, 1e-5
    v = 0.0
    for _ in range(20_000):
        v += rng.normal(0, 2e-3) - 0.01 * v
        before = LAW.coefficient(v, z)
        z = LAW.after(z, v, h)
        work += 0.5 * (before + LAW.coefficient(v, z)) * v * h
        assert work >= LAW.stored(z) * (1 - 1e-9) - 1e-15
