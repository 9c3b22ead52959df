"""What decides whether runs converge, piece by piece: the rest of a series, what is refined next, when to stop."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from simulations import BAR

from buckler.mbs import (
    Cable,
    Clearance,
    Controlled,
    Exudyn,
    Link,
    Mass,
    Mechanism,
    Revolute,
    Rigid,
    Section,
    Spectral,
    Strut,
    crank_rocker,
    simulate,
    slider_crank,
)
from buckler.mbs.accuracy import delivery, refine, verify
from buckler.mbs.accuracy.band import banded, unresolved
from buckler.mbs.accuracy.by_signal import Signals, _norm, _of_force, by_signal
from buckler.mbs.accuracy.delivery import Delivery, Task, comparable
from buckler.mbs.accuracy.difference import _gap, difference, differences
from buckler.mbs.accuracy.extrapolation import _Extrapolation, _FailedError, extrapolated
from buckler.mbs.accuracy.plan import Plan
from buckler.mbs.accuracy.sampling import sampled
from buckler.mbs.accuracy.tolerance import _Tolerance, left_with_play
from buckler.mbs.engine.solve import once as once_of_engine
from buckler.mbs.functions import Expression
from buckler.mbs.kinematics.exact import once as closed_once
from buckler.mbs.kinematics.inertias import axial_period
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.result import Result
from buckler.mbs.record.status import Status
from buckler.mbs.spectral.accuracy import MOST_TAUT, TAUT, known
from buckler.mbs.spectral.run import once
from buckler.mbs.spectral.scene import Scene


@pytest.mark.parametrize(
    ("apart", "before", "error"),
    [
        (1e-3, 1e-2, 1.25e-3),  # an eighth of the one before, more than the rest of the series, 1.1e-4
        (2e-3, 1e-2, 2.5e-3),  # itself and a quarter
        (8e-3, 1e-2, 3.2e-2),  # converges slowly: r^2/(1 - r) of the one before
        (5e-5, 9e-5, 6.25e-5),  # both below what counts
        (2e-2, 1e-2, np.inf),  # does not converge
    ],
)
def test_the_rest_of_three_runs_with_clearance(apart, before, error):
    assert left_with_play(apart, before, 1e-3) == pytest.approx(error, rel=1e-12)


def without_runs(asked):
    """An extrapolation whose runs are not made."""
    own = _Extrapolation.__new__(_Extrapolation)
    own.plan, own.first, own.runs = SimpleNamespace(asked=asked, mesh=lambda: 8, meshed=True), 100, {}
    return own


@pytest.mark.parametrize(
    ("in_time", "in_space", "steps", "mesh"),
    [(9e-4, 1e-4, 200, 8), (1e-4, 9e-4, 100, 12), (9e-4, 9e-4, 200, 12), (3e-4, 3e-4, 200, 8)],
)
def test_what_errs_more_than_its_half_is_made_finer(in_time, in_space, steps, mesh):
    assert without_runs(1e-3).refine(100, 8, in_time, in_space) == (steps, mesh)


@pytest.mark.parametrize(
    ("series", "made"),
    [
        ([1e-1, 9e-2, 8.5e-2, 8e-2], 3),
        ([1e-1, 1e-2, 9e-3, 2e-3], 4),
        ([1e-1, 9e-4, 1e-9, 1e-9], 2),
        ([5e-1, 1e-1, 3e-2, 1e-2], 4),
    ],
)
def test_two_refinements_in_turn_that_do_not_help_are_the_end(monkeypatch, series, made):
    own, left = without_runs(1e-3), list(series)

    def estimate(steps, mesh):
        reached = left.pop(0)
        return Delivery(SimpleNamespace(failure=None), reached, Errors(reached, {}, "steps"), {}, {}), reached, 0.0

    monkeypatch.setattr(own, "estimate", estimate)
    assert own.deliver().reached == min(series[:made]) and len(left) == len(series) - made


@pytest.mark.parametrize(("apart", "many"), [(2.0, True), (0.01, False)])
def test_a_motion_is_one_of_many_where_another_clearance_gives_another(monkeypatch, apart, many):
    monkeypatch.setattr(refine, "comparable", lambda run: run)
    mechanism = crank_rocker(
        BAR, speed=30.0, play=lambda point, pin, bush: Clearance(point, pin, bush, 5e-3, 1e-4, KelvinVoigt(1e8, 1e3))
    )
    seen = []

    def run(*given):
        seen.append(given[0])
        return SimpleNamespace(failure=None)

    own = SimpleNamespace(task=SimpleNamespace(duration=0.1), run=run)
    first = SimpleNamespace(record=SimpleNamespace(mechanism=mechanism), solver=None)
    assert refine._one_of_many(own, first, SimpleNamespace(apart=lambda a, b: apart * refine.BOUND * refine.ASKED)) is many
    gaps = [[joint.gap for joint in each.joints if hasattr(joint, "gap")] for each in (*seen, mechanism)]
    assert gaps[0] and all(0 < new / old - 1 < 0.01 for new, old in zip(*gaps, strict=True))


def test_means_are_over_time_wherever_it_starts():
    time = np.linspace(3.0, 5.0, 2001)
    assert _norm(time, np.sin(np.pi * time)) == pytest.approx(np.sqrt(0.5), rel=1e-5)


def test_a_force_differs_by_peak_mean_square_and_impulse():
    time = np.linspace(0.0, 2.0, 2001)

    def signals(values):
        return Signals(Result(Status.OK, "", time, {"A.contact_force": values}, {"A.contact_force": "N"}, {}))

    found = _of_force(signals(11 * np.sin(np.pi * time) ** 2), signals(10 * np.sin(np.pi * time) ** 2), "A.contact_force", 1e-9)
    assert {key: pytest.approx(0.1, rel=1e-3) for key in found} == found


def test_runs_of_other_times_are_compared_by_straight_lines_where_one_is_too_short_for_a_cubic():
    """A line against a parabola, 1/4 - (x - 1/2)^2 apart: sqrt(1/30) in the mean."""

    def line(time, values):
        return Result(Status.OK, "", time, {"A.x": values}, {"A.x": "m"}, {})

    time = np.linspace(0.0, 1.0, 101)
    found = by_signal(line(np.array([0.0, 1.0]), np.array([0.0, 1.0])), line(time, time**2))
    assert found["A.x"] == pytest.approx(np.sqrt(1 / 30), rel=1e-3) and found["A.x.peak"] == pytest.approx(0.25)


def ringing(steps):
    """A strip that rings every 0.8 ms, 0.47 s long, its plan, and how many steps lie between samples."""
    mechanism = crank_rocker(Cable(Section(0.03, 5e-4), elements=8), speed=20.0)
    plan = Plan(mechanism, 0.47, 1e-3)
    return axial_period(mechanism), plan, plan.solver(steps, 4, 1.0).steps.record_every


@pytest.mark.parametrize("steps", [100, 2000, 7168, 30000])
def test_samples_lie_close_enough_for_means_over_a_period(steps):
    """A force averaged over a period was 2.4 times too small where its samples were farther apart than that."""
    period, plan, every = ringing(steps)
    apart = every * plan.duration / steps
    assert every == 1 or period / 16 < apart <= period / 8


@pytest.mark.parametrize(("a_period", "peak", "rms"), [(2.0, 0.3, 0.1), (3.99, 0.3, 0.1), (4.01, 1e-3, 1e-3), (8.0, 1e-3, 1e-3)])
def test_forces_that_ring_are_not_known_where_steps_do_not_resolve_the_period_they_are_means_over(a_period, peak, rms):
    period, plan, _ = ringing(100)
    units = {"B.coupler-rocker.fx": "N", "B.contact_force": "N", "B.x": "m"}
    force = "B.coupler-rocker.fx"
    errors = dict.fromkeys([*units, f"{force}.peak", f"{force}.rms", f"{force}.impulse", "B.contact_force.peak"], 1e-3)
    found = unresolved(plan.mechanism, period / a_period, errors, units)
    assert found == errors | {force: peak, f"{force}.peak": peak, f"{force}.rms": rms}
    larger = unresolved(plan.mechanism, period, dict.fromkeys(errors, 0.5), units)
    assert larger == dict.fromkeys(errors, 0.5)


def test_a_run_of_the_compiled_solver_tells_that_it_does_not_resolve_how_a_strut_rings():
    """Peaks were told to 7e-4 and 19 % off: 17 ms a step, 1.6 ms a period."""
    mechanism = slider_crank(Strut(Section(0.03, 3e-4)), law=None, mass=0.3, speed=3.0)
    duration = 4 * np.pi / 3
    assert duration > MOST_TAUT / TAUT * axial_period(mechanism)
    result = simulate(mechanism, duration, 1e-2)
    assert result.work["spectral_runs"] > 0 and result.status == Status.OK
    assert (
        result.error["drive.torque.peak"] >= 0.3 > 0.1 == result.error["drive.torque.rms"] > result.error["drive.torque.impulse"]
    )


def test_struts_ring_like_strips():
    """A spring E A/L that holds all mass there is."""
    section = Section(0.03, 3e-4)
    mechanism = slider_crank(Strut(section), law=None, mass=0.3, speed=3.0)
    mass = 0.3 + mechanism.link("crank").mass(mechanism.length("crank"))
    expected = 2 * np.pi * np.sqrt(mass * mechanism.length("coupler") / section.axial_stiffness)
    assert axial_period(mechanism) == pytest.approx(expected)


def test_steps_too_long_to_end_at_all_do_not_count_as_refinements(monkeypatch):
    """A strip that starts with a spin needed 2048, 32 were tried first."""
    own, tried = without_runs(1e-3), []
    failed = SimpleNamespace(failure=(Status.NEWTON_DIVERGED, "no convergence"))

    def estimate(steps, mesh):
        tried.append(steps)
        if steps < 2000:
            raise _FailedError(failed)
        return Delivery(SimpleNamespace(failure=None), 1e-4, Errors(1e-4, {}, "steps"), {}, {}), 1e-4, 0.0

    monkeypatch.setattr(own, "first", 32)
    monkeypatch.setattr(own, "estimate", estimate)
    assert own.deliver().reached == 1e-4 and tried == [32, 128, 512, 2048]


def test_a_strip_with_a_point_within_is_made_finer_by_each_run_of_a_series():
    """Its pieces have two degrees less, and once had four in the first two runs: an error of 2e-3 was told as 3e-6."""
    body = Cable(Section(0.03, 2.8e-3), imperfection=0.02)
    mechanism = Mechanism(
        {"O": (0.0, 0.0), "A": (0.46, 0.0)},
        [Link("link", "O", "A", body, carries={"M": 0.6})],
        joints=[Revolute("O", "ground", "link")],
        masses=[Mass("M", 0.05)],
        velocities={"link": -10.0},
    )
    degrees = [len(Scene.of(mechanism, degree).q0) for degree in (4, 6, 8)]
    assert degrees == sorted(set(degrees))
    found = known(mechanism, 0.05, 1e-2)
    fine = once(mechanism, 0.05, Spectral(Controlled(1e-8), degree=14))
    assert difference(comparable(found.run), comparable(fine)) < found.errors.motion < 1e-2


def test_errors_by_steps_and_by_elements_add_up_before_a_finer_run_is_spared(monkeypatch):
    """What is left of 6e-4 by steps and elements is beyond half of 1e-3; 3e-4 is not: only other errors are left then."""
    for in_space, made in ((3e-4, 4), (1e-5, 1)):
        own, calls = without_runs(1e-3), []

        def estimate(steps, mesh, in_space=in_space, calls=calls):
            calls.append(steps)
            reached = 1.0 / 4 ** len(calls)
            return Delivery(SimpleNamespace(failure=None), reached, Errors(reached, {}, "steps"), {}, {}), 3e-4, in_space

        monkeypatch.setattr(own, "estimate", estimate)
        own.deliver()
        assert len(calls) == made


def test_runs_with_clearance_begin_with_the_largest_tolerances(monkeypatch):
    own, made = _Tolerance.__new__(_Tolerance), []
    own.task = SimpleNamespace(asked=1e-3, duration=1.0, mechanism=crank_rocker(BAR, speed=30.0))
    own.plan, own.runs = SimpleNamespace(meshed=False), {}

    def start(finer, mesh=1.0):
        made.append(finer)
        return SimpleNamespace(failure=(Status.SINGULAR, ""))

    monkeypatch.setattr(own, "start", start)
    assert own.deliver().run.failure is not None and made[:3] == pytest.approx([1 / 64, 1 / 8, 1.0])


def test_a_run_may_take_what_the_ones_before_have_left(monkeypatch):
    clock, given = SimpleNamespace(now=100.0), []
    monkeypatch.setattr(delivery, "perf_counter", lambda: clock.now)
    own = delivery.Delivering(Task(None, 1.0, 1e-3, patience=10.0), lambda *arguments: given.append(arguments[3]))
    for passed in (0.0, 4.0, 20.0):
        clock.now = 100.0 + passed
        own.run(None, 1.0, Exudyn())
    assert given == pytest.approx([10.0, 6.0, 1e-3]) and own.runs == {"exudyn": 3}


def test_samples_of_a_linkage_are_doubled():
    mechanism, made = slider_crank(Rigid(Section(0.03, 5e-3)), law=None, mass=0.3, speed=Expression("3+sin(40*t)")), []

    def run(mechanism, duration, solver, *rest):
        made.append((solver.steps.max_step, closed_once(mechanism, duration, solver, None, None)))
        return made[-1][1]

    sampled(Task(mechanism, 1.0, 1e-12), run)
    for (_, before), (longest, after) in pairwise(made):
        intervals = len(before.record.time) - 1
        assert longest == pytest.approx(1.0 / (2 * intervals), rel=1e-12) and len(after.record.time) - 1 >= 2 * intervals


@pytest.mark.parametrize(("closed", "gap"), [(True, 9e-4), (False, 1e-3)])
def test_a_clearance_is_the_eccentricity_less_the_penetration(closed, gap):
    """Of a journal that never touches it is the largest eccentricity."""
    depth = np.array([0.0, 1e-4, 0.0]) if closed else np.full(3, -1e-5)
    signals = {"A.journal_x": np.array([0.0, 1e-3, 2e-4]), "A.journal_y": np.zeros(3), "A.penetration": depth}
    assert _gap(Result(Status.OK, "", np.arange(3.0), signals, {}, {}), "A") == pytest.approx(gap)


@pytest.mark.parametrize(("off", "compared"), [(5e-7, True), (5e-6, False)])
def test_runs_that_end_at_other_times_are_not_compared(off, compared):
    def moved(end):
        time = np.linspace(0.0, end, 50)
        return Result(Status.OK, "", time, {"A.x": time, "A.y": time, "A.vx": 1 + 0 * time, "A.vy": 1 + 0 * time}, {}, {})

    assert ("duration" not in differences(moved(1.0 + off), moved(1.0))) is compared


def test_forces_of_a_few_samples_are_means_too():
    mechanism = crank_rocker(Cable(Section(0.03, 5e-4), elements=8), speed=20.0)
    for samples, averages in ((2, False), (3, True), (5, True)):
        time = np.linspace(0.0, 2e-3, samples)
        found = banded(mechanism, time, {"A.crank-coupler.fx": time**2}, {"A.crank-coupler.fx": "N"})
        assert bool(found) is averages


def test_a_solver_beside_another_tells_its_error_only_where_an_accuracy_was_asked():
    mechanism = slider_crank(Rigid(Section(0.03, 5e-3)), law=KelvinVoigt(1e5, 1e2), mass=0.3, speed=20.0)

    def run(mechanism, duration, solver, *rest):
        return once(mechanism, duration, solver)

    without, asked = (verify._run(mechanism, 0.05, Spectral, accuracy, run) for accuracy in (0.0, 1e-2))
    assert not without.errors.known and asked.errors.known
    assert without.run.solver == Spectral() != asked.run.solver


@pytest.mark.parametrize(("mass", "each"), [(0.3, True), (1e3, False)])
def test_energies_have_errors_where_each_step_was_recorded(mass, each):
    """A heavy slider rings slowly: fewer samples serve."""
    mechanism = slider_crank(Cable(Section(0.03, 2e-3)), law=None, mass=mass, speed=1.0)

    def run(mechanism, duration, solver, *rest):
        return once_of_engine(mechanism, duration, solver, None, None)

    found = extrapolated(Task(mechanism, 1.0, 1e-1), run)
    assert (found.run.solver.steps.record_every == 1) is each and ("energy.kinetic" in found.errors.signals) is each
