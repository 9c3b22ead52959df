"""The study of accuracy: each scene's reference is right, what is silent is found out, and it is drawn."""

from dataclasses import replace

import numpy as np
import pytest

from buckler.mbs import simulate
from buckler.studies.trust import accuracy
from buckler.studies.trust.accuracy import SCENES, Parameters, Scene, case, run


@pytest.fixture(scope="module")
def short():
    return run(Parameters(scenes=("rigid", "strut"), cases=1))


def test_what_is_asked_is_delivered(short):
    assert short.status == "OK", short.message
    assert short.metrics["cases"].value == 4 and short.metrics["within"].value == 1 and short.metrics["silent"].value == 0
    assert 0 < short.metrics["strut.worst_ratio"].value <= 1


def test_it_is_drawn(short):
    assert len(accuracy.figure(short).axes) == 1


def off_by(factor):
    """A scene that errs by so many times what was asked."""
    return Scene(("any struck",), right=lambda made, asked, aim: lambda result: factor * asked)


@pytest.mark.parametrize(("factor", "silent", "within"), [(0.9, 0, 1.0), (2.0, 0, 0.0), (4.0, 1, 0.0)])
def test_what_is_silently_wrong_is_found_out(monkeypatch, factor, silent, within):
    monkeypatch.setitem(SCENES, "rigid", off_by(factor))
    result = run(Parameters(scenes=("rigid",), accuracies=(1e-2,), cases=1))
    assert (result.metrics["silent"].value, result.metrics["within"].value) == (silent, within)
    assert (result.status == "OK") == (within == 1) and ("not told" in result.message) == bool(silent)


def test_a_mechanism_of_the_whole_grammar_is_held_against_what_two_finer_runs_agree_in():
    made = case("grammar", 5, 0, 1e-4)
    mistaken = replace(made.mechanism, gravity=tuple(1.01 * g for g in made.mechanism.gravity))
    found, off = (made.error(simulate(each, made.duration, 1e-4)) for each in (made.mechanism, mistaken))
    assert found < 1e-4 < 10 * found + 1e-3 < off


def test_a_mechanism_without_a_reference_is_left_out(monkeypatch):
    monkeypatch.setitem(SCENES, "rigid", off_by(float("nan")))
    result = run(Parameters(scenes=("rigid", "strut"), cases=1))
    assert result.metrics["cases"].value == 2 and result.status == "OK" and np.isnan(result.metrics["rigid.within"].value)
    assert run(Parameters(scenes=("rigid",), cases=1)).status == "SUSPECT"
