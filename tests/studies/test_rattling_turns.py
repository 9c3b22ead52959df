"""Statistics over turns: right numbers, right errors, the same for the same seeds."""

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs import Status
from buckler.studies.rattling.bars import PlayParameters, RockerParameters
from buckler.studies.rattling.turns import Ensemble, ensemble, period

BARS = PlayParameters().bars()
CLOSED = PlayParameters(damping_unit="N.s/mm").bars()
NAMES = {"impacts", "force", "depth", "peak_a", "rms_a", "lost"}


@pytest.fixture(scope="module")
def rattling():
    return ensemble(BARS, 3, range(6))


def test_measures_have_their_shapes_and_the_energy_balances(rattling):
    assert rattling.ok and set(rattling.turns) == NAMES and max(rattling.balances) < 1e-4  # chaotic: 1e-5 to 4e-5 by the machine
    assert 20 < rattling.mean("impacts").min() and rattling.mean("impacts").max() < 150
    assert rattling.turns["force"].shape == (6, 3, 4) and rattling.mean("force").shape == (4,)
    assert rattling.turns["lost"].shape == (6, 3) and 0.9 < rattling.mean("lost") < 1.2


def test_every_turn_is_measured_by_itself():
    """Two turns after one that settles are the second and third of three without."""
    late, every = (ensemble(BARS, n, [3], settle=3 - n).turns for n in (2, 3))
    for name in NAMES:
        np.testing.assert_allclose(late[name], every[name][:, 1:], rtol=1e-12)
        assert name in ("impacts", "lost") or (np.abs(np.diff(every[name], axis=1)) > 0.01 * every[name][:, 1:]).any()


def test_seeds_decide_and_threads_do_not(rattling):
    again = ensemble(BARS, 3, range(6), workers=2)
    for name in NAMES:
        np.testing.assert_array_equal(again.turns[name], rattling.turns[name])
    assert not np.array_equal(rattling.turns["force"][0], rattling.turns["force"][1])


@pytest.mark.slow
def test_other_members_and_other_tolerances_agree_within_their_errors(rattling):
    others = [ensemble(BARS, 3, range(100, 106)), ensemble(BARS, 3, range(200, 206), tolerance=1e-9)]
    for other in others:
        for name in ("impacts", "rms_a", "lost"):
            apart = abs(other.mean(name) - rattling.mean(name))
            assert (apart < 5 * np.hypot(other.error(name), rattling.error(name))).all(), name
    assert (rattling.error("rms_a") < 0.1 * rattling.mean("rms_a")).all()


def test_closed_joints_repeat_themselves():
    found = ensemble(CLOSED, 1, range(2))
    assert (found.mean("impacts") < 5).all() and (found.error("rms_a") < 1e-3 * found.mean("rms_a")).all()
    assert (found.mean("force") > 5000).all()  # the closing of the gap at each reversal


def test_loose_steps_are_looked_at_in_between():
    """Their ends alone miss peaks of closed joints by 4 %, and the energy by 2e-3."""
    assert ensemble(CLOSED, 1, [0], settle=0, tolerance=1e-6).balances[0] < 3e-4


def test_a_pin_deeper_than_its_clearance_is_suspect_and_modes_start_at_rest():
    assert ensemble(PlayParameters(clearance=5e-6).bars(), 1, [0], settle=0).outcomes == (Status.SUSPECT,)
    large = ensemble(RockerParameters(rocker="modal", damping_unit="N.s/mm").bars(), 1, [0], settle=0, spread=2.5e-5)
    assert large.ok and large.balances[0] < 3e-5 and large.mean("lost") < 2.0


def test_mean_and_error_are_those_of_independent_members():
    values = np.array([[1.0, 3.0], [4.0, 4.0], [7.0, 9.0]])
    made = Ensemble(1e-4, {"force": values}, (Status.OK,) * 3)
    assert made.mean("force") == pytest.approx(28 / 6)
    assert made.error("force") == pytest.approx(np.std([2.0, 4.0, 8.0], ddof=1) / np.sqrt(3))
    alone = Ensemble(1e-4, {"force": values[2:]}, (Status.OK,), (1e-9,))
    assert alone.error("force") == pytest.approx(np.std([7.0, 9.0], ddof=1) / np.sqrt(2))
    joined = Ensemble.join([Ensemble(1e-4, {"force": values[k : k + 1]}, (Status.OK,), (k,)) for k in range(3)])
    assert joined.error("force") == made.error("force") and joined.balances == (0, 1, 2)


@pytest.mark.parametrize(
    ("wrong", "words"), [({"turns": 0}, "turns = 0"), ({"workers": 0}, "workers = 0"), ({"spread": 0.0}, "spread = 0.0 m")]
)
def test_bad_input_is_named(wrong, words):
    with pytest.raises(ValueError, match=words):
        ensemble(**{"mechanism": BARS, "turns": 1, "seeds": [1]} | wrong)
    with pytest.raises(ValueError, match="seeds"):
        ensemble(BARS, 1, [])


def test_a_crank_that_stands_or_has_no_one_speed_has_no_turns():
    with pytest.raises(ValueError, match=r"speed = 0.0 rad/s: turns need a crank that turns"):
        period(PlayParameters().bars(speed=0.0))
