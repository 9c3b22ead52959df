"""Runs that several tests look at: six mechanisms, and the names of what they show."""

from dataclasses import replace
from functools import cache

import numpy as np

from buckler.mbs import (
    Beam,
    Clearance,
    Controlled,
    Drive,
    Exudyn,
    Guide,
    Link,
    Mechanism,
    Modal,
    Revolute,
    Rigid,
    Section,
    Stop,
    Strut,
    crank_rocker,
    simulate,
    slider_crank,
)
from buckler.mbs.laws import ExactRestitution, Impact

STRIP = Section(width=0.030, thickness=0.0003).damped(0.02, 0.31)
BAR = Rigid(Section(width=0.020, thickness=0.010))


def pendulum():
    """Plate of three points out of line; gravity."""
    points = {"O": (0.0, 0.0), "A": (0.3, -0.1), "C": (0.1, -0.3)}
    return Mechanism(
        points=points,
        links=[Link("plate", "O", "A", Rigid.of(mass=0.4, inertia=2e-3, centre=(0.15, -0.05)), carries=["C"])],
        joints=[Revolute("O", "ground", "plate")],
        gravity=(0.0, -9.81),
    )


def pushed():
    """A block that is driven along an inclined guide into a stop."""
    along = np.array([0.8, 0.6])
    return Mechanism(
        points={"A": (0, 0), "B": tuple(0.1 * along)},
        links=[Link("bar", "A", "B", BAR)],
        guides=[Guide("A", "bar", tuple(along), 0.5), Guide("B", "bar", tuple(along))],
        stops=[Stop("A", at=0.05, law=ExactRestitution(1e4, 0.5))],
        drives=[Drive("B", 0.06)],
    )


def loose():
    """Crank-rocker with play in its joints."""

    def play(point, first, second):
        return Clearance(point, first, second, pin=5e-3, gap=1e-4, law=Impact(1e8, 1e4, 1e-5))

    return replace(crank_rocker(Rigid(Section(0.02, 0.005)), speed=10.0, play=play), gravity=(0.0, -9.81))


MECHANISMS = {
    "strip": (lambda: slider_crank(Beam(STRIP, elements=8), law=ExactRestitution(1e5, 0.8), mass=0.3, speed=1.25), 5.0, {}),
    "strut": (lambda: slider_crank(Strut(STRIP), law=ExactRestitution(1e5, 0.8), mass=0.3, speed=1.25), 5.0, {}),
    "modal": (lambda: crank_rocker(Modal(Section(0.02, 0.005)), speed=10.0), 0.7, {}),
    "loose": (loose, 0.65, {"solver": Exudyn(Controlled(tolerance=1e-2))}),
    "pendulum": (pendulum, 1.5, {}),
    "failed": (pushed, 2.0, {"solver": Exudyn(Controlled(max_steps=150))}),
}


@cache
def run(name):
    """Result of one of them."""
    make, duration, options = MECHANISMS[name]
    return simulate(make(), duration, ledger=True, **options)
