"""Guides: their lateral reaction, friction that follows it, and true stiction."""

import math
from dataclasses import replace

import numpy as np
import pytest
from simulations import fine

from buckler import mbs
from buckler.mbs.laws import Coulomb, ExactRestitution, LuGre, Stiction

G = 9.81
MASS, BAR = 0.5, mbs.Rigid.of(mass=0.2, inertia=1e-3, centre=(0.0, 0.0))
WEIGHT = (MASS + 0.2) * G
STICKING = Stiction(0.25, 0.2, 1e-2, 1e5, 100.0)


def slope(friction, angle, turn=0.0):
    """A block on a line, gravity at an angle to the line's normal; the whole scene turned."""
    c, s = math.cos(turn), math.sin(turn)
    down, across = G * math.sin(angle), -G * math.cos(angle)
    return mbs.Mechanism(
        points={"A": (0, 0), "B": (0.1 * s, -0.1 * c)},
        links=[mbs.Link("bar", "A", "B", BAR)],
        guides=[mbs.Guide("A", "bar", along=(c, s), mass=MASS, friction=friction)],
        gravity=(c * down - s * across, s * down + c * across),
    )


@pytest.mark.parametrize("turn", [0.0, 0.8, 3.0])
def test_block_slides_down_a_slope(turn):
    """It gains g (sin - mu cos), with the reaction W cos on the left of the line."""
    angle, mu = 0.5, 0.2
    solver = mbs.Exudyn(
        mbs.Controlled(tolerance=1e-9, max_step=2e-4)
    )  # the first step, a thousandth of that, knows no friction yet
    result = fine(mbs.simulate(slope(Coulomb(mu, 1e-7), angle, turn), 0.5, solver=solver, ledger=True))
    run = result.signals
    pull = G * (math.sin(angle) - mu * math.cos(angle))
    assert np.hypot(run["A.x"], run["A.y"])[-1] == pytest.approx(pull * 0.5**2 / 2, rel=1e-6)
    assert run["A.guide_force"][1:] == pytest.approx(WEIGHT * math.cos(angle), rel=1e-8)
    assert run["A.friction_force"][1:] == pytest.approx(mu * WEIGHT * math.cos(angle), rel=1e-6)
    assert result.energy_balance < 1e-6
    assert result.energy["taken_friction"][-1] == pytest.approx(mu * WEIGHT * math.cos(angle) * pull * 0.125, rel=1e-5)


def ladder(friction, speed=1e-3, mass=2.0):
    """A rod on floor and wall, both rough, its foot drawn out."""
    return mbs.Mechanism(
        points={"A": (0.3, 0), "E": (0, 0.4)},
        links=[mbs.Link("rod", "A", "E", mbs.Rigid.of(mass=mass, inertia=0.02))],
        guides=[mbs.Guide("A", "rod", friction=friction), mbs.Guide("E", "rod", along=(0, 1), friction=friction)],
        drives=[mbs.Drive("A", speed)],
        gravity=(0, -G),
    )


LAWS = {
    "Coulomb": lambda mu: Coulomb(mu, 1e-9),
    "stiction": lambda mu: Stiction(mu, mu, 1e-2, 1e7),
    "LuGre": lambda mu: LuGre(mu, mu, 1e-2, 1e7),
}


@pytest.mark.parametrize("mu", [0.1, 0.6, 1.5])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
def test_ladder_slips_by_the_closed_form(law, mu):
    """Moments about the foot: H (b + mu a) = W a/2; floor N = W - mu H; the foot is drawn with mu N - H."""
    result = fine(mbs.simulate(ladder(law(mu)), 20.0, solver=mbs.Exudyn(), ledger=True))
    run = result.signals
    a, b, weight = run["A.x"], run["E.y"], 2 * G
    wall = weight * a / (2 * (b + a * mu))
    floor = weight - mu * wall
    later = slice(5, None)
    assert -run["E.guide_force"][later] == pytest.approx(wall[later], rel=1e-6)
    assert run["A.guide_force"][later] == pytest.approx(floor[later], rel=1e-6)
    assert run["drive.force"][later] == pytest.approx((mu * floor - wall)[later], abs=1e-6 * weight)
    assert run["A.friction_force"][later] == pytest.approx(mu * floor[later], rel=1e-6)
    assert run["E.friction_force"][later] == pytest.approx(-mu * wall[later], rel=1e-6)  # against a speed that is negative
    assert result.energy_balance < 1e-5


@pytest.mark.parametrize("angle", [0.2, -0.2])
def test_slider_stays_at_rest_and_its_force_is_between_the_limits(angle):
    """Sticking force = the pull; the limit mu_s N is the interval that statics leave; no drift at all once at rest."""
    result = fine(mbs.simulate(slope(STICKING, angle), 0.5, solver=mbs.Exudyn(mbs.Equal(2000)), ledger=True))
    run = result.signals
    half = len(result.time) // 2
    assert np.ptp(run["A.x"][half:]) == 0.0
    assert run["A.friction_force"][-1] == pytest.approx(WEIGHT * math.sin(angle), rel=1e-8)
    assert run["A.friction_limit"][-1] == pytest.approx(0.25 * WEIGHT * math.cos(angle), rel=1e-8)
    assert (np.abs(run["A.friction_force"]) <= run["A.friction_limit"] * (1 + 1e-12)).all()
    bend = math.tan(angle) / 1e5
    assert run["A.x"][-1] == pytest.approx(bend, rel=0.1)  # the reaction is the same throughout
    assert np.abs(result.energy["error"]).max() < 1e-7 * WEIGHT * 0.1


def test_slider_slips_where_the_static_limit_is_passed():
    """Gravity at an angle beyond atan(mu_s) moves it, below that it holds; a regularised law creeps."""
    for angle, slides in ((math.atan(0.26), True), (math.atan(0.24), False)):
        run = mbs.simulate(slope(STICKING, angle), 0.5, solver=mbs.Exudyn(mbs.Controlled(tolerance=1e-7))).signals
        assert (run["A.x"][-1] > 1e-3) == slides
    creep = [
        np.ptp(mbs.simulate(slope(law, 0.2), 0.5, solver=mbs.Exudyn(mbs.Equal(2000))).signals["A.x"][1000:])
        for law in (LuGre(0.25, 0.2, 1e-2, 1e5, 100.0), STICKING, Coulomb(0.25, 1e-3))
    ]
    assert creep[1] == 0.0 and creep[2] > 1e-4


def test_shaken_load_below_the_limit_does_not_move_a_stuck_slider():
    """A rocking pendulum on the block pulls it to and fro: after hundreds of cycles the block is where it was."""
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": (0.03, -0.1)},
        links=[mbs.Link("bar", "A", "B", mbs.Rigid.of(mass=0.1, inertia=1e-4))],
        guides=[mbs.Guide("A", "bar", mass=2.0, friction=replace(STICKING, bristle_damping=10.0))],
        gravity=(0, -G),
    )
    result = mbs.simulate(mechanism, 4.0, solver=mbs.Exudyn(mbs.Equal(8000)), ledger=True)
    run = result.signals
    assert np.ptp(run["B.x"]) > 0.05
    assert np.abs(run["A.friction_force"]).max() > 0.1
    early, late = (run["A.x"][(result.time > a) & (result.time < a + 1)] for a in (0.5, 3.0))
    assert late.mean() == pytest.approx(early.mean(), abs=2e-8)
    assert result.energy_balance < 1e-2


def test_a_massless_block_dissipates_what_its_shaken_link_loses():
    """The rod vibrates on the bristles, 180 steps in a period: their damping takes the work of the load."""
    law = Stiction(0.3, 0.2, v_stribeck=1e-2, bristle_stiffness=1e3, bristle_damping=2.0)
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": (0.2, 0)},
        links=[mbs.Link("rod", "A", "B", mbs.Rigid.of(mass=1.0, inertia=1e-2))],
        guides=[mbs.Guide("A", "rod", friction=law), mbs.Guide("B", "rod")],
        loads=[mbs.Force("A", ("0.02*sin(125.66*t)", 0.0))],
        gravity=(0, -G),
    )
    result = mbs.simulate(mechanism, 1.0, solver=mbs.Exudyn(mbs.Equal(2000)), ledger=True)
    assert np.ptp(result.signals["A.x"]) < 1e-5  # it does not slide
    assert result.energy["taken_friction"][-1] == pytest.approx(result.energy["given_load"][-1], rel=0.2)
    assert result.energy_balance < 1e-3


def test_reaction_under_a_strut():
    """A strut leans on a block: the guide takes its lateral part and the block's weight."""
    section = mbs.Section(0.02, 0.0005)
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "C": (-0.3, 0.2), "O": (-0.3, 0.2)},
        links=[mbs.Link("strut", "C", "A", mbs.Strut(section))],
        guides=[
            mbs.Guide("A", "strut", mass=0.3, friction=mbs.GuideFriction(0.5)),
            mbs.Guide("C", "strut", along=(1, 0), mass=0.1),
        ],
        drives=[mbs.Drive("C", 0.0)],
        gravity=(0.5, -G),
    )
    run = mbs.simulate(mechanism, 0.05).signals
    chord = np.column_stack([run["A.x"] - run["C.x"], run["A.y"] - run["C.y"]])
    push = run["strut.compression"] * chord[:, 1] / np.hypot(*chord.T)
    assert run["A.guide_force"] == pytest.approx(0.3 * G - push, rel=1e-6, abs=1e-9)


def test_stiction_serves_joints_with_clearance():
    joint = mbs.Clearance("A", "ground", "rod", 5e-3, 1e-4, ExactRestitution(1e8, 0.5), Stiction(0.3, 0.2, 1e-2, 1e5, 10.0))
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": (0.2, 0)},
        links=[mbs.Link("rod", "A", "B", mbs.Rigid(mbs.Section(0.02, 0.01)))],
        joints=[joint],
        gravity=(0, -G),
    )
    result = fine(mbs.simulate(mechanism, 0.05, ledger=True))
    run = result.signals
    assert np.abs(run["A.friction_force"]).max() > 0.01
    assert (np.abs(run["A.friction_force"]) <= 0.3 * run["A.normal_force"] * (1 + 1e-9)).all()


def test_law_that_needs_the_reaction_is_refused_under_a_strut():
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "C": (-0.3, 0.2)},
        links=[mbs.Link("strut", "C", "A", mbs.Strut(mbs.Section(0.02, 0.0005)))],
        guides=[mbs.Guide("A", "strut", mass=0.3, friction=Coulomb(0.1)), mbs.Guide("C", "strut", mass=0.1)],
    )
    with pytest.raises(ValueError, match="needs a link with mass there, not a Strut"):
        mbs.build(mechanism)


def test_slider_crank_pushes_its_block_at_the_friction_angle():
    """Slow, its rod without weight: the rod's push P at angle phi has P cos phi = load + mu N, N = P sin phi."""
    mu, load = 0.3, 5.0
    mechanism = mbs.Mechanism(
        points={"O": (0, 0), "A": (0.0, 0.1), "B": (0.3, 0.0)},
        links=[
            mbs.Link("crank", "O", "A", mbs.Rigid.of(mass=1e-6, inertia=1e-9)),
            mbs.Link("rod", "A", "B", mbs.Rigid.of(mass=1e-6, inertia=1e-9)),
        ],
        joints=[mbs.Revolute("O", "ground", "crank"), mbs.Revolute("A", "crank", "rod")],
        guides=[mbs.Guide("B", "rod", mass=load, friction=Coulomb(mu, 1e-9))],
        drives=[mbs.Drive("crank", -1e-3)],
        gravity=(-1.0, 0.0),
    )
    run = fine(mbs.simulate(mechanism, 600.0)).signals
    later = slice(5, None)
    phi = np.arcsin(run["A.y"] / np.hypot(run["B.x"] - run["A.x"], run["A.y"]))[later]
    push = load / (np.cos(phi) - mu * np.sin(phi))
    assert run["B.guide_force"][later] == pytest.approx(push * np.sin(phi), rel=1e-6, abs=1e-6)
    assert run["B.friction_force"][later] == pytest.approx(mu * push * np.sin(phi), rel=1e-6, abs=1e-6)
    lever = 0.1 * np.sin(np.arctan2(run["A.y"], run["A.x"])[later] + phi)
    assert run["drive.torque"][later] == pytest.approx(-push * lever, rel=1e-5, abs=1e-6)
