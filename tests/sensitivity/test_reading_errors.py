"""What errors of signals leave in a measure, against runs of the compiled solver at a tolerance of 1e-11."""

import numpy as np
import pytest
from simulations import BAR, pendulum

from buckler.mbs import Controlled, Exudyn, Spectral, simulate, slider_crank
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.sensitivity.reading import read_number
from buckler.mbs.sensitivity.reading_errors import bound_error

CASES = {
    "pendulum": (pendulum(2.0), ["max(A.x)", "min(A.y)", "mean(A.y)", "rms(A.x)", "at(A.x, 1.3)", "when(A.x, 0, 2)",
                                 "settled(A.x)", "2 * end(A.x) - 3 * start(A.y)", "max(A.x) / max(abs(A.y))",
                                 "end(A.vy)", "max(A.vx)", "min(A.vx)", "at(A.vy, 1.3)"]),
    "stop": (slider_crank(BAR, law=KelvinVoigt(1e4, 3.0), mass=0.3, speed=1.0),
             ["max(B.contact_force)", "peak(B.contact_force, 1)", "impulse(B.contact_force)", "begins(B.contact_force, 1)",
              "ends(B.contact_force, 1)", "mean(B.contact_force)"]),
}  # fmt: skip


@pytest.fixture(scope="module")
def runs():
    fine = Spectral(Controlled(tolerance=1e-11))
    return {
        name: (simulate(made, 4.0, 1e-3, of=of, solver=Exudyn()), simulate(made, 4.0, solver=fine))
        for (name, (made, _)), of in zip(CASES.items(), ("places", "forces"), strict=True)
    }


def read(text, pair):
    return [read_number(text, each.time, each.signals, each.units).value for each in pair]


@pytest.mark.parametrize(("name", "text"), [(name, text) for name, (_, texts) in CASES.items() for text in texts])
def test_a_measure_is_no_more_off_than_is_told(runs, name, text):
    found, right = read(text, runs[name])
    assert abs(found - right) <= bound_error(text, runs[name][0]) < 0.05 * max(abs(right), 0.1)


def test_a_fifth_of_the_told_errors_would_not_do(runs):
    shares = [
        abs(np.subtract(*read(text, runs[name]))) / bound_error(text, runs[name][0])
        for name, (_, all_) in CASES.items()
        for text in all_
    ]
    assert max(shares) > 0.2


def test_without_an_estimate_nothing_is_told(runs):
    assert np.isnan(bound_error("max(A.x)", runs["pendulum"][1]))
