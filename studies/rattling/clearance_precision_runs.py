"""What `clearance-precision` runs: the crank-rocker with clearance on both solvers, by scipy, and plainly.

Every run gives the same: the path of the bars' centres at times of its own, to be held against a fine run of the compiled solver.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from buckler.mbs import (
    Beam,
    Clearance,
    Controlled,
    Equal,
    Exudyn,
    Mechanism,
    Modal,
    Ramp,
    Rigid,
    crank_rocker,
    simulate,
)
from buckler.mbs.library import STEEL_CRANK_ROCKER
from buckler.mbs.modal import BarModes
from buckler.mbs.spectral.dense import right_hand_side
from buckler.mbs.spectral.output import STEPS
from buckler.mbs.spectral.run import integrate
from buckler.studies.rattling import turns
from buckler.studies.rattling.clearance import CrankRockerParameters
from buckler.studies.rattling.linkage import FourBar
from buckler.studies.rattling.turns import Model, solver

Array = np.ndarray[Any, Any]
CENTRES = {"coupler": 2, "rocker": 5}
"""First column of a bar's centre among the coordinates of a run."""
FINEST = 1e-12
"""Tolerance of the run that others are held against."""
SAMPLE = 1e-6
"""Time between its samples, s: read between them, it is as good as at them."""
SEEN = 1e-4
"""Time between the samples of scipy's runs, s."""
LENGTH = STEEL_CRANK_ROCKER.rocker
"""Of the rocker, m."""
MODES = 12
"""Bending and as many axial modes of the rocker that stands for the beam."""


@dataclass(frozen=True)
class BarPaths:
    """Path of the centres of coupler and rocker, how the run ended, what it counted.

    Attributes
    ----------
    time : array, shape (times,)
    path : array, shape (times, 4)
        x and y of the coupler's centre, then of the rocker's, m.
    """

    time: Array
    path: Array
    status: str = "OK"
    work: dict[str, float] = field(default_factory=dict)
    balance: float = float("nan")


def mechanism(p: CrankRockerParameters, rocker: Any, *, law: Any = None, ramp: bool = False) -> Mechanism:
    """The crank-rocker with clearance in all joints; a ramp that does not rise takes it to the implicit integrator."""

    def play(point: str, first: str, second: str) -> Clearance:
        return replace(p.play(point, first, second), law=law or p.law)

    offset = p.mechanism("rigid").points["A"]  # with the chance offset of the start
    angle = float(np.arctan2(offset[1], offset[0]))
    speed = Ramp(p.speed, p.speed, 1.0) if ramp else p.speed
    return replace(crank_rocker(rocker, speed=speed, play=play, section=p.section, angle=angle), gravity=p.pull)


def rigid(p: CrankRockerParameters) -> Rigid:
    """Rocker that does not bend."""
    return Rigid(p.section)


def beam(p: CrankRockerParameters, elements: int) -> Beam:
    """Rocker of elements, with Kelvin-Voigt damping in bending and along its axis."""
    damped = p.section.damped(p.rocker_damping, LENGTH)
    material = replace(damped.material, axial_damping=damped.material.bending_damping)
    return Beam(replace(damped, material=material), elements=elements)


def modal(p: CrankRockerParameters) -> Modal:
    """Rocker of a solid's modes."""
    return p.modal()


def fourbar(p: CrankRockerParameters, modes: Modal | None = None) -> FourBar:
    """The same for the compiled solver."""
    place = p.mechanism("rigid").points["A"]
    return FourBar(
        width=p.section.width, thickness=p.section.thickness, density=p.section.material.density, speed=p.speed,
        start=float(np.arctan2(place[1], place[0])), pin=p.pin, gap=p.clearance, law=p.law, friction=p.friction, modes=modes,
        gravity=p.pull, turned=p.turned,
    )  # fmt: skip


def modes_of_beam(p: CrankRockerParameters, count: int = MODES) -> Modal:
    """Rocker of Timoshenko modes with the material damping of `beam`, of each mode tau omega / 2."""
    section = beam(p, 1).section
    body = Modal(section, BarModes(count, count), 0.0)
    ratios = section.material.bending_damping * body.planar(LENGTH).frequency / 2
    return replace(body, damping=tuple(ratios.tolist()))


# --- runs -------------------------------------------------------------------------------------------------------------


def on_engine(made: Mechanism, duration: float, solver: Exudyn | None = None, ledger: bool = False) -> BarPaths:
    """By the engine alone: a run without a solver might be another's."""
    result = simulate(made, duration, solver=solver or Exudyn(), ledger=ledger, timeout=300)
    path = np.stack([result.signals[f"{bar}.{axis}"] for bar in CENTRES for axis in "xy"], axis=1)
    return BarPaths(result.time, path, result.status, result.work, result.energy_balance if ledger else float("nan"))


def with_tolerance(made: Mechanism, duration: float, tolerance: float) -> BarPaths:
    """By `simulate`, with that tolerance."""
    return on_engine(made, duration, Exudyn(Controlled(tolerance)))


def with_equal_steps(made: Mechanism, duration: float, count: int) -> BarPaths:
    """By `simulate`, in equal steps."""
    return on_engine(made, duration, Exudyn(Equal(count)))


def compiled(bar: FourBar, duration: float, tolerance: float) -> BarPaths:
    """By the compiled solver, at its own steps."""
    model = Model.of(bar)
    out, failure, counts = integrate(model.scene, duration, solver(bar, tolerance))
    path = out.q[:, model.columns[[2, 3, 5, 6]]]
    return BarPaths(out.time, path, str(failure[0]) if failure else "OK", {"steps": float(counts[STEPS])})


def by_scipy(bar: FourBar) -> Callable[[float, float], BarPaths]:
    """The compiled solver's right-hand side through scipy's DOP853; of duration and tolerance."""
    model = Model.of(bar)
    rates, start = right_hand_side(model.scene), np.concatenate([model.scene.q0, model.scene.v0])
    rates(0.0, start)  # compiled now, not in the first run
    options: Any = {"max_step": bar.period / 100, "first_step": 1e-7}

    def run(duration: float, tolerance: float) -> BarPaths:
        times = np.linspace(0, duration, round(duration / SEEN) + 1)
        found = solve_ivp(rates, (0, duration), start, "DOP853", times, rtol=tolerance, atol=tolerance, **options)
        path, work = found.y[model.columns[[2, 3, 5, 6]]].T, {"evaluations": found.nfev}
        return BarPaths(found.t, path, "OK" if found.success else found.message, work)

    return run


def plainly(made: Mechanism, duration: float, steps: int) -> BarPaths:
    """By the engine's own default settings, in equal steps; their number is the one thing that has no default that works."""
    from buckler.mbs.engine.defaults import with_default_settings  # loads the engine

    time, bars, message = with_default_settings(made, duration, steps)
    places = [bars[bar].point(point)[0] for bar, ends in (("coupler", "AB"), ("rocker", "CB")) for point in ends]
    path = np.hstack([(places[0] + places[1]) / 2, (places[2] + places[3]) / 2])
    return BarPaths(time, path, message or "OK", {"steps": float(len(time))})


# --- how far apart ----------------------------------------------------------------------------------------------------


def finest(bar: FourBar, compared: float) -> Callable[[BarPaths], float]:
    """Distance from the compiled solver at `FINEST`: largest of a bar's centre within the time compared, m; nan if failed."""
    run = turns.simulate(bar, compared, tolerance=FINEST, samples=round(compared / SAMPLE) + 1)
    path = CubicHermiteSpline(run.time, run.q[:, [2, 3, 5, 6]], run.q_t[:, [2, 3, 5, 6]])

    def distance(outcome: BarPaths) -> float:
        early = outcome.time <= compared
        if not run.ok or outcome.status not in ("OK", "SUSPECT") or early.all():
            return float("nan")
        off = outcome.path[early] - path(outcome.time[early])
        return float(np.hypot(off[:, ::2], off[:, 1::2]).max())

    return distance
