"""The study of wear: Archard's volume from signals it does not read, and refusals."""

import numpy as np
import pytest

from buckler import mbs
from buckler.studies.rattling.turns import STEPS_A_TURN
from buckler.studies.rattling.wear import Parameters, run, worn_mechanism


def small(**changes):
    """One joint, two turns measured."""
    return Parameters(**({"rocker": "rigid", "clearance_joints": 1, "measured_turns": 2} | changes))


@pytest.mark.slow
def test_little_wear_is_the_work_of_the_signals_times_the_coefficient():
    """As long as nothing changes: volume = k turns x mean of F |v| a turn; pins of a tenth of the coefficient, a tenth of it."""
    p = small(turns=100.0, pin_wear=0.1)
    found = run(p)
    assert found.status == "OK", found.message
    steps = mbs.Controlled(tolerance=p.tolerance, max_step=p.turn / STEPS_A_TURN)
    result = mbs.simulate(p.mechanism("rigid"), 3 * p.turn, solver=mbs.Exudyn(steps))
    kept = result.time >= p.turn
    power = (result.signals["B.normal_force"] * np.abs(result.signals["B.sliding_speed"]))[kept]
    expected = p.wear_coefficient * p.turns * np.trapezoid(power, result.time[kept]) / 2
    assert found.metrics["rigid.B.bush.volume"].value == pytest.approx(expected, rel=2e-3)
    assert found.metrics["rigid.B.pin.volume"].value == pytest.approx(expected / 10, rel=2e-3)


@pytest.mark.slow
def test_worn_surfaces_change_what_a_turn_takes():
    """A million turns: the clearance has grown and the rate is another one; the error of the jumps is told, and small."""
    found = run(small(turns=1e6, jump_error=2e-3))
    assert found.status == "OK", found.message
    assert found.metrics["rigid.jumps"].value >= 3
    assert 1e-6 < found.metrics["rigid.B.bush.depth"].value < 2e-4
    assert found.metrics["rigid.error"].value < 0.1
    assert abs(found.metrics["rigid.rate_ratio"].value - 1) > 1e-3


def test_worn_surfaces_stand_in_the_joints():
    p = small()
    worn = np.stack([np.full(180, 1e-5), 2e-6 * (1 + np.cos(np.radians(np.arange(0, 360, 2))))])
    joint = next(joint for joint in worn_mechanism(p.mechanism("rigid"), {"B": worn}, p.clearance).joints if not joint.ideal)
    assert joint.gap == pytest.approx(p.clearance + 1e-5 + 2e-6, rel=1e-3)
    assert joint.pin_profile[0] == pytest.approx(2e-6, rel=0.02)
    assert max(map(abs, joint.bush_profile)) < 1e-15
