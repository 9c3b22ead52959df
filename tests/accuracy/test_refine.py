"""Refinement: with made-up runs whose errors are known, runs that fail, and motions whose separation is known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from buckler.mbs import Beam, Exudyn, Link, Mechanism, Revolute, Section, Spectral, Status
from buckler.mbs.accuracy import refine as module
from buckler.mbs.accuracy.demand import BALANCE, PLACE_ERROR, Asked, Usual, find_worst
from buckler.mbs.accuracy.difference import Difference
from buckler.mbs.accuracy.estimate import LEAST_ERROR, Separation, estimate_gains
from buckler.mbs.accuracy.levels import DEGREE, FIRST, LEVELS_BY_SOLVER, Level, Levels
from buckler.mbs.accuracy.refine import refine
from buckler.mbs.accuracy.trajectory import Trajectory
from buckler.mbs.elements.signal import Kind, Signal
from buckler.mbs.record.errors import Failure, Norm
from buckler.mbs.record.run import BALANCE as BALANCE_ALLOWED
from buckler.mbs.scene.scene import Scene
from buckler.mbs.solvers import usual_tolerance

TIME = np.linspace(0.0, 1.0, 4001)
RIGHT = np.cos(3 * TIME)
SECTION = Section(0.02, 0.002)
BAR = Mechanism(
    points={"O": (0, 0), "A": (0.3, 0)}, links=[Link("bar", "O", "A", Beam(SECTION))], joints=[Revolute("O", "ground", "bar")]
)
X = ("P.x", Norm.RMS)


class MadeUp(Levels):
    """Levels of made-up runs."""

    finest = 1e-9

    def first(self):
        return Level(FIRST, 0)

    def settings(self, level):
        return None, level


@pytest.fixture(autouse=True)
def made_up(monkeypatch):
    """A made-up run is its own trajectory, without energies but for their balance."""

    def of(run):
        return Trajectory(run.record.time, {"P.x": Signal("P.x", run.x, "m", Kind.PLACE)}, 1.0)

    monkeypatch.setattr(module, "Trajectory", SimpleNamespace(of=of))
    monkeypatch.setattr(module, "compute_energies", lambda run: (Trajectory(run.record.time, {}, 1.0), run.balance))


def made(off, fails=(), balance=0.0):
    """Return the function that makes a run off by `off(tolerance, time)` of its range, and the levels it was asked for."""
    asked = []

    def run(_mechanism, end, level):
        asked.append((level.tolerance, end))
        time = TIME[TIME <= end * (1 + 1e-12)]
        failure = Failure(Status.NEWTON_DIVERGED, "made up") if len(asked) in fails else None
        x = RIGHT[: len(time)] + np.ptp(RIGHT) * off(level.tolerance, time)
        return SimpleNamespace(
            failure=failure,
            unseen="",
            solver=Spectral(),
            x=x,
            balance=balance,
            record=SimpleNamespace(time=time, mechanism=BAR),
        )

    return run, asked


def found(off, asked=1e-2, **more):
    run, levels = made(off, **more)
    return refine(run, MadeUp(None, 1.0, Spectral()), Asked(asked)), levels


@pytest.fixture(autouse=True)
def no_clearance(monkeypatch):
    monkeypatch.setattr(MadeUp, "rattles", False)


def power(order, size):
    return lambda tolerance, time: size * (tolerance / FIRST) ** order + 0 * time


@pytest.mark.parametrize("order", [0.2, 0.25, 0.5, 1.0, 1.25, 1.46])
def test_the_estimate_is_right_within_half_and_twenty_times_for_all_orders(order):
    """The first pair does not show the order, which is 5/4 in smooth motions and far less where friction reverses."""
    answer, levels = found(power(order, 4e-3))
    true = 4e-3 * (levels[-1][0] / FIRST) ** order
    assert len(levels) == 2 and levels[0][0] / levels[1][0] == pytest.approx(8.0)
    assert 0.5 < answer.errors["P.x"] / true < 20 and answer.shortfall(Asked(1e-2)) == ""


@pytest.mark.parametrize("order", [0.25, 0.5, 0.75])
def test_a_third_run_knows_the_order(order):
    """Its error is then known to the ratio in which its tolerance differs from the one before."""
    answer, levels = found(power(order, 0.06), 1e-2)
    true = 0.06 * (levels[-1][0] / FIRST) ** order
    assert 3 <= len(levels) <= 9 and 0.9 < answer.errors["P.x"] / true < 8
    assert answer.shortfall(Asked(1e-2)) == "" or answer.errors["P.x"] > 1e-2


def test_gains_are_observed_within_bounds():
    before, now = {X: 8.0, ("Q.x", Norm.RMS): 1.0}, {X: 8.0 / 8**0.5, ("Q.x", Norm.RMS): 0.0}
    assert estimate_gains(now, None, (8, 8), lambda _: (0.25, 0.25, 0.75))[X] == pytest.approx(8**0.25)
    assert estimate_gains(now, before, (8, 8), lambda _: (0.25, 0.25, 0.75))[X] == pytest.approx(8**0.5)
    assert estimate_gains(now, before, (8, 8), lambda _: (0.25, 0.25, 0.25))[X] == pytest.approx(8**0.25)


def test_an_error_that_does_not_get_smaller_ends_as_suspect():
    answer, levels = found(lambda tolerance, time: 0.1 * np.sin(1e3 * tolerance ** (1 / 7)) + 0 * time, 1e-3)
    assert len(levels) <= Levels.runs_at_most
    assert answer.shortfall(Asked(1e-3)).startswith("ACCURACY: 'P.x' is off by")


def test_without_a_finer_run_the_error_is_not_known():
    answer, _ = found(power(0.5, 1e-5), fails=[2])
    assert not answer.errors.known and "not known (2 runs); a finer run ended as NEWTON_DIVERGED" in answer.shortfall(Asked(1e-3))


def test_where_the_coarsest_runs_fail_no_finer_run_is_named():
    answer, levels = found(power(0.5, 1e-3), fails=[1, 2, 3, 4])
    assert answer.run.failure is not None and not answer.reason and answer.count == len(levels) == 4


def test_a_coarse_run_that_fails_is_made_finer_and_a_late_failure_keeps_the_best():
    answer, levels = found(power(0.5, 1e-3), fails=[1])
    assert answer.run.failure is None and answer.errors.known and len(levels) == 3
    late, _ = found(power(0.5, 0.06), 1e-3, fails=[3])
    assert late.errors.known and "a finer run ended as" in late.shortfall(Asked(1e-3))


def test_energies_that_do_not_add_up_are_an_error_of_the_run():
    answer, _ = found(power(0.5, 1e-6), balance=2 * BALANCE_ALLOWED)
    assert answer.worst.key == BALANCE and answer.worst.ratio == pytest.approx(2.0)
    assert found(power(0.5, 1e-6), balance=0.5 * BALANCE_ALLOWED)[0].shortfall(Asked(1e-3)) == ""


# --- chaos ------------------------------------------------------------------------------------------------------------


def exponential(rate, floor=0.0):
    """Runs that part from the right one as exp(rate t), to the size of the motion; from a tolerance on no later."""
    return lambda tolerance, time: (
        np.minimum(1e-3 * max(tolerance, floor) ** 0.75 * np.exp(rate * time), 0.5) * np.cos(20 * time + 7 * np.log(tolerance))
    )


def test_chaos_is_named_by_the_third_or_fourth_run():
    """Digits for e^60 there are none: errors are those up to the separation."""
    answer, levels = found(exponential(120.0))
    assert answer.chaos is Status.CHAOTIC and len(levels) <= 4
    assert 0.02 < answer.errors.until < 0.2 and answer.errors["P.x"] <= 1e-2
    assert "one trajectory to about t = " in answer.errors.notes[0]


def test_refinements_that_cease_to_delay_the_separation_end_as_chaotic():
    """The third run moves it by its share; from a tolerance of 3e-6 on none does."""
    answer, levels = found(exponential(20.0, floor=3e-6))
    assert answer.chaos is Status.CHAOTIC and len(levels) <= 7
    assert 0.3 < answer.errors.until < 0.9 and answer.errors["P.x"] <= 1e-2


def test_one_refinement_that_delays_the_separation_by_little_is_no_chaos():
    """Double pendulums are chaotic for a while only: the refinements before it and after it delay the separation by more."""
    starts = (0.2, 0.4, 0.5, 0.5, 1.0, 1.0, 1.0)

    def off(tolerance, time):
        start = np.interp(np.log(FIRST / tolerance) / np.log(8.0), range(len(starts)), starts)
        return np.where(time > start, 0.3 * np.cos(20 * time + 7 * np.log(tolerance)), 0.0)

    answer, _ = found(off)
    assert answer.chaos is None and answer.errors.until == 1.0


@pytest.mark.parametrize(("order", "chaos"), [(0.0, Status.CHAOTIC), (0.5, None)])
def test_spells_in_which_runs_part_are_chaos_where_refinements_make_them_no_smaller(monkeypatch, order, chaos):
    """Pins rattle for a third of each tenth of the run, and rest: no parting lasts."""
    monkeypatch.setattr(MadeUp, "rattles", True)

    def off(tolerance, time):
        apart = 0.3 * (tolerance / FIRST) ** order * np.cos(20 * time + 7 * np.log(tolerance))
        return np.where(np.abs(time % 0.1 - 0.045) < 0.015, apart, 0.0)

    answer, levels = found(off)
    assert answer.chaos is chaos and (len(levels) <= 4 if chaos else answer.shortfall(Asked(1e-2)) == "")
    assert answer.errors.until == pytest.approx(0.03 if chaos else 1.0, abs=1e-3)


def test_a_motion_within_reach_of_the_digits_is_followed_to_its_end():
    answer, _ = found(exponential(12.0))
    assert answer.chaos is None and answer.errors.until == 1.0 and answer.shortfall(Asked(1e-2)) == ""


def test_a_phase_that_drifts_is_no_chaos():
    def drift(tolerance, time):
        return (np.cos(3 * (1 + 30 * tolerance**0.75) * time) - np.cos(3 * time)) / np.ptp(RIGHT)

    answer, _ = found(drift)
    assert answer.chaos is None and answer.shortfall(Asked(1e-2)) == ""


def test_a_snap_that_comes_later_parts_no_runs():
    def run(at):
        x = np.where((TIME > at) & (TIME < at + 2e-3), 1.0, 0.0)
        return Trajectory(TIME, {"P.x": Signal("P.x", x, "m", Kind.PLACE)}, 1.0)

    assert Separation(Difference(run(0.3), run(0.31)), {X: 1e-2}).start == np.inf


# --- what is demanded -------------------------------------------------------------------------------------------------


def trajectory_of(**signals):
    found = {name.replace("_", "."): Signal(name.replace("_", "."), *rest) for name, rest in signals.items()}
    return Trajectory(TIME, found, 1.0)


def test_what_is_asked_of_which_signal():
    ring = np.sin(50 * TIME)
    run = trajectory_of(
        P_x=(RIGHT, "m", Kind.PLACE), s_short=(RIGHT, "m", Kind.STRETCH), P_vx=(RIGHT, "m/s", Kind.RATE),
        R_fx=(ring, "N", Kind.REACTION), R_fx_mean=(0.1 * ring, "N", Kind.REACTION, "", "", 0.0, 0.01, "R.fx"),
        S_force=(RIGHT, "N", Kind.CONTACT),
    )  # fmt: skip
    contact = {("S.force", norm) for norm in (Norm.RMS, Norm.PEAK, Norm.IMPULSE)}
    assert set(Asked(1e-2).limits(run)) == {X}
    assert set(Asked(1e-2, "forces").limits(run)) == {("R.fx", Norm.RMS), *contact}
    assert set(Asked(1e-2, ["P.vx", "peak(S.force)"]).limits(run)) == {("P.vx", Norm.RMS), ("S.force", Norm.PEAK)}
    assert find_worst(Asked(1e-2, ["P.x", "S.force"]).limits(run), {X: 2e-2, ("S.force", Norm.RMS): 1e-3}).name == "P.x"
    usual = Usual().limits(run)
    assert set(usual) == {X, ("S.force", Norm.IMPULSE), ("S.force", Norm.PEAK)}  # no stretch, no force as a function of time
    assert usual[X] == pytest.approx(5e-3) and usual["S.force", Norm.PEAK] == 0.05


def test_where_nothing_strikes_places_are_right_at_any_time():
    """To a thousandth of the longest link, and to a hundredth of their range in the mean."""
    run = trajectory_of(P_x=(0.1 * RIGHT, "m", Kind.PLACE))
    assert Usual().limits(run) == {X: PLACE_ERROR, ("P.x", Norm.PEAK): pytest.approx(1e-3 / np.ptp(0.1 * RIGHT))}


def test_no_place_is_known_better_than_the_journal_that_holds_it():
    """A tenth of a clearance of 0.1 is 1 % of a range of 1, and 20 % of one of 0.05."""
    journal = 0.01 * RIGHT, "m", Kind.PLACE, "", "", 0.1
    run = trajectory_of(P_x=(RIGHT / 2, "m", Kind.PLACE), Q_x=(RIGHT / 40, "m", Kind.PLACE), J_x=journal)
    allowed = Usual().limits(run)
    assert allowed[X] == pytest.approx(1e-2 / np.ptp(RIGHT / 2), rel=1e-9)
    assert allowed["Q.x", Norm.RMS] == pytest.approx(1e-2 / np.ptp(RIGHT / 40)) and allowed["J.x", Norm.RMS] == 0.1


@pytest.mark.parametrize("solver", [Spectral(), Exudyn()])
def test_no_two_levels_share_a_setting(solver):
    """Two runs that share a longest step, a contact tolerance or elements agree in the error it makes."""
    levels = LEVELS_BY_SOLVER[type(solver)](BAR, 1.0, solver)
    made = [levels.settings(level) for level in (levels.first(), levels.finer(levels.first(), 8.0))]
    (coarse, first), (fine, second) = made
    tolerances = [each.steps.tolerance or usual_tolerance(Scene.of(BAR)) for each in (first, second)]
    assert tolerances[0] / tolerances[1] == pytest.approx(8.0)
    assert 1.5 < first.steps.longest(1.0) / second.steps.longest(1.0) < 2.5
    if isinstance(solver, Spectral):
        assert first.degree == DEGREE and second.degree > first.degree and first.contact_tolerance > second.contact_tolerance
    else:
        assert fine == BAR and coarse != BAR and first.spectral_radius != second.spectral_radius
        assert second == replace(solver, steps=replace(solver.steps, tolerance=usual_tolerance(Scene.of(BAR)), max_step=1 / 200))


def test_two_runs_that_are_the_same_are_right_to_half_the_digits():
    assert found(power(0.5, 0.0))[0].errors["P.x"] == LEAST_ERROR
