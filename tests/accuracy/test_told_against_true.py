"""Told errors against true ones, by kind of signal, where the motion is known in closed form or by another integrator."""

from math import pi, sqrt

import numpy as np
import pytest
import simulations
from scipy.integrate import solve_ivp
from simulations import BAR, FEATHER, MASS, SPAN, G, exact_swing, pendulum_frequency

from buckler.mbs import Exudyn, Force, Guide, GuideFriction, Link, Mechanism, Spectral, Spring, States, Stop
from buckler.mbs.accuracy.compare import Functions, compare, relative
from buckler.mbs.accuracy.deliver import Climb, deliver
from buckler.mbs.accuracy.goal import Asked
from buckler.mbs.accuracy.ladder import ladder_of
from buckler.mbs.elements.signal import Kind, Signal
from buckler.mbs.geometry import onsets
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.simulation import SOLVERS

FINE = 20_001
LOW, HIGH = 0.5, 50.0
"""Told over true error."""


def pendulum():
    """A bar let go level: elliptic functions; place, rate, energy and reaction."""
    mass, inertia, _ = BAR.inertia(SPAN)
    whole, time = inertia + mass * SPAN**2 / 4, np.linspace(0, 1.5, FINE)
    angle, rate = exact_swing(pi / 2, time)
    turning = -(pendulum_frequency() ** 2) * np.sin(angle)
    x, y = SPAN * np.sin(angle), -SPAN * np.cos(angle)
    ay = SPAN / 2 * (np.cos(angle) * rate**2 + np.sin(angle) * turning)
    ax = SPAN / 2 * (-np.sin(angle) * rate**2 + np.cos(angle) * turning)
    signals = [
        ("A.x", x, "m", Kind.PLACE), ("A.y", y, "m", Kind.PLACE), ("A.vx", -y * rate, "m/s", Kind.RATE),
        ("O.ground-bar.fx", mass * ax, "N", Kind.REACTION), ("O.ground-bar.fy", mass * (ay + G), "N", Kind.REACTION),
        ("energy.kinetic", whole * rate**2 / 2, "J", Kind.ENERGY),
    ]  # fmt: skip
    return simulations.pendulum(pi / 2), 1.5, time, signals


def block(**more):
    return Mechanism(
        points={"A": (0, 0), "B": (0.1, 0)} | more.pop("points", {}), links=[Link("bar", "A", "B", FEATHER)],
        guides=[Guide("A", "bar", (1, 0), 0.5, more.pop("friction", None)), Guide("B", "bar", (1, 0))], **more,
    )  # fmt: skip


def oscillator():
    """A block on a spring, let go stretched: a cosine; place, rate, internal force, energy."""
    stiffness, stretch = 80.0, 0.05
    mechanism = block(points={"F": (-0.3, 0)}, loads=[Spring("A", "ground:F", stiffness, free_length=0.3 - stretch)])
    w = sqrt(stiffness / MASS)
    time = np.linspace(0, 1.2, FINE)
    out, rate = stretch * np.cos(w * time), -w * stretch * np.sin(w * time)
    (spring,) = (name for name in mechanism.elements() if "spring" in name)
    signals = [
        ("A.x", out - stretch, "m", Kind.PLACE), ("A.vx", rate, "m/s", Kind.RATE),
        (f"{spring}.force", stiffness * out, "N", Kind.INTERNAL), ("energy.kinetic", MASS * rate**2 / 2, "J", Kind.ENERGY),
    ]  # fmt: skip
    return mechanism, 1.2, time, signals


def bouncer():
    """A block that falls on an undamped stop: parabolas and sines; a contact's force, and places."""
    stiffness, gap, pull = 2e4, 0.02, 20.0
    mechanism = block(stops=[Stop("A", at=gap, law=KelvinVoigt(stiffness, 0.0))], gravity=(pull, 0))
    found = solve_ivp(
        lambda _t, y: [y[1], pull - stiffness / MASS * max(y[0] - gap, 0.0)], (0, 0.3), [0, 0], "DOP853",
        np.linspace(0, 0.3, FINE), rtol=1e-12, atol=1e-14, max_step=1e-4,
    )  # fmt: skip
    depth = found.y[0] - gap
    touched = onsets(found.t, depth, found.y[1])
    push = Signal("A.contact_force", stiffness * np.maximum(depth, 0.0), "N", Kind.CONTACT, onsets=touched)
    return mechanism, 0.3, found.t, [("A.x", found.y[0], "m", Kind.PLACE), push]


def braked():
    """A block pushed against smoothed friction: the same law by another integrator; friction, place."""
    law = GuideFriction(1.0, 1.5)
    mechanism = block(friction=law, velocities={"A": (0.6, 0.0)})
    found = solve_ivp(
        lambda _t, y: [y[1], -float(law.force(np.array([y[1]]))[0]) / MASS], (0, 0.25), [0, 0.6], "DOP853",
        np.linspace(0, 0.25, FINE), rtol=1e-12, atol=1e-14, max_step=1e-4,
    )  # fmt: skip
    return mechanism, 0.25, found.t, [
        ("A.x", found.y[0], "m", Kind.PLACE), ("A.vx", found.y[1], "m/s", Kind.RATE),
        ("A.friction_force", law.force(found.y[1]), "N", Kind.FRICTION),
    ]  # fmt: skip


def piped():
    """A block that a pressure pushes, which its speed lets down: a state of a law, place, rate, internal force."""
    push, fill = "0.02*state1 - 80*x, 0".split(","), "(400*(1 - exp(-t/0.05)) - state1)/0.03 - 2000*vx"
    mechanism = block(loads=[Force("A", push, states=States(fill))])
    time = np.linspace(0, 0.6, FINE)
    found = solve_ivp(
        lambda t, y: [y[1], (0.02 * y[2] - 80 * y[0]) / MASS, (400 * (1 - np.exp(-t / 0.05)) - y[2]) / 0.03 - 2000 * y[1]],
        (0, 0.6), [0, 0, 0], "DOP853", time, rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    return mechanism, 0.6, time, [
        ("A.x", found.y[0], "m", Kind.PLACE), ("A.vx", found.y[1], "m/s", Kind.RATE),
        ("force.A.state1", found.y[2], "", Kind.STATE), ("force.A.fx", 0.02 * found.y[2] - 80 * found.y[0], "N", Kind.INTERNAL),
    ]  # fmt: skip


CASES = {each.__name__: each for each in (pendulum, oscillator, bouncer, braked, piped)}


@pytest.mark.parametrize("level", [1e-3, 1e-4, 1e-5])
def test_a_first_run_of_bounces_errs_by_about_what_is_asked(level):
    """More would cost a round more, less a run that is finer than asked: what tolerances begin with is measured here."""
    mechanism, duration, time, signals = bouncer()
    first = ladder_of(mechanism, duration, level, Spectral()).made(0, 0, lambda *what: SOLVERS[Spectral](*what, None, None))
    mine = Functions.of(first)
    right = {s.name: s for s in (each if isinstance(each, Signal) else Signal(*each) for each in signals)}
    assert 0.1 * level < relative(compare(mine, Functions(time, right, mine.size)))["A.x"] < level


@pytest.mark.parametrize("level", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("solver", [Spectral(), Exudyn()], ids=["compiled", "exudyn"])
@pytest.mark.parametrize("name", CASES)
def test_told_errors_are_true(name, solver, level):
    mechanism, duration, time, signals = CASES[name]()
    ladder = ladder_of(mechanism, duration, level, solver)
    found = deliver(Climb(ladder, lambda *what: SOLVERS[type(what[2])](*what, None, None)), Asked(level))
    known = {s[0]: s if isinstance(s, Signal) else Signal(*s) for s in signals}
    mine = Functions.of(found.run)
    through = {name: mine.signals[name].scale for name in known if name.startswith("energy.")}
    known = {name: s._replace(scale=through.get(name, 0.0)) for name, s in known.items()}
    true = relative(compare(mine, Functions(time, known, mine.size)))
    assert found.missed(Asked(level)) == ""
    for signal in known:
        if true[signal] > 3e-7:
            assert LOW <= found.errors[signal] / true[signal] <= HIGH, signal
    assert true["A.x"] <= level
