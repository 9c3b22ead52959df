"""Ideal joints in the second solver: no power in a motion they allow, and none of their forces acts on the whole."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs import Mechanism
from buckler.mbs.elements import Beam, Cable, Link, Mass, Revolute, Rigid, Section, Slider, Slot, Weld
from buckler.mbs.geometry import rotate, rotate_left
from buckler.mbs.solvers import Controlled, Spectral
from buckler.mbs.spectral.run import once

BAR = Section(0.02, 0.004)
ALONG = (0.3, 1.0)
JOINTS = {"revolute": Revolute("A", "one", "two"), "weld": Weld("A", "one", "two"),
          "slider": Slider("A", "two", "one", along=ALONG), "slot": Slot("A", "two", "one", along=ALONG)}  # fmt: skip


def flight(joint, body):
    """Two links and a mass fly and turn, held together by the joint alone."""
    mechanism = Mechanism(
        points={"O": (0, 0), "A": (0.2, 0), "B": (0.35, 0.1)},
        links=[Link("one", "O", "A", body), Link("two", "A", "B", Rigid(BAR))],
        joints=[joint],
        masses=[Mass("B", 0.05)],
        velocities={"one": 5.0, "B": (0.4, 0.3)},
    )
    run = once(mechanism, 0.1, Spectral(Controlled(tolerance=1e-7)))
    assert run.failure is None, run.failure
    return run


def wrench(joint, record):
    """Force, (times, 2), and moment, (times,), on the second body at the place of the first one's point."""
    if isinstance(joint, Slot):
        effort, (angle, _) = record.channel(joint.key, "effort"), record.turn(f"{joint.second}:A")
        normal = rotate_left(rotate(angle, np.array(ALONG) / np.hypot(*ALONG)))
        return effort[:, :1] * normal, effort[:, 1] if isinstance(joint, Slider) else 0.0
    moment = record.channel(joint.key, "moment")
    return record.channel(joint.key, "force"), moment[:, 0] if isinstance(joint, Weld) else 0.0


@pytest.mark.parametrize("body", [Rigid(BAR), Beam(BAR), Cable(BAR)], ids=["rigid", "beam", "cable"])
@pytest.mark.parametrize("kind", JOINTS)
def test_a_joint_takes_no_power(kind, body):
    joint = JOINTS[kind]
    record = flight(joint, body).record
    (first, v_first), (second, v_second) = record.point(f"{joint.first}:A"), record.point(f"{joint.second}:A")
    spin_first, spin_second = record.turn(f"{joint.first}:A")[1], record.turn(f"{joint.second}:A")[1]
    force, moment = wrench(joint, record)
    slip = v_second + spin_second[:, None] * rotate_left(first - second) - v_first
    power = np.abs((force * slip).sum(axis=1) + moment * (spin_second - spin_first))
    speed = np.abs(v_first).max()
    assert np.abs(force[0]).max() > 0 and power[0] < 1e-12 * np.abs(force[0]).max() * speed  # rates are consistent to rounding
    assert power.max() < 1e-7 * np.abs(force).max() * speed  # and then to the tolerance


@pytest.mark.parametrize("kind", JOINTS)
def test_momentum_of_the_whole_stays_and_the_joint_changes_that_of_each(kind):
    """Linear momentum to rounding, angular momentum to the integrator's error; m a of a body is the joint's force."""
    joint = JOINTS[kind]
    record = flight(joint, Rigid(BAR)).record
    linear, angular = np.zeros((len(record.time), 2)), np.zeros(len(record.time))
    for name, link in record.links.items():
        place, velocity, _ = link.centre()
        linear += link.mass * velocity
        angular += link.mass * (place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0])
        angular += link.inertia * record.turn(f"{name}:A")[1]
    place, velocity = record.point("two:B")
    linear += 0.05 * velocity
    angular += 0.05 * (place[:, 0] * velocity[:, 1] - place[:, 1] * velocity[:, 0])
    assert np.abs(linear - linear[0]).max() < 1e-10 * np.abs(linear).max()
    assert np.abs(angular - angular[0]).max() < 1e-4 * np.abs(angular).max()
    one = record.links["one"]
    force = wrench(joint, record)[0] * (1.0 if joint.second == "one" else -1.0)
    assert one.mass * one.centre()[2] == pytest.approx(force, abs=2e-3 * np.abs(force).max())
