"""The study of published benchmark problems."""

import numpy as np
import pytest

from buckler.studies.trust import benchmark_problems as problems
from buckler.studies.trust import benchmarks
from buckler.studies.trust.benchmarks import ALLOWED, Parameters, figure, run

PART = ("andrews", "princeton", "simeon", "pendulum")


@pytest.fixture(scope="module")
def found():
    return run(Parameters(problems=PART, steps=8000))


def test_all_numbers_are_as_published(found):
    assert found.status == "OK", found.message
    for name in ("andrews.beta", "princeton.tip", "princeton.exact", "simeon.slider_crank", "pendulum"):
        assert found.metrics[name].error <= ALLOWED[name]
    assert figure(found).axes


def test_four_bar_goes_through_its_singular_poses():
    """Level poses, in which the couplers could fold, ten times in 10 s."""
    result = run(Parameters(problems=("four_bar_n2",)))
    assert max(result.metrics[f"four_bar_n2.{axis}"].error for axis in "xy") <= 1e-4


def test_andrews_bodies_stand_as_published():
    """Points of the closed chain at the start, from the truths' table."""
    points = problems.andrews().points
    assert points["E"] == pytest.approx((-0.020960022346354336, 0.0012951691937066864), abs=1e-9)
    assert points["D"] == pytest.approx((-0.010472393888814626, 0.02535778853027525), abs=1e-9)
    ends = np.hypot(*np.subtract(points["G"], points["A"]))
    assert ends == pytest.approx(0.04, rel=1e-12)


def test_a_wrong_spring_is_seen(monkeypatch):
    """Break the physics: a spring 1 % stiffer moves beta by far more than is allowed."""
    right = problems.andrews()
    from dataclasses import replace

    stiffer = replace(right, loads=[right.loads[0], replace(right.loads[1], stiffness=1.01 * right.loads[1].stiffness)])
    monkeypatch.setattr(problems, "andrews", lambda: stiffer)
    assert "andrews.beta is" in run(Parameters(problems=("andrews",), steps=2000)).message


def test_a_suspect_run_is_no_ok_though_its_number_is_right(monkeypatch):
    suspect = {"princeton.tip_13": benchmarks.Row(1.0, 1e-9, 1.0, "m", "SUSPECT")}
    monkeypatch.setitem(benchmarks.SOLVE, "princeton", lambda _: suspect)
    result = run(Parameters(problems=("princeton",)))
    assert (result.status, result.message) == ("SUSPECT", "princeton.tip_13: its run is SUSPECT")
