"""Smooth contacts come to published trajectories of nonsmooth dynamics as they stiffen."""

import numpy as np
import pytest
from drawing import drawn

from buckler.mbs import Controlled, Exudyn, simulate
from buckler.studies.rattling import nonsmooth
from buckler.studies.rattling.nonsmooth_cases import FOURBAR, SLIDER_CRANK, controlled, slider_crank


def test_controller_gives_the_published_torque():
    """At every published state; they are stored to 1e-6 rad, which its gain makes 2e-3 N m."""
    time, crank, _, _, speed, torque = FOURBAR
    found = np.array([controlled(*each) for each in zip(time, crank, speed, strict=True)])
    np.testing.assert_allclose(found, torque, atol=5e-3)
    assert np.abs(torque).max() > 180


def test_slider_in_its_guide_strikes_where_the_published_one_does():
    """First half turn, six strikes of the lower and upper face: within a fifth of the clearance at 1e6 N/m, worse when softer."""
    apart = []
    for stiffness in (1e5, 1e6):
        result = simulate(slider_crank(stiffness), 0.035, solver=Exudyn(Controlled(tolerance=1e-5)))
        turned = 2 * np.pi * SLIDER_CRANK[1]
        seen = turned < min(np.pi, result.signals["crank.angle"][-1])
        published = SLIDER_CRANK[2][seen]
        apart.append(np.sqrt(((nonsmooth.height(result, turned[seen]) - published) ** 2).mean()))
    assert np.abs(published).max() == pytest.approx(1, abs=1e-3)  # rests on, and strikes, both faces
    assert apart[1] < 0.1 and 1.5 < apart[0] / apart[1] < 10


def test_published_schemes_differ_from_each_other():
    assert 1e-4 < nonsmooth.schemes_apart() / 0.153 < 3e-3


@pytest.mark.slow
def test_study_finds_the_rates_and_its_figure():
    result = nonsmooth.run(nonsmooth.Parameters())
    assert result.status == "OK", result.message
    m = {name: metric.value for name, metric in result.metrics.items()}
    assert m["four-bar.power_of_stiffness"] == pytest.approx(-1.0, abs=0.15)
    assert m["slider-crank.power_of_stiffness"] == pytest.approx(-0.65, abs=0.2)
    assert max(m["four-bar.1e+07.largest"], m["slider-crank.1e+07.largest"]) < 1e-3
    assert m["slider-crank.1e+07.distance"] < m["slider-crank.schemes"]
    assert len(drawn(nonsmooth, result).axes) == 2
