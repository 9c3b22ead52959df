"""Derivatives where events move with the numbers: kinks in time, contacts that begin."""

import numpy as np
from scipy.integrate import solve_ivp
from simulations import guided

from buckler.mbs import Force, Link, Mechanism, Motor, Revolute, Rigid, Stop, sensitivities
from buckler.mbs.laws import Flores

CONSTANT, RESISTANCE, INERTIA, PEAK, OMEGA = 0.12, 1.6, 6e-3, 7.0, 7.5


def rotor(dead):
    """At rest until the voltage leaves its dead band."""
    arm = Link("arm", "A", "B", Rigid.of(mass=1.0, inertia=INERTIA, centre=(0.0, 0.0)))
    motor = Motor("arm", lambda t: PEAK * np.sin(OMEGA * t), RESISTANCE, CONSTANT, dead_band=dead)
    return Mechanism({"A": (0.0, 0.0), "B": (0.2, 0.0)}, [arm], [Revolute("A", "ground", "arm")], loads=[motor])


def leaves(dead):
    return float(np.arcsin(dead / PEAK) / OMEGA)


def test_a_force_whose_kink_is_in_time():
    """Angle of the rotor by its dead band, against SciPy from when it starts."""

    def angle(dead):
        def rates(t, y):
            return y[1], CONSTANT * (PEAK * np.sin(OMEGA * t) - dead - CONSTANT * y[1]) / RESISTANCE / INERTIA

        return solve_ivp(rates, (leaves(dead), 0.3), [0.0, 0.0], method="DOP853", rtol=1e-13, atol=1e-15).y[0, -1]

    row = sensitivities(rotor, 0.3, by=["dead"], at={"dead": 0.8}, of="end(arm.angle)").rows[0]
    true = (angle(0.8001) - angle(0.7999)) / 2e-4
    assert abs(row.derivative - true) <= min(3 * row.error, 1e-3 * abs(true))


def shaken(push=9.9, stiffness=5e5):
    """A block between two stops, pushed to and fro from rest."""
    stops = [Stop("O", at=0.014, law=Flores(1e5, 0.7)), Stop("O", at=-0.02, law=Flores(stiffness, 0.7))]
    return guided(0.56, stops=stops, loads=[Force("O", lambda t: (push * np.cos(20 * t), 0.0))])


def touches(push):
    """When x = F/(m w^2) (1 - cos(w t)) first is at the stop."""
    return float(np.arccos(1 - 0.014 * 0.56 * 20**2 / push) / 20)


def test_what_does_not_depend_on_a_number():
    """Nothing of the other stop is in the first contact: only rounding is told as error, not that of the value."""
    begins, ends = "begins(O.contact_force, 1)", "ends(O.contact_force, 1)"
    at = {"push": 9.9, "stiffness": 5e5}
    found = sensitivities(shaken, 0.15, by=list(at), at=at, of=[begins, ends])
    sooner, none = found[begins, "push"], found[ends, "stiffness"]
    true = (touches(9.901) - touches(9.899)) / 2e-3
    assert abs(sooner.derivative - true) <= min(3 * sooner.error, 2e-6 * abs(true))
    assert none.derivative == 0.0 and 0.0 < none.error * 5e5 < 1e-11 * none.value
