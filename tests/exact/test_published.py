"""The published benchmark numbers, confirmed: each problem is integrated or solved here a second way."""

import numpy as np
import pytest

from exact import andrews, four_bars, pendulums, princeton, simeon
from exact.published import ANDREWS_ANGLES, DOUBLE_PENDULUM, PUBLISHED, SIMEON_END


def test_andrews_mechanism_reaches_the_published_angles():
    found = andrews.index_one(1e-12)
    np.testing.assert_allclose(found[:7], ANDREWS_ANGLES, rtol=0.0, atol=1e-8)
    assert np.max(np.abs(andrews.constraints(found[:7])[0])) < 1e-13
    number = PUBLISHED["andrews.beta"]
    assert found[0] == pytest.approx(number.value, abs=number.within)


def test_four_bars_turn_over_as_published():
    x, y, vx, vy = four_bars.top(10.0)
    assert x == pytest.approx(PUBLISHED["four_bar_n2.x"].value, abs=PUBLISHED["four_bar_n2.x"].within)
    assert y == pytest.approx(PUBLISHED["four_bar_n2.y"].value, abs=PUBLISHED["four_bar_n2.y"].within)
    h = 1e-6
    numbers = [(four_bars.top(10.0 + h)[k] - four_bars.top(10.0 - h)[k]) / (2.0 * h) for k in (0, 1)]
    assert numbers == pytest.approx((vx, vy), rel=1e-7)
    assert four_bars.top(10.0, speed=-1.0)[:2] == pytest.approx((-x, y), rel=1e-14)


@pytest.mark.parametrize(("load", "name"), [(8.896, "princeton.tip"), (13.345, "princeton.tip_13")])
def test_princeton_beam_bends_as_published(load, name):
    number = PUBLISHED[name]
    assert princeton.tip(load)[1] == pytest.approx(number.value, abs=number.within)


@pytest.mark.slow
def test_simeons_slider_crank_ends_as_published():
    found = simeon.end_state(tolerance=1e-9)
    scale = np.array((1.0, 1.0, 1.0, *[1e-4] * 4, 1.0, 1.0, 1.0, *[1e-1] * 4))
    np.testing.assert_allclose(found / scale, np.array(SIMEON_END) / scale, rtol=1e-7, atol=2e-5)
    assert found[2] == pytest.approx(PUBLISHED["simeon.slider"].value, abs=PUBLISHED["simeon.slider"].within)


@pytest.mark.parametrize("kind", ["points", "rods"])
def test_double_pendulum_in_double_precision_meets_the_series(kind):
    np.testing.assert_allclose(pendulums.double_by_steps(kind, (np.pi / 2.0,) * 2, 5.0), DOUBLE_PENDULUM[kind], atol=1e-9)
