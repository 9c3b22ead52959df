"""The compiled solver beside hand-tuned plain runs."""

from __future__ import annotations

import pytest

pytest.importorskip("numba")

from drawing import drawn

from buckler.studies.trust import solver_speed


def test_both_ways_of_the_fast_work_agree() -> None:
    result = solver_speed.run(solver_speed.Parameters(works=("fast",), repeats=1, known=0))
    assert result.status == "OK", result.message
    assert result.metrics["fast_error"].value < 2e-3
    assert result.metrics["fast_plain_error"].value < 4e-3
    drawn(solver_speed, result)


@pytest.mark.slow
def test_one_run_is_faster_than_a_hand_tuned_one() -> None:
    found = solver_speed.run(solver_speed.Parameters(repeats=3, known=0)).metrics
    for name in solver_speed.WORKS:
        assert found[f"{name}_error"].value < found[f"{name}_plain_error"].value
        assert found[f"{name}_ratio"].value > 1.0
