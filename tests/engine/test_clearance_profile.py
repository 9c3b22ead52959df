"""Pins and bushes that are not round: against a shifted round one, statics, energy and moments that balance."""

from dataclasses import replace
from math import atan2, hypot, pi

import numpy as np
import pytest

from buckler.mbs import Clearance, Controlled, Exudyn, Link, Mechanism, Rigid, Section, Status, simulate
from buckler.mbs.elements.clearance import Side, contact
from buckler.mbs.laws import Coulomb, Hertz, KelvinVoigt, NoFriction

BAR = Section(width=0.020, thickness=0.005)
WEIGHT = BAR.mass_per_length * 0.1 * 9.81
GAP, PIN, K = 1e-4, 5e-3, 1e7
OVAL = (0.0, 0.0, 1.5e-5, 0.5e-5, 0.0, 0.5e-5)


def hung(law, *, bush=(), pin=(), friction=None, ground_has="bush", gravity=(0.0, -9.81), velocities=None):
    """A bar with a pin in the middle in the ground's bush, or its bush on the ground's pin."""
    bodies = ("bar", "ground") if ground_has == "bush" else ("ground", "bar")
    joint = Clearance("P", *bodies, PIN, GAP, law, friction or NoFriction(), bush_profile=bush, pin_profile=pin)
    return Mechanism(
        points={"P": (0.0, 0.0), "Q": (-0.05, 0.0), "R": (0.05, 0.0)},
        links=[Link("bar", "Q", "R", Rigid(BAR), carries=["P"])],
        joints=[joint],
        gravity=gravity,
        velocities=velocities or {},
    )


def run(mechanism, duration, tolerance=1e-7):
    result = simulate(mechanism, duration, solver=Exudyn(Controlled(tolerance=tolerance, max_step=duration / 2000)), ledger=True)
    assert result.status is Status.OK, result.message
    return result


def test_a_bush_of_one_harmonic_is_a_shifted_round_one():
    """The difference is the square of the amplitude: c + a cos(phi) is a circle about a shifted centre to first order."""
    settled = []
    for amplitude in (2e-6, 4e-6):
        rubbed = Coulomb(1.0, 0.1)  # below that speed it is viscous, and the swinging dies
        found = run(hung(KelvinVoigt(K, 2e3), bush=(amplitude, 0.0), friction=rubbed, gravity=(-3.0, -9.81)), 0.3)
        x, y = (found.signals[f"P.journal_{axis}"][-1] for axis in "xy")
        depth = hypot(3.0, 9.81) / 9.81 * WEIGHT / K
        reach, angle = GAP + depth, atan2(-9.81, -3.0)
        settled.append(hypot(x - amplitude - reach * np.cos(angle), y - reach * np.sin(angle)))
    assert settled[1] < 0.05 * 4e-6
    assert 3.0 < settled[1] / settled[0] < 5.0


@pytest.mark.parametrize("ground_has", ["bush", "pin"])
def test_the_normal_force_of_an_unround_pair_has_a_potential(ground_has):
    """It swings and turns in an oval bush on a three-lobed pin: kinetic, potential and contact energy keep their sum."""
    mechanism = hung(Hertz(1e9), bush=OVAL, pin=(0, 0, 0, 0, 6e-6, 2e-6), ground_has=ground_has, velocities={"bar": 3.0})
    result = run(mechanism, 0.05, 1e-8)
    exchanged = np.ptp(result.energy["kinetic"])
    assert exchanged > 1e-5  # it does bounce
    assert np.abs(result.energy["error"]).max() < 2e-4 * exchanged
    unturned = 3.0 * result.time + result.signals["bar.angle"][0]
    assert np.abs(result.signals["bar.angle"] - unturned).max() > 5e-6  # what is not round is turned by normal forces


def test_forces_of_a_profile_balance_moments_and_powers():
    """At chance states: power of the force on both bodies is -N rate - T sliding; a flipped slope shows."""
    rng, n = np.random.default_rng(3), 200
    joint = Clearance("P", "a", "b", PIN, GAP, Hertz(1e9), Coulomb(0.2, 1e-3), OVAL, (0, 0, 0, 0, 6e-6, 2e-6))
    angle, size = rng.uniform(-pi, pi, n), rng.uniform(0.9, 1.5, n) * GAP
    bush = Side(rng.normal(size=(n, 2)), rng.normal(size=(n, 2)), rng.uniform(-9, 9, n), rng.normal(size=n))
    place = bush.place + size[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    pin = Side(place, rng.normal(size=(n, 2)), rng.uniform(-9, 9, n), rng.normal(size=n))
    found = contact(joint, pin, bush, np.ones((n, 4)), np.zeros(n))
    touching = found.depth > 0
    assert 20 < touching.sum() < n
    m = np.column_stack([found.nx, found.ny])
    left = np.column_stack([-found.ny, found.nx])
    touched, force = pin.place + PIN * m - found.shift[:, None] * left, np.column_stack([found.fx, found.fy])

    def power(side, sign):
        arm = touched - side.place
        moment = arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]
        return sign * ((force * side.velocity).sum(axis=1) + moment * side.spin)

    given = power(pin, 1.0) + power(bush, -1.0)
    lost = found.normal * found.rate + found.tangential * found.sliding
    assert np.allclose(given, -lost, rtol=1e-9, atol=1e-9 * np.abs(lost).max())

    def depth(h):
        moved = [replace_side(side, h) for side in (pin, bush)]
        return contact(joint, *moved, np.ones((n, 4)), np.zeros(n)).depth

    h = 1e-8
    assert np.allclose((depth(h) - depth(-h)) / (2 * h), found.rate, atol=1e-6)


def replace_side(side, h):
    return side._replace(place=side.place + h * side.velocity, angle=side.angle + h * side.spin)


def test_compiled_and_plain_equations_agree(monkeypatch):
    import sys

    mechanism = hung(Hertz(1e9), bush=OVAL, pin=(0, 0, 3e-6, 0), friction=Coulomb(0.2, 1e-2), velocities={"bar": 3.0})
    compiled = run(mechanism, 0.01)
    monkeypatch.setitem(sys.modules, "buckler.mbs.engine.compiled", None)
    plain = run(mechanism, 0.01)
    for axis in "xy":
        assert np.allclose(plain.signals[f"P.journal_{axis}"], compiled.signals[f"P.journal_{axis}"], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("bush_profile", (1e-5,), "bush_profile"),
        ("pin_profile", tuple([1e-6] * 18), "at most 8 harmonics"),
        ("bush_profile", "x", "cosine and sine"),
        ("pin_profile", (2e-4, 0.0), "must be positive"),
        ("bush_profile", (float("nan"), 0.0), "bush_profile"),
    ],
)
def test_what_is_no_profile_is_refused(field, value, said):
    sound = Clearance("P", "a", "b", PIN, GAP, Hertz(1e9))
    with pytest.raises(ValueError, match=said):
        replace(sound, **{field: value})
