"""Pendulums and blocks, each with its signals in closed form or by another integrator."""

from math import pi

import numpy as np
import simulations
from moved import solved
from simulations import BAR, FEATHER, MASS, SPAN, exact_swing, pendulum_frequency

from buckler.mbs import Force, Guide, GuideFriction, Link, Mechanism, States


def pendulum():
    """A bar let go level: elliptic functions; place, rate and reaction."""
    mass = BAR.mass_properties(SPAN)[0]

    def swing(t):
        return exact_swing(pi / 2, np.asarray(t))

    def reaction(t):
        angle, rate = swing(t)
        turning = -(pendulum_frequency() ** 2) * np.sin(angle)
        return mass * SPAN / 2 * (-np.sin(angle) * rate**2 + np.cos(angle) * turning)

    return simulations.pendulum(pi / 2), 1.5, {
        "A.x": lambda t: SPAN * np.sin(swing(t)[0]), "A.vx": lambda t: SPAN * np.cos(swing(t)[0]) * swing(t)[1],
        "O.ground-bar.fx": reaction,
    }  # fmt: skip


def block(**more):
    return Mechanism(
        points={"A": (0, 0), "B": (0.1, 0)} | more.pop("points", {}), links=[Link("bar", "A", "B", FEATHER)],
        guides=[Guide("A", "bar", (1, 0), 0.5, more.pop("friction", None)), Guide("B", "bar", (1, 0))], **more,
    )  # fmt: skip


def braked():
    """A block pushed against smoothed friction."""
    law = GuideFriction(1.0, 1.5)
    y = solved(lambda _t, y: [y[1], -float(law.force(np.array([y[1]]))[0]) / MASS], 0.25, [0, 0.6], 1e-4)
    return block(friction=law, velocities={"A": (0.6, 0.0)}), 0.25, {
        "A.x": lambda t: y(t)[0], "A.vx": lambda t: y(t)[1], "A.friction_force": lambda t: law.force(y(t)[1]),
    }  # fmt: skip


def piped():
    """A block that a pressure pushes, which its speed lets down: a state of a law, place, rate, internal force."""
    push, fill = "0.02*state1 - 80*x, 0".split(","), "(400*(1 - exp(-t/0.05)) - state1)/0.03 - 2000*vx"
    mechanism = block(loads=[Force("A", push, states=States(fill))])

    def rates(t, y):
        return [y[1], (0.02 * y[2] - 80 * y[0]) / MASS, (400 * (1 - np.exp(-t / 0.05)) - y[2]) / 0.03 - 2000 * y[1]]

    y = solved(rates, 0.6, [0, 0, 0], 1e-3)
    return mechanism, 0.6, {
        "A.x": lambda t: y(t)[0], "A.vx": lambda t: y(t)[1], "force.A.state1": lambda t: y(t)[2],
        "force.A.fx": lambda t: 0.02 * y(t)[2] - 80 * y(t)[0],
    }  # fmt: skip
