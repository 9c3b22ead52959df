"""Runs that are right, and of which the checks say nothing."""

from dataclasses import replace

import numpy as np
import pytest
from judged import BARS, CLOSED, RATTLING, WET, K, rattling, striking
from scipy.integrate import solve_ivp
from simulations import BAR, LENGTH, STRIP, G, block, fine, pendulum, pressed

from buckler import mbs
from buckler.elastica import pinned
from buckler.mbs.laws import Hertz, Stiction

COUPLER = {
    "beam": mbs.Beam(WET, elements=8, imperfection=-1e-4 * LENGTH),
    "cable": mbs.Cable(WET, elements=12, imperfection=-1e-4 * LENGTH),
    "strut": mbs.Strut(STRIP),
}


@pytest.mark.parametrize("kind", COUPLER)
def test_slider_crank_is_fine(kind):
    fine(mbs.simulate(striking(COUPLER[kind]), 2.8))


ROCKERS = {
    "rigid": mbs.Rigid(BARS),
    "beam": mbs.Beam(BARS.damped(0.01, 0.175)),
    "modal": mbs.Modal(BARS, damping=0.01),
}


@pytest.mark.parametrize("law", [RATTLING, CLOSED], ids=["rattling", "closed"])
@pytest.mark.parametrize("rocker", ["rigid", "modal"])
def test_crank_rocker_with_play_is_fine(rocker, law):
    fine(mbs.simulate(rattling(law, rocker=ROCKERS[rocker]), 0.02))


@pytest.mark.slow
def test_blows_into_a_beam_are_known_as_well_as_its_polynomials_follow_them():
    """Within 5 % where pins rattle, and with a little more, which is told, where each blow bends the rocker by itself."""
    fine(mbs.simulate(rattling(RATTLING, rocker=ROCKERS["beam"]), 0.02))
    result = mbs.simulate(rattling(CLOSED, rocker=ROCKERS["beam"]), 0.02)
    assert result.ok or 0.05 < result.error["C.ground-rocker.fx", "impulse"] < 0.1


def test_ideal_linkage_is_fine_and_so_is_a_swing():
    fine(
        mbs.simulate(
            mbs.crank_rocker(mbs.Rigid(BARS), speed=10 * np.pi, section=BARS, angle=0.5),
            0.2,
            solver=mbs.Exudyn(mbs.Controlled(max_step=5e-4)),
        )
    )
    fine(mbs.simulate(pendulum(1.5), 2.0))


def test_a_bowed_strip_buckles_and_is_fine():
    strip = mbs.Beam(STRIP.damped(0.5, LENGTH), elements=8, imperfection=1e-3 * LENGTH)
    result = fine(mbs.simulate(pressed(strip, 0.3 * LENGTH, 10.0), 10.0))
    load = STRIP.euler_load(LENGTH) / np.pi**2 * float(pinned.load(0.3))
    late = result.time > 9.9
    assert np.median(result.signals["drive.force"][late]) == pytest.approx(load, rel=0.05)


def test_a_strip_with_a_bow_may_be_pressed_beyond_it():
    fine(mbs.simulate(pressed(mbs.Beam(WET, imperfection=1e-3), 4.9e-3 * LENGTH, 1.0), 1.0))


def test_a_straight_strip_may_be_pressed_beyond_it_for_a_moment():
    """In a tenth of a period nothing can have grown."""
    brief = 0.1 / STRIP.first_frequency(LENGTH)
    moved = replace(pressed(mbs.Beam(STRIP), 0.0, 1.0), drives=[mbs.Drive("A", 1e-5 * LENGTH / brief)])
    result = mbs.simulate(moved, brief)
    assert -result.signals["strip.axial_force"].min() > 5 * STRIP.euler_load(LENGTH)
    assert "UNBUCKLED" not in result.message


@pytest.mark.parametrize("stiffness", [1e5, 1e7])
@pytest.mark.parametrize("damping", [0.0, 100.0])
@pytest.mark.parametrize("duration", [0.1, 5.0])
def test_a_slider_that_sticks_is_fine(stiffness, damping, duration):
    """On a slope of 8 degrees, below its angle of friction: it does not move but for the bend of its bristles."""
    slope = np.radians(8.0)
    mechanism = block(friction=Stiction(0.3, 0.3, 1e-2, stiffness, damping), along=(np.cos(slope), np.sin(slope)))
    result = fine(mbs.simulate(replace(mechanism, gravity=(0.0, -G)), duration))
    pull = mechanism.guide("A").mass * G * np.sin(slope)
    assert np.hypot(result.signals["A.x"], result.signals["A.y"]).max() < 1e-3 * 0.1
    drag = result.signals["A.friction_force"]
    assert -2.1 * pull < drag.min() and drag.max() < 1e-3 * pull  # bristles that are not damped ring
    if damping or duration > 1:
        assert drag[-1] == pytest.approx(-pull, rel=0.05)


def column(body, share, mass=0.1, weight=False):
    """A strip between a pin and a slider under a share of its critical load: suddenly, or as the slider's weight."""
    load = share * WET.euler_load(LENGTH)
    return mbs.Mechanism(
        points={"A": (0, LENGTH), "B": (0, 0)},
        links=[mbs.Link("strip", "A", "B", body)],
        joints=[mbs.Revolute("B", "ground", "strip")],
        guides=[mbs.Guide("A", "strip", (0, 1), load / G if weight else mass)],
        loads=[] if weight else [mbs.Force("A", (0.0, -load))],
        gravity=(0.0, -G) if weight else (0.0, 0.0),
    )


@pytest.mark.parametrize(
    "mechanism",
    [
        column(mbs.Beam(WET, imperfection=1e-4 * LENGTH), 0.9),
        column(mbs.Beam(WET, imperfection=1e-4 * LENGTH), 0.9, mass=0.0),
        column(mbs.Cable(WET, imperfection=1e-3 * LENGTH), 0.9),
        column(mbs.Beam(WET, imperfection=1e-4 * LENGTH), 0.9, weight=True),
    ],
    ids=["beam", "light", "cable", "weight"],
)
def test_a_column_near_its_critical_load_is_fine(mechanism):
    """It hardly moves: the load's work is that of an axial vibration that steps leave out."""
    fine(mbs.simulate(mechanism, 1.0))


def test_a_double_pendulum_that_is_accurate_is_fine():
    """The ledger is that of the finest run, which extrapolation made more accurate."""
    places = {"O": (0, 0), "A": (0.5, 0), "B": (1.0, 0)}
    links = [mbs.Link("first", "O", "A", BAR), mbs.Link("second", "A", "B", BAR)]
    joints = [mbs.Revolute("O", "ground", "first"), mbs.Revolute("A", "first", "second")]
    fine(mbs.simulate(mbs.Mechanism(points=places, links=links, joints=joints, gravity=(0.0, -G)), 2.0, 1e-3))


def test_a_pin_deeper_than_its_clearance_is_remarked():
    """Its law is followed, as it would be with any clearance."""
    result = fine(mbs.simulate(rattling(Hertz(K), gap=1e-6), 0.003))
    assert any("more than its clearance 1e-06 m" in note for note in result.provenance["notes"])


@pytest.mark.parametrize("duration", [1e-3, 0.5])
def test_ramps_are_fine(duration):
    fine(mbs.simulate(mbs.slider_crank(mbs.Rigid(BARS), law=None, mass=0.3, speed=mbs.Ramp(0.0, 10.0, duration)), 1.0))


def test_a_clutch_that_locks_by_a_law_of_a_user_is_fine():
    """Steps of coarse runs miss edges of the law, whose times scatter as the discs lock; those of finer runs end on them."""
    first, second, most, band = 0.02, 0.05, 3.0, 1e-3
    axis, discs = {"O": (0, 0), "A": (0.1, 0), "B": (0, 0.1)}, {"one": ("A", first), "two": ("B", second)}
    clutch = mbs.Mechanism(
        axis,
        [mbs.Link(name, "O", end, mbs.Rigid.of(mass=1.0, inertia=j, centre=(0, 0))) for name, (end, j) in discs.items()],
        [mbs.Revolute("O", "ground", name) for name in discs],
        loads=[
            mbs.TorsionSpring("one", "two", 0.0, law=lambda angle, rate: most * max(-1.0, min(1.0, rate / band))),
            mbs.Torque("two", lambda t, angle, spin: -np.sin(4 * t)),
        ],
        velocities={"one": 60.0, "two": 0.0},
    )
    result = fine(mbs.simulate(clutch, 1.0))

    def rates(t, y):
        torque = most * np.clip((y[3] - y[2]) / band, -1, 1)
        return [y[2], y[3], torque / first, (-torque - np.sin(4 * t)) / second]

    exact = solve_ivp(rates, (0, 1), [0, 0, 60, 0], "Radau", rtol=1e-10, atol=1e-11, max_step=0.01, t_eval=result.time).y
    for name, angle in zip(discs, exact, strict=False):
        assert np.abs(result.signals[f"{name}.angle"] - angle).max() < 2 * result.error.absolute(f"{name}.angle", "peak") + 1e-8
