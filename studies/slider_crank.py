"""The compliant slider-crank striking its stop at constant speed: three models against Fig. 5 and the exact elastica.

One turn of the crank from angle 0. The slider meets the stop at 120 degrees, rebounds until it rests, and is pressed
against it by the buckled coupler until 240 degrees. `stitched` is the published model; `strut` and `beam` simulate it.

References
----------
B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from elastica import pinned
from mbs.library import PAPER, PAPER_STOP
from studies import impact
from studies.cli import main
from studies.impact import ImpactParameters, ModelRun, Reading
from studies.parameters import quantity
from studies.report import QUIET, Metric, Progress, StudyResult, Table
from studies.style import subplots

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONTACT = float(np.degrees(PAPER.contact_angle(PAPER_STOP)))
NOTES = """\
error: against exact where there is one, else against published. exact: elastica in equilibrium, no friction.
published: Fig. 5 (27 N at 1.25 rad/s) and Table 2, whose forces follow from a stop met at 115.35 degrees, not 120.
27 N is no prediction: it fixes impact_duration for stitched and stop_stiffness for strut (both rounded); beam uses the
stiffness of strut. impact_peak and impact_impulse: from first contact until the force first returns to zero."""


@dataclass(frozen=True)
class Parameters(ImpactParameters):
    """Parameters of the study."""

    speed: float = quantity(impact.IMPACT_SPEED, "rad/s", 0.1, 60, "speed of the crank", "drive")


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run each model for one turn and read it."""
    duration = 2 * pi / parameters.speed
    runs = [
        impact.run_model(model, parameters, parameters.speed, duration)
        for model in progress(parameters.models, label="models")
    ]
    readings = [impact.read(run, parameters) for run in runs]
    metrics = {
        f"{run.model}.{name}": metric
        for run, reading in zip(runs, readings, strict=True)
        for name, metric in _metrics(run, reading, parameters).items()
    }
    notes = [note for run, reading in zip(runs, readings, strict=True) for note in impact.findings(run, [reading])]
    grid = np.radians(np.linspace(CONTACT, 360 - CONTACT, 481))
    exact = {"exact.angle": grid, "exact.force": impact.exact_force(parameters, grid)}
    return StudyResult(
        parameters=parameters,
        **impact.verdict(runs, notes),
        metrics=metrics,
        signals={**exact, **{name: values for run in runs for name, values in run.signals.items()}},
        work=impact.work(runs),
        tables=[_table(metrics, runs, notes)],
    )


def _metrics(run: ModelRun, reading: Reading, p: Parameters) -> dict[str, Metric]:
    """Every number of one model, with what was published and what is exact."""
    at_27 = p.speed == impact.IMPACT_SPEED and p.thickness == 3e-4
    deepest = float(PAPER.shortening(pi, PAPER_STOP))
    stress, exact_stress = (
        float(pinned.surface_stress(min(max(u, 0.0), 1.0), p.thickness, PAPER.coupler, p.section.material.modulus))
        for u in (reading.shortening, deepest)
    )
    return {
        "contact_force_180": Metric(
            reading.force_180, "N", impact.CONTACT_FORCES.get(p.thickness), float(impact.exact_force(p, pi))
        ),
        "contact_force_error": Metric(reading.force_error, "1"),
        "impact_peak": Metric(reading.impact_peak, "N", impact.IMPACT_FORCE if at_27 else None),
        "impact_impulse": Metric(reading.impact_impulse, "N.s"),
        "impact_time": Metric(reading.impact_time, "s"),
        "rebound_ratio": Metric(reading.rebound_ratio, "1"),
        "rebounds": Metric(reading.rebounds, "1"),
        "settling_time": Metric(reading.settling_time, "s"),
        "contact_angle": Metric(degrees(reading.contact_angle), "deg", 120.0, CONTACT),
        "release_angle": Metric(degrees(reading.release_angle), "deg", 240.0, 360 - CONTACT),
        "bending_stress": Metric(stress, "Pa", exact=exact_stress),
        "buckles_before_stop": Metric(float(reading.buckles_before_stop), "1"),
        "energy_balance": Metric(run.energy_balance, "1"),
    }


def _table(metrics: Mapping[str, Metric], runs: Sequence[ModelRun], notes: Sequence[str]) -> Table:
    """Published, exact and computed side by side, each with its error; run time and steps below."""
    models = [run.model for run in runs]
    names = [name.partition(".")[2] for name in metrics if name.startswith(f"{models[0]}.")]
    rows: list[list[Any]] = []
    for name in names:
        found = [metrics[f"{model}.{name}"] for model in models]
        rows.append([name, found[0].unit, found[0].published, found[0].exact, *(x for m in found for x in (m.value, _error(m)))])
    for name, unit in (("wall_s", "s"), ("steps", "1")):
        rows.append([name, unit, None, None, *(x for run in runs for x in (run.work[name], None))])
    headers = ["", "unit", "published", "exact", *(x for model in models for x in (model, "error"))]
    return Table(headers, rows, "One turn of the crank", "\n".join([NOTES, *notes]))


def _error(metric: Metric) -> str | None:
    error = metric.error
    if error is None and metric.published:
        error = abs(metric.value / metric.published - 1)
    return None if error is None else f"{error:.1e}"


def figure(result: StudyResult) -> Figure:
    return subplots()[0]


if __name__ == "__main__":
    raise SystemExit(main("slider-crank"))
