"""Parameters of a study: quantities with units, ranges, and what is said of wrong ones."""

import math
import re

import numpy as np
import pytest
from made_up_study import Parameters

from buckler.mbs.units import parse_quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.3mm", "m", 3e-4),
        ("300 µm", "m", 3e-4),
        ("-2.5cm", "m", -0.025),
        (".5e1 mm", "m", 5e-3),
        ("12rpm", "rad/s", 12 * math.pi / 30),
        ("300r/min", "rad/s", 10 * math.pi),
        ("1.25rad/s", "rad/s", 1.25),
        ("180deg", "rad", math.pi),
        ("300g", "kg", 0.3),
        ("68kN/m", "N/m", 68e3),
        ("2min", "s", 120),
        ("210GPa", "Pa", 210e9),
        ("253 N s/mm", "N.s/m", 253e3),
        ("2.53e5 N/mm^1.5", "N/m^1.5", 2.53e5 * 1e3**1.5),
        ("7.85 g/cm^3", "kg/m^3", 7850),
        ("2500mV", "V", 2.5),
        ("80%", "1", 0.8),
        ("3cm", "mm", 30),
    ],
)
def test_quantities_with_units(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value, rel=4e-16, abs=0)


@pytest.mark.parametrize(
    ("text", "unit", "reason"),
    [
        ("5kg", "m", "'kg' is no unit for a quantity in m"),
        ("20Hz", "rad/s", "'Hz' is no unit"),
        ("1m", "1", "no unit for a quantity in plain numbers"),
        ("5furlong", "m", "unknown unit 'furlong'"),
        ("5m)", "m", "unknown unit"),
        ("thin", "m", "not a number"),
        ("1,5mm", "m", "a number with a comma; write 1.5"),
    ],
)
def test_wrong_quantities_say_why(text, unit, reason):
    with pytest.raises(ValueError, match=re.escape(reason)):
        parse_quantity(text, unit)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"thickness": "2cm"}, "thickness = 2cm: must lie in [1e-05, 0.01] m"),
        ({"thickness": "3kg"}, "thickness = 3kg: must be in m"),
        ({"thickness": math.nan}, "thickness = nan m: must lie in [1e-05, 0.01] m"),
        ({"thickness": True}, "thickness = true: must be a number, or one with a unit"),
        ({"speed": "1e999"}, "speed = inf rad/s: must lie in [-100, 100] rad/s"),
        ({"elements": 8.5}, "elements = 8.5: must be a whole number in [1, 64]"),
        ({"models": "strut,shell"}, "models[1] = 'shell': must be one of 'stitched', "),
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
