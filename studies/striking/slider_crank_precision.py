"""Slider-crank striking its stop: error against run time of each model and tolerance, and of a plain run of the engine.

The main job of the slider-crank study (its default parameters, a beam coupler, one turn of the crank), solved with
error-controlled steps at several tolerances, steps an impact and elements, and by a plain run straight on the engine
with ANCF elements and uniform steps (studies/plain.py). The error of a run is the largest relative one of four numbers,
impact peak, impact impulse, force at 180 degrees and mean force over 150 to 210 degrees, against a finer run: twice the
elements, a thousandth of the smallest tolerance. A plain run with eight times the steps and twice the elements is the
second opinion on that one.

What the paper leaves open is a parameter here too. The exact elastica knows neither gravity in the plane nor a bow: with
gravity, or a bow above the default, the settled force is held against the finer run instead.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan, pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Beam, Cable, Controlled, Exudyn, Mechanism, simulate
from buckler.mbs.geometry import Array
from buckler.mbs.record.errors import Status
from buckler.mbs.sensitivity.curve import spells

from ..kit import work_precision as precision
from ..kit.parameters import counts, integer, quantities, quantity
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import Figure
from ..kit.work_precision import Bar, Point, Runs, Series
from ..trust import plain
from . import impact, impact_models
from . import slider_crank as main_study
from .assumptions import StrikeAssumptions, crank_angle

JOB = main_study.Parameters()
"""The main job."""
TURN = 2 * pi / JOB.speed
"""One turn of the crank, s."""
PLATEAU = np.radians(np.linspace(150, 210, 601))
"""Crank angles at which the pressed slider's force is compared with the exact elastica, rad."""
EXACT = impact.exact_force(JOB, PLATEAU)
"""Force of the exact elastica there, in equilibrium and without friction, N."""
UNTUNED = 1e-6
"""Newton tolerance of the plain run before it is tuned."""
FINER = 1e-3
"""Tolerance of the finer run over the smallest tolerance."""
BARS = {
    "peak_error": Bar("impact peak against the finer run", 1e-2),
    "impulse_error": Bar("impact impulse against the finer run", 1e-2),
    "settled_error": Bar("force at 180 deg against the exact elastica (under gravity or bowed: the finer run)", 1e-3),
    "plateau_error": Bar("force over 150 to 210 deg, likewise", 5e-3),
    "release_error": Bar("release angle against the finer run", 0.05, "deg"),
    "energy_balance": Bar("energy balance", 1e-3),
}
"""What is asked of the chosen run; it is SUSPECT if it misses one."""
SPEEDUPS = {
    "speedup_at_plain_error": Bar("times faster: fastest run no less accurate than the plain run, against it", 4, sign=">="),
    "speedup_at_own_error": Bar("times faster: chosen run, against plain runs as accurate (interpolated)", 4, sign=">="),
}
"""What is asked of run times, which depend on the machine and make no run SUSPECT."""


@dataclass(frozen=True)
class Parameters(StrikeAssumptions):
    """Parameters of the study."""

    imperfection: float = quantity(
        JOB.imperfection, "1", -0.05, 0.05, "bow of the unloaded strip over its length, to the side its inertia bends it",
        "left open",
    )  # fmt: skip
    mass: float = quantity(JOB.mass, "kg", 0.01, 10, "mass of the slider", "left open")
    elements: int = integer(8, 2, 64, "Beam elements of the chosen run; half as many are run too", "numerics")
    tolerance: float = quantity(1e-5, "1", 1e-7, 1e-3, "tolerance of the chosen run", "numerics")
    tolerances: tuple[float, ...] = quantities((1e-4, 1e-5, 1e-6), "1", 1e-7, 1e-3, "tolerances to run", "numerics")
    resolutions: tuple[int, ...] = counts((20, 80, 160), 1, 1000, "steps an impact, more runs", "numerics")
    plain_steps: int = integer(10_000, 1000, 10**6, "steps of the plain run held against", "plain run")
    steps: tuple[int, ...] = counts((2000, 5000, 10_000, 20_000, 40_000), 1000, 10**6, "steps of plain runs", "plain run")
    plain_newton: float = quantity(1e-4, "1", 1e-9, 1e-2, "Newton tolerances of the plain runs, tuned", "plain run")
    repeats: int = integer(5, 1, 1000, "repetitions, taken in turn", "numerics")

    def check(self) -> None:
        """Check that the chosen runs are among those run."""
        for name, value, among in (("tolerance", self.tolerance, self.tolerances), ("plain_steps", self.plain_steps, self.steps)):
            if value not in among:
                raise ValueError(f"{name} = {value:g}: must be one of {', '.join(f'{x:g}' for x in among)}")

    @property
    def job(self) -> main_study.Parameters:
        """The main job under these assumptions."""
        return replace(JOB, **self.shared(main_study.Parameters))

    @property
    def exact(self) -> bool:
        """Whether the exact elastica is what the settled force must be."""
        return not self.gravity and abs(self.imperfection) <= abs(JOB.imperfection)

    def stated(self) -> str:
        """One sentence for a table."""
        return f"{super().stated()}; bow {self.imperfection:g} of the length; slider {self.mass:g} kg"


class PrecisionReading(NamedTuple):
    """What is read off a contact force; nan where the run failed or there was no contact.

    Attributes
    ----------
    peak, impulse : largest force, N, and impulse, N s, from first contact until the force first returns to zero
    settled, mean : force at a crank angle of 180 degrees and its mean over 150 to 210 degrees, N
    release : crank angle at the last sample in contact, deg
    plateau : force at the angles of `PLATEAU`, N, shape (601,)
    """

    peak: float = nan
    impulse: float = nan
    settled: float = nan
    mean: float = nan
    release: float = nan
    plateau: Array = np.full(PLATEAU.size, nan)

    def off(self, other: PrecisionReading) -> dict[str, float]:
        """Relative differences of the four numbers that make the error of a run."""
        return {name: abs(getattr(self, name) / getattr(other, name) - 1) for name in self._fields[:4]}

    def plateau_error(self, standard: Array = EXACT) -> float:
        """Largest relative deviation over 150 to 210 degrees."""
        return float(np.abs(self.plateau / standard - 1).max())


@dataclass(frozen=True)
class ReadRun:
    """Reading of a run, with its status and work."""

    reading: PrecisionReading
    status: str
    work: Mapping[str, float]
    energy_balance: float = nan


def read(time: Array, force: Array, angle: Array | None = None) -> PrecisionReading:
    """Read a contact force, N, over times, s, and crank angles, rad (by default at the job's speed), of the first turn."""
    angle = JOB.speed * time if angle is None else angle
    turn = angle <= 2 * pi * (1 + 1e-9)
    time, force, angle = time[turn], force[turn], angle[turn]
    contacts = spells(force)
    if not len(contacts):
        return PrecisionReading()
    pulse = slice(max(contacts[0, 0] - 1, 0), contacts[0, 1] + 1)
    plateau = np.interp(PLATEAU, angle, force)
    return PrecisionReading(
        peak=float(force[pulse].max()),
        impulse=float(np.trapezoid(force[pulse], time[pulse])),
        settled=float(np.interp(pi, PLATEAU, plateau)),
        mean=float(np.trapezoid(plateau, PLATEAU) / np.ptp(PLATEAU)),
        release=float(np.degrees(angle[contacts[-1, 1] - 1])),
        plateau=plateau,
    )


def with_coupler(kind: type[Beam] | type[Cable], elements: int, job: main_study.Parameters = JOB) -> Mechanism:
    """The mechanism of the job, its coupler of that kind."""
    return impact_models.mechanism(kind, replace(job, elements=elements), job.stop_stiffness, job.speed)


def duration(mechanism: Mechanism) -> float:
    """Time in which the crank surely turns once, s."""
    return StrikeAssumptions(motor=float(not mechanism.drives)).lasts(TURN)


def simulated(mechanism: Mechanism, tolerance: float, ledger: bool = False, **steps: Any) -> ReadRun:
    """One turn with error-controlled steps."""
    solver = Exudyn(Controlled(tolerance, **steps))
    result = simulate(mechanism, duration(mechanism), solver=solver, ledger=ledger)
    ended = result.status in (Status.OK, Status.SUSPECT)
    reading = read(result.time, result.signals["B.contact_force"], crank_angle(result.signals)) if ended else PrecisionReading()
    return ReadRun(reading, result.status, result.work, result.energy_balance)


def plainly(mechanism: Mechanism, steps: int, newton: float) -> ReadRun:
    """One turn by a plain run in uniform steps."""
    found = plain.slider_crank(mechanism, duration(mechanism), steps, newton)
    reading = read(found.x, found.force, found.angle) if found.x.size else PrecisionReading()
    return ReadRun(reading, found.message or "OK", found.work)


def _our_runs(p: Parameters) -> Runs:
    """Runs by model and setting: tolerances, and for the chosen one also steps an impact."""
    made = {
        f"{kind.__name__} x {n}": with_coupler(kind, n, p.job)
        for kind, n in ((Beam, max(2, p.elements // 2)), (Beam, p.elements), (Cable, p.elements))
    }
    chosen = f"Beam x {p.elements}"
    found = {name: precision.by_tolerance(partial(simulated, each), p.tolerances) for name, each in made.items()}
    found[f"{chosen}, steps an impact"] = {
        f"{n:g}": partial(simulated, made[chosen], p.tolerance, contact_resolution=n) for n in sorted(p.resolutions)
    }
    return found


def _plain_runs(p: Parameters) -> Runs:
    """Plain runs by model and steps: tuned, tuned with twice the elements, not tuned."""
    coarse, fine = with_coupler(Cable, p.elements, p.job), with_coupler(Cable, 2 * p.elements, p.job)

    def by_steps(made: Mechanism, newton: float, steps: Sequence[int]) -> Mapping[str, Callable[[], ReadRun]]:
        return precision.by_steps(lambda n: plainly(made, n, newton), steps)

    return {
        f"plain ANCF x {p.elements}": by_steps(coarse, p.plain_newton, p.steps),
        f"plain ANCF x {2 * p.elements}": by_steps(fine, p.plain_newton, sorted(p.steps)[-2:]),
        f"plain, Newton {precision.power(UNTUNED)}": by_steps(coarse, UNTUNED, [p.plain_steps]),
    }


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run the references, then every variant once for its reading, then all of them in turn for their times."""
    reference = simulated(with_coupler(Beam, 2 * p.elements, p.job), FINER * min(p.tolerances)).reading
    second = plainly(with_coupler(Cable, 2 * p.elements, p.job), 8 * p.plain_steps, UNTUNED).reading
    chosen = simulated(with_coupler(Beam, p.elements, p.job), p.tolerance, ledger=True)
    ours, theirs = _our_runs(p), _plain_runs(p)
    runs = {**ours, **theirs}
    found = precision.outcomes(runs)
    series = precision.measure(runs, lambda outcome: max(outcome.reading.off(reference).values()), p.repeats, progress)
    mine, plains = ({name: series[name] for name in part} for part in (ours, theirs))
    times, sentence = _compare(p, mine, plains)
    metrics = _reading_metrics(p, chosen, reference, second) | times
    wrong = precision.missed(BARS, metrics)
    baseline = plains[f"plain ANCF x {p.elements}"][precision.thousands(p.plain_steps)]
    return StudyResult(
        parameters=p,
        metrics=metrics,
        signals=precision.as_signals(series),
        tables=[
            _runs_table(series, baseline, found, reference, f"{sentence}\n{p.stated()}.\n{precision.footnote(p)}"),
            precision.bars_table(BARS | SPEEDUPS, metrics, "asked of the chosen run"),
        ],
        **judged([f"the chosen run misses its bars: {', '.join(wrong)}"] if wrong else [], sentence),
    )


def _reading_metrics(p: Parameters, chosen: ReadRun, reference: PrecisionReading, second: PrecisionReading) -> dict[str, Metric]:
    """What the chosen run reads, and how far it is off."""
    found, off = chosen.reading, chosen.reading.off(reference)
    standard = EXACT if p.exact else reference.plateau
    settled = float(np.interp(pi, PLATEAU, standard))
    return {
        "peak": Metric(found.peak, "N", error=off["peak"]),
        "impulse": Metric(found.impulse, "N.s", error=off["impulse"]),
        "settled": Metric(found.settled, "N", exact=settled if p.exact else None),
        "mean": Metric(found.mean, "N", error=off["mean"]),
        "release": Metric(found.release, "deg"),
        "peak_error": Metric(off["peak"], "1"),
        "impulse_error": Metric(off["impulse"], "1"),
        "settled_error": Metric(abs(found.settled / settled - 1), "1"),
        "plateau_error": Metric(found.plateau_error(standard), "1"),
        "release_error": Metric(abs(found.release - reference.release), "deg"),
        "energy_balance": Metric(chosen.energy_balance, "1"),
        "references_differ": Metric(max(second.off(reference).values()), "1"),
        "references_differ_release": Metric(abs(second.release - reference.release), "deg"),
    }


def _compare(p: Parameters, ours: Series, theirs: Series) -> tuple[dict[str, Metric], str]:
    """The chosen run, and the fastest that is no less accurate, against plain runs: numbers and sentences."""
    chosen = ours[f"Beam x {p.elements}"][precision.power(p.tolerance)]
    tuned, twice, untuned = theirs.values()
    key = precision.thousands(p.plain_steps)
    equal = precision.fastest(precision.points_of(ours), tuned[key].error)
    as_accurate = precision.time_for([*tuned.values(), *twice.values()], chosen.error)
    metrics = {
        "error": Metric(chosen.error, "1"),
        "time": Metric(chosen.wall_s, "s"),
        "plain_error": Metric(tuned[key].error, "1"),
        "plain_time": Metric(tuned[key].wall_s, "s"),
        "speedup": Metric(chosen.speedup(tuned[key]), "1"),
        "speedup_not_tuned": Metric(chosen.speedup(untuned[key]), "1"),
        "speedup_at_plain_error": Metric(equal.speedup(tuned[key]) if equal else nan, "1"),
        "speedup_at_plain_error_not_tuned": Metric(equal.speedup(untuned[key]) if equal else nan, "1"),
        "speedup_at_own_error": Metric(as_accurate / chosen.wall_s, "1"),
    }
    pair = dict.fromkeys(filter(None, (chosen, equal)))
    return metrics, " ".join(precision.verdict(point, tuned[key]) for point in pair)


def _runs_table(
    series: Series, baseline: Point, found: Mapping[str, Mapping[str, ReadRun]], reference: PrecisionReading, notes: str
) -> Table:
    rows: list[list[Any]] = [["finer run", "", None, *_numbers(reference), None, None, None, ""]]
    for name, part in series.items():
        for setting, point in part.items():
            one = found[name][setting]
            wall = [1e3 * point.wall_s, f"{point.speedup(baseline):.2f}", one.work.get("steps")]
            rows.append([name, setting, point.error, *_numbers(one.reading), *wall, precision.mark(point, one.status)])
    headers = [
        "model", "setting", "relative error", "peak [N]", "impulse [N s]", "F(180) [N]", "plateau off", "release [deg]",
        "time [ms]", "plain/time", "steps", "front",
    ]  # fmt: skip
    notes = f"plateau off: largest deviation from the exact elastica over 150 to 210 deg.\n{notes}"
    return Table(headers, rows, f"Slider-crank, one turn at {JOB.speed:g} rad/s", notes)


def _numbers(reading: PrecisionReading) -> list[float]:
    return [reading.peak, reading.impulse, reading.settled, reading.plateau_error(), reading.release]


def figure(result: StudyResult) -> Figure:
    """Error over run time of every series."""
    label = "largest relative error of peak, impulse,\nforce at 180° and mean force"
    return precision.figure_of(result.signals, label)[0]
