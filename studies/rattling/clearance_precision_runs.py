"""What `clearance-precision` runs: the crank-rocker with clearance on both solvers, by scipy, and plainly.

Every run gives the same: the path of the bars' centres at times of its own, to be held against a fine run of the compiled solver.
Later only means over turns can be compared, of many starts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.stats import ttest_ind

from buckler.mbs import Exudyn, Mechanism, Modal, Ramp, Section, simulate
from buckler.mbs.elements.element import Body
from buckler.mbs.geometry import Array
from buckler.mbs.modal import BarModes
from buckler.mbs.spectral.dense import right_hand_side
from buckler.mbs.spectral.run import integrate
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.start import start_rates

from . import turns
from .clearance import CrankRockerParameters
from .mode_sets import LENGTH
from .turns import by_turn, ensemble, period, solver

LINKS, GOOD = ("coupler", "rocker"), ("OK", "SUSPECT")
FINEST = 1e-12
"""Tolerance of the run that others are held against."""
SEEN = 1e-4
"""Time between the samples of scipy's runs, s."""
MODES = 12
"""Bending and as many axial modes of the rocker that stands for the beam."""


@dataclass(frozen=True)
class BarPaths:
    """Path of the centres of coupler and rocker, x and y of each, m, (times, 4); how the run ended, what it counted."""

    time: Array
    path: Array
    status: str = "OK"
    work: dict[str, float] = field(default_factory=dict)


def mechanism(p: CrankRockerParameters, rocker: Body | None = None, *, ramp: bool = False, **changes: Any) -> Mechanism:
    """The crank-rocker with clearance in all joints; a ramp that does not rise takes it to the implicit integrator."""
    speed = Ramp(p.speed, p.speed, 1.0) if ramp else p.speed
    return p.bars(rocker=rocker, speed=speed, angle=p.angle, **changes)


def damped(p: CrankRockerParameters) -> Section:
    """Of the rocker, with Kelvin-Voigt damping in bending and along its axis."""
    found = p.section.damped(p.rocker_damping, LENGTH)
    return replace(found, material=replace(found.material, axial_damping=found.material.bending_damping))


def modes_of_beam(p: CrankRockerParameters, count: int = MODES) -> Modal:
    """Rocker of Timoshenko modes with the material damping of `damped`, of each mode tau omega / 2."""
    section = damped(p)
    body = Modal(section, BarModes(count, count), 0.0)
    ratios = section.material.bending_damping * body.planar(LENGTH).frequency / 2
    return replace(body, damping=tuple(ratios.tolist()))


def on_engine(made: Mechanism, duration: float, solver: Exudyn | None = None) -> BarPaths:
    """By the engine alone: a run without a solver might be another's."""
    result = simulate(made, duration, solver=solver or Exudyn(), timeout=300)
    path = np.stack([result.signals[f"{bar}.{axis}"] for bar in LINKS for axis in "xy"], axis=1)
    return BarPaths(result.time, path, result.status, result.work)


def compiled(made: Mechanism, duration: float, tolerance: float) -> BarPaths:
    """By the compiled solver, at its own steps, nothing read but the path."""
    scene = Scene.of(made)
    out, failure, counts = integrate(scene, duration, solver(made, tolerance))
    return BarPaths(out.time, out.q[:, centres(scene)], str(failure[0]) if failure else "OK", {"steps": float(counts.steps)})


def by_scipy(made: Mechanism) -> Callable[[float, float], BarPaths]:
    """The compiled solver's right-hand side through scipy's DOP853; of duration and tolerance."""
    scene = Scene.of(made)
    rates, start = right_hand_side(scene), np.concatenate([scene.q0, start_rates(scene)])
    rates(0.0, start)  # compiled now, not in the first run
    options: Any = {"max_step": period(made) / 100, "first_step": 1e-7}

    def run(duration: float, tolerance: float) -> BarPaths:
        times = np.linspace(0, duration, round(duration / SEEN) + 1)
        found = solve_ivp(rates, (0, duration), start, "DOP853", times, rtol=tolerance, atol=tolerance, **options)
        path, work = found.y[centres(scene)].T, {"evaluations": found.nfev}
        return BarPaths(found.t, path, "OK" if found.success else found.message, work)

    return run


def centres(scene: Scene) -> list[int]:
    """Coordinates of the centres of coupler and rocker."""
    return [scene.builder.bodies[link].offset + k for link in LINKS for k in (0, 1)]


def plainly(made: Mechanism, duration: float, steps: int) -> BarPaths:
    """By the engine's own default settings, in equal steps; their number is the one thing that has no default that works."""
    from buckler.mbs.engine.solve import with_default_settings  # loads the engine

    time, bars, message = with_default_settings(made, duration, steps)
    places = [bars[bar].point(point)[0] for bar, ends in (("coupler", "AB"), ("rocker", "CB")) for point in ends]
    path = np.hstack([(places[0] + places[1]) / 2, (places[2] + places[3]) / 2])
    return BarPaths(time, path, message or "OK", {"steps": float(len(time))})


def finest(made: Mechanism, compared: float) -> Callable[[BarPaths], float]:
    """Distance from the compiled solver at `FINEST`: largest of a bar's centre within the time compared, m; nan if failed."""
    fine = simulate(made, compared, solver=solver(made, FINEST))

    def distance(outcome: BarPaths) -> float:
        early = outcome.time <= compared
        if fine.status not in GOOD or outcome.status not in GOOD or early.all():
            return float("nan")
        path = np.stack([fine.at(f"{bar}.{axis}", outcome.time[early]) for bar in LINKS for axis in "xy"], axis=1)
        off = outcome.path[early] - path
        return float(np.hypot(off[:, ::2], off[:, 1::2]).max())

    return distance


# --- statistics: many starts, means over turns, standard errors ------------------------------------------------------------

QUANTITIES = {
    "peak_force_coupler_rocker": "N", "peak_force_rocker_frame": "N", "rms_ax_coupler": "m/s^2", "rms_ax_rocker": "m/s^2",
    "lost": "J",
}  # fmt: skip
"""Of each turn: largest force of two joints, rms x-acceleration of two bars, energy lost in contact and friction; with units."""


class Comparison(NamedTuple):
    """Each member's means over its turns, (members, 5) by `QUANTITIES`, of both solvers; largest energy balance on the engine."""

    engine: Array
    compiled: Array
    balance: float

    @property
    def error(self) -> Array:
        """Standard errors of the differences of the means, (5,)."""
        return np.asarray(np.sqrt(sum(each.var(axis=0, ddof=1) / len(each) for each in (self.engine, self.compiled))))

    @property
    def apart(self) -> Array:
        """Difference of the means in standard errors, (5,)."""
        return np.asarray((self.engine.mean(axis=0) - self.compiled.mean(axis=0)) / self.error)

    @property
    def chance(self) -> float:
        """Chance of a difference as large in any of the five if there is none: Welch's t-test, times five (Bonferroni)."""
        return min(1.0, 5 * float(ttest_ind(self.engine, self.compiled, equal_var=False).pvalue.min()))


def compare(usual: Mechanism, compiled: Mechanism, members: int, cycles: int, progress: Callable[..., Any] = iter) -> Comparison:
    """Run the engine at its default tolerance, the compiled solver four times as often; each member has a start of its own."""
    runs = [turns.on_engine(turns.another(usual, seed), cycles, 1) for seed in progress(range(members))]
    engine = np.stack([columns(by_turn(run, period(usual), 1 + cycles, 1)).mean(axis=0) for run in runs])
    found = ensemble(compiled, cycles, range(4 * members)).turns
    return Comparison(engine, columns(found).mean(axis=1), max(run.energy_balance for run in runs))


def columns(found: Mapping[str, Array]) -> Array:
    """`QUANTITIES` among the measures of turns, shape (..., 5)."""
    force, a = found["force"], found["rms_a"]
    return np.stack([force[..., 2], force[..., 3], a[..., 0], a[..., 1], found["lost"]], axis=-1)
