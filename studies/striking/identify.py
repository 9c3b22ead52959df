"""Which cause explains the impact forces that were measured: 27 N at 1.25 rad/s, 25 N at 2.5 V, 30 N at 3 V, no more at 4.4 V?

A stop of unknown stiffness alone, or with a bow of the strip, gravity in the plane, a DC motor that gives way, a voltage below
which the motor stands still, a compliant drive, or two of these. Each is held against the readings with an error of 1 N; 44.18 N
at 4.4 V is the range of the sensor, which a force did not exceed. Strikes are simulated at points over the priors and where the
posterior lies, and interpolated in between; what further strikes are off before they are added is the interpolation's error.
The best point is fitted (`buckler.mbs.fit`). Then: which further reading would tell the hypotheses apart?

References
----------
B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import copysign, nan, pi
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import qmc

from buckler.mbs import Controlled, Mechanism, Spectral, fit
from buckler.mbs.geometry import Array
from buckler.mbs.sensitivity.data import Experiment, Read

from ..kit.parameters import StudyParameters, choice, choices, integer, quantity
from ..kit.published import GRAVITY
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, judged
from ..kit.style import COLOURS, Axes, Figure, subplots
from . import evidence
from .evidence import DEAD_BAND, READINGS, Hypothesis, Posterior, Strikes
from .strike import UNITS, duration, mechanism, peak, struck
from .strike import Parameters as Strike

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
PEAK = "peak(B.contact_force, 1)"
"""The largest force of the first impact."""
NEAR = 0.1
"""Of the priors' ranges: how far the fitted point may lie from the best one that was interpolated."""
EXACT = 0.02
"""Relative error of the interpolation above which evidence is told as a span."""
LATER = range(1, len(READINGS))
"""Readings that are a peak alone."""
UNREFINED = 0.03
"""Relative error of the interpolation before it is known."""
LONGEST = 12.0
"""Difference of log evidence at which a bar ends."""
TOLERANCE = 1e-5
"""Of the runs that are fitted, as of the strikes."""
FIELDS = {"bow": "imperfection"}
"""Unknowns whose parameter of `strike` is called otherwise."""
WITHIN = 1.0
"""N: how near a force must come to count as explained."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    reading_error: float = quantity(1.0, "N", 0.01, 10, "standard deviation of a force that was read", "readings")
    reference_voltage: float = quantity(2.7, "V", 2.55, 12, "voltage at which the crank turns at 1.25 rad/s", "readings")
    causes: tuple[str, ...] = choices(evidence.CAUSES, evidence.CAUSES, "causes beside the stop's stiffness", "hypotheses")
    pairs: str = choice("yes", ("yes", "no"), "whether pairs of causes are hypotheses, too", "hypotheses")
    mass: float = quantity(0.3, "kg", 0.01, 10, "mass of the slider", "slider and stop")
    first: int = integer(8, 4, 10**4, "strikes over the priors, for each unknown and reading; more by its square", "strikes")
    rounds: int = integer(2, 1, 20, "rounds of further strikes where the posterior lies", "strikes")
    refined: int = integer(6, 1, 1000, "strikes of a round, for each unknown and reading", "strikes")
    points: int = integer(2048, 16, 2**20, "Sobol' points of each of 8 sets over the priors, a power of two", "numerics")
    samples: int = integer(400, 10, 10**5, "samples of each posterior", "numerics")
    seed: int = integer(0, 0, 2**31 - 1, "draws the points", "numerics")
    workers: int = integer(2, 1, 256, "threads", "numerics")

    @property
    def hypotheses(self) -> list[Hypothesis]:
        """Those that are weighed."""
        return evidence.hypotheses(tuple(c for c in evidence.CAUSES if c in self.causes), self.pairs == "yes")

    def check(self) -> None:
        """Points are a power of two."""
        if self.points & (self.points - 1):
            raise ValueError(f"points = {self.points}: must be a power of two")


class Weighed(NamedTuple):
    """A hypothesis after the readings.

    `error` is the relative error of the interpolated forces, `span` that of the log evidence where it matters; `points` were
    simulated, and `failed` strikes of them had no force. `best` are the values fitted, `forces` those of the readings there, N.
    """

    posterior: Posterior
    error: float
    span: tuple[float, ...]
    points: int
    failed: int
    best: Mapping[str, float]
    forces: Sequence[float]

    @property
    def name(self) -> str:
        """Of the hypothesis."""
        return self.posterior.hypothesis.name


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Weigh every hypothesis, fit its best point, look for readings that would tell them apart."""
    with ThreadPoolExecutor(p.workers) as pool:
        found = [_weighed(h, p, pool) for h in progress(p.hypotheses, label="hypotheses")]
    chances = evidence.probabilities([each.posterior for each in found])
    column = {what: len(READINGS) - 1 + k for k, what in enumerate(UNITS)} | {"peak": len(READINGS) - 1}
    bits = {what: evidence.information([each.posterior.numbers[:, column[what]] for each in found], chances, sd, p.seed)
            for what, (_, sd, _) in FURTHER.items()}  # fmt: skip
    runs, failed = len(READINGS) * sum(each.points for each in found), sum(each.failed for each in found)
    errors = [each.error for each in found]
    metrics = {
        name: metric for each, chance in zip(found, chances, strict=True) for name, metric in _metrics(each, chance).items()
    }
    metrics |= {f"{what}.information": Metric(value, "bit") for what, value in bits.items()}
    metrics |= {
        "emulator.error": Metric(float(np.mean(errors)), "1"),
        **{f"emulator.{each.name}.error": Metric(each.error, "1") for each in found},
        "emulator.worst": Metric(max(errors), "1"),
        "emulator.failed": Metric(float(failed), "1"),
        **{f"{each.name}.log_evidence.{end}": Metric(x, "1") for each in found
           for end, x in zip(("low", "high"), each.span, strict=False)},
    }  # fmt: skip
    return StudyResult(
        parameters=p,
        **judged([f"EMULATOR: {failed} of {runs} strikes failed"] if failed > 0.01 * runs else []),
        metrics=metrics,
        signals={f"{each.name}.forces": each.posterior.forces for each in found},
        work={"strikes": runs},
        tables=[_table(found, chances, p), _further_table(bits)],
    )


def _weighed(h: Hypothesis, p: Parameters, pool: ThreadPoolExecutor) -> Weighed:
    """Simulate over the priors, then where the posterior lies, integrate, and fit the best point."""
    strikes, d = Strikes(h, lambda values: _simulated(values, p, pool)), len(h.axes)

    def weigh(error: float) -> Posterior:
        return evidence.posterior(
            strikes, h, points=p.points, samples=p.samples, sd=p.reading_error, model_error=error, seed=p.seed
        )

    strikes.add(qmc.Halton(d, rng=np.random.default_rng(p.seed)).random(p.first * d * d))
    error = UNREFINED
    for _ in range(p.rounds):
        off = strikes.add(strikes.spread(weigh(error).unit, p.refined * d))
        error = float(np.sqrt(np.nanmean(off**2)))
    found = weigh(error)
    logs = [found.log_evidence, *(weigh(other).log_evidence for other in (0.0, 2 * error) if error > EXACT)]
    failed = int((strikes.logs[:, : len(READINGS)] <= np.log(evidence.FLOOR)).sum())
    span = (min(logs), max(logs)) if error > EXACT else ()
    return Weighed(found, error, span, len(strikes.unit), failed, *fitted(found, p))


def case(values: Mapping[str, float], voltage: float | None, p: Parameters) -> Strike:
    """The strike that a hypothesis with these values predicts for a reading."""
    given: dict[str, Any] = {
        FIELDS.get(name, name): value for name, value in values.items() if name not in ("gravity", "dead_band")
    }
    if "gravity" in values:
        given |= {"gravity": GRAVITY, "gravity_angle": copysign(pi / 2, values["gravity"])}
    speed = evidence.crank_speed(voltage, values.get("dead_band", 0.0), p.reference_voltage)
    return Strike(**given, speed=float(speed), mass=p.mass)


def _simulated(values: Mapping[str, Array], p: Parameters, pool: ThreadPoolExecutor) -> Array:
    """Forces of the readings and the further readings, shape (points, numbers), nan of those that do not happen."""
    points = [dict(zip(values, map(float, point), strict=True)) for point in zip(*values.values(), strict=True)]
    cases = [case(point, reading.voltage, p) for point in points for reading in READINGS]
    whole, peaks = pool.map(struck, cases[:: len(READINGS)]), [pool.map(peak, cases[k :: len(READINGS)]) for k in LATER]
    first = np.array([[found.get(what, nan) for what in UNITS] for found in whole])
    return np.column_stack([first[:, 0], *(list(each) for each in peaks), first[:, 1:]])


def fitted(found: Posterior, p: Parameters) -> tuple[dict[str, float], list[float]]:
    """The best point of a hypothesis, from that of its posterior on, and the forces there, N."""
    h, start = found.hypothesis, dict(zip(found.hypothesis.axes, found.best.tolist(), strict=True))

    def made(reading: float, **moved: float) -> Mechanism:
        return mechanism(case(at(moved), READINGS[int(reading)].voltage, p))

    def at(moved: Mapping[str, float]) -> dict[str, float]:
        unit = np.array([[{**start, **moved}[name] for name in h.axes]])
        return {name: float(x[0]) for name, x in h.values(unit).items()}

    experiments = [
        Experiment(
            readings={PEAK: Read(reading.force, p.reading_error, "at most" if reading.bound else "is")},
            settings={"reading": k}, duration=duration(case(at({}), reading.voltage, p)),
        )
        for k, reading in enumerate(READINGS)
    ]  # fmt: skip
    free = {name: (max(0.0, u - NEAR), min(1.0, u + NEAR)) for name, u in start.items() if name != "gravity"}
    best = fit(made, experiments, free=free, starts=1, solver=Spectral(Controlled(tolerance=TOLERANCE)))
    return at(best.values), [float(said[PEAK]) for said in best.predicted]


def _metrics(each: Weighed, chance: float) -> dict[str, Metric]:
    """Of a hypothesis: evidence, probability, forces over its posterior and at its best point."""
    own, name = each.posterior, each.name
    metrics = {
        f"{name}.log_evidence": Metric(own.log_evidence, "1", error=abs(own.error / own.log_evidence)),
        f"{name}.probability": Metric(float(chance), "1"),
    }
    for what, reading, forces, fitted in zip(NAMES, READINGS, own.forces, each.forces, strict=True):
        known = None if reading.bound else reading.force
        metrics[f"{name}.{what}"] = Metric(float(forces.mean()), "N", known)
        metrics[f"{name}.best.{what}"] = Metric(fitted, "N", known)
    return metrics | {f"{name}.best.{axis}": Metric(value, _unit(axis)) for axis, value in each.best.items()}


def _unit(axis: str) -> str:
    """Of an unknown."""
    return {"stop_stiffness": "N/m", "dead_band": "V", "motor": "N.m.s", "compliance": "rad/(N.m)"}.get(axis, "1")


# --- tables -----------------------------------------------------------------------------------------------------------


def _words(name: str) -> str:
    """Of a hypothesis."""
    return name.replace("dead_band", "dead band").replace("_", " + ")


def _explains(simulated: Sequence[float]) -> bool:
    """Whether the best point is within 1 N of all readings and below the bound."""
    off = [force - reading.force for reading, force in zip(READINGS, simulated, strict=True)]
    return all(x <= WITHIN and (reading.bound or x >= -WITHIN) for reading, x in zip(READINGS, off, strict=True))


def _table(found: Sequence[Weighed], chances: Array, p: Parameters) -> Table:
    """One row a hypothesis, the likeliest first."""
    rows = []
    for k in np.argsort(-chances):
        each, own = found[k], found[k].posterior
        best = ", ".join(f"{axis.replace('_', ' ')} {value:.3g}" for axis, value in each.best.items())
        forces = [f"{mean:.1f} ({fitted:.1f})" for mean, fitted in zip(own.forces.mean(axis=1), each.forces, strict=True)]
        log = f"{own.log_evidence:.2f} ± {own.error:.2f}"
        if each.span:
            log += " ({:.1f} to {:.1f})".format(*each.span)
        rows.append([_words(each.name), log, f"{chances[k]:.3f}", *forces, "yes" if _explains(each.forces) else "no", best])
    heads = ["cause", "log evidence", "probability", "1.25 rad/s: 27 N", "2.5 V: 25 N", "3 V: 30 N", "4.4 V: at most 44.18 N",
             "within 1 N", "best point"]  # fmt: skip
    told = ", ".join(f"{_words(each.name)} {100 * each.error:.1f} %" for each in found)
    priors = ", ".join(f"{_words(name)} {low:g} to {high:g} {_unit(name)}" for name, (low, high) in evidence.RANGES.items())
    notes = (
        "forces: mean over the posterior, N; in brackets at the best point. Readings: standard deviation "
        f"{p.reading_error:g} N, 44.18 N a bound.\nPriors, uniform in the logarithm: {priors};\n"
        f"uniform: dead band {DEAD_BAND[0]:g} to {DEAD_BAND[1]:g} V; gravity along -y or +y. Slider {p.mass:g} kg.\n"
        f"Interpolation, root mean square at strikes of the posterior that it had not seen:\n{told}."
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
    p = result.of(Parameters)
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


def _draw_readings(ax: Axes, p: Any) -> None:
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
