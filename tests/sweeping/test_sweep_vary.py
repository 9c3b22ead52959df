"""From words to cases: grids, lists, and every way to get them wrong."""

import math

import pytest
from sweep_toy import Parameters

from buckler.mbs.declare import declarations
from buckler.studies.kit.running import CaseMaker
from buckler.studies.sweeping.table import MOST_CASES, make_cases, parse

KNOWN = declarations(Parameters)


def cases(*texts, given=None):
    return make_cases(CaseMaker(Parameters, KNOWN, given or {}), [parse(text, KNOWN) for text in texts])


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("length=0.1mm:0.5mm:5", (1e-4, 2e-4, 3e-4, 4e-4, 5e-4)), ("length=1mm,2.5cm,3", (1e-3, 2.5e-2, 3)),
        ("length=1e-5:1e-3:5:log", (1e-5, 10**-4.5, 1e-4, 10**-3.5, 1e-3)), ("order=4:16:4", (4, 8, 12, 16)),
        ("speed=-12rpm:12rpm:3", (-12 * math.pi / 30, 0, 12 * math.pi / 30)), ("models=beam,strut", ("beam", "strut")),
    ],
)  # fmt: skip
def test_values_of_a_grid(text, values):
    grid = parse(text, KNOWN)
    assert grid.values == pytest.approx(values, rel=1e-11) if not isinstance(values[0], str) else grid.values == values
    assert {type(value) for value in grid.values} == {type(grid.values[0])}


def test_values_are_shown_in_the_unit_in_which_they_were_written():
    length, speed, plain = (parse(text, KNOWN) for text in ("length=0.1mm:0.3mm:3", "speed=12rpm,24rpm", "speed=1,2"))
    assert ([length.show(value) for value in length.values], length.unit) == ([0.1, 0.2, 0.3], "mm")
    assert ([speed.show(value) for value in speed.values], speed.unit) == ([12.0, 24.0], "rpm")
    assert (plain.show(1.0), plain.unit) == (1.0, "rad/s")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lenght=1:2:3", "unknown parameter 'lenght'; did you mean length?"),
        ("length", "no values; write length=START:STOP:COUNT"),
        ("length=1:2", "no count; write START:STOP:COUNT"),
        ("length=1:2:1", "'1' is no count"),
        ("length=1kg:2:3", "length = 1kg: must be in m"),
        ("length=1:20:3", "length = 20.0 m: must lie in [0, 10] m"),
        ("speed=-1:1:3:log", "log needs start and stop above 0"),
        ("order=1:4:3", "gives 2.5, which is not a whole number; choose another count or list them"),
        ("models=strut,bean", "models[0] = 'bean': must be one of 'strut', 'beam', 'cable'"),
        ("models=strut:beam:2", "words have no range; write models=strut,beam"),
        ("length=1,1000mm", "one of them given twice"),
    ],
)
def test_wrong_words_are_named_in_one_line(text, message):
    with pytest.raises(ValueError) as error:
        parse(text, KNOWN)
    assert str(error.value).startswith(f"--vary {text}: {message}")
    assert "\n" not in str(error.value)


def test_grids_combine_each_with_each_in_the_order_given():
    found = cases("models=strut,beam", "length=1,2,3", given={"noise": "2N"})
    assert [(c.models, c.length) for c in found] == [((m,), length) for m in ("strut", "beam") for length in (1, 2, 3)]
    assert {case.noise for case in found} == {2}


@pytest.mark.parametrize(
    ("texts", "given", "message"),
    [
        (["length=1,2", "length=3,4"], {}, "--vary length: given twice"),
        (["length=1,2"], {"length": 1}, "--vary length: also given as --length"),
        (["order=12,13", "speed=4,6"], {}, "order = 13, speed = 6 rad/s: order = 13: not with a speed above 5 rad/s"),
        (["length=1:2:1001", "speed=1:2:1001"], {}, f"1002001 cases; allowed: up to {MOST_CASES}"),
    ],
)
def test_wrong_plans_are_named_in_one_line(texts, given, message):
    with pytest.raises(ValueError) as error:
        cases(*texts, given=given)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)
