"""Slider-crank with a bending coupler and no stop: error against run time of meshes, tolerances, fidelities, plain runs.

The coupler is 2 mm thick and undamped. At 62.8 rad/s it follows inertia; at 1.25 rad/s it only rings on from the start, for
244 periods of its first mode, so that the smallest error of frequency shows: the hard case for any integrator. The error is
that of the deflection of mid-span from the chord, relative L2 norm over 401 times of one turn, against another method:
the compiled solver, whose strip is one polynomial, at a tolerance of 1e-8.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import nan, pi
from typing import Any

import numpy as np

from buckler.mbs import Beam, Cable, Controlled, Exudyn, Mechanism, Result, Section, Spectral, simulate, slider_crank
from buckler.mbs.elements.element import Body
from buckler.mbs.geometry import Array

from ..kit import work_precision as precision
from ..kit.parameters import StudyParameters, counts, integer, quantities, quantity
from ..kit.published import STRIP_WIDTH
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Figure
from ..kit.work_precision import Point, Runs, Series
from . import plain

DEFLECTION = "coupler.deflection"
TIMES = 401
REFERENCE = 1e-8
"""Tolerance of the compiled solver's runs."""
AGREES_TO = 2e-3
"""The finest run of the engine must be this close to the reference, or one of the two is wrong."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    thickness: float = quantity(2e-3, "m", 1e-3, 5e-3, "of the coupler, 30 mm wide", "mechanism")
    mass: float = quantity(0.3, "kg", 1e-3, 100, "of the slider", "mechanism")
    speed: float = quantity(62.8, "rad/s", 0.5, 200, "of the crank", "mechanism")
    turns: float = quantity(1.0, "1", 0.01, 10, "of the crank; a tenth will do at 1.25 rad/s", "mechanism")
    elements: tuple[int, ...] = counts((4, 8), 1, 64, "elements of the beam", "numerics")
    tolerances: tuple[float, ...] = quantities((1e-5, 1e-6, 1e-7, 1e-8), "1", 1e-10, 1e-3, "tolerances to run", "numerics")
    steps: tuple[int, ...] = counts((400, 800, 1600, 3200), 50, 10**6, "steps a turn of plain runs", "plain run")
    degree: int = integer(11, 6, 24, "of the polynomial of the compiled solver's strip", "numerics")
    repeats: int = integer(5, 1, 1000, "repetitions, taken in turn", "numerics")

    @property
    def section(self) -> Section:
        """Of the coupler, without damping."""
        return Section(width=STRIP_WIDTH, thickness=self.thickness)

    @property
    def times(self) -> Array:
        """When deflections are compared, s."""
        return np.linspace(0.0, self.turns * 2 * pi / self.speed, TIMES)

    def mechanism(self, coupler: Body) -> Mechanism:
        """The slider-crank without a stop."""
        return slider_crank(coupler, law=None, mass=self.mass, speed=self.speed)


@dataclass(frozen=True)
class DeflectionRun:
    """Deflection at the study's times, m, how the run ended and its work."""

    deflection: Array
    status: str
    work: dict[str, float]


def deflection(result: Result, times: Array) -> DeflectionRun:
    """That of a result, nan after its end."""
    return DeflectionRun(result.at(DEFLECTION, times, outside=np.nan), result.status, result.work)


def plain_deflection(mechanism: Mechanism, times: Array, steps: int, relative: float, absolute: float) -> DeflectionRun:
    """That of a plain run in uniform steps, Newton's method to these tolerances."""
    found = plain.smooth_slider_crank(mechanism, float(times[-1]), steps, relative, absolute)
    return DeflectionRun(found.at(times), found.message or "OK", found.work)


def reference(p: Parameters, degree: int) -> Array:
    """Deflection by the compiled solver, m: one polynomial of this degree."""
    solver = Spectral(Controlled(REFERENCE), degree=degree)
    result = simulate(p.mechanism(Beam(p.section)), float(p.times[-1]), solver=solver, timeout=300)
    return deflection(result, p.times).deflection


def simulated(p: Parameters, coupler: Beam | Cable, tolerance: float) -> DeflectionRun:
    """The deflection by `simulate` with error-controlled steps."""
    result = simulate(p.mechanism(coupler), float(p.times[-1]), solver=Exudyn(Controlled(tolerance)), timeout=300)
    return deflection(result, p.times)


def plainly(p: Parameters, elements: int, steps: int, relative: float, absolute: float) -> DeflectionRun:
    """The deflection by a plain run in uniform steps."""
    cable = p.mechanism(Cable(p.section, elements=elements))
    return plain_deflection(cable, p.times, max(1, round(steps * p.turns)), relative, absolute)


def variants(p: Parameters) -> Runs:
    """Every run by model and setting."""
    couplers: dict[str, Beam | Cable] = {f"Beam x {n}": Beam(p.section, elements=n) for n in p.elements}
    couplers["Cable x 4"] = Cable(p.section, elements=4)
    runs = {name: precision.by_tolerance(partial(simulated, p, coupler), p.tolerances) for name, coupler in couplers.items()}
    for label, relative, absolute in (("tuned", 1e-5, 1e-8), ("default Newton", 1e-8, 1e-10)):
        runs[f"plain ANCF x 4, {label}"] = {f"{n}": partial(plainly, p, 4, n, relative, absolute) for n in sorted(p.steps)}
    return runs


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run the reference twice, of a lower degree too, then every variant in turn."""
    exact = reference(p, p.degree)
    size = float(np.sqrt((exact**2).mean()))

    def off(deflection: Array) -> float:
        return float(np.sqrt(((deflection - exact) ** 2).mean())) / size

    own = off(reference(p, p.degree - 2))
    runs = variants(p)
    series = precision.measure(runs, lambda outcome: off(outcome.deflection), p.repeats, progress)
    ours, plains = (
        precision.points_of({model: part for model, part in series.items() if model.startswith("plain") == plain})
        for plain in (False, True)
    )
    best, rival = (min(points, key=lambda point: (point.error, point.wall_s)) for points in (ours, plains))
    mine = precision.fastest(ours, rival.error)  # no less accurate than the most accurate plain run
    metrics = {
        "best_error": Metric(best.error, "1"),
        "reference_own_error": Metric(own, "1"),
        "speedup_at_plain_error": Metric(mine.speedup(rival) if mine else nan, "1"),
    }
    wrong = [] if best.error <= AGREES_TO else [f"engine and reference differ by {best.error:.1e}"]
    return StudyResult(
        parameters=p,
        metrics=metrics,
        signals=precision.as_signals(series),
        tables=[_table(series, rival, precision.footnote(p))],
        **judged(wrong, precision.verdict(mine or best, rival)),
    )


def _table(series: Series, baseline: Point, notes: str) -> Table:
    rows: list[list[Any]] = []
    for model, part in series.items():
        for key, point in part.items():
            counts = [point.work.get(name) for name in ("steps", "newton_iterations", "jacobians")]
            speed = f"{point.speedup(baseline):.2f}"
            rows.append([model, key, point.error, 1e3 * point.wall_s, speed, *counts, precision.mark(point)])
    headers = ["model", "tolerance, steps", "relative error", "time [ms]", "plain/time", "steps", "Newton", "Jacobians", "front"]
    return Table(headers, rows, "Smooth slider-crank: relative L2 error of the deflection", f"plain: {baseline.name}\n{notes}")


def figure(result: StudyResult) -> Figure:
    """Error over run time of every series."""
    fig, ax = precision.figure_of(result.signals, "relative L2 error of the deflection")
    ax.legend(
        title="at the points: tolerance, or steps", title_fontsize=8, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3
    )
    return fig
