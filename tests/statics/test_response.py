"""Curves of periodic motions over a frequency, a load or a number: their critical points against closed forms and own runs."""

import numpy as np
import pytest
from returned_states import block, hill, returned, start_at
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

from buckler import mbs
from buckler.mbs.functions import Components, Expression
from buckler.mbs.laws import KelvinVoigt

TURN = 2 * np.pi


def duffing_run(x, v, speed):
    """A period of x'' + 0.1 x' + x + x^3 = 0.3 cos(speed t), and its derivative by (x, v)."""

    def right(t, z):
        tangent = -1.0 - 3.0 * z[0] ** 2
        forced = -z[0] - z[0] ** 3 - 0.1 * z[1] + 0.3 * np.cos(speed * t)
        return [z[1], forced, z[3], tangent * z[2] - 0.1 * z[3], z[5], tangent * z[4] - 0.1 * z[5]]

    end = solve_ivp(right, (0, TURN / speed), [x, v, 1, 0, 0, 1], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return end[:2], end[2:].reshape(2, 2).T


def test_duffings_response_folds_twice_and_both_branches_are_motions():
    """Folds are solved again as states and speeds that return with a multiplier 1."""
    made = block(
        mbs.Spring("P", "ground:S", stiffness=0.0, free_length=10.0, law=lambda e, rate: e + e**3 + 0.1 * rate),
        mbs.Force("P", lambda t: (0.3 * np.cos(1.2 * t), 0.0)),
    )
    found = mbs.response(made, TURN / 1.2, to=2.0 / TURN)

    def fold(z):
        end, matrix = duffing_run(*z)
        return [*(end - z[:2]), np.linalg.det(matrix - np.eye(2))]

    exact = []
    for size, speed in ((1.722, 1.7797), (0.593, 1.3242)):
        at = 0.3 / (1 - speed**2 + 0.75 * size**2 + 0.1j * speed)
        at = at / abs(at) * size
        exact.append(fsolve(fold, [at.real, -speed * at.imag, speed], xtol=1e-12)[2] / TURN)
    assert (found.status, found.ended) == ("OK", "reached")
    assert found.folds == pytest.approx(exact, abs=1e-9)
    assert (found.errors["folds"] < 1e-8).all()
    assert not (found.doublings or found.branchings)
    between = (found.parameter > exact[1]) & (found.parameter < exact[0])
    back = np.diff(found.parameter, prepend=0.0) < 0
    assert (found.stable == ~(between & back)).all()
    for motion in found.motions[::10]:
        moving = int(np.argmax(np.abs(motion.v).max(axis=0)))
        x, v = motion.q[0, moving], motion.v[0, moving]
        end, matrix = duffing_run(x, v, TURN / motion.period)
        assert end == pytest.approx([x, v], abs=1e-7)
        assert np.sort_complex(motion.multipliers) == pytest.approx(np.sort_complex(np.linalg.eigvals(matrix)), abs=1e-6)


def test_a_number_of_the_mechanism_changes_a_motion():
    made = block(
        mbs.Spring("P", "ground:S", stiffness=25.0, damping=0.6), mbs.Force("P", Components((Expression("1.5*cos(4*t)"), 0.0)))
    )
    found = mbs.response(made, TURN / 4.0, to=40.0, parameter="loads.0.stiffness")
    exact = np.abs(1.5 / (found.parameter - 16.0 + 2.4j))
    assert (found.parameter[0], found.parameter[-1]) == (25.0, 40.0)
    assert found.amplitude("block", "P")[:, 0] == pytest.approx(exact, rel=1e-6)


def test_mathieus_tongues_begin_and_end_where_hills_determinant_says():
    made = mbs.Mechanism(
        {"O": (0, 0), "A": (1, 0)}, [mbs.Link("bar", "O", "A", mbs.Rigid.of(mass=1.0, inertia=0.2, centre=(0, 0)))],
        [mbs.Revolute("O", "ground", "bar")],
        loads=[mbs.Torque("bar", lambda t, angle, speed: -0.2 * (0.25 + 0.1 * np.cos(1.3 * t)) * angle)],
    )  # fmt: skip
    found = mbs.response(made, TURN / 1.3, to=0.45 / TURN)

    def edge(trace, low, high):
        return brentq(lambda speed: hill(0.25 / speed**2, 0.1 / speed**2) - trace, low, high, xtol=1e-14) / TURN

    doublings, branchings = [edge(-2, 1.0, 1.2), edge(-2, 0.8, 1.0)], [edge(2, 0.495, 0.51), edge(2, 0.47, 0.49)]
    assert found.doublings == pytest.approx(doublings, abs=1e-9)
    assert found.branchings == pytest.approx(branchings, abs=1e-9)
    assert not found.folds
    assert (found.errors["doublings"] < 1e-8).all()


@pytest.mark.slow
def test_a_connecting_rod_pressed_and_pulled_resonates_at_twice_its_frequency():
    """Its first mode obeys Mathieu's damped equation; shear, stretching and the second mode are what is left."""
    section, length = mbs.Section(0.02, 0.002).damped(0.01, 0.5), 0.5
    made = mbs.Mechanism(
        {"A": (0, 0), "B": (length, 0)}, [mbs.Link("rod", "A", "B", mbs.Beam(section))], [mbs.Revolute("A", "ground", "rod")],
        [mbs.Guide("B", "rod")],
    )  # fmt: skip
    first = mbs.frequencies(made, count=1)
    own, damping = abs(first.values[0]), 2 * first.damping[0] * abs(first.values[0])
    load, speed = 0.3 * section.euler_load(length), 2.16 * own
    pressed = mbs.Mechanism(
        made.points, made.links, made.joints, made.guides, loads=[mbs.Force("B", lambda t: (-load * np.cos(speed * t), 0.0))]
    )
    found = mbs.response(pressed, TURN / speed, to=2.13 * own / TURN, degree=6)

    def doubles(speed):
        def end(y):
            def right(t, y):
                return [y[1], -(own**2) * (1 - 0.3 * np.cos(speed * t)) * y[0] - damping * y[1]]

            return solve_ivp(right, (0, TURN / speed), y, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]

        return np.linalg.det(np.array([end([1.0, 0.0]), end([0.0, 1.0])]).T + np.eye(2))

    assert found.doublings == pytest.approx([brentq(doubles, 2.13 * own, 2.16 * own) / TURN], rel=1e-4)


@pytest.mark.slow
def test_a_bouncing_ball_doubles_its_period_as_in_closed_form():
    """On a table shaken with Gamma g, of restitution e: at pi sqrt(a^2 + b^2), a = (1 - e)/(1 + e), b = 2 (1 + e^2)/pi/(1 + e)^2
    (N. B. Tufillaro et al., 1992); a contact of 1/200 of a period moves that by as much: against an own run with contacts.
    """
    gravity, speed, e, shake = 9.81, 10 * np.pi, 0.5, 12.0
    period, lag = TURN / speed, (1 - e) / (1 + e)
    law = KelvinVoigt.from_restitution(1e7, e, 1.0)
    made = block(
        mbs.Force("P", lambda t: (0.0, shake * np.sin(speed * t))), mbs.Force("P", (0.0, -gravity)), along=(0.0, 1.0),
        stops=[mbs.Stop("P", at=0.0, law=law, along=(0, 1))],
    )  # fmt: skip
    phase = np.arccos(gravity * period / 2 * lag / (shake / speed))
    flown, up = period - phase / speed, gravity * period / 2
    low = shake / speed**2 * np.sin(phase)
    y = [up * flown - gravity * flown**2 / 2 + low, up - gravity * flown - shake / speed]
    start, moving = start_at(mbs.periodic(made, period), made, y)
    found = mbs.response(made, period, to=1.4, load="force.P", start=start)
    mean, swing = lag, 2 * (1 + e * e) / np.pi / (1 + e) ** 2
    assert found.status == "OK"
    assert found.doublings == pytest.approx([np.pi * np.hypot(mean, swing) * gravity / shake], rel=5e-3)
    assert found.stable[0]
    assert not found.stable[-1]

    def bounces(times, y):
        """The state that returns under so many times the load, and its multipliers."""
        return returned(
            y, period, lambda t, x, v: times * shake * np.sin(speed * t) - gravity, lambda t, x, v: (0.0, 0.0), law, -1.0
        )  # fmt: skip

    near = min(found.motions, key=lambda each: abs(each.multipliers + 1).min())
    y = [near.point("block", "P")[0, 1], near.v[0, moving]]
    exact = brentq(lambda times: np.prod(bounces(times, y)[1] + 1).real, found.doublings[0] - 1e-4, found.doublings[0] + 1e-4)
    assert abs(found.doublings[0] - exact) < min(2 * found.errors["doublings"][0], 1e-6)
    for times, motion in list(zip(found.parameter, found.motions, strict=True))[::4]:
        y, values = bounces(times, [motion.point("block", "P")[0, 1], motion.v[0, moving]])
        assert [motion.point("block", "P")[0, 1], motion.v[0, moving]] == pytest.approx(y, abs=1e-7)
        off = np.abs(np.sort_complex(motion.multipliers) - np.sort_complex(values)).max()
        assert off <= min(2 * motion.errors.max() + 1e-8, 1e-6)


def test_a_motion_that_its_drive_alone_decides_has_no_multipliers():
    """A slider-crank's stroke is twice its crank, however quick."""
    made = mbs.Mechanism(
        {"O": (0, 0), "A": (0.05, 0), "B": (0.25, 0)},
        [mbs.Link("crank", "O", "A", mbs.Rigid(mbs.Section(0.02, 0.005))), mbs.Link("rod", "A", "B",
        mbs.Rigid(mbs.Section(0.02, 0.005)))],
        [mbs.Revolute("O", "ground", "crank"), mbs.Revolute("A", "crank", "rod")], [mbs.Guide("B", "rod")],
        drives=[mbs.Drive("crank", 10.0)],
    )  # fmt: skip
    once = mbs.periodic(made, TURN / 10.0)
    found = mbs.response(made, TURN / 10.0, to=5.0)
    assert (once.status, once.stable, len(once.multipliers)) == ("OK", True, 0)
    assert (found.status, found.points) == ("OK", [])
    assert found.amplitude("rod", "B")[:, 0] == pytest.approx(0.05, rel=1e-6)
    assert found.motions[-1].v[:, 2].max() == pytest.approx(5.0 * TURN, rel=1e-6)
