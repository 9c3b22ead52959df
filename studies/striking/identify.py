"""Which cause explains the impact forces that were measured: 27 N at 1.25 rad/s, 25 N at 2.5 V, 30 N at 3 V, no more at 4.4 V?

A stop of unknown stiffness alone, or with a bow of the strip, gravity in the plane, a DC motor that gives way, a voltage below
which the motor stands still, a compliant drive, or two of these. Each is held against the readings with an error of 1 N; 44.18 N
at 4.4 V is the range of the sensor, which a force did not exceed. Strikes are simulated on a grid and interpolated; then, twice
by default, strikes are simulated where the posteriors lie and correct the interpolation there, and at last others tell how far
it is still off. The best point of every hypothesis is simulated once more. Then: which further reading would tell them apart?

References
----------
B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from buckler.studies.kit.parameters import StudyParameters, choice, choices, integer, quantity, text
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import COLOURS, Figure, subplots
from buckler.studies.striking.emulator import FIELDS, GRAVITY, RANGES, Emulator, grids
from buckler.studies.striking.evidence import (
    BOW,
    CAUSES,
    DEAD_BAND,
    READINGS,
    Hypothesis,
    Posterior,
    crank_speed,
    hypotheses,
    information,
    posterior,
    predicted,
    probabilities,
    where,
)
from buckler.studies.striking.strike import Parameters as Strike
from buckler.studies.sweeping.sweep import sweep

Array = np.ndarray[Any, Any]
NAMES = ("f125", "v25", "v30", "v44")
"""Of the readings in metrics."""
FURTHER = {
    "pulse": ("duration of the first impact at 1.25 rad/s", 5e-4, "s"),
    "torque": ("largest torque on the crank at 1.25 rad/s", 0.05, "N.m"),
    "between": ("time from the first impact to the next at 1.25 rad/s", 2e-3, "s"),
    "force_180": ("force at the dead centre at 1.25 rad/s", 0.02, "N"),
    "peak": ("impact force at 4.4 V, by a larger sensor", 1.0, "N"),
}
"""Readings that could still be taken, each with its error."""
DOUBTFUL = 4.0
"""N: how far a strike at the best point may be from the posterior's mean before the emulator is doubted there."""
EXACT = 0.02
"""Relative error of the interpolation above which evidence is told as a span."""
UNREFINED = 0.03
"""Relative error of the interpolation before it is known."""
LONGEST = 12.0
"""Difference of log evidence at which a bar ends."""
WITHIN = 1.0
"""N: how near a force must come to count as explained."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    reading_error: float = quantity(1.0, "N", 0.01, 10, "standard deviation of a force that was read", "readings")
    reference_voltage: float = quantity(2.7, "V", 2.55, 12, "voltage at which the crank turns at 1.25 rad/s", "readings")
    causes: tuple[str, ...] = choices(CAUSES, CAUSES, "causes beside the stop's stiffness", "hypotheses")
    pairs: str = choice("yes", ("yes", "no"), "whether pairs of causes are hypotheses, too", "hypotheses")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    stiffnesses: int = integer(7, 4, 40, "values of the stop's stiffness that are simulated", "emulator")
    speeds: int = integer(5, 4, 40, "speeds of the crank that are simulated", "emulator")
    bows: int = integer(5, 2, 40, "bows of the strip that are simulated", "emulator")
    others: int = integer(4, 2, 40, "motors and compliances that are simulated", "emulator")
    rounds: int = integer(2, 0, 20, "corrections by strikes where the posteriors lie", "emulator")
    refined: int = integer(6, 1, 1000, "samples of every posterior that a correction simulates, each at all readings", "emulator")
    held_out: int = integer(4, 0, 1000, "samples that the corrected interpolation is held against", "emulator")
    points: int = integer(2048, 16, 2**20, "Sobol' points of each of 8 sets over the priors, a power of two", "numerics")
    samples: int = integer(400, 10, 10**5, "samples of each posterior", "numerics")
    seed: int = integer(0, 0, 2**31 - 1, "draws the points", "numerics")
    workers: int = integer(2, 0, 256, "processes, 0 for none but this", "numerics")
    strikes_store: str = text("results/identify-strikes.sqlite", "file of the simulated strikes; none: memory only", "numerics")

    @property
    def hypotheses(self) -> list[Hypothesis]:
        """Those that are weighed."""
        return hypotheses(tuple(c for c in CAUSES if c in self.causes), self.pairs == "yes")

    def check(self) -> None:
        """Points are a power of two."""
        if self.points & (self.points - 1):
            raise ValueError(f"points = {self.points}: must be a power of two")


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Simulate the grid, weigh every hypothesis, simulate its best point, look for readings that would tell them apart."""
    p = parameters
    store = Path(p.strikes_store) if p.strikes_store else None
    if store:
        store.parent.mkdir(parents=True, exist_ok=True)
    wanted = grids(p.causes, p.pairs == "yes", p.stiffnesses, p.speeds, p.bows, p.others)
    emulator = Emulator(wanted, p.workers, store, progress, mass=p.mass)
    found, errors = _posteriors(emulator, p, progress)
    spans = _spans(emulator, p, found, errors)
    engine = at_best(p, found, progress)
    told = _further(emulator, p, found)
    metrics = _metrics(found, engine, told) | {
        "emulator.error": Metric(float(np.mean(list(errors.values()))), "1"),
        **{f"emulator.{name}.error": Metric(float(error), "1") for name, error in errors.items()},
        "emulator.worst": Metric(float(max(errors.values())), "1"),
        "emulator.failed": Metric(float(emulator.failed), "1"),
        **{f"{name}.log_evidence.{end}": Metric(x, "1") for name, span in spans.items()
           for end, x in zip(("low", "high"), span, strict=True)},
    }  # fmt: skip
    suspect = f"EMULATOR: {emulator.failed} of {emulator.runs} strikes failed" if emulator.failed > 0.01 * emulator.runs else ""
    return StudyResult(
        parameters=p,
        status="SUSPECT" if suspect else "OK",
        message=suspect,
        metrics=metrics,
        signals={f"{each.hypothesis.name}.forces": each.forces for each in found},
        work={"strikes": emulator.runs},
        tables=[_table(found, engine, errors, spans, p), _further_table(told)],
    )


def _posteriors(emulator: Emulator, p: Parameters, progress: Progress) -> tuple[list[Posterior], dict[str, float]]:
    """Posteriors of all hypotheses on an interpolation that was corrected where they lie, and its error there for each."""
    numerics: dict[str, Any] = {"points": p.points, "samples": p.samples, "sd": p.reading_error, "seed": p.seed}

    def weighed(errors: Mapping[str, float]) -> list[Posterior]:
        return [
            posterior(emulator, h, model_error=errors[h.name], reference=p.reference_voltage, **numerics) for h in p.hypotheses
        ]

    errors = dict.fromkeys((h.name for h in p.hypotheses), UNREFINED)
    found = weighed(errors)
    for k in range(p.rounds):
        emulator.refine(_gathered(where(each, p.refined, p.reference_voltage, p.seed + k) for each in found), progress)
        found = weighed(errors)
    if p.held_out:
        wanted = [where(each, p.held_out, p.reference_voltage, p.seed + 100) for each in found]
        off = emulator.off(_gathered(wanted), progress)
        place = {table: iter(values) for table, values in off.items()}
        for each, some in zip(found, wanted, strict=True):
            errors[each.hypothesis.name] = float(np.sqrt(np.nanmean([next(place[table]) ** 2 for table, _ in some])))
        found = weighed(errors)
    return found, errors


def _spans(
    emulator: Emulator, p: Parameters, found: Sequence[Posterior], errors: Mapping[str, float]
) -> dict[str, tuple[float, float]]:
    """Log evidence from none to twice the interpolation's error, of hypotheses where that is more than `EXACT`."""
    numerics: dict[str, Any] = {"points": p.points, "samples": p.samples, "sd": p.reading_error, "seed": p.seed}
    spans = {}
    for each in found:
        h, error = each.hypothesis, errors[each.hypothesis.name]
        if error > EXACT:
            others = [posterior(emulator, h, model_error=e, reference=p.reference_voltage, **numerics) for e in (0.0, 2 * error)]
            logs = [each.log_evidence, *(other.log_evidence for other in others)]
            spans[h.name] = (min(logs), max(logs))
    return spans


def _gathered(some: Iterable[Sequence[tuple[str, dict[str, float]]]]) -> dict[str, list[dict[str, float]]]:
    """Points by table, in their order."""
    found: dict[str, list[dict[str, float]]] = {}
    for table, point in (pair for each in some for pair in each):
        found.setdefault(table, []).append(point)
    return found


def at_best(p: Parameters, found: Sequence[Posterior], progress: Progress) -> Array:
    """Forces simulated at every hypothesis's best point, N, shape (hypotheses, readings)."""
    cases = []
    for each in found:
        best = dict(each.best)
        gravity = GRAVITY[{-1.0: "-y", 1.0: "+y"}.get(best.pop("gravity", 0.0), "")]
        dead_band = best.pop("dead_band", 0.0)
        given: dict[str, Any] = {FIELDS.get(name, name): value for name, value in best.items()}
        for reading in READINGS:
            speed = float(crank_speed(reading.voltage, dead_band, p.reference_voltage))
            cases.append(Strike(**given | gravity, speed=speed, mass=p.mass))
    alone = list(dict.fromkeys(cases))
    rows = sweep("strike", alone, workers=p.workers, progress=progress)
    forces = {case: row.value("peak") for case, row in zip(alone, rows, strict=True)}
    return np.array([forces[case] for case in cases], dtype=float).reshape(len(found), len(READINGS))


def _further(emulator: Emulator, p: Parameters, found: Sequence[Posterior]) -> dict[str, float]:
    """Expected information of each further reading, bits."""
    weights, bits = probabilities(found), {}
    for what, (_, sd, _) in FURTHER.items():
        voltage = 4.4 if what == "peak" else None
        readings = [predicted(emulator, each.values, voltage, p.reference_voltage, what) for each in found]
        bits[what] = information(readings, weights, sd, p.seed)
    return bits


def _metrics(found: Sequence[Posterior], engine: Array, told: Mapping[str, float]) -> dict[str, Metric]:
    """Of every hypothesis: evidence, probability, forces over its posterior and at its best point; of readings: bits."""
    metrics: dict[str, Metric] = {}
    for each, chance, simulated in zip(found, probabilities(found), engine, strict=True):
        name = each.hypothesis.name
        metrics[f"{name}.log_evidence"] = Metric(each.log_evidence, "1", error=abs(each.error / each.log_evidence))
        metrics[f"{name}.probability"] = Metric(float(chance), "1")
        for what, reading, forces, checked in zip(NAMES, READINGS, each.forces, simulated, strict=True):
            known = None if reading.bound else reading.force
            metrics[f"{name}.{what}"] = Metric(float(forces.mean()), "N", known)
            metrics[f"{name}.best.{what}"] = Metric(float(checked), "N", known)
        metrics |= {f"{name}.best.{axis}": Metric(value, _unit(axis)) for axis, value in each.best.items()}
    return metrics | {f"{what}.information": Metric(bits, "bit") for what, bits in told.items()}


def _unit(axis: str) -> str:
    """Of an unknown."""
    return {"stop_stiffness": "N/m", "dead_band": "V", "motor": "N.m.s", "compliance": "rad/(N.m)"}.get(axis, "1")


# --- tables -----------------------------------------------------------------------------------------------------------


def _words(name: str) -> str:
    """Of a hypothesis."""
    return name.replace("dead_band", "dead band").replace("_", " + ")


def _explains(simulated: Array) -> bool:
    """Whether the best point is within 1 N of all readings and below the bound."""
    off = [force - reading.force for reading, force in zip(READINGS, simulated, strict=True)]
    return all(x <= WITHIN and (reading.bound or x >= -WITHIN) for reading, x in zip(READINGS, off, strict=True))


def _table(
    found: Sequence[Posterior],
    engine: Array,
    errors: Mapping[str, float],
    spans: Mapping[str, tuple[float, float]],
    p: Parameters,
) -> Table:
    """One row a hypothesis, the likeliest first."""
    rows = []
    chances = probabilities(found)
    for k in np.argsort(-chances):
        each, simulated = found[k], engine[k]
        best = ", ".join(f"{axis.replace('_', ' ')} {value:.3g}" for axis, value in each.best.items())
        forces = [f"{mean:.1f} ({checked:.1f})" for mean, checked in zip(each.forces.mean(axis=1), simulated, strict=True)]
        evidence = f"{each.log_evidence:.2f} ± {each.error:.2f}"
        name = _words(each.hypothesis.name)
        if each.hypothesis.name in spans:
            evidence += " ({:.1f} to {:.1f})".format(*spans[each.hypothesis.name])
        if np.abs(each.forces.mean(axis=1) - simulated).max() > DOUBTFUL:
            name += " *"
        rows.append([name, evidence, f"{chances[k]:.3f}", *forces, "yes" if _explains(simulated) else "no", best])
    heads = ["cause", "log evidence", "probability", "1.25 rad/s: 27 N", "2.5 V: 25 N", "3 V: 30 N", "4.4 V: at most 44.18 N",
             "within 1 N", "best point"]  # fmt: skip
    low, high = RANGES["stop_stiffness"]
    told = ", ".join(f"{_words(name)} {100 * error:.1f} %" for name, error in errors.items())
    notes = (
        "forces: mean over the posterior, N; in brackets simulated at the best point. Readings: standard deviation "
        f"{p.reading_error:g} N, 44.18 N a bound.\nPriors, uniform in the logarithm: stop {low:g} to {high:g} N/m, bow "
        f"{BOW[0]:g} to {BOW[1]:g} L, motor {RANGES['motor'][0]:g} to {RANGES['motor'][1]:g} N m s with 0.02 kg m2,\ncompliance "
        f"{RANGES['compliance'][0]:g} to {RANGES['compliance'][1]:g} rad/(N m); uniform: dead band {DEAD_BAND[0]:g} to "
        f"{DEAD_BAND[1]:g} V; gravity along -y or +y.\nInterpolation, root mean square at strikes of the posterior "
        f"that it has not seen, which widens the readings' error:\n{told}."
        f"\n* the strike at the best point is more than {DOUBTFUL:g} N from the mean: raise "
        f"the emulator's numbers before this row is believed. Slider {p.mass:g} kg."
    )
    return Table(heads, rows, "Causes of the measured impact forces", notes)


def _further_table(told: Mapping[str, float]) -> Table:
    """One row a reading, the most telling first."""
    rows = [
        [FURTHER[what][0], f"{FURTHER[what][1]:g} {FURTHER[what][2]}", f"{bits:.2f}"]
        for what, bits in sorted(told.items(), key=lambda item: -item[1])
    ]
    notes = (
        "Information: by how much the reading is expected to lessen the uncertainty about which cause holds, after those taken."
    )
    return Table(["further reading", "its error", "information [bit]"], rows, "What would tell the causes apart", notes)


# --- figure -----------------------------------------------------------------------------------------------------------


def figure(result: StudyResult) -> Figure:
    """Draw the forces that single causes predict over the voltage, and the evidence of all."""
    fig, (left, right) = subplots(1, 2, height=105, width_ratios=(1.25, 1))
    p: Any = result.parameters
    every = p.hypotheses
    volts = np.array([p.reference_voltage if r.voltage is None else r.voltage for r in READINGS])
    order = np.argsort(volts)
    for each, colour in zip([h for h in every if len(h.causes) < 2], COLOURS, strict=False):
        low, middle, high = np.quantile(result.signals[f"{each.name}.forces"], (0.16, 0.5, 0.84), axis=1)[:, order]
        left.plot(volts[order], middle, color=colour, label=each.name.replace("_", " "))
        left.fill_between(volts[order], low, high, color=colour, alpha=0.15, linewidth=0)
    _draw_readings(left, p)
    logs = {each.name: result.metrics[f"{each.name}.log_evidence"].value for each in every}
    names = sorted(logs, key=lambda name: logs[name])
    top = max(logs.values())
    right.barh(range(len(names)), [max(logs[name] - top, -LONGEST) for name in names], color=COLOURS[0])
    right.set_yticks(range(len(names)), [_words(name) for name in names], fontsize=7)
    right.set(xlabel="log evidence, less the best's", xlim=(-min(LONGEST, 1.1 * (top - min(logs.values())) + 0.5), 0))
    right.grid(visible=False, axis="y")
    return fig


def _draw_readings(ax: Any, p: Any) -> None:
    """Readings with their error; the bound as an arrow that points down."""
    for reading in READINGS:
        volt = p.reference_voltage if reading.voltage is None else reading.voltage
        if reading.bound:
            ax.errorbar(volt, reading.force, yerr=[[3], [0]], uplims=True, color="black", capsize=3, label="bound (sensor)")
        else:
            first = reading is READINGS[0]
            ax.errorbar(volt, reading.force, yerr=p.reading_error, fmt="ko", capsize=2, label="read" if first else None)
    ax.set(xlabel="voltage of the motor [V]", ylabel="impact force [N]", ylim=(15, None))
    ax.legend(loc="upper left", fontsize=7)
