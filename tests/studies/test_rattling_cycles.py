"""Statistics over cycles: right numbers, right errors, the same for the same seeds."""

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs import Status
from buckler.mbs.library import CLOSED
from buckler.studies.rattling.cycles import UNITS, Ensemble, by_cycle, ensemble
from buckler.studies.rattling.linkage import FourBar
from buckler.studies.rattling.turns import simulate

BAR = FourBar()


@pytest.fixture(scope="module")
def rattling():
    return ensemble(BAR, 3, range(6))


def test_cycles_are_what_the_run_shows():
    run = simulate(BAR, 0.6, samples=60_001)
    cycles, time, edges = by_cycle(run, 3, settle=1), run.time, (0.2, 0.4, 0.6)
    for i, (a, b) in enumerate(((20_000, 40_000), (40_000, 60_000))):
        inside = (run.impacts[:, 1] >= edges[i]) & (run.impacts[:, 1] < edges[i + 1])
        np.testing.assert_array_equal(cycles["impacts"][i], np.bincount(run.impacts[inside, 0].astype(int), minlength=4))
        np.testing.assert_allclose(cycles["closed"][i], (run.depth[a:b] > 0).mean(axis=0), atol=0.01)
        assert (cycles["force"][i] >= np.hypot(*run.force[a + 1 : b + 1].T).max(axis=1)).all()
        assert (cycles["peak_a"][i, :2] >= abs(np.stack([run.coupler_a, run.rocker_a], 1)[a + 1 : b + 1, :, 0]).max(axis=0)).all()
        mean_square = np.trapezoid(run.coupler_a[a : b + 1, 0] ** 2, time[a : b + 1]) / 0.2
        assert cycles["rms_a"][i, 0] == pytest.approx(np.sqrt(mean_square), rel=0.01)
        assert cycles["given"][i] == pytest.approx(run.given[b] - run.given[a])
        np.testing.assert_allclose(cycles["friction"][i], run.taken_friction[b] - run.taken_friction[a])
    ended = run.impacts[(run.impacts[:, 0] == 2) & (run.impacts[:, 1] >= 0.2) & (run.impacts[:, 1] < 0.4)]
    rebound = np.sqrt(np.nansum(ended[:, 4] ** 2) / (ended[np.isfinite(ended[:, 4]), 2] ** 2).sum())
    assert cycles["restitution"][0, 2] == pytest.approx(rebound)


def test_figures_of_a_cycle_do_not_depend_on_samples():
    """One sample a turn: the same steps, the same peaks and integrals, of the same turns."""
    coarse, fine = (by_cycle(simulate(BAR, 0.6, samples=n), 3) for n in (4, 3001))
    for name in ("impacts", "closed", "given", "rms_a", "friction"):
        np.testing.assert_allclose(coarse[name], fine[name], rtol=1e-6)
    for name in ("force", "peak_a"):
        assert (coarse[name] <= fine[name]).all() and (coarse[name] > 0.97 * fine[name]).all()
        assert (abs(np.diff(fine[name], axis=0)) > 0.03 * fine[name][1:]).any()  # or a wrong turn would pass, too


def test_energy_of_a_cycle_balances_on_the_mean(rattling):
    """What the drive gives is lost in joints, up to the change of what is held: 1e-2 J of 1 J."""
    assert rattling.ok and set(rattling.cycles) == set(UNITS)
    lost = rattling.mean("contact").sum() + rattling.mean("friction").sum() + rattling.mean("modes")
    assert rattling.mean("given") == pytest.approx(lost, rel=0.03)
    assert 20 < rattling.mean("impacts").min() and rattling.mean("impacts").max() < 150
    assert rattling.cycles["force"].shape == (6, 3, 4) and rattling.mean("force").shape == (4,)


def test_seeds_decide_and_threads_do_not(rattling):
    again = ensemble(BAR, 3, range(6), workers=2)
    for name in UNITS:
        np.testing.assert_array_equal(again.cycles[name], rattling.cycles[name])
    assert not np.array_equal(rattling.cycles["force"][0], rattling.cycles["force"][1])


@pytest.mark.slow
def test_other_members_and_other_tolerances_agree_within_their_errors(rattling):
    others = [ensemble(BAR, 3, range(100, 106)), ensemble(BAR, 3, range(200, 206), tolerance=1e-9)]
    for other in others:
        for name in ("impacts", "rms_a", "friction", "given"):
            apart = abs(other.mean(name) - rattling.mean(name))
            assert (apart < 5 * np.hypot(other.error(name), rattling.error(name))).all(), name
    assert (rattling.error("rms_a") < 0.1 * rattling.mean("rms_a")).all()


def test_closed_joints_repeat_themselves():
    found = ensemble(FourBar(law=CLOSED), 1, range(2))
    assert (found.mean("closed") > 0.97).all() and (found.mean("impacts") < 5).all()
    assert (found.error("rms_a") < 1e-3 * found.mean("rms_a")).all()
    assert (found.mean("force") > 5000).all()  # the closing of the gap at each reversal


def test_mean_and_error_are_those_of_independent_members():
    values = np.array([[1.0, 3.0], [4.0, np.nan], [7.0, 9.0]])
    made = Ensemble(BAR, {"force": values}, (Status.OK,) * 3)
    assert made.mean("force") == pytest.approx(24 / 5)
    assert made.error("force") == pytest.approx(np.std([2.0, 4.0, 8.0], ddof=1) / np.sqrt(3))
    alone = Ensemble(BAR, {"force": values[2:]}, (Status.OK,))
    assert alone.error("force") == pytest.approx(np.std([7.0, 9.0], ddof=1) / np.sqrt(2))
    assert np.isnan(Ensemble(BAR, {"force": np.full((2, 2), np.nan)}, (Status.OK,) * 2).mean("force"))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [({"cycles": 0}, "cycles = 0"), ({"workers": 0}, "workers = 0"), ({"spread": 0.0}, "spread = 0.0 m")],
)
def test_bad_input_is_named(wrong, words):
    with pytest.raises(ValueError, match=words):
        ensemble(**{"fourbar": BAR, "cycles": 1, "seeds": [1]} | wrong)
    with pytest.raises(ValueError, match="speed = 0"):
        ensemble(FourBar(speed=0.0), 1, [1])
    with pytest.raises(ValueError, match="seeds"):
        ensemble(BAR, 1, [])
