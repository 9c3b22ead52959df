"""Velocities at the start: completed through the constraints by least kinetic energy, or refused with the names."""

from dataclasses import replace

import numpy as np
import pytest
from simulations import closed, position

from buckler.mbs import Beam, Drive, Guide, Link, Mechanism, Ramp, Revolute, Rigid, Section, Strut, crank_rocker
from buckler.mbs.scene.linkage import KinematicsError
from buckler.mbs.scene.scene import Scene

BAR = Rigid(Section(width=0.020, thickness=0.005))
STRIP = Section(width=0.030, thickness=0.0003)
FREE = Mechanism({"A": (0.0, 0.0), "B": (0.6, 0.8)}, [Link("bar", "A", "B", Rigid.of(mass=2.0, inertia=0.3))])


def test_given_speed_of_a_crank_is_that_of_a_drive():
    driven = crank_rocker(BAR, speed=3.0)
    free = replace(driven, drives=(), velocities={"crank": 3.0})
    assert Scene.of(free).start.rates == pytest.approx(Scene.of(driven).start.rates, abs=1e-12)
    assert Scene.of(free).start.rates[0, 2] == pytest.approx(3.0, rel=1e-12)


def test_a_struck_bar_takes_the_least_energy():
    """A free bar whose end is given a velocity v across: impulse at the end, so centre v/(1 + m d^2/I), spin from there."""
    v, d = np.array([-0.8, 0.6]), 0.5
    rates = Scene.of(replace(FREE, velocities={"B": tuple(v)})).start.rates[0]
    share = 1 / (1 + 2.0 * d**2 / 0.3)
    assert rates[2] == pytest.approx((1 - share) / d, rel=1e-12)
    centre = rates[:2] + rates[2] * d * v
    assert centre == pytest.approx(share * v, rel=1e-12)


@pytest.mark.parametrize(
    ("velocities", "named"),
    [
        ({"crank": 3.0, "A": (5.0, 0.0)}, ["velocities['crank']", "velocities['A']"]),
        ({"crank": 3.0, "rocker": 0.1}, ["velocities['crank']", "velocities['rocker']", "B.coupler-rocker"]),
        ({"O": (0.1, 0.0)}, ["velocities['O']", "O.ground-crank"]),
    ],
)
def test_contradicting_velocities_are_refused_with_their_names(velocities, named):
    with pytest.raises(KinematicsError) as caught:
        _ = Scene.of(replace(crank_rocker(BAR, speed=1.0), drives=(), velocities=velocities)).start
    assert not [name for name in named if name not in str(caught.value)], str(caught.value)


def test_a_velocity_against_a_drive_is_refused():
    with pytest.raises(KinematicsError, match=r"'drive', .*velocities\['crank'\]|velocities\['crank'\].*'drive'"):
        _ = Scene.of(replace(crank_rocker(BAR, speed=1.0), velocities={"crank": 2.0})).start


@pytest.mark.parametrize(
    ("velocities", "words"),
    [
        ({"arm": 1.0}, ["velocities['arm']", "unknown link", "crank"]),
        ({"crank": (1.0, 2.0)}, ["velocities['crank']", "one number"]),
        ({"Z": (1.0, 2.0)}, ["velocities['Z']", "unknown point"]),
        ({"B": (1.0, 2.0, 3.0)}, ["velocities.B", "two numbers"]),
        ({"crank": float("inf")}, ["velocities.crank = inf", "finite"]),
        (3.0, ["velocities = 3.0", "table of links and points"]),
    ],
)
def test_wrong_velocities_are_refused_when_made(velocities, words):
    with pytest.raises(ValueError) as caught:
        replace(crank_rocker(BAR, speed=1.0), drives=(), velocities=velocities)
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


def truss(body, speed=-0.1, height=0.1):
    """Von Mises: two strips from the ground to a driven apex."""
    return Mechanism(
        {"L": (-0.3, 0.0), "R": (0.3, 0.0), "T": (0.0, height)},
        [Link("left", "L", "T", body), Link("right", "T", "R", body)],
        [Revolute("L", "ground", "left"), Revolute("R", "right", "ground"), Revolute("T", "left", "right")],
        [Guide("T", "left", (0, 1), mass=0.1)],
        drives=[Drive("T", speed)],
    )


@pytest.mark.parametrize("body", [Beam(STRIP), Strut(STRIP)], ids=["beam", "strut"])
def test_a_von_mises_truss_of_strips_is_no_dead_centre(body):
    """Each strip shortens by its share of the apex's speed and turns by the rest."""
    begun, length = Scene.of(truss(body)).start, np.hypot(0.3, 0.1)
    assert begun.velocity("left", "T") == pytest.approx([0.0, -0.1], abs=1e-12)
    assert begun.velocity("right", "T") == pytest.approx([0.0, -0.1], abs=1e-12)
    assert begun.velocity("left", "L") == pytest.approx([0.0, 0.0], abs=1e-12)
    spins = begun.rates[:, 2]
    assert spins == pytest.approx([-0.1 * 0.3 / length**2, 0.1 * 0.3 / length**2], rel=1e-9)


def test_a_rigid_truss_is_a_dead_centre():
    with pytest.raises(KinematicsError, match=r"'drive'.*contradict"):
        _ = Scene.of(truss(BAR)).start


def test_a_strip_between_two_held_points_may_be_pressed_at_speed():
    strip, pin = Link("strip", "A", "B", Beam(STRIP)), Revolute("B", "ground", "strip")
    guides, drives = [Guide("A", "strip", mass=0.1)], [Drive("A", 0.5)]
    held = Mechanism({"A": (0, 0), "B": (0.31, 0)}, [strip], [pin], guides, drives=drives)
    begun = Scene.of(held).start
    assert begun.velocity("strip", "A") == pytest.approx([0.5, 0.0], abs=1e-12)
    assert begun.velocity("strip", "B") == pytest.approx([0.0, 0.0], abs=1e-12)


def five_bar(first, second):
    """Two cranks, each with a drive of its own."""
    points = {"O": (0, 0), "A": (0.1, 0.1), "B": (0.25, 0.3), "C": (0.4, 0.12), "D": (0.5, 0)}
    links = [Link("a", "O", "A", BAR), Link("b", "A", "B", BAR), Link("c", "C", "B", BAR), Link("d", "D", "C", BAR)]
    pairs = {"O": ("ground", "a"), "A": ("a", "b"), "B": ("b", "c"), "C": ("c", "d"), "D": ("ground", "d")}
    joints = [Revolute(point, *pair) for point, pair in pairs.items()]
    return Mechanism(points, links, joints, drives=[Drive("a", first), Drive("d", second)])


def test_two_drives_turn_two_cranks():
    closure, (state,) = closed(five_bar(1.0, Ramp(0.0, -2.0, 0.5)), [0.4])
    assert state.q[[0, 3], 2] - closure.reference[[0, 3], 2] == pytest.approx([0.4, -0.32], abs=1e-12)
    assert state.q_t[[0, 3], 2] == pytest.approx([1.0, -1.6], rel=1e-12)
    assert state.q_tt[[0, 3], 2] == pytest.approx([0.0, -4.0], abs=1e-9)
    ends = [position(closure, link, "B", state.q) for link in "bc"]
    assert ends[0] == pytest.approx(ends[1], abs=1e-12)
    assert Scene.of(closure.mechanism).is_determined
