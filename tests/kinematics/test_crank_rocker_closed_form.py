"""The ideal crank-rocker in closed form and its numbers."""

import numpy as np
import pytest
from clearance_pair import beam_modes
from fourbar import FourBar
from simulations import closed, position

from buckler.mbs.library import CLOSED, RATTLING


@pytest.mark.parametrize("bar", [FourBar(gap=0.0, start=0.5), FourBar(gap=0.0, crank=0.08, start=2.0, speed=-40.0)])
def test_it_is_the_motion_of_the_general_loop_closure(bar):
    """Two codes that share nothing, over two turns."""
    times = np.linspace(0, 2 * bar.period, 145)
    exact = bar.ideal(times)
    closure, states = closed(bar.mechanism(), times)
    place, speed, change = (np.array([getattr(state, name) for state in states])[..., 2] for name in ("q", "q_t", "q_tt"))
    assert np.abs(np.exp(1j * (place - exact.place[..., 2])) - 1).max() < 1e-12
    assert np.abs(speed - exact.velocity[..., 2]).max() < 1e-11 * abs(bar.speed)
    assert np.abs(change - exact.acceleration[..., 2]).max() < 1e-10 * bar.speed**2
    assert states[-1].q[0, 2] - closure.reference[0, 2] == pytest.approx(np.copysign(4 * np.pi, bar.speed), abs=1e-12)
    for joint in closure.mechanism.joints:
        ends = [[position(closure, link, joint.point, state.q) for state in states] for link in (joint.first, joint.second)]
        assert np.abs(np.subtract(*ends)).max() < 1e-12


def test_masses_and_laws_of_the_paper():
    np.testing.assert_allclose(FourBar().masses, [0.082425, 0.21352, 0.137375], rtol=1e-12)
    # 0.01 mm deep: 2.53e5 N/mm^1.5 * (0.01 mm)^1.5 = 253 N; and 253 N s/m or 253 N s/mm at 1 mm/s
    for law, damping in ((RATTLING, 0.253), (CLOSED, 253.0)):
        assert law.force(1e-5, 0.0, 1.0) == pytest.approx(253.0)
        assert law.force(1e-5, 1e-3, 1.0) - law.force(1e-5, 0.0, 1.0) == pytest.approx(damping)
    flexible = FourBar(modes=beam_modes(density=1000.0))
    assert flexible.masses[2] == pytest.approx(0.0175) and flexible.inertias[2] == flexible.modes.planar(0.175).inertia
