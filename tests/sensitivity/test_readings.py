"""Readings of signals: what they give, in which unit, and what is none."""

from math import pi

import numpy as np
import pytest

from buckler.mbs.sensitivity.curve import Curve, Smooth
from buckler.mbs.sensitivity.reading import check_reading, read_number


def test_smooth_readings_of_a_sine():
    time = np.sort(np.r_[np.linspace(0, 3, 61), 0.511, 1.733])
    signals = {"A.x": np.sin(2 * time)}

    def read(text, curve=Smooth):
        return read_number(text, time, signals, {"A.x": "m"}, curve)

    assert read("max(A.x)").value == pytest.approx(1.0, abs=1e-6)
    assert read("max(A.x)", Curve).value < 1 - 1e-6
    assert read("impulse(A.x)").value == pytest.approx((1 - np.cos(6)) / 2, abs=1e-5)
    assert read("impulse(A.x)").unit == "m s" and read("when(A.x, 0.5, 2)").unit == "s"
    assert read("when(A.x, 0.5, 2)").value == pytest.approx((pi - pi / 6) / 2, abs=1e-5)
    assert np.isnan(read("when(A.x, 2, 1)").value)
    assert read("settled(A.x)").value == pytest.approx((np.cos(5.4) - np.cos(6)) / 0.6, abs=1e-5)


def test_readings_of_a_contact():
    """Pushes of a force: half sines of 3 and 5 N from 1 to 2 s and from 4 to 4.5 s."""
    time = np.linspace(0, 6, 601)
    push = np.where((time > 1) & (time < 2), 3 * np.sin(pi * (time - 1)), 0.0)
    push += np.where((time > 4) & (time < 4.5), 5 * np.sin(2 * pi * (time - 4)), 0.0)
    signals, units = {"B.push": push, "B.way": 2 * time}, {"B.push": "N", "B.way": "m"}
    for text, value, unit in (
        ("begins(B.push, 1)", 1.0, "s"), ("ends(B.push, 1)", 2.0, "s"), ("peak(B.push, 1)", 3.0, "N"),
        ("begins(B.push, -1)", 4.0, "s"), ("ends(B.push, 2)", 4.5, "s"), ("peak(B.push, -1)", 5.0, "N"),
        ("at(B.way, ends(B.push, -1)) - at(B.way, begins(B.push, 1))", 7.0, "m"),
    ):  # fmt: skip
        found = read_number(text, time, signals, units, Smooth)
        assert found.value == pytest.approx(value, rel=1e-4) and found.unit == unit, text
    assert np.isnan(read_number("peak(B.push, 3)", time, signals, units, Smooth).value)


def test_a_spell_begins_and_ends_between_samples():
    """Where a curve crosses zero; where it rests at zero outside; at the sample where one stands before and after an event."""
    time = np.linspace(0.0, 3.0, 61) + 0.013
    arc = 1 - (time - 1.5) ** 2
    cut = np.sort(np.r_[time, 0.5, 0.5 + 1e-13, 2.5, 2.5 + 1e-13])
    jump = np.where((cut > 0.5) & (cut <= 2.5), 3.0, 0.0)
    for t, x in ((time, arc), (time, np.maximum(arc, 0.0)), (cut, jump)):
        curve = Smooth(t, x)
        assert curve.begins(1) == pytest.approx(0.5, abs=1e-6) and curve.ends(-1) == pytest.approx(2.5, abs=1e-6)


TIME = np.array([0.0, 1.0, 3.0])
SIGNALS = {"B.x": np.array([0.0, 2.0, 2.0]), "A.crank-coupler.fx": np.array([1.0, -5.0, 2.0]), "B.vx": np.ones(3)}
UNITS = {"B.x": "m", "A.crank-coupler.fx": "N", "B.vx": "m/s"}


@pytest.mark.parametrize(
    ("text", "value", "unit"),
    [
        ("max(B.x)", 2, "m"), ("mean(B.x)", 5 / 3, "m"), ("rms(B.x)", (10 / 3) ** 0.5, "m"), ("at(B.x, 0.5)", 1, "m"),
        ("max(abs(A.crank-coupler.fx))", 5, "N"), ("end(B.x)-start(B.x)", 2, "m"), ("2*max(B.x)/max(B.x)", 2, "1"),
        ("max(B.x)*max(B.vx)", 2, ""), ("max(B.x-B.x)", 0, "m"), ("-min(A.crank-coupler.fx)", 5, "N"),
        ("max(B.x) + max(B.vx)", 3, ""),
    ],
)  # fmt: skip
def test_measures(text, value, unit):
    found = read_number(text, TIME, SIGNALS, UNITS)
    assert (found.value, found.unit) == (pytest.approx(value), unit)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("max(B.y)", "max(B.y): no signal 'B.y'; near it: B.x"),
        ("B.x", "B.x: gives a series; write max(B.x), mean(B.x) or end(B.x)"),
        ("mx(B.x)", "mx(B.x): unknown function 'mx', did you mean 'max'?"),
        ("max(B.x", "max(B.x: '"),
        ("__import__('os')", "__import__('os'): unknown function '__import__'"),
        ("max(B.x).real", "max(B.x).real: "),
    ],
)
def test_what_is_no_measure(text, message):
    with pytest.raises(ValueError) as error:
        read_number(text, TIME, SIGNALS, UNITS)
    assert str(error.value).startswith(message)


def test_a_measure_is_checked_before_signals_are_known():
    check_reading("max(B.contact_force)/mean(abs(drive.torque))")
    with pytest.raises(ValueError, match="unknown function 'maxx'"):
        check_reading("maxx(B.contact_force)")
