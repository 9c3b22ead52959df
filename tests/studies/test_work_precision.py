"""Error against run time: turns, medians, the front, the verdict and the rate, on runs whose time is made up."""

from itertools import count
from math import inf, isnan, nan
from types import SimpleNamespace

import numpy as np
import pytest

from buckler.studies.kit import work_precision as precision
from buckler.studies.kit.statistics import exponent
from buckler.studies.kit.work_precision import Point, fastest, time_for, verdict, work_precision


@pytest.fixture
def clock(monkeypatch):
    """A clock that runs only when told: `clock.spend(seconds)`."""
    made = SimpleNamespace(now=0.0)
    made.spend = lambda seconds: setattr(made, "now", made.now + seconds)
    monkeypatch.setattr(precision, "perf_counter", lambda: made.now)
    return made


def variant(clock, log, name, seconds, error, work=None):
    """A variant that takes these seconds, one after the other, and is this wrong."""
    times = iter(seconds)

    def run():
        log.append(name)
        clock.spend(next(times))
        return SimpleNamespace(error=error, work=work or {})

    return run


def measured(clock, repeats=3, **variants):
    log = []
    runs = {name: variant(clock, log, name, *made) for name, made in variants.items()}
    return log, work_precision(runs, lambda outcome: outcome.error, repeats)


def test_variants_take_turns(clock):
    log, _ = measured(clock, a=([1] * 3, 0.1), b=([1] * 3, 0.2), c=([1] * 3, 0.3))
    assert "".join(log) == "abcabcabc"


def test_points_hold_the_median_and_all_times_in_order(clock):
    _, (a, b) = measured(clock, a=([1, 9, 2], 0.1), b=([4, 4, 4], 0.2))
    assert a.walls == pytest.approx((1, 9, 2))
    assert (a.wall_s, b.wall_s) == (pytest.approx(2), pytest.approx(4))
    assert (a.name, a.error, b.error) == ("a", 0.1, 0.2)


def test_error_and_work_come_from_the_outcome_and_cost_no_time(clock):
    def slow_error(outcome):
        clock.spend(100)
        return outcome.error

    run = variant(clock, [], "a", [1, 1], 0.5, {"steps": 7.0})
    (point,) = work_precision({"a": run}, slow_error, 2)
    assert point.work == {"steps": 7.0}
    assert point.error == 0.5
    assert point.walls == pytest.approx((1, 1))


def test_first_outcome_gives_the_error():
    numbers = count(1)
    (point,) = work_precision({"a": lambda: next(numbers)}, float, 3)
    assert point.error == 1


def test_work_is_empty_where_the_outcome_has_none():
    (point,) = work_precision({"a": lambda: 3.0}, lambda outcome: abs(outcome - 3.5), 1)
    assert point.work == {}
    assert point.error == 0.5


def test_speedup_cancels_a_machine_that_slows_down(clock):
    drift = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    _, (a, b) = measured(clock, 5, a=(drift, 0.1), b=(3 * drift, 0.1))
    assert a.speedup(b) == pytest.approx(3)
    assert b.speedup(a) == pytest.approx(1 / 3)


def test_progress_sees_every_run(clock):
    seen = []

    def progress(names):
        seen.extend(names)
        return names

    run = {name: variant(clock, [], name, [1, 1], 0.1) for name in "ab"}
    work_precision(run, lambda outcome: outcome.error, 2, progress=progress)
    assert seen == ["a", "b", "a", "b"]


def test_front_is_what_nothing_beats(clock):
    made = {
        "fast": ([1], 1e-1),
        "good": ([2], 1e-3),
        "beaten": ([3], 1e-2),
        "same_error_slower": ([4], 1e-3),
        "best": ([5], 1e-5),
        "failed": ([0.1], nan),
        "infinite": ([0.2], inf),
    }
    _, points = measured(clock, 1, **made)
    assert [point.name for point in points if point.front] == ["fast", "good", "best"]


def test_twins_are_both_on_the_front(clock):
    _, points = measured(clock, 1, a=([1], 0.1), b=([1], 0.1))
    assert [point.front for point in points] == [True, True]


@pytest.mark.parametrize(("variants", "repeats"), [({}, 1), ({"a": lambda: 1.0}, 0), ({"a": lambda: 1.0}, 1.5)])
def test_wrong_input(variants, repeats):
    with pytest.raises(ValueError, match=r"variants|repeats"):
        work_precision(variants, float, repeats)


# --- choosing and comparing -------------------------------------------------------------------------------------------


def point(name, error, *walls):
    return Point(name, error, walls)


def test_fastest_is_the_quickest_of_those_accurate_enough():
    points = [point("quick", 1e-2, 1), point("exact", 1e-6, 9), point("fine", 1e-4, 3), point("failed", nan, 0.1)]
    assert fastest(points, 1e-3).name == "fine"
    assert fastest(points, 1e-4).name == "fine"
    assert fastest(points, 1e-7) is None


def test_time_for_an_error_lies_on_the_line_in_logarithms():
    points = [point("a", 1e-2, 1), point("b", 1e-4, 100), point("c", 1e-3, 5000), point("failed", nan, 0.1)]
    assert time_for(points, 1e-3) == pytest.approx(10)  # c is beaten by b and does not count
    assert time_for(points, 1e-2) == pytest.approx(1)
    assert isnan(time_for(points, 1e-5))
    assert isnan(time_for(points, 0.1))
    assert isnan(time_for(points[-1:], 0.1))


def test_verdict_says_both_ratios():
    ours, theirs = point("ours", 2e-6, 0.01, 0.01, 0.01), point("theirs", 1e-6, 0.03, 0.05, 0.04)
    assert verdict(ours, theirs) == (
        "ours has an error of 2.0e-06 after 10 ms, theirs one of 1.0e-06 after 40 ms: 4.0 times faster at 2 times the error."
    )
    assert "4.0 times slower at 0.5 times the error" in verdict(theirs, ours)
    assert "an error the other does not reach" in verdict(ours, point("failed", nan, 1, 1, 1))


def test_exponent_of_a_power_law_is_its_power():
    sizes = 1 / np.array([4, 8, 16, 20])
    assert exponent(sizes, 3 * sizes**4) == pytest.approx(4, abs=1e-12)
    assert exponent([1, 2, 3, 0], [5, 5, nan, 1]) == pytest.approx(0, abs=1e-12)
    assert isnan(exponent([1], [0.1])) and isnan(exponent([2, 2], [0.1, 0.2])) and isnan(exponent([1, 2], [0.1, -1.0]))


def test_exponent_of_the_trapezoidal_rule_is_two():
    counts = 2 ** np.arange(3, 9)
    grids = [np.linspace(0, 1, n + 1) for n in counts]
    errors = [abs(np.trapezoid(np.exp(x), x) - np.expm1(1)) for x in grids]
    assert exponent(1 / counts, errors) == pytest.approx(2, abs=1e-3)


def test_real_time_is_measured():
    numbers = count()

    def busy(loops):
        for _ in range(loops):
            next(numbers)

    short, long = work_precision({"short": lambda: busy(2_000), "long": lambda: busy(200_000)}, lambda _outcome: 0.1, 5)
    assert short.speedup(long) > 10


@pytest.mark.parametrize(
    ("error", "seconds", "beaten"),
    [(0.1, 0.5, True), (0.05, 1.0, True), (0.1, 1.0, False), (0.2, 0.5, False), (0.05, 2.0, False), (0.05, 0.5, True)],
)
def test_a_point_beats_another_that_is_no_better_in_anything(error, seconds, beaten):
    assert Point("a", error, (seconds,)).beats(Point("b", 0.1, (1.0,))) is beaten
