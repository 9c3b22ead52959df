"""The benchmark: its numbers are those of the jobs, a wrong one makes it SUSPECT, and it is drawn."""

import pytest

from buckler.studies.trust import benchmark
from buckler.studies.trust.benchmark import Parameters, TimedJob, run


@pytest.fixture(scope="module")
def short():
    return run(Parameters(jobs=("static", "rigid clearance"), repeats=1))


def test_ours_and_baseline_are_right(short):
    assert short.status == "OK", short.message
    assert short.metrics["static.error"].value < 1e-5 and short.metrics["static.baseline_error"].value < 1e-5
    assert short.metrics["rigid_play.error"].value < 1e-2 and short.metrics["rigid_play.baseline_error"].value < 1e-3
    assert len(short.tables[0].rows) == 2 and short.metrics["static.baseline_over_ours"].value > 0
    axes = benchmark.figure(short).axes
    assert [ax.get_title() for ax in axes] == ["static", "rigid clearance"]
    assert len({ax.get_ylabel() for ax in axes}) == 2  # each its own kind of error


def test_a_wrong_answer_is_suspect(monkeypatch):
    monkeypatch.setitem(benchmark.JOBS, "static", lambda: TimedJob(lambda: 2.0, lambda: 1.25, lambda x: x - 1, 0.5))
    result = run(Parameters(jobs=("static",), repeats=1))
    assert result.status == "SUSPECT" and result.message == "static: error 1.0e+00, allowed 0.5"
