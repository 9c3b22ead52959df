"""Sliders and slots in the engine: closed forms, what they keep, what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from jointed import BAR, G, turned
from simulations import closed, fine, position

from buckler import mbs

EQUAL = mbs.Exudyn(mbs.Equal(4000), spectral_radius=0.6)
"""Constraint forces ring where steps change their size."""


# --- sliders and slots ------------------------------------------------------------------------------------------------


BEAD = mbs.Rigid.of(mass=0.3, inertia=2e-4, centre=(0.0, 0.0))


def bead_on_a_rod(kind, speed, angle=0.5, start=0.1):
    """A bead on a rod that turns about its end; no gravity."""
    o, p, q, e = turned(angle, (0, 0), (start, 0), (start, 0.02), (1.0, 0))
    return mbs.Mechanism(
        points={"O": o, "P": p, "Q": q, "E": e},
        links=[mbs.Link("rod", "O", "E", mbs.Rigid(BAR)), mbs.Link("bead", "P", "Q", BEAD)],
        joints=[mbs.Revolute("O", "ground", "rod"), kind("P", "bead", "rod", along=turned(angle, (1, 0))[0])],
        drives=[mbs.Drive("rod", speed)],
    )


@pytest.mark.parametrize("kind", [mbs.Slider, mbs.Slot])
def test_bead_flies_out_along_a_turning_rod(kind):
    """Its distance grows by r'' = w^2 r: r = r_0 cosh w t, with 2 m w r' across the rod."""
    speed = 8.0
    result = fine(mbs.simulate(bead_on_a_rod(kind, speed), 0.2, solver=EQUAL, ledger=True))
    run, t = result.signals, result.time
    out = 0.1 * (np.cosh(speed * t) - 1)
    assert run["P.bead-rod.travel"] == pytest.approx(out, abs=2e-6)
    pushed = -2 * 0.3 * speed**2 * 0.1 * np.sinh(speed * t)  # of the bead on the rod: to its right
    later = t > 0.02  # the first steps ring
    assert run["P.bead-rod.normal_force"][later] == pytest.approx(pushed[later], abs=1e-3 * np.abs(pushed).max())
    turned_by = run["Q.x"] - run["P.x"], run["Q.y"] - run["P.y"]
    turn = np.unwrap(np.arctan2(*turned_by[::-1])) - 0.5 - math.pi / 2
    assert turn[-1] == pytest.approx(speed * 0.2 if kind is mbs.Slider else 0.0, abs=1e-9)
    assert result.energy_balance < 1e-6


def test_slider_carries_the_moment_that_turns_the_bead_and_a_slot_none():
    spin_up = mbs.Motion(lambda t: 20 * t**3, lambda t: 60 * t**2)
    for kind in (mbs.Slider, mbs.Slot):
        result = fine(mbs.simulate(bead_on_a_rod(kind, spin_up), 0.2, solver=EQUAL, ledger=True))
        run, t = result.signals, result.time
        beads = np.arctan2(run["Q.y"] - run["P.y"], run["Q.x"] - run["P.x"]) - 0.5 - math.pi / 2
        if kind is mbs.Slider:
            assert run["P.bead-rod.moment"][5:] == pytest.approx(-2e-4 * 120 * t[5:], abs=1e-5)
            assert beads == pytest.approx(20 * t**3, abs=1e-9)
        else:
            assert "P.bead-rod.moment" not in run
            assert np.abs(beads).max() < 1e-12
        assert result.energy_balance < 1e-6


@pytest.mark.parametrize("rod", [mbs.Beam(BAR, 4), mbs.Cable(BAR, 4)], ids=["beam", "cable"])
def test_line_of_a_flexible_link_turns_with_its_section(rod):
    flexible = bead_on_a_rod(mbs.Slider, 0.0, start=0.99)
    mechanism = replace(flexible, links=[mbs.Link("rod", "O", "P", rod), flexible.links[1]], drives=[], gravity=(0, -G))
    result = fine(mbs.simulate(mechanism, 0.2, solver=mbs.Exudyn(mbs.Controlled(tolerance=2e-8)), ledger=True))
    assert result.energy_balance < 1e-6
    assert np.abs(result.signals["P.bead-rod.travel"]).max() > 1e-3


@pytest.mark.parametrize("kind", [mbs.Slider, mbs.Slot])
def test_loop_closure_knows_joints_that_slide(kind):
    """A quick-return linkage: velocities and accelerations from closure against differences of its places."""
    mechanism = mbs.Mechanism(
        points={"O": (0, 0), "A": (0.05, 0.1), "D": (0.0, -0.2), "E": (0.1, 0.3), "F": (0.07, 0.1)},
        links=[mbs.Link("crank", "O", "A", mbs.Rigid(BAR)), mbs.Link("block", "A", "F", BEAD),
               mbs.Link("arm", "D", "E", mbs.Rigid(BAR))],
        joints=[mbs.Revolute("O", "ground", "crank"), mbs.Revolute("D", "ground", "arm"), mbs.Revolute("A", "crank", "block"),
                mbs.Slider("A", "block", "arm", along=(0.05, 0.3))] if kind is mbs.Slider else
               [mbs.Revolute("O", "ground", "crank"), mbs.Revolute("D", "ground", "arm"), mbs.Weld("A", "crank", "block"),
                mbs.Slot("A", "block", "arm", along=(0.05, 0.3))],
        drives=[mbs.Drive("crank", mbs.Motion(lambda t: 3 * t + t * t, lambda t: 3 + 2 * t))],
    )  # fmt: skip
    h = 1e-4
    closure, states = closed(mechanism, 0.3 + h * np.arange(-1, 2))
    assert closure.count_free_motions() == 0
    rate = (states[2].q - states[0].q) / (2 * h)
    change = (states[2].q_t - states[0].q_t) / (2 * h)
    assert states[1].q_t == pytest.approx(rate, abs=1e-5)
    assert states[1].q_tt == pytest.approx(change, abs=1e-4)
    result = fine(mbs.simulate(mechanism, 0.3, solver=mbs.Closure(mbs.Equal(400)), ledger=True))
    end = states[1].q
    assert [result.signals[f"{p}.{a}"][-1] for p in "AE" for a in "xy"] == pytest.approx(
        [*position(closure, "block", "A", end), *position(closure, "arm", "E", end)], abs=1e-8
    )
    assert result.energy_balance < 1e-6
    for name, found in reactions(mechanism, closure, states[1]).items():
        told = {"force": ("fx", "fy"), "moment": ("moment",), "effort": ("normal_force", "moment")}
        for channel, values in found.items():
            letters = told[channel][: values.shape[1]]
            if name != "drive":
                run = [result.signals[f"{name}.{letter}"][-1] for letter in letters]
                assert run == pytest.approx(values[0], abs=2e-3 * max(1.0, np.abs(values).max())), name


def reactions(mechanism, closure, state):
    """Channels of the joints at 0.3 s from inverse dynamics: J^T lambda = inertia forces."""
    inertial = []
    for i, link in enumerate(mechanism.links):
        mass, inertia, centre = link.body.mass_properties(mechanism.length(link.name))
        (arm,) = turned(state.q[i, 2], centre)
        (ax, ay, alpha), spin = state.q_tt[i], state.q_t[i, 2]
        fx, fy = mass * (ax - alpha * arm[1] - spin**2 * arm[0]), mass * (ay + alpha * arm[0] - spin**2 * arm[1])
        inertial += [fx, fy, inertia * alpha + arm[0] * fy - arm[1] * fx]
    jacobian = closure.jacobian(state.q)
    multipliers = np.linalg.lstsq(jacobian.T, np.array(inertial))[0]
    names = np.array(closure.names)
    return {name: element.reactions(multipliers[None, names == name])
            for name, element in mechanism.elements().items() if name in closure.names}  # fmt: skip


# --- what is refused --------------------------------------------------------------------------------------------------


WRONG = {
    "strut clamped": ([mbs.Weld("A", "ground", "strut")], "Weld|weld at 'A': link 'strut' is a Strut"),
    "welded to itself": ([mbs.Weld("A", "bar", "bar")], "joins 'bar' to itself"),
    "welded twice": ([mbs.Weld("A", "bar", "ground"), mbs.Revolute("A", "ground", "bar")], "twice"),
    "out of reach": ([mbs.Weld("C", "bar", "ground")], "'bar' does not reach"),
    "ground slides": ([mbs.Slider("A", "ground", "bar")], "first = 'ground': the point must be a link's; swap the bodies"),
    "line of a stranger": ([mbs.Slider("A", "bar", "arm")], "unknown link 'arm'"),
    "line off a beam": ([mbs.Slider("A", "bar", "beam")], "link 'beam' does not reach"),
    "slot in a strut": ([mbs.Slot("A", "bar", "strut")], "'strut' is a Strut"),
}


@pytest.mark.parametrize(("joints", "message"), WRONG.values(), ids=WRONG.keys())
def test_joint_that_cannot_be_is_refused(joints, message):
    points = {"A": (0, 0), "B": (1, 0), "C": (1, 1)}
    links = [
        mbs.Link("bar", "A", "B", mbs.Rigid(BAR)),
        mbs.Link("strut", "A", "C", mbs.Strut(BAR)),
        mbs.Link("beam", "B", "C", mbs.Beam(BAR)),
    ]
    with pytest.raises(ValueError, match=message):
        mbs.Mechanism(points, links, joints)


def test_slider_needs_a_direction():
    with pytest.raises(ValueError, match=r"Slider at 'A': along"):
        mbs.Slider("A", "bar", "ground", along=(0, 0))
