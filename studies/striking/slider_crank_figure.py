"""Figures of the study slider-crank, one for each drive; `exact`: static forces at first contact and at the dead centre [N]."""

import numpy as np

from buckler.mbs.geometry import Array

from ..kit.published import IMPACT_FORCE, IMPACT_SPEED, SENSOR_RANGE, SENSOR_VOLTAGE, VOLTAGE_FORCES
from ..kit.report import StudyResult
from ..kit.style import Axes, Figure, subplots
from .impact import COLOURS, MODELS

WIDTHS = {"stitched": 2.0, "strut": 1.3, "beam": 1.0}
"""Line widths, which keep the first model visible below the others."""
DOTTED = {"color": COLOURS["published"], "linestyle": ":"}
"""Style of lines of published values."""


def _models(result: StudyResult) -> list[str]:
    return [model for model in MODELS if f"{model}.time" in result.signals]


def draw_forces(ax: Axes, result: StudyResult, abscissa: str, lowest: float) -> None:
    """Draw the force on the stop [N] of each model over angle or time, on a logarithmic axis from `lowest`; 0 lies below it."""
    for model in _models(result):
        x, force = result.signals[f"{model}.{abscissa}"], result.signals[f"{model}.force"]
        x = np.degrees(x) if abscissa == "angle" else x
        ax.semilogy(x, np.maximum(force, lowest / 2), color=COLOURS[model], lw=WIDTHS[model], label=model)
    ax.set(ylim=(lowest, None), ylabel="force on the stop [N]")
    ax.set_ylim(top=5 * ax.get_ylim()[1])  # space for the legend
    ax.yaxis.set_major_formatter("{x:g}")


def _draw_turn(result: StudyResult, exact: Array) -> Figure:
    """Draw the force over a turn on a logarithmic axis, and over the impact on a linear one."""
    fig, (turn, first) = subplots(2, 1, height=140)
    s = result.signals
    draw_forces(turn, result, "angle", lowest=exact.min() / 4)
    turn.semilogy(np.degrees(s["exact.angle"]), s["exact.force"], "--", color="#000000", label="elastica")
    turn.set(xlim=(110, 250), xlabel="crank angle [deg]")
    turn.legend(loc="upper right", ncols=4)
    for model in _models(result):
        time, force = s[f"{model}.time"], s[f"{model}.force"]
        if (force > 0).any():
            first.plot(1e3 * (time - time[np.argmax(force > 0)]), force, color=COLOURS[model], lw=WIDTHS[model])
    times = [metric.value for name, metric in result.metrics.items() if name.endswith("impact_time")]
    # An impact of 0.1 s or more has passed into lasting contact, and does not set the axis; if all have, it has 10 ms: chosen.
    longest = 1e3 * max((t for t in times if t < 0.1), default=0.01)  # [ms]
    for ax in (turn, first):
        ax.axhline(IMPACT_FORCE, **DOTTED)
    first.set(xlim=(-0.05 * longest, 1.3 * longest), ylim=(0, None), ylabel="force on the stop [N]")
    first.set(xlabel="time since first contact [ms]", title=f"dotted: {IMPACT_FORCE:g} N of the paper's Fig. 5")
    return fig


def _draw_ramp(result: StudyResult, exact: Array) -> Figure:
    """Draw the force over the whole run, and the impact, contact maximum and contact time of each turn over its crank speed."""
    fig, (run, *below) = subplots(4, 1, height=200)
    at_contact, at_dead_centre = exact
    draw_forces(run, result, "time", lowest=at_contact / 4)
    run.set(xlabel="time [s]")
    run.legend(loc="upper left", ncols=3)
    labels = {"impact_peak": "impact force [N]", "contact_max": "contact maximum [N]", "contact_time": "contact time [s]"}
    for ax, (name, label) in zip(below, labels.items(), strict=True):
        for model in _models(result):
            crank, values = result.signals["turn.crank_speed"], result.signals[f"{model}.turn.{name}"]
            ax.plot(crank, values, "o", color=COLOURS[model], fillstyle="none", markersize=3 + 2 * WIDTHS[model])
        ax.set(xlabel="crank speed [rad/s]", ylabel=label, ylim=(0, None), xlim=(0, None))
    speeds = np.array([0.0, result.signals["turn.crank_speed"].max()])
    below[0].plot(speeds, IMPACT_FORCE / IMPACT_SPEED * speeds, **DOTTED)  # published force, in proportion to the speed
    below[1].axhline(at_dead_centre, color="#000000", linestyle="--")
    return fig


def _draw_voltages(result: StudyResult, _exact: Array) -> Figure:
    """Draw the impact force of each case over the voltage, with the published forces and the sensor's range."""
    fig, ax = subplots(height=100)
    voltages = result.signals["voltage"]
    order, dashes = np.argsort(voltages), ("--", "-.", ":", (0, (5, 1, 1, 1)), (0, (1, 3)), (0, (8, 2)))
    # Each case has the metric `exponent`, of its power law of force over voltage.
    cases = [name.removesuffix(".exponent") for name in result.metrics if name.endswith(".exponent")]
    for k, name in enumerate(cases):
        forces = np.array([result.metrics[f"{name}.force_{voltage:g}V"].value for voltage in voltages])
        style = {"color": COLOURS[name]} if name in COLOURS else {"color": "#777777", "linestyle": dashes[k % len(dashes)]}
        ax.plot(voltages[order], forces[order], marker=".", label=name.replace("_", " "), **style)
    ax.plot(*zip(*VOLTAGE_FORCES.items(), strict=True), "k*", markersize=8, label="published")
    ax.errorbar(  # an arrow downwards, because the range is an upper bound
        SENSOR_VOLTAGE, SENSOR_RANGE, yerr=np.array([[0.06 * SENSOR_RANGE], [0.0]]), uplims=True, color="black", capsize=3,
        label="range of the sensor",
    )  # fmt: skip
    ax.set(xlabel="voltage [V]", ylabel="impact force [N]")
    ax.legend(ncols=2, fontsize=7)
    return fig


DRAWINGS = {"speed": _draw_turn, "ramp": _draw_ramp, "voltage": _draw_voltages}
"""Functions that draw a result, by the drive."""
