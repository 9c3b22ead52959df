"""Joints with clearance against momentum, friction and closed-form kinematics, and their limit of no clearance."""

from dataclasses import replace
from math import hypot, pi, sqrt

import numpy as np
import pytest
from clearance_pair import CENTRES, JOINTS
from fourbar import FourBar
from scipy.integrate import solve_ivp
from simulations import fine, rates

from buckler import mbs
from buckler.mbs.laws import AdamsFriction, Coulomb, Impact
from buckler.mbs.library import CLOSED, RATTLING, CrankRocker
from buckler.mbs.scene.linkage import KinematicsError

BAR = mbs.Section(width=0.020, thickness=0.005)
PIN, GAP = 5e-3, 1e-4
FRICTION = AdamsFriction(0.3, 0.1)

# --- momentum ---------------------------------------------------------------------------------------------------------


def test_two_bars_that_only_touch_each_other_keep_their_momentum():
    """The first is made to turn, about its own centre of mass: no force from outside."""
    flown = mbs.Mechanism(
        points={"A": (0.0, 0.0), "B": (0.1, 0.0), "C": (0.25, 0.05)},
        links=[mbs.Link("one", "A", "B", mbs.Rigid(BAR)), mbs.Link("two", "B", "C", mbs.Rigid(BAR))],
        joints=[mbs.Clearance("B", "one", "two", PIN, GAP, RATTLING, FRICTION)],
        drives=[mbs.Drive("one", 30.0)],
    )
    result = fine(mbs.simulate(flown, 0.1, ledger=True))
    assert result.signals["B.contacts"][-1] > 20 and result.energy_balance < 1e-3
    one, two = BAR.mass_per_length * 0.1, BAR.mass_per_length * hypot(0.15, 0.05)
    for axis in ("vx", "vy"):
        parts = one * result.signals[f"one.{axis}"], two * result.signals[f"two.{axis}"]
        assert np.ptp(parts[0]) > 0.05  # they do change each other's
        assert np.ptp(parts[0] + parts[1]) < 1e-12 * np.abs(parts[0]).max()


@pytest.mark.parametrize(("law", "bar"), [(RATTLING, 1e-12), (CLOSED, 1e-9)], ids=["explicit", "implicit"])
def test_each_bar_is_accelerated_by_the_forces_of_its_joints(law, bar):
    """To rounding where the forces give the accelerations, to Newton's tolerance where they are solved for."""
    four = FourBar(law=law)
    signals = fine(mbs.simulate(four.mechanism(), 0.02, solver=mbs.Exudyn(mbs.Controlled(tolerance=1e-5)))).signals
    for axis in "xy":
        o, a, b, c = (signals[f"{point}.{pair}.f{axis}"] for point, pair in JOINTS.items())  # on the second body of each
        for name, mass, force in zip(CENTRES, four.masses, (o - a, a - b, b + c), strict=True):
            largest = np.abs(force).max()
            assert largest > 100 and np.abs(mass * signals[f"{name}.a{axis}"] - force).max() < bar * largest


# --- friction ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("dynamic", "speed"), [(0.1, 300.0), (0.3, -300.0)])
def test_journal_in_a_turning_bush_is_spun_up_and_loses_what_friction_says(dynamic, speed):
    """It lies on the slope of angle atan(mu): N = m g / sqrt(1 + mu^2), J omega' = mu N R, v_t = (R + e) Omega - R omega.

    Friction grows a little with speed, which ends the rocking on the slope that the fall into the bush began.
    """
    gravity, span, friction, law = 1e4, 0.3, Coulomb(dynamic, 1e-3, viscous=0.05), Impact(8e9, 3000.0, 1e-7)
    spun = mbs.Mechanism(
        points={"O": (0.0, 0.0), "D": (0.02, 0.0), "P": (0.0, 0.0), "Q": (-span / 2, 0.0), "R": (span / 2, 0.0)},
        links=[
            mbs.Link("drum", "O", "D", mbs.Rigid(BAR), carries=["P"]),
            mbs.Link("bar", "Q", "R", mbs.Rigid(BAR), carries=["P"]),
        ],
        joints=[mbs.Revolute("O", "ground", "drum"), mbs.Clearance("P", "bar", "drum", PIN, GAP, law, friction)],
        drives=[mbs.Drive("drum", speed)],
        gravity=(0.0, -gravity),
    )
    result = fine(mbs.simulate(spun, 0.06, solver=mbs.Exudyn(mbs.Controlled(tolerance=1e-4)), ledger=True, timeout=60))
    s, settled = result.signals, np.searchsorted(result.time, 0.035)
    along = [s[f"R.{axis}"] - s[f"Q.{axis}"] for axis in ("x", "y", "vx", "vy")]
    spin = (along[0] * along[3] - along[1] * along[2]) / span**2
    mass = BAR.mass_per_length * span
    inertia = mass * (span**2 + BAR.thickness**2) / 12
    radius = PIN + GAP + (mass * gravity / law.stiffness) ** (2 / 3)

    def motion(_t, y):
        slide = PIN * y[0] - radius * speed
        mu = friction.coefficient(slide)
        normal = mass * gravity / sqrt(1 + mu**2)
        return [-mu * normal * PIN / inertia, mu * normal * slide]

    times = result.time[[settled, -1]]
    expected = solve_ivp(motion, times, [spin[settled], 0.0], rtol=1e-10, atol=1e-12).y[:, -1]
    assert abs(spin[-1] - spin[settled]) > 20
    assert spin[-1] - spin[settled] == pytest.approx(expected[0] - spin[settled], rel=1e-3)
    lost = result.energy["taken_friction"]
    assert lost[-1] - lost[settled] == pytest.approx(expected[1], rel=1e-3)
    assert result.energy_balance < 1e-3


# --- ideal joints -----------------------------------------------------------------------------------------------------

IDEAL = FourBar(gap=0.0, start=0.5)


def test_ideal_joints_move_as_the_closed_form():
    """Nothing is integrated: places, velocities and accelerations to rounding, at any step."""
    result = fine(mbs.simulate(IDEAL.mechanism(), IDEAL.period))
    exact = IDEAL.ideal(result.time)
    for kind, form, scale in (("v", exact.velocity, IDEAL.speed), ("a", exact.acceleration, IDEAL.speed**2)):
        for i, bar in enumerate(CENTRES):
            for k, axis in enumerate("xy"):
                assert np.abs(result.signals[f"{bar}.{kind}{axis}"] - form[:, i, k]).max() < 1e-11 * scale


def test_engine_holds_ideal_joints_together_and_converges_to_the_closed_form():
    """The loop closes to rounding; velocities and, once the start is forgotten, accelerations to second order in the step."""
    errors = []
    for steps in (400, 800, 1600):
        result = fine(mbs.simulate(IDEAL.mechanism(), IDEAL.period, solver=mbs.Exudyn(mbs.Equal(steps)), ledger=True))
        s, exact, late = result.signals, IDEAL.ideal(result.time), result.time > IDEAL.period / 4
        for pair, length in (("OA", IDEAL.crank), ("AB", IDEAL.coupler), ("CB", IDEAL.rocker)):
            span = np.hypot(*(s[f"{pair[0]}.{axis}"] - s[f"{pair[1]}.{axis}"] for axis in "xy"))
            assert np.abs(span - length).max() < 1e-12
        off = [
            np.abs(s[f"{bar}.{kind}{axis}"] - form[:, i, k])[late].max()
            for kind, form in (("v", exact.velocity), ("a", exact.acceleration))
            for i, bar in enumerate(CENTRES)
            for k, axis in enumerate("xy")
        ]
        errors.append([max(off[:6]) / IDEAL.speed, max(off[6:]) / IDEAL.speed**2])
        assert result.energy_balance < 1e-3
    for kind in np.transpose(errors):
        assert rates(kind) == pytest.approx([2.0, 2.0], abs=0.1)
    assert errors[-1][0] < 5e-6 and errors[-1][1] < 1e-4


NO_GRASHOF = CrankRocker(0.2, 0.272, 0.175, 0.225)
"""Its crank gets from 1 rad to the angle at which coupler and rocker are in line, and not on."""


def test_dead_centre_at_the_start_is_named():
    """Coupler and rocker stretched out, to rounding or beyond reach."""
    reach = NO_GRASHOF.coupler + NO_GRASHOF.rocker
    flat = CrankRocker(NO_GRASHOF.crank, NO_GRASHOF.coupler, NO_GRASHOF.rocker, reach - NO_GRASHOF.crank)
    with pytest.raises(KinematicsError, match=r"crank angle 3\.14159 rad: coupler and rocker .*dead centre"):
        flat.places(pi)
    with pytest.raises(KinematicsError, match=r"crank angle 0 rad: coupler and rocker do not close"):
        mbs.crank_rocker(mbs.Rigid(BAR), speed=1.0, lengths=NO_GRASHOF, angle=0.0)


def test_crank_that_cannot_turn_stops_by_name():
    """With ideal joints it locks at the angle of the dead centre; with clearance pins are torn out of their bushes."""
    c = NO_GRASHOF
    near = abs(c.coupler - c.rocker)
    dead = 2 * pi - np.arccos((c.crank**2 + c.frame**2 - near**2) / (2 * c.crank * c.frame))
    speed, start = 10 * pi, 1.0
    ideal = mbs.simulate(mbs.crank_rocker(mbs.Rigid(BAR), speed=speed, lengths=c, angle=start), 0.2, timeout=60)
    assert ideal.status is mbs.Status.LOCKED and "(coupler and rocker in line)" in ideal.message
    assert start + speed * ideal.time[-1] == pytest.approx(dead, abs=1e-7)

    def play(point, first, second):
        return mbs.Clearance(point, first, second, PIN, GAP, RATTLING)

    torn = mbs.simulate(mbs.crank_rocker(mbs.Rigid(BAR), speed=speed, play=play, lengths=c, angle=start), 0.16, timeout=60)
    assert torn.status is mbs.Status.SUSPECT and "PENETRATION: pin 'B'" in torn.message


# --- no play ----------------------------------------------------------------------------------------------------------


def away(law, gap, tolerance):
    """Largest distance of a bar's centre from the closed form without play, over a tenth of a turn, and the depth, m."""
    bar = FourBar(gap=gap, start=IDEAL.start, law=law)
    result = mbs.simulate(bar.mechanism(), 0.02, solver=mbs.Exudyn(mbs.Controlled(tolerance=tolerance)), ledger=True, timeout=120)
    assert result.status is mbs.Status.OK or result.message.startswith("PENETRATION"), result.message
    assert result.energy_balance < 1e-3
    exact = IDEAL.ideal(result.time).place
    distance = max(
        np.hypot(*(result.signals[f"{name}.{axis}"] - exact[:, i, k] for k, axis in enumerate("xy"))).max()
        for i, name in enumerate(CENTRES)
    )
    return distance, max(result.signals[f"{point}.penetration"].max() for point in "OABC")


@pytest.mark.parametrize(
    ("law", "floor"), [(CLOSED, 3e-6), (Impact(100 * CLOSED.stiffness, 2.53e6, 1e-6), 2e-7)], ids=["paper", "stiff"]
)
def test_motion_tends_to_the_closed_form_of_ideal_joints(law, floor):
    """Two decades of play, 253 N s/mm: the distance is four times play and depth together, so its rate in the play is 1.

    On the paper's contacts it stops at their depth, 3 um; on contacts a hundred times stiffer it goes on.
    """
    gaps = np.array([1e-4, 1e-5, 1e-6])
    found, depth = np.transpose([away(law, gap, 1e-5) for gap in gaps])
    assert (depth > floor).all() and (depth < 3 * floor).all()
    assert found / (gaps + depth) == pytest.approx(np.full(3, 4.1), rel=0.15)
    if floor < 1e-6:
        assert np.log10(found[:-1] / found[1:]) == pytest.approx([1.0, 1.0], abs=0.08)


def test_ramp_and_number_drive_the_same_motion_without_play():
    """Constant speed by either: the closed form."""
    for speed in (IDEAL.speed, mbs.Ramp(IDEAL.speed, IDEAL.speed, 1.0)):
        result = fine(mbs.simulate(replace(IDEAL, speed=speed).mechanism(), 0.02))
        exact = IDEAL.ideal(result.time).place
        assert np.abs(result.signals["rocker.x"] - exact[:, 2, 0]).max() < 1e-9
