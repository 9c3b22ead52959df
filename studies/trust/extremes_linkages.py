"""Cases of the study `extremes` with four-bars of rigid links in ideal joints: near and beyond dead centres, speeds, steps."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np

from buckler.mbs import Controlled, Equal, Exudyn, Mechanism, Result, Rigid, Section
from buckler.mbs.library import CrankRocker, crank_rocker
from buckler.studies.kit.published import STEEL
from buckler.studies.rattling.linkage import FourBar
from buckler.studies.trust.extremes_case import DEFAULT, Case, Measures, simulated

BARS = Section(0.005, 0.020, STEEL)
"""The paper's bars, 20 mm in the plane."""
SPEED = 10 * pi
"""Of the crank, rad/s."""
SAMPLES = np.linspace(0.0, 1.0, 401)
"""When motions are compared, of the run's length: what is wrong may last a few steps only."""


def ideal(name: str, lengths: CrankRocker, angle: float, turn: float, speed: float = SPEED, solver: Exudyn = DEFAULT) -> Case:
    """Make a case of rigid bars and ideal joints, against loop closure; none is right where the crank cannot turn."""
    duration = turn / abs(speed)
    times = SAMPLES * duration

    def read(result: Result) -> Measures:
        signals = {
            f"{link}.{what}": result.at(f"{link}.{what}", times, outside=np.nan)
            for link in ("coupler", "rocker")
            for what in ("x", "ax")
        }
        return {
            "place": np.stack([signals["coupler.x"], signals["rocker.x"]]),
            "acceleration": np.stack([signals["coupler.ax"], signals["rocker.ax"]]),
            "force": result.at("drive.torque", times, outside=np.nan),
        }

    def reference() -> Measures:
        bars = FourBar(*lengths, width=BARS.width, thickness=BARS.thickness, speed=speed, start=angle, gap=0)
        place, velocity, acceleration = bars.ideal(times)
        inertia = np.stack([bars.masses, bars.masses, bars.inertias], axis=-1)
        power = (inertia * velocity * acceleration).sum(axis=(1, 2))
        return {"place": place[:, 1:, 0].T, "acceleration": acceleration[:, 1:, 0].T, "force": power / speed}

    def mechanism() -> Mechanism:
        return crank_rocker(Rigid(BARS), speed=speed, section=BARS, lengths=lengths, angle=angle)

    run = simulated(mechanism, duration, solver, read)
    turns = _turns(lengths)
    return Case("four-bar, ideal joints", name, run, reference if turns else None, {"place": max(lengths)})


def _turns(lengths: CrankRocker) -> bool:
    """True if coupler and rocker reach each other at every crank angle."""
    low, high = abs(lengths.coupler - lengths.rocker), lengths.coupler + lengths.rocker
    return low < abs(lengths.frame - lengths.crank) and lengths.frame + lengths.crank < high


PAPER = CrankRocker()


def near_change_point(room: float) -> CrankRocker:
    """The paper's bars with a frame so short that at crank angle 0 coupler and rocker are in line but for this, m."""
    return PAPER._replace(frame=PAPER.crank + PAPER.coupler - PAPER.rocker + room)


def every() -> Iterator[Case]:
    """All cases of this file: dead centres near and met, linkages whose crank cannot turn, speeds and steps."""
    for room in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-9):
        for angle in (0.5, -0.3):
            yield ideal(f"{room:g} m from a dead centre, from {angle:g} rad", near_change_point(room), angle, 2 * pi)
    square = CrankRocker(0.1, 0.2, 0.1, 0.2)
    yield ideal("parallelogram", square, 0.5, 2 * pi)
    yield ideal("parallelogram, from its dead centre", square, 0.0, 1.0)
    yield ideal("kite", CrankRocker(0.1, 0.2, 0.2, 0.1), 1.0, 2 * pi)
    for name, lengths in (
        ("crank too long", PAPER._replace(crank=0.15)),
        ("coupler too short", PAPER._replace(coupler=0.16)),
        ("coupler far too short", PAPER._replace(coupler=0.03)),
    ):
        for angle in (0.0, 0.5):
            yield ideal(f"{name}, from {angle:g} rad", lengths, angle, 2 * pi)
    for steps in (5, 20, 50, 200, 2000):
        yield ideal(f"{steps} equal steps", PAPER, 0.5, 2 * pi, solver=Exudyn(Equal(steps)))
    for speed in (0.01, 1e3, 1e5):
        yield ideal(f"{speed:g} rad/s", PAPER, 0.5, 2 * pi, speed=speed)
    yield ideal("tolerance 1", PAPER, 0.5, 2 * pi, solver=Exudyn(Controlled(1.0)))
    yield ideal("tolerance 1, one step in all", PAPER, 0.5, 2 * pi, solver=Exudyn(Controlled(1.0, 1.0)))
