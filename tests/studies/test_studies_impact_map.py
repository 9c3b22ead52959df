"""A strike in dimensionless numbers: the simulation beside a strip of sine modes."""

import pytest
from drawing import drawn

from buckler.studies.striking import impact_map, slider_crank
from buckler.studies.striking.impact_map import SineStrip


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


@pytest.fixture(scope="module")
def result():
    return impact_map.run(impact_map.Parameters(speeds="1.25,10", bows="1e-4", stiffnesses="72000", masses="0.05,0.5"))


def test_stiffnesses_alone_give_a_power_of_the_rate():
    case, points = slider_crank.Parameters(models="beam"), []
    for rate in (1.0, 4.0):
        points.append(impact_map.MapPoint(case, 2.0, 2 * rate**0.5, 0.0, 2.0, rate, bend=1.0, failure=""))
    assert impact_map._metrics(points)["late.power_of_rate"].value == pytest.approx(0.5)
    assert "late.power_of_rate" not in impact_map._metrics(points[:1])


def test_sine_modes_stand_beside_every_strike(result):
    assert result.status == "OK", result.message
    m = {name: metric.value for name, metric in result.metrics.items()}
    assert m["sine.median"] == pytest.approx(1, abs=0.05)
    assert m["regime.late_buckling"] == 3 and m["regime.swing"] == 1
    assert sum(m[name] for name in m if name.startswith("regime.")) == len(result.signals["peak"]) == 4


@pytest.mark.slow
def test_sine_modes_over_the_whole_map():
    result = impact_map.run(impact_map.Parameters())
    assert result.status == "OK", result.message
    m = {name: metric.value for name, metric in result.metrics.items()}
    assert m["sine.median"] == pytest.approx(1, abs=0.02) and m["sine.within_20"] > 0.9


def test_figure_of_the_map(result):
    over, parity = drawn(impact_map, result).axes
    assert all("[1]" in ax.get_xlabel() and "[1]" in ax.get_ylabel() for ax in (over, parity))
    assert set(impact_map.REGIMES) <= {text.get_text() for text in over.get_legend().get_texts()}
