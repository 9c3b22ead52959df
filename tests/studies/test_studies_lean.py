"""What is off is not there: the study of scenes counts items; times are shown, not asserted."""

import numpy as np
import pytest
from drawing import drawn

from buckler.mbs import build
from buckler.studies.trust import lean_scenes

SLIDER = {"strut": (4, 3), "beam": (55, 7), "cable": (40, 7)}
"""Coordinates and constraints: crank 3, block 1, strut none, beam 3 a node, cable 4; two rows a pin, one the drive."""


@pytest.mark.parametrize("kind", SLIDER)
def test_slider_crank_without_options(kind):
    plain = lean_scenes.SCENES[f"slider-crank-{kind}"]()[lean_scenes.BASE].summary
    assert (plain["coordinates"], plain["constraints"]) == SLIDER[kind]
    assert plain.keys().isdisjoint({"Stop", "GuideFriction", "gravity"}) and plain["loads"] == plain["sensors"] == 0


ADDED = {"stop": {"Stop": 1, "objects": 1}, "friction": {"GuideFriction": 1, "objects": 1}, "ledger": {}, "pictures": {}}


@pytest.mark.parametrize("part", ADDED)
def test_a_part_adds_what_it_is_and_no_more(part):
    variants = lean_scenes.SCENES["slider-crank-beam"]()
    before, after = variants[lean_scenes.BASE].summary, variants[part].summary
    assert {name: after.get(name, 0) - before.get(name, 0) for name in after if after[name] != before.get(name, 0)} == ADDED[part]


def test_gravity_loads_each_body_and_static_friction_is_a_number():
    variants = lean_scenes.SCENES["slider-crank-beam"]()
    assert variants["gravity"].summary["loads"] == 1 + 8 + 1
    assert variants["static friction"].summary == variants["friction"].summary


def test_friction_of_joints_adds_no_item_and_no_play_no_contact():
    variants = lean_scenes.SCENES["crank-rocker-play"]()
    assert variants["friction"].summary == variants[lean_scenes.BASE].summary
    ideal = lean_scenes.SCENES["crank-rocker-ideal"]()
    assert "friction" not in ideal and "Clearance" not in ideal[lean_scenes.BASE].summary
    assert build(ideal[lean_scenes.BASE].mechanism).remembering == []


@pytest.fixture(scope="module")
def found():
    scenes = ("slider-crank-strut", "crank-rocker-play")
    return lean_scenes.run(lean_scenes.Parameters(scenes=scenes, repeats=1))


def test_metrics_are_what_was_counted(found):
    metrics = {name: metric.value for name, metric in found.metrics.items()}
    assert found.status == "OK" and all(np.isfinite(value) for value in metrics.values())
    assert metrics["slider-crank-strut.coordinates"] == 4 and metrics["crank-rocker-play.coordinates"] == 9
    assert metrics["slider-crank-strut.stop.items"] == 1 and metrics["slider-crank-strut.ledger.items"] == 0
    assert metrics["slider-crank-strut.gravity.items"] == 2 and metrics["crank-rocker-play.friction.items"] == 0
    assert metrics["crank-rocker-play.contact signals.ratio"] > 1 and "slider-crank-strut.contact signals.ratio" not in metrics
    assert len(found.tables[0].rows) == 2


def test_a_scene_with_what_nobody_asked_for_is_suspect(monkeypatch):
    stopped = lambda: {**(v := lean_scenes.SCENES["slider-crank-strut"]()), lean_scenes.BASE: v["stop"]}  # noqa: E731
    monkeypatch.setitem(lean_scenes.SCENES, "crank-rocker-ideal", stopped)
    result = lean_scenes.run(lean_scenes.Parameters(scenes=("crank-rocker-ideal",), repeats=1))
    assert result.status == "SUSPECT" and "builds Stop" in result.message


def test_figure(found):
    (ax,) = drawn(lean_scenes, found).axes
    assert "ledger" in [text.get_text() for text in ax.get_xticklabels()] and len(ax.lines) == 3
