"""Runs that must not be trusted, that failed or are refused; repeatability and manners."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from simulations import BAR, LENGTH, STRIP, G, block, fine, pendulum, pressed

from buckler import mbs
from buckler.elastica import pinned
from buckler.mbs.laws import CarvalhoMartins, ExactRestitution, Hertz

# --- what must not be trusted, and what failed ------------------------------------------------------------------------


@dataclass(frozen=True)
class Broken(Hertz):
    """A stop whose force is no number."""

    def force(self, depth, rate, onset):
        return math.nan


@pytest.mark.parametrize(("mechanism", "steps"), [(pendulum(2.5), 20), (block(G, Hertz(1e10)), 100)], ids=["swing", "hit"])
def test_too_large_uniform_steps_are_suspect(mechanism, steps):
    result = mbs.simulate(mechanism, 1.5 if steps == 20 else 0.4, ledger=True, solver=mbs.Exudyn(mbs.Equal(steps)))
    assert result.status is mbs.Status.SUSPECT and "ENERGY" in result.message
    assert result.energy_balance > 1e-2


def test_out_of_time():
    result = mbs.simulate(mbs.slider_crank(mbs.Beam(STRIP), law=None, mass=0.3, speed=1.25), 5.0, timeout=1e-9, ledger=True)
    assert result.status is mbs.Status.TIMED_OUT and "of 5 s" in result.message
    assert 1 <= result.work["steps"] < 50 and len(result.signals["B.x"]) == len(result.time)


def test_too_many_steps():
    result = mbs.simulate(
        mbs.slider_crank(mbs.Beam(STRIP), law=None, mass=0.3, speed=1.25), 5.0, solver=mbs.Exudyn(mbs.Controlled(max_steps=7))
    )
    assert result.status is mbs.Status.TOO_MANY_STEPS and "max_steps = 7" in result.message
    assert len(result.time) <= 8


def test_drive_out_of_reach_locks():
    """The slider is pulled on beyond the stretched linkage."""
    linkage = mbs.Mechanism(
        points={"O": (0, 0), "A": (0.1, 0.1), "B": (0.4, 0)},
        links=[mbs.Link("a", "O", "A", BAR), mbs.Link("b", "A", "B", BAR)],
        joints=[mbs.Revolute("O", "ground", "a"), mbs.Revolute("A", "a", "b")],
        guides=[mbs.Guide("B", "b")],
        drives=[mbs.Drive("B", 0.1)],
    )
    reach = math.hypot(0.1, 0.1) + math.hypot(0.3, 0.1)
    result = mbs.simulate(linkage, 2.0)
    assert result.status is mbs.Status.LOCKED and result.message == "the linkage locks at t = 0.576491 s (a and b in line)"
    assert result.signals["B.x"][-1] == pytest.approx(reach, abs=1e-8)
    short = mbs.simulate(linkage, 2.0, solver=mbs.Closure(mbs.Controlled(max_steps=20)))  # the steps end before the motion
    assert short.status is mbs.Status.TOO_MANY_STEPS and "max_steps = 20 steps by t = 0.2 s" in short.message
    for solver, off in (
        (mbs.Exudyn(), 0.1 * 2.0 / 200),
        (mbs.Exudyn(mbs.Controlled(tolerance=1e-5)), 1e-4),
    ):  # by default equal steps: it ends within one
        result = mbs.simulate(linkage, 2.0, solver=solver)
        assert result.status is mbs.Status.LOCKED and "(a and b in line)" in result.message
        assert reach - off < result.signals["B.x"][-1] < reach + 1e-6 and "0.57" in result.message


def test_force_that_is_no_number_is_a_failure():
    result = mbs.simulate(block(G, Broken(1e8)), 0.3)
    assert result.status in (mbs.Status.NEWTON_DIVERGED, mbs.Status.NOT_FINITE)
    assert result.time[-1] < math.sqrt(0.2 / G) * 1.01


def half_elastica(u):
    if u > 0.2:
        raise ValueError(f"shortening = {u:.3f}: must lie in [0, 0.2]")
    return pinned.load(u)


def test_strut_beyond_its_law_has_a_name():
    result = mbs.simulate(pressed(mbs.Strut(STRIP, load=half_elastica), 0.5 * LENGTH, 1.0), 1.0)
    assert result.status is mbs.Status.STRUT_OUT_OF_RANGE and "must lie in [0, 0.2]" in result.message
    assert result.signals["strip.end_shortening"][-1] == pytest.approx(0.2 * LENGTH, rel=0.05)


# --- wrong input, repeatability, manners ------------------------------------------------------------------------------


def test_wrong_input_is_refused_before_the_engine(monkeypatch):
    from buckler.mbs.engine import solve

    def no_engine(*_):
        raise AssertionError("the engine was asked")

    monkeypatch.setattr(solve, "build", no_engine)
    with pytest.raises(AssertionError):
        mbs.simulate(pendulum(1.0), 1.0)
    for value in (0, -1.0, math.nan, math.inf, None, "1"):
        with pytest.raises(ValueError, match=r"duration = .*: must ((lie|be a number) in \(0, inf\) s|be finite)"):
            mbs.simulate(pendulum(1.0), value)
    for value in (0.0, -1.0, math.nan):
        with pytest.raises(ValueError, match=r"timeout = .* s: must lie in \(0, inf\) s"):
            mbs.simulate(pendulum(1.0), 1.0, timeout=value)


@pytest.mark.parametrize("solver", ["Exudyn", mbs.Exudyn, mbs.Controlled()])
def test_a_solver_of_a_wrong_type_is_refused(solver):
    with pytest.raises(ValueError, match=r"solver = .*must be Exudyn"):
        mbs.simulate(pendulum(1.0), 0.1, solver=solver)
    with pytest.raises(ValueError, match="accuracy = "):
        mbs.simulate(pendulum(1.0), 0.1, solver)


def test_the_same_input_gives_the_same_bits():
    mechanism = mbs.slider_crank(
        mbs.Beam(STRIP.damped(0.02, LENGTH)), law=CarvalhoMartins(1e5, 0.8), mass=0.3, speed=1.25, friction=mbs.GuideFriction(0.1)
    )
    one, two = (mbs.simulate(mechanism, 2.5, ledger=True) for _ in range(2))
    assert one.ok and one.signals["B.contact_force"].max() > 1  # so that there is something to repeat
    assert np.array_equal(one.time, two.time)
    for name in one.signals:
        assert np.array_equal(one.signals[name], two.signals[name]), name
    for name in one.energy:
        assert np.array_equal(one.energy[name], two.energy[name]), name


def test_the_ledger_changes_nothing_but_itself():
    mechanism = mbs.slider_crank(mbs.Strut(STRIP), law=ExactRestitution(1e5, 0.8), mass=0.3, speed=1.25)
    one, two = mbs.simulate(mechanism, 2.0), mbs.simulate(mechanism, 2.0, ledger=True)
    assert not one.energy and two.energy
    assert all(np.array_equal(one.signals[name], two.signals[name]) for name in one.signals)


def test_progress_rises_from_zero_to_one():
    seen = []
    mbs.simulate(pendulum(1.0), 0.3, progress=seen.append, solver=mbs.Exudyn())
    assert seen[0] == 0 and seen[-1] == pytest.approx(1.0) and (np.diff(seen) > 0).all()


def test_run_ends_where_it_should_and_keeps_to_the_largest_step():
    result = fine(mbs.simulate(pendulum(1.0), 0.7, solver=mbs.Exudyn(mbs.Controlled(max_step=0.01))))
    assert result.time[0] == 0 and result.time[-1] == pytest.approx(0.7, rel=1e-12)
    assert np.diff(result.time).max() <= 0.01 * (1 + 1e-9)
