"""Runs that several tests look at: seven mechanisms, and the names of what they show."""

from dataclasses import replace
from functools import cache

import numpy as np

from buckler import mbs
from buckler.mbs.laws import ExactRestitution, Impact

STRIP = mbs.Section(width=0.030, thickness=0.0003).damped(0.02, 0.31)
BAR = mbs.Rigid(mbs.Section(width=0.020, thickness=0.010))


def pendulum():
    """Plate of three points out of line; gravity."""
    points = {"O": (0.0, 0.0), "A": (0.3, -0.1), "C": (0.1, -0.3)}
    plate = mbs.Link("plate", "O", "A", mbs.Rigid.of(mass=0.4, inertia=2e-3, centre=(0.15, -0.05)), carries=["C"])
    return mbs.Mechanism(points, [plate], [mbs.Revolute("O", "ground", "plate")], gravity=(0.0, -9.81))


def pushed():
    """A block that is driven along an inclined guide into a stop."""
    along = np.array([0.8, 0.6])
    return mbs.Mechanism(
        points={"A": (0, 0), "B": tuple(0.1 * along)},
        links=[mbs.Link("bar", "A", "B", BAR)],
        guides=[mbs.Guide("A", "bar", tuple(along), 0.5), mbs.Guide("B", "bar", tuple(along))],
        stops=[mbs.Stop("A", at=0.05, law=ExactRestitution(1e4, 0.5))],
        drives=[mbs.Drive("B", 0.06)],
    )


def loose():
    """Crank-rocker with clearance in its joints."""

    def play(point, first, second):
        return mbs.Clearance(point, first, second, pin=5e-3, gap=1e-4, law=Impact(1e8, 1e4, 1e-5))

    return replace(mbs.crank_rocker(mbs.Rigid(mbs.Section(0.02, 0.005)), speed=10.0, play=play), gravity=(0.0, -9.81))


def loaded():
    """A four-bar linkage with one of each load, a mass, and a weight that slides on its coupler."""
    points = {"O": (0, 0), "A": (0.1, 0.1), "B": (0.4, 0.15), "C": (0.35, 0), "P": (0.1, 0.3), "Q": (0.5, 0.25)}
    pairs = {"O": ("ground", "crank"), "A": ("crank", "coupler"), "B": ("coupler", "rocker"), "C": ("ground", "rocker")}
    crank, coupler = mbs.Link("crank", "O", "A", BAR), mbs.Link("coupler", "A", "B", BAR, carries=["Q"])
    return mbs.Mechanism(
        points, [crank, coupler, mbs.Link("rocker", "C", "B", BAR)], [mbs.Revolute(at, *pair) for at, pair in pairs.items()],
        loads=[
            mbs.Spring("A", "ground:P", 50.0, damping=0.1), mbs.TorsionSpring("ground", "rocker", 0.1),
            mbs.Force("Q", (0.0, -2.0)), mbs.Force("A", (1.0, 1.0), follows="crank"), mbs.Torque("rocker", 0.01),
            mbs.Motor("crank", voltage=2.0, resistance=1.0, constant=0.1),
        ],
        masses=[mbs.Mass("Q", 0.2)], gravity=(0.0, -9.81),
    )  # fmt: skip


def pressed(coupler):
    return mbs.slider_crank(coupler, law=ExactRestitution(1e5, 0.8), mass=0.3, speed=1.25)


MECHANISMS = {
    "strip": (lambda: pressed(mbs.Beam(STRIP, elements=16)), 5.0, {}),
    "strut": (
        lambda: pressed(mbs.Strut(STRIP)),
        5.0,
        {"solver": mbs.Exudyn()},
    ),  # undamped, it rings: nothing predicts its forces
    "modal": (lambda: mbs.crank_rocker(mbs.Modal(mbs.Section(0.02, 0.005)), speed=10.0), 0.7, {}),
    "loose": (loose, 0.65, {"solver": mbs.Exudyn(mbs.Controlled(tolerance=1e-2))}),
    "pendulum": (pendulum, 1.5, {}),
    "loaded": (loaded, 0.5, {}),
    "failed": (pushed, 2.0, {"solver": mbs.Exudyn(mbs.Controlled(max_steps=150))}),
}


@cache
def run(name):
    make, duration, options = MECHANISMS[name]
    return mbs.simulate(make(), duration, ledger=True, **options)
