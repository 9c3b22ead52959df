"""The crank-rocker over clearance and speed: ideal forces by inverse dynamics, made-up power laws, engine and reference."""

from math import isnan

import numpy as np
import pytest
from fourbar import FourBar
from ideal_linkage import inverse_dynamics

pytest.importorskip("numba")

from drawing import inked

from buckler.mbs import Controlled, Exudyn, simulate
from buckler.mbs.ensembles.readings import read_windows
from buckler.studies.kit.statistics import Mean, power_law
from buckler.studies.rattling import clearance_speed
from buckler.studies.rattling.clearance_speed import IMPACTS, MEASURES, READINGS, compute_sections, ideal
from buckler.studies.rattling.turns import Turns, period, run_turns

SMALL = {"clearances": "5um,0.2mm,0.5mm", "speeds": "20,40", "members": 2, "cycles": 1, "settle": 0}


def parameters(**changes):
    return clearance_speed.Parameters(**SMALL | changes)


def measure(p, mechanism):
    return run_turns(p, [mechanism], (*READINGS, IMPACTS))[0]


def numbers(turns):
    """Means of the measures and their errors, as arrays."""
    return np.array([turns.means[reading][:2] for reading in READINGS]).T


@pytest.fixture(scope="module")
def small():
    return clearance_speed.run(parameters())


@pytest.mark.parametrize("speed", [10.0, 75.0])
def test_ideal_joints_are_those_of_inverse_dynamics(speed):
    p = parameters()
    force, *moved = inverse_dynamics(FourBar(), speed)
    assert ideal(p, speed) == pytest.approx([force.max(), *(np.sqrt(np.mean(a**2)) for a in moved)], rel=3e-4)


def test_engine_and_reference_agree_where_nothing_is_left_to_chance():
    """Heavily damped, the joints hardly open and the motion is no chaos: the same turn on both.

    The engine's peaks are those at its steps, 1.4 % below the tops that the compiled solver looks for within steps.
    """
    p = parameters(damping_unit="N.s/mm", clearance="0.1mm", settle=1)
    turn = measure(p, p.bars())
    mean, error = numbers(turn)
    assert turn.notes == () and turn.means[IMPACTS].value < 3 and (error < 0.02 * mean).all()
    made, end = p.bars(), 3 * period(p.bars())
    found = simulate(made, end, solver=Exudyn(Controlled(5e-5, max_step=end / 2160)))
    engine = read_windows(READINGS, found.time, found.signals, np.array([end / 3, 2 * end / 3, end])).mean(axis=0)
    assert engine == pytest.approx(mean, rel=0.02) and engine[1:] == pytest.approx(mean[1:], rel=8e-3)  # 3.9 to 4.1e-3


def test_sections_of_a_motion_that_repeats_are_one_point_near_that_of_ideal_joints():
    """Heavily damped at 0.1 mm each turn is the one before; at 0.12 mm, by explicit steps at 1e-7 too, it takes two turns."""
    p = parameters(damping_unit="N.s/mm", sections=2, settle=2)
    ideal_joints = p.bars(gap=0.0, rocker=None)
    free = simulate(ideal_joints, period(ideal_joints))["B.vx"][-1]
    found = compute_sections(p, np.array([1e-4, 1.2e-4]))
    assert found.shape == (2, 2) and np.ptp(found[0]) < 1e-3 * abs(free)
    assert found == pytest.approx(free, rel=0.06)  # B moves in its bush


def test_rattling_joints_carry_more_and_dig_in_as_deep_as_the_law_says(small):
    """K d^1.5 is no more than the largest force in any joint; B's mean peak is well within ten times that of ideal joints."""
    s, p = small.signals, small.parameters
    assert small.status == "OK", small.message
    for i, k in np.ndindex(s["depth"].shape):
        depth = s["depth"][i, k] * s["clearance"][i]
        held = p.stiffness * depth**1.5
        assert 0.3 * held < s["mean"][i, k, 0] < 2 * held
    assert (s["mean"][..., 0] > s["ideal"][:, 0]).all()
    assert (np.diff(s["mean"][..., 0], axis=0) > 0).all() and (np.diff(s["mean"][..., 0], axis=1) > 0).all()


def test_a_pin_deeper_than_its_play_carries_a_name_and_enters_no_fit(small):
    s = small.signals
    np.testing.assert_array_equal(s["valid"], s["depth"] <= 1)
    assert small.metrics["invalid"].value == (s["depth"] > 1).sum() == 2
    rows = {(row[0], row[1]): row for row in small.tables[0].rows}
    assert rows["0.005", "40"][-1] == "PENETRATION" and rows["0.5", "40"][-1] == ""
    assert small.metrics["valid"].value == 4 and "peak_force.power_of_speed" not in small.metrics  # too few for a fit


def test_points_do_not_depend_on_the_threads_but_on_the_seed(small):
    alone = clearance_speed.run(parameters(workers=1)).signals
    np.testing.assert_array_equal(alone["mean"], small.signals["mean"])
    other = measure(parameters(seed=5), parameters().bars(gap=5e-4, speed=40.0))
    assert other.means[READINGS[0]].value != small.signals["mean"][2, 1, 0]


def test_powers_of_a_made_up_law_and_their_errors():
    """Scatter s about ln y = a + b x: b's error is s over the square root of the sum of squares of x."""
    rng = np.random.default_rng(0)
    at = np.array([(c, w) for c in np.geomspace(1e-5, 1e-3, 20) for w in np.geomspace(10, 100, 20)])
    values = 3e4 * at[:, 0] ** 0.75 * at[:, 1] ** 1.5 * np.exp(0.1 * rng.standard_normal(len(at)))
    powers, scatter = power_law(at.T, values)
    for metric, power, spread in zip(powers, (0.75, 1.5), np.log(at).std(axis=0), strict=True):
        error = metric.error * metric.value
        assert error == pytest.approx(0.1 / np.sqrt(len(at)) / spread, rel=0.1)
        assert metric.value == pytest.approx(power, abs=4 * error)
    assert scatter.value == pytest.approx(0.1, rel=0.1)


def made_up(p, monkeypatch, points=None):
    """The study with points of a power law instead of ensembles."""

    def point(gap, speed):
        means = [Mean(1e6 * gap * speed, 10.0, 4), Mean(10.0, 0.1, 4), Mean(20.0, 0.2, 4), Mean(30.0, 1.0, 4)]
        return Turns(dict(zip((*READINGS, IMPACTS), means, strict=True)), 0.5, ())

    def made(_, mechanisms, _readings, batch):
        where = [(made.joints[0].gap, made.drives[0].speed) for made in mechanisms]
        return [(points(gap) if points else None) or point(gap, speed) for gap, speed in where]

    monkeypatch.setattr(clearance_speed, "run_turns", made)
    return clearance_speed.run(p)


def test_a_point_that_fails_is_suspect_and_drawn(monkeypatch):
    nothing = dict.fromkeys((*READINGS, IMPACTS), Mean(np.nan, np.nan, 4))
    lost = Turns(nothing, np.nan, ("FAILED: seed 0: no more",))
    result = made_up(parameters(), monkeypatch, lambda gap: lost if gap == 5e-4 else None)
    assert result.status == "SUSPECT"
    assert result.message == "FAILED: 0.5 mm, 20 rad/s; FAILED: 0.5 mm, 40 rad/s"
    assert isnan(result.signals["mean"][2, 0, 0]) and not result.signals["valid"][2].any()
    draw(result)


def draw(result):
    figures = inked(clearance_speed, result)
    assert all(ax.get_ylabel() for ax in figures["lines"].axes)
    return figures


def test_figures(small):
    figures = draw(small)
    assert all(name in str(small) for name in ("peak force B [N]", "depth/c", "PENETRATION")) and len(MEASURES) == 3
    assert len(figures["lines"].axes) == 4 and "bifurcation" not in figures


def ensemble(**given):
    p = clearance_speed.Parameters(**given)
    return measure(p, p.bars())


def test_pin_at_the_frame_decides_how_often_the_rocker_strikes():
    """At 0.1 mm, the pin at B on the rocker: with the pin at O on the crank impacts in B fall from some 107 to 63 a turn."""
    few = {"clearance": 1e-4, "members": 3, "cycles": 2}
    on_ground, on_crank = (ensemble(pin_on=pins, **few).means[IMPACTS].value for pins in ("B.rocker", "O.crank,B.rocker"))
    assert 0.4 < on_crank / on_ground < 0.75


@pytest.mark.slow
def test_thresholds_take_a_fifth_of_the_force_where_the_rocker_carries_the_pin():
    """ADAMS's 0.1 and 1 m/s against 0.01 and 0.1 m/s, at 0.25 mm: 21 % less, within two standard errors."""
    given = {"pin_on": "B.rocker", "members": 10, "cycles": 6, "settle": 2}
    force = READINGS[0]
    slow, fast = (ensemble(friction_thresholds=factor, **given).means[force] for factor in (0.1, 1.0))
    ratio = slow.value / fast.value
    error = ratio * np.hypot(slow.error / slow.value, fast.error / fast.value)
    assert error < 0.03 and abs(ratio - 0.79) < 2 * error
    on_coupler = [ensemble(friction_thresholds=factor, **given | {"pin_on": "B.coupler"}) for factor in (0.1, 1.0)]
    assert 0.79 < on_coupler[0].means[force].value / on_coupler[1].means[force].value < 0.88  # the pin on the coupler: less
