"""Goals, ladders, the estimator and the loop: with made-up runs whose errors are known, and broken ones."""

from types import SimpleNamespace

import numpy as np
import pytest

from buckler.mbs import Beam, Closure, Drive, Exudyn, Link, Mechanism, Revolute, Rigid, Section, Spectral, simulate
from buckler.mbs.accuracy import deliver as room
from buckler.mbs.accuracy.compare import Functions, compare, relative
from buckler.mbs.accuracy.deliver import PATIENCE, RUNS, Climb, deliver
from buckler.mbs.accuracy.estimate import BALANCE, REMAINDER, ROUNDING, look, parted
from buckler.mbs.accuracy.goal import ALLOWED, Asked, Usual, worst
from buckler.mbs.accuracy.ladder import STRICTER, ladder_of
from buckler.mbs.elements.signal import Kind, Signal
from buckler.mbs.record.errors import Status
from buckler.mbs.solvers import usual_tolerance

TIME = np.linspace(0.0, 1.0, 401)
RIGHT = np.cos(3 * TIME)
SECTION = Section(0.02, 0.002)


def strip(**more):
    return Mechanism(
        points={"O": (0, 0), "A": (0.3, 0)},
        links=[Link("bar", "O", "A", Beam(SECTION, **more))],
        joints=[Revolute("O", "ground", "bar")],
    )


STRIP = strip()


class Made:
    """A ladder of made-up runs: a place that is off by a share of its range, in time and in space."""

    in_time = True

    def __init__(self, in_time, in_space=0.0, gain=8.0, fails=(), balance=0.0):
        self.off, self.in_space, self.gain, self.fails, self.balance = (in_time, in_space), bool(in_space), gain, fails, balance
        self.made_at = []

    def made(self, time, space, run):
        self.made_at.append((time, space))
        return run(time, space)

    def run(self, time, space):
        failure = (Status.NEWTON_DIVERGED, "made up") if (time, space) in self.fails else None
        off = np.ptp(RIGHT) * (self.off[0] / self.gain**time + self.off[1] / 100.0**space)
        return SimpleNamespace(
            failure=failure, solver=Spectral(), x=RIGHT + off, balance=self.balance, record=SimpleNamespace(time=TIME)
        )


@pytest.fixture(autouse=True)
def made_up(monkeypatch):
    def of(run):
        return Functions(TIME, {"P.x": Signal("P.x", run.x, "m", Kind.PLACE)}, 1.0, run.balance)

    monkeypatch.setattr(room, "Functions", SimpleNamespace(of=of))


def delivered(level=1e-3, **kwargs):
    ladder = Made(**kwargs)
    return ladder, deliver(Climb(ladder, ladder.run), Asked(level))


def test_the_error_is_that_of_the_run_that_is_handed_back():
    ladder, found = delivered(in_time=4e-4)
    assert ladder.made_at == [(0, 0), (1, 0)]
    assert found.run.x[0] == pytest.approx(RIGHT[0] + 4e-4 * np.ptp(RIGHT))
    assert found.errors["P.x"] == pytest.approx(REMAINDER * 4e-4 * 7 / 8)
    assert 1 <= found.errors["P.x"] / 4e-4 <= 2
    assert found.missed(Asked(1e-3)) == ""


def test_time_and_space_are_told_apart_and_each_is_refined_by_itself():
    ladder, found = delivered(in_time=2e-4, in_space=0.5)
    assert found.errors.time["P.x"] == pytest.approx(REMAINDER * 2e-4 * 7 / 8, rel=1e-6)
    assert max(time for time, _ in ladder.made_at) == 1
    assert found.errors.space["P.x"] < 5e-4 < 0.5
    ladder, found = delivered(in_time=0.5, in_space=2e-4)
    assert max(space for _, space in ladder.made_at) == 1
    assert found.errors["P.x"] <= 1e-3
    assert len(ladder.made_at) == len(set(ladder.made_at)), "a run is made once"


def test_a_part_that_may_stay_is_not_refined():
    """In time three tenths of what is allowed, in space more than all of it: next to nothing is left of that by one rung."""
    ladder, found = delivered(in_time=3e-4 / (REMAINDER * 7 / 8), in_space=1.5e-3 * 100 / 99)
    assert ladder.made_at == [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2)]
    assert found.missed(Asked(1e-3)) == ""


def test_a_coarse_run_is_refined_by_as_many_rungs_as_it_takes():
    ladder, found = delivered(level=1e-4, in_time=0.02)
    assert found.errors["P.x"] <= 1e-4
    assert len(ladder.made_at) <= 4


def test_what_does_not_get_better_is_told_and_ends():
    ladder, found = delivered(in_time=0.1, gain=1.05)
    assert len(ladder.made_at) <= 2 + 2 * PATIENCE < RUNS
    said = found.missed(Asked(1e-3))
    assert said.startswith("ACCURACY: 'P.x' is off by")
    assert "allowed 0.1 %" in said


def test_what_gets_better_slowly_ends_too():
    """A known error is not worth more than some ten runs."""
    ladder, found = delivered(in_time=1e3, gain=1.2)
    assert 8 <= len(ladder.made_at) <= 16
    assert found.missed(Asked(1e-3))


def bounced(rebound):
    """A ball that falls on a stop and comes back as quickly as it is told: parabolas, and the blow as a half-sine of 10 ms."""
    speed, blow, time = 2.0, 1e-2, np.linspace(0, 0.4, 4001)
    up = np.maximum(time - 0.2, 0.0)
    y = np.where(time < 0.2, speed * (0.2 - time), rebound * speed * up)
    push = np.where((time > 0.2) & (time < 0.2 + blow), np.sin(np.pi * up / blow) * speed * (1 + rebound), 0.0)
    return Functions(time, {"y": Signal("y", y, "m", Kind.PLACE), "c": Signal("c", push, "N", Kind.CONTACT)}, 0.4)


def swung(slow):
    """A pendulum through one period, by a clock that is slow."""
    time = np.linspace(0, 1, 1001)
    return Functions(time, {"x": Signal("x", np.sin(2 * np.pi * (1 - slow) * time), "m", Kind.PLACE)}, 1.0)


def pulled(share):
    """A spring that pulls as hard."""
    time = np.linspace(0, 1, 1001)
    return Functions(time, {"s.force": Signal("s.force", share * np.sin(9 * time), "N", Kind.INTERNAL)}, 1.0)


@pytest.mark.parametrize(
    ("made", "right", "fine", "wrong"),
    [(bounced, 0.5, 0.495, 0.45), (swung, 0.0, 1e-4, 1e-3), (pulled, 1.0, 0.97, 0.7)],
)
def test_what_nobody_asks_better_of(made, right, fine, wrong):
    """Restitutions are known to a few percent, forces to ten; a clock is right by 10 s a day, not by 100 s."""
    for value, within in ((fine, True), (wrong, False)):
        off = relative(compare(made(value), made(right)))
        assert (worst(Usual(), made(right), off).ratio <= 1) == within, off


def test_impulses_are_known_to_a_few_percent():
    """Those of a blow by a restitution that is as much off."""
    for rebound, within in ((0.45, True), (0.2, False)):
        off = relative(compare(bounced(rebound), bounced(0.5)))
        assert (off["c.impulse"] <= Usual().limits(bounced(0.5))["c.impulse"]) == within


def test_an_error_nobody_knows_is_no_error_of_nothing():
    _, found = delivered(in_time=1e-5, fails=[(1, 0)])
    assert not found.errors.known
    assert "not known" in found.missed(Asked(1e-3))


def test_a_coarse_run_that_fails_is_made_finer():
    _, found = delivered(in_time=1e-3, fails=[(0, 0)])
    assert found.run.failure is None
    assert found.errors.known


def test_energies_that_do_not_add_up_are_an_error_of_the_run():
    _, found = delivered(in_time=1e-6, balance=2 * ALLOWED)
    assert found.worst.name == BALANCE
    assert found.worst.ratio == pytest.approx(2.0)
    assert delivered(in_time=1e-6, balance=0.5 * ALLOWED)[1].missed(Asked(1e-3)) == ""


def chaotic(rate, size=1e-9):
    def functions(off):
        return Functions(TIME, {"P.x": Signal("P.x", RIGHT + off, "m", Kind.PLACE)}, 1.0)

    return functions(np.minimum(size * np.exp(rate * TIME), 1.0)), functions(0.0 * TIME)


def test_a_difference_that_explodes_parts_two_runs():
    until = parted(*chaotic(40.0))
    assert 0 < until < np.log(0.1 * np.ptp(RIGHT) / 1e-9) / 40
    assert parted(*chaotic(2.0)) == np.inf


@pytest.mark.parametrize("wrong", ["speeds", [], ["x"], 3])
def test_an_accuracy_of_nothing_is_refused(wrong):
    with pytest.raises(ValueError, match="'places', 'forces', 'means', or a list"):
        Asked(1e-3, wrong)


def functions_of(**signals):
    return Functions(TIME, {name.replace("_", "."): Signal(name.replace("_", "."), *rest) for name, rest in signals.items()}, 1.0)


def test_what_is_asked_of_which_signal():
    ring = np.sin(50 * TIME)
    run = functions_of(
        P_x=(RIGHT, "m", Kind.PLACE), P_vx=(RIGHT, "m/s", Kind.RATE), R_fx=(ring, "N", Kind.REACTION),
        R_fx_mean=(0.1 * ring, "N", Kind.REACTION, "", "", 0.0, 0.01), S_force=(RIGHT, "N", Kind.CONTACT),
    )  # fmt: skip
    assert set(Asked(1e-2).limits(run)) == {"P.x"}
    assert set(Asked(1e-2, "forces").limits(run)) == {"R.fx", "S.force", "S.force.peak", "S.force.impulse"}
    assert set(Asked(1e-2, "means").limits(run)) == {"R.fx.mean", "S.force", "S.force.peak", "S.force.impulse"}
    assert set(Asked(1e-2, ["P.vx", "S.force.peak"]).limits(run)) == {"P.vx", "S.force.peak"}
    assert worst(Asked(1e-2, ["P.x", "S.force"]), run, {"P.x": 2e-2, "S.force": 1e-3}).name == "P.x"


def left_of_a_bow(degree):
    """What a polynomial leaves of half a wave, the first shape of a strip that buckles."""
    x = np.linspace(-1, 1, 201)
    return np.abs(np.polynomial.Chebyshev.fit(x, np.cos(np.pi * x / 2), degree)(x) - np.cos(np.pi * x / 2)).max()


@pytest.mark.parametrize("level", [1e-2, 1e-3])
@pytest.mark.parametrize("solver", [Spectral(), Exudyn()])
def test_no_two_rungs_share_a_tolerance_or_a_longest_step(solver, level):
    """To 1 % the longest steps were 0.95 of each other, and errors were told a seventh of what they were."""
    ladder, made = ladder_of(STRIP, 1.0, level, solver), []
    assert ladder.in_space
    for rung in ((0, 0), (1, 0), (2, 0), (0, 1)):
        ladder.made(*rung, lambda mechanism, _duration, solver: made.append((mechanism, solver)))
    first, second, third, wide = made
    tolerances = [solver.steps.tolerance or usual_tolerance(STRIP) for _, solver in (first, second, third)]
    assert tolerances[0] / tolerances[1] == pytest.approx(STRICTER)
    assert tolerances[1] / tolerances[2] == pytest.approx(STRICTER)
    longest = [solver.steps.longest(1.0) for _, solver in (first, second, third)]
    assert longest[0] / longest[1] == pytest.approx(longest[1] / longest[2])
    assert 1.5 < longest[0] / longest[1] < 2.5  # less would tell little, more would cost more than the run itself
    assert wide[1].steps == first[1].steps
    if isinstance(solver, Spectral):
        assert wide[1].degree == first[1].degree + 2
        assert left_of_a_bow(first[1].degree) < 1e-3 < left_of_a_bow(first[1].degree - 3)
    else:
        assert wide[0].link("bar").body.count == 2 * first[0].link("bar").body.count
        assert first[1].spectral_radius < second[1].spectral_radius  # so that what damping takes is in the difference
        assert second[1].spectral_radius ** first[1].steps.number(1.0) < 1e-3, "what steps do not follow is gone within a run"


def test_closure_has_no_space_and_its_finer_rung_has_more_samples():
    crank = Mechanism(
        points={"O": (0, 0), "A": (0.1, 0)}, links=[Link("bar", "O", "A", Rigid(SECTION))],
        joints=[Revolute("O", "ground", "bar")], drives=[Drive("bar", 3.0)],
    )  # fmt: skip
    ladder, made = ladder_of(crank, 1.0, 1e-3, Closure()), []
    assert not ladder.in_space
    for k in (0, 1):
        ladder.made(k, 0, lambda _mechanism, _duration, solver: made.append(solver))
    assert made[0] == Closure()
    assert made[1].steps.max_step is not None
    with pytest.raises(ValueError, match="no accuracy; give accuracy"):
        simulate(crank, 1.0, of="forces")


def test_a_solver_with_an_accuracy_climbs_its_own_ladder(monkeypatch):
    monkeypatch.undo()  # the real functions of runs
    swinging = Mechanism(
        points={"O": (0, 0), "A": (0.3, 0)},
        links=[Link("bar", "O", "A", Rigid(SECTION))],
        joints=[Revolute("O", "ground", "bar")],
        gravity=(0.0, -9.81),
    )
    for solver in (Spectral(), Exudyn()):
        result = simulate(swinging, 0.5, accuracy=1e-4, of="forces", solver=solver)
        assert result.ok, result.message
        assert 0 < result.error["O.ground-bar.fx"] <= 1e-4 == result.asked
        assert result.work["runs"] == result.work[f"{type(solver).__name__.lower()}_runs"] >= 2
        assert set(result.error.time) == set(result.error.signals)


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("begins", [0.0, 0.4])
def test_a_difference_that_grows_by_a_power_of_time_parts_no_runs(power, begins):
    """Of steps that do not follow a vibration: it was taken for chaos, and the error told up to a fiftieth of the run."""
    off = np.maximum(TIME - begins, 0.0) ** power
    runs = [Functions(TIME, {"P.x": Signal("P.x", RIGHT + each, "m", Kind.PLACE)}, 1.0) for each in (off, 0.0 * TIME)]
    assert parted(*runs) == np.inf


def test_of_a_ringing_that_steps_do_not_follow_neither_norm_nor_peak_is_known():
    """The sharp front of a strip that spins at once: both runs lose it, its peak was 0.9 off and 0.014 told."""
    run = functions_of(R_fx=(RIGHT, "N", Kind.REACTION), R_fx_mean=(RIGHT, "N", Kind.REACTION, "", "", 0.0, TIME[1]))
    in_time, _ = look(run, run).told
    assert in_time["R.fx"] == in_time["R.fx.peak"] == np.inf
    assert in_time["R.fx.mean"] == in_time["R.fx.impulse"] == ROUNDING


class Exploding(Made):
    """Made-up runs whose error grows by exp(40 t)."""

    def run(self, time, space):
        off = np.minimum(self.off[0] * np.exp(40 * TIME) / self.gain**time, 1.0) * np.ptp(RIGHT)
        return SimpleNamespace(failure=None, solver=Spectral(), x=RIGHT + off, balance=0.0, record=SimpleNamespace(time=TIME))


def test_rungs_that_part_hardly_later_are_one_of_many():
    ladder = Exploding(in_time=1e-8, gain=8.0)
    found = deliver(Climb(ladder, ladder.run), Asked(1e-3))
    assert found.errors.until == pytest.approx(np.log(1e-3 / (1e-8 / 8 * 7 / 8)) / 40, abs=0.01)
    assert "one of many" in found.errors.notes[0]


def test_rungs_that_part_later_and_later_are_refined_until_they_are_one():
    ladder = Exploding(in_time=1e-6, gain=1e5)
    found = deliver(Climb(ladder, ladder.run), Asked(1e-3))
    assert found.errors.until == TIME[-1] and not found.errors.notes
    assert found.missed(Asked(1e-3)) == "" and len(ladder.made_at) == 5
