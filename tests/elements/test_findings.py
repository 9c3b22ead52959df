"""Wrong input is a ValueError with the name of what is wrong; what is right is not refused; failures have their names."""

import math
import os
import signal
import threading
import time
from dataclasses import dataclass, replace

import numpy as np
import pytest
from simulations import BAR, STRIP, block, fine, pendulum, pressed, simply_supported

from buckler.mbs import (
    Beam,
    Cable,
    Clearance,
    Drive,
    Equal,
    Exudyn,
    Guide,
    Link,
    Material,
    Mechanism,
    Motion,
    Ramp,
    Result,
    Revolute,
    Rigid,
    Section,
    Spectral,
    Status,
    Stop,
    Strut,
    crank_rocker,
    simulate,
    slider_crank,
)
from buckler.mbs.laws import Hertz
from buckler.mbs.library import CrankRocker

POINTS = {"O": (0, 0), "A": (1, 0), "B": (2, 0)}


def made(**changed):
    parts = dict(
        points=POINTS,
        links=[Link("crank", "O", "A", BAR), Link("rod", "A", "B", BAR)],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "rod")],
        guides=[Guide("B", "rod", mass=1.0)],
    )
    return Mechanism(**{**parts, **changed})


def ran(**changed):
    return simulate(made(drives=[Drive("crank", 1.0)], **changed), 0.1)


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
    "joints in words": (lambda: made(joints="weld"), ["joints = 'weld'", "must be a list"]),
    "a joint in words": (lambda: made(joints=["weld"]), ["joints[0] = 'weld'", "Clearance or Revolute"]),
    "a guide among joints": (lambda: made(joints=[Guide("B", "rod")]), ["joints[0]", "this is a Guide"]),
    "one joint, no list": (lambda: made(joints=Revolute("O", "ground", "crank")), ["joints", "must be a list"]),
    "one drive, no list": (lambda: made(drives=Drive("crank", 1.0)), ["drives", "must be a list"]),
    "a list to drive": (lambda: Drive(["crank"], 1.0), ["target = ['crank']: must be a name"]),
    "driven twice": (lambda: made(drives=[Drive("crank", 1.0), Drive("crank", 2.0)]), ["'crank'", "driven twice"]),
    "gravity a number": (lambda: made(gravity=9.81), ["gravity = 9.81", "two numbers", "m/s^2"]),
    "gravity in space": (lambda: made(gravity=(0, 0, -9.81)), ["gravity", "two numbers"]),
    "a point in space": (lambda: made(points={**POINTS, "B": (2, 0, 0)}), ["points.B = (2, 0, 0)", "two numbers"]),
    "points a list": (lambda: made(points=[(0, 0)]), ["points = [(0, 0)]", "table of points"]),
    "a section for a body": (lambda: Link("a", "O", "A", Section(0.1, 0.1)), ["link 'a': body = Section", "this is a Section"]),
    "no body": (lambda: Link("a", "O", "A", None), ["link 'a': body = None"]),
    "a number for a name": (lambda: Link(3, "O", "A", BAR), ["name = 3: must be a name"]),
    "a law's class": (lambda: Stop("B", at=3, law=Hertz), ["law = Hertz", "instance"]),
    "a law without potential": (lambda: Stop("B", at=3, law=WithoutPotential()), ["lacks 'potential'"]),
    "an unhashable law": (lambda: Stop("B", at=3, law=Unhashable()), ["hashable", "frozen dataclass"]),
    "a motion that raises": (lambda: Motion(lambda t: 1 / 0, float), ["position(0) raises ZeroDivisionError"]),
    "a motion that raises later": (
        lambda: simulate(made(drives=[Drive("crank", Motion(breaks, lambda t: 1.0))]), 1.0),
        ["drive: position(0.5001) raises ZeroDivisionError"],
    ),
    "no such signal": (lambda: ran().at("nothing", 0.0), ["no signal 'nothing'", "O.x"]),
    "no such signal by item": (lambda: ran()["B.z"], ["no signal 'B.z'", "near it", "B.x"]),
    "after the run": (lambda: ran().at("B.x", 0.2), ["'B.x' at t = 0.2 s", "[0, 0.1] s"]),
    "before the run": (lambda: ran().at("B.x", [0.05, -0.1]), ["t = -0.1 s"]),
    "a solver for an accuracy": (lambda: simulate(made(), 0.1, Exudyn()), ["accuracy = Exudyn"]),
    "no mechanism": (lambda: simulate(None, 0.1), ["mechanism = None"]),
    "infinite modulus": (lambda: Material(modulus=math.inf, density=1.0, poisson=0.3), ["modulus = inf Pa: must be finite"]),
    "radius 1": (lambda: Exudyn(spectral_radius=1.0), ["spectral_radius = 1.0"]),
    "a clearance beyond its links": (
        lambda: made(joints=[Clearance("A", "crank", "rod", pin=0.01, gap=2.0, law=Hertz(1e8))]),
        ["gap = 2 m at 'A'", "below the length", "1 m"],
    ),
    "a beam as thick as long": (
        lambda: made(links=[Link("crank", "O", "A", Beam(Section(0.1, 1.0))), Link("rod", "A", "B", BAR)]),
        ["thickness of flexible link 'crank' = 1 m", "below its length"],
    ),
    "letters to carry": (lambda: Link("a", "O", "A", BAR, carries="AB"), ["link 'a': carries = 'AB'"]),
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
    mechanism = made()
    with pytest.raises(TypeError, match="does not change"):
        mechanism.points["A"] = (5.0, 5.0)


def test_what_is_shown_of_a_result_and_a_mechanism_is_short():
    result = fine(ran())
    assert len(repr(result)) < 400 and "OK" in repr(result) and "0.1 s" in repr(result)
    assert len(repr(made())) < 400 and "crank (Rigid)" in repr(made())
    with pytest.raises(KeyError):
        result["nothing"]
    assert result["B.x"] is result.signals["B.x"] and result.at("B.x", 0.1) == result["B.x"][-1]


# --- right, and accepted ----------------------------------------------------------------------------------------------


def test_two_struts_at_a_guided_point_with_mass():
    """Both push the block; the truss snaps from +h to -h of itself if it is driven there."""
    truss = Mechanism(
        {"L": (-0.3, 0.0), "R": (0.3, 0.0), "T": (0.0, 0.03)},
        [Link("left", "L", "T", Strut(STRIP)), Link("right", "R", "T", Strut(STRIP))],
        [Revolute("L", "ground", "left"), Revolute("R", "ground", "right"), Revolute("T", "left", "right")],
        [Guide("T", "left", (0, 1), mass=0.1)],
        drives=[Drive("T", -0.05)],
    )
    result = fine(simulate(truss, 0.2, ledger=True))
    assert result["left.compression"] == pytest.approx(result["right.compression"], rel=1e-9)
    lean = (0.03 + result["drive.position"]) / np.hypot(0.3, 0.03 + result["drive.position"])
    push = -2 * result["left.compression"] * lean
    late = result.time > 0.02
    assert result["drive.force"][late] == pytest.approx(push[late], abs=1e-3 * np.abs(push).max())


def test_a_driven_truss_of_strips_runs():
    truss = Mechanism(
        {"L": (-0.3, 0.0), "R": (0.3, 0.0), "T": (0.0, 0.1)},
        [Link("left", "L", "T", Beam(STRIP, imperfection=1e-3)), Link("right", "T", "R", Beam(STRIP, imperfection=1e-3))],
        [Revolute("L", "ground", "left"), Revolute("R", "right", "ground"), Revolute("T", "left", "right")],
        [Guide("T", "left", (0, 1), mass=0.1)],
        drives=[Drive("T", -0.02)],
    )
    result = simulate(truss, 0.1)
    assert result.status in (Status.OK, Status.SUSPECT) and "dead centre" not in result.message
    assert result.time[-1] == pytest.approx(0.1) and result["T.y"][-1] == pytest.approx(0.098, abs=1e-9)


@pytest.mark.parametrize(
    "mechanism",
    [
        pendulum(0.0),
        block(),
        simply_supported(Beam(STRIP), 0.0),
        simply_supported(Beam(STRIP, imperfection=1e-3), 0.0),
        simply_supported(Cable(STRIP), 0.0),
    ],
    ids=["pendulum", "block", "beam", "bowed beam", "cable"],
)
def test_rest_is_no_suspicion(mechanism):
    fine(simulate(mechanism, 1.0, ledger=True))


@pytest.mark.parametrize("duration", [1e-11, 1e-6])
def test_the_shortest_run_ends_where_it_should(duration):
    for mechanism in (pendulum(1.0), made(drives=[Drive("crank", 1.0)]), pressed(Strut(STRIP), 0.1, 1.0)):
        assert simulate(mechanism, duration).time[-1] == pytest.approx(duration, rel=1e-9)


def test_a_motion_is_not_asked_for_times_beyond_the_run():
    def known(t):
        assert 0 <= t <= 0.03 * (1 + 1e-12), f"asked for t = {t}"
        return t

    drive = Drive("crank", Motion(lambda t: 5 * known(t) ** 2, lambda t: 10 * known(t)))
    result = fine(simulate(made(drives=[drive]), 0.03))
    assert result["crank.ay"] == pytest.approx(
        5 * np.cos(result["drive.position"]) - 0.5 * (10 * result.time) ** 2 * np.sin(result["drive.position"]), abs=1e-6
    )


# --- ramps and kinks --------------------------------------------------------------------------------------------------


def test_a_lone_crank_starts_with_its_acceleration():
    """Centre at half of 1 m, spun up with 10 rad/s^2: 5 m/s^2 across from the start, to the kink and none after it."""
    crank = Mechanism(
        {"O": (0, 0), "A": (0, 1)},
        [Link("crank", "O", "A", BAR)],
        [Revolute("O", "ground", "crank")],
        drives=[Drive("crank", Ramp(0.0, 1.0, 0.1))],
    )
    for mechanism, duration in ((crank, 0.045), (crank, 0.3)):
        result = fine(simulate(mechanism, duration, ledger=True))
        angle, spin = result["drive.position"], np.minimum(10 * result.time, 1.0)
        change = np.where(result.time < 0.1, 10.0, 0.0)
        assert result["crank.ax"] == pytest.approx(-0.5 * change * np.cos(angle) + 0.5 * spin**2 * np.sin(angle), abs=1e-9)
        inertia = BAR.inertia(1.0)[1] + BAR.inertia(1.0)[0] * 0.25
        assert result["drive.torque"] == pytest.approx(inertia * change, abs=1e-9)
    assert result["crank.ax"][0] == pytest.approx(-5.0, rel=1e-12)


def test_peak_torque_of_a_ramped_slider_crank():
    """0 to 10 rad/s in 0.5 s; the right peak from virtual work on a grid of its own."""
    mechanism = slider_crank(BAR, law=None, mass=0.3, speed=Ramp(0.0, 10.0, 0.5))
    torques = [fine(simulate(mechanism, 1.0, solver=solver))["drive.torque"] for solver in (Exudyn(), Exudyn(Equal(40000)))]
    assert torques[0].max() == pytest.approx(torques[1].max(), rel=1e-3)
    result = simulate(mechanism, 1.0, ledger=True)
    kinetic = result.energy["kinetic"]
    power = np.gradient(kinetic, result.time)
    steady = (result.time > 0.55) & (result.time < 0.95)
    spin = 10.0
    assert result["drive.torque"][steady] == pytest.approx(power[steady] / spin, abs=0.02 * torques[0].max())


# --- what fails, fails by name ----------------------------------------------------------------------------------------


def parallelogram(drives, **more):
    points = {"O": (0, 0), "P": (2, 0), "A": (0, 1), "B": (2, 1), "Q": (1, 0), "C": (1, 1)}
    links = [
        Link("a", "O", "A", BAR),
        Link("b", "P", "B", BAR),
        Link("k", "A", "B", BAR, carries=["C"]),
        Link("c", "Q", "C", BAR),
    ]
    joints = [
        Revolute("O", "ground", "a"),
        Revolute("P", "ground", "b"),
        Revolute("A", "a", "k"),
        Revolute("B", "b", "k"),
        Revolute("Q", "ground", "c"),
        Revolute("C", "c", "k"),
    ]
    return Mechanism(points, links, joints, drives=drives, **more)


def test_a_parallel_fourth_leg_is_redundant_and_runs_right():
    result = fine(simulate(parallelogram([Drive("a", 1.0)]), 0.5, ledger=True))
    assert "redundant, and left out: 'C.c-k'" in result.provenance["notes"][0]
    for leg in "abc":
        assert result[f"{leg}.ax"] == pytest.approx(0.5 * np.sin(result.time), abs=1e-12)
    assert result["drive.torque"] == pytest.approx(0.0, abs=1e-10)


def test_a_free_parallelogram_with_a_parallel_leg_swings_as_a_pendulum():
    """Three legs turn, the bar on top moves in parallel: (3 m l^2/3 + M l^2) theta'' = (3 m l/2 + M l) g sin(theta)."""
    from scipy.integrate import solve_ivp

    mechanism = parallelogram([], velocities={"a": 1.0}, gravity=(0.0, -9.81))
    result = fine(simulate(mechanism, 0.5, ledger=True))
    leg, inertia, _ = BAR.inertia(1.0)
    top = BAR.inertia(2.0)[0]
    turning = 3 * (inertia + leg / 4) + top
    pull = (1.5 * leg + top) * 9.81
    exact = solve_ivp(lambda t, y: [y[1], pull * np.sin(y[0]) / turning], (0, 0.5), [0.0, 1.0], rtol=1e-11, atol=1e-12)
    assert result["A.x"][-1] == pytest.approx(-np.sin(exact.y[0, -1]), rel=2e-4)
    assert "'C.c-k'" in result.provenance["notes"][0]


def test_a_linkage_that_is_not_grashofs_locks():
    lengths = CrankRocker(0.2, 0.272, 0.175, 0.225)
    result = simulate(crank_rocker(BAR, speed=10.0, lengths=lengths, angle=1.0), 1.0)
    assert result.status is Status.LOCKED and "coupler and rocker in line" in result.message


def test_a_slider_past_its_reach_locks():
    result = simulate(made(points={"O": (0, 0), "A": (1, 0.5), "B": (2, 0)}, drives=[Drive("B", 0.5)]), 5.0)
    assert result.status is Status.LOCKED and result.message.startswith("the linkage locks at t = ")
    assert "(crank and rod in line)" in result.message
    assert result.time[-1] == pytest.approx((2 * math.hypot(1, 0.5) - 2) / 0.5, abs=1e-7)


def test_a_drive_square_to_its_guide_is_refused_by_name():
    with pytest.raises(ValueError, match=r"'guide B'|'O.ground-bar'.*'drive'") as caught:
        simulate(
            Mechanism(
                {"O": (0, 0), "B": (1, 0)},
                [Link("bar", "O", "B", BAR)],
                [Revolute("O", "ground", "bar")],
                [Guide("B", "bar")],
                drives=[Drive("B", 0.1)],
            ),
            1.0,
        )
    assert "contradict each other" in str(caught.value)


class Typo(Hertz):
    def force(self, depth, rate, onset):
        return self.stifness * depth


def test_a_law_with_a_typo_is_told_first():
    result = simulate(block(9.81, Typo(1e8)), 0.3)
    assert result.status is Status.FUNCTION_FAILED and "the law of the stop of 'A' raised AttributeError" in result.message
    assert "stifness" in result.message and "\n" not in result.message and len(result.message) < 200
    assert result.time[-1] == pytest.approx(math.sqrt(0.2 / 9.81), rel=0.02)


def test_a_motion_that_raises_between_the_looks_is_told_first():
    def place(t):
        if 0.0511 < t < 0.0515:
            raise RuntimeError("sensor broken")
        return t

    drive = Drive("A", Motion(lambda t: 1e-3 * place(t), lambda t: 1e-3))
    result = simulate(replace(pressed(Strut(STRIP), 0.1, 1.0), drives=[drive]), 0.08)
    assert result.status is Status.FUNCTION_FAILED and "raised RuntimeError: sensor broken" in result.message


def test_ctrl_c_ends_a_run_within_a_second():
    threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt):
        simulate(slider_crank(Beam(STRIP, elements=40), law=None, mass=0.3, speed=1.25), 500.0)
    assert time.perf_counter() - begin < 3.0
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_what_a_progress_raises_comes_through(error):
    def progress(share):
        if share > 0.1:
            raise error

    with pytest.raises(error):
        simulate(slider_crank(Beam(STRIP), law=None, mass=0.3, speed=1.25), 5.0, accuracy=1e-2, progress=progress)


# --- notes ------------------------------------------------------------------------------------------------------------

NOTED = {
    "a point shared without a joint": (
        lambda: replace(pendulum(0.1), links=[*pendulum(0.1).links, Link("other", "O", "A", BAR)]),
        "links 'bar' and 'other' share the point 'O' without a joint there",
    ),
    "a driven link without bearing": (
        lambda: Mechanism({"O": (0, 0), "A": (1, 0)}, [Link("crank", "O", "A", BAR)], drives=[Drive("crank", 1.0)]),
        "nothing ties the driven link 'crank' to the ground",
    ),
    "a stop out of reach": (
        lambda: made(drives=[Drive("crank", 1.0)], stops=[Stop("B", at=20.0, law=Hertz(1e8))]),
        "the stop of 'B' lies farther than the links reach",
    ),
}


@pytest.mark.parametrize("case", NOTED)
def test_what_looks_forgotten_is_noted(case):
    make, words = NOTED[case]
    notes = simulate(make(), 0.05).provenance["notes"]
    assert any(words in note for note in notes), notes


class Wordy(Hertz):
    """A law that asks a dictionary, which Numba cannot compile."""

    def force(self, depth, rate, onset):
        return {"force": super().force(depth, rate, onset)}["force"]


@pytest.mark.parametrize("solver", [Exudyn(), Spectral()], ids=["Exudyn", "Spectral"])
def test_a_law_that_cannot_be_compiled_is_told(solver):
    play = [Clearance("A", "crank", "rod", pin=0.01, gap=1e-4, law=law(1e8)) for law in (Wordy, Hertz)]
    slow, quick = (simulate(made(joints=[Revolute("O", "ground", "crank"), joint]), 1e-4, solver=solver) for joint in play)
    assert any("called back in Python" in note and "slower" in note for note in slow.provenance["notes"])
    assert not any("Python" in note for note in quick.provenance.get("notes", ()))
    assert slow["rod.x"] == pytest.approx(quick["rod.x"])


def test_nothing_is_noted_of_a_plain_mechanism():
    for mechanism in (made(drives=[Drive("crank", 1.0)]), crank_rocker(Rigid(STRIP), speed=1.0), pendulum(1.0)):
        assert "notes" not in simulate(mechanism, 0.01).provenance


def test_a_result_survives_its_file(tmp_path):
    result = simulate(parallelogram([Drive("a", 1.0)]), 0.1)
    again = Result.load(result.save(tmp_path / "run"))
    assert again.status is result.status and again.provenance["notes"] == result.provenance["notes"]
