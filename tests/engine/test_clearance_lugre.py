"""LuGre friction in a joint with clearance against its closed forms: sliding, presliding, what a rejected step leaves."""

from math import exp, pi

import numpy as np
import pytest
from fourbar import FourBar
from simulations import fine

from buckler import mbs
from buckler.mbs.laws import Impact, LuGre
from buckler.mbs.library import CLOSED, RATTLING

BAR = mbs.Section(width=0.020, thickness=0.005)
PIN, GAP = 5e-3, 1e-4
STATIC, DYNAMIC, STRIBECK, BRISTLES = 0.3, 0.1, 0.05, 1e5
WEIGHT, LANDED = 1e3, 4e-3
"""m/s^2, which press the block on the pin; s, when it lies still there."""
NORMAL = BAR.mass_per_length * 0.05 * WEIGHT


def pressed(friction, turn):
    """A pin that turns in place, under a block that can only move up and down: normal force and sliding speed are given."""
    return mbs.Mechanism(
        points={"O": (0.0, 0.0), "D": (0.05, 0.0), "E": (-0.05, 0.0), "P": (0.0, 0.0), "S": (0.0, 0.05)},
        links=[mbs.Link("shaft", "D", "E", mbs.Rigid(BAR), carries=["O", "P"]), mbs.Link("block", "P", "S", mbs.Rigid(BAR))],
        joints=[
            mbs.Revolute("O", "ground", "shaft"),
            mbs.Clearance("P", "shaft", "block", PIN, GAP, Impact(8e9, 500.0, 1e-6), friction),
        ],
        guides=[mbs.Guide("P", "block", along=(0, 1)), mbs.Guide("S", "block", along=(0, 1))],
        drives=[mbs.Drive("shaft", turn)],
        gravity=(0.0, -WEIGHT),
    )


def rubbed(friction, turn, duration, max_step):
    """Signals after the landing, with `time` and the coefficient of friction, `mu`."""
    result = fine(
        mbs.simulate(
            pressed(friction, turn),
            duration,
            solver=mbs.Exudyn(mbs.Controlled(tolerance=1e-5, max_step=max_step)),
            ledger=True,
        )
    )
    assert result.energy_balance < 1e-3
    every = {**result.signals, **result.energy}
    found = {name: values[result.time > LANDED] for name, values in every.items()}
    np.testing.assert_allclose(found["P.normal_force"], NORMAL, rtol=1e-4)
    return found | {"time": result.time[result.time > LANDED], "mu": found["P.friction_force"] / found["P.normal_force"]}


@pytest.mark.parametrize("side", [1, -1])
def test_steady_sliding_is_the_stribeck_curve(side):
    """The shaft is sped up so slowly that the bristles have always settled; it feels the friction at the pin's radius."""
    viscous, alpha = 0.2, side * 0.4 / PIN / 0.2
    found = rubbed(LuGre(STATIC, DYNAMIC, STRIBECK, 10 * BRISTLES, viscous=viscous), mbs.Ramp(0.0, 0.2 * alpha, 0.2), 0.2, 4e-5)
    time, speed = found["time"], found["P.sliding_speed"]
    late = time > 0.01
    np.testing.assert_allclose(speed, PIN * alpha * time, rtol=1e-4)
    expected = side * (DYNAMIC + (STATIC - DYNAMIC) * np.exp(-((speed / STRIBECK) ** 2))) + viscous * speed
    assert np.ptp(np.abs(expected)) > 0.15
    np.testing.assert_allclose(found["mu"][late], expected[late], rtol=1e-3)
    mass = BAR.mass_per_length * 0.1
    torque = mass * (0.1**2 + BAR.thickness**2) / 12 * alpha + expected * NORMAL * PIN
    np.testing.assert_allclose(found["drive.torque"][late], torque[late], rtol=1e-3)


def test_presliding_is_a_spring_that_yields_and_is_left_bent():
    """There mu = mu_s (1 - exp(-s0 x/mu_s)), of stiffness s0 at first; back along the same curve about where it turned."""
    period, there = 0.02, 2 * STATIC / BRISTLES

    def moved(t):
        return there * np.sin(pi * np.maximum(t - LANDED, 0.0) / period) ** 2

    def speed(t):
        return there * pi / period * float(np.sin(2 * pi * max(t - LANDED, 0.0) / period))

    turn = mbs.Motion(lambda t: float(moved(t)) / PIN, lambda t: speed(t) / PIN)
    found = rubbed(LuGre(STATIC, DYNAMIC, STRIBECK, BRISTLES), turn, LANDED + period, 2e-5)
    time, mu = found["time"], found["mu"]
    x, forth = moved(time), time <= LANDED + period / 2
    bent = STATIC * (1 - exp(-BRISTLES * there / STATIC))
    back = -STATIC + (bent + STATIC) * np.exp(-BRISTLES * (there - x) / STATIC)
    np.testing.assert_allclose(mu, np.where(forth, -STATIC * np.expm1(-BRISTLES * x / STATIC), back), atol=1e-3 * STATIC)
    relaxed = -np.expm1(-BRISTLES * x / STATIC)
    lost = NORMAL * STATIC * (x - STATIC / BRISTLES * (relaxed + relaxed**2 / 2))  # work done, less what the bristle holds
    taken = found["taken_friction"] - found["taken_friction"][0]
    np.testing.assert_allclose(taken[forth], lost[forth], atol=2e-3 * lost[forth].max())
    begun = forth & (x > 0) & (x < 0.01 * there)
    assert begun.sum() > 10 and np.polyfit(x[begun], mu[begun], 1)[0] == pytest.approx(BRISTLES, rel=0.03)
    assert mu[-1] < -0.2 * STATIC  # where it began it is bent the other way


@pytest.mark.parametrize(("law", "damped"), [(RATTLING, 0.0), (CLOSED, 10.0)], ids=["explicit", "implicit"])
def test_bristles_bend_over_accepted_steps_only(law, damped):
    """Marched here, from one recorded step to the next; a rejected one that had bent them would show from there on."""
    friction = LuGre(STATIC, DYNAMIC, 0.1, BRISTLES, damped)
    result = fine(
        mbs.simulate(
            FourBar(law=law, friction=friction).mechanism(), 0.01, solver=mbs.Exudyn(mbs.Controlled(tolerance=1e-5)), ledger=True
        )
    )
    assert result.energy_balance < 1e-3 and (law is RATTLING or result.work["rejected"] > 10)
    for point in "OABC":
        normal, drag, speed, depth = (
            result.signals[f"{point}.{name}"] for name in ("normal_force", "friction_force", "sliding_speed", "penetration")
        )
        z = 0.0
        for k in range(1, len(speed)):
            level = (DYNAMIC + (STATIC - DYNAMIC) * exp(-((speed[k - 1] + speed[k]) ** 2) / 0.04)) / BRISTLES
            mean = (speed[k - 1] + speed[k]) / 2
            settled = np.sign(mean) * level
            z = settled + (z - settled) * exp(-abs(mean) * (result.time[k] - result.time[k - 1]) / level)
            z = z if depth[k] > 0 else 0.0
            g = DYNAMIC + (STATIC - DYNAMIC) * exp(-((speed[k] / 0.1) ** 2))
            mu = BRISTLES * z + damped * (speed[k] - BRISTLES * abs(speed[k]) * z / g)
            assert drag[k] == pytest.approx(mu * normal[k], rel=1e-9, abs=1e-9 * normal.max())
        assert (np.abs(drag) > 0).sum() > 20
