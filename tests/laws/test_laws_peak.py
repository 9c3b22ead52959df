"""Largest force of an impact with a push behind it: against integration, and its limits."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from buckler.mbs.laws import chi_exact
from buckler.mbs.laws.peak import peak_factors


def struck(chi, push):
    """Largest force of a unit mass at unit speed on a unit stop, pushed on, by integration."""

    def motion(_, state):
        x, v = state
        return v, push - x * (1 + chi * v)

    run = solve_ivp(motion, (0, 3), (0, 1), method="DOP853", rtol=1e-12, atol=1e-13, dense_output=True)
    x, v = run.sol(np.linspace(0, 3, 30001))
    force = x * (1 + chi * v)
    i = int(np.argmax(np.diff(force) < 0))  # the first maximum; its samples are 1e-4 apart: good to 1e-8
    return force[i]


@pytest.mark.parametrize("e", [0.1, 0.3, 0.5, 0.8, 0.95, 1.0])
def test_peak_of_a_free_impact_is_exact(e):
    chi = chi_exact(e)
    assert peak_factors(chi)[0] == pytest.approx(struck(chi, 0.0), rel=1e-7)


@pytest.mark.parametrize("e", [0.3, 0.5, 0.8, 0.95])
def test_a_push_adds_to_the_peak_what_its_factor_says(e):
    chi = chi_exact(e)
    slope = (struck(chi, 1e-3) - struck(chi, -1e-3)) / 2e-3
    assert peak_factors(chi)[1] == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize(("push", "within"), [(0.05, 2e-4), (0.3, 2.5e-3), (0.5, 7e-3)])
def test_peak_with_a_strong_push(push, within):
    for e in (0.2, 0.4, 0.6, 0.8, 0.9, 0.99):
        c0, c1 = peak_factors(chi_exact(e))
        assert c1 * push + np.hypot(c1 * push, c0) == pytest.approx(struck(chi_exact(e), push), rel=within)


def test_elastic_limit_of_the_factors():
    assert peak_factors(0.0) == pytest.approx((1.0, 1.0), abs=1e-12)
    c0, c1 = peak_factors(np.array([1e-12, 1e-9, 1e-8, 1.1e-8, 1e-6, 1e-4]))
    assert np.all(np.abs(c0 - 1) < 1e-4) and np.all(np.abs(c1 - 1) < 1e-4)
    assert np.all(np.diff(c0) <= 1e-12)  # 1 - chi/3 + ...: no jump where the root changes
    assert c0[-1] == pytest.approx(1 - 1e-4 / 3, abs=1e-8)


@pytest.mark.parametrize("chi", [500.0, 1e3, 1e6])
def test_stops_that_lose_nearly_all_energy(chi):
    c0, c1 = peak_factors(chi)
    y = 2 / 3 * (1.5 + chi - np.log1p(chi) + np.log(2 / 3 * chi))  # equation (2), ln y to leading order
    w = (y - 1) / chi
    assert c0 == pytest.approx(y * np.sqrt(w / chi), rel=1e-2)  # w = chi x^2 at the peak
    assert c1 == pytest.approx(peak_factors(500.0)[1], rel=1e-3)


@pytest.mark.parametrize("chi", [-1e-3, float("nan"), float("inf")])
def test_factors_refuse_what_is_no_hysteresis(chi):
    with pytest.raises(ValueError, match=r"chi = .*must lie in"):
        peak_factors(chi)
