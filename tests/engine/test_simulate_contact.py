"""A block on its guide against integrations of its own: stops and friction."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from simulations import MASS, block, fine

from buckler.mbs import GuideFriction, simulate
from buckler.mbs.laws import CarvalhoMartins, ExactRestitution, Hertz, KelvinVoigt, delivered


def impact(law, speed, pull):
    """Speed ratio and largest force of one impact, integrated on its own."""

    def motion(_, s):
        return s[1], pull - float(law.force(s[0], s[1], speed)) / MASS

    def out(_, s):
        return s[0]

    out.terminal, out.direction = True, -1
    run = solve_ivp(motion, (0, 10), (1e-12, speed), events=out, method="DOP853", rtol=1e-10, atol=1e-14)
    return -run.y_events[0][0][1] / speed, float(law.force(*run.y, speed).max())


def rebound(law, solver=None):
    """Speed ratio over the face, largest force, and the run of one impact after a fall through 0.5 m at 0.1 m/s^2."""
    pull, way = 0.1, 0.5
    speed = math.sqrt(2 * pull * way)
    result = fine(simulate(block(pull, law, way), 1.5 * speed / pull, solver=solver, ledger=True))
    x, v = result.signals["A.x"], result.signals["A.vx"]
    out = int(np.flatnonzero(x > way)[-1]) + 1
    at_face = math.sqrt(v[out] ** 2 + 2 * pull * (way - x[out]))
    assert v[out] < 0
    return at_face / speed, result.signals["A.contact_force"].max(), result


LAWS = {
    "Hertzian": (CarvalhoMartins(1e8, 0.8), 1e-3, 5e-3),
    "more damped": (CarvalhoMartins(1e8, 0.5), 0.02, 5e-3),
    "heavily damped": (CarvalhoMartins(1e8, 0.3), 0.02, 5e-3),
    "linear": (CarvalhoMartins(1e6, 0.8, 1.0), 1e-3, 1e-2),
    "exact": (ExactRestitution(1e8, 0.9), 1e-3, 1e-2),
    "elastic": (Hertz(1e8), 1e-3, 1e-2),
    "dashpot": (KelvinVoigt.from_restitution(1e6, 0.8, MASS), 6e-3, 1e-2),  # its force begins with a jump
}
"""Laws, error of the restitution, balance of the energy."""


@pytest.mark.parametrize(("law", "tolerance", "balance"), LAWS.values(), ids=LAWS)
def test_stop_gives_back_what_its_law_delivers(law, tolerance, balance):
    ratio, force, result = rebound(law)
    expected, peak = impact(law, math.sqrt(0.1), 0.1)
    assert expected == pytest.approx(delivered(law, MASS, math.sqrt(0.1)), abs=1e-3)
    assert ratio == pytest.approx(expected, abs=tolerance)
    assert force == pytest.approx(peak, rel=0.02)
    assert result.energy["taken_contact"][-1] == pytest.approx(0.5 * MASS * 0.1 * (1 - ratio**2), rel=0.02, abs=1e-4)
    assert result.energy_balance < balance


def test_resting_block_presses_with_what_pulls_it():
    """After many bounces: K d^n = m a."""
    law = ExactRestitution(1e7, 0.3)
    result = fine(simulate(block(5.0, law, 0.01), 1.0))
    assert result.signals["A.contact_force"][-1] == pytest.approx(MASS * 5, rel=1e-3)
    assert result.signals["A.penetration"][-1] == pytest.approx((MASS * 5 / 1e7) ** (2 / 3), rel=1e-3)


FRICTION = GuideFriction(0.7, static=1.1, viscous=3.0, regularisation=2e-3, stribeck=2e-2)


@pytest.mark.parametrize("speed", [1e-3, 2e-3, 5e-3, 0.02, 0.5, -0.05])
def test_driven_block_feels_the_friction_curve(speed):
    beyond = abs(speed) - 2e-3
    expected = 0.7 + 0.4 * math.exp(-beyond / 2e-2) + 3.0 * beyond if beyond > 0 else 1.1 * abs(speed) / 2e-3
    result = fine(simulate(block(friction=FRICTION, speed=speed), 0.1, ledger=True))
    assert result.signals["drive.force"] == pytest.approx(math.copysign(expected, speed), rel=1e-6)
    assert result.energy["taken_friction"][-1] == pytest.approx(expected * abs(speed) * 0.1, rel=1e-9)


def test_dry_friction_slows_a_fall():
    pull, force = 2.0, 0.3 * MASS * 2.0
    result = fine(simulate(block(pull, friction=GuideFriction(force, regularisation=1e-5)), 0.5, ledger=True))
    assert result.signals["A.x"] == pytest.approx(0.5 * (pull - force / MASS) * result.time**2, abs=1e-5)
    assert result.energy["taken_friction"][-1] == pytest.approx(force * result.signals["A.x"][-1], rel=1e-3)
