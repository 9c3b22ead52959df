"""Largest Lyapunov exponents: of systems that have a known one, and of the crank-rocker."""

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs.spectral.chaos import lyapunov, stretching
from buckler.studies.rattling.bars import PlayParameters

TURN = 0.2
"""Of the crank [s]."""


def test_logistic_map_has_ln_2():
    growth = stretching(lambda x, _: 4 * x * (1 - x), np.array([0.3]), 20_000, offset=1e-9)
    assert growth[10:].mean() == pytest.approx(np.log(2), rel=1e-3)


def test_linear_map_has_its_largest_eigenvalue_whatever_the_scale():
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]])
    matrix = turn @ np.diag([1.5, 0.7, -0.2]) @ turn.T
    for scale in (1.0, np.array([1e-3, 1.0, 50.0])):
        growth = stretching(lambda x, _: matrix @ x, np.zeros(3), 200, offset=1e-6, scale=scale, seed=1)
        np.testing.assert_allclose(growth[50:], np.log(1.5), rtol=1e-9)


def test_damped_oscillator_has_minus_its_decay_and_sees_the_number_of_the_step():
    """Of x'' + 2 z x' + x = cos(k): a force alike for both motions changes nothing."""
    z, h = 0.05, 2 * np.pi / np.sqrt(1 - 0.05**2) / 8
    grid = np.linspace(0, h, 401)
    w = np.sqrt(1 - z**2)
    free = np.exp(-z * h) * np.array([
        [np.cos(w * h) + z / w * np.sin(w * h), np.sin(w * h) / w],
        [-np.sin(w * h) / w, np.cos(w * h) - z / w * np.sin(w * h)],
    ])  # fmt: skip
    seen = []

    def flow(x, k):
        seen.append(k)
        return free @ x + grid[1] * np.cos(k)

    growth = stretching(flow, np.array([1.0, 0.0]), 800, offset=1e-7)
    assert growth.sum() / (800 * h) == pytest.approx(-z, rel=2e-2) and growth.std() > 0.01
    assert seen == [k for k in range(800) for _ in range(2)]


def test_offset_that_is_lost_is_an_error():
    with pytest.raises(ArithmeticError, match="step 0: the offset of 1e-09 became 0"):
        stretching(lambda x, _: 0 * x, np.ones(2), 3, offset=1e-9)
    with pytest.raises(ArithmeticError, match="became nan"):
        stretching(lambda x, _: x * np.nan, np.ones(2), 3, offset=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("damping", "rate", "within"), [(253.0, 163.0, 60.0), (17e3, -22.0, 7.0)])
def test_rattling_joints_are_chaotic_and_damped_ones_repeat(damping, rate, within):
    """An offset of 1e-12 m is seen to grow to 1e-4 m within some 40 ms: in one part of the turn, which has a mean of its own."""
    found = lyapunov(PlayParameters(damping=damping).bars(), TURN / 100, 300, settle=300)
    assert found.value == pytest.approx(rate, abs=within)
    assert damping > 253.0 or found.growth.reshape(3, 100)[:, :26].mean() > 250.0
