"""Units that people write, and input that looks like a number with a unit and is none."""

import re

import pytest

from buckler.mbs import Drive, Section, Spring, Torque
from buckler.mbs.units import is_measured, measured, parse_quantity


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("5 Nm", "N m", 5.0), ("7 Nmm", "N m", 7e-3), ("2 kNm", "N m", 2e3), ("3 Nm/rad", "N m/rad", 3.0),
        ("1.5 t", "kg", 1500.0),
        ("3 in", "m", 0.0762), ("12 in", "ft", 1.0), ("2 ft", "m", 0.6096), ("10 lb", "kg", 4.5359237),
        ("1 lbf", "N", 0.45359237 * 9.80665), ("4 lbf.in", "N m", 4 * 0.45359237 * 9.80665 * 0.0254),
        ("2 lbf/in", "N/m", 2 * 0.45359237 * 9.80665 / 0.0254), ("2 bar", "Pa", 2e5), ("500 mbar", "Pa", 5e4),
        ("36 km/h", "m/s", 10.0), ("7.85 t/m^3", "kg/m^3", 7850.0),
    ],
)  # fmt: skip
def test_units_that_people_write(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value, rel=1e-15)
    assert is_measured(text)


@pytest.mark.parametrize(
    ("text", "point"), [("0,3 mm", "0.3"), ("-2,75", "-2.75"), ("1,5e-3 kg", "1.5e-3"), ("12,0 rpm", "12.0")]
)
def test_a_decimal_comma_is_refused_in_words(text, point):
    for read in (
        measured,
        lambda text: parse_quantity(text, "m"),
        lambda text: Section(text, "1 mm"),
        lambda text: Drive("crank", text),
    ):
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
