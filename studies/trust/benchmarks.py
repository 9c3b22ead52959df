"""Published benchmark problems of multibody dynamics, one row each: reference, result, error, run time.

Andrews' squeezing mechanism, the N four-bar through its singular poses, the Princeton beam in its plane, Simeon's
flexible slider-crank and a double pendulum against 40 digits. docs/benchmarks.md tells each problem, its parameters
and its source.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, pi
from time import perf_counter
from typing import NamedTuple

from buckler.elastica.strip import Load, Strip
from buckler.mbs import Equal, Exudyn, Mechanism, simulate
from buckler.mbs.statics import equilibrium

from ..kit.parameters import StudyParameters, choices, integer, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Figure
from . import benchmark_problems as problems
from . import known


class Row(NamedTuple):
    """One number of a problem: reference, its own uncertainty (absolute), what was found, in a unit, with a status."""

    reference: float
    within: float
    found: float
    unit: str
    status: str = "OK"


PROBLEMS = ("andrews", "four_bar_n2", "princeton", "simeon", "pendulum")
ALLOWED = {
    "andrews.beta": 1e-6,
    "four_bar_n2.x": 1e-4,
    "four_bar_n2.y": 1e-4,
    "princeton.tip": 5e-3,
    "princeton.exact": 1e-6,
    "princeton.exact_13": 1e-6,
    "simeon.slider_crank": 1e-3,
    "simeon.rod": 1e-3,
    "pendulum": 1e-6,
}
"""Error allowed: relative to the reference, of places of the four-bar and the pendulum's angle absolute, m and rad."""
RADIUS = 0.95
"""Spectral radius of rigid problems' runs."""
ABSOLUTE = ("four_bar_n2.x", "four_bar_n2.y", "pendulum")


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    problems: tuple[str, ...] = choices(PROBLEMS, PROBLEMS, "which are solved", "problems")
    steps: int = integer(25_000, 100, 1_000_000, "equal steps of the coarser run of rigid problems", "numerics")
    singular_accuracy: float = quantity(1e-6, "1", 1e-6, 1e-2, "accuracy asked of the four-bar", "numerics")
    accuracy: float = quantity(1e-3, "1", 1e-6, 1e-2, "accuracy asked of the flexible slider-crank", "numerics")


def extrapolated(mechanism: Mechanism, duration: float, steps: int, *signals: str) -> tuple[list[float], str]:
    """Last values of some signals from two runs of equal steps, n and 2 n, extrapolated to no step at all; a status.

    Generalized-alpha is of second order: the finer run's error is a third of the difference.
    """
    runs = [simulate(mechanism, duration, solver=Exudyn(Equal(n), spectral_radius=RADIUS)) for n in (steps, 2 * steps)]
    coarse, fine = ([float(run[name][-1]) for name in signals] for run in runs)
    wrong = next((run.status for run in runs if not run.ok), "OK")
    return [b + (b - a) / 3 for a, b in zip(coarse, fine, strict=True)], str(wrong)


def _andrews(p: Parameters) -> dict[str, Row]:
    (turned,), status = extrapolated(problems.andrews(), 0.03, p.steps, "K1.angle")
    return {"andrews.beta": Row(problems.ANDREWS_BETA, 1e-13, problems.ANDREWS_ANGLES[0] + turned, "rad", status)}


def _four_bar(p: Parameters) -> dict[str, Row]:
    """By an accuracy: equal steps meet a singular pose, through which nothing but luck goes on."""
    result = simulate(problems.four_bars(2), 10.0, p.singular_accuracy)
    return {
        f"four_bar_n2.{axis}": Row(right, 5e-6, float(result.signals[f"B0.{axis}"][-1]), "m", result.status)
        for axis, right in zip("xy", problems.FOUR_BAR_TOP, strict=True)
    }


def _princeton(_p: Parameters) -> dict[str, Row]:
    section, length = problems.PRINCETON, problems.PRINCETON_LENGTH
    unit = section.bending_stiffness / length**2
    exact = Strip("clamped", "free", axial=section.axial_stiffness / unit, shear=section.shear_stiffness / unit)
    rows = {}
    for load, (name, against) in zip(problems.PRINCETON_TIPS, (("tip", "exact"), ("tip_13", "exact_13")), strict=True):
        rest = equilibrium(problems.princeton(load), degree=14)
        tip = -float(rest.point("beam", "B").position[1])
        closed = -length * float(exact.equilibrium(Load(end=(0.0, -load / unit))).end[1])
        rows[f"princeton.{name}"] = Row(problems.PRINCETON_TIPS[load], 5e-10, tip, "m")
        rows[f"princeton.{against}"] = Row(closed, 1e-12, tip, "m")
    return rows


def _simeon(p: Parameters) -> dict[str, Row]:
    result = simulate(problems.simeon(), 0.1, p.accuracy)
    x, y = (float(result.signals[f"A.{axis}"][-1]) for axis in "xy")
    slider = float(result.signals["B.x"][-1])
    return {
        "simeon.slider_crank": Row(problems.SIMEON_SLIDER, 1e-9, slider, "m", result.status),
        "simeon.rod": Row(problems.SIMEON_ROD, 1e-9, atan2(-y, slider - x), "rad", result.status),
    }


def _pendulum(p: Parameters) -> dict[str, Row]:
    (turned,), status = extrapolated(problems.double_pendulum(), 5.0, p.steps, "first.angle")
    return {"pendulum": Row(problems.DOUBLE_PENDULUM, 1e-15, pi / 2 + turned, "rad", status)}


SOLVE: dict[str, Callable[[Parameters], dict[str, Row]]] = dict(
    zip(PROBLEMS, (_andrews, _four_bar, _princeton, _simeon, _pendulum), strict=True)
)


def error(name: str, row: Row) -> float:
    """Error of a row as its bar counts it: relative, or absolute for those named `ABSOLUTE`."""
    off = abs(row.found - row.reference)
    return off if name in ABSOLUTE else off / abs(row.reference)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Solve the problems one after the other."""
    rows: dict[str, Row] = {}
    walls: dict[str, float] = {}
    for problem in progress(p.problems, label="problems"):
        start = perf_counter()
        rows |= SOLVE[problem](p)
        walls[problem] = perf_counter() - start
    errors = {name: error(name, row) for name, row in rows.items()}
    missed = list(filter(None, (_missed(name, row, errors[name]) for name, row in rows.items())))
    metrics = {name: Metric(row.found, row.unit, exact=row.reference, error=errors[name]) for name, row in rows.items()} | {
        f"{name}.wall": Metric(wall, "s") for name, wall in walls.items()
    }
    table = Table(
        ["number", "unit", "reference", "found", "error", "allowed", "problem's run time [s]", "status"],
        [
            [name, r.unit, f"{r.reference:.9g}", f"{r.found:.9g}", _told(name, errors[name]), _told(name, ALLOWED.get(name)),
             round(walls[name.partition(".")[0]], 2), r.status]
            for name, r in rows.items()
        ],
        "Published benchmark problems",
        "Errors are relative, those marked m and rad absolute. docs/benchmarks.md tells the problems and where theories differ.",
    )  # fmt: skip
    signals = known.as_signals(errors, ALLOWED.get)
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=[table], **judged(missed))


def _missed(name: str, row: Row, off: float) -> str:
    """What is wrong with a number or with the run it is from."""
    allowed = ALLOWED.get(name)
    if allowed is not None and not off <= max(allowed, row.within / abs(row.reference)):
        return f"{name} is {off:.1e} off, allowed {allowed:.0e}" + ("" if row.status == "OK" else f" ({row.status})")
    though = ", though within what is allowed" if allowed is not None else ""
    return "" if row.status == "OK" else f"{name}: its run is {row.status}{though}"


def _told(name: str, value: float | None) -> str:
    if value is None:
        return ""
    unit = {"pendulum": " rad"}.get(name, " m") if name in ABSOLUTE else ""
    return f"{value:.1e}{unit}"


def figure(result: StudyResult) -> Figure:
    """Error of each number as a point, what is allowed as a bar."""
    names = [name for name in result.metrics if not name.endswith(".wall")]
    return known.figure(result, names, "error: relative; of pendulum and four-bar in rad and m", row=12)
