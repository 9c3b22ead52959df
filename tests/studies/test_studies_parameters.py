"""Parameters of a study: quantities with units, ranges, and what is said of wrong ones."""

import math
import re
from dataclasses import dataclass

import numpy as np
import pytest
from made_up_study import Parameters

from buckler.mbs.units import parse_quantity
from buckler.studies.kit.parameters import StudyParameters, quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.3mm", "m", 3e-4),
        ("3e-4", "m", 3e-4),
        ("0.3e-3m", "m", 3e-4),
        ("300um", "m", 3e-4),
        ("300 µm", "m", 3e-4),
        ("-2.5cm", "m", -0.025),
        (".5e1 mm", "m", 5e-3),
        ("12rpm", "rad/s", 12 * math.pi / 30),
        ("300r/min", "rad/s", 10 * math.pi),
        ("1.25rad/s", "rad/s", 1.25),
        ("180deg", "rad", math.pi),
        ("180°", "rad", math.pi),
        ("300g", "kg", 0.3),
        ("68kN/m", "N/m", 68e3),
        ("68N/mm", "N/m", 68e3),
        ("5ms", "s", 5e-3),
        ("2min", "s", 120),
        ("210GPa", "Pa", 210e9),
        ("253 N.s/m", "N.s/m", 253),
        ("253N·s/mm", "N.s/m", 253e3),
        ("253 N s/mm", "N.s/m", 253e3),
        ("2.53e5 N/mm^1.5", "N/m^1.5", 2.53e5 * 1e3**1.5),
        ("14.175 N.mm²", "N.m^2", 14.175e-6),
        ("7.85 g/cm^3", "kg/m^3", 7850),
        ("2500mV", "V", 2.5),
        ("80%", "1", 0.8),
        ("7Hz", "1/s", 7),
        ("3", "mm", 3),
        ("3cm", "mm", 30),
    ],
)
def test_quantities_with_units(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value, rel=4e-16, abs=0)


@pytest.mark.parametrize("text", ["300um", "0.3mm", "0.03cm", "3e2um", "0.3e-3m"])
def test_decimal_prefixes_are_exact(text):
    assert parse_quantity(text, "m") == 3e-4


@pytest.mark.parametrize(
    ("text", "unit", "reason"),
    [
        ("5kg", "m", "'kg' is no unit for a quantity in m"),
        ("20Hz", "rad/s", "'Hz' is no unit"),
        ("5N/m", "N.s/m", "'N/m' is no unit"),
        ("1m", "1", "no unit for a quantity in plain numbers"),
        ("5furlong", "m", "unknown unit 'furlong'"),
        ("5mdeg", "rad", "unknown unit 'mdeg'"),
        ("5m/", "m", "unknown unit 'm/'"),
        ("5m)", "m", "unknown unit"),
        ("thin", "m", "not a number"),
        ("", "m", "not a number"),
        ("nan", "m", "not a number"),
        ("1,5mm", "m", "a number with a comma; write 1.5"),
    ],
)
def test_wrong_quantities_say_why(text, unit, reason):
    with pytest.raises(ValueError, match=re.escape(reason)):
        parse_quantity(text, unit)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"thickness": -1}, "thickness = -1 m: must lie in [1e-05, 0.01] m"),
        ({"thickness": "2cm"}, "thickness = 2cm: must lie in [1e-05, 0.01] m"),
        ({"thickness": "3kg"}, "thickness = 3kg: must be in m"),
        ({"thickness": math.nan}, "thickness = nan m: must lie in [1e-05, 0.01] m"),
        ({"thickness": True}, "thickness = true: must be a number, or one with a unit"),
        ({"thickness": None}, "thickness = None: must be a number, or one with a unit"),
        ({"restitution": 1.1}, "restitution = 1.1: must lie in [0, 1]"),
        ({"speed": "1e999"}, "speed = inf rad/s: must lie in [-100, 100] rad/s"),
        ({"elements": 8.5}, "elements = 8.5: must be a whole number in [1, 64]"),
        ({"elements": "8.0"}, "elements = '8.0': must be a whole number in [1, 64]"),
        ({"elements": 65}, "elements = 65: must be a whole number in [1, 64]"),
        ({"models": "strut,shell"}, "models[1] = 'shell': must be one of 'stitched', "),
        ({"models": ()}, "models = (): must be a list of at least 1, each one of 'stitched', 'strut', 'beam'"),
        ({"models": "beam,beam"}, "models = ('beam', 'beam'): must be given once each"),
        ({"ending": "sad"}, "ending = 'sad': must be one of 'fine', 'suspect', 'raises'"),
        ({"widths": (0.03, 5)}, "widths[1] = 5 m: must lie in [0.001, 1] m"),
        ({"elements": 13, "thickness": "2mm"}, "elements = 13: not with a thickness above 0.001 m"),
    ],
)
def test_wrong_parameters_name_value_range_and_unit(given, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        Parameters(**given)


def test_parameters_read_numbers_strings_and_arrays():
    made = Parameters(thickness="0.3mm", widths=np.array([0.01, 0.02]), elements=np.int64(4), models="beam, strut")
    assert (made.thickness, made.widths, made.elements) == (3e-4, (0.01, 0.02), 4)
    assert made.models == ("beam", "strut")
    assert made == Parameters(thickness=3e-4, widths="1cm,20mm", elements="4", models=["beam", "strut"])


def test_ranges_are_closed_and_what_is_not_finite_is_out():
    assert [Parameters(restitution=end).restitution for end in (0, 1)] == [0, 1]
    assert [Parameters(elements=end).elements for end in (1, 64)] == [1, 64]

    @dataclass(frozen=True)
    class Unbounded(StudyParameters):
        load: float = quantity(1, "N", 0, math.inf, "load")

    with pytest.raises(ValueError, match=r"load = inf N: must be finite"):
        Unbounded(load=math.inf)
