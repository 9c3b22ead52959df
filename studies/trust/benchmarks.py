"""Published benchmark problems of multibody dynamics, one row each: reference, result, error, run time.

Andrews' squeezing mechanism, the N four-bar through its singular poses, the Princeton beam in its plane, Simeon's flexible slider-crank
and a double pendulum against 40 digits. docs/benchmarks.md tells each problem, its parameters and its source.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, pi
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from buckler.elastica.strip import Load, Strip
from buckler.mbs import Result, simulate
from buckler.mbs.statics import equilibrium
from buckler.studies.kit.cli import main
from buckler.studies.kit.parameters import StudyParameters, choices, quantity
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import subplots
from buckler.studies.trust import benchmark_problems as problems

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Row(NamedTuple):
    """One number of a problem: reference, its own uncertainty (absolute), what was found, in a unit, with a status."""

    reference: float
    within: float
    found: float
    unit: str
    status: str = "OK"


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
ABSOLUTE = ("four_bar_n2.x", "four_bar_n2.y", "pendulum")


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    problems: tuple[str, ...] = choices(
        ("andrews", "four_bar_n2", "princeton", "simeon", "pendulum"),
        ("andrews", "four_bar_n2", "princeton", "simeon", "pendulum"),
        "which are solved",
        "problems",
    )
    accuracy: float = quantity(1e-6, "1", 1e-6, 1e-2, "accuracy asked of runs", "numerics")


def _andrews(p: Parameters) -> dict[str, Row]:
    result = simulate(problems.andrews(), 0.03, p.accuracy)
    return {"andrews.beta": Row(problems.ANDREWS_BETA, 1e-13, _angle(result, "K1", problems.ANDREWS_ANGLES[0]), "rad", result.status)}


def _four_bar(p: Parameters) -> dict[str, Row]:
    result = simulate(problems.four_bars(2), 10.0, p.accuracy)
    x, y = problems.FOUR_BAR_TOP
    found = {"x": result.signals["B0.x"][-1], "y": result.signals["B0.y"][-1]}
    return {
        "four_bar_n2.x": Row(x, 5e-6, float(found["x"]), "m", result.status),
        "four_bar_n2.y": Row(y, 5e-6, float(found["y"]), "m", result.status),
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
    result = simulate(problems.simeon(), 0.1, max(p.accuracy, 1e-4))
    x, y = (float(result.signals[f"A.{axis}"][-1]) for axis in "xy")
    slider = float(result.signals["B.x"][-1])
    return {
        "simeon.slider_crank": Row(problems.SIMEON_SLIDER, 1e-9, slider, "m", result.status),
        "simeon.rod": Row(problems.SIMEON_ROD, 1e-9, atan2(-y, slider - x), "rad", result.status),
    }


def _pendulum(p: Parameters) -> dict[str, Row]:
    result = simulate(problems.double_pendulum(), 5.0, p.accuracy)
    return {"pendulum": Row(problems.DOUBLE_PENDULUM[0], 1e-15, _angle(result, "first", pi / 2), "rad", result.status)}


SOLVE: dict[str, Callable[[Parameters], dict[str, Row]]] = {
    "andrews": _andrews,
    "four_bar_n2": _four_bar,
    "princeton": _princeton,
    "simeon": _simeon,
    "pendulum": _pendulum,
}


def _angle(result: Result, link: str, start: float) -> float:
    """Angle of a link at the end, rad, counted on from the start."""
    return start + float(result.signals[f"{link}.angle"][-1])


def error(name: str, row: Row) -> float:
    """Error of a row as its bar counts it: relative, or absolute for those named `ABSOLUTE`."""
    off = abs(row.found - row.reference)
    return off if name in ABSOLUTE else off / abs(row.reference)


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Solve the problems one after the other."""
    rows: dict[str, Row] = {}
    walls: dict[str, float] = {}
    for problem in progress(parameters.problems, label="problems"):
        start = perf_counter()
        rows |= SOLVE[problem](parameters)
        walls[problem] = perf_counter() - start
    errors = {name: error(name, row) for name, row in rows.items()}
    missed = [
        f"{name} is {errors[name]:.1e} off, allowed {ALLOWED[name]:.0e}" + ("" if row.status == "OK" else f" ({row.status})")
        for name, row in rows.items()
        if name in ALLOWED and not errors[name] <= max(ALLOWED[name], row.within / abs(row.reference))
    ]
    metrics = {
        name: Metric(row.found, row.unit, exact=row.reference, error=errors[name]) for name, row in rows.items()
    } | {f"{name}.wall": Metric(wall, "s") for name, wall in walls.items()}
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
    status = {"status": "SUSPECT", "message": "; ".join(missed)} if missed else {}
    signals = {"error": np.array(list(errors.values())), "allowed": np.array([ALLOWED.get(name, np.nan) for name in rows])}
    return StudyResult(parameters=parameters, metrics=metrics, signals=signals, tables=[table], **status)  # type: ignore[arg-type]


def _told(name: str, value: float | None) -> str:
    if value is None:
        return ""
    unit = {"pendulum": " rad"}.get(name, " m") if name in ABSOLUTE else ""
    return f"{value:.1e}{unit}"


def figure(result: StudyResult) -> Figure:
    """Error of each number as a point, what is allowed as a bar."""
    names = [name for name in result.metrics if not name.endswith(".wall")]
    fig, ax = subplots(height=12 * len(names) + 20)
    places = np.arange(len(names))
    ax.semilogx(np.maximum(result.signals["error"], 1e-16), places, "o", label="found")
    ax.semilogx(result.signals["allowed"], places, "|", color="C3", markersize=14, markeredgewidth=2, label="allowed")
    ax.set_yticks(places, names)
    ax.invert_yaxis()
    ax.set(xlabel="error: relative; of pendulum and four-bar in rad and m")
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return fig


if __name__ == "__main__":
    raise SystemExit(main("benchmarks"))
