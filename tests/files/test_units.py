"""Units that people write, and input that looks like a number with a unit and is none."""

import math
import re
from functools import partial

import pytest

from buckler.mbs import Drive, Section, Spring, Torque
from buckler.mbs.units import is_measured, measured, parse_quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("5 Nm", "N m", 5.0), ("7 Nmm", "N m", 7e-3), ("2 kNm", "N m", 2e3), ("3 Nm/rad", "N m/rad", 3.0),
        ("4 Ns/m", "N s/m", 4.0), ("1.5 t", "kg", 1500.0),
        ("3 in", "m", 0.0762), ("12 in", "ft", 1.0), ("2 ft", "m", 0.6096), ("10 lb", "kg", 4.5359237),
        ("1 lbf", "N", 0.45359237 * 9.80665), ("4 lbf.in", "N m", 4 * 0.45359237 * 9.80665 * 0.0254),
        ("2 lbf/in", "N/m", 2 * 0.45359237 * 9.80665 / 0.0254), ("2 bar", "Pa", 2e5), ("500 mbar", "Pa", 5e4),
        ("36 km/h", "m/s", 10.0), ("7.85 t/m^3", "kg/m^3", 7850.0), ("7.85 g/cm^3", "kg/m^3", 7850.0),
        ("0.3mm", "m", 3e-4), ("300 µm", "m", 3e-4), ("-2.5cm", "m", -0.025), (".5e1 mm", "m", 5e-3), ("3cm", "mm", 30.0),
        ("12rpm", "rad/s", 12 * math.pi / 30), ("300r/min", "rad/s", 10 * math.pi), ("180deg", "rad", math.pi),
        ("300g", "kg", 0.3), ("68kN/m", "N/m", 68e3), ("2min", "s", 120.0), ("210GPa", "Pa", 210e9), ("2500mV", "V", 2.5),
        ("253 N s/mm", "N.s/m", 253e3), ("2.53e5 N/mm^1.5", "N/m^1.5", 2.53e5 * 1e3**1.5), ("80%", "1", 0.8),
    ],
)  # fmt: skip
def test_units_that_people_write(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value, rel=4e-16, abs=0)
    assert is_measured(text)


@pytest.mark.parametrize(
    ("text", "unit", "reason"),
    [
        ("5kg", "m", "'kg' is no unit for a quantity in m"), ("20Hz", "rad/s", "'Hz' is no unit"),
        ("1m", "1", "no unit for a quantity in plain numbers"), ("5furlong", "m", "unknown unit 'furlong'"),
        ("5m)", "m", "unknown unit"), ("thin", "m", "not a number"),
    ],
)  # fmt: skip
def test_wrong_quantities_say_why(text, unit, reason):
    with pytest.raises(ValueError, match=re.escape(reason)):
        parse_quantity(text, unit)


@pytest.mark.parametrize(
    ("text", "point"), [("0,3 mm", "0.3"), ("-2,75", "-2.75"), ("1,5e-3 kg", "1.5e-3"), ("12,0 rpm", "12.0")]
)
def test_a_decimal_comma_is_refused_in_words(text, point):
    parse = partial(parse_quantity, unit="m")
    for read in (measured, parse, lambda text: Section(text, "1 mm"), lambda text: Drive("crank", text)):
        with pytest.raises(ValueError, match=re.escape(f"a number with a comma; write {point}, with a point")):
            read(text)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Drive("crank", "6.28*x"), "'6.28*x': there is no x; known: t"),
        (lambda: Torque("crank", "0.1*v"), "'0.1*v': there is no v; known: t, angle, speed"),
        (lambda: Spring("A", "B", 0, law="3*t"), "'3*t': there is no t; known: x, v"),
    ],
)
def test_a_formula_of_other_variables_is_refused(make, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        make()
