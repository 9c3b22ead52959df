"""Joints with clearance against momentum and the forces of their joints, and cranks that cannot turn."""

from math import hypot, pi

import numpy as np
import pytest
from clearance_pair import CENTRES, JOINTS
from fourbar import FourBar
from simulations import fine

from buckler import mbs
from buckler.mbs.laws import AdamsFriction
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
    ideal = mbs.simulate(mbs.crank_rocker(mbs.Rigid(BAR), speed=speed, lengths=c, angle=start), 0.2)
    assert ideal.status is mbs.Status.LOCKED and "(coupler and rocker in line)" in ideal.message
    assert start + speed * ideal.time[-1] == pytest.approx(dead, abs=1e-7)

    def play(point, first, second):
        return mbs.Clearance(point, first, second, PIN, GAP, RATTLING)

    torn = mbs.simulate(mbs.crank_rocker(mbs.Rigid(BAR), speed=speed, play=play, lengths=c, angle=start), 0.16)
    assert torn.status is mbs.Status.SUSPECT and "PENETRATION: pin 'B'" in torn.message
