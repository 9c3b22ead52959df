"""Laws of elongation or angle with jumps and kinks: steps end on them, though one step may pass two."""

import numpy as np
import pytest
from scipy.optimize import brentq

from buckler.mbs import Guide, Link, Mechanism, Revolute, Rigid, Spring, Status, Torque, simulate
from buckler.mbs.functions import Argument, EdgeMemory

DRAWS = np.random.default_rng(4207)


def check(mechanism, duration, reading, exact):
    result = simulate(mechanism, duration)
    told = result.reading(reading)
    assert result.status is Status.OK, result.message
    assert abs(told.value - exact) <= 3 * told.error and told.error < 1e-3
    assert result.work["spectral_runs"] <= 6


def gliding(mass, speed, law):
    return Mechanism(
        points={"A": (0, 0), "B": (0, -0.1), "P": (-0.5, 0)},
        links=[Link("block", "A", "B", Rigid.of(mass=mass, inertia=1e-3, centre=(0, 0)))],
        guides=[Guide("A", "block")],
        loads=[Spring("ground:P", "A", 0.0, free_length=0.5, law=law)],
        velocities={"A": (speed, 0), "B": (speed, 0)},
    )


@pytest.mark.parametrize(("draw", "periods"), [(0, 8), (1, 8), (2, 8), (3, 8), (4, 60)])
def test_a_dead_zone_without_damping_keeps_its_period(draw, periods):
    """Sixty periods pass its edges 240 times: each is at one of two elongations."""
    mass, stiffness, play, speed = 10 ** DRAWS.uniform([-1, 2, -3, -1], [1, 4, -1.5, 0.5])
    period = 2 * (2 * play / speed + np.pi * np.sqrt(mass / stiffness))
    spring = gliding(mass, speed, lambda x, v: stiffness * (max(x - play, 0.0) + min(x + play, 0.0)))
    check(spring, periods * period + 0.3 * play / speed, "end(A.x)", 0.3 * play)


@pytest.mark.parametrize("draw", range(4))
def test_a_spring_of_two_stiffnesses_keeps_its_period(draw):
    mass, soft, ratio, speed = 10 ** DRAWS.uniform([-1, 1, 0.5, -1], [1, 2, 2, 0.5])
    half = [np.pi * np.sqrt(mass / k) for k in (soft, soft * ratio)]
    spring = gliding(mass, speed, lambda x, v: soft * x if x > 0 else soft * ratio * x)
    check(spring, 6 * sum(half) + half[0] / 2, "end(A.x)", speed * half[0] / np.pi)


def turning(inertia, speed, torque):
    return Mechanism(
        points={"O": (0, 0), "A": (0.1, 0)},
        links=[Link("rotor", "O", "A", Rigid.of(mass=0.1, inertia=inertia, centre=(0, 0)))],
        joints=[Revolute("O", "ground", "rotor")],
        loads=[Torque("rotor", torque)],
        velocities={"rotor": speed},
    )


@pytest.mark.parametrize("draw", range(4))
def test_pulses_over_a_narrow_angle_are_all_felt(draw):
    """A rotor gains the same energy from each: its speed between them is known, and so is the time that each takes."""
    inertia, speed, width, share = 10 ** DRAWS.uniform([-4, 0.5, -3, -2.5], [-2, 1.5, -1.5, -2])
    torque = share * inertia * speed**2 / 2 / width
    rotor = turning(inertia, speed, lambda t, angle, rate: torque if (angle + 0.5) % 1.0 < width else 0.0)
    speeds = speed * np.sqrt(1 + share * np.arange(8))
    ways = np.array([0.5, *[1 - width] * 6, 0.5 - width])
    time = (ways / speeds).sum() + (2 * width / (speeds[1:] + speeds[:-1])).sum()
    check(rotor, time, "end(rotor.angle)", ways.sum() + 7 * width)


@pytest.mark.parametrize("drag", [0.0, 1e-5, 1e-4])
def test_edges_in_the_angle_are_found_beside_a_drag_of_the_speed(drag):
    """Between the edges the angle is known in closed form: its way is the sum of an exponential and a line."""
    inertia, torque, width, end = 2e-3, 0.05, 0.03, 1.0
    rotor = turning(inertia, 10.0, lambda t, angle, rate: (torque if angle % 1.0 < width else 0.0) - drag * rate)
    time, angle, speed = 0.0, 0.0, 10.0
    for k in range(40):
        push, way = (torque, width) if k % 2 == 0 else (0.0, 1 - width)

        def travel(t, push=push, speed=speed):
            if drag == 0.0:
                return speed * t + push / inertia * t * t / 2
            last, pace = push / drag, drag / inertia
            return last * t - (speed - last) * np.expm1(-pace * t) / pace

        left = end - time
        if travel(left) <= way:
            angle += travel(left)
            break
        step = brentq(lambda t: travel(t) - way, 0.0, left, xtol=1e-15)  # noqa: B023
        speed += (push * step - drag * way) / inertia
        time, angle = time + step, angle + way
    check(rotor, end, "end(rotor.angle)", angle)


def test_edges_of_two_states_are_found_anew_in_each_run_until_two_runs_agree():
    """The confirming search of the first run is no second run."""
    time, memory = np.linspace(0.0, 1.0, 2001), EdgeMemory()
    angle = Argument(np.sin(3 * time), 3 * np.cos(3 * time))
    of_one_state = ("spring", (lambda _t, x: 1.0 * (x > 0.5), (angle,)))
    for shift in (0.0, 1e-3):
        other = Argument(time + shift, np.ones_like(time))
        of_two_states = ("force", (lambda _t, x, y: 1.0 * (x + y > 1.3), (angle, other)))
        memory.find_passed(time, [of_one_state, of_two_states])
        exact = brentq(lambda t, shift=shift: np.sin(3 * t) + t + shift - 1.3, 0.2, 0.5)
        assert np.abs(memory.edges - exact).min() < 1e-7
