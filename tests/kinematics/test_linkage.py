"""Ideal kinematics: general loop closure against the closed form of the slider-crank, and how it fails."""

import numpy as np
import pytest
from simulations import BAR, closed, position, velocity

from buckler.mbs import Drive, Ramp, slider_crank
from buckler.mbs.library import PAPER, PAPER_STOP, SliderCrank

SPEED = 1.25


def driven_slider_crank(speed=SPEED, lengths=PAPER):
    return slider_crank(BAR, law=None, mass=0.3, speed=speed, lengths=lengths)


@pytest.mark.parametrize("lengths", [PAPER, SliderCrank(0.3, 0.31), SliderCrank(0.01, 2.0)])
def test_slider_position_and_speed_agree_with_closed_form(lengths):
    angles = np.linspace(0, 2 * np.pi, 73)
    closure, states = closed(driven_slider_crank(lengths=lengths), angles / SPEED)
    for angle, state in zip(angles, states, strict=True):
        x, y = position(closure, "coupler", "B", state.q)
        vx, vy = velocity(closure, "coupler", "B", state.q, state.q_t)
        assert abs(x - lengths.slider(angle)) < 1e-12 and abs(y) < 1e-12
        assert abs(vx - SPEED * lengths.slider_rate(angle)) < 1e-11 and abs(vy) < 1e-12


@pytest.mark.parametrize("ramp", [SPEED, Ramp(0.75, 6.58, 2.0)], ids=["constant", "ramp"])
def test_slider_acceleration_agrees_with_the_closed_form_differentiated(ramp):
    """Rates d2x/dtheta2 by the complex step on dx/dtheta, then a = x'' omega^2 + x' alpha."""
    motion, times = Drive("crank", ramp).motion, np.linspace(0, 3, 61)
    closure, states = closed(driven_slider_crank(ramp), times)
    for t, state in zip(times, states, strict=True):
        angle, omega, alpha = motion.position(t), motion.speed(t), motion.acceleration(t)
        second = PAPER.slider_rate(angle + 1e-30j).imag / 1e-30
        expected = second * omega**2 + PAPER.slider_rate(angle) * alpha
        arm = position(closure, "coupler", "B", state.q) - state.q[1, :2]
        spin, gain = state.q_t[1, 2], state.q_tt[1, 2]
        found = state.q_tt[1, :2] + gain * np.array([-arm[1], arm[0]]) - spin**2 * arm
        assert found == pytest.approx([expected, 0.0], abs=1e-9)


def test_published_contact_angle_and_speed():
    """Demirel et al. 2008 (doi 10.1115/IMECE2008-68796): stop at 120 degrees, 355.3 mm from the crank's pivot."""
    assert abs(PAPER_STOP + 0.355307) < 5e-7
    assert PAPER.contact_angle(PAPER_STOP) == pytest.approx(np.radians(120), abs=1e-12)
    assert abs(SPEED * PAPER.slider_rate(np.radians(120))) == pytest.approx(0.18874, abs=5e-6)


@pytest.mark.parametrize("stop", [-0.46, -0.16, -1e3, 0.17, 0.3, 0.45, 0.0])
def test_unreachable_stop_is_named_with_the_travel(stop):
    """Short of it, beyond it, at the pivot and on its other side."""
    with pytest.raises(ValueError, match=rf"stop = {stop:g} m: .* moves only in \[-0\.45, -0\.17\] m"):
        PAPER.contact_angle(stop)


def test_chord_shortening_and_lean_of_the_buckled_coupler():
    at_contact, dead_centre = np.radians(120), np.pi
    assert PAPER.shortening(at_contact, PAPER_STOP) == pytest.approx(0.0, abs=1e-15)
    assert PAPER.chord(dead_centre, PAPER_STOP) == pytest.approx(-PAPER_STOP - PAPER.crank, rel=1e-14)
    assert PAPER.lean_cosine(dead_centre, PAPER_STOP) == pytest.approx(1.0, abs=1e-15)
    for angle in np.radians([120, 140, 165, 200]):
        pin = PAPER.crank * np.exp(1j * angle)
        arm = PAPER_STOP - pin
        assert PAPER.chord(angle, PAPER_STOP) == pytest.approx(abs(arm), rel=1e-14)
        assert PAPER.lean_cosine(angle, PAPER_STOP) == pytest.approx(-np.cos(np.angle(arm)), rel=1e-13)
        assert PAPER.shortening(angle, PAPER_STOP) == pytest.approx(1 - abs(arm) / PAPER.coupler, abs=1e-14)
