"""A mechanism is asked once for what follows from it."""

import pickle
from collections import Counter
from dataclasses import replace

import pytest

from buckler.mbs import Drive, Exudyn, Mechanism, Rigid, Section, simulate, slider_crank
from buckler.mbs.scene.linkage import Linkage
from buckler.mbs.scene.scene import Scene
from buckler.mbs.spectral import registry


@pytest.fixture
def crank():
    return slider_crank(Rigid(Section(0.03, 2e-3)), law=None, mass=0.3, speed=1.25)


def test_all_runs_and_checks_of_a_simulation_ask_once(crank, monkeypatch):
    asked = Counter()
    listed, made = Mechanism.elements, Linkage.__init__
    monkeypatch.setattr(Mechanism, "elements", lambda self: asked.update(["elements"]) or listed(self))
    monkeypatch.setattr(Linkage, "__init__", lambda self, *given: asked.update(["linkage"]) or made(self, *given))
    result = simulate(crank, 0.5, solver=Exudyn())
    assert result.ok and asked["linkage"] == 1 and 1 <= asked["elements"] <= 3


def test_a_scene_goes_with_its_mechanism_and_not_with_copies(crank):
    scene = Scene.of(crank)
    assert Scene.of(crank) is scene
    free = replace(crank, drives=())
    assert not Scene.of(free).is_determined and scene.is_determined
    assert Scene.of(replace(free, drives=(Drive("crank", 2.0),))).is_determined
    assert pickle.loads(pickle.dumps(crank)) == crank  # rows of a scene hold functions


def test_a_solver_that_does_not_take_a_mechanism_says_why(crank, monkeypatch):
    run = pytest.importorskip("buckler.mbs.spectral.run")
    assert run.scene_or_reason(crank, None).source is Scene.of(crank)
    monkeypatch.delitem(registry.BODIES, "Rigid")
    assert run.scene_or_reason(crank, None) == "Rigid: the compiled solver does not know this kind of link"
