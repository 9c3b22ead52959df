"""Kinks of drives and points of loads' tables: known, stepped onto, and what follows is right at once."""

import numpy as np
import pytest
from simulations import BAR, block

from buckler import mbs
from buckler.mbs import Torque as Moment
from buckler.mbs.functions import Components, Table
from buckler.mbs.scene.scene import Scene

SPEED = Table((0.0, 0.123, 0.3, 0.55), (0.0, 8.0, 8.0, 3.0))
"""Of a crank, rad/s; it is constant in the middle and beyond the end."""
SLOPES = (8.0 / 0.123, 0.0, -5.0 / 0.25, 0.0)
MOTION = mbs.Drive("crank", SPEED).motion


def angle(t):
    """Integral of `SPEED`, by hand."""
    if t <= 0.123:
        return 8.0 / 0.123 * t**2 / 2
    if t <= 0.3:
        return 4.0 * 0.123 + 8.0 * (t - 0.123)
    late = min(t, 0.55) - 0.3
    return 4.0 * 0.123 + 8.0 * 0.177 + 8.0 * late - 20.0 * late**2 / 2 + 3.0 * max(0.0, t - 0.55)


def test_the_travel_of_a_table_of_speeds_is_exact():
    for t in np.linspace(0, 0.9, 37):
        assert MOTION.position(t) == pytest.approx(angle(t), abs=1e-14)


@pytest.mark.parametrize("after", [0.0, 1e-9, 3e-5, 1e-4, 0.01])
def test_the_acceleration_is_that_of_the_side_of_the_kink(after):
    for k, (start, end) in enumerate([(0.0, 0.123), (0.123, 0.3), (0.3, 0.55), (0.55, 1.0)]):
        assert MOTION.acceleration(start + after, 1.0) == pytest.approx(SLOPES[k], abs=1e-8)
        if 0 < after < 0.01:
            assert MOTION.acceleration(end - after, 1.0) == pytest.approx(SLOPES[k], abs=1e-8)


def test_everything_that_acts_tells_its_kinks():
    table = Table((0.1, 0.2), (0.0, 1.0))
    crank = mbs.Mechanism(
        {"O": (0, 0), "A": (0.5, 0)}, [mbs.Link("crank", "O", "A", BAR)], [mbs.Revolute("O", "ground", "crank")],
        loads=[
            mbs.Force("A", Components((Table((0.3, 0.4), (0.0, 1.0)), 0.0))), Moment("crank", table),
            mbs.Motor("crank", Table((0.5, 0.6), (0.0, 1.0)), 1.0, 0.1),
        ],
    )  # fmt: skip
    assert Scene.of(crank).kinks(0.55) == (0.1, 0.2, 0.3, 0.4, 0.5)
    assert Scene.of(mbs.slider_crank(BAR, law=None, mass=0.3, speed=mbs.Ramp(0, 1, 0.1))).kinks(1.0) == (0.1,)


def test_the_torque_of_a_crank_jumps_where_its_speed_has_a_kink():
    """I alpha about its pivot, on both sides of every kink, and nothing between."""
    bar = mbs.Rigid.of(mass=0.4, inertia=3e-3)
    crank = mbs.Mechanism(
        {"O": (0, 0), "A": (0.5, 0)}, [mbs.Link("crank", "O", "A", bar)], [mbs.Revolute("O", "ground", "crank")],
        drives=[mbs.Drive("crank", SPEED)],
    )  # fmt: skip
    result = mbs.simulate(crank, 0.9)
    inertia = 3e-3 + 0.4 * 0.25**2
    side = np.searchsorted((0.123, 0.3, 0.55), result.time, side="right")
    assert result.ok
    assert result.signals["drive.torque"] == pytest.approx(inertia * np.array(SLOPES)[side], abs=1e-8)
    impulse = np.trapezoid(result.signals["drive.torque"], result.time)
    assert impulse == pytest.approx(inertia * 3.0, rel=1e-9)


STRIP = mbs.Beam(mbs.Section(0.03, 3e-3).damped(0.02, 0.31), elements=4)


@pytest.mark.parametrize(
    "solver", [mbs.Exudyn(), mbs.Exudyn(mbs.Controlled(max_step=0.1)), mbs.Spectral()], ids=["default", "long", "compiled"]
)
def test_steps_end_at_kinks(solver):
    result = mbs.simulate(mbs.slider_crank(STRIP, law=None, mass=0.3, speed=SPEED), 0.7, solver=solver)
    for kink in (0.123, 0.3, 0.55):
        assert np.abs(result.time - kink).min() < 1e-9
    assert np.diff(result.time).max() <= 0.1 * (1 + 1e-9)


PUSH = Table((0.1, 0.101, 0.102), (0.0, 50.0, 0.0))
"""A short push, N, that long steps would not see."""


@pytest.mark.parametrize(
    "solver", [mbs.Exudyn(), mbs.Exudyn(mbs.Controlled(max_step=0.5)), mbs.Spectral()], ids=["default", "long", "compiled"]
)
def test_a_short_push_between_two_steps_is_felt(solver):
    """Its impulse is 0.05 N s; the block and its bar have known masses."""
    pushed = block()
    pushed = mbs.Mechanism(
        pushed.points, pushed.links, guides=pushed.guides, loads=[mbs.Force("A", Components((PUSH, 0.0)))], gravity=(0, 0)
    )
    result = mbs.simulate(pushed, 1.0, solver=solver)
    mass = pushed.guide("A").mass + pushed.links[0].mass(0.1)
    assert result.signals["A.vx"][-1] == pytest.approx(0.05 / mass, rel=2e-3)
    assert result.signals["A.x"][-1] == pytest.approx(0.05 / mass * (1.0 - 0.101), rel=2e-3)
