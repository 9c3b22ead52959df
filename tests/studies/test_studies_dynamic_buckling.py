"""The strip compressed at constant speed, and the first mode of its column against Airy functions and its limits."""

from math import pi

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import airy

from buckler.studies.strips.dynamic_buckling import Hoff, Parameters, figure, run

FAST = Parameters(rates=(0.3, 1.0), bows=(0.1,), elements=8)


def test_rate_is_the_rise_of_the_straight_strips_force():
    """E A v/L over a radian of the first vibration, in critical loads."""
    p = Parameters()
    rise = p.section.axial_stiffness * p.speed(1.0) / p.length / p.frequency
    assert rise == pytest.approx(p.section.euler_load(p.length), rel=1e-12)
    assert p.frequency == pytest.approx((pi / p.length) ** 2 * (p.section.bending_stiffness / p.section.mass_per_length) ** 0.5)


def test_beam_peaks_as_its_first_mode_says():
    """All modes and axial vibration of the beam on the engine against one ordinary differential equation."""
    result = run(FAST)
    assert result.status == "OK", result.message
    for rate in FAST.rates:
        metric = result.metrics[f"s{rate:g}.bow0.1.peak"]
        assert metric.exact == Hoff(rate, 0.1).peak().force and metric.error < 5e-3
    assert figure(result).axes


def test_a_wrong_first_mode_is_seen(monkeypatch):
    """Break the physics: a bow ten times as large lowers the peak by more than is allowed."""
    right = Hoff.peak
    monkeypatch.setattr(Hoff, "peak", lambda self: right(Hoff(self.rate, 10 * self.bow)))
    assert "off the first mode" in run(FAST).message


def airy_peak(rate, bow):
    """While bending shortens the column little, a_zz = z a + a0 s^(-2/3), z = s^(1/3) (tau - 1/s), from rest on its bow."""
    start, share = -(rate ** (-2 / 3)), rate ** (-2 / 3)
    _, slope_ai, _, slope_bi = airy(start)

    def amplitude(z):
        of_ai, of_bi = (share * quad(lambda x: airy(x)[k], start, z, limit=500)[0] for k in (0, 2))  # noqa: B023
        c = np.pi * bow * np.array([slope_bi - of_bi, of_ai - slope_ai])
        ai, ai1, bi, bi1 = airy(z)
        return c @ [ai, bi], c @ [ai1, bi1]

    z = start
    while np.prod(amplitude(z)) < 2 / share:  # the force rises
        z += 0.25
    z = brentq(lambda z: np.prod(amplitude(z)) - 2 / share, z - 0.25, z)
    tau = z * rate ** (-1 / 3) + 1 / rate
    return tau, Hoff(rate, bow).force(tau, amplitude(z)[0])


@pytest.mark.parametrize("rate", [0.01, 1.0, 100.0])
def test_small_bows_peak_as_the_airy_functions_say(rate):
    """An integrator on the full equations; closed form while the bow does not yet lower the force."""
    assert Hoff(rate, 1e-4).peak() == pytest.approx(airy_peak(rate, 1e-4), rel=1e-3)


def test_slow_compression_measures_the_critical_load():
    """The slower, the nearer to Euler's load; a bow of a radius of gyration never reaches it."""
    peaks = [Hoff(rate, 1e-3).peak().force for rate in (0.1, 0.01, 1e-3)]
    assert (np.diff(peaks) < 0).all() and peaks[-1] == pytest.approx(1.0, abs=0.02)
    assert Hoff(1e-3, 1.0).peak().force < 0.9
