"""A run held against the other solver: they agree, a flipped sign is caught, what cannot be compared says so."""

from dataclasses import replace
from math import isnan

import pytest

pytest.importorskip("numba")

from buckler.mbs import (
    Beam,
    Controlled,
    Exudyn,
    Force,
    Link,
    Mechanism,
    Revolute,
    Rigid,
    Section,
    Spring,
    simulate,
)
from buckler.mbs.accuracy import second_opinion
from buckler.mbs.accuracy.demand import USUAL_ERROR, CheckedRun
from buckler.mbs.accuracy.second_opinion import compare_solvers
from buckler.mbs.accuracy.trajectory import Trajectory
from buckler.mbs.engine.solve import run_once
from buckler.mbs.library import slider_crank
from buckler.mbs.record.errors import Errors, Norm
from buckler.mbs.solvers import Spectral
from buckler.mbs.spectral import recording, registry
from buckler.mbs.view.verdicts import verdicts

PENDULUM = Mechanism(
    {"O": (0.0, 0.0), "A": (1.0, 0.0)},
    [Link("rod", "O", "A", Rigid(Section(0.02, 0.005)))],
    [Revolute("O", "ground", "rod")],
    loads=[Force("A", (3.0, 0.0))],
    gravity=(0.0, -9.81),
)
SPRUNG = replace(PENDULUM, points={**PENDULUM.points, "P": (1.0, 1.0)}, loads=[Spring("A", "ground:P", stiffness=5.0)])


def flipped(monkeypatch, kind, **values):
    """The compiled solver's file of one kind with the sign of some values flipped."""
    right = registry.ELEMENTS[kind]

    def wrong(builder, name, element):
        right(builder, name, replace(element, **{key: flip(getattr(element, key)) for key, flip in values.items()}))

    monkeypatch.setitem(registry.ELEMENTS, kind, wrong)


def test_the_difference_allowed_is_the_sum_of_both_errors():
    """Signal by signal; of one that is not known, 5 %, and of what a run without settings is held to."""
    runs = [run_once(PENDULUM, 0.5, Exudyn(), None, None), run_once(PENDULUM, 0.5, Exudyn(Controlled(1e-3, 0.1)), None, None)]
    errors = {(name, norm): 1.0 for name in Trajectory.of(runs[0]).signals for norm in Norm}
    errors |= {("O.ground-rod.fx", Norm.IMPULSE): 1e-7}
    mine, other = (Errors(1.0, {key: share * error for key, error in errors.items()}, until=0.5) for share in (1, 2))
    _, found = compare_solvers(*runs, mine, other)
    assert found.name == "impulse(O.ground-rod.fx)" and found.allowed == pytest.approx(3e-7) and found.ratio > 1
    assert compare_solvers(*runs, mine, Errors())[1].allowed == USUAL_ERROR
    assert compare_solvers(*runs, mine, other, least=1.0)[1].ratio < 1


def test_solvers_agree_on_a_pendulum():
    """With an accuracy the difference is within the sum of both estimates."""
    result = simulate(PENDULUM, 1.0, 1e-4, verify=True)
    assert result.ok, result.message
    assert 0 < result.verified < 2e-4
    assert "from the other solver" in repr(result)
    assert [row.verdict for row in verdicts(result) if row.name == "SOLVERS"] == ["no complaint"]


def test_solvers_agree_on_a_beam():
    """Either solver may be the first; without an accuracy 5 % are allowed."""
    mechanism = slider_crank(Beam(Section(0.03, 0.002).damped(0.01, 0.31)), law=None, mass=0.3, speed=20.0)
    for solver in (None, Spectral()):
        result = simulate(mechanism, 0.1, solver=solver, verify=True)
        assert result.ok, result.message
        assert 0 < result.verified < 0.03
        assert result.work["verify_s"] > 0


@pytest.mark.parametrize(
    ("mechanism", "kind", "values"),
    [
        (SPRUNG, "Spring", {"stiffness": lambda k: -k}),
        (PENDULUM, "Force", {"value": lambda f: (-f[0], -f[1])}),
    ],
    ids=["spring", "force"],
)
@pytest.mark.parametrize("accuracy", [None, 1e-3])
def test_a_flipped_sign_is_caught(monkeypatch, mechanism, kind, values, accuracy):
    assert simulate(mechanism, 0.5, accuracy, verify=True).ok
    flipped(monkeypatch, kind, **values)
    result = simulate(mechanism, 0.5, accuracy, verify=True)
    assert result.status == "SUSPECT"
    assert "SOLVERS: " in result.message and "Exudyn" in result.message and "the compiled solver" in result.message
    assert result.verified > 0.05


@pytest.mark.parametrize(("heavier", "agree"), [(3e-3, True), (0.03, False)])
def test_solvers_that_agree_far_better_than_asked_do_agree(monkeypatch, heavier, agree):
    """Gravity a few thousandths off moves nothing that is asked for to a tenth; a few hundredths do. Errors are tiny."""
    tiny = Errors(1e-7, until=0.5)
    made = run_once(PENDULUM, 0.5, Exudyn(Controlled(1e-8, 1e-3)), None, None)
    other = run_once(replace(PENDULUM, gravity=(0.0, -9.81 * (1 + heavier))), 0.5, Exudyn(Controlled(1e-8, 1e-3)), None, None)
    result = replace(simulate(PENDULUM, 0.5), asked=0.1, error=tiny)
    monkeypatch.setattr(second_opinion, "refine", lambda *_: CheckedRun(other, tiny))
    assert second_opinion.verify_by_other_solver(result, made, 0.5, run_once).ok == agree


@pytest.mark.parametrize("accuracy", [None, 1e-3])
def test_a_reaction_of_the_wrong_sign_is_caught(monkeypatch, accuracy):
    right = recording._channels

    def wrong(*what):
        found = right(*what)
        return found | {name: {key: -each for key, each in found[name].items()} for name in found if "ground-rod" in name}

    monkeypatch.setattr(recording, "_channels", wrong)
    result = simulate(PENDULUM, 0.5, accuracy, verify=True)
    assert result.verified < 0.01
    assert result.status == "SUSPECT" and "apart in 'impulse(O.ground-rod.f" in result.message


def test_a_kind_the_other_does_not_know_is_a_note(monkeypatch):
    monkeypatch.delitem(registry.ELEMENTS, "Force")
    result = simulate(PENDULUM, 0.1, verify=True)
    assert result.ok and isnan(result.verified)
    assert "Force: the compiled solver does not know this kind" in result.provenance["notes"][-1]


def test_nothing_is_compared_unasked():
    result = simulate(PENDULUM, 0.1)
    assert isnan(result.verified)
    assert "SOLVERS" not in {row.name for row in verdicts(result)}
