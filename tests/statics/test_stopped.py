"""Statics that Ctrl-C or a limit of time ends: what they hand over is a part of the whole answer, and says so."""

from math import pi

import numpy as np
import pytest
from returned_states import block
from stopping import stop_at

from buckler import mbs
from buckler.mbs.functions import Components, Expression
from buckler.mbs.process import Interrupted
from buckler.mbs.statics.problem import Problem, StaticsError
from buckler.mbs.statics.shooting import Shooting


def column(*loads):
    """A slender column on a guide, pushed by 1 N."""
    strip = mbs.Beam(mbs.Section(0.02, 5e-4), imperfection=1e-3)
    return mbs.Mechanism(
        {"O": (0, 0), "B": (0.3, 0)}, [mbs.Link("strip", "O", "B", strip)], [mbs.Revolute("O", "ground", "strip")],
        guides=[mbs.Guide("B", "strip", (1, 0))], loads=[mbs.Force("B", (-1.0, 0.0))],
    )  # fmt: skip


SHAKEN = block(
    mbs.Spring("P", "ground:S", stiffness=25.0, damping=0.6), mbs.Force("P", Components((Expression("1.5*cos(4*t)"), 0.0)))
)
"""A spring of 25 N/m, shaken at 4 rad/s."""


def stopped(monkeypatch, look, by, call):
    """Return the answer of a call that is stopped, however it comes."""
    stop_at(monkeypatch, look, by)
    if by == "timeout":
        found = call()
        assert found.status == "TIMED_OUT"
        return found
    with pytest.raises(Interrupted) as stop:
        call()
    assert stop.value.result.status == "INTERRUPTED"
    return stop.value.result


@pytest.mark.parametrize("by", ["timeout", "Ctrl-C"])
def test_a_path_keeps_its_first_steps(monkeypatch, by):
    whole = mbs.path(column(), to=15.0, degree=8)
    found = stopped(monkeypatch, 40, by, lambda: mbs.path(column(), to=15.0, degree=8))
    count = len(found.parameter)
    assert 2 < count < len(whole.parameter)
    assert found.parameter == pytest.approx(whole.parameter[:count], rel=1e-9)
    assert found.ended == "stopped" and f"it led to {found.parameter[-1]:.6g}, not to 15" in found.message
    assert not found.errors, "a strip's errors are not known without a path of a higher degree"


def test_a_path_that_was_refined_only_in_part_is_the_coarser_whole(monkeypatch):
    whole = mbs.path(column(), to=15.0)
    looks = stop_at(monkeypatch, 0)
    mbs.path(column(), to=15.0, degree=12)
    found = stopped(monkeypatch, next(looks) + 20, "timeout", lambda: mbs.path(column(), to=15.0))
    assert found.ended == "reached" and "its errors are not known" in found.message
    assert found.point("strip", "B")[-1] == pytest.approx(whole.point("strip", "B")[-1], abs=1e-5)


def test_an_equilibrium_rests_at_the_part_of_the_load_that_was_reached(monkeypatch):
    found = stopped(monkeypatch, 60, "Ctrl-C", lambda: mbs.equilibrium(column(), 15.0, degree=8))
    assert 0.0 < found.load < 15.0 and f"{found.load / 15.0:.4g} of the load" in found.message
    monkeypatch.undo()
    again = mbs.equilibrium(column(), found.load, degree=8)
    assert found.point("strip", "B").position == pytest.approx(again.point("strip", "B").position, abs=1e-9)


def test_frequencies_without_a_refinement_have_no_error(monkeypatch):
    whole = mbs.frequencies(column(), count=3)
    rested = mbs.equilibrium(column())
    found = stopped(monkeypatch, 2, "timeout", lambda: mbs.frequencies(column(), rested, count=3))
    assert found.hertz == pytest.approx(whole.hertz, rel=1e-4) and np.isinf(found.errors).all()


@pytest.mark.parametrize("by", ["timeout", "Ctrl-C"])
def test_a_periodic_motion_is_kept_without_its_finer_steps(monkeypatch, by):
    exact = abs(1.5 / (25.0 - 16.0 + 2.4j))
    looks = stop_at(monkeypatch, 0)
    mbs.periodic(SHAKEN, pi / 2)
    found = stopped(monkeypatch, next(looks) - 2, by, lambda: mbs.periodic(SHAKEN, pi / 2))
    assert found.amplitude("block", "P")[0] == pytest.approx(exact, rel=1e-5)
    none = stopped(monkeypatch, 1, by, lambda: mbs.periodic(SHAKEN, pi / 2))
    assert "no periodic motion was found yet" in none.message and not len(none.time)


@pytest.mark.parametrize("by", ["timeout", "Ctrl-C"])
def test_a_response_keeps_the_motions_that_it_found(monkeypatch, by):
    found = stopped(monkeypatch, 120, by, lambda: mbs.response(SHAKEN, pi / 2, to=40.0, parameter="loads.0.stiffness"))
    assert 1 < len(found.parameter) and 25.0 < found.parameter[-1] < 40.0
    exact = np.abs(1.5 / (found.parameter - 16.0 + 2.4j))
    assert found.amplitude("block", "P")[:, 0] == pytest.approx(exact, rel=1e-5)


def test_an_equilibrium_whose_refinement_fails_says_that_its_error_is_unknown(monkeypatch):
    newton = Problem.newton

    def fail_if_fine(problem, *args, **options):
        if problem.scene.degree > 8:
            raise StaticsError("diverges")
        return newton(problem, *args, **options)

    monkeypatch.setattr(Problem, "newton", fail_if_fine)
    rest = mbs.equilibrium(column())
    assert rest.status == "INACCURATE" and "its error is not known" in rest.message


def test_a_periodic_motion_whose_refinement_fails_says_that_its_error_is_unknown(monkeypatch):
    search = Shooting.search

    def fail_if_fine(shooting, *args):
        if shooting.longest < 1 / 64:
            raise StaticsError("diverges")
        return search(shooting, *args)

    monkeypatch.setattr(Shooting, "search", fail_if_fine)
    found = mbs.periodic(SHAKEN, pi / 2)
    assert found.status == "INACCURATE" and "its error is not known" in found.message
