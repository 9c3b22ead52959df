"""Wrong input is a ValueError with the name of what is wrong; what is right is not refused; failures have their names."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from made import POINTS, stiff
from simulations import BAR, STRIP, block, fine, pendulum, pressed, simply_supported

from buckler import mbs
from buckler.mbs.laws import Hertz


def ran(**changed):
    return mbs.simulate(stiff(drives=[mbs.Drive("crank", 1.0)], **changed), 0.1)


class WithoutPotential:
    stiffness = exponent = 1.0

    def force(self, depth, rate, onset):
        return 0.0

    def elastic(self, depth):
        return 0.0


@dataclass
class Unhashable(WithoutPotential):
    number: float = 1.0

    def potential(self, depth):
        return 0.0


def breaks(t):
    return t if t < 0.5 else 1 / 0


WRONG = {
    "joints in words": (lambda: stiff(joints="weld"), ["joints = 'weld'", "must be a list"]),
    "a joint in words": (lambda: stiff(joints=["weld"]), ["joints[0] = 'weld'", "Clearance or Revolute"]),
    "a guide among joints": (lambda: stiff(joints=[mbs.Guide("B", "rod")]), ["joints[0]", "this is a Guide"]),
    "one joint, no list": (lambda: stiff(joints=mbs.Revolute("O", "ground", "crank")), ["joints", "must be a list"]),
    "one drive, no list": (lambda: stiff(drives=mbs.Drive("crank", 1.0)), ["drives", "must be a list"]),
    "a list to drive": (lambda: mbs.Drive(["crank"], 1.0), ["target = ['crank']: must be a name"]),
    "driven twice": (lambda: stiff(drives=[mbs.Drive("crank", 1.0), mbs.Drive("crank", 2.0)]), ["'crank'", "driven twice"]),
    "gravity a number": (lambda: stiff(gravity=9.81), ["gravity = 9.81", "two numbers", "m/s^2"]),
    "gravity in space": (lambda: stiff(gravity=(0, 0, -9.81)), ["gravity", "two numbers"]),
    "a point in space": (lambda: stiff(points={**POINTS, "B": (2, 0, 0)}), ["points.B = (2, 0, 0)", "two numbers"]),
    "points a list": (lambda: stiff(points=[(0, 0)]), ["points = [(0, 0)]", "table of points"]),
    "a section for a body": (
        lambda: mbs.Link("a", "O", "A", mbs.Section(0.1, 0.1)),
        ["link 'a': body = Section", "this is a Section"],
    ),
    "no body": (lambda: mbs.Link("a", "O", "A", None), ["link 'a': body = None"]),
    "a number for a name": (lambda: mbs.Link(3, "O", "A", BAR), ["name = 3: must be a name"]),
    "a law's class": (lambda: mbs.Stop("B", at=3, law=Hertz), ["law = Hertz", "instance"]),
    "a law without potential": (lambda: mbs.Stop("B", at=3, law=WithoutPotential()), ["lacks 'potential'"]),
    "an unhashable law": (lambda: mbs.Stop("B", at=3, law=Unhashable()), ["hashable", "frozen dataclass"]),
    "a motion that raises": (lambda: mbs.Motion(lambda t: 1 / 0, float), ["position(0) raises ZeroDivisionError"]),
    "a motion that raises later": (
        lambda: mbs.simulate(stiff(drives=[mbs.Drive("crank", mbs.Motion(breaks, lambda t: 1.0))]), 1.0),
        ["drive: position(0.50001) raises ZeroDivisionError"],
    ),
    "no such signal": (lambda: ran().at("nothing", 0.0), ["no signal 'nothing'", "O.x"]),
    "no such signal by item": (lambda: ran()["B.z"], ["no signal 'B.z'", "near it", "B.x"]),
    "after the run": (lambda: ran().at("B.x", 0.2), ["'B.x' at t = 0.2 s", "[0, 0.1] s"]),
    "before the run": (lambda: ran().at("B.x", [0.05, -0.1]), ["t = -0.1 s"]),
    "no mechanism": (lambda: mbs.simulate(None, 0.1), ["mechanism = None"]),
    "infinite modulus": (lambda: mbs.Material(modulus=math.inf, density=1.0, poisson=0.3), ["modulus = inf Pa: must be finite"]),
    "a clearance beyond its links": (
        lambda: stiff(joints=[mbs.Clearance("A", "crank", "rod", pin=0.01, gap=2.0, law=Hertz(1e8))]),
        ["gap = 2 m at 'A'", "below the length", "1 m"],
    ),
    "a beam as thick as long": (
        lambda: stiff(links=[mbs.Link("crank", "O", "A", mbs.Beam(mbs.Section(0.1, 1.0))), mbs.Link("rod", "A", "B", BAR)]),
        ["thickness of flexible link 'crank' = 1 m", "below its length"],
    ),
    "letters to carry": (lambda: mbs.Link("a", "O", "A", BAR, carries="AB"), ["link 'a': carries = 'AB'"]),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_is_a_sentence(case):
    make, words = WRONG[case]
    with pytest.raises(ValueError) as caught:
        make()
    text = str(caught.value)
    assert not [word for word in words if word not in text], text
    assert len(text) < 400


def test_a_mechanism_does_not_change():
    mechanism = stiff()
    with pytest.raises(TypeError, match="does not change"):
        mechanism.points["A"] = (5.0, 5.0)


def test_what_is_shown_of_a_result_and_a_mechanism_is_short():
    result = fine(ran())
    assert len(repr(result)) < 400 and "OK" in repr(result) and "0.1 s" in repr(result)
    assert len(repr(stiff())) < 400 and "crank (Rigid)" in repr(stiff())
    with pytest.raises(KeyError):
        result["nothing"]
    assert result["B.x"] is result.signals["B.x"] and result.at("B.x", 0.1) == result["B.x"][-1]


# --- right, and accepted ----------------------------------------------------------------------------------------------


def test_two_struts_at_a_guided_point_with_mass():
    """Both push the block; the truss snaps from +h to -h of itself if it is driven there."""
    truss = mbs.Mechanism(
        {"L": (-0.3, 0.0), "R": (0.3, 0.0), "T": (0.0, 0.03)},
        [mbs.Link("left", "L", "T", mbs.Strut(STRIP)), mbs.Link("right", "R", "T", mbs.Strut(STRIP))],
        [mbs.Revolute("L", "ground", "left"), mbs.Revolute("R", "ground", "right"), mbs.Revolute("T", "left", "right")],
        [mbs.Guide("T", "left", (0, 1), mass=0.1)],
        drives=[mbs.Drive("T", -0.05)],
    )
    result = fine(mbs.simulate(truss, 0.2, ledger=True))
    assert result["left.compression"] == pytest.approx(result["right.compression"], rel=1e-9)
    lean = (0.03 + result["drive.position"]) / np.hypot(0.3, 0.03 + result["drive.position"])
    push = -2 * result["left.compression"] * lean
    late = result.time > 0.02
    assert result["drive.force"][late] == pytest.approx(push[late], abs=1e-3 * np.abs(push).max())


def test_a_driven_truss_of_strips_runs():
    truss = mbs.Mechanism(
        {"L": (-0.3, 0.0), "R": (0.3, 0.0), "T": (0.0, 0.1)},
        [
            mbs.Link("left", "L", "T", mbs.Beam(STRIP, imperfection=1e-3)),
            mbs.Link("right", "T", "R", mbs.Beam(STRIP, imperfection=1e-3)),
        ],
        [mbs.Revolute("L", "ground", "left"), mbs.Revolute("R", "right", "ground"), mbs.Revolute("T", "left", "right")],
        [mbs.Guide("T", "left", (0, 1), mass=0.1)],
        drives=[mbs.Drive("T", -0.02)],
    )
    result = mbs.simulate(truss, 0.1)
    assert result.status in (mbs.Status.OK, mbs.Status.SUSPECT) and "dead centre" not in result.message
    assert result.time[-1] == pytest.approx(0.1) and result["T.y"][-1] == pytest.approx(0.098, abs=1e-9)


@pytest.mark.parametrize(
    "mechanism",
    [
        pendulum(0.0),
        block(),
        simply_supported(mbs.Beam(STRIP), 0.0),
        simply_supported(mbs.Beam(STRIP, imperfection=1e-3), 0.0),
        simply_supported(mbs.Cable(STRIP), 0.0),
    ],
    ids=["pendulum", "block", "beam", "bowed beam", "cable"],
)
def test_rest_is_no_suspicion(mechanism):
    fine(mbs.simulate(mechanism, 1.0, ledger=True))


@pytest.mark.parametrize("duration", [1e-11, 1e-6])
def test_the_shortest_run_ends_where_it_should(duration):
    for mechanism in (pendulum(1.0), stiff(drives=[mbs.Drive("crank", 1.0)]), pressed(mbs.Strut(STRIP), 0.1, 1.0)):
        assert mbs.simulate(mechanism, duration).time[-1] == pytest.approx(duration, rel=1e-9)


def test_a_motion_is_not_asked_for_times_beyond_the_run():
    def known(t):
        assert 0 <= t <= 0.03 * (1 + 1e-12), f"asked for t = {t}"
        return t

    drive = mbs.Drive("crank", mbs.Motion(lambda t: 5 * known(t) ** 2, lambda t: 10 * known(t)))
    result = fine(mbs.simulate(stiff(drives=[drive]), 0.03))
    assert result["crank.ay"] == pytest.approx(
        5 * np.cos(result["drive.position"]) - 0.5 * (10 * result.time) ** 2 * np.sin(result["drive.position"]), abs=1e-6
    )


# --- ramps and kinks --------------------------------------------------------------------------------------------------


def test_a_lone_crank_starts_with_its_acceleration():
    """Centre at half of 1 m, spun up with 10 rad/s^2: 5 m/s^2 across from the start, to the kink and none after it."""
    crank = mbs.Mechanism(
        {"O": (0, 0), "A": (0, 1)},
        [mbs.Link("crank", "O", "A", BAR)],
        [mbs.Revolute("O", "ground", "crank")],
        drives=[mbs.Drive("crank", mbs.Ramp(0.0, 1.0, 0.1))],
    )
    for mechanism, duration in ((crank, 0.045), (crank, 0.3)):
        result = fine(mbs.simulate(mechanism, duration, ledger=True))
        angle, spin = result["drive.position"], np.minimum(10 * result.time, 1.0)
        change = np.where(result.time < 0.1, 10.0, 0.0)
        assert result["crank.ax"] == pytest.approx(-0.5 * change * np.cos(angle) + 0.5 * spin**2 * np.sin(angle), abs=1e-9)
        inertia = BAR.inertia(1.0)[1] + BAR.inertia(1.0)[0] * 0.25
        assert result["drive.torque"] == pytest.approx(inertia * change, abs=1e-9)
    assert result["crank.ax"][0] == pytest.approx(-5.0, rel=1e-12)


def test_peak_torque_of_a_ramped_slider_crank():
    """0 to 10 rad/s in 0.5 s; the right peak from virtual work on a grid of its own."""
    mechanism = mbs.slider_crank(BAR, law=None, mass=0.3, speed=mbs.Ramp(0.0, 10.0, 0.5))
    torques = [
        fine(mbs.simulate(mechanism, 1.0, solver=solver))["drive.torque"]
        for solver in (mbs.Exudyn(), mbs.Exudyn(mbs.Equal(40000)))
    ]
    assert torques[0].max() == pytest.approx(torques[1].max(), rel=1e-3)
    result = mbs.simulate(mechanism, 1.0, ledger=True)
    kinetic = result.energy["kinetic"]
    power = np.gradient(kinetic, result.time)
    steady = (result.time > 0.55) & (result.time < 0.95)
    spin = 10.0
    assert result["drive.torque"][steady] == pytest.approx(power[steady] / spin, abs=0.02 * torques[0].max())
