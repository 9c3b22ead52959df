"""The papers' figures on their own axes; means of the crank-rocker with errors."""

import numpy as np
import pytest
from drawing import inked

from buckler.studies.rattling import crank_rocker
from buckler.studies.striking import paper_figures


@pytest.fixture(scope="module")
def result():
    return paper_figures.run(paper_figures.Parameters(models="stitched"))


def test_published_model_strikes_as_printed_in_every_figure(result):
    assert result.status == "OK", result.message
    m = {name: metric.value for name, metric in result.metrics.items()}
    assert [m[f"fig{k}.stitched.first"] for k in ("5", "10", "11")] == pytest.approx([27, 25, 30], rel=1e-3)
    assert [m[f"fig{k}.stitched.turns"] for k in ("5", "6", "10", "11")] == [3, 9, 3, 3]
    assert 28 < m["fig6.stitched.first"] < 40 and 120 < m["fig6.stitched.last"] < 140  # the printed axis ends at 140 N


def test_axes_are_the_printed_ones(result):
    axes = inked(paper_figures, result).axes
    assert [ax.get_xlim()[1] for ax in axes] == [15, 15, 15, 12] and [ax.get_ylim()[1] for ax in axes] == [30, 140, 30, 35]
    assert all("[s]" in ax.get_xlabel() and "[N]" in ax.get_ylabel() and ax.get_yscale() == "linear" for ax in axes)


@pytest.mark.slow
def test_bowed_beam_strikes_as_printed_at_both_voltages():
    result = paper_figures.run(paper_figures.Parameters(models="beam", figures="5,10,11"))
    for k, force in (("5", 27), ("10", 25), ("11", 30)):
        assert result.metrics[f"fig{k}.beam.first"].value == pytest.approx(force, abs=1)


def test_crank_rocker_gives_means_with_errors():
    result = crank_rocker.run(crank_rocker.Parameters(rocker="rigid", duration=0.012, settle=0.005, members=3))
    alone = [
        crank_rocker.run(crank_rocker.Parameters(rocker="rigid", duration=0.012, settle=0.005, members=1, seed=k))
        for k in range(3)
    ]
    name = "rigid.peak_force_coupler_rocker"
    each = [run.metrics[name].value for run in alone]
    metric = result.metrics[name]
    assert metric.value == pytest.approx(np.mean(each)) and alone[0].metrics[name].error is None
    assert metric.error == pytest.approx(np.std(each, ddof=1) / np.sqrt(3) / np.mean(each))
    assert "± standard error of the mean over 3 members" in str(result)
