"""What the check of the steps is made of."""

from types import SimpleNamespace

import numpy as np
import pytest
from simulations import pendulum

from buckler.mbs.accuracy import predictable
from buckler.mbs.checks import steps


@pytest.mark.parametrize(("span", "idle"), [(2.0, True), (1.0, True), (0.5, False)])
def test_a_finer_run_of_all_that_can_be_predicted_leaves_nothing_to_ask(monkeypatch, span, idle):
    monkeypatch.setattr(predictable, "predictable", lambda mechanism, duration: span)
    time = np.linspace(0.0, 1.0, 9)
    run = SimpleNamespace(record=SimpleNamespace(mechanism=pendulum(1.0), time=time))
    said = steps._idle(run, SimpleNamespace(time=time, error=SimpleNamespace(known=True)))
    assert said == ("a whole finer run was compared" if idle else "")


def test_the_stretch_looked_at_has_its_moment_in_the_middle_and_lies_within_the_run():
    assert [steps._about(middle, 10, 100) for middle in (50, 2, 99)] == [(45, 55), (0, 10), (90, 100)]
