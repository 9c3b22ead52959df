"""Joints with clearance against statics, balance of energy and a law of a user's own."""

import re
import sys
from math import atan, cos, pi
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from simulations import fine

from buckler import mbs
from buckler.mbs import laws

BAR = mbs.Section(width=0.020, thickness=0.005)
MASS = BAR.mass_per_length * 0.1
K, GAP, PIN = 2.53e5 * 1e3**1.5, 1e-4, 5e-3  # K of the crank-rocker paper, N/m^1.5
SPEED = 10 * pi
RATTLING, CLOSED = laws.Impact(K, 253.0, 1e-5), laws.Impact(K, 253e3, 1e-5)  # c_max = 253 N s/m or N s/mm
FRICTION = laws.AdamsFriction(0.3, 0.1)
HOW_TO = (Path(__file__).parents[2] / "docs" / "how-to-add-a-clearance-joint.md").read_text(encoding="utf-8")


# --- one journal under its weight -------------------------------------------------------------------------------------


def resting(law, friction=None, *, gap=GAP, gravity=9.81, speed=None, pin_is="bar"):
    """A bar whose middle is a pin in the ground's bush, or the bush of the ground's pin; weight pulls it down."""
    names = ("bar", "ground") if pin_is == "bar" else ("ground", "bar")
    return mbs.Mechanism(
        points={"P": (0.0, 0.0), "Q": (-0.05, 0.0), "R": (0.05, 0.0)},
        links=[mbs.Link("bar", "Q", "R", mbs.Rigid(BAR), carries=["P"])],
        joints=[mbs.Clearance("P", *names, PIN, gap, law, friction or laws.NoFriction())],
        drives=[] if speed is None else [mbs.Drive("bar", speed)],
        gravity=(0.0, -gravity),
    )


def test_pin_in_the_very_middle_feels_nothing(plain):
    result = fine(mbs.simulate(resting(RATTLING, gravity=0.0), 1e-4, ledger=True))  # fine: every signal is finite
    assert result.signals["P.journal_x"].max() == result.signals["P.normal_force"].max() == 0


@pytest.mark.parametrize(
    "law",
    [
        laws.Impact(8e9, 1300.0, 1e-7),
        laws.Impact(8e12, 1300.0, 1e-7, exponent=2.0),
        laws.ExactRestitution(8e9, 0.3),
        laws.KelvinVoigt(4e6, 900.0),
    ],
    ids=lambda law: f"{type(law).__name__} {law.exponent:g}",
)
def test_journal_at_rest_sinks_in_as_its_weight_says(law, plain):
    result = fine(mbs.simulate(resting(law, gap=1e-5), 0.02, ledger=True))
    depth = (MASS * 9.81 / law.stiffness) ** (1 / law.exponent)
    assert result.signals["P.penetration"][-1] == pytest.approx(depth, rel=1e-9, abs=0)
    assert result.signals["P.journal_y"][-1] == pytest.approx(-1e-5 - depth, rel=1e-9)
    assert result.signals["P.bar-ground.fy"][-1] == pytest.approx(-MASS * 9.81, rel=1e-9)
    assert result.energy_balance < 1e-3


@pytest.mark.parametrize("pin_is", ["bar", "ground"])
@pytest.mark.parametrize(("dynamic", "speed"), [(0.1, 20.0), (0.3, -50.0)])
def test_turning_journal_climbs_and_loses_what_friction_says(dynamic, speed, pin_is):
    """At rest on the slope of angle phi = atan(mu): N = m g cos(phi), torque mu N times the bar's own radius at P."""
    gravity, friction = 1e4, laws.Coulomb(dynamic, 1e-3, viscous=0.5)  # viscous friction ends the rocking on the slope
    law = laws.Impact(8e9, 3000.0, 1e-7)
    mechanism = resting(law, friction, gravity=gravity, speed=speed, pin_is=pin_is)
    result = fine(mbs.simulate(mechanism, 0.04, ledger=True, solver=mbs.Exudyn(mbs.Controlled(tolerance=1e-5))))
    s, energy = result.signals, result.energy
    arm = PIN if pin_is == "bar" else PIN + GAP + s["P.penetration"][-1]
    mu = abs(friction.coefficient(speed * arm))
    normal = MASS * gravity * cos(atan(mu))
    assert s["P.normal_force"][-1] == pytest.approx(normal, rel=1e-3)
    assert s["P.penetration"][-1] == pytest.approx((normal / 8e9) ** (2 / 3), rel=1e-3)
    assert abs(s["P.sliding_speed"][-1]) == pytest.approx(abs(speed) * arm, rel=1e-3)
    assert s["drive.torque"][-1] == pytest.approx(np.sign(speed) * mu * normal * arm, rel=1e-3)
    slope = np.arctan2(abs(s["P.journal_x"][-1]), abs(s["P.journal_y"][-1]))
    assert slope == pytest.approx(atan(mu), rel=1e-3)
    late = result.time > 0.03
    lost, span = np.ptp(energy["taken_friction"][late]), np.ptp(result.time[late])
    assert lost == pytest.approx(mu * normal * arm * abs(speed) * span, rel=1e-3)
    assert result.energy_balance < 1e-3


# --- the crank-rocker -------------------------------------------------------------------------------------------------


def rattling(with_play="OABC", rocker=None, law=RATTLING, friction=FRICTION, gap=GAP, speed=SPEED):
    def play(point, first, second):
        return mbs.Clearance(point, first, second, PIN, gap, law, friction)

    return mbs.crank_rocker(rocker or mbs.Rigid(BAR), speed=speed, play=play, with_play=with_play)


ROCKERS = {"rigid": mbs.Rigid(BAR), "beam": mbs.Beam(BAR.damped(0.01, 0.175), elements=4)}


@pytest.mark.parametrize("with_play", ["B", "OABC"])
@pytest.mark.parametrize("law", [RATTLING, CLOSED], ids=["N s per m", "N s per mm"])
@pytest.mark.parametrize("rocker", ROCKERS)
def test_energy_balances(rocker, law, with_play):
    result = fine(mbs.simulate(rattling(with_play, ROCKERS[rocker], law), 0.05, solver=mbs.Exudyn(), ledger=True))
    assert result.signals["B.contacts"][-1] > 0 and result.energy["taken_contact"][-1] > 0
    assert result.energy_balance < 1e-3
    assert mbs.build(rattling(with_play)).summary().get("Clearance", 0) == len(with_play)


# --- a user's own law -------------------------------------------------------------------------------------------------


def test_a_law_of_ones_own_runs_in_a_joint_with_play():
    """The rubber stop of docs/how-to-add-a-clearance-joint.md, as it stands there."""
    module = ModuleType("how_to")
    sys.modules[module.__name__] = module  # where dataclasses look for it
    exec(re.search(r"```python\n(from functools.*?)```", HOW_TO, re.DOTALL)[1], module.__dict__)
    law = module.HardeningStop(2e7, 1e-4, 0.6)
    result = fine(mbs.simulate(rattling(law=law), 0.01, ledger=True))
    s = result.signals
    touching = s["B.penetration"] > 0
    assert touching.any() and result.energy_balance < 1e-3
    most = law.elastic(s["B.penetration"]) * (1 + law.chi * 1e3)  # the rate stays below 1000 times the onset speed
    assert (s["B.normal_force"] <= most + 1e-9).all() and (s["B.normal_force"][~touching] == 0).all()


# --- refused ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("change", "message"), [
    ({"gap": 0.0}, r"clearance at 'B': gap = 0.0 m: must lie in \(0, inf\) m; a joint without clearance is a Revolute"),
    ({"gap": -1e-4}, r"gap = -0.0001 m: must lie in \(0, inf\) m"),
    ({"pin": 0.0}, r"pin = 0.0 m: must lie in \(0, inf\) m"),
    ({"law": 8e9}, r"clearance at 'B': law = .* must be Impact"),
    ({"friction": 0.3}, r"clearance at 'B': friction = 0.3: must be Coulomb"),
], ids=["no gap", "negative gap", "no pin", "no law", "no friction law"])  # fmt: skip
def test_what_is_no_joint_with_play_is_refused(change, message):
    given = {"pin": PIN, "gap": GAP, "law": RATTLING, "friction": FRICTION} | change
    with pytest.raises(ValueError, match=message):
        mbs.Clearance("B", "coupler", "rocker", **given)
