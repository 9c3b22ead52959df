"""From words to cases: grids, lists, samples, repeats, and every way to get them wrong."""

import math
from collections import Counter

import numpy as np
import pytest
from scipy.stats import kstest
from sweep_toy import Parameters

from buckler.studies.sweeping.vary import METHODS, MOST, Axis, Samples, parse, plan


def words(*texts):
    return [parse(text, Parameters) for text in texts]


def cases(*texts, given=None, **options):
    return plan(Parameters, given or {}, words(*texts), **options).cases


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("length=0.1mm:0.5mm:5", (1e-4, 2e-4, 3e-4, 4e-4, 5e-4)),
        ("length=0.5:0.1:3", (0.5, 0.3, 0.1)),
        ("length=1e-5:1e-3:5:log", (1e-5, 10**-4.5, 1e-4, 10**-3.5, 1e-3)),
        ("speed=-12rpm:12rpm:3", (-12 * math.pi / 30, 0, 12 * math.pi / 30)),
        ("length=1mm,2.5cm,3", (1e-3, 2.5e-2, 3)),
        ("order=4:16:4", (4, 8, 12, 16)),
        ("order=1:64:7:log", (1, 2, 4, 8, 16, 32, 64)),
        ("models=beam,strut", ("beam", "strut")),
        ("ending=fine", ("fine",)),
    ],
)
def test_values_of_a_grid(text, values):
    grid = parse(text, Parameters)
    assert not grid.sampled
    assert grid.values == pytest.approx(values, rel=1e-11) if not isinstance(values[0], str) else grid.values == values
    assert {type(value) for value in grid.values} == {type(grid.values[0])}


def test_values_between_the_ends_carry_no_rounding_error():
    assert parse("length=0.1mm:0.5mm:9", Parameters).values[1] == 1.5e-4 != np.linspace(1e-4, 5e-4, 9)[1]


def test_range_without_a_count_is_sampled():
    assert parse("length=1mm:2mm", Parameters) == Axis("length", (1e-3, 2e-3), sampled=True)
    assert parse("length=1mm:2mm:log", Parameters) == Axis("length", (1e-3, 2e-3), log=True, sampled=True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lenght=1:2:3", "unknown parameter 'lenght'; did you mean length?"),
        ("length", "no values; write length=START:STOP:COUNT"),
        ("length=1:2:x", "'x' is no count; allowed: 2 to 1000000"),
        ("length=1:2:1", "'1' is no count"),
        ("length=1:2:3:4:log", "'3:4' is no count"),
        ("length=1kg:2:3", "length = 1kg: must be in m"),
        ("length=1:20:3", "length = 20.0 m: must lie in [0, 10] m"),
        ("length=1:1:3", "start and stop are the same"),
        ("speed=-1:1:3:log", "log needs start and stop above 0"),
        ("order=1:4:3", "gives 2.5, which is not a whole number; choose another count or list them"),
        ("order=1.5,2", "order = '1.5': must be a whole number in [0, 100]"),
        ("models=strut,bean", "models[0] = 'bean': must be one of 'strut', 'beam', 'cable'"),
        ("models=strut:beam:2", "words have no range; write models=strut,beam"),
        ("length=1,1000mm", "one of them given twice"),
    ],
)
def test_wrong_words_are_named_in_one_line(text, message):
    with pytest.raises(ValueError) as error:
        parse(text, Parameters)
    assert str(error.value).startswith(f"--vary {text}: {message}")
    assert "\n" not in str(error.value)


def test_grids_combine_each_with_each_in_the_order_given():
    found = plan(Parameters, {"noise": "2N"}, words("models=strut,beam", "length=1,2,3"), repeats=2)
    assert [(c.models, c.length, c.seed) for c in found.cases] == [
        ((model,), length, seed) for model in ("strut", "beam") for length in (1, 2, 3) for seed in (0, 1)
    ]
    assert {case.noise for case in found.cases} == {2}
    assert (found.names, found.repeats) == (("models", "length"), 2)


def test_repeats_count_on_from_the_given_seed():
    assert [case.seed for case in cases("length=1,2", given={"seed": 7}, repeats=3)] == [7, 8, 9, 7, 8, 9]


@pytest.mark.parametrize("method", METHODS)
def test_samples_fill_the_range_evenly(method):
    """A thousand plain random numbers would have a Kolmogorov distance near 0.03; these are spread on purpose."""
    found = cases("length=2:4", "speed=1e-2:100:log", samples=Samples(1024, method))
    length, speed = np.array([(case.length, case.speed) for case in found]).T
    assert kstest((length - 2) / 2, "uniform").statistic < 5e-3
    assert kstest((np.log10(speed) + 2) / 4, "uniform").statistic < 5e-3
    assert abs(np.corrcoef(length, np.log(speed))[0, 1]) < 0.05
    # the mean of a sum over both, far better than the 1 % of plain sampling
    assert np.mean(length + np.log10(speed) + 2) == pytest.approx(3 + 2, rel=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_samples_are_the_same_each_time_and_others_for_another_draw(method):
    first, again, other = (cases("length=2:4", samples=Samples(16, method, draw)) for draw in (0, 0, 1))
    assert first == again
    assert not {case.length for case in first} & {case.length for case in other}


@pytest.mark.parametrize("method", ["sobol", "halton"])
def test_more_samples_include_the_fewer(method):
    few, many = (cases("length=2:4", "speed=0:1", samples=Samples(n, method)) for n in (10, 25))
    assert many[:10] == few


def test_whole_numbers_have_equal_shares():
    shares = Counter(case.order for case in cases("order=3:6", "length=0:1", samples=Samples(1024)))
    assert shares == {3: 256, 4: 256, 5: 256, 6: 256}


def test_words_and_grids_combine_with_every_sample():
    found = cases("models=strut,beam", "length=0:1", samples=Samples(8))
    assert [case.length for case in found[:8]] == [case.length for case in found[8:]]
    assert [case.models for case in found] == [("strut",)] * 8 + [("beam",)] * 8


@pytest.mark.parametrize(
    ("texts", "options", "message"),
    [
        (["length=1,2", "length=3,4"], {}, "--vary length: given twice"),
        (["length=1,2"], {"given": {"length": 1}}, "--vary length: also given as --length"),
        (["length=1:2"], {}, "--vary length: no count; write START:STOP:COUNT, or give --samples"),
        (["length=1:2:3"], {"samples": Samples(8)}, "--samples 8: nothing to sample"),
        (["length=1:2"], {"samples": Samples(0)}, "--samples 0: out of range"),
        (["seed=1,2"], {"repeats": 2}, "--repeat 2: the seed is also varied"),
        (["length=1,2"], {"repeats": 0}, "--repeat 0: out of range"),
        (["order=12,13", "speed=4,6"], {}, "order = 13, speed = 6 rad/s: order = 13: not with a speed above 5 rad/s"),
        (["length=1:2:1001", "speed=1:2:1001"], {}, f"1002001 cases; allowed: up to {MOST}"),
    ],
)
def test_wrong_plans_are_named_in_one_line(texts, options, message):
    with pytest.raises(ValueError) as error:
        cases(*texts, **options)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_repeats_need_a_seed():
    from buckler.studies.strips.elastica_law import Parameters as seedless

    with pytest.raises(ValueError, match="--repeat 2: this study has no parameter seed"):
        plan(seedless, {}, [], repeats=2)
