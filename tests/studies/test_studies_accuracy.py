"""The study of accuracy: each scene's reference is right, what is silent is found out, and it is drawn."""

from dataclasses import replace

import numpy as np
import pytest

from buckler.studies.trust import accuracy
from buckler.studies.trust.accuracy import Parameters, run
from buckler.studies.trust.accuracy_truth import SCENES, Scene, Truth, two_runs


@pytest.fixture(scope="module")
def short():
    return run(Parameters(scenes=("rigid", "strut"), cases=1))


def test_what_is_asked_is_delivered(short):
    assert short.status == "OK", short.message
    assert short.metrics["cases"].value == 4 and short.metrics["within"].value == 1 and short.metrics["silent"].value == 0
    assert 0 < short.metrics["strut.worst_ratio"].value <= 1 and len(accuracy.figure(short).axes) == 1


def off_by(factor):
    """A scene whose truth lies so many times what was asked from any run."""

    def right(made, asked, _solver):
        truth = two_runs(made, asked, "compiled")
        moved = {
            name: signal._replace(values=signal.values + factor * asked * truth.functions.scales[name][0])
            for name, signal in truth.functions.signals.items()
        }
        return Truth(replace(truth.functions, signals=moved), {})

    return Scene(("rigid",), right=right)


@pytest.mark.parametrize(("factor", "silent", "within"), [(0.9, 0, 1.0), (2.0, 0, 0.0), (4.0, 1, 0.0)])
def test_what_is_silently_wrong_is_found_out(monkeypatch, factor, silent, within):
    monkeypatch.setitem(SCENES, "rigid", off_by(factor))
    result = run(Parameters(scenes=("rigid",), accuracies=(1e-2,), cases=1))
    assert (result.metrics["silent"].value, result.metrics["within"].value) == (silent, within)
    assert (result.status == "OK") == (within == 1) and ("not told" in result.message) == bool(silent)
    assert result.metrics["effectivity.low"].value == pytest.approx(1.0, abs=0.3)


def test_told_over_true_errors_and_the_price():
    result = run(Parameters(scenes=("grammar",), accuracies=(1e-3,), cases=1, seed=3, price="priced"))
    assert 0.5 < result.metrics["effectivity.p5"].value <= result.metrics["effectivity.p95"].value
    assert result.metrics["effectivity.low"].value == 0
    assert result.metrics["price.median"].value > 0.5


def test_a_mechanism_without_a_reference_is_left_out(monkeypatch):
    monkeypatch.setitem(SCENES, "rigid", Scene(("rigid",), right=lambda *_: None))
    result = run(Parameters(scenes=("rigid", "strut"), cases=1))
    assert result.metrics["cases"].value == 2 and result.status == "OK" and np.isnan(result.metrics["rigid.within"].value)
    assert run(Parameters(scenes=("rigid",), cases=1)).status == "SUSPECT"
