"""Slider-crank striking its stop: error against run time of each model and tolerance, and of a plain run of the engine.

The main job of the slider-crank study (its default parameters, a beam coupler, one turn of the crank), solved with
error-controlled steps at several tolerances and elements, and by a plain run straight on the engine with ANCF elements and
uniform steps (studies/plain.py). The error of a run is the largest relative one of four numbers, impact peak, impact
impulse, force at 180 degrees and mean force over 150 to 210 degrees, against a finer run: twice the elements, a hundredth
of the smallest tolerance. A plain run with ten times the steps and twice the elements is the second opinion on that one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isfinite, nan, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from elastica import pinned
from mbs import Beam, Cable, GuideFriction, Mechanism, Solver, simulate, slider_crank
from mbs.laws import CarvalhoMartins
from mbs.library import PAPER, PAPER_STOP
from mbs.precision import Point, fastest, verdict, work_precision
from mbs.result import Status
from studies import plain
from studies import slider_crank as main_study
from studies.cli import main
from studies.contact_force_table import Press
from studies.parameters import StudyParameters, integer, quantities, quantity
from studies.report import QUIET, Metric, Progress, StudyResult, Table
from studies.static_precision import as_signals, draw, footnote
from studies.style import subplots

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = np.ndarray[Any, Any]
JOB = main_study.Parameters()
"""The main job."""
TURN = 2 * pi / JOB.speed
"""One turn of the crank, s."""
PLATEAU = np.radians(np.linspace(150, 210, 601))
"""Crank angles at which the pressed slider's force is held against the exact elastica, rad."""
EXACT = Press(JOB.thickness, PAPER_STOP).force(pinned.load, PLATEAU)
"""Force of the exact elastica there, in equilibrium and without friction, N."""
UNTUNED = 1e-6
"""Newton tolerance of the plain run before it is tuned."""
BARS = {
    "peak_error": (1e-2, "1", "impact peak against the finer run"),
    "impulse_error": (1e-2, "1", "impact impulse against the finer run"),
    "settled_error": (1e-3, "1", "force at 180 deg against the exact elastica"),
    "plateau_error": (5e-3, "1", "force over 150 to 210 deg against the exact elastica"),
    "release_error": (0.05, "deg", "release angle against the finer run"),
    "energy_balance": (1e-3, "1", "energy balance"),
}
"""What is asked of the chosen run, its unit and meaning."""
SPEEDUP_BAR = 4.0
"""Times faster than the plain run at no larger error."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    elements: int = integer(8, 2, 64, "Beam elements of the chosen run; half as many are run too", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-7, 1e-3, "tolerance of the chosen run", "numerics")
    tolerances: tuple[float, ...] = quantities((1e-4, 1e-5, 1e-6), "1", 1e-7, 1e-3, "tolerances to run", "numerics")
    plain_steps: int = integer(10_000, 1000, 10**6, "steps of the plain run held against", "plain run")
    steps: tuple[float, ...] = quantities((2e3, 5e3, 1e4, 2e4, 4e4), "1", 1e3, 1e6, "steps of all plain runs", "plain run")
    plain_newton: float = quantity(1e-4, "1", 1e-9, 1e-2, "Newton tolerances of the plain runs, tuned", "plain run")
    repeats: int = integer(5, 1, 1000, "repetitions, taken in turn", "numerics")

    def check(self) -> None:
        """Check that the chosen runs are among those run."""
        for name, value, among in (
            ("tolerance", self.tolerance, self.tolerances),
            ("plain_steps", self.plain_steps, self.steps),
        ):
            if value not in among:
                raise ValueError(f"{name} = {value:g}: must be one of {', '.join(f'{x:g}' for x in among)}")
        if any(x != int(x) for x in self.steps):
            raise ValueError(f"steps = {','.join(f'{x:g}' for x in self.steps)}: must be whole numbers")


class Reading(NamedTuple):
    """What is read off a contact force; nan where the run failed or there was no contact.

    Attributes
    ----------
    peak, impulse : float
        Largest force, N, and impulse, N s, from first contact until the force first returns to zero.
    settled, mean : float
        Force at a crank angle of 180 degrees and its mean over 150 to 210 degrees, N.
    plateau_error : float
        Largest relative deviation from the exact elastica over 150 to 210 degrees.
    release : float
        Crank angle at the last sample in contact, deg.
    """

    peak: float = nan
    impulse: float = nan
    settled: float = nan
    mean: float = nan
    plateau_error: float = nan
    release: float = nan

    def off(self, other: Reading) -> dict[str, float]:
        """Relative differences of the four numbers that make the error of a run."""
        return {name: abs(getattr(self, name) / getattr(other, name) - 1) for name in self._fields[:4]}


@dataclass(frozen=True)
class Outcome:
    """Reading of a run, with its status and work."""

    reading: Reading
    status: str
    work: Mapping[str, float]
    energy_balance: float = nan


def read(time: Array, force: Array) -> Reading:
    """Read a contact force, N, sampled at times, s, over one turn."""
    touching = np.flatnonzero(force > 0)
    if not touching.size:
        return Reading()
    first = touching[0]
    free = np.flatnonzero(force[first:] <= 0)
    strike = slice(max(first - 1, 0), first + free[0] + 1 if free.size else None)
    plateau = np.interp(PLATEAU, JOB.speed * time, force)
    return Reading(
        peak=float(force[strike].max()),
        impulse=float(np.trapezoid(force[strike], time[strike])),
        settled=float(np.interp(pi, PLATEAU, plateau)),
        mean=float(np.trapezoid(plateau, PLATEAU) / np.ptp(PLATEAU)),
        plateau_error=float(np.abs(plateau / EXACT - 1).max()),
        release=float(np.degrees(JOB.speed * time[touching[-1]])),
    )


# --- the runs ---------------------------------------------------------------------------------------------------------


def with_coupler(kind: type[Beam] | type[Cable], elements: int) -> Mechanism:
    """The mechanism of the main job, its coupler of that kind."""
    section = JOB.section.damped(JOB.damping, PAPER.coupler)
    return slider_crank(
        kind(section, elements=elements, imperfection=JOB.imperfection * PAPER.coupler),
        law=CarvalhoMartins(JOB.stop_stiffness, JOB.restitution, exponent=1.0),
        mass=JOB.mass,
        speed=JOB.speed,
        friction=GuideFriction(JOB.friction_force),
    )


def simulated(mechanism: Mechanism, tolerance: float, ledger: bool = False) -> Outcome:
    """One turn with error-controlled steps."""
    result = simulate(mechanism, TURN, solver=Solver(tolerance=tolerance), ledger=ledger)
    ended = result.status in (Status.OK, Status.SUSPECT)
    reading = read(result.time, result.signals["B.contact_force"]) if ended else Reading()
    return Outcome(reading, result.status, result.work, result.energy_balance)


def plainly(mechanism: Mechanism, steps: float, newton: float) -> Outcome:
    """One turn by a plain run in uniform steps."""
    found = plain.slider_crank(mechanism, TURN, int(steps), newton)
    return Outcome(read(found.x, found.force) if found.x.size else Reading(), found.message or "OK", found.work)


def _variants(p: Parameters) -> Mapping[str, Mapping[str, Callable[[], Outcome]]]:
    """Runs by series and setting."""
    half = max(2, p.elements // 2)
    ours = {
        f"Beam x {half}": with_coupler(Beam, half),
        f"Beam x {p.elements}": with_coupler(Beam, p.elements),
        f"Cable x {p.elements}": with_coupler(Cable, p.elements),
    }
    theirs = with_coupler(Cable, p.elements)
    found: dict[str, dict[str, Callable[[], Outcome]]] = {
        name: {_power(tol): lambda m=m, tol=tol: simulated(m, tol) for tol in sorted(p.tolerances, reverse=True)}
        for name, m in ours.items()
    }
    tuned, untuned = _plain_names(p)
    found[tuned] = {_thousands(n): lambda n=n: plainly(theirs, n, p.plain_newton) for n in sorted(p.steps)}
    found[untuned] = {_thousands(p.plain_steps): lambda: plainly(theirs, p.plain_steps, UNTUNED)}
    return found


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run the references, then every variant once for its reading, then all of them in turn for their times."""
    p = parameters
    reference = simulated(with_coupler(Beam, 2 * p.elements), min(p.tolerances) / 100).reading
    second = plainly(with_coupler(Cable, 2 * p.elements), 10 * p.plain_steps, UNTUNED).reading
    chosen = simulated(with_coupler(Beam, p.elements), p.tolerance, ledger=True)
    variants = _variants(p)
    runs = {f"{series}, {setting}": call for series, calls in variants.items() for setting, call in calls.items()}
    outcomes = {name: call() for name, call in runs.items()}  # untimed: the first call of anything is slow
    points = work_precision(
        runs,
        lambda outcome: max(outcome.reading.off(reference).values()),
        p.repeats,
        progress=lambda names: progress(names, label="runs"),
    )
    by_name = {point.name: point for point in points}
    series = {name: {key: by_name[f"{name}, {key}"] for key in calls} for name, calls in variants.items()}
    metrics = _reading_metrics(chosen, reference, second) | _time_metrics(p, series)
    sentence = _verdicts(p, series)
    missed = [f"{name} = {metrics[name].value:.2g}" for name, (bar, *_) in BARS.items() if not metrics[name].value <= bar]
    checks = {"status": "SUSPECT", "message": f"misses its bar: {', '.join(missed)}"} if missed else {"message": sentence}
    signals = {f"{name}.setting": np.array([*part]) for name, part in series.items()}
    return StudyResult(
        parameters=p,
        metrics=metrics,
        signals=signals | as_signals({name: [*part.values()] for name, part in series.items()}),
        tables=[_runs_table(p, series, outcomes, reference, f"{sentence}\n{footnote(p)}"), _bars_table(metrics)],
        **checks,
    )


# --- what is reported -------------------------------------------------------------------------------------------------

Series = Mapping[str, Mapping[str, Point]]


def _plain_names(p: Parameters) -> tuple[str, str]:
    """Series of the plain runs, tuned and not."""
    return f"plain ANCF x {p.elements}", f"plain, Newton {UNTUNED:.0e}"


def _baselines(p: Parameters, series: Series) -> list[Point]:
    """The plain run held against, tuned and not."""
    return [series[name][_thousands(p.plain_steps)] for name in _plain_names(p)]


def _thousands(steps: float) -> str:
    return f"{steps / 1000:g}k"


def _ours(p: Parameters, series: Series) -> list[Point]:
    return [point for name, part in series.items() if name not in _plain_names(p) for point in part.values()]


def _verdicts(p: Parameters, series: Series) -> str:
    """The chosen run, and the fastest that is no less accurate, against the plain run."""
    baseline, _ = _baselines(p, series)
    chosen = series[f"Beam x {p.elements}"][_power(p.tolerance)]
    pair = dict.fromkeys(filter(None, (chosen, fastest(_ours(p, series), baseline.error))))
    return " ".join(verdict(point, baseline) for point in pair)


def _power(tolerance: float) -> str:
    return f"{tolerance:.0e}"


def _reading_metrics(chosen: Outcome, reference: Reading, second: Reading) -> dict[str, Metric]:
    """What the chosen run reads, and how far it is off."""
    found, off = chosen.reading, chosen.reading.off(reference)
    exact = float(np.interp(pi, PLATEAU, EXACT))
    return {
        "peak": Metric(found.peak, "N", error=off["peak"]),
        "impulse": Metric(found.impulse, "N.s", error=off["impulse"]),
        "settled": Metric(found.settled, "N", exact=exact),
        "mean": Metric(found.mean, "N", error=off["mean"]),
        "release": Metric(found.release, "deg"),
        "peak_error": Metric(off["peak"], "1"),
        "impulse_error": Metric(off["impulse"], "1"),
        "settled_error": Metric(abs(found.settled / exact - 1), "1"),
        "plateau_error": Metric(found.plateau_error, "1"),
        "release_error": Metric(abs(found.release - reference.release), "deg"),
        "energy_balance": Metric(chosen.energy_balance, "1"),
        "references_differ": Metric(max(second.off(reference).values()), "1"),
        "references_differ_release": Metric(abs(second.release - reference.release), "deg"),
    }


def _time_metrics(p: Parameters, series: Series) -> dict[str, Metric]:
    """Times of the chosen run and how many times faster it is than the plain ones; nan if none is so accurate."""
    chosen = series[f"Beam x {p.elements}"][_power(p.tolerance)]
    tuned, untuned = _baselines(p, series)
    equal = fastest(_ours(p, series), tuned.error)
    rival = fastest(series[_plain_names(p)[0]].values(), chosen.error)
    return {
        "error": Metric(chosen.error, "1"),
        "time": Metric(chosen.wall_s, "s"),
        "plain_error": Metric(tuned.error, "1"),
        "plain_time": Metric(tuned.wall_s, "s"),
        "speedup": Metric(chosen.speedup(tuned), "1"),
        "speedup_not_tuned": Metric(chosen.speedup(untuned), "1"),
        "speedup_at_plain_error": Metric(equal.speedup(tuned) if equal else nan, "1"),
        "speedup_at_plain_error_not_tuned": Metric(equal.speedup(untuned) if equal else nan, "1"),
        "speedup_at_own_error": Metric(chosen.speedup(rival) if rival else nan, "1"),
    }


def _runs_table(
    p: Parameters, series: Series, outcomes: Mapping[str, Outcome], reference: Reading, notes: str
) -> Table:
    baseline, _ = _baselines(p, series)
    rows: list[list[Any]] = [["finer run", "", None, *_numbers(reference), None, None, None, ""]]
    for name, part in series.items():
        for setting, point in part.items():
            found = outcomes[point.name]
            numbers = _numbers(found.reading) if isfinite(point.error) else [found.status, *[None] * 4]
            wall = [f"{1e3 * point.wall_s:.4g}", f"{point.speedup(baseline):.2f}", found.work.get("steps")]
            rows.append([name, setting, point.error, *numbers, *wall, "*" if point.front else ""])
    headers = [
        "model", "setting", "error", "peak [N]", "impulse [N s]", "F(180) [N]", "150-210 deg off exact", "release [deg]",
        "time [ms]", "plain/time", "steps", "front",
    ]  # fmt: skip
    return Table(headers, rows, "Slider-crank, one turn at 1.25 rad/s", notes)


def _numbers(reading: Reading) -> list[Any]:
    return [reading.peak, reading.impulse, reading.settled, f"{reading.plateau_error:.1e}", reading.release]


def _bars_table(metrics: Mapping[str, Metric]) -> Table:
    """What was asked of the chosen run and what it does."""
    rows = [
        [meaning, f"{metrics[name].value:.2g}", unit, f"<= {bar:g}", metrics[name].value <= bar]
        for name, (bar, unit, meaning) in BARS.items()
    ]
    for name in ("speedup_at_plain_error", "speedup_at_plain_error_not_tuned"):
        value = metrics[name].value
        rows.append([name.replace("_", " "), f"{value:.2g}", "1", f">= {SPEEDUP_BAR:g}", value >= SPEEDUP_BAR])
    return Table(["asked", "found", "unit", "bar", "reached"], [[*r[:4], "yes" if r[4] else "no"] for r in rows])


def figure(result: StudyResult) -> Figure:
    """Error over run time of every series."""
    names = [name.removesuffix(".setting") for name in result.signals if name.endswith(".setting")]
    fig, ax = subplots(height=110)
    marks = {name: result.signals[f"{name}.setting"] for name in names}
    draw(ax, result.signals, {name: name for name in names}, marks, "tolerance, or steps")
    ax.set(ylabel="largest relative error of peak, impulse,\nforce at 180° and mean force")
    return fig


if __name__ == "__main__":
    raise SystemExit(main("slider-crank-precision"))
