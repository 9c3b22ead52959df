"""Error against run time: turns and medians, on runs whose time is made up."""

from math import isnan, nan

import numpy as np
import pytest

from buckler.studies.kit import statistics as precision
from buckler.studies.kit.statistics import WorkPoint, exponent, fastest, work_precision


def measured(monkeypatch, repeats, **variants):
    """Variants that take these seconds, one after the other, and are this wrong."""
    now = [0.0]
    monkeypatch.setattr(precision, "process_time", lambda: now[0])

    def variant(seconds):
        left = iter(seconds)

        def run():
            now[0] += next(left)

        return run

    runs = {name: variant(seconds) for name, (seconds, _) in variants.items()}
    return work_precision(runs, {name: error for name, (_, error) in variants.items()}, repeats)


def test_points_hold_the_median_and_all_times_in_order(monkeypatch):
    found = measured(monkeypatch, 3, a=([1, 9, 2], 0.1), b=([4, 4, 4], 0.2))
    assert found["a"].times == pytest.approx((1, 9, 2))
    assert (found["a"].time, found["b"].time) == (pytest.approx(2), pytest.approx(4))
    assert (found["a"].error, found["b"].error) == (0.1, 0.2)


def test_speedup_cancels_a_machine_that_slows_down(monkeypatch):
    drift = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    found = measured(monkeypatch, 5, a=(drift, 0.1), b=(3 * drift, 0.1))
    assert found["a"].speedup(found["b"]) == pytest.approx(3)
    assert found["b"].speedup(found["a"]) == pytest.approx(1 / 3)


def test_fastest_is_the_quickest_of_those_accurate_enough():
    quick, exact, fine, failed = WorkPoint(1e-2, (1,)), WorkPoint(1e-6, (9,)), WorkPoint(1e-4, (3,)), WorkPoint(nan, (0.1,))
    points = [quick, exact, fine, failed]
    assert fastest(points, 1e-3) is fine and fastest(points, 1e-4) is fine
    assert fastest(points, 1e-7) is None


def test_exponent_of_a_power_law_is_its_power():
    sizes = 1 / np.array([4, 8, 16, 20])
    assert exponent(sizes, 3 * sizes**4) == pytest.approx(4, abs=1e-12)
    assert exponent([1, 2, 3, 0], [5, 5, nan, 1]) == pytest.approx(0, abs=1e-12)
    assert isnan(exponent([1], [0.1])) and isnan(exponent([2, 2], [0.1, 0.2])) and isnan(exponent([1, 2], [0.1, -1.0]))
