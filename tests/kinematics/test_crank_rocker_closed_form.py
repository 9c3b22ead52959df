"""The ideal crank-rocker in closed form and its numbers."""

import numpy as np
import pytest
from clearance_pair import beam_modes
from fourbar import FourBar
from simulations import closed

from buckler.mbs.library import CLOSED, RATTLING

TIMES = np.linspace(0, 0.2, 41)


@pytest.mark.parametrize("bar", [FourBar(), FourBar(crank=0.08, start=2.0, speed=-40.0)])
def test_loops_close_and_bars_keep_their_lengths(bar):
    place = bar.ideal(TIMES).place
    direction = np.stack([np.cos(place[..., 2]), np.sin(place[..., 2])], axis=-1)
    half = 0.5 * bar.lengths[:, None] * direction
    start, end = place[..., :2] - half, place[..., :2] + half
    grounded = np.tile([bar.frame, 0.0], (len(TIMES), 1))
    np.testing.assert_allclose(start, np.stack([np.zeros((len(TIMES), 2)), end[:, 0], grounded], axis=1), atol=1e-15)
    np.testing.assert_allclose(end[:, 2], end[:, 1], atol=1e-15)
    a, b, c = start[:, 1], end[:, 2], np.array([bar.frame, 0.0])
    left = (c - a)[:, 0] * (b - a)[:, 1] - (c - a)[:, 1] * (b - a)[:, 0]
    assert (left > 1e-3).all()  # open branch, never at a dead centre


def test_velocities_and_accelerations_are_the_derivatives():
    """Central differences: the error falls with the square of the step."""
    bar, errors = FourBar(start=1.0), []
    exact = bar.ideal(TIMES)
    for h in (1e-4, 5e-5):
        after, before = bar.ideal(TIMES + h), bar.ideal(TIMES - h)
        errors.append([
            abs((after.place - before.place) / (2 * h) - exact.velocity).max(),
            abs((after.velocity - before.velocity) / (2 * h) - exact.acceleration).max(),
        ])  # fmt: skip
    np.testing.assert_allclose(np.log2(np.divide(*errors)), 2, atol=0.01)
    assert errors[1][0] < 1e-3 and errors[1][1] < 0.1


def test_it_is_the_motion_of_the_general_loop_closure():
    """Two codes that share nothing, over two turns."""
    bar = FourBar(gap=0.0, start=0.5)
    times = np.linspace(0, 2 * bar.period, 145)
    exact = bar.ideal(times)
    closure, states = closed(bar.mechanism(), times)
    place, speed, change = (np.array([getattr(state, name) for state in states])[..., 2] for name in ("q", "q_t", "q_tt"))
    assert np.abs(np.exp(1j * (place - exact.place[..., 2])) - 1).max() < 1e-12
    assert np.abs(speed - exact.velocity[..., 2]).max() < 1e-11 * bar.speed
    assert np.abs(change - exact.acceleration[..., 2]).max() < 1e-10 * bar.speed**2
    assert states[-1].q[0, 2] - closure.reference[0, 2] == pytest.approx(4 * np.pi, abs=1e-12)
    for joint in closure.mechanism.joints:
        ends = [[closure.position(link, joint.point, state.q) for state in states] for link in (joint.first, joint.second)]
        assert np.abs(np.subtract(*ends)).max() < 1e-12


def test_masses_inertias_and_laws_of_the_paper():
    bar = FourBar()
    np.testing.assert_allclose(bar.masses, [0.082425, 0.21352, 0.137375], rtol=1e-12)
    np.testing.assert_allclose(bar.inertias, bar.masses * (bar.lengths**2 + 0.02**2) / 12, rtol=1e-14)
    assert bar.period == pytest.approx(0.2)
    assert bar.gaps == (2.5e-4,) * 4
    # 0.01 mm deep: 2.53e5 N/mm^1.5 * (0.01 mm)^1.5 = 253 N; and 253 N s/m or 253 N s/mm at 1 mm/s
    for law, damping in ((RATTLING, 0.253), (CLOSED, 253.0)):
        assert law.force(1e-5, 0.0, 1.0) == pytest.approx(253.0)
        assert law.force(1e-5, 1e-3, 1.0) - law.force(1e-5, 0.0, 1.0) == pytest.approx(damping)
    flexible = FourBar(modes=beam_modes(density=1000.0))
    assert flexible.masses[2] == pytest.approx(0.0175) and flexible.inertias[2] == flexible.modes.planar(0.175).inertia
