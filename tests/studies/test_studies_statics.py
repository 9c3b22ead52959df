"""Studies of the strip's law and of the contact force in equilibrium, and the elements they rest on."""

import numpy as np
import pytest
from drawing import drawn
from scipy.optimize import linprog

from buckler.elastica import pinned
from buckler.mbs.library import PAPER
from buckler.studies.strips import contact_force_table, elastica_law
from buckler.studies.strips.contact_force_table import friction_interval


@pytest.fixture(scope="module")
def laws():
    return elastica_law.run(elastica_law.Parameters(points=21))


def test_each_law_is_as_far_from_the_closed_form_as_it_may_be(laws):
    assert laws.status == "OK"
    assert laws.metrics["quartic_error"].value == pytest.approx(9.8879488 / np.pi**2 - 1, rel=1e-9)
    assert laws.metrics["quartic_error_at"].value == 0
    assert laws.metrics["load_at_1"].error == pytest.approx(1.3e-3, abs=1e-4)
    assert laws.metrics["rod_difference"].value < 1e-13
    assert 0 < laws.metrics["fast_error"].value < 1e-12
    assert laws.metrics["strip_difference"].value == pytest.approx(4.45e-6, rel=0.02)
    _, lower = drawn(elastica_law, laws).axes
    assert lower.get_yscale() == "log" and len(lower.get_legend().get_texts()) == 4


@pytest.fixture(scope="module")
def table():
    return contact_force_table.run(contact_force_table.Parameters(angles=7))


def test_forces_against_what_was_printed_and_the_cube(table):
    metrics = table.metrics
    assert table.status == "OK" and table.message == ""
    for h, force in {"0.1": 0.0655, "0.3": 1.7684, "0.5": 8.1871}.items():
        for metric in (metrics[f"F_h{h}_e120"], metrics[f"F_h{h}_eTable2"]):
            assert (metric.unit, metric.published) == ("N", force) and metric.error < 1e-5
    described = metrics["F_h0.3_e120"]
    assert (described.exact, described.value) == (pytest.approx(1.72465, abs=5e-6), pytest.approx(1.72465, rel=1e-5))
    assert described.published / described.value == pytest.approx(1.0254, abs=2e-4)
    for name, cube, printed in (("ratio_h0.3_h0.1", 27, 26.998), ("ratio_h0.5_h0.1", 125, 124.99)):
        assert metrics[name].exact == pytest.approx(cube) and metrics[name].error < 1e-5
        assert metrics[name].published == pytest.approx(printed, abs=0.01)
    assert "Largest contact force" in str(table)
    left, right = drawn(contact_force_table, table).axes
    assert len(left.get_legend().get_texts()) == 4
    assert "printed in Table 2" in [text.get_text() for text in right.get_legend().get_texts()]


def test_force_over_crank_angle(table):
    assert np.degrees(table.signals["angle"]) == pytest.approx([120, 130, 140, 150, 160, 170, 180])
    known = [1.3398, 1.4039, 1.4797, 1.5626, 1.6424, 1.7022, 1.7247]
    assert table.signals["F_h0.3.exact"] == pytest.approx(known, abs=6e-5)
    for model in ("rod", "beam"):
        force = table.signals[f"F_h0.3.{model}"]
        assert np.isnan(force[0])  # still straight
        assert force[1:] == pytest.approx(table.signals["F_h0.3.exact"][1:], rel=5e-6)
    assert table.signals["F_h0.3.quartic"] == pytest.approx(known, rel=2e-3)


def test_force_is_largest_at_dead_centre_and_its_moment_makes_the_stress(table):
    stop = PAPER.slider(2 * np.pi / 3)
    before, top, after = contact_force_table.press(pinned.load, 3e-4, stop, np.radians([160, 180, 200]))
    assert before == pytest.approx(after, rel=1e-12) and before < top
    moment = top * PAPER.coupler * pinned.mid_deflection(PAPER.shortening(np.pi, stop))
    stress = table.metrics["stress_h0.3_e120"].value
    assert stress == pytest.approx(moment * 3e-4 / 2 / (0.030 * 3e-4**3 / 12), rel=1e-12)
    assert stress == pytest.approx(376e6, rel=2e-3)


def test_beam_that_fails_makes_the_table_suspect(monkeypatch):
    monkeypatch.setattr("buckler.mbs.engine.pressed.MESH", -1.0)
    result = contact_force_table.run(contact_force_table.Parameters(thicknesses="0.3mm", elements=8, angles=2))
    assert result.status == "SUSPECT"
    assert result.message.startswith("h = 0.3 mm: at u = ")


@pytest.mark.parametrize(("push", "limit"), [(1.7, 0.3), (0.2, 0.3), (8.0, 0.0)])
def test_friction_leaves_the_interval_of_all_that_equilibrium_allows(push, limit):
    """Push, friction within its limit and a stop that only presses: extremes of the stop's force by linear programming."""
    ends = []
    for sign in (1, -1):
        found = linprog([sign, 0], A_eq=[[1, -1]], b_eq=[push], bounds=[(0, None), (-limit, limit)])
        ends.append(found.x[0])
    np.testing.assert_allclose(friction_interval(push, limit), ends, atol=1e-9)


def test_friction_interval_of_the_study():
    result = contact_force_table.run(contact_force_table.Parameters(thicknesses=3e-4, elements=4, angles=3))
    low, high = (result.metrics[f"friction_h0.3.{end}"].value for end in ("low", "high"))
    assert (high - low) / 2 == pytest.approx(0.15 * 0.3 * 9.81) and (high + low) / 2 == pytest.approx(1.7246507, rel=1e-6)
