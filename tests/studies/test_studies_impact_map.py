"""A strike in dimensionless numbers: the simulation, a strip of sine modes, closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from drawing import drawn
from scipy.integrate import quad

from buckler.studies.striking import impact_map, impact_numbers, slider_crank
from buckler.studies.striking.impact_numbers import ImpactNumbers
from buckler.studies.striking.sine_strip import SineStrip
from buckler.studies.strips.hoff import Hoff


def both(**given):
    p = slider_crank.Parameters(models="beam", until="190deg", **given)
    return slider_crank.run(p).metrics["beam.impact_peak"].value, SineStrip(p).peak()


@pytest.mark.parametrize(("given", "within"), [
    ({}, 0.01), ({"gravity": 9.81}, 0.03), pytest.param({"imperfection": 0.01}, 0.01, marks=pytest.mark.slow),
    pytest.param({"stop_stiffness": 1e3, "imperfection": 0.03}, 0.02, marks=pytest.mark.slow),
])  # fmt: skip
def test_strip_of_sine_modes_strikes_as_the_simulated_beam(given, within):
    """Ten modes without axial inertia, an equation of its own: 156.7 N for the beam's 156.3."""
    peak, theory = both(**given)
    assert theory == pytest.approx(peak, rel=within)


def test_side_of_the_bow_matters_to_both():
    (with_it, theory), (against, other) = both(imperfection=1e-3), both(imperfection=-1e-3)
    assert against / with_it == pytest.approx(other / theory, rel=0.01) and against > 1.05 * with_it


def base(**given):
    return ImpactNumbers.of(SineStrip(slider_crank.Parameters(**given)))


@pytest.mark.parametrize(("rate", "bow"), [(1.0, 0.01), (3.0, 0.1), (10.0, 0.01)])
def test_closed_form_is_near_the_columns_first_mode(rate, bow):
    """Hoff's column is the strip between rigid walls, r = 1, without damping, one mode."""
    closed = replace(base(), rate=rate, seeds=np.array([bow]), ratio=1.0, damping=0.0).late()
    assert closed == pytest.approx(Hoff(rate, bow).peak().force, rel=0.15)


def test_growth_is_integrated():
    for n, p, damping in ((1, 7.0, 0.05), (3, 40.0, 0.2), (2, 30.0, 0.0)):
        area, _ = quad(lambda x: impact_numbers._growth(n, x, damping), n**2, p)  # noqa: B023
        assert impact_numbers._integrate_growth(n, p, damping) == pytest.approx(area, rel=1e-6)


def test_peak_grows_with_the_root_of_the_rate_when_modes_are_free():
    numbers = replace(base(), damping=0.0, seeds=1e-6 / np.arange(1, 41.0) ** 5, ratio=1.0)
    peaks = [replace(numbers, rate=s).late() for s in (100.0, 400.0)]
    assert np.log(peaks[1] / peaks[0]) / np.log(4) == pytest.approx(0.5, abs=0.06)
    assert peaks[1] > 2 * np.sqrt(400.0)


def test_regimes_are_where_their_borders_say():
    assert base().regime() == "late buckling"
    assert base(stop_stiffness=500, imperfection=0.03, speed=0.3).regime() == "sagging"
    assert base(speed=10.0).regime() == "swing" and base(speed=10.0).way > 1
    assert base(stop_stiffness=100, speed=0.1, mass=2.0, friction=0.0).regime() == "plateau"


@pytest.fixture(scope="module")
def result():
    return impact_map.run(impact_map.Parameters(speeds="1.25,10", bows="1e-4", stiffnesses="72000", masses="0.05,0.5"))


def test_theories_stand_beside_every_strike(result):
    assert result.status == "OK", result.message
    m = {name: metric.value for name, metric in result.metrics.items()}
    assert m["sine.median"] == pytest.approx(1, abs=0.05) and 0.75 < m["closed.median"] < 1.1
    assert m["regimes.agree"] == 1 and m["regime.late_buckling"] == 3 and m["regime.swing"] == 1
    assert sum(m[name] for name in m if name.startswith("regime.")) == len(result.signals["peak"]) == 4


@pytest.mark.slow
def test_theories_over_the_whole_map():
    result = impact_map.run(impact_map.Parameters())
    assert result.status == "OK", result.message
    m = {name: metric.value for name, metric in result.metrics.items()}
    assert m["sine.median"] == pytest.approx(1, abs=0.02) and m["sine.within_20"] > 0.9
    assert 0.5 < m["closed.low"] and m["closed.high"] < 1.6 and m["regimes.agree"] > 0.75


def test_figure_of_the_map(result):
    over, parity = drawn(impact_map, result).axes
    assert all("[1]" in ax.get_xlabel() and "[1]" in ax.get_ylabel() for ax in (over, parity))
    assert set(impact_map.REGIMES) <= {text.get_text() for text in over.get_legend().get_texts()}
