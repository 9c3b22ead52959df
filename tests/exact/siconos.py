"""Two published mechanisms with clearance, whose contacts are rigid there and have a stiffness here, and their trajectories.

A four-bar with three joints with clearance, no restitution, friction 0.1, its crank turned by a controller; and a slider-crank
whose slider has clearance in its guide, restitution 0.4 at each of four corners, friction 0.01, which our stops leave out.

The trajectories are numbers only, by nonsmooth dynamics, from the examples of Siconos: every row of the four-bar's that is
published, every tenth of the slider-crank's, up to 0.1 s. Source: the reference files (.ref) of the Siconos tutorials, repository
siconos/siconos-tutorials on GitHub, commit b6c9bfd (24 July 2024),
examples/mechanics/FourBarLinkageWith3clearance/FourBarClearance.ref and
examples/mechanics/SliderCrank/SliderCrankMoreauJean(Direct|Combined)ProjectionOSI.ref. Copyright INRIA, Apache License 2.0.
The slider-crank is that of P. Flores, R. Leine, C. Glocker, doi 10.1007/s11044-009-9178-y.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from pathlib import Path

import numpy as np

from buckler.mbs import Clearance, Link, Mechanism, Revolute, Rigid, Stop, Torque
from buckler.mbs.geometry import Array
from buckler.mbs.laws import CarvalhoMartins, Coulomb
from buckler.studies.kit.published import GRAVITY


def _columns(name: str) -> Array:
    return np.loadtxt(Path(__file__).with_name(f"siconos_{name}.csv"), delimiter=",", skiprows=1, unpack=True)


FOURBAR = _columns("four_bar")
"""Time, s; angles of crank, coupler and rocker, rad; speed of the crank, rad/s; torque of its drive, N m."""
SLIDER_CRANK = _columns("slider_crank")
"""Time, s; crank's revolutions and the slider's height over the clearance, by direct and by combined projection."""

CRANK, COUPLER, ROCKER, FRAME = 1.0, 4.0, 2.5, 3.0
"""Lengths, m; every bar has 1 kg."""
CENTRE = 1.876454585097650, 1.691962091335582
"""Of the coupler at the start, m."""
PIN, GAP, FRICTION = 0.055, 0.005, 0.1
"""Radius of the pins, radial clearance, m; Coulomb's coefficient."""
GAIN, POLE, SWING, PACE = 200.0, 10.0, 6.0, 0.75 * 3.14159265
"""Controller: N m s, 1/s, rad, rad/s; pi as it was typed."""
SLOW = 1e-2
"""Sliding speed below which friction is linear, m/s."""
SOFT = 0.1
"""Restitution of the smooth law; the published one is 0, and joints that stay closed do not ask."""


def controlled(t: float, angle: float, speed: float) -> float:
    """Torque of the crank, N m: a passive controller that knows the four-bar with ideal joints and wants 6 sin(w t).

    With the reduced inertia M(angle), wanted angle q and p = speed - POLE (angle - q): M (q'' - POLE (speed - q')) + C speed p
    - GAIN (speed - q' + POLE (angle - q)) + weights. C is M'/2 but for the rocker's part, in which the published controller
    takes the inertia about the centre of mass.
    """
    k1, k2 = -2 * CRANK * ROCKER * sin(angle), 2 * ROCKER * (FRAME - CRANK * cos(angle))
    k3 = FRAME**2 + CRANK**2 - COUPLER**2 + ROCKER**2 - 2 * FRAME * CRANK * cos(angle)
    rocker = 2 * (3.14159265 + atan2(-k1 - sqrt(k1 * k1 + k2 * k2 - k3 * k3), k3 - k2))
    coupler = atan2(-CRANK * sin(angle) + ROCKER * sin(rocker), FRAME - CRANK * cos(angle) + ROCKER * cos(rocker))
    apart = sin(coupler - rocker)
    one, two = CRANK * sin(rocker - angle) / (COUPLER * apart), CRANK * sin(coupler - angle) / (ROCKER * apart)
    bend = cos(coupler - rocker) / apart * (one - two)  # (ln apart)' over the crank's angle
    one_ = CRANK * cos(rocker - angle) * (two - 1) / (COUPLER * apart) - one * bend
    two_ = CRANK * cos(coupler - angle) * (one - 1) / (ROCKER * apart) - two * bend
    turned = sin(coupler - angle) * (1 - one)  # cos(angle - coupler)'
    first, second, third = 0.5 * (CRANK**2 / 3 + CRANK**2), COUPLER**2 / 6, ROCKER**2 / 6
    cross = 0.5 * CRANK * COUPLER
    inertia = 2 * (first + second * one**2 + third * two**2 + cross * cos(angle - coupler) * one)
    change = 2 * second * one * one_ + ROCKER**2 / 6 * two * two_ + cross * (cos(angle - coupler) * one_ + one * turned)
    wanted, pace, rise = SWING * sin(PACE * t), SWING * PACE * cos(PACE * t), -SWING * PACE**2 * sin(PACE * t)
    off, lag = speed - pace, angle - wanted
    weights = GRAVITY * (1.5 * CRANK * cos(angle) + one * 0.5 * COUPLER * cos(coupler) + two * 0.5 * ROCKER * cos(rocker))
    drive = inertia * (rise - POLE * off) + change * speed * (speed - POLE * lag)
    return drive - GAIN * (off + POLE * lag) + weights


def fourbar(stiffness: float) -> Mechanism:
    """The four-bar, its contacts of this stiffness, N/m."""
    crank, coupler = (float(FOURBAR[k, 0]) for k in (1, 2))
    law, friction = CarvalhoMartins(stiffness, SOFT, exponent=1.0), Coulomb(FRICTION, SLOW)

    def joint(point: str, pin: str, bush: str) -> Clearance:
        return Clearance(point, pin, bush, PIN, GAP, law, friction)

    def bar(length: float) -> Rigid:
        return Rigid.of(mass=1.0, inertia=length**2 / 12)

    end = (CENTRE[0] + 0.5 * COUPLER * cos(coupler), CENTRE[1] + 0.5 * COUPLER * sin(coupler))
    return Mechanism(
        points={"O": (0.0, 0.0), "A": (CRANK * cos(crank), CRANK * sin(crank)), "B": end, "C": (FRAME, 0.0)},
        links=[
            Link("crank", "O", "A", bar(CRANK)),
            Link("coupler", "A", "B", bar(COUPLER)),
            Link("rocker", "C", "B", bar(ROCKER)),
        ],
        joints=[
            Revolute("O", "ground", "crank"),
            joint("A", "crank", "coupler"),
            joint("B", "coupler", "rocker"),
            joint("C", "rocker", "ground"),
        ],
        loads=[Torque("crank", lambda t, turned, speed: controlled(t, crank + turned, speed))],
        gravity=(0.0, -GRAVITY),
    )


ARM, ROD = 0.153, 0.306
HALF_LENGTH, HALF_HEIGHT, CLEARANCE = 0.05, 0.025, 0.001
"""Of the slider, and its clearance in the guide either way, m."""
RESTITUTION = 0.4
START = 150.0
"""Speed of the crank at the start, rad/s; nothing drives it."""


def slider_crank(stiffness: float) -> Mechanism:
    """The slider-crank, the faces of its guide of this stiffness, N/m."""
    x, law = ARM + ROD, CarvalhoMartins(stiffness, RESTITUTION, exponent=1.0)
    corners = {
        f"N{k}": (x + along * HALF_LENGTH, up * HALF_HEIGHT)
        for k, (along, up) in enumerate(((-1, 1), (1, 1), (-1, -1), (1, -1)), 1)
    }
    return Mechanism(
        points={"O": (0.0, 0.0), "A": (ARM, 0.0), "B": (x, 0.0), "E": (x + HALF_LENGTH, 0.0), **corners},
        links=[
            Link("crank", "O", "A", Rigid.of(mass=0.038, inertia=7.4e-5)),
            Link("coupler", "A", "B", Rigid.of(mass=0.038, inertia=5.9e-4)),
            Link("slider", "B", "E", Rigid.of(mass=0.076, inertia=2.7e-6, centre=(0.0, 0.0)), carries=tuple(corners)),
        ],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler"), Revolute("B", "coupler", "slider")],
        stops=[
            Stop(name, at=y + CLEARANCE * (1 if y > 0 else -1), law=law, along=(0, 1), link="slider")
            for name, (_, y) in corners.items()
        ],
        gravity=(0.0, -GRAVITY),
        velocities={"crank": START, "coupler": -START * ARM / ROD, "slider": 0.0},
    )
