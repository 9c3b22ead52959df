"""Sobol' indices against functions that have known ones; forces and their elasticities against closed forms."""

from math import comb, pi

import numpy as np
import pytest
from scipy import stats

pytest.importorskip("numba")

from drawing import inked

from buckler import mbs
from buckler.elastica import pinned
from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.studies.kit.statistics import power_law
from buckler.studies.rattling.bars import PlayParameters
from buckler.studies.rattling.turns import ensemble
from buckler.studies.striking import uncertainty
from buckler.studies.striking.assumptions import StrikeAssumptions
from buckler.studies.striking.impact_models import strike
from buckler.studies.striking.slider_crank import Parameters as SliderCrankParameters
from buckler.studies.striking.uncertainty_models import (
    CUT,
    SEED,
    Input,
    Rattler,
    Striker,
    levels,
    linear_shares,
    slopes,
    sobol,
    thickness_share,
)  # fmt: skip

SMALL = {"samples": 256, "runs": 8, "cycles": 1, "repeats": 8, "workers": 1}
STRIKER = Striker(3.775e-3, "strut")


class Uniform(Input):
    """An input with a uniform distribution from mean - sd to mean + sd."""

    distribution = property(lambda self: stats.uniform(self.mean - self.sd, 2 * self.sd))


def moment(k):
    """E[z^k] of a standard normal z cut off at three: by parts, m_k = (k - 1) m_(k-2) - 2 c^(k-1) phi(c)/P, k even."""
    if k % 2:
        return 0.0
    within = 2 * stats.norm.cdf(CUT) - 1
    return 1.0 if k == 0 else (k - 1) * moment(k - 2) - 2 * CUT ** (k - 1) * stats.norm.pdf(CUT) / within


def power(given, n):
    """E[x^n] of an input."""
    return sum(comb(n, k) * given.mean ** (n - k) * given.sd**k * moment(k) for k in range(n + 1))


# --- indices ----------------------------------------------------------------------------------------------------------


def test_indices_of_the_ishigami_function():
    """Closed form: T. Ishigami, T. Homma (1990), doi 10.1109/ISUMA.1990.151285."""
    a, b = 7.0, 0.1
    found = sobol(
        lambda x: (np.sin(x[0]) + a * np.sin(x[1]) ** 2 + b * x[2] ** 4 * np.sin(x[0]))[None],
        [Uniform("x", "1", 0.0, pi)] * 3, 4096, 0,
    )  # fmt: skip
    one, two, three = 0.5 * (1 + b * pi**4 / 5) ** 2, a**2 / 8, b**2 * pi**8 * (1 / 18 - 1 / 50)
    np.testing.assert_allclose(found.first[0], np.array([one, two, 0]) / (one + two + three), atol=0.02)
    np.testing.assert_allclose(found.total[0], np.array([one + three, two, three]) / (one + two + three), atol=0.02)
    assert (found.first_range[0, :, 0] < found.first[0]).all() and (found.first[0] < found.first_range[0, :, 1]).all()
    assert found.sample.shape == (1, 8192) and found.inputs.shape == (3, 8192)
    assert found.sample.var() == pytest.approx(one + two + three, rel=0.02)


def test_chance_has_its_share_as_total_and_nothing_alone():
    """Y = x1 + 2 x2 + 3 chance: a number that any change of anything draws afresh."""

    def model(x):
        noise = [np.random.default_rng(np.abs(column).view(np.uint64)).standard_normal() for column in x.T.copy()]
        return np.array([x[0] + 2 * x[1] + 3 * np.array(noise)])

    variance = moment(2)
    found = sobol(model, [Input("x1", "1", 5.0, 1.0), Input("x2", "1", 5.0, 1.0), SEED], 2048, 0)
    whole = 5 * variance + 9
    np.testing.assert_allclose(found.first[0], [variance / whole, 4 * variance / whole, 0], atol=0.06)
    np.testing.assert_allclose(found.total[0], [(variance + 9) / whole, (4 * variance + 9) / whole, 9 / whole], atol=0.06)


def test_input_that_does_nothing_has_an_interval_of_nothing():
    found = sobol(lambda x: x[:1], [Input("x", "1", 1.0, 0.1), Input("idle", "1", 1.0, 0.1)], 64, 0)
    assert found.first[0, 1] == found.total[0, 1] == np.ptp(found.first_range[0, 1]) == np.ptp(found.total_range[0, 1]) == 0


def test_linear_shares_and_slopes_of_a_power_law():
    inputs = [Input("x", "1", 2.0, 0.02), Input("y", "1", 5.0, 0.1)]
    slope = slopes(lambda x: np.stack([x[0] ** 3 / x[1], x[1] ** 0.5]), inputs)
    np.testing.assert_allclose(slope, [[3, -1], [0, 0.5]], atol=1e-6)
    np.testing.assert_allclose(linear_shares(slope, inputs), [[9 / 13, 4 / 13], [0, 1]], atol=1e-6)


def test_fit_finds_powers_and_how_sure_it_is():
    rng = np.random.default_rng(0)
    x = rng.uniform(1, 2, (2, 400))
    noise = rng.normal(0, 0.05, 400)
    found = power_law(x, 7 * x[0] ** 1.5 / x[1] * np.exp(noise))
    assert (np.abs(found.slope - [1.5, -1]) < 4 * found.error).all()
    np.testing.assert_allclose(found.error, 0.05 / np.sqrt(400) / np.log(x).std(axis=1), rtol=0.1)
    signal = np.log(x[0] ** 1.5 / x[1]).var()
    assert found.explained == pytest.approx(signal / (signal + 0.05**2), abs=0.02)


def test_distribution_of_an_input():
    given = Input("x", "m", 2.0, 0.1)
    assert given.distribution.support() == pytest.approx((1.7, 2.3))
    assert given.distribution.moment(6) == pytest.approx(power(given, 6), rel=1e-6)
    drawn = levels(given.distribution.ppf([0.01, 0.124, 0.126, 0.999]), given)
    assert drawn[0] == drawn[1] == pytest.approx(given.distribution.ppf(1 / 16)) and drawn[2] > drawn[1]
    assert drawn[3] == pytest.approx(given.distribution.ppf(15 / 16))


# --- the slider-crank -------------------------------------------------------------------------------------------------


def test_elasticities_are_those_of_the_formulas():
    """D ln F/d ln x of p(u) E b h^3/(12 L^2), u = 1 - (e - r)/L; the pulse goes with m (1 + e_r) alone besides speed."""
    inputs = uncertainty.Parameters().inputs("slider-crank")
    contact, impact = STRIKER.closed_form(np.array([[i.mean] for i in inputs]))[:, 0]
    assert contact == pytest.approx(1.72465, abs=1e-5) and impact == pytest.approx(27.0, rel=1e-3)
    found = dict(zip([i.name for i in inputs], slopes(STRIKER.closed_form, inputs).T, strict=True))
    length, stop, crank = PAPER.coupler, -PAPER_STOP, PAPER.crank
    u = 1 - (stop - crank) / length
    bend = pinned.stiffness(u) / pinned.load(u)
    expected = {"thickness": 3, "modulus": 1, "length": bend * (1 - u) - 2, "stop": -bend * stop / length}
    for name in found:
        assert found[name][0] == pytest.approx(expected.get(name, 0), abs=1e-5), name
    assert found["mass"][1] == pytest.approx(1) and found["restitution"][1] == pytest.approx(0.8 / 1.8)
    assert found["thickness"][1] == found["modulus"][1] == found["friction"][1] == 0
    # speed = w dx/dtheta at the stop: by moving the stop a little on the exact kinematics
    assert found["speed"][1] == pytest.approx(1) and found["bow"][1] == found["stop_stiffness"][1] == 0
    rate = [PAPER.slider_rate(PAPER.contact_angle(-stop * (1 + s))) for s in (-1e-4, 1e-4)]
    assert found["stop"][1] == pytest.approx(np.log(rate[1] / rate[0]) / 2e-4, abs=1e-4)


def test_share_of_the_thickness_is_that_of_its_cube():
    """With nothing else uncertain but the modulus the moments are those of powers, by recursion."""
    inputs = [
        i if i.name in ("thickness", "modulus") else i._replace(sd=1e-9 * i.mean)
        for i in uncertainty.Parameters(thickness_sd=2e-5, modulus_sd=2e10).inputs("slider-crank")
    ]
    thickness, modulus = inputs[0], inputs[1]
    cube = power(thickness, 6) - power(thickness, 3) ** 2
    whole = power(thickness, 6) * power(modulus, 2) - (power(thickness, 3) * power(modulus, 1)) ** 2
    assert thickness_share(inputs) == pytest.approx(cube * power(modulus, 1) ** 2 / whole, rel=1e-6)


def test_small_tolerances_share_and_spread_as_slopes_say(fast):
    p = fast.parameters
    parts = {i.name: i.sd / i.mean for i in p.inputs("slider-crank")}
    expected = (3 * parts["thickness"]) ** 2 / ((3 * parts["thickness"]) ** 2 + parts["modulus"] ** 2)
    first = fast.metrics["slider-crank.contact_force.thickness.first"]
    assert first.exact == pytest.approx(expected, abs=0.01) and first.value == pytest.approx(first.exact, abs=0.03)
    assert fast.metrics["slider-crank.contact_force.modulus.first"].value == pytest.approx(1 - expected, abs=0.03)
    alone = {"mass": parts["mass"] ** 2, "restitution": (parts["restitution"] * 0.8 / 1.8) ** 2, "speed": parts["speed"] ** 2}
    for name, share in alone.items():
        found = fast.metrics[f"slider-crank.impact_force.{name}.total"].value
        assert found == pytest.approx(share / sum(alone.values()), abs=0.03)
    contact = {name: fast.metrics[f"slider-crank.contact_force.{name}"].value for name in ("mean", "sd", "5%", "50%", "95%")}
    sd = np.hypot(3 * 5e-6 / 3e-4, 4e9 / 210e9) * np.sqrt(moment(2))
    assert contact["sd"] / contact["mean"] == pytest.approx(sd, rel=0.03)
    assert contact["50%"] == pytest.approx(1.7246, rel=2e-3)
    assert np.log(contact["95%"] / contact["5%"]) == pytest.approx(2 * 1.645 * sd, rel=0.05)


@pytest.mark.parametrize(("coupler", "given"), [("strut", {}), ("beam", {"gravity": 9.81}), ("beam", {"motor": 1.6})])
def test_simulated_strikes_are_those_of_the_slider_crank_study(coupler, given):
    """Strut and beam at the mean, by the other solver; gravity and motor reach the mechanism."""
    at = {i.name: i.mean for i in uncertainty.Parameters().inputs("slider-crank")} | {"stop_stiffness": 7.2e4, "bow": 1e-4}
    made = Striker(3.775e-3, coupler, StrikeAssumptions(**given)).mechanism(**at)
    found = mbs.simulate(made, 3.0, solver=mbs.Spectral(mbs.Controlled(tolerance=1e-8)))
    known = strike(coupler, SliderCrankParameters(tolerance=1e-6, **given), 7.2e4, 1.25)
    assert found.signals["B.contact_force"].max() == pytest.approx(known.force.max(), rel=5e-3)


def test_bowed_beam_strikes_as_published_and_harder_with_speed_and_stop(fast):
    """Slopes against runs of the other solver 1 % apart: farther apart the force is wavy over the speed, 0.9 not 1.04."""
    assert fast.metrics["slider-crank.simulated.impact_force.mean"].value == pytest.approx(27, abs=1)
    at = {i.name: i.mean for i in fast.parameters.inputs("slider-crank")}
    solver = mbs.Exudyn(mbs.Controlled(tolerance=1e-6))
    for name, low, high in (("speed", 0.7, 1.3), ("stop_stiffness", 0.3, 0.7), ("bow", -0.5, -0.01)):
        up, down = (
            mbs.simulate(Striker(3.775e-3).mechanism(**at | {name: factor * at[name]}), 2.0, solver=solver).signals[
                "B.contact_force"
            ]
            for factor in (1.005, 1 / 1.005)
        )
        between = np.log(up.max() / down.max()) / np.log(1.005**2)
        slope = fast.metrics[f"slider-crank.simulated.impact_force.{name}.slope"]
        assert low < between < high, name
        assert slope.value == pytest.approx(between, abs=0.06 + abs(slope.error * slope.value)), name


# --- the crank-rocker -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fast():
    return uncertainty.run(uncertainty.Parameters(**SMALL))


def test_run_is_that_of_the_ensemble():
    p = uncertainty.Parameters()
    values, wrong = Rattler(p, "damping", 2, 1).run((2.5e-4, 253.0, 0.1, 0.4))
    found = ensemble(PlayParameters().bars(), 2, [int(np.float64(0.4).view(np.uint64))])
    expected = [found.mean("force")[2], *found.mean("rms_a")[:2]]
    assert not wrong and values == pytest.approx(expected, rel=1e-9)


def test_clearance_friction_and_law_reach_the_mechanism():
    p = uncertainty.Parameters()
    joints = Rattler(p, "restitution", 1, 0).mechanism(1e-4, 0.7, 0.05).joints
    assert [joint.gap for joint in joints] == [1e-4] * 4
    law, friction = joints[0].law, joints[0].friction
    assert law.restitution == 0.7 and type(law).__name__ == "ExactRestitution"
    assert (friction.dynamic, friction.static) == pytest.approx((0.05, 0.15))
    assert Rattler(p, "damping", 1, 0).mechanism(1e-4, 300.0, 0.05).joints[0].law.damping == 300.0


def test_crank_rocker_gives_all_its_numbers(fast):
    assert "crank-rocker" not in fast.message, fast.message  # the slider-crank's derivatives are not always certain, and say so
    for name, unit in (("peak_force", "N"), ("rms_ax_coupler", "m/s^2"), ("rms_ax_rocker", "m/s^2")):
        metric = fast.metrics[f"crank-rocker.{name}.mean"]
        assert metric.unit == unit and 100 < metric.value < 5000 and 0 < metric.error < 0.2
        assert np.isfinite(fast.metrics[f"crank-rocker.{name}.chance.total"].value)
        assert 0.05 < fast.metrics[f"crank-rocker.{name}.chance_at_mean"].value < 4
    text = str(fast)
    assert "chance, at the mean" in text and "simulated impact: slope" in text
    assert fast.signals["crank-rocker.peak_force"].shape == (16,)
    assert {name: len(each.axes) for name, each in inked(uncertainty, fast).items()} == {"slider_crank": 4, "crank_rocker": 6}


@pytest.mark.slow
def test_pins_deeper_in_than_they_have_play_are_suspect():
    result = uncertainty.run(uncertainty.Parameters(**SMALL, mechanism="crank-rocker", clearance="3um"))
    assert result.status == "SUSPECT" and "crank-rocker: PENETRATION: in 48 of 48 runs" in result.message


@pytest.mark.slow
def test_peak_force_goes_with_the_clearance_and_chance_is_the_same_by_both_ways():
    """Elastic impact: F goes with v^(6/5), v with c^(1/2) for a given relative acceleration: 0.6; more impacts add to it."""
    result = uncertainty.run(uncertainty.Parameters(mechanism="crank-rocker", runs=128))
    for name in ("peak_force", "rms_ax_coupler", "rms_ax_rocker"):
        slope = result.metrics[f"crank-rocker.{name}.clearance.slope"]
        assert 0.3 < slope.value < 1.5 and slope.error < 0.2
        total, at_mean = (result.metrics[f"crank-rocker.{name}.{x}"] for x in ("chance.total", "chance_at_mean"))
        apart = np.hypot(total.error * total.value / 2, at_mean.error * at_mean.value)
        assert abs(total.value - at_mean.value) < 4 * apart


# --- both -------------------------------------------------------------------------------------------------------------


def test_seed_decides():
    p = {**SMALL, "mechanism": "slider-crank", "coupler": "strut"}
    one, again, other = (uncertainty.run(uncertainty.Parameters(**p, seed=seed)).signals for seed in (0, 0, 1))
    for name, values in one.items():
        assert np.array_equal(values, again[name])
    assert not np.array_equal(one["slider-crank.contact_force"], other["slider-crank.contact_force"])


@pytest.mark.parametrize(("wrong", "message"), [
    ({"samples": 100}, "samples = 100: must be a power of two"),
    ({"runs": 100}, "runs = 100: must be a power of two"),
    ({"thickness": "0.1mm", "thickness_sd": "0.05mm"}, "thickness_sd = 5e-05: three of it must leave thickness positive"),
    ({"restitution": 0.95}, "restitution_sd = 0.02: three of it above 0.95"),
    ({"dynamic_friction": 0.0}, "dynamic_friction = 0: an uncertain coefficient"),
    ({"mechanism": "four-bar"}, r"mechanism\[0\] = 'four-bar': must be one of 'slider-crank'"),
])  # fmt: skip
def test_wrong_input_is_refused_in_one_line(wrong, message):
    with pytest.raises(ValueError, match=message):
        uncertainty.Parameters(**wrong)
