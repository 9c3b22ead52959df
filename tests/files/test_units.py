"""Units that people write, and input that looks like a number with a unit and is none."""

import re
from dataclasses import replace
from math import pi

import pytest

from buckler.mbs import Closure, Drive, Link, Mechanism, Revolute, Rigid, Section, Spring, Torque, simulate
from buckler.mbs.scene.scene import Scene
from buckler.mbs.units import is_measured, measured, parse_quantity

BAR = Rigid(Section(0.02, 0.005))


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


def test_old_units_mean_what_they_meant():
    """A minute is no milli-inch, a milli-tonne no unit, and a product with t is a formula of time."""
    assert measured("2 min") == 120.0 and measured("3 mm") == 3e-3 and measured("1 ms") == 1e-3
    for wrong in ("1 mt", "1 kin", "2 ulb", "3 mh", "1 klbf"):
        with pytest.raises(ValueError, match="unknown unit"):
            measured(wrong)
    assert not is_measured("6.28*t") and Drive("crank", "6.28*t").speed.speed(2.0) == 12.56


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


def test_a_comma_in_a_formula_is_named():
    with pytest.raises(ValueError, match=r"'\(2, 5 \* t\)' is not allowed in a formula; decimals are written with a point"):
        Drive("crank", "2,5*t")
    assert Drive("crank", "max(2, 5*t)").speed.speed(1.0) == 5.0


@pytest.mark.parametrize("angle", [60, -90.0, 7])
def test_an_angle_beyond_a_turn_is_no_radian(angle):
    with pytest.raises(
        ValueError, match=rf"angle = {angle} rad: must lie in .*; a number without a unit is in rad; write degrees as '60 deg'"
    ):
        Link("crank", "O", "A", BAR, angle=angle)
    assert Link("crank", "O", "A", BAR, angle="-90 deg").angle == pytest.approx(-pi / 2)


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


def four_bar(*drives):
    return Mechanism(
        points={"A": (0, 0), "B": (0.1, 0.02), "C": (0.4, 0.2), "D": (0.3, 0)},
        links=[Link("crank", "A", "B", BAR), Link("coupler", "B", "C", BAR), Link("rocker", "D", "C", BAR)],
        joints=[
            Revolute("A", "ground", "crank"),
            Revolute("B", "crank", "coupler"),
            Revolute("C", "coupler", "rocker"),
            Revolute("D", "ground", "rocker"),
        ],
        drives=list(drives),
    )


def test_two_drives_on_one_way_to_move_are_named():
    said = r"2 drives \('drive', 'drive.2'\) for a mobility of 1: leave 1 out, or their motions must agree"
    with pytest.raises(ValueError, match=said):
        simulate(four_bar(Drive("crank", 1.0), Drive("rocker", 1.0)), 0.1, solver=Closure())
    assert any(re.search(said, note) for note in Scene.of(four_bar(Drive("crank", 1.0), Drive("rocker", 1.0))).remarks)
    assert not any("mobility" in note for note in Scene.of(four_bar(Drive("crank", 1.0))).remarks)
    open_chain = replace(
        four_bar(Drive("crank", 1.0), Drive("rocker", 1.0)), joints=four_bar().joints[:2] + four_bar().joints[3:]
    )
    assert not any("drives (" in note for note in Scene.of(open_chain).remarks)
