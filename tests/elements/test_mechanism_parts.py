"""Motions and sections."""

import math
from dataclasses import replace

import pytest
from made import BAR, LENGTH, STRIP, steel
from scipy.integrate import quad
from simulations import simply_supported

from buckler.elastica import law, pinned
from buckler.mbs import STEEL, Beam, Drive, Link, Mechanism, Motion, Ramp, Revolute, Rigid, Strut, frequencies, simulate
from buckler.mbs.functions import Piecewise, Table

RAMPS = [Ramp(0.75, 6.58, 15.0), Ramp(2.0, -3.0, 0.5), Ramp(1.25, 1.25, 1.0), Ramp(0.0, 1.0, 1e-3)]


@pytest.mark.parametrize("ramp", RAMPS)
def test_ramp_position_is_the_integral_of_its_speed(ramp):
    for t in (0.0, 0.3 * ramp.duration, ramp.duration, 1.7 * ramp.duration):
        integral = quad(ramp.speed, 0.0, t, points=[ramp.duration] if t > ramp.duration else None, epsabs=1e-13)[0]
        assert ramp.position(t) == pytest.approx(integral, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("smooth", [False, True])
def test_the_integral_of_a_table_goes_on_beyond_its_ends(smooth):
    table = Table((0.1, 0.3, 0.7, 1.0), (1.0, -2.0, 3.0, 0.5), smooth)
    for t in (0.05, 0.2, 0.65, 1.7):
        points = [point for point in table.times if point < t] or None
        assert table.integral()(t) == pytest.approx(quad(table, 0.0, t, points=points, epsabs=1e-13)[0], rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("ramp", RAMPS)
def test_ramp_is_linear_and_then_stays(ramp):
    T = ramp.duration
    assert [ramp.speed(0.0), ramp.speed(T), ramp.speed(3 * T)] == pytest.approx([ramp.start, ramp.end, ramp.end])
    assert ramp.speed(T / 2) == pytest.approx((ramp.start + ramp.end) / 2)
    h = 1e-3 * T
    for t in (0.2 * T, 0.7 * T, 1.5 * T):
        assert ramp.acceleration(t) == pytest.approx((ramp.speed(t + h) - ramp.speed(t - h)) / (2 * h), abs=1e-9)


@pytest.mark.parametrize("factor", [-1.0, 0.99, 0.0, 2.0])
def test_wrong_derivative_of_a_motion_is_refused(factor):
    with pytest.raises(ValueError, match=r"drive: speed\(0.05\) = .* is not the derivative of position"):
        Motion(lambda t: math.sin(t), lambda t: factor * math.cos(t)).check_run(1.0, "drive")


@pytest.mark.parametrize("frequency", [50.0, 300.0, 2000.0])
def test_a_fast_oscillation_is_the_derivative_of_itself(frequency):
    """Its difference over 2e-4 s is 0.6 % off at 300 Hz."""
    w = 2 * math.pi * frequency
    Motion(lambda t: math.sin(w * t) / w, lambda t: math.cos(w * t)).check_run(1.0, "drive")
    with pytest.raises(ValueError, match="is not the derivative"):
        Motion(lambda t: math.sin(w * t) / w, lambda t: 1.01 * math.cos(w * t)).check_run(1.0, "drive")


def test_euler_load_is_where_the_elastica_begins():
    unit = STRIP.bending_stiffness / LENGTH**2
    assert STRIP.euler_load(LENGTH) == pytest.approx(unit * pinned.load(1e-12), rel=1e-11)
    assert Strut(STRIP).load is law.fast


def test_a_damped_section_has_that_damping_ratio_in_its_first_mode():
    """Of a pinned beam: its slowest vibration has the section's frequency, less by the damping."""
    section = STRIP.damped(0.3, LENGTH)
    found = frequencies(simply_supported(Beam(section), length=LENGTH), count=1)
    assert found.angular[0] == pytest.approx(section.first_frequency(LENGTH) * math.sqrt(1 - 0.3**2), rel=1e-4)
    assert found.damping[0] == pytest.approx(0.3, rel=1e-4)


def test_shear_stiffness_by_cowper():
    """Factor 5/6 without lateral contraction, 0.8497 at nu = 0.3 (Cowper 1966, doi 10.1115/1.3625046)."""
    plain = replace(BAR, material=steel(poisson=0.0))
    assert plain.shear_stiffness == pytest.approx(5 / 6 * STEEL.modulus / 2 * BAR.area, rel=1e-14)
    shear_modulus = STEEL.modulus / 2.6
    assert BAR.shear_stiffness / (shear_modulus * BAR.area) == pytest.approx(0.8497, abs=5e-5)


@pytest.mark.parametrize("at", [0.21, 0.63])
def test_a_speed_that_jumps_within_a_run_is_named_as_an_impulse(at):
    jumping = Motion(lambda t: 4.0 * t + 3.0 * max(t - at, 0.0), lambda t: 4.0 if t < at else 7.0)
    with pytest.raises(ValueError, match=rf"speed jumps from 4 to 7 at t = {at:g} s: .* impulse"):
        jumping.check_run(1.0, "drive")
    jumping.check_run(0.9 * at, "drive")


def test_a_kink_where_the_speed_is_looked_at_is_no_wrong_derivative():
    """A twentieth of the run after its start, where the slope of the position is taken, the speed rises at 1000 m/s^2."""
    times = (0.0, 0.1, 0.101, 2.0)
    Drive("T", speed=Table(times, (0.0, 0.0, 1.0, 1.0))).motion.check_run(2.0, "drive")


def test_a_drive_that_dwells_is_looked_at_while_it_moves():
    """It rests for three quarters of each second, and is at rest at all other times that are looked at."""

    def moved(t):
        turns, rest = divmod(t, 1.0)
        part = max(0.0, (rest - 0.75) / 0.25)
        return turns + part - math.sin(2 * math.pi * part) / (2 * math.pi)

    def speed(t):
        return 4 * (1 - math.cos(2 * math.pi * max(0.0, (t % 1.0 - 0.75) / 0.25)))

    at = {"breaks": (0.75, 0.999999), "period": 1.0}
    Motion(Piecewise(moved, **at), Piecewise(speed, **at)).check_run(3.2, "drive")
    with pytest.raises(ValueError, match="is not the derivative of position"):
        Motion(Piecewise(moved, **at), Piecewise(lambda t: 1.1 * speed(t), **at)).check_run(3.2, "drive")


def test_a_links_direction_is_its_angle_from_the_x_axis_and_its_angle_the_turn_since_the_start():
    crank = Mechanism(
        {"O": (0, 0), "A": (0.1 * math.cos(2.0), 0.1 * math.sin(2.0))}, [Link("crank", "O", "A", Rigid(BAR))],
        [Revolute("O", "ground", "crank")], drives=[Drive("crank", 3.0)],
    )  # fmt: skip
    result = simulate(crank, 1.0)
    assert result.signals["crank.angle"][[0, -1]] == pytest.approx([0.0, 3.0], abs=1e-9)
    assert result.signals["crank.direction"][[0, -1]] == pytest.approx([2.0, 5.0], abs=1e-9)


def test_rounding_of_a_speed_in_a_very_short_run_is_no_jump():
    Drive("crank", speed="49.37*cos(1342.1*t)").motion.check_run(2.5e-7, "drive")
