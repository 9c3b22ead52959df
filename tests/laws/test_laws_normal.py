"""Normal contact laws as forces: they push, never pull, and their energy is the integral of their elastic part."""

import numpy as np
import pytest
from scipy.integrate import quad

from buckler.mbs import laws

KINDS = [kind for kind in vars(laws).values() if isinstance(kind, type)]
LAWS = [kind for kind in KINDS if issubclass(kind, laws.HysteresisLaw) and kind is not laws.HysteresisLaw]


# --- the force -----------------------------------------------------------------------------------------------------


def any_laws(random):
    for law in LAWS:
        yield law(10.0 ** random.uniform(3, 10), random.uniform(0.01, 1.0), random.uniform(1.0, 3.0))
    yield laws.KelvinVoigt(10.0 ** random.uniform(3, 8), 10.0 ** random.uniform(-1, 5))
    yield laws.Impact(10.0 ** random.uniform(3, 10), 10.0 ** random.uniform(0, 6), 1e-5, random.uniform(1.0, 3.0))
    yield laws.Hertz(10.0 ** random.uniform(3, 10))


def test_no_law_pulls_or_reaches_out():
    random = np.random.default_rng(7)
    pushed = released = 0
    for _ in range(20):
        for law in any_laws(random):
            depth = random.choice((-1.0, 1.0), 400) * 10.0 ** random.uniform(-9, -2, 400)
            rate = random.choice((-1.0, 1.0), 400) * 10.0 ** random.uniform(-6, 2, 400)
            onset = 10.0 ** random.uniform(-4, 1, 400)
            force = law.force(depth, rate, onset)
            assert np.all(np.isfinite(force)) and np.all(force >= 0.0)
            assert np.all(force[depth <= 0.0] == 0.0)
            assert np.all(force[(depth > 0.0) & (rate > 0.0)] > 0.0)
            assert np.all(law.force(0.0 * depth, rate, onset) == 0.0)
            pushed += np.count_nonzero(force)
            released += np.count_nonzero((depth > 0.0) & (force == 0.0))
    assert pushed > 10_000 and released > 10_000  # both branches were visited


@pytest.mark.parametrize("law", LAWS)
def test_the_force_is_its_equation(law):
    contact = law(2e7, 0.6, 1.5)
    chi = contact.hysteresis(0.6)
    assert contact.force(2e-5, 0.12, 0.5) == pytest.approx(2e7 * 2e-5**1.5 * (1.0 + chi * 0.12 / 0.5), rel=1e-14)
    assert contact.force(2e-5, -0.12, 0.5) == pytest.approx(2e7 * 2e-5**1.5 * (1.0 - chi * 0.12 / 0.5), rel=1e-13)
    assert contact.force(2e-5, -1.01 * 0.5 / chi, 0.5) == 0.0


def test_the_impact_force_is_its_equation():
    law = laws.Impact(8e9, 253.0, 1e-5, 1.5)
    assert law.force(4e-6, 0.1, 1.0) == pytest.approx(8e9 * 4e-6**1.5 + 253.0 * 0.4**2 * (3.0 - 0.8) * 0.1, rel=1e-14)
    assert law.force(5e-5, -0.1, 1.0) == pytest.approx(8e9 * 5e-5**1.5 - 25.3, rel=1e-14)
    assert law.force(1e-6, -10.0, 1.0) == 0.0
    assert laws.KelvinVoigt(1e5, 20.0).force(1e-4, -0.2, 1.0) == pytest.approx(10.0 - 4.0, rel=1e-14)


def test_potential_is_the_integral_of_the_elastic_force():
    for law in any_laws(np.random.default_rng(5)):
        assert isinstance(law, laws.NormalLaw)
        integral = quad(law.elastic, 0.0, 1e-3, epsabs=0.0, epsrel=1e-11)[0]
        assert law.potential(1e-3) == pytest.approx(integral, rel=1e-9)
        assert law.elastic(1e-3) == pytest.approx(law.stiffness * 1e-3**law.exponent, rel=1e-14)
        assert law.elastic(-1e-3) == 0.0 and law.potential(-1e-3) == 0.0
        assert law.force(1e-3, 0.0, 1.0) == pytest.approx(law.elastic(1e-3), rel=1e-14)


def test_step():
    assert laws.step(-1.0, 0.0, 2.0, 4.0, 10.0) == 2.0
    assert laws.step(1.0, 0.0, 2.0, 4.0, 10.0) == pytest.approx(2.0 + 8.0 * 0.0625 * 2.5, rel=1e-15)
    assert laws.step(2.0, 0.0, 2.0, 4.0, 10.0) == 6.0
    assert laws.step(123.456, 0.0, 2.0, 4.0, 10.0) == pytest.approx(10.0, rel=1e-15)
    np.testing.assert_allclose(laws.step(np.array([-1.0, 2.0, 9.0]), 0.0, 2.0, 4.0, 10.0), [2.0, 6.0, 10.0])


# --- making laws ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: laws.KelvinVoigt.from_restitution(1e5, 0.0, 1.0), r"restitution = 0\.0.*\(0, 1\]"),
        (lambda: laws.KelvinVoigt.from_restitution(1e5, 0.5, 0.0), r"mass = 0\.0 kg: must lie in \(0, inf\)"),
        (lambda: laws.KelvinVoigt.from_restitution(-1e5, 0.5, 1.0), r"stiffness = -100000\.0 N/m"),
        (lambda: laws.restitution(-0.1), r"chi = -0\.1.*\[0, inf\)"),
        (lambda: laws.chi_exact(1.5), r"restitution = 1\.5"),
        (lambda: laws.contact_time(laws.Hertz(1e9), 0.0, 1.0), r"mass = 0\.0 kg"),
        (lambda: laws.delivered(laws.KelvinVoigt(1e5, 1.0)), r"mass = None: the restitution of KelvinVoigt depends on it"),
        (lambda: laws.delivered(laws.Impact(1e9, 1.0, 1e-5), 1.0), r"speed = None: .* in \(0, inf\) m/s"),
        (lambda: laws.delivered(laws.Impact(1e9, 1.0, 1e-5), 1.0, -1.0), r"speed = -1\.0 m/s"),
        (lambda: laws.HuntCrossley("50 kN/m", 0.5), r"stiffness = 50 kN/m: must be in N/m\^1\.5, as exponent = 1\.5"),
        (lambda: laws.Impact("5 N/mm^2", 1.0, 1e-5, 1.0), r"stiffness = 5 N/mm\^2: must be in N/m\^1, as exponent = 1"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_stiffness_in_the_unit_of_its_exponent_is_a_plain_number():
    law = laws.HuntCrossley("2 N/mm^1.5", 0.5)
    assert law.stiffness == pytest.approx(2e3 * np.sqrt(1e3), rel=1e-14) and type(law.stiffness) is float


def test_laws_that_allow_a_dead_stop_accept_zero():
    for name in ("HuntCrossley", "LankaraniNikravesh", "HerbertMcWhannell", "LeeWang", "ZhiyingQishao", "CarvalhoMartins"):
        assert laws.delivered(getattr(laws, name)(1e9, 0.0)) > 0.0  # none of them delivers it


def test_a_law_that_makes_energy_is_refused():
    class Backwards(laws.HysteresisLaw):
        @staticmethod
        def hysteresis(e):
            return e - 1.0

    with pytest.raises(ValueError, match=r"chi = -0\.5"):
        Backwards(1e9, 0.5)
