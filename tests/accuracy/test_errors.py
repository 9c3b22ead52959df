"""Errors signal by signal: the measure on closed forms, what is told against what is delivered, what may be asked."""

from math import hypot, pi

import numpy as np
import pytest
from simulations import BAR, SPAN, pendulum
from truths import four_bars, pendulums

pytest.importorskip("numba")

from buckler.mbs import Beam, Cable, Motion, Ramp, Result, Rigid, Section, Status, Strut, simulate, slider_crank
from buckler.mbs.accuracy.aim import Aim
from buckler.mbs.accuracy.by_signal import by_signal
from buckler.mbs.accuracy.ways import own_functions
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.library import crank_rocker
from buckler.mbs.record.errors import Errors
from buckler.mbs.solvers.spectral import Spectral
from buckler.studies.trust import benchmark_problems as problems

TIME = np.linspace(0.0, 2.0, 4001)
THICK = Section(0.03, 2e-3).damped(0.01, 0.31)
EQUIVALENT = (SPAN**2 / 3 + BAR.section.thickness**2 / 12) / (SPAN / 2)  # length of the simple pendulum of the same period
PERIOD = float(2 * pi * np.sqrt(EQUIVALENT / pendulums.GRAVITY))
STOP = KelvinVoigt(1e5, 300.0)
UNITS = {"x": "m", "y": "m", "vx": "m/s", "vy": "m/s", "fx": "N", "fy": "N", "contact_force": "N", "torque": "N m"}


def made(**signals):
    """A result of these signals, `__` for the dot in their names."""
    named = {name.replace("__", "."): values for name, values in signals.items()}
    return Result(Status.OK, "", TIME, named, {name: UNITS[name.rpartition(".")[2]] for name in named}, {})


# --- the measure ------------------------------------------------------------------------------------------------------


def test_a_place_is_measured_over_its_range_and_a_speed_over_its_largest():
    wave, other = np.sin(2 * pi * TIME), np.cos(2 * pi * TIME)
    right = made(P__x=wave, P__y=0 * wave, P__vx=other, P__vy=0 * wave)
    found = by_signal(made(P__x=wave + 0.02, P__y=0.02 + 0 * wave, P__vx=1.01 * other, P__vy=0.01 * other), right)
    assert found["P.x"] == pytest.approx(0.01, rel=1e-6) == found["P.y"]
    assert found["P.vx"] == pytest.approx(0.01 * np.sqrt(0.5), rel=1e-3) == found["P.vy"]


def pulse(centre, width, height):
    return np.where(abs(TIME - centre) < width / 2, height * np.cos(pi * (TIME - centre) / width), 0.0)


def test_a_force_is_measured_by_peak_mean_square_and_impulse():
    right = made(B__contact_force=pulse(1.0, 0.1, 50.0))
    higher = by_signal(made(B__contact_force=pulse(1.0, 0.1, 55.0)), right)
    for part in ("peak", "rms", "impulse"):
        assert higher[f"B.contact_force.{part}"] == pytest.approx(0.1, rel=1e-6)
    assert higher["B.contact_force"] == max(value for name, value in higher.items() if name != "B.contact_force")
    shorter = by_signal(made(B__contact_force=pulse(1.0, 0.05, 50.0)), right)
    assert shorter["B.contact_force.peak"] == pytest.approx(0.0, abs=1e-9)
    assert shorter["B.contact_force.impulse"] == pytest.approx(0.5, rel=1e-3)
    assert shorter["B.contact_force.rms"] == pytest.approx(1 - np.sqrt(0.5), rel=1e-3)


def test_an_impact_a_step_later_is_as_good_a_force():
    right, late = made(B__contact_force=pulse(1.0, 0.01, 50.0)), made(B__contact_force=pulse(1.01, 0.01, 50.0))
    found = by_signal(late, right)
    assert found["B.contact_force"] < 1e-3
    assert found["B.contact_force.onset"] == pytest.approx(0.01 / 2, rel=0.06)


def test_a_force_of_another_sign_is_all_wrong():
    right, wrong = made(drive__torque=3 + 0 * TIME), made(drive__torque=-3 + 0 * TIME)
    assert by_signal(wrong, right)["drive.torque"] > 1


def test_a_small_component_is_measured_by_the_vector():
    right = made(A__fx=100 * np.cos(TIME), A__fy=1e-3 * np.cos(TIME))
    found = by_signal(made(A__fx=100 * np.cos(TIME), A__fy=0 * TIME), right)
    assert found["A.fy"] == pytest.approx(1e-5, rel=1e-3)


def test_a_contact_in_one_run_only_has_no_onset_in_common():
    touching, open_ = made(B__contact_force=pulse(1.0, 0.1, 5.0)), made(B__contact_force=0 * TIME)
    assert by_signal(open_, touching)["B.contact_force.onset"] == np.inf
    assert by_signal(open_, open_)["B.contact_force"] == 0.0


# --- what is asked ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("of", ["speeds", [], ["B.x", 3], 7])
def test_what_an_accuracy_may_be_asked_of(of):
    with pytest.raises(ValueError, match=r"of = .*: must be 'places', 'forces', or a list of signals' names"):
        simulate(pendulum(0.3), 0.1, 1e-3, of=of)


def test_a_signal_that_is_not_there_is_named_with_those_near_it():
    with pytest.raises(ValueError, match=r"no signal 'A\.z'; near it: .*A\.x"):
        simulate(pendulum(0.3), 0.1, 1e-3, of=["A.z"])


def test_of_needs_an_accuracy():
    with pytest.raises(ValueError, match="of = 'forces': no accuracy"):
        simulate(pendulum(0.3), 0.1, of="forces")


def test_errors_are_a_mapping_that_prints_and_names_what_it_does_not_have():
    found = simulate(pendulum(0.3), 0.5, 1e-4).error
    assert 0 <= found.motion <= 1e-4 and 0 <= found["A.x"] <= 1e-4 and "energy.kinetic" in found
    assert repr(found).startswith("<Errors: motion ")
    with pytest.raises(ValueError, match=r"no error of 'A\.xx'; near it: A\.x"):
        found["A.xx"]
    with pytest.raises(ValueError, match=r"no error of 'A\.x': none was estimated"):
        Errors()["A.x"]
    assert not Errors().known and repr(Errors()) == "<Errors: not estimated>"


# --- what is delivered ------------------------------------------------------------------------------------------------


def test_a_pendulum_of_a_hundred_periods():
    """Its angle after 100 periods, against the elliptic function."""
    result = simulate(pendulum(0.1), 100 * PERIOD, 1e-3)
    angle, _ = pendulums.simple(100 * PERIOD, 0.1, length=EQUIVALENT)
    assert result.ok and abs(np.arctan2(result["A.x"][-1], -result["A.y"][-1]) - angle) < 1e-3 * 0.1 * 2


def test_a_double_pendulum_at_a_millionth():
    """Its first angle after 5 s against another method at 1e-13; it was 1.4e-5 and SUSPECT."""
    result = simulate(problems.double_pendulum(), 5.0, 1e-6)
    angle = float(pendulums.double_by_steps("rods", (pi / 2, pi / 2), 5.0)[0])
    assert result.ok and abs(pi / 2 + result["first.angle"][-1] - angle) < 1e-6
    assert result.work["spectral_runs"] >= 2 and "exudyn_runs" not in result.work


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6])
def test_four_bars_through_singular_poses(accuracy):
    """Ten seconds against the elliptic function; at a millionth it was 1.6e-5 m and SUSPECT."""
    result = simulate(problems.four_bars(2), 10.0, accuracy)
    x, y, *_ = four_bars.top(10.0)
    assert result.ok and hypot(result["B0.x"][-1] - x, result["B0.y"][-1] - y) <= 2 * accuracy


def test_a_determined_linkage_is_not_integrated():
    result = simulate(slider_crank(Rigid(THICK), law=None, mass=0.3, speed=Ramp(0.0, 40.0, 0.05)), 0.1, 1e-6)
    assert result.ok and result.error.motion <= 1e-6
    assert result.error.kind == "samples; nothing is integrated" and result.work["newton_iterations"] == 0


@pytest.mark.slow
def test_forces_are_delivered_where_they_are_asked_for():
    """Of a slider that a strut presses on its stop: peak, mean square and impulse, against a far finer run."""
    mechanism = slider_crank(Strut(Section(0.03, 3e-4)), law=STOP, mass=0.3, speed=6.0)
    result = simulate(mechanism, 0.7, 1e-2, of=["B.contact_force"])
    fine = simulate(mechanism, 0.7, 1e-4, of=["B.contact_force"])
    assert result.ok and fine.error["B.contact_force"] <= 1e-4 and result.error["B.contact_force"] <= 1e-2
    assert by_signal(result, fine)["B.contact_force"] <= 1.2e-2  # the estimate is the difference of two runs, no bound


def test_what_forces_miss_is_told():
    mechanism = slider_crank(Cable(Section(0.03, 2e-3)), law=None, mass=0.3, speed=20.0)
    result = simulate(mechanism, 0.1, 1e-6, of="forces", timeout=3.0)
    assert not result.ok
    assert "ACCURACY: asked 1e-06 of forces, reached" in result.message or result.status is Status.TIMED_OUT


def test_named_elements_stay_with_exudyn():
    """What is asked for is the answer of four elements, which is not that of the strip."""
    mechanism = slider_crank(Beam(THICK, elements=4), law=None, mass=0.3, speed=20.0)
    result = simulate(mechanism, 0.05, 1e-3)
    assert result.ok and "spectral_runs" not in result.work


def test_a_solver_that_fails_is_followed_by_the_other(monkeypatch):
    """The compiled one may take no step: Exudyn answers, and the work of both is told."""
    from dataclasses import replace

    from buckler.mbs import simulation

    def stuck(mechanism, duration, solver, *limits):
        return compiled(mechanism, duration, replace(solver, steps=replace(solver.steps, max_steps=3)), *limits)

    compiled = simulation.SOLVERS[Spectral]
    monkeypatch.setitem(simulation.SOLVERS, Spectral, stuck)
    result = simulate(pendulum(0.3), 1.0, 1e-3)
    assert result.ok and result.error.motion <= 1e-3
    assert result.work["exudyn_runs"] >= 3 and result.work["spectral_runs"] >= 1
    assert result.provenance["settings"]["kind"] == "Exudyn"


def test_functions_in_python_are_found():
    mechanism = slider_crank(Rigid(THICK), law=STOP, mass=0.3, speed=6.0)
    assert not own_functions(mechanism) and not own_functions(crank_rocker(Beam(THICK), speed=30.0))
    assert own_functions(slider_crank(Rigid(THICK), law=None, mass=0.3, speed=Motion(lambda t: t * t, lambda t: 2 * t)))
    assert own_functions(slider_crank(Strut(THICK, load=lambda u: u), law=None, mass=0.3, speed=6.0))


def test_an_aim_reads_as_words():
    assert Aim().words == "places" and Aim(["B.x", "B.y"]).words == "B.x, B.y"
