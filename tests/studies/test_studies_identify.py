"""Causes of the measured forces: the likelihood by hand, evidence in closed form, information, real strikes."""

import numpy as np
import pytest
from scipy.stats import norm

from buckler.studies.kit import registry
from buckler.studies.striking import identify, slider_crank, strike
from buckler.studies.striking.evidence import (
    READINGS,
    Hypothesis,
    crank_speed,
    hypotheses,
    information,
    log_likelihood,
    posterior,
    predicted,
    probabilities,
)


class Made:
    """A strike whose force is known: F = sqrt(k/k0) (v/v0)^n 27 N, n = 1/2 if nothing but the stop is its cause, else 1."""

    def __call__(self, table, what, **point):
        n = 0.5 if table == "rigid" else 1.0
        return 27.0 * np.sqrt(point["stop_stiffness"] / 2e4) * (point["speed"] / 1.25) ** n


NUMBERS = {"points": 1024, "samples": 300, "sd": 1.0, "model_error": 0.0, "reference": 2.7, "seed": 0}


# --- readings ---------------------------------------------------------------------------------------------------------


def test_readings_are_the_published_ones_and_the_last_is_a_bound():
    assert [(r.force, r.voltage, r.bound) for r in READINGS] == [
        (27.0, None, False), (25.0, 2.5, False), (30.0, 3.0, False), (44.18, 4.4, True),
    ]  # fmt: skip


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


def test_speed_over_voltage():
    assert crank_speed(None, 0.7, 2.7) == 1.25 and crank_speed(2.7, 1.3, 2.7) == pytest.approx(1.25)
    assert crank_speed(4.4, 0.0, 2.7) == pytest.approx(1.25 * 4.4 / 2.7)
    slope = crank_speed(3.7, 1.43, 2.7) - crank_speed(2.7, 1.43, 2.7)
    assert slope == pytest.approx(1.25 / 1.27)


def test_hypotheses_are_causes_and_their_pairs():
    names = [h.name for h in hypotheses()]
    assert names[:6] == ["stop", "bow", "gravity", "motor", "dead_band", "compliance"] and len(names) == 6 + 9
    assert "motor_compliance" not in names and "gravity_motor" in names


# --- evidence ---------------------------------------------------------------------------------------------------------


def test_evidence_is_the_integral_over_the_prior():
    """One unknown: by a fine sum over the stiffness."""
    found = posterior(Made(), Hypothesis(()), **NUMBERS)
    k = np.geomspace(1e3, 2e5, 200_001)
    volts = (None, 2.5, 3.0, 4.4)
    forces = [predicted(Made(), {"stop_stiffness": k}, v, 2.7) for v in volts]
    exact = np.log(np.exp(log_likelihood(forces, 1.0, 0.0)).mean())
    assert found.log_evidence == pytest.approx(exact, abs=0.02) and found.error < 0.05
    assert found.best["stop_stiffness"] == pytest.approx(k[np.argmax(log_likelihood(forces, 1.0, 0.0))], rel=0.02)


def test_force_in_proportion_to_speed_wins_and_what_changes_nothing_pays_its_prior_only():
    stop, gravity, motor = (posterior(Made(), Hypothesis(causes), **NUMBERS) for causes in ((), ("gravity",), ("motor",)))
    assert gravity.log_evidence > stop.log_evidence + 1
    assert motor.log_evidence == pytest.approx(gravity.log_evidence, abs=0.1)  # the same forces, whatever the motor
    np.testing.assert_allclose(gravity.forces.mean(axis=1), [27.1, 25.1, 30.1, 44.1], atol=0.6)
    assert probabilities([stop, gravity, motor]).sum() == pytest.approx(1)


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


def test_the_study_on_few_strikes(tmp_path):
    p = identify.Parameters(
        causes=("gravity",), pairs="no", stiffnesses=4, speeds=4, held_out=1, rounds=1, refined=2, points=64, samples=20,
        workers=0,
        strikes_store=str(tmp_path / "new" / "strikes.sqlite"),
    )  # fmt: skip
    result = identify.run(p)
    assert result.status == "OK", result.message
    assert result.metrics["gravity.log_evidence"].value > result.metrics["stop.log_evidence"].value
    for name in ("v25", "v30", "v44", "best.v25", "probability"):
        assert np.isfinite(result.metrics[f"gravity.{name}"].value)
    assert result.metrics["peak.information"].value >= -1e-6
    assert (tmp_path / "new" / "strikes.sqlite").exists() and identify.figure(result).axes


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
    made = impact_models.mechanism("strut", p, 7.2e4, mbs.Ramp(1.0, 2.0, 0.5))
    assert not made.drives and made.velocities["crank"] == 1.0
    result = mbs.simulate(made, 0.5)
    angle = impact_models.crank_angle(result)
    late = result.time > 0.4
    lag = (1.0 + 2.0 * result.time - np.gradient(angle, result.time))[late].mean()
    inertia = 0.02 + 7850 * 0.03 * 0.005 * 0.14**3 / 3
    assert lag == pytest.approx(inertia * 2.0 / 2.0, rel=0.15)
