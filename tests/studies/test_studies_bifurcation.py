"""The largest Lyapunov exponent: of systems that have a known one, and of the crank-rocker by other ways; the study of it."""

import numpy as np
import pytest

pytest.importorskip("numba")

from drawing import inked

from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.spectral.chaos import stretching
from buckler.mbs.spectral.scene import Scene
from buckler.studies.rattling import bifurcation
from buckler.studies.rattling.bars import PlayParameters
from buckler.studies.rattling.bifurcation_points import (
    Growth,
    SectionParameters,
    agreement,
    exponent,
    fastest,
    member,
    read,
    repeats,
    separation,
    settled,
    turn_growth,
)

TURN = 0.2
"""Of the crank, s."""


def scene(**given):
    return Scene.of(PlayParameters(**given).bars())


def damped():
    """A crank-rocker that repeats itself each turn."""
    return scene(damping=17e3)


COARSE = {"count": 2, "seeds": 1, "settle": 3, "turns": 6, "exponent_turns": 1, "workers": 1}


# --- systems that have a known exponent -------------------------------------------------------------------------------


def test_logistic_map_has_ln_2():
    growth = stretching(lambda x, _: 4 * x * (1 - x), np.array([0.3]), 20_000, offset=1e-9)
    assert growth[10:].mean() == pytest.approx(np.log(2), rel=1e-3)


def test_linear_map_has_its_largest_eigenvalue_whatever_the_scale():
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])
    matrix = turn @ np.diag([1.5, 0.7, -0.2]) @ turn.T
    for scale in (1.0, np.array([1e-3, 1.0, 50.0])):
        growth = stretching(lambda x, _: matrix @ x, np.zeros(3), 200, offset=1e-6, scale=scale, seed=1)
        np.testing.assert_allclose(growth[50:], np.log(1.5), rtol=1e-9)


def test_damped_oscillator_has_minus_its_decay_and_sees_the_number_of_the_step():
    """Of x'' + 2 z x' + x = cos(k): a force alike for both motions changes nothing."""
    z, h = 0.05, 2 * np.pi / np.sqrt(1 - 0.05**2) / 8
    grid = np.linspace(0, h, 401)
    w = np.sqrt(1 - z**2)
    free = np.exp(-z * h) * np.array([
        [np.cos(w * h) + z / w * np.sin(w * h), np.sin(w * h) / w],
        [-np.sin(w * h) / w, np.cos(w * h) - z / w * np.sin(w * h)],
    ])  # fmt: skip
    seen = []

    def flow(x, k):
        seen.append(k)
        return free @ x + grid[1] * np.cos(k)

    growth = stretching(flow, np.array([1.0, 0.0]), 800, offset=1e-7)
    assert growth.sum() / (800 * h) == pytest.approx(-z, rel=2e-2) and growth.std() > 0.01
    assert seen == [k for k in range(800) for _ in range(2)]


def test_error_is_that_of_independent_turns():
    growth = np.random.default_rng(0).normal(0.3, 1.0, (5, 400, 50))
    found = exponent(growth, 0.2)
    assert found.error == pytest.approx(np.sqrt(50) / 0.2 / np.sqrt(2000), rel=0.05)
    assert found.value == pytest.approx(0.3 * 50 / 0.2, abs=4 * found.error)
    assert np.isnan(exponent(growth[0, :1], 0.2).error)


def test_offset_that_is_lost_is_an_error():
    with pytest.raises(ArithmeticError, match="step 0: the offset of 1e-09 became 0"):
        stretching(lambda x, _: 0 * x, np.ones(2), 3, offset=1e-9)
    with pytest.raises(ArithmeticError, match="became nan"):
        stretching(lambda x, _: x * np.nan, np.ones(2), 3, offset=1e-9)


# --- the crank-rocker by other ways -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_growth_added_up_is_that_of_an_offset_left_alone():
    """Of joints that stay closed over a whole turn and four decades down; of rattling ones over five decades up."""
    here = damped()
    state = settled(here, 6, 0)
    alone, growth = separation(here, state, 1e-7, 3, steps=40), turn_growth(here, state, 1, 3, steps=40)
    assert alone[0] == pytest.approx(1e-7) and alone[-1] < 5e-9
    np.testing.assert_allclose(np.log(alone[1:] / alone[0]), np.cumsum(growth[0]), atol=0.1)
    here = scene()
    state = settled(here, 3, 0)
    alone, growth = (f(here, state, n, 0, steps=100) for f, n in ((separation, 1e-12), (turn_growth, 1)))
    small = alone[1:] < 1e-7
    assert alone[1:][small].max() > 1e-8 and small.sum() > 10
    np.testing.assert_allclose(np.log(alone[1:][small] / 1e-12), np.cumsum(growth[0])[small], atol=1.0)


@pytest.mark.slow
def test_repeating_motion_comes_together_as_its_section_does():
    """Differences of successive sections shrink by exp(lambda T) a turn: no second trajectory, no renormalisation."""
    here = damped()
    p = bifurcation.Parameters(damping=17e3, settle=0, turns=5, exponent_turns=1, tolerance=1e-11)
    section = member(p, here.mechanism, 0)[0]
    rate = np.diff(np.log(np.linalg.norm(np.diff(section, axis=0), axis=1)[:3])).mean() / TURN
    found = exponent(turn_growth(here, settled(here, 4, 0), 4, 0, steps=50)[2:], TURN)
    assert found.value == pytest.approx(rate, rel=0.05) and found.value < -15


@pytest.mark.slow
def test_rattling_joints_are_chaotic_in_one_part_of_the_turn():
    """An offset of 1e-12 m is seen to grow to 1e-4 m within some 40 ms: the rate of that part, not the mean of a turn."""
    here = scene()
    growth = np.stack([turn_growth(here, settled(here, 3, seed), 4, seed, steps=50)[1:] for seed in range(2)])
    found = exponent(growth, TURN)
    assert found.error < 20 and found.value == pytest.approx(163, abs=5 * found.error)
    part = growth.mean(axis=(0, 1)) * 50 / TURN
    assert part[:13].mean() > 250 and abs(part[20:38].mean()) < 60
    assert fastest(growth * 50 / TURN, TURN) == pytest.approx(np.log(1e8) / 0.04, rel=0.4)


def test_laws_that_remember_may_and_cranks_that_stand_may_not():
    here = Scene.of(PlayParameters().bars(law=CarvalhoMartins(8e9, 0.8)))
    growth = turn_growth(here, settled(here, 0, 0), 1, 0, steps=200)
    assert np.isfinite(growth).all() and growth.min() < -0.1 < 0.1 < growth.max()
    with pytest.raises(ValueError, match=r"speed = 0.0 rad/s"):
        here = Scene.of(PlayParameters().bars(speed=0.0))
        turn_growth(here, settled(here, 0, 0), 1, 0)


# --- the study --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def both():
    return bifurcation.run(bifurcation.Parameters(**COARSE, dampings="253N.s/m,17kN.s/m"))


def test_one_end_is_chaos_and_the_other_repeats(both):
    assert both.status == "OK", both.message
    s = both.signals
    assert s["exponent"][0] > 80 and s["exponent"][1] < -15
    assert s["period"].tolist() == [0, 1] and s["spread"][0] > 100 * s["spread"][1]
    assert both.metrics["repeating"].value == 1
    assert both.metrics["fastest_growth"].value > 2 * both.metrics["exponent"].value > 100
    assert both.metrics["alone_against_drawn_back"].value < 5
    assert s["section"].shape == (2, 1, 6, 2) and np.linalg.norm(s["section"], axis=-1).max() < 1.3
    assert "253" in str(both) and "std. error" in str(both)


def test_figures(both):
    figures = inked(bifurcation, both)
    assert list(figures) == ["bifurcation", "growth"]
    above, below = figures["bifurcation"].axes
    assert above.get_xlim() == below.get_xlim() and "N s/m" in below.get_xlabel() and "pin B" in above.get_ylabel()


@pytest.mark.parametrize(("over", "unit"), [("speed", "rad/s"), ("clearance", "mm")])
def test_speed_and_clearance_may_be_varied(over, unit):
    p = bifurcation.Parameters(**COARSE, over=over, speeds="20,40", clearances="0.1mm,0.5mm", damping=20, damping_unit="N.s/mm")
    low, high = (p.at(float(value)) for value in p.values)
    speeds, joints = [made.drives[0].speed for made in (low, high)], [made.joints[0] for made in (low, high)]
    assert speeds == ([20, 40] if over == "speed" else [p.speed, p.speed])
    assert [joint.gap for joint in joints] == pytest.approx([1e-4, 5e-4] if over == "clearance" else [2.5e-4, 2.5e-4])
    assert joints[0].law.damping == joints[1].law.damping == 20e3 and unit in bifurcation.diagram.AXES[over][0]


@pytest.mark.slow
def test_pin_deeper_in_than_it_has_play_is_suspect():
    result = bifurcation.run(bifurcation.Parameters(**COARSE | {"turns": 2}, over="clearance", clearances="2um,1mm"))
    assert result.status == "SUSPECT" and result.message.startswith("clearance = 2e-06: PENETRATION: pin")
    assert result.signals["valid"].tolist() == [False, True] and "PENETRATION" in str(result)


def test_section_and_exponent_that_contradict_each_other_are_named():
    p, bar = SectionParameters(), PlayParameters().bars()
    still = np.tile([0.5, 0.5], (20, 1))
    wild = np.random.default_rng(0).normal(size=(20, 2))
    noise = np.random.default_rng(1).normal(size=(4, 100))
    for section, mean, name in (
        (still, 0.3, "CONTRADICTION"), (wild, -0.3, "NOT_SETTLED"), (still, -0.3, ""), (wild, 0.3, ""), (wild, 12.0, "OFFSET"),
    ):  # fmt: skip
        found = read(p, bar, [(section, 0.1 * noise + mean, "")])
        assert [note.partition(":")[0] for note in found.notes] == ([name] if name else [])
        assert found.exponent.value == pytest.approx(100 * mean / TURN, rel=0.1)
    assert read(p, bar, [(still, noise, "PENETRATION: deep"), (wild, noise, "")]).period == 0


def test_repeats_finds_the_shortest_period():
    turn = np.arange(24)[:, None] * np.ones(2)
    assert repeats(0 * turn) == 1 and repeats(turn % 3) == 3 and repeats(turn % 9) == 0
    assert repeats(np.where(turn < 12, turn, 0.0)) == 1
    assert repeats(1e-3 * (turn % 2)) == 2 and repeats(1e-6 * (turn % 2)) == 1


def test_fastest_window_wraps_around_the_turn():
    rate = np.zeros((1, 2, 100))
    rate[..., :10], rate[..., 90:] = 300.0, 500.0
    assert fastest(rate, 0.2) == pytest.approx(400)
    assert fastest(rate, 0.02) == pytest.approx(80)


def test_agreement_looks_only_where_both_are_small():
    size = np.geomspace(1e-12, 1e-3, 10)[None]
    assert agreement(Growth(size, size, np.where(size < 1e-6, 2 * size, 1.0)), 1e-3) == pytest.approx(2)
