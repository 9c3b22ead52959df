"""Wrong input is a ValueError with the name of what is wrong; what is right is not refused; failures have their names."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from made import POINTS, stiff
from simulations import BAR, STRIP, block, fine, pendulum, simply_supported

from buckler import mbs
from buckler.mbs.laws import Hertz


def ran(**changed):
    return mbs.simulate(stiff(drives=[mbs.Drive("crank", 1.0)], **changed), 0.1)


def coiled(first, second):
    return stiff(loads=[mbs.TorsionSpring(first, second, stiffness=1.0)])


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


WRONG = {  # beside ranges of fields (tests/files/test_declared.py)
    "ratio": (lambda: STRIP.damped(-0.1, 0.31), ["ratio = -0.1", " in [0, inf)"]),
    "elements": (lambda: mbs.Beam(STRIP, elements=0), ["elements = 0", " in [1, 1000]"]),
    "nodes": (lambda: mbs.Beam(STRIP, nodes=4), ["nodes = 4", " in [2, 3]"]),
    "static below dynamic": (lambda: mbs.GuideFriction(2.0, static=1.0), ["static = 1.0 N", " in [2, inf) N"]),
    "along": (lambda: mbs.Guide("B", "bar", along=(0.0, 0.0)), ["along (length) = 0.0", " in (0, inf)"]),
    "position(0)": (lambda: mbs.Motion(math.cos, lambda t: -math.sin(t)), ["position(0) = 1.0 rad or m", " in [-1e-12, 1e-12]"]),
    "speed": (lambda: mbs.Drive("crank", math.nan), ["speed"]),
    "speed in words": (lambda: mbs.Drive("crank", "fast"), ["speed"]),
    "a joint in words": (lambda: stiff(joints=["weld"]), ["joints[0] = 'weld'", "Clearance or Revolute"]),
    "a guide among joints": (lambda: stiff(joints=[mbs.Guide("B", "rod")]), ["joints[0]", "this is a Guide"]),
    "one joint, no list": (lambda: stiff(joints=mbs.Revolute("O", "ground", "crank")), ["joints", "must be a list"]),
    "a list to drive": (lambda: mbs.Drive(["crank"], 1.0), ["target = ['crank']: must be a name"]),
    "driven twice": (lambda: stiff(drives=[mbs.Drive("crank", 1.0), mbs.Drive("crank", 2.0)]), ["'crank'", "driven twice"]),
    "gravity a number": (lambda: stiff(gravity=9.81), ["gravity = 9.81", "two numbers", "m/s^2"]),
    "a point in space": (lambda: stiff(points={**POINTS, "B": (2, 0, 0)}), ["points.B = (2, 0, 0)", "two numbers"]),
    "a section for a body": (
        lambda: mbs.Link("a", "O", "A", mbs.Section(0.1, 0.1)),
        ["link 'a': body", "is a Section"],
    ),
    "a law's class": (lambda: mbs.Stop("B", at=3, law=Hertz), ["law = Hertz", "instance"]),
    "a law without potential": (lambda: mbs.Stop("B", at=3, law=WithoutPotential()), ["lacks 'potential'"]),
    "an unhashable law": (lambda: mbs.Stop("B", at=3, law=Unhashable()), ["hashable", "frozen dataclass"]),
    "a motion that raises": (lambda: mbs.Motion(lambda t: 1 / 0, float), ["position(0) raises ZeroDivisionError"]),
    "a motion that raises later": (
        lambda: mbs.simulate(stiff(drives=[mbs.Drive("crank", mbs.Motion(breaks, lambda t: 1.0))]), 1.0),
        ["drive: position(0.50001) raises ZeroDivisionError"],
    ),
    "no such signal by item": (lambda: ran()["B.z"], ["no signal 'B.z'", "near it", "B.x"]),
    "after the run": (lambda: ran().at("B.x", 0.2), ["'B.x' at t = 0.2 s", "[0, 0.1] s"]),
    "no mechanism": (lambda: mbs.simulate(None, 0.1), ["mechanism = None"]),
    "a clearance beyond its links": (
        lambda: stiff(joints=[mbs.Clearance("A", "crank", "rod", pin=0.01, gap=2.0, law=Hertz(1e8))]),
        ["gap = 2 m at 'A'", "below the length", "1 m"],
    ),
    "a torsion spring of one section": (lambda: coiled("rod:A", "rod:A"), ["torsion spring of 'rod:A'", "two different links"]),
    "a torsion spring of one rigid link": (lambda: coiled("crank:O", "crank:A"), ["spring of 'crank:O'", "two different links"]),
    "a beam as thick as long": (
        lambda: stiff(links=[mbs.Link("crank", "O", "A", mbs.Beam(mbs.Section(0.1, 1.0))), mbs.Link("rod", "A", "B", BAR)]),
        ["thickness of flexible link 'crank' = 1 m", "below its length"],
    ),
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


@pytest.mark.parametrize(
    "mechanism",
    [pendulum(0.0), block(), *map(simply_supported, (mbs.Beam(STRIP), mbs.Beam(STRIP, imperfection=1e-3), mbs.Cable(STRIP)))],
    ids=["pendulum", "block", "beam", "bowed beam", "cable"],
)
def test_rest_is_no_suspicion(mechanism):
    fine(mbs.simulate(mechanism, 1.0, ledger=True))


def test_a_lone_crank_starts_with_its_acceleration():
    """Centre at half of 1 m, spun up with 10 rad/s^2: 5 m/s^2 across from the start, to the kink and none after it."""
    link, pin, ramp = mbs.Link("crank", "O", "A", BAR), mbs.Revolute("O", "ground", "crank"), mbs.Ramp(0.0, 1.0, 0.1)
    crank = mbs.Mechanism({"O": (0, 0), "A": (0, 1)}, [link], [pin], drives=[mbs.Drive("crank", ramp)])
    for duration in (0.045, 0.3):
        result = fine(mbs.simulate(crank, duration, ledger=True))
        angle, spin = result["drive.position"], np.minimum(10 * result.time, 1.0)
        change = np.where(result.time < 0.1, 10.0, 0.0)
        assert result["crank.ax"] == pytest.approx(-0.5 * change * np.cos(angle) + 0.5 * spin**2 * np.sin(angle), abs=1e-9)
        inertia = BAR.mass_properties(1.0)[1] + BAR.mass_properties(1.0)[0] * 0.25
        assert result["drive.torque"] == pytest.approx(inertia * change, abs=1e-9)
    assert result["crank.ax"][0] == pytest.approx(-5.0, rel=1e-12)
