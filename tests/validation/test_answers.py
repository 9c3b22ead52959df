"""Every problem with a known answer has an accepted verdict, and wrong answers are found to be wrong."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba")

from exact import columns, frames, problems
from exact.siconos import FOURBAR, SLIDER_CRANK, controlled

from buckler.mbs import Exudyn, Rigid, path
from buckler.mbs.library import BAR, crank_rocker
from buckler.mbs.simulation import SOLVERS
from buckler.studies.extremes.case import Verdict
from buckler.studies.kit.drawn import Draw

from . import errors, nonsmooth, published, solvers, stability
from .known import Answer, Known, relate, solve, tabulate
from .questions import QUESTIONS, list_known

KNOWN = list(list_known())


def mark(known):
    """Return the marks of a problem: slow, or known to be wrong still."""
    still = pytest.mark.xfail(reason=f"still {known.still}", strict=True)
    return [pytest.mark.slow] * known.slow + [still] * bool(known.still)


@pytest.mark.parametrize("known", [pytest.param(k, id=f"{k.question}: {k.group}: {k.name}", marks=mark(k)) for k in KNOWN])
def test_an_answer_has_an_accepted_verdict(known):
    answer = known.solve()
    assert answer.verdict in known.accepted, answer


def test_every_question_has_problems_and_their_names_are_unique():
    assert {known.question for known in KNOWN} == set(QUESTIONS)
    assert len({(known.question, known.group, known.name) for known in KNOWN}) == len(KNOWN)


# --- verdicts ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("answer", "verdict"),
    [
        (Answer(1.0, 1.05, 0.1), Verdict.RIGHT),
        (Answer(1.0, 1.2, 0.1), Verdict.SILENT),
        (Answer(1.0, 1.05, 0.1, reported=0.01), Verdict.SILENT),
        (Answer(np.nan, 1.0, 0.1), Verdict.SILENT),
        (Answer(1.0, np.nan, 0.1), Verdict.NO_REFERENCE),
        (Answer(1.0, 1.2, 0.1, status="SUSPECT"), Verdict.NAMED),
        (Answer(1.0, 1.0, 0.1, status="SUSPECT"), Verdict.FALSE_ALARM),
        (relate(2.0, 2.02, 0.02), Verdict.RIGHT),
        (relate(-2.0, -2.05, 0.02), Verdict.SILENT),
    ],
)
def test_verdict_of_an_answer(answer, verdict):
    assert answer.verdict is verdict


def test_the_table_has_a_row_for_each_group_with_its_worst_answer():
    solved = [solve(Known("q", "g", name, lambda off=off: Answer(1 + off, 1.0, 0.1))) for name, off in (("a", 0.01), ("b", 0.2))]
    head, _, row = tabulate(solved)
    assert head.count("|") == row.count("|") and "| g | 2 | b: 1.2 | 1 | 2.0e-01 |" in row and "1 right, 1 silent" in row


# --- wrong answers are found --------------------------------------------------------------------------------------------


def test_a_wrong_spring_moves_andrews_mechanism(monkeypatch):
    right = problems.andrews()
    stiffer = replace(right, loads=[right.loads[0], replace(right.loads[1], stiffness=1.01 * right.loads[1].stiffness)])
    monkeypatch.setattr(problems, "andrews", lambda: stiffer)
    assert published.solve_andrews().verdict is Verdict.SILENT


def test_andrews_mechanism_has_the_published_start():
    points = problems.andrews().points
    assert points["E"] == pytest.approx((-0.020960022346354336, 0.0012951691937066864), abs=1e-9)
    assert points["D"] == pytest.approx((-0.010472393888814626, 0.02535778853027525), abs=1e-9)


def test_a_force_with_another_sign_is_a_contradiction(monkeypatch):
    """Change the sign of the drive torque of a crank-rocker, whose motion stays the same."""
    drawn, right = Draw("crank-rocker", crank_rocker(Rigid(BAR), speed=30.0), 0.05), SOLVERS[Exudyn]

    def wrong(*arguments):
        run = right(*arguments)
        torque = run.signals["drive.torque"]
        run.signals["drive.torque"] = torque._replace(values=-torque.values)
        return run

    assert solvers.compare(drawn).verdict is Verdict.RIGHT
    monkeypatch.setitem(SOLVERS, Exudyn, wrong)
    answer = solvers.compare(drawn)
    assert answer.ratio > 1 and "drive.torque" in answer.message


@pytest.mark.parametrize(("factor", "verdict"), [(0.0, Verdict.RIGHT), (4.0, Verdict.SILENT)])
def test_an_error_beyond_the_accuracy_asked_for_is_silent(monkeypatch, factor, verdict):
    """Compare with a reference that is wrong by a factor times the accuracy asked for."""

    def reference(drawn):
        exact = errors.close_loop(drawn)
        return exact._replace(places={name: x + factor * 1e-2 * np.ptp(x) for name, x in exact.places.items()})

    monkeypatch.setitem(errors.REFERENCES, "rigid", reference)
    errors.compare_places.cache_clear()
    assert errors.solve_accuracy("rigid", 0, 1e-2).verdict is verdict
    errors.compare_places.cache_clear()


# --- published data and references -----------------------------------------------------------------------------------------


def test_the_controller_gives_the_published_torque():
    """Compare the torque at all published states; these have 6 decimals, and 1e-6 rad times the gain is 2e-3 N m."""
    time, crank, _, _, speed, torque = FOURBAR
    found = np.array([controlled(*each) for each in zip(time, crank, speed, strict=True)])
    np.testing.assert_allclose(found, torque, atol=5e-3)
    assert np.abs(torque).max() > 180


def test_the_published_slider_touches_both_faces_and_its_schemes_differ():
    assert np.abs(SLIDER_CRANK[2]).max() == pytest.approx(1, abs=1e-3)
    assert 1e-4 < nonsmooth.compare_schemes() < 3e-3


@pytest.mark.slow
def test_frames_have_the_published_limit_loads():
    found = {(name, k): stability.solve_frame(name, "limit", k).found for name, k in (("lee", 0), ("lee", 1), ("deep_arch", 0))}
    found["deep_arch", 0] /= (np.radians(215) / 2) ** 2
    assert list(found.values()) == pytest.approx([18.55, -9.39, 8.97], rel=5e-4)


def test_the_koiter_roorda_frame_has_no_limit_on_the_other_side():
    frame = frames.roorda(0.01)
    assert list(frame.chain.critical()) == path(frame.mechanism, to=frame.chain.to).points == []


def test_beck_s_column_flutters_at_the_published_load():
    assert columns.flutter_with_tip(0.0) == pytest.approx(20.05095, rel=1e-6)
    assert columns.leipholz(14) == pytest.approx(40.05, rel=2e-4)
