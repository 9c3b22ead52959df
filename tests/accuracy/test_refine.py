"""Runs without settings: right to what is allowed, made finer where they are not, and told where that does not help."""

from math import hypot, pi

import numpy as np
import pytest
from simulations import BAR, SPAN, block, pendulum
from truths import four_bars, pendulums

pytest.importorskip("numba")

from buckler.mbs import Beam, Cable, Controlled, Exudyn, Motion, Rigid, Section, Spectral, Status, Stop, simulate, slider_crank
from buckler.mbs.accuracy import refine
from buckler.mbs.accuracy.band import averaged, start
from buckler.mbs.accuracy.by_signal import by_signal
from buckler.mbs.functions import Expression
from buckler.mbs.kinematics.inertias import axial_period
from buckler.mbs.laws import CarvalhoMartins
from buckler.studies.trust import benchmark_problems as problems

EQUIVALENT = (SPAN**2 / 3 + BAR.section.thickness**2 / 12) / (SPAN / 2)  # length of the simple pendulum of the same period
PERIOD = float(2 * pi * np.sqrt(EQUIVALENT / pendulums.GRAVITY))
THICK = Section(0.03, 2e-3).damped(0.01, 0.31)


def test_a_pendulum_of_a_hundred_periods():
    """Within a thousandth of its amplitude; it was 12 % off, and fine."""
    result = simulate(pendulum(0.1), 100 * PERIOD)
    angle, _ = pendulums.simple(100 * PERIOD, 0.1, length=EQUIVALENT)
    assert result.ok and result.work["spectral_runs"] >= 2
    assert abs(np.arctan2(result["A.x"][-1], -result["A.y"][-1]) - angle) < 1e-3 * 0.1


@pytest.mark.slow
def test_four_bars_through_singular_poses_for_ten_seconds():
    """Against the elliptic function; it was 0.06 m off, and fine."""
    result = simulate(problems.four_bars(2), 10.0)
    x, y, *_ = four_bars.top(10.0)
    assert hypot(result["B0.x"][-1] - x, result["B0.y"][-1] - y) < 2e-3


def test_a_run_that_holds_is_handed_back_with_its_error():
    mechanism = slider_crank(Beam(THICK), law=None, mass=0.3, speed=20.0)
    result = simulate(mechanism, 0.1)
    assert result.ok and result.provenance["settings"]["kind"] == "Exudyn"
    assert (result.work["exudyn_runs"], result.work["spectral_runs"]) == (1, 1)
    assert result.error["B.x"] < 1e-3 and result.error["drive.torque"] < 0.05 and result.error["energy.kinetic"] < 0.05
    assert np.isnan(result.asked) and result.error.kind == "a run of Spectral beside it"


@pytest.mark.parametrize("solver", [Exudyn(), Spectral()], ids=["Exudyn", "Spectral"])
def test_a_solver_that_is_named_is_left_alone(solver):
    result = simulate(pendulum(0.1), 2.0, solver=solver)
    assert "runs" not in result.work and not result.error.known


def test_forces_of_strips_are_means_over_their_axial_vibration():
    """Of an undamped strip that starts at once they ring, by 9 % to 25 % in two solvers; their means agree to a hundredth."""
    mechanism = slider_crank(Cable(Section(0.03, 2e-3)), law=None, mass=0.3, speed=20.0)
    result = simulate(mechanism, 0.1)
    assert result.ok and "means, twice over 0.00077 s" in result.provenance["notes"][-1]
    fine = simulate(mechanism, 0.1, solver=Spectral(Controlled(1e-8), degree=12))
    raw, period = fine["coupler.axial_force"], axial_period(mechanism)
    right = averaged(fine.time, averaged(fine.time, raw, period), period)
    peak = abs(right).max()
    assert abs(result["coupler.axial_force"]).max() == pytest.approx(peak, rel=0.03)
    assert abs(raw).max() > 1.15 * peak


def test_a_mean_leaves_slow_forces_and_takes_the_ring():
    time = np.linspace(0.0, 1.0, 20001)
    slow, ring = 3 + np.sin(2 * pi * time), np.sin(2 * pi * 100 * time)
    found = averaged(time, averaged(time, slow + ring, 0.01), 0.01)
    inside = (time > 0.01) & (time < 0.99)
    assert abs(found - slow)[inside].max() < 5e-4
    assert abs(found - slow).max() < 0.05  # at the ends the mean is that of the nearest period within the run


@pytest.mark.parametrize("finer", [400, 500, 600, 700, 800])
def test_a_ring_that_growing_steps_lose_is_no_peak(finer):
    """Steps that double from a small part of a period to two: the first ones see a sudden force swing to twice itself."""
    period = 1e-3
    time = np.concatenate([[0.0], np.cumsum(np.minimum(2.0 ** np.arange(120) * period / finer, 2 * period))])
    force = np.where(time < 1.5 * period, 1 - np.cos(2 * pi * time / period), 1.0)
    at, wide = start(time, period)
    assert averaged(time, averaged(time, force[at], wide), wide).max() < 1.01
    if finer in (400, 700, 800):
        assert averaged(time, averaged(time, force, period), period).max() > 1.2


@pytest.mark.parametrize("step", [5e-5, 2e-3])
def test_equal_steps_are_averaged_over_one_period(step):
    time = np.arange(300) * step
    at, wide = start(time, 1e-3)
    assert set(wide) == {1e-3} and (at == np.arange(300)).all()


def test_functions_in_python_are_not_compiled():
    motion = Motion(lambda t: 4 * t + np.sin(20 * t) / 20, lambda t: 4 + np.cos(20 * t))
    result = simulate(slider_crank(Beam(THICK), law=None, mass=0.3, speed=motion), 0.2)
    assert result.ok and "spectral_runs" not in result.work and result.work["exudyn_runs"] >= 2


@pytest.mark.slow
def test_a_drive_that_shakes_faster_than_the_samples():
    """50 Hz, of which 200 samples of 2 s show two a period: the torque against twenty times as many."""
    mechanism = slider_crank(Rigid(THICK), law=None, mass=0.3, speed=Expression("3*sin(314*t)"))
    result = simulate(mechanism, 2.0)
    assert result.ok and result.work["exudyn_runs"] >= 2 and result.error["drive.torque"] < 0.05
    fine = simulate(mechanism, 2.0, solver=Exudyn(Controlled(max_step=2.0 / 4000)))
    assert by_signal(result, fine)["drive.torque"] < 0.05


@pytest.mark.parametrize("second", [0.1 + 5e-6, 0.1 + 1e-3])
def test_two_stops_a_hair_apart(second):
    """A block falls on one and, microseconds later, on the other; impulses against a far finer run of the other solver."""
    from dataclasses import replace

    law = CarvalhoMartins(1e6, 0.5)
    made = block(9.81, law)
    far = Stop("B", at=second + 0.1, law=law)
    mechanism = replace(made, stops=[*made.stops, far])
    result = simulate(mechanism, 0.3)
    fine = simulate(mechanism, 0.3, solver=Spectral(Controlled(1e-10, 1e-3), method="explicit"))
    found = by_signal(result, fine)
    assert result.ok, result.message
    assert max(found["A.contact_force"], found["B.contact_force"]) < 0.05


def test_what_rests_needs_no_second_run():
    result = simulate(block(), 0.1)
    assert result.ok and result.work["runs"] == 1 and not result.error.known


def test_what_does_not_hold_is_told(monkeypatch):
    """No time for a finer run: the first one is handed back, and says how far off it is."""
    monkeypatch.setattr(refine, "deliver", lambda task, run: refine.Delivery(run(*REST), float("nan"), refine.Errors()))
    REST = (pendulum(0.1), 1e-3, Exudyn(Controlled(max_steps=1)))
    result = simulate(pendulum(0.1), 100 * PERIOD)
    assert result.status is Status.SUSPECT
    assert "is off by about" in result.message and result.message.startswith("ACCURACY: ")
    assert result.error["A.x"] > 0.01
