"""Friction that follows the reaction of a guide, in runs of the compiled solver, which is the default."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from simulations import fine

pytest.importorskip("numba")

from buckler import mbs
from buckler.mbs.laws import Coulomb, Stribeck

G = 9.81


@pytest.mark.parametrize("mu", [0.6, 1.5, 2.5])
def test_reactions_have_the_signs_of_those_without_friction(mu):
    """The foot of a rod on a rough floor and a rough wall is drawn out: wall H (b + mu a) = W a/2, floor N = W - mu H.

    Beyond mu = b/a the guides, which hold to both sides, have a second solution: both reactions pull.
    """
    mechanism = mbs.Mechanism(
        points={"A": (0.3, 0), "E": (0, 0.4)},
        links=[mbs.Link("rod", "A", "E", mbs.Rigid.of(mass=2.0, inertia=0.02))],
        guides=[mbs.Guide("A", "rod", friction=Coulomb(mu)), mbs.Guide("E", "rod", along=(0, 1), friction=Coulomb(mu))],
        drives=[mbs.Drive("A", 2e-3)],
        gravity=(0, -G),
    )
    run = fine(mbs.simulate(mechanism, 10.0)).signals
    wall = 2 * G * run["A.x"] / (2 * (run["E.y"] + mu * run["A.x"]))
    assert -run["E.guide_force"] == pytest.approx(wall, rel=1e-5)
    assert run["A.guide_force"] == pytest.approx(2 * G - mu * wall, rel=1e-5)


def test_block_that_a_spring_drags_sticks_and_slips_as_its_equation_of_motion():
    """The default run has the places of m x'' = k (v t - x) - mu(x') m g; SciPy's Radau solves that to 1e-10."""
    law, mass, stiffness, speed = Stribeck(0.4, 0.25, 0.05), 1.0, 50.0, 0.1
    body = mbs.Rigid.of(mass=mass, inertia=1e-3, centre=(0, 0))
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": (0, -0.1), "C": (0.5, 0), "D": (0.5, 0.1)},
        links=[mbs.Link("block", "A", "B", body), mbs.Link("puller", "C", "D", body)],
        guides=[mbs.Guide("A", "block", friction=law), mbs.Guide("C", "puller"), mbs.Guide("D", "puller")],
        loads=[mbs.Spring("A", "C", stiffness, free_length=0.5)],
        drives=[mbs.Drive("C", speed)],
        gravity=(0, -G),
    )
    result = fine(mbs.simulate(mechanism, 3.0))
    rate = lambda t, y: [y[1], (stiffness * (speed * t - y[0]) - law.coefficient(y[1]) * mass * G) / mass]  # noqa: E731
    exact = solve_ivp(rate, (0, 3), [0, 0], "Radau", rtol=1e-10, atol=1e-12, max_step=0.01, dense_output=True).sol
    error = np.abs(result.signals["A.x"] - exact(result.time)[0]).max()
    assert error < 2 * result.error.absolute("A.x", "peak") < 1e-2
