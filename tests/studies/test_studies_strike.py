"""Strikes of the slider-crank under what its paper leaves open: gravity, motor, the stop."""

import numpy as np
import pytest

from buckler import mbs
from buckler.studies.kit import registry
from buckler.studies.striking import impact_models, slider_crank
from buckler.studies.striking.impact import ImpactParameters
from buckler.studies.striking.impact_map import SineStrip


def case(**given):
    """A strike of the beam, up to a crank angle of 190 degrees."""
    return slider_crank.Parameters(models="beam", until="190deg", **given)


def peak(p):
    return slider_crank.run(p).metrics["beam.impact_peak"].value


def test_gravity_and_motor_strike_as_found_for_the_paper():
    """27 N under gravity with 23.9 kN/m, where a straight strip without it strikes with 84 N; a stiff motor changes nothing."""
    found = {}
    for name, given in {
        "gravity": {"gravity": 9.81}, "plain": {}, "stiff motor": {"motor": 5000.0}, "motor": {"motor": 1.6},
    }.items():  # fmt: skip
        found[name] = peak(case(stop_stiffness=23925.0, **given))
    assert found["gravity"] == pytest.approx(27.0, abs=0.3) and found["plain"] == pytest.approx(83.6, rel=0.01)
    assert found["stiff motor"] == pytest.approx(found["plain"], rel=0.02)
    assert found["motor"] < 0.5 * found["plain"]


@pytest.mark.parametrize("given", [
    {"stop_stiffness": 3.7e3}, pytest.param({"stop_stiffness": 1e5}, marks=pytest.mark.slow),
    pytest.param({"stop_stiffness": 3.7e3, "mass": 1.0}, marks=pytest.mark.slow),
])  # fmt: skip
def test_no_stop_brings_the_straight_strip_within_a_newton_of_both_voltages(given):
    """F = c v^n misses 25 and 30 N at 2.5 and 3 V by (30 - 25 r)/(1 + r) at least, r = 1.2^n: 1 N asks for n = 0.60 or more.

    The simulation and the strip of sine modes both give less, whatever the stop.
    """

    def least(forces):
        r = forces[1] / forces[0]
        return (30 - 25 * r) / (1 + r)

    cases = [case(speed=1.25 * voltage / 2.7, **given) for voltage in (2.5, 3.0)]
    simulated = [peak(each) for each in cases]
    theory = [SineStrip(each).peak() for each in cases]
    assert least(simulated) > 1.05 and least(theory) > 1.05
    assert np.log(simulated[1] / simulated[0]) / np.log(1.2) < 0.58
    assert least([27.0, 27.0 * 1.2]) == pytest.approx(0.0)  # in proportion to speed both can be met


@pytest.mark.parametrize("name", ["slider-crank", "thickness-speed", "design"])
def test_every_study_states_gravity_and_motor(name):
    study = registry.load(name)
    p = study.Parameters()
    assert (p.gravity, p.motor, p.imperfection) == (0.0, 0.0, 1e-4) and p.gravity_vector == (0.0, 0.0)
    assert "gravity none in the plane" in p.describe() and "speed prescribed" in p.describe()
    assert study.Parameters(gravity=9.81, motor=2.0).gravity_vector == pytest.approx((0.0, -9.81), abs=1e-12)


def test_a_motor_turns_the_crank_at_the_speed_it_is_given_without_load():
    """Ramp: the voltage follows it; a strut's crank lags by its own inertia, (J + J_rotor) w'/slope, and little else."""
    p = ImpactParameters(motor=2.0, mass=0.02, friction=0.0)
    made = impact_models.mechanism("strut", p, 7.2e4, mbs.Ramp(1.0, 2.0, 0.5))
    assert not made.drives and made.velocities["crank"] == 1.0
    result = mbs.simulate(made, 0.5)
    angle = impact_models.crank_angle(result.signals)
    late = result.time > 0.4
    lag = (1.0 + 2.0 * result.time - np.gradient(angle, result.time))[late].mean()
    inertia = 0.02 + 7850 * 0.03 * 0.005 * 0.14**3 / 3
    assert lag == pytest.approx(inertia * 2.0 / 2.0, rel=0.15)
