"""The slider-crank on its motor, Figs 10 and 11: one number calibrated on 27 N, the forces at other voltages predicted.

Calibrated: the duration of an impact (stitched) or the stiffness of the stop (strut, beam), so that each model strikes
with 27 N at 1.25 rad/s. Assumed: the crank's speed is proportional to the voltage, 1.25 rad/s at 2.7 V. That voltage is chosen
here, as 2.7 = 2.5·27/25: it puts 27 N on the line through 25 N at 2.5 V and 30 N at 3 V. So the forces at these two voltages
test the exponent of a model, not its size; `dead_band` and `reference_voltage` vary the map. The range of the sensor at 4.4 V
bounds the force there, and is no reading. The beam is also run with strips that are bowed before they are loaded: a straight
one resists the impact far beyond its Euler load, and not in proportion to the speed.
Source: B. Demirel et al., doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import cycle
from math import nan
from typing import Any, NamedTuple

import numpy as np

from ..kit.parameters import quantities, quantity
from ..kit.published import IMPACT_FORCE, IMPACT_SPEED, SENSOR_RANGE, SENSOR_VOLTAGE, VOLTAGE_FORCES
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, worst
from ..kit.statistics import exponent
from ..kit.style import Axes, Figure, subplots
from . import impact
from .impact import ImpactParameters, ModelRun
from .impact_models import Fit, NotCalibratedError, calibrate, strike

VARIED = {"friction": (0.0, 0.9), "mass": (0.01, 10.0), "restitution": (0.1, 1.0)}
"""Parameters whose influence is measured, and their ranges."""


@dataclass(frozen=True)
class Parameters(ImpactParameters):
    """Parameters of the study."""

    voltages: tuple[float, ...] = quantities((2.5, 3.0, 4.4), "V", 0.5, 12, "voltages of the motor", "drive")
    reference_voltage: float = quantity(2.7, "V", 0.5, 12, "voltage at which the crank turns at 1.25 rad/s", "drive")
    dead_band: float = quantity(0.0, "V", 0, 2.4, "voltage below which the motor does not turn", "left open")
    bows: tuple[float, ...] = quantities(
        (0.003, 0.01), "1", -0.05, 0.05, "bows of further strips over their length (beam)", "strip"
    )
    variation: float = quantity(0.1, "1", 0.01, 0.5, "relative change of each varied parameter", "sensitivity")

    def speed(self, voltage: float) -> float:
        """Crank speed at a voltage, rad/s."""
        return IMPACT_SPEED * (voltage - self.dead_band) / (self.reference_voltage - self.dead_band)

    def check(self) -> None:
        """Every voltage turns the motor."""
        super().check()
        if not self.dead_band < min(*self.voltages, self.reference_voltage):
            raise ValueError(f"dead_band = {self.dead_band:g} V: must lie below every voltage")


class VoltageCase(NamedTuple):
    """One model, or the beam with a bowed strip, with its own stop."""

    name: str
    model: str
    parameters: Parameters
    fit: Fit

    def strike(self, speed: float, **changes: Any) -> ModelRun:
        """Run past the first impact at a crank speed, the stop held."""
        return strike(self.model, replace(self.parameters, **changes), self.fit.stop, speed)

    def varied(self) -> dict[str, dict[float, ModelRun]]:
        """Strikes at 1.25 rad/s with each parameter below and above its value, within its range; none of zero."""
        found = {}
        for name, (least, most) in VARIED.items():
            value, change = getattr(self.parameters, name), self.parameters.variation
            ends = max(value * (1 - change), least), min(value * (1 + change), most)
            found[name] = {end: self.strike(IMPACT_SPEED, **{name: end}) for end in ends if ends[0] < ends[1]}
        return found


def force(run: ModelRun) -> float:
    """Impact force, N; nan without impact."""
    return impact.read(run).impact_peak or nan


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Calibrate each case, predict the forces, vary the parameters."""
    bowed = [(f"beam_bow_{bow:g}", "beam", replace(p, imperfection=bow)) for bow in (p.bows if "beam" in p.models else ())]
    asked = [*((model, model, p) for model in p.models), *bowed]
    try:
        cases = [VoltageCase(*case, calibrate(*case[1:])) for case in progress(asked, label="calibration")]
    except NotCalibratedError as error:
        return StudyResult(parameters=p, status="NOT_CALIBRATED", message=str(error))
    predicted = {case.name: [case.strike(p.speed(v)) for v in p.voltages] for case in progress(cases, label="voltages")}
    plain = progress([case for case in cases if case.name == case.model], label="sensitivity")
    varied = {case.name: case.varied() for case in plain}
    runs = [run for own in predicted.values() for run in own]
    runs += [run for own in varied.values() for ends in own.values() for run in ends.values()]
    forces = {name: [force(run) for run in own] for name, own in predicted.items()}
    slopes = {
        name: {what: exponent([*ends], [force(run) for run in ends.values()]) for what, ends in own.items()}
        for name, own in varied.items()
    }
    return StudyResult(
        parameters=p,
        **worst([(run.model, run) for run in runs]),
        metrics={name: metric for case in cases for name, metric in _metrics(case, forces, slopes).items()},
        signals={"voltage": np.array(p.voltages), **{f"{name}.force": np.array(own) for name, own in forces.items()}},
        work={"runs": len(runs) + sum(len(case.fit.trials) for case in cases), "steps": sum(run.work["steps"] for run in runs)},
        tables=[_forces_table(cases, forces), _calibration_table(cases), _sensitivity_table(slopes, p)],
    )


def _from_ends(voltages: Sequence[float], forces: Sequence[float]) -> float:
    """Exponent of force against voltage from the lowest to the highest voltage; nan if they are the same."""
    ends = [int(np.argmin(voltages)), int(np.argmax(voltages))]
    return exponent(np.array(voltages)[ends], np.array(forces)[ends])


PUBLISHED = _from_ends(list(VOLTAGE_FORCES), list(VOLTAGE_FORCES.values()))
"""Exponent of the published forces."""


def _metrics(
    case: VoltageCase, forces: Mapping[str, Sequence[float]], slopes: Mapping[str, Mapping[str, float]]
) -> dict[str, Metric]:
    voltages = case.parameters.voltages
    found = {**dict([case.fit.metric]), "force_calibrated": Metric(case.fit.trials[-1][1], "N", IMPACT_FORCE)}
    for voltage, force in zip(voltages, forces[case.name], strict=True):
        found[f"force_{voltage:g}V"] = Metric(force, "N", VOLTAGE_FORCES.get(voltage))
    found["exponent"] = Metric(_from_ends(voltages, forces[case.name]), "1", PUBLISHED)
    found |= {f"slope_{name}": Metric(slope, "1") for name, slope in slopes.get(case.name, {}).items()}
    return {f"{case.name}.{name}": metric for name, metric in found.items()}


def _forces_table(cases: Sequence[VoltageCase], forces: Mapping[str, Sequence[float]]) -> Table:
    p = cases[0].parameters
    headers = ["voltage [V]", "crank [rad/s]", "published [N]"]
    for case in cases:
        headers += [f"{case.name} [N]", "off"]
    rows = []
    for i, voltage in enumerate(p.voltages):
        published = VOLTAGE_FORCES.get(voltage)
        said = f"at most {SENSOR_RANGE}" if voltage == SENSOR_VOLTAGE else published
        row = [f"{voltage:g}", f"{p.speed(voltage):.4f}", said]
        for case in cases:
            force = forces[case.name][i]
            row += [f"{force:.2f}", f"{force / published - 1:+.1%}" if published else None]
        rows.append(row)
    ends = [f"{_from_ends(p.voltages, forces[case.name]):.3f}" for case in cases]
    rows.append(["exponent", None, f"{PUBLISHED:.3f}", *(x for end in ends for x in (end, None))])
    notes = (
        f"assumed: speed proportional to voltage, {IMPACT_SPEED:g} rad/s at {p.reference_voltage:g} V; "
        "predicted: the forces; exponent: of force against speed.\n"
        "44.18 N is the range of the force sensor: a bound, no reading; beam_bow: strip bowed by this part of its length, "
        "unloaded.\n"
        f"{p.stated()}."
    )
    return Table(headers, rows, "Predicted impact forces", notes)


def _calibration_table(cases: Sequence[VoltageCase]) -> Table:
    rows = []
    for case in cases:
        name, stop = case.fit.metric
        trials = "; ".join(f"{k:.4g}: {f:.2f} N" for k, f in case.fit.trials)
        rows.append([case.name, name, stop.unit, f"{stop.value:.4g}", trials])
    title = f"Calibrated: one number each, on {IMPACT_FORCE:g} N at {IMPACT_SPEED:g} rad/s"
    return Table(["case", "number", "unit", "value", "runs"], rows, title)


def _sensitivity_table(slopes: Mapping[str, Mapping[str, float]], p: Parameters) -> Table:
    rows = [[name, getattr(p, name), *(slope[name] for slope in slopes.values())] for name in VARIED]
    notes = "relative change of the force over that of the parameter, by central differences, the stop held."
    return Table(["parameter", "value", *slopes], rows, f"Sensitivity of the impact force at {IMPACT_SPEED:g} rad/s", notes)


def figure(result: StudyResult) -> Figure:
    """Draw the forces over the voltage, and their sensitivity."""
    fig, (forces, bars) = subplots(1, 2, height=100, width_ratios=(1.5, 1))
    _draw_forces(forces, result)
    fig.legend(*forces.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    _draw_sensitivity(bars, result)
    return fig


def _draw_forces(ax: Axes, result: StudyResult) -> None:
    p = result.of(Parameters)
    names = [name.removesuffix(".force") for name in result.signals if name.endswith(".force")]
    strokes = cycle(("--", "-.", ":", (0, (5, 1, 1, 1, 1, 1))))
    for name in names:
        voltages = np.append(result.signals["voltage"], p.reference_voltage)
        forces = np.append(result.signals[f"{name}.force"], result.metrics[f"{name}.force_calibrated"].value)
        order = np.argsort(voltages)
        look = {"color": impact.COLOURS[name]} if name in impact.COLOURS else {"color": "#777777", "linestyle": next(strokes)}
        ax.plot(voltages[order], forces[order], marker=".", label=_label(name), **look)
    ax.plot(*zip(*VOLTAGE_FORCES.items(), strict=True), "k*", markersize=8, label="published")
    ax.errorbar(
        SENSOR_VOLTAGE, SENSOR_RANGE, yerr=np.array([[0.06 * SENSOR_RANGE], [0.0]]), uplims=True, color="black", capsize=3,
        label="bound: sensor range",
    )  # fmt: skip
    ax.plot(p.reference_voltage, IMPACT_FORCE, "ko", markerfacecolor="white", markersize=6, label="calibrated on")
    ax.set(xlabel="voltage [V]", ylabel="impact force [N]")
    ax.locator_params(axis="y", integer=True)


def _label(name: str) -> str:
    """Name of a case in words: beam_bow_0.01 is a beam with a bow of 0.01 L."""
    model, _, bow = name.partition("_bow_")
    return f"{model}, bow {bow} L" if bow else model


def _draw_sensitivity(ax: Axes, result: StudyResult) -> None:
    p = result.of(Parameters)
    models = [model for model in impact.MODELS if model in p.models]
    height = 0.8 / len(models)
    for i, model in enumerate(models):
        slopes = [result.metrics[f"{model}.slope_{name}"].value for name in VARIED]
        ax.barh(np.arange(len(VARIED)) - i * height, slopes, height, color=impact.COLOURS[model], label=model)
    ax.axvline(0, color="black", linewidth=0.6)
    ax.set_yticks(np.arange(len(VARIED)) - 0.4 + height / 2, VARIED)
    ax.tick_params(axis="y", length=0)
    ax.grid(visible=False, axis="y")
    ax.set(xlabel="d ln force / d ln parameter")
