"""The study of the strip compressed at constant speed."""

from math import pi

import pytest

from buckler.elastica.hoff import Hoff
from buckler.studies.strips.dynamic_buckling import Parameters, figure, run

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
