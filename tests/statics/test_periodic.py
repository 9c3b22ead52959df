"""Periodic motions and their multipliers: closed forms, Hill's determinant, and own integrations of the same equations."""

import numpy as np
import pytest
from returned_states import block, hill, returned, start_at
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from buckler import mbs
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.statics.cycles import describe_change


def monodromy(right, state, period):
    """Where an own run ends, and dP/dx by central differences of it."""

    def run(y):
        return solve_ivp(right, (0, period), y, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]

    h = 1e-5
    return run(state), np.array([(run(state + e) - run(state - e)) / (2 * h) for e in h * np.eye(2)]).T


def multipliers(matrix):
    values = np.linalg.eigvals(matrix)
    return values[np.argsort(-np.abs(values), kind="stable")]


def test_a_damped_oscillator_swings_as_in_closed_form():
    stiffness, damping, force, speed = 25.0, 0.6, 1.5, 4.0
    made = block(
        mbs.Spring("P", "ground:S", stiffness=stiffness, damping=damping),
        mbs.Force("P", lambda t: (force * np.cos(speed * t), 0.0)),
    )
    found = mbs.periodic(made, 2 * np.pi / speed)
    exact = np.exp(np.roots([1.0, damping, stiffness]) * found.period)
    response = force / (stiffness - speed**2 + 1j * damping * speed)
    assert found.status == "OK"
    assert found.stable
    assert np.sort_complex(found.multipliers) == pytest.approx(np.sort_complex(exact), abs=1e-8)
    assert (np.abs(np.sort_complex(found.multipliers) - np.sort_complex(exact)) <= 2 * found.errors + 1e-9).all()
    assert found.point("block", "P")[0, 0] == pytest.approx(response.real, rel=1e-7)
    assert found.amplitude("block", "P")[0] == pytest.approx(abs(response), rel=1e-6)


@pytest.mark.parametrize("point", [(0.2, 0.1), (0.27, 0.2), (1.1, 0.3), (1.03, 0.5), (-0.05, 0.5), (-0.05, 0.2)])
def test_mathieu_is_stable_outside_the_tongues_of_hills_determinant(point):
    delta, epsilon = point
    made = mbs.Mechanism(
        {"O": (0, 0), "A": (1, 0)}, [mbs.Link("bar", "O", "A", mbs.Rigid.of(mass=1.0, inertia=0.2, centre=(0, 0)))],
        [mbs.Revolute("O", "ground", "bar")],
        loads=[mbs.Torque("bar", lambda t, angle, speed: -0.2 * (delta + epsilon * np.cos(t)) * angle)],
    )  # fmt: skip
    found, trace = mbs.periodic(made, 2 * np.pi), hill(delta, epsilon)
    assert found.multipliers.sum().real == pytest.approx(trace, abs=1e-6)
    assert found.multipliers.prod().real == pytest.approx(1.0, abs=1e-6)
    assert found.stable == (abs(trace) < 2)
    assert found.stable or ("alternates" in found.message) == (trace < -2)


def duffing(t, y):
    return [y[1], -y[0] - y[0] ** 3 - 0.1 * y[1] + 0.3 * np.cos(1.6 * t)]


@pytest.mark.parametrize(("which", "stable"), [(0, True), (1, False), (2, True)])
def test_duffings_three_motions_at_one_frequency(which, stable):
    """Hardening: between the folds the smallest and the largest are stable. Harmonic balance is where both searches begin."""
    made = block(
        mbs.Spring("P", "ground:S", stiffness=0.0, free_length=10.0, law=lambda e, rate: e + e**3 + 0.1 * rate),
        mbs.Force("P", lambda t: (0.3 * np.cos(1.6 * t), 0.0)),
    )
    period, off = 2 * np.pi / 1.6, 1 - 1.6**2
    squares = np.sort(np.roots([0.75**2, 1.5 * off, off**2 + 0.16**2, -(0.3**2)]).real)
    response = 0.3 / (off + 0.75 * squares[which] + 0.16j)
    y = np.array([response.real, -1.6 * response.imag])
    for _ in range(5):  # Newton's method on an own integration
        end, matrix = monodromy(duffing, y, period)
        y = y - np.linalg.solve(matrix - np.eye(2), end - y)
    near, moving = start_at(mbs.periodic(made, period), made, y + 1e-3)
    found = mbs.periodic(made, period, start=near)
    assert [found.q[0, moving], found.v[0, moving]] == pytest.approx(y, abs=1e-7)
    assert found.multipliers == pytest.approx(multipliers(matrix), abs=1e-6)
    assert found.stable == stable


def test_van_der_pols_cycle_finds_its_own_period():
    made = block(mbs.Spring("P", "ground:S", stiffness=0.0, free_length=9.9, law=lambda e, rate: e - (1 - e * e) * rate))
    found = mbs.periodic(made, 6.0)
    assert found.period == pytest.approx(6.6632868593231302, rel=1e-9)
    assert found.multipliers[0] == pytest.approx(1.0, abs=1e-6)
    y = np.array([found.point("block", "P")[0, 0] * -1 + 0.1, -found.v[0, np.argmax(np.abs(found.v).max(axis=0))]])
    _, matrix = monodromy(lambda t, y: [y[1], (1 - y[0] ** 2) * y[1] - y[0]], y, found.period)
    assert found.multipliers[1] == pytest.approx(multipliers(matrix)[1], abs=1e-6)
    assert found.stable
    assert (found.trivial, str(found).count("trivial multiplier")) == (0, 1)


def test_a_block_on_a_belt_sticks_and_slips():
    """Stribeck's friction, smooth within 1 mm/s, on a belt of 0.2 m/s; while it sticks all that differs is forgotten."""
    stiffness, belt, weight = 100.0, 0.2, 10.0

    def force(e, rate):
        slip = rate - belt
        return stiffness * e + weight * (0.3 + 0.2 * np.exp(-((slip / 0.1) ** 2))) * np.tanh(slip / 1e-3)

    def turns(t, y):
        return y[1]

    turns.direction = -1
    own = solve_ivp(lambda t, y: [y[1], -force(*y)], (0, 6), [0.03, 0.0], method="Radau", rtol=1e-10, atol=1e-12, events=turns)
    found = mbs.periodic(block(mbs.Spring("P", "ground:S", stiffness=0.0, free_length=10.0, law=force)), 0.6, settle=5)
    assert found.period == pytest.approx(np.diff(own.t_events[0])[-1], rel=1e-8)
    assert found.amplitude("block", "P")[0] == pytest.approx(np.ptp(own.y[0][own.t > 3]) / 2, rel=1e-3)  # by its steps
    assert found.trivial == 0
    assert abs(found.multipliers - [1.0, 0.0]) == pytest.approx([0.0, 0.0], abs=1e-6)
    assert found.stable


def test_a_pendulum_keeps_the_period_of_its_swing():
    made = mbs.Mechanism(
        {"O": (0, 0), "A": (0.6, -0.8)}, [mbs.Link("bar", "O", "A", mbs.Rigid.of(mass=1.0, inertia=1 / 12, centre=(0.5, 0)))],
        [mbs.Revolute("O", "ground", "bar")], gravity=(0, -9.81),
    )  # fmt: skip
    found = mbs.periodic(made, 1.7)
    _, y = found.point("bar", "A")[0]
    speed = np.abs(found.v[0]).max()  # that of the angle: the centre is half as far
    swing = np.arccos(-y - speed**2 / (2 * 9.81 * 0.5 * 3))
    assert found.period == pytest.approx(4 * ellipk(np.sin(swing / 2) ** 2) / np.sqrt(9.81 * 0.5 * 3), rel=1e-8)
    assert (np.abs(found.multipliers - 1) <= 1.01 * found.errors).all()
    assert found.stable


@pytest.mark.slow
def test_a_block_that_strikes_a_stop_each_period():
    gap, law, period = 0.02, KelvinVoigt(40.0, 0.3), 2 * np.pi / 5
    made = block(
        mbs.Spring("P", "ground:S", stiffness=9.0, damping=0.4), mbs.Force("P", lambda t: (1.2 * np.cos(5.0 * t), 0.0)),
        stops=[mbs.Stop("P", at=gap, law=law, along=(1, 0))],
    )  # fmt: skip
    found = mbs.periodic(made, period, settle=20)
    moving = int(np.argmax(np.abs(found.v).max(axis=0)))
    y, exact = returned(
        [found.point("block", "P")[0, 0], found.v[0, moving]], period,
        lambda t, x, v: -9.0 * x - 0.4 * v + 1.2 * np.cos(5.0 * t), lambda t, x, v: (-9.0, -0.4), law, 1.0, gap,
    )  # fmt: skip
    assert found.point("block", "P")[:, 0].max() > 1.5 * gap
    assert [found.point("block", "P")[0, 0], found.v[0, moving]] == pytest.approx(y, abs=1e-8)
    assert np.abs(found.multipliers - exact).max() <= min(2 * found.errors.max() + 1e-8, 1e-6)
    assert found.stable


def test_multipliers_beside_a_graze_are_those_of_the_motion_without_the_stop():
    """The stop stands 2e-7 m beyond the amplitude: a difference across its touch would tell it unstable."""
    damping, rate, push = 0.06, 2.2, 0.5
    amplitude = push / np.hypot(1 - rate**2, damping * rate)
    stop = mbs.Stop("P", at=amplitude + 2e-7, law=KelvinVoigt(1e4, 0.0), along=(1, 0), link="block")
    spring = mbs.Spring("P", "ground:S", stiffness=1.0, damping=damping)
    made = block(spring, mbs.Force("P", lambda t: (push * np.cos(rate * t), 0.0)), stops=[stop])
    found = mbs.periodic(made, 2 * np.pi / rate, settle=30)
    assert found.status == "OK" and found.stable
    assert np.abs(found.multipliers) == pytest.approx(np.exp(-damping / 2 * found.period), rel=1e-6)


@pytest.mark.parametrize("stiffness", [1e5, 1e7])
def test_a_ball_that_bounces_each_period(stiffness):
    """On a table that shakes, of restitution 0.5; contacts last 1/20 to 1/200 of a period, and begin with a jump of the force."""
    law, speed, shake, e = KelvinVoigt.from_restitution(stiffness, 0.5, 1.0), 10 * np.pi, 12.0, 0.5
    period, stop = 2 * np.pi / speed, mbs.Stop("P", at=-0.05, law=law, along=(0, 1))
    made = block(
        mbs.Force("P", lambda t: (0.0, shake * np.sin(speed * t))), mbs.Force("P", (0.0, -9.81)), along=(0, 1), stops=[stop]
    )
    up, phase = 9.81 * period / 2, np.arccos(9.81 * period / 2 * (1 - e) / (1 + e) / (shake / speed))
    flown = period - phase / speed  # since an instantaneous impact
    y = [up * flown - 9.81 * flown**2 / 2 - 0.05 + shake / speed**2 * np.sin(phase), up - 9.81 * flown - shake / speed]
    y, exact = returned(
        y, period, lambda t, x, v: shake * np.sin(speed * t) - 9.81, lambda t, x, v: (0.0, 0.0), law, -1.0, -0.05
    )  # fmt: skip
    start, moving = start_at(mbs.periodic(made, period), made, y)
    found = mbs.periodic(made, period, start=start)
    assert [found.point("block", "P")[0, 1], found.v[0, moving]] == pytest.approx(y, abs=1e-8)
    assert np.abs(np.sort_complex(found.multipliers) - np.sort_complex(exact)).max() <= min(3 * found.errors.max() + 1e-8, 1e-6)
    assert abs(found.multipliers[0]) ** 2 == pytest.approx(e**2, rel=0.02)  # of an instantaneous impact


def test_a_strip_about_its_rest_has_the_multipliers_of_its_tangent():
    section = mbs.Section(0.02, 0.002).damped(0.05, 0.4)
    made = mbs.Mechanism(
        {"A": (0, 0), "B": (0.4, 0)}, [mbs.Link("strip", "A", "B", mbs.Beam(section))], [mbs.Weld("A", "ground", "strip")],
        loads=[mbs.Force("B", lambda t: (0.0, 1e-5 * np.cos(60.0 * t)))],
    )  # fmt: skip
    found = mbs.periodic(made, 2 * np.pi / 60.0, degree=8)
    values = mbs.frequencies(made, count=2).values
    exact = np.exp(np.array([value for s in values for value in (s, s.conjugate())]) * found.period)
    assert np.sort_complex(found.multipliers[:4]) == pytest.approx(np.sort_complex(exact), abs=1e-6)


def test_what_does_not_return_is_told():
    made = block(mbs.Force("P", (1.0, 0.0)))
    found = mbs.periodic(made, 1.0)
    assert found.status == "NOT_REACHED"
    assert "no motion of period 1 s" in found.message


@pytest.mark.parametrize(("multiplier", "words"), [
    (1.5, ""), (1.5 + 1e-14j, ""), (-1.5, " and alternates"), (-1.5 + 1e-14j, " and alternates"), (1.5j, " and turns"),
])  # fmt: skip
def test_a_multiplier_that_is_real_to_rounding_does_not_turn(multiplier, words):
    assert describe_change(complex(multiplier)) == words
