"""Figures 5, 6, 10 and 11 of the paper on the striking slider-crank, on the paper's axes for comparison with the print.

Each figure shows the force on the stop over time, in several turns from crank angle 0, by several models (`impact.MODELS`).
`stitched` is the model of the paper: closed forms of three modes of motion, joined one after another. The beam has by default a
bow of 1 % of its length, which is one explanation of the measured forces. The stop of each model is calibrated so that the model
strikes with the published 27 N at 1.25 rad/s. All other numbers are predictions. In Fig. 6 the crank speeds up. At its top speed
only a light slider rests on the stop. The paper does not give the mass, so `ramp_mass` is chosen.
Source: B. Demirel et al., doi 10.1115/IMECE2008-68796.
"""

from dataclasses import dataclass, replace
from math import pi
from typing import NamedTuple

from buckler.mbs import Ramp

from ..kit.parameters import choices, quantity
from ..kit.published import IMPACT_FORCE, IMPACT_SPEED, VOLTAGE_FORCES
from ..kit.report import QUIET, Metric, Progress, StudyResult, metrics_table, worst
from ..kit.style import Figure, subplots
from .impact import MODELS, ImpactParameters, read
from .impact_models import NotCalibratedError, calibrate, run_model
from .slider_crank import REFERENCE_VOLTAGE


class Printed(NamedTuple):
    """Figure of the paper, with the ends of its axes."""

    caption: str
    until: float  # end of the time axis [s]
    force: float  # end of the force axis [N]
    speed: float | Ramp  # of the crank [rad/s]
    published: float | None  # largest impact force [N]


PRINTED = {
    "5": Printed("1.25 rad/s", 15.0, 30.0, IMPACT_SPEED, IMPACT_FORCE),
    "6": Printed("0.75 to 6.58 rad/s", 15.0, 140.0, Ramp(0.75, 6.58, 15.0), None),
    "10": Printed("2.5 V", 15.0, 30.0, IMPACT_SPEED * 2.5 / REFERENCE_VOLTAGE, VOLTAGE_FORCES[2.5]),
    "11": Printed("3 V", 12.0, 35.0, IMPACT_SPEED * 3.0 / REFERENCE_VOLTAGE, VOLTAGE_FORCES[3.0]),
}
"""Figures of the paper by their numbers. In 10 and 11 the crank speed is assumed proportional to the voltage."""


@dataclass(frozen=True)
class Parameters(ImpactParameters):
    """Parameters of the study."""

    models: tuple[str, ...] = choices(("stitched", "beam"), MODELS, "models to draw", "models")
    imperfection: float = quantity(0.01, "1", -0.05, 0.05, "bow of the unloaded strip over its length (beam)", "strip")
    ramp_mass: float = quantity(0.02, "kg", 0.01, 10, "mass of the slider in Fig. 6", "slider and stop")
    figures: tuple[str, ...] = choices(tuple(PRINTED), tuple(PRINTED), "figures", "which")


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Calibrate every model, run it for every figure, and read the first and the last impact."""
    runs, metrics = {}, {}
    for number, model in progress([(number, model) for number in p.figures for model in p.models], label="figures"):
        case = replace(p, mass=p.ramp_mass) if number == "6" else p
        printed = PRINTED[number]
        try:
            stop = calibrate(model, case).stop_setting  # duration of an impact [s] (stitched) or stiffness of the stop [N/m]
            done = run_model(model, case, stop, printed.speed, printed.until)
        except NotCalibratedError as error:
            return StudyResult(parameters=p, status="NOT_CALIBRATED", message=str(error))
        whole, rest = divmod(done.angle[-1], 2 * pi)
        turns = int(whole) + int(rest > 5 * pi / 6)  # the impact begins at 120 degrees and is over at 150
        peaks = [read(done, turn).impact_peak for turn in range(turns)]
        key = f"fig{number}.{model}"
        runs[key] = done
        metrics[f"{key}.first"] = Metric(float(peaks[0]), "N", published=printed.published)
        metrics[f"{key}.last"] = Metric(float(peaks[-1]), "N", published=printed.published)
        metrics[f"{key}.turns"] = Metric(float(turns), "1")
    notes = "First and last impact of each figure. Fig. 6 in print: the impact force grows to 120 or 140 N. "
    notes += f"Its slider: {p.ramp_mass:g} kg.\n{p.describe()}."
    return StudyResult(
        parameters=p, **worst(runs.items()), metrics=metrics,
        signals={f"{key}.{what}": getattr(run, what) for key, run in runs.items() for what in ("time", "force")},
        tables=[replace(metrics_table(metrics), notes=notes)],
    )  # fmt: skip


def figure(result: StudyResult) -> Figure:
    """Draw a row of panels for each figure of the paper and a column for each model, on the printed axes."""
    p = result.of(Parameters)
    fig, axes = subplots(len(p.figures), len(p.models), height=20 + 42 * len(p.figures), squeeze=False)
    for line, number in zip(axes, p.figures, strict=True):
        printed = PRINTED[number]
        for ax, model in zip(line, p.models, strict=True):
            time, force = (result.signals[f"fig{number}.{model}.{what}"] for what in ("time", "force"))
            ax.plot(time, force, color="#000000", linewidth=0.7)
            if printed.published:
                ax.axhline(printed.published, color="#009E73", linestyle=":", linewidth=1)
            ax.set(xlim=(0, printed.until), ylim=(0, printed.force), title=f"Fig. {number}, {printed.caption}: {model}")
            ax.set(xlabel="time [s]", ylabel="impact and contact\nforce [N]")
    return fig
