"""Laws with states of their own, in the compiled solver, against matrix exponentials and integrators of SciPy."""

from math import sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from buckler.mbs import (
    Closure,
    Controlled,
    Drive,
    Equal,
    Exudyn,
    Force,
    Guide,
    Link,
    Mechanism,
    Revolute,
    Rigid,
    Section,
    Spectral,
    States,
    Strut,
    Torque,
    sensitivities,
    simulate,
)
from buckler.mbs.process import has_compiler

INERTIA, KP, KI, WANTED = 0.02, 0.2, 2.0, 10.0
BAR = Section(0.02, 0.005)
FINE = Spectral(Controlled(tolerance=1e-8))


def turned(*loads, body=None, **more):
    rigid = Rigid.of(mass=1.0, inertia=INERTIA, centre=(0.0, 0.0))
    return Mechanism(
        points={"O": (0, 0), "A": (0.06, 0.08)}, links=[Link("rotor", "O", "A", body or rigid)],
        joints=[Revolute("O", "ground", "rotor")], loads=loads, **more,
    )  # fmt: skip


def controlled(kp=KP, ki=KI, begun=0.0):
    return turned(
        Torque(
            "rotor",
            lambda t, angle, speed, total: kp * (WANTED - speed) + ki * total,
            states=States(lambda t, angle, speed, total: WANTED - speed, initial=(begun,)),
        )
    )


def exact(time, kp=KP, ki=KI, begun=0.0):
    """Angle, speed and state: the exponential of the matrix of a linear system and 1."""
    matrix = np.array([[0, 1, 0, 0], [0, -kp / INERTIA, ki / INERTIA, kp * WANTED / INERTIA], [0, -1, 0, WANTED], [0, 0, 0, 0]])
    return np.array([expm(matrix * t) @ [0, 0, begun, 1] for t in np.atleast_1d(time)])[:, :3].T


def test_a_controller_with_an_integral_is_a_linear_system(bar=1e-8):
    result = simulate(controlled(begun=0.3), 1.0, solver=FINE, ledger=True)
    angle, speed, total = exact(result.time, begun=0.3)
    off = {
        "rotor.angle": np.abs(result.signals["rotor.angle"] - angle).max(),
        "torque.rotor.state1": np.abs(result.signals["torque.rotor.state1"] - total).max(),
        "torque.rotor.torque": np.abs(result.signals["torque.rotor.torque"] - KP * (WANTED - speed) - KI * total).max(),
    }
    assert max(off.values()) < bar, off
    assert np.abs(result.signals["torque.rotor.rate1"] - (WANTED - speed)).max() < 20 * bar
    assert result.energy_balance < bar


def test_states_converge_by_the_order_of_the_steps():
    """By equal steps, each half as long as the last."""
    found = []
    for count in (16, 32, 64):
        result = simulate(controlled(), 1.0, solver=Spectral(Equal(count)))
        found.append(abs(result.signals["torque.rotor.state1"][-1] - exact(1.0)[2, 0]))
    slopes = np.log2(np.array(found[:-1]) / found[1:])
    assert slopes.min() > 4.8, (slopes, found)


AREA, DEAD, BULK, SUPPLY = 5e-4, 2e-4, 2e6, 4e5
"""Of a cylinder, m^2, m^3, Pa, and of what feeds it through a valve, Pa."""


def push(t, x, y, vx, vy, pressure):
    return AREA * pressure - 400.0 * x - 20 * vx, 0.0


@pytest.mark.parametrize("rod", ["rigid", "strut"])
def test_a_force_with_states_sees_and_pushes_along_an_inclined_guide(rod, bar=1e-8):
    """On a link, or on a block alone: the strut between two of them that are pushed alike is not loaded."""

    def push(t, x, y, vx, vy, lag):
        return -3 * x - lag, -5 * y + 0.2 * vx - 0.4 * vy

    def rate(t, x, y, vx, vy, lag):
        return (2 * vy - vx + 1.0 - lag) / 0.05

    def shifted(t, x, y, vx, vy, lag):
        return push(t, x - 0.4, y, vx, vy, lag)

    def shifted_rate(t, x, y, vx, vy, lag):
        return rate(t, x - 0.4, y, vx, vy, lag)

    mass, body = (0.0, Rigid.of(mass=0.2, inertia=1e-3)) if rod == "rigid" else (0.2, Strut(BAR))
    loads = [Force("B", push, states=States(rate))]
    mechanism = Mechanism(
        points={"B": (0.0, 0.0), "C": (0.4, 0.0)}, links=[Link("rod", "B", "C", body)],
        guides=[Guide("B", "rod", (0.6, 0.8), mass), Guide("C", "rod", (0.6, 0.8), mass)],
        loads=loads if rod == "rigid" else [*loads, Force("C", shifted, states=States(shifted_rate))],
    )  # fmt: skip
    result = simulate(mechanism, 1.0, solver=FINE)

    def right(t, y):
        seen = t, 0.6 * y[0], 0.8 * y[0], 0.6 * y[1], 0.8 * y[1], y[2]
        return [y[1], np.dot(push(*seen), (0.6, 0.8)) / 0.2, rate(*seen)]

    found = solve_ivp(right, (0, 1.0), np.zeros(3), "DOP853", result.time, rtol=1e-12, atol=1e-13).y
    assert np.abs(result.signals["B.y"] - 0.8 * found[0]).max() < bar
    assert np.abs(result.signals["force.B.state1"] - found[2]).max() < bar


def test_a_force_with_states_acts_off_the_centre_of_a_turning_link():
    """A spring by a lagging place: on the end of a bar, by its moment about the pivot."""

    def pull(t, x, y, vx, vy, lag_x, lag_y):
        return -30 * lag_x, -30 * lag_y

    def rates(t, x, y, vx, vy, lag_x, lag_y):
        return 50 * (x - 0.05 - lag_x) + 3 * vy, 50 * (y - 0.03 - lag_y) - 2 * vx

    mechanism = turned(Force("A", pull, states=States(rates, initial=(0.0, 0.0))), velocities={"rotor": 4.0})
    result = simulate(mechanism, 1.0, solver=FINE)

    def right(t, y):
        x, at = 0.06 * np.cos(y[0]) - 0.08 * np.sin(y[0]), 0.06 * np.sin(y[0]) + 0.08 * np.cos(y[0])
        fx, fy = pull(t, x, at, 0, 0, *y[2:])
        return [y[1], (x * fy - at * fx) / INERTIA, *rates(t, x, at, -at * y[1], x * y[1], *y[2:])]

    found = solve_ivp(right, (0, 1.0), [0, 4.0, 0, 0], "DOP853", result.time, rtol=1e-12, atol=1e-13).y
    assert np.abs(result.signals["rotor.angle"] - found[0]).max() < 1e-8
    assert np.abs(result.signals["force.A.state2"] - found[3]).max() < 1e-8


def test_a_driven_linkage_is_no_closure_where_states_are_integrated():
    sensing = turned(
        Torque("rotor", lambda t, angle, speed, lag: 0.0 * lag, states=States(lambda t, angle, speed, lag: (speed - lag) / 0.1)),
        drives=[Drive("rotor", 3.0)],
    )
    with pytest.raises(ValueError, match=r"states of 'torque\.rotor' are integrated"):
        simulate(sensing, 1.0, solver=Closure())
    result = simulate(sensing, 1.0, solver=FINE)
    assert np.abs(result.signals["torque.rotor.state1"] - 3.0 * (1 - np.exp(-result.time / 0.1))).max() < 1e-7
    with pytest.raises(ValueError, match=r"torque on 'rotor': states = .*: the compiled solver alone integrates states"):
        simulate(sensing, 1.0, solver=Exudyn())


@pytest.mark.skipif(not has_compiler(), reason="derivatives need the compiled solver")
def test_derivatives_by_numbers_of_a_law_are_those_of_the_exponential():
    found = sensitivities(controlled, 1.0, by=["kp", "ki", "begun"], of="end(torque.rotor.state1)",
                          at={"kp": KP, "ki": KI, "begun": 0.3})  # fmt: skip
    h = 1e-5
    for name in ("kp", "ki", "begun"):
        ends = [exact(1.0, **{"kp": KP, "ki": KI, "begun": 0.3} | {name: {"kp": KP, "ki": KI, "begun": 0.3}[name] + s})[2, 0]
                for s in (h, -h)]  # fmt: skip
        assert found["end(torque.rotor.state1)", name].derivative == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-4)


def test_a_rate_that_fails_in_the_run_ends_it_by_name():
    def rate(t, angle, speed, x):
        return sqrt(0.3 - t)

    result = simulate(turned(Torque("rotor", lambda t, angle, speed, x: x, states=States(rate))), 1.0, solver=Spectral())
    assert not result.ok
    assert "torque.rotor" in result.message or "a law or a motion returned nan" in result.message
