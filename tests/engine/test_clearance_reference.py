"""Joints with clearance in the engine against the compiled reference, which shares with it the contact laws and nothing else."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from clearance_pair import damped_modes, damped_section, distance, forces
from fourbar import FourBar, run
from scipy.stats import norm
from simulations import fine

pytest.importorskip("numba")

from turn_statistics import QUANTITIES, Comparison, columns, compare

from buckler.mbs import Beam, Controlled, Exudyn, Modal, simulate
from buckler.mbs.laws import AdamsFriction
from buckler.mbs.library import CLOSED
from buckler.studies.rattling.turns import by_turn, ensemble

BAR = FourBar()
"""Joints that rattle, 253 N s/m: 0.25 mm, 300 r/min."""
SHORT = 0.010
"""Time, s, for which rattling motion may be compared: after it an offset grows too fast."""


def run_engine(bar, duration, tolerance, rocker=None):
    """A run that may be trusted, its energy in balance."""
    solver = Exudyn(Controlled(tolerance=tolerance, max_step=min(duration / 100, bar.period / 720)))
    result = fine(simulate(bar.mechanism(rocker), duration, solver=solver, ledger=True, timeout=120))
    assert result.energy_balance < 1e-3
    return result


def run_reference(bar, duration, tolerance=1e-12):
    """The reference, sampled each microsecond, so that it can be read between its samples."""
    found = run(bar, duration, tolerance=tolerance, samples=round(1e6 * duration) + 1)
    assert found.ok and found.energy_balance < 1e-7
    return found


def slope(results, errors):
    """Order of convergence in the number of steps, first to last."""
    return -np.log(errors[-1] / errors[0]) / np.log(results[-1].work["steps"] / results[0].work["steps"])


# --- trajectories -----------------------------------------------------------------------------------------------------


def test_rattling_rigid_bars_move_as_the_reference_says():
    """Fourth order in the steps at least, down to 1e-11 m; each joint is struck as often, and as hard.

    The integrator is of fifth order; the onset of each contact falls within a step. Rounding, which differs between
    processors, moves the slope between 4.0 and 4.4.
    """
    run = run_reference(BAR, SHORT)
    results = [run_engine(BAR, SHORT, tolerance) for tolerance in (1e-4, 1e-5, 1e-6, 1e-8)]
    errors = [distance(result, run).max() for result in results]
    assert errors[-1] < 1e-10
    assert (np.diff(errors) < 0).all() and slope(results, errors) > 3.8
    struck = (np.diff((run.depth > 0).astype(int), axis=0) > 0).sum(axis=0)  # samples are a microsecond apart
    assert struck.sum() >= 20
    assert [results[-1].signals[f"{point}.contacts"][-1] for point in "OABC"] == list(struck)
    np.testing.assert_allclose(forces(results[-1]).max(axis=0), run.peak_force.max(axis=0), rtol=1e-4)
    for what in ("contact", "friction"):
        lost = [results[-1].energy[f"{point}.taken_{what}"][-1] for point in "OABC"]
        np.testing.assert_allclose(lost, getattr(run, f"taken_{what}")[-1], rtol=1e-3)
        assert sum(lost) == pytest.approx(results[-1].energy[f"taken_{what}"][-1], rel=1e-12)


def test_closed_rigid_bars_move_as_the_reference_says():
    """A whole turn with stiff dampers, implicit steps: second order, down to 1e-7 m."""
    bar = replace(BAR, law=CLOSED)
    run = run_reference(bar, bar.period, 1e-10)
    results = [run_engine(bar, bar.period, tolerance) for tolerance in (1e-6, 1e-7)]
    errors = [distance(result, run).max() for result in results]
    assert errors[-1] < 1e-7
    assert slope(results, errors) == pytest.approx(2.0, abs=0.5)  # which step a peak falls into is decided by rounding
    np.testing.assert_allclose(forces(results[-1]).max(axis=0), run.peak_force.max(axis=0), rtol=5e-3)


@pytest.mark.parametrize("law", [BAR.law, CLOSED], ids=["rattling", "closed"])
def test_modal_rocker_moves_as_the_reference_with_the_same_modes(law):
    """Implicit: second order in the steps. A rigid rocker is a hundred times farther off, other damping shows."""
    rocker = Modal(BAR.section, damping=0.01)
    bar = replace(BAR, law=law, modes=rocker)
    run = run_reference(bar, SHORT, 1e-11)
    results = [run_engine(bar, SHORT, tolerance, rocker) for tolerance in (1e-5, 1e-6)]
    errors = [distance(result, run).max() for result in results]
    assert errors[-1] < 2e-6 and slope(results, errors) > 1.5
    rigid, undamped = replace(bar, modes=None), replace(bar, modes=replace(bar.modes, damping=0.0))
    for other, factor in ((rigid, 50), (undamped, 10)):
        assert distance(results[-1], run_reference(other, SHORT, 1e-11)).max() > factor * errors[-1]


def test_beam_rocker_is_the_limit_of_the_modal_reference():
    """The more modes the reference has, the nearer it comes: from 120 um with the rigid rocker, or one mode, to 10 um."""
    damped = damped_section(BAR)
    result = run_engine(BAR, SHORT, 1e-5, Beam(damped, elements=8))
    away = [
        distance(result, run_reference(replace(BAR, modes=damped_modes(damped, n, n)), SHORT, 1e-10)).max() for n in (1, 2, 4, 8)
    ]
    assert (np.diff(away) < 0).all() and away[0] > 1e-4 and away[-1] < 1.5e-5


# --- statistics -------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("members", "cycles", "chance", "error"), [(8, 1, 2.7e-3, 0.15), (20, 5, 0.01, 0.04)], ids=["few cycles", "a hundred"]
)
def test_cycles_have_the_statistics_of_the_reference(members, cycles, chance, error):
    """Largest forces, accelerations and losses at once: all together are allowed the chance to fail without a reason.

    Two standard errors alone would fail one test in three. A hundred cycles must tell friction that is a fifth larger.
    """
    found = compare(BAR.mechanism(), BAR.mechanism(), members, cycles)
    assert found.chance > chance and found.balance < 1e-3
    assert (found.error / found.compiled.mean(axis=0)).max() < error
    rougher = replace(BAR, friction=AdamsFriction(static=0.36, dynamic=0.12)).mechanism()
    other = found._replace(compiled=columns(ensemble(rougher, cycles, range(4 * members)).turns).mean(axis=1))
    assert cycles < 5 or other.chance < 1e-6


@pytest.mark.slow
def test_cycles_of_closed_joints_are_those_of_the_reference():
    """Nothing is left to chance here: numbers of three cycles agree one by one."""
    bar = replace(BAR, law=CLOSED)
    result = run_engine(bar, 4 * bar.period, 1e-7)
    found = by_turn(result, bar.period, 4, 1)
    expected = ensemble(bar.mechanism(), 3, [0], spread=1e-12, tolerance=1e-9).turns
    np.testing.assert_allclose(found["force"], expected["force"][0], rtol=5e-3)
    np.testing.assert_allclose(found["rms_a"][:, :2], expected["rms_a"][0, :, :2], rtol=2e-3)
    np.testing.assert_allclose(found["lost"], expected["lost"][0], rtol=2e-3)


def draw(shape, seed=1):
    return 1 + 0.01 * np.random.default_rng(seed).standard_normal(shape)


def test_statistics_tell_a_difference_from_chance():
    one, same, other = draw((40, 5)), draw((160, 5), 2), draw((160, 5), 3)
    other[:, 3] *= 1.01
    alike, apart = Comparison(one, same, 0.0), Comparison(one, other, 0.0)
    assert alike.chance > 0.01 and apart.chance < 1e-4
    assert np.abs(alike.apart).max() < 3 and apart.apart[3] == pytest.approx(-1 / np.hypot(1 / 40**0.5, 1 / 160**0.5), abs=2)
    k = int(np.abs(alike.apart).argmax())
    assert alike.chance == pytest.approx(min(1.0, 5 * 2 * norm.sf(abs(alike.apart[k]))), rel=0.5)  # nearly normal with so many
    assert len(QUANTITIES) == alike.error.size == 5


def test_measures_of_a_turn_are_those_of_the_curves():
    """Of sines, at uneven times: largest values, root mean square, differences; the first turn is left out."""
    time = np.sort(np.concatenate([np.linspace(0, 3, 6001), 1.5 + 0.2 * np.random.default_rng(1).random(500)]))
    wave, turn = np.sin(2 * np.pi * time), np.floor(time) + 1
    sizes = {"O.ground-crank": 1, "A.coupler-crank": 1, "B.coupler-rocker": 3, "C.ground-rocker": 5}
    signals = {f"{joint}.f{axis}": k * turn * wave for joint, k in sizes.items() for axis in "xy"}
    signals |= {"coupler.ax": 2 * wave, "rocker.ax": 4 * wave}
    made = SimpleNamespace(time=time, signals=signals, energy={"taken_contact": time, "taken_friction": time**2})
    expected = [[k * n * 2**0.5 for k in (3, 5)] + [2**0.5, 2 * 2**0.5, 1 + 2 * n - 1] for n in (2, 3)]
    assert columns(by_turn(made, 1.0, 3, 1)) == pytest.approx(np.array(expected), rel=1e-3)
    made.signals["A.penetration"] = np.where(time > 2, 1e-5, 0.0)
    assert by_turn(made, 1.0, 3, 1)["depth"].tolist() == [[0, 0, 0, 0], [0, 1e-5, 0, 0]]
