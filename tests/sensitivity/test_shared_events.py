"""Runs that share their steps: events that all of them must see, each at its own time."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from buckler.mbs import Controlled, Force, Guide, Link, Mechanism, Motor, Revolute, Rigid, Spectral, Stop, sensitivities
from buckler.mbs.laws import Flores
from buckler.mbs.sensitivity.frozen import FINE, Steps

GIVEN = Spectral(Controlled(tolerance=FINE, max_steps=3000))
CONSTANT, RESISTANCE, INERTIA, PEAK, OMEGA = 0.12, 1.6, 6e-3, 7.0, 7.5


def rotor(dead):
    """At rest until the voltage leaves its dead band."""
    return Mechanism(
        points={"A": (0.0, 0.0), "B": (0.2, 0.0)},
        links=[Link("arm", "A", "B", Rigid.of(mass=1.0, inertia=INERTIA, centre=(0.0, 0.0)))],
        joints=[Revolute("A", "ground", "arm")],
        loads=[Motor("arm", lambda t: PEAK * np.sin(OMEGA * t), RESISTANCE, CONSTANT, dead_band=dead)],
    )


def leaves(dead):
    """When the voltage does."""
    return float(np.arcsin(dead / PEAK) / OMEGA)


def test_a_force_whose_kink_is_in_time():
    """Angle of the rotor by its dead band, against SciPy from when it starts."""

    def angle(dead):
        def rates(t, y):
            return y[1], CONSTANT * (PEAK * np.sin(OMEGA * t) - dead - CONSTANT * y[1]) / RESISTANCE / INERTIA

        return solve_ivp(rates, (leaves(dead), 0.3), [0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-15).y[0, -1]

    row = sensitivities(rotor, 0.3, by=["dead"], at={"dead": 0.8}, of="end(arm.angle)").rows[0]
    assert row.derivative == pytest.approx((angle(0.8001) - angle(0.7999)) / 2e-4, rel=1e-6)


@pytest.mark.parametrize("beside", [-4e-5, -1e-5, 1e-5, 4e-5])
@pytest.mark.parametrize("half", [1 / 8, 3 / 16, 1 / 32])
def test_a_kink_beside_where_its_step_is_halved(half, beside):
    """It is in the tangent of one half and in the other half: it was in neither."""
    kink, step = leaves(0.8), 0.004
    begins = kink - (1e-3 + half * (1 - 1e-3) + beside) * step
    steps = Steps(0.04, np.array([begins, begins + step, 0.04]), GIVEN)
    steps.run(rotor(0.8))
    assert np.abs(steps.tapes[0].onset - kink).min() < 1e-5 * step


def shaken(push=9.9, stiffness=5e5):
    """A block between two stops, pushed to and fro from rest."""
    laws = Flores(1e5, 0.7), Flores(stiffness, 0.7)
    return Mechanism(
        points={"O": (0.0, 0.0), "A": (0.2, 0.0)},
        links=[Link("bar", "O", "A", Rigid.of(mass=1e-9, inertia=1e-12))],
        guides=[Guide("O", "bar", mass=0.56), Guide("A", "bar")],
        stops=[Stop("O", at=at, law=law) for at, law in zip((0.014, -0.02), laws, strict=True)],
        loads=[Force("O", lambda t: (push * np.cos(20 * t), 0.0))],
    )


def touches(push):
    """When x = F/(m w^2) (1 - cos(w t)) first is at the stop."""
    return float(np.arccos(1 - 0.014 * 0.56 * 20**2 / push) / 20)


@pytest.mark.parametrize("count", [64, 74, 84])
def test_a_contact_begins_at_its_own_time(count):
    """In all neighbours it is as near to the face: they were up to 3e-12 of the time apart, 1e-5 of a derivative."""
    steps, off = Steps(0.2, np.linspace(0.0, 0.2, count + 1)[1:], GIVEN), []
    for push in 9.9 * (1 + np.array([0.0, -3e-7, 0.0, 3e-7, 1.2e-6])):
        time = steps.run(shaken(push)).record.time
        off.append(time[np.flatnonzero(np.diff(time) < 1e-12)[0]] / touches(push))
    assert np.ptp(off[1:]) < 3e-14


def test_what_does_not_depend_on_a_number():
    """Nothing of the other stop is in the first contact: only rounding is told as error, not that of the value."""
    begins, ends = "begins(O.contact_force, 1)", "ends(O.contact_force, 1)"
    found = sensitivities(
        shaken, 0.15, by=["push", "stiffness"], at={"push": 9.9, "stiffness": 5e5}, of=[begins, ends]
    )  # fmt: skip
    sooner, none = found[begins, "push"], found[ends, "stiffness"]
    assert sooner.derivative == pytest.approx((touches(9.901) - touches(9.899)) / 2e-3, rel=5e-7)
    assert none.derivative == 0.0 and none.error * 5e5 == pytest.approx(1e-15 / 3e-7 * none.value, rel=1e-6)


def test_no_guess_is_made_from_a_tiny_step():
    """One is to end 2.5e-10 s after the second blow began: the next one's guess was rounding, grown by the cube of 5e6."""
    steps = Steps(0.2, np.linspace(0.0, 0.2, 150)[1:], GIVEN)
    steps.run(shaken())
    blow = steps.tapes[0].onset[steps.tapes[0].onset > 0][2]
    steps = Steps(0.2, np.sort(np.append(steps.ends, blow + 2.5e-10)), GIVEN)
    first, by_tape = (steps.run(shaken()).values["O.x"][-1] for _ in range(2))
    assert by_tape == pytest.approx(first, rel=1e-7)
