"""Integrals over the times of a record: order, uneven steps, kinks."""

from __future__ import annotations

import numpy as np
import pytest

from buckler.mbs.record.lookup import corrected_trapezoidal, trapezoidal


def uneven(count):
    fraction = np.linspace(0.0, 1.0, count + 1)
    return fraction + 0.05 * np.sin(4 * np.pi * fraction)


@pytest.mark.parametrize(("rule", "order"), [(trapezoidal, 2), (corrected_trapezoidal, 4)])
def test_order_on_uneven_steps(rule, order):
    errors = []
    for count in (40, 80, 160):
        t = uneven(count)
        errors.append(np.abs(rule(t, 3 * np.cos(3 * t)) - np.sin(3 * t)).max())
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx(order, abs=0.35)


def test_parabolas_do_not_cross_a_kink_sampled_on_both_sides():
    """A jump whose two sides are 1e-12 apart: as accurate as without it."""
    jump = 0.4
    t = np.unique(np.concatenate([np.linspace(0, 1, 81), [jump - 1e-12, jump]]))
    rate = np.where(t < jump, np.cos(t), 5 + np.cos(t))
    exact = np.sin(t) + 5 * np.maximum(t - jump, 0.0)
    assert np.abs(corrected_trapezoidal(t, rate) - exact).max() < 1e-8
    assert np.abs(trapezoidal(t, rate) - exact).max() > 1e-6


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_times(count):
    t = np.linspace(0.0, 1.0, count)
    np.testing.assert_allclose(corrected_trapezoidal(t, 2 * t), t**2, atol=1e-15)
