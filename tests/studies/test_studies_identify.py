"""Causes of the measured forces: the likelihood by hand, evidence in closed form, information, real strikes."""

import numpy as np
import pytest
from scipy.stats import norm

from buckler.studies.kit import registry
from buckler.studies.striking import identify, slider_crank, strike
from buckler.studies.striking.evidence import (
    READINGS,
    Hypothesis,
    Strikes,
    crank_speed,
    hypotheses,
    information,
    log_likelihood,
    posterior,
    probabilities,
)


class Made:
    """A strike whose force is known: F = sqrt(k/k0) (v/v0)^n 27 N, n = 1/2 if nothing but the stop is its cause, else 1."""

    def __init__(self, causes=()):
        self.hypothesis, self.n = Hypothesis(causes), 1.0 if causes else 0.5

    def __call__(self, unit):
        speeds = np.array([crank_speed(reading.voltage, 0.0, 2.7) for reading in READINGS])
        return np.log(forces(self.hypothesis.values(unit)["stop_stiffness"][:, None], speeds, self.n))

    def weighed(self):
        return posterior(self, self.hypothesis, points=1024, samples=300, sd=1.0, model_error=0.0, seed=0)


def forces(stiffness, speed, n):
    return 27.0 * np.sqrt(stiffness / 2e4) * (speed / 1.25) ** n


# --- readings ---------------------------------------------------------------------------------------------------------


def test_likelihood_is_that_of_normal_readings_and_of_a_bound_kept():
    forces = [26.0, 25.5, 28.0, 45.0]
    by_hand = sum(norm.logpdf(x, y, 1.0) for x, y in zip((27, 25, 30), forces[:3], strict=True)) + norm.logcdf(44.18, 45, 1.0)
    assert log_likelihood([np.array(f) for f in forces], 1.0, 0.0) == pytest.approx(by_hand)
    far = log_likelihood([np.array(f) for f in (27.0, 25.0, 30.0, 20.0)], 1.0, 0.0)
    assert far == pytest.approx(3 * norm.logpdf(0))  # any force well below the bound is as good as any other
    wide = log_likelihood([np.array(f) for f in forces], 1.0, 0.1)
    assert wide == pytest.approx(
        sum(norm.logpdf(x, y, np.hypot(1, 0.1 * y)) for x, y in zip((27, 25, 30), forces[:3], strict=True))
        + norm.logcdf(44.18, 45, np.hypot(1, 4.5))
    )


def test_readings_hypotheses_and_the_speed_over_voltage():
    assert [(r.force, r.voltage, r.bound) for r in READINGS] == [
        (27.0, None, False), (25.0, 2.5, False), (30.0, 3.0, False), (44.18, 4.4, True),
    ]  # fmt: skip
    names = [h.name for h in hypotheses()]
    assert names[:6] == ["stop", "bow", "gravity", "motor", "dead_band", "compliance"] and len(names) == 6 + 9
    assert "motor_compliance" not in names and "gravity_motor" in names
    assert crank_speed(None, 0.7, 2.7) == 1.25 and crank_speed(2.7, 1.3, 2.7) == pytest.approx(1.25)
    assert crank_speed(4.4, 0.0, 2.7) == pytest.approx(1.25 * 4.4 / 2.7)
    assert crank_speed(3.7, 1.43, 2.7) - crank_speed(2.7, 1.43, 2.7) == pytest.approx(1.25 / 1.27)


# --- evidence ---------------------------------------------------------------------------------------------------------


def test_evidence_is_the_integral_over_the_prior():
    """One unknown: by a fine sum over the stiffness."""
    found, k = Made().weighed(), np.geomspace(1e3, 2e5, 200_001)
    logs = log_likelihood([forces(k, crank_speed(reading.voltage, 0.0, 2.7), 0.5) for reading in READINGS], 1.0, 0.0)
    assert found.log_evidence == pytest.approx(np.log(np.exp(logs).mean()), abs=0.02) and found.error < 0.05
    assert Hypothesis(()).values(found.best[None])["stop_stiffness"] == pytest.approx(k[np.argmax(logs)], rel=0.02)


def test_force_in_proportion_to_speed_wins_and_what_changes_nothing_pays_its_prior_only():
    stop, gravity, motor = (Made(causes).weighed() for causes in ((), ("gravity",), ("motor",)))
    assert gravity.log_evidence > stop.log_evidence + 1
    assert motor.log_evidence == pytest.approx(gravity.log_evidence, abs=0.1)  # the same forces, whatever the motor
    np.testing.assert_allclose(gravity.forces.mean(axis=1), [27.1, 25.1, 30.1, 44.1], atol=0.6)
    assert probabilities([stop, gravity, motor]).sum() == pytest.approx(1)


def test_strikes_between_those_simulated_and_how_far_they_are_off():
    """A power law is met exactly; sin(3 x) of the unit cube to 1e-3 of the force with 24 points, as the further ones tell."""

    def simulated(values):
        x = np.log(values["stop_stiffness"] / 1e3) / np.log(200)
        law = np.outer(values["stop_stiffness"] ** 0.5, np.arange(1.0, 5.0))
        return np.where(values["gravity"][:, None] > 0, law * np.exp(0.3 * np.sin(3 * x))[:, None], law)

    strikes, points = Strikes(Hypothesis(("gravity",)), simulated), np.random.default_rng(1).random((80, 2))
    assert np.isnan(strikes.add(points[:40])).all()
    unseen = strikes.spread(points[40:], 20)
    up, off = unseen[:, 1] >= 0.5, strikes.add(unseen)
    assert np.abs(off[~up]).max() < 1e-9 and 1e-6 < np.sqrt(np.mean(off[up] ** 2)) < 2e-3
    assert len({tuple(each) for each in unseen}) == 20
    np.testing.assert_allclose(np.exp(strikes(unseen)), simulated(strikes.hypothesis.values(unseen)), rtol=1e-9)


def test_information_of_readings_in_closed_form():
    """Two hypotheses alike: far apart a bit, the same none; one apart by d: numerically integrated."""
    draw = np.random.default_rng(0)
    half, same = np.array([0.5, 0.5]), draw.normal(0, 1e-3, 2000)
    assert information([same, same + 50.0], half, 1.0) == pytest.approx(1.0, abs=1e-6)
    assert information([same, same], half, 1.0) == pytest.approx(0.0, abs=1e-3)
    y = np.linspace(-10, 12, 20_001)
    mix = 0.5 * norm.pdf(y) + 0.5 * norm.pdf(y, 2.0)
    exact = np.trapezoid(norm.pdf(y) * np.log2(norm.pdf(y) / mix), y)
    assert information([same, same + 2.0], half, 1.0) == pytest.approx(exact, abs=0.03)
    assert information([same, same + 50.0], np.array([1.0, 0.0]), 1.0) == pytest.approx(0.0, abs=1e-9)


# --- strikes ----------------------------------------------------------------------------------------------------------


def test_a_strike_is_that_of_the_main_study():
    ours = strike.run(strike.Parameters())
    theirs = slider_crank.run(slider_crank.Parameters(models="beam"))
    assert ours.metrics["peak"].value == pytest.approx(theirs.metrics["beam.impact_peak"].value, rel=2e-3)
    assert ours.metrics["force_180"].value == pytest.approx(theirs.metrics["beam.contact_force_180"].value, rel=1e-3)
    assert ours.metrics["pulse"].value == pytest.approx(theirs.metrics["beam.impact_time"].value, rel=0.02)


def test_gravity_and_motor_strike_as_found_by_the_referee():
    """27 N under gravity with 23.9 kN/m, where a straight strip without it strikes with 84 N; stiff drives change nothing."""
    peak = {}
    for name, given in {
        "gravity": {"gravity": 9.81}, "plain": {}, "stiff motor": {"motor": 5000.0}, "stiff drive": {"compliance": 1e-5},
        "motor": {"motor": 1.6},
    }.items():  # fmt: skip
        peak[name] = strike.run(strike.Parameters(stop_stiffness=23925.0, **given)).metrics["peak"].value
    assert peak["gravity"] == pytest.approx(27.0, abs=0.3) and peak["plain"] == pytest.approx(83.6, rel=0.01)
    assert peak["stiff motor"] == pytest.approx(peak["plain"], rel=0.02)
    assert peak["stiff drive"] == pytest.approx(peak["plain"], rel=0.03)
    assert peak["motor"] < 0.5 * peak["plain"]


@pytest.mark.parametrize("given", [
    {"stop_stiffness": 3.7e3}, pytest.param({"stop_stiffness": 1e5}, marks=pytest.mark.slow),
    pytest.param({"stop_stiffness": 3.7e3, "mass": 1.0}, marks=pytest.mark.slow),
])  # fmt: skip
def test_no_stop_brings_the_straight_strip_within_a_newton_of_both_voltages(given):
    """F = c v^n misses 25 and 30 N at 2.5 and 3 V by (30 - 25 r)/(1 + r) at least, r = 1.2^n: 1 N asks for n = 0.60 or more.

    The simulation and the strip of sine modes both give less, whatever the stop.
    """
    from buckler.studies.striking.impact_map import sine_strip

    def least(forces):
        r = forces[1] / forces[0]
        return (30 - 25 * r) / (1 + r)

    cases = [strike.Parameters(speed=1.25 * voltage / 2.7, **given) for voltage in (2.5, 3.0)]
    simulated = [strike.run(case).metrics["peak"].value for case in cases]
    theory = [sine_strip(case).strike().peak for case in cases]
    assert least(simulated) > 1.05 and least(theory) > 1.05
    assert np.log(simulated[1] / simulated[0]) / np.log(1.2) < 0.58
    assert least([27.0, 27.0 * 1.2]) == pytest.approx(0.0)  # in proportion to speed both can be met


def test_a_strike_of_the_compiled_solver_is_that_of_the_engine():
    """With gravity the soft stop takes the slider in late: peak, its duration, torque, the next contact, the force at 180 deg."""
    p = strike.Parameters(stop_stiffness=23925.0, gravity=9.81, tolerance=1e-7)
    ours, theirs = strike.struck(p), strike.run(p).metrics
    for name, within in (("peak", 1e-3), ("pulse", 0.02), ("torque", 0.01), ("between", 0.01), ("force_180", 1e-3)):
        assert ours[name] == pytest.approx(theirs[name].value, rel=within), name


@pytest.mark.parametrize("given", [{}, {"speed": 2.0, "stop_stiffness": 3e3}, {"compliance": 0.3}])
def test_a_peak_alone_is_that_of_the_whole_strike(given):
    p = strike.Parameters(**given, tolerance=1e-7)
    assert strike.peak(p) == pytest.approx(strike.struck(p)["peak"], rel=2e-3)


@pytest.mark.slow
def test_the_study_on_few_strikes():
    result = identify.run(identify.Parameters(causes=("gravity",), pairs="no", samples=200))
    assert result.status == "OK", result.message
    m = {name: metric.value for name, metric in result.metrics.items()}
    assert m["gravity.log_evidence"] == pytest.approx(-7.0, abs=0.15) and m["stop.log_evidence"] == pytest.approx(-8.63, abs=0.05)
    assert [m[f"stop.best.{name}"] for name in ("f125", "v25", "v30", "v44")] == pytest.approx([27.2, 26.2, 28.6, 34.0], abs=0.1)
    assert m["emulator.worst"] < 0.02 and m["peak.information"] >= -1e-6
    for name in ("v25", "best.v25", "probability"):
        assert np.isfinite(m[f"gravity.{name}"])
    assert identify.figure(result).axes


@pytest.mark.parametrize("name", ["slider-crank", "slider-crank-ramp", "slider-crank-voltage", "thickness-speed", "design"])
def test_every_study_states_gravity_and_motor(name):
    study = registry.load(name)
    p = study.Parameters()
    assert (p.gravity, p.motor, p.imperfection) == (0.0, 0.0, 1e-4) and p.pull == (0.0, 0.0)
    assert "gravity none in the plane" in p.stated() and "speed prescribed" in p.stated()
    assert study.Parameters(gravity=9.81, motor=2.0).pull == pytest.approx((0.0, -9.81), abs=1e-12)


def test_a_motor_turns_the_crank_at_the_speed_it_is_given_without_load():
    """Ramp: the voltage follows it; a strut's crank lags by its own inertia, (J + J_rotor) w'/slope, and little else."""
    from buckler import mbs
    from buckler.studies.striking import impact_models
    from buckler.studies.striking.impact import ImpactParameters

    p = ImpactParameters(motor=2.0, mass=0.02, friction=0.0)
    made = impact_models.mechanism(mbs.Strut, p, 7.2e4, mbs.Ramp(1.0, 2.0, 0.5))
    assert not made.drives and made.velocities["crank"] == 1.0
    result = mbs.simulate(made, 0.5)
    angle = impact_models.crank_angle(result.signals)
    late = result.time > 0.4
    lag = (1.0 + 2.0 * result.time - np.gradient(angle, result.time))[late].mean()
    inertia = 0.02 + 7850 * 0.03 * 0.005 * 0.14**3 / 3
    assert lag == pytest.approx(inertia * 2.0 / 2.0, rel=0.15)
