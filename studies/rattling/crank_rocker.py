"""Crank-rocker with clearance in up to four joints, its rocker rigid or flexible: what Figs 5 to 10 of the paper show.

One turn of the crank, journals centred at the start. Both rockers are held against the rigid mechanism with ideal
joints. With `damping_unit` N.s/m the joints rattle and the motion is chaotic: a run is one draw of many, `seed` gives
others, and only their mean and scatter can say whether the flexible rocker buffers. N.s/mm is nearly repeatable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from buckler.studies.kit.cli import main
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import subplots
from buckler.studies.rattling.clearance import FORCES, CrankRockerParameters, read, run_variants, samples, verdict

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = {"ideal": "#000000", "rigid": "#D55E00", "flexible": "#0072B2"}
JOINTS = {"O": "crank–frame", "A": "crank–coupler", "B": "coupler–rocker", "C": "rocker–frame"}
NOTES = """\
ideal: rigid bars, no clearance. rms over time, of centres of mass; rms_vx_error against ideal. From `settle` on.
Peaks of single runs scatter by tens of percent where joints rattle (damping_unit N.s/m): compare means over `seed`.
In N.s/mm they are repeatable, but last microseconds: some percent too small, less with a smaller `tolerance`."""


@dataclass(frozen=True)
class Parameters(CrankRockerParameters):
    """Parameters of the study."""


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Run the mechanism with ideal joints and with each rocker, and read them."""
    variants = run_variants(parameters, progress)
    found = {v.name: read(v, variants[0], parameters.settle) for v in variants}
    if parameters.accuracy:
        for v in variants:
            found[v.name] |= {"error": (v.result.error, "1"), "wall_s": (v.result.work["wall_s"], "s")}
    metrics = {
        f"{name}.{metric}": Metric(value, unit) for name, numbers in found.items() for metric, (value, unit) in numbers.items()
    }
    return StudyResult(
        parameters=parameters,
        **verdict(variants),
        metrics=metrics,
        signals={name: values for v in variants for name, values in samples(v).items()},
        work={f"{v.name}.{name}": v.result.work[name] for v in variants for name in ("wall_s", "steps")},
        tables=[_table(metrics, list(found), parameters)],
    )


def _table(metrics: Mapping[str, Metric], variants: list[str], p: Parameters) -> Table:
    """One row a number, one column a variant, and how the flexible rocker compares with the rigid one."""
    rows: list[list[Any]] = []
    names = [name.partition(".")[2] for name in metrics if name.startswith("ideal.")]
    both = {"rigid", "flexible"} <= set(variants)
    for name in names:
        values = [metrics[f"{variant}.{name}"] for variant in variants]
        row = [name, values[0].unit, *(m.value for m in values)]
        if both:
            rigid, flexible = metrics[f"rigid.{name}"].value, metrics[f"flexible.{name}"].value
            row.append(flexible / rigid if rigid and name != "energy_balance" else None)
        rows.append(row)
    headers = ["", "unit", *variants, *(["flexible/rigid"] if both else [])]
    title = f"{p.clearance_joints} joints with {1e3 * p.clearance:g} mm clearance, c_max = {p.damping:g} {p.damping_unit}"
    return Table(headers, rows, title, f"{NOTES}\n{p.stated()}.")


# --- figures ----------------------------------------------------------------------------------------------------------


def figure(result: StudyResult) -> dict[str, Figure]:
    """Draw velocities (Figs 5, 6), accelerations (Figs 7, 8), contact forces (Figs 9, 10) and the journals' paths."""
    p: Any = result.parameters
    figures = {
        "velocity": _histories(result, {f"{link}.vx": f"{link}, $v_x$ [m/s]" for link in ("coupler", "rocker")}),
        "acceleration": _histories(result, {f"{link}.ax": f"{link}, $a_x$ [m/s²]" for link in ("coupler", "rocker")}),
        "contact_force": _histories(
            result,
            {f"{start}.fx": f"{name.replace('_', '–')}, $F_x$ [N]" for name, start in FORCES.items()},
        ),
    }
    return figures | ({"orbits": _orbits(result)} if p.with_play else {})


def _variants(result: StudyResult) -> list[str]:
    """Those with clearance, in the order run."""
    return [name for name in ("rigid", "flexible") if f"{name}.time" in result.signals]


def _histories(result: StudyResult, rows: Mapping[str, str]) -> Figure:
    """One column a rocker, one row a signal, over the ideal mechanism's."""
    s, variants = result.signals, _variants(result)
    fig, axes = subplots(len(rows), len(variants), height=105, sharex=True, sharey="row", squeeze=False)
    for line, (signal, name) in zip(axes, rows.items(), strict=True):
        for ax, variant in zip(line, variants, strict=True):
            for case, style in ((variant, "-"), ("ideal", "--")):
                time, values = 1e3 * s[f"{case}.time"], s[f"{case}.{signal}"]
                ax.plot(time, values, style, color=COLOURS[case], linewidth=0.7, label=_name(case), rasterized=True)
            ax.label_outer()
        line[0].set_ylabel(name)
    for ax in axes[0]:
        ax.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, borderaxespad=0.2)
    for ax in axes[-1]:
        ax.set_xlabel("time [ms]")
    return fig


def _name(case: str) -> str:
    """What a curve is called."""
    return "ideal joints" if case == "ideal" else f"{case} rocker"


def _orbits(result: StudyResult) -> Figure:
    """Paths of the pins' centres in their bushes, in clearances; inside the circle they are free."""
    s, variants = result.signals, _variants(result)
    p: Any = result.parameters
    joints = [joint for joint in JOINTS if joint in p.with_play]
    shared = {"squeeze": False, "sharex": True, "sharey": True}
    fig, axes = subplots(len(variants), len(joints), height=18 + 38 * len(variants), **shared)
    turn = np.linspace(0, 2 * np.pi, 181)
    for line, variant in zip(axes, variants, strict=True):
        for ax, joint in zip(line, joints, strict=True):
            x, y = (s[f"{variant}.{joint}.journal_{axis}"] / p.clearance for axis in "xy")
            ax.plot(x, y, color=COLOURS[variant], linewidth=0.3, rasterized=True)
            ax.plot(np.cos(turn), np.sin(turn), color="#000000", linewidth=0.8)
            ax.set_aspect("equal")
            ax.label_outer()
        line[0].set_ylabel(f"{_name(variant)}\n$y/c$")
    for ax, joint in zip(axes[0], joints, strict=True):
        ax.set_title(f"{joint}: {JOINTS[joint]}")
    for ax in axes[-1]:
        ax.set_xlabel("$x/c$")
    return fig


if __name__ == "__main__":
    raise SystemExit(main("crank-rocker"))
