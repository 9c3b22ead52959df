"""The skeleton of a study of precision: runs by series and setting, their errors and times, the figure of one over the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array
from buckler.studies.kit.labels import Label, write_labels
from buckler.studies.kit.parameters import StudyParameters
from buckler.studies.kit.report import Metric, Progress, Table, provenance
from buckler.studies.kit.style import Axes, Figure, plain_ticks, subplots
from buckler.studies.kit.work_precision import Point, work_precision

Runs = Mapping[str, Mapping[str, Callable[[], Any]]]
"""What makes a run, by series and setting."""
Series = Mapping[str, Mapping[str, Point]]
"""What came of it."""
SETTING = ".setting"


def power(tolerance: float) -> str:
    """1e-5 for 1e-05."""
    return f"{tolerance:.0e}".replace("e-0", "e-")


def thousands(steps: float) -> str:
    """20k for 20000."""
    return f"{steps / 1000:g}k"


def by_tolerance(run: Callable[[float], Any], tolerances: Sequence[float]) -> dict[str, Callable[[], Any]]:
    """Runs by tolerance, coarsest first; `run(tolerance)` makes one."""
    return {power(x): partial(run, x) for x in sorted(tolerances, reverse=True)}


def by_steps(run: Callable[[int], Any], steps: Sequence[float]) -> dict[str, Callable[[], Any]]:
    """Runs by number of equal steps; `run(count)` makes one."""
    return {thousands(n): partial(run, int(n)) for n in sorted(steps)}


def outcomes(runs: Runs) -> dict[str, dict[str, Any]]:
    """Run everything once, untimed: the first call of anything is slow."""
    return {series: {key: call() for key, call in part.items()} for series, part in runs.items()}


def measure(runs: Runs, error: Callable[[Any], float], repeats: int, progress: Progress, label: str = "runs") -> Series:
    """Run everything several times in turn for its error and its times; see `work_precision`."""
    calls = {f"{series}, {key}": call for series, part in runs.items() for key, call in part.items()}
    points = work_precision(calls, error, repeats, progress=lambda names: progress(names, label=label))
    found = {point.name: point for point in points}
    return {series: {key: found[f"{series}, {key}"] for key in part} for series, part in runs.items()}


def points_of(series: Series) -> list[Point]:
    """All points."""
    return [point for part in series.values() for point in part.values()]


def mark(point: Point, status: str = "") -> str:
    """What stands in a table's last column: how a run failed, or whether nothing is both faster and more accurate."""
    if not isfinite(point.error):
        return f"failed: {status}" if status else "failed"
    return "*" if point.front else ""


@dataclass(frozen=True)
class Bar:
    """What is asked of a number: that it is no more, or no less, than a bound."""

    text: str
    bound: float
    unit: str = "1"
    sign: str = "<="

    def reached(self, value: float) -> bool:
        """Whether a value is on the right side."""
        return value >= self.bound if self.sign == ">=" else value <= self.bound


def missed(bars: Mapping[str, Bar], metrics: Mapping[str, Metric]) -> list[str]:
    """Names of the metrics that miss their bar."""
    return [name for name, bar in bars.items() if name in metrics and not bar.reached(metrics[name].value)]


def bars_table(bars: Mapping[str, Bar], metrics: Mapping[str, Metric], what: str) -> Table:
    """What was asked and what was found."""
    rows: list[list[Any]] = []
    for name, bar in bars.items():
        if name in metrics:
            value = metrics[name].value
            rows.append([bar.text, value, bar.unit, f"{bar.sign} {bar.bound:g}", "yes" if bar.reached(value) else "no"])
    return Table([what, "found", "unit", "bar", "reached"], rows)


def as_signals(series: Series, setting: str = SETTING, kind: type = str) -> dict[str, Array]:
    """Errors, times, front and settings (as what `kind` makes of them) of each series as arrays."""
    found = {}
    for name, part in series.items():
        for what in ("error", "wall_s", "front"):
            found[f"{name}.{what}"] = np.array([getattr(point, what) for point in part.values()])
        found[f"{name}{setting}"] = np.array([kind(key) for key in part])
    return found


def series_in(signals: Mapping[str, Array]) -> list[str]:
    """Names of the series in a study's signals."""
    return [name.removesuffix(SETTING) for name in signals if name.endswith(SETTING)]


def draw(
    ax: Axes,
    signals: Mapping[str, Array],
    labels: Mapping[str, str],
    what: str = "tolerance, or steps",
    setting: str = SETTING,
) -> None:
    """Draw error over run time on log-log axes, each point with its setting (`what`), the Pareto front behind them."""
    front: list[tuple[float, float]] = []
    texts: list[Label] = []
    lines: list[Array] = []
    for k, (name, label) in enumerate(labels.items()):
        time, error = 1e3 * signals[f"{name}.wall_s"], signals[f"{name}.error"]
        ax.loglog(time, error, "so^Dv<>"[k] + "-", color=f"C{k}", label=label)
        texts += [Label(x, y, str(of), f"C{k}") for x, y, of in zip(time, error, signals[f"{name}{setting}"], strict=True)]
        lines.append(np.column_stack([time, error]))
        on = signals[f"{name}.front"]
        front += [*zip(time[on], error[on], strict=True)]
    x, y = np.array(sorted(front)).T
    ax.step(x, y, where="post", color="0.8", linewidth=5, zorder=0, label="Pareto front")
    ax.set(xlabel="run time [ms]")
    plain_ticks(ax.xaxis)
    ax.legend(title=f"at the points: {what}", title_fontsize=8, alignment="left")
    write_labels(ax, texts, lines)


def footnote(parameters: StudyParameters, of: str = "Medians") -> str:
    """Machine, versions and repetitions a table of run times stands on; `of` says what is told of the repetitions."""
    origin = provenance(parameters)
    versions = ", ".join(f"{name} {version}" for name, version in origin["versions"].items() if version)
    machine = f"{origin['machine']['cpu']}, {origin['machine']['cores']} cores"
    repeats = origin["parameters"]["repeats"]
    return f"{of} of {repeats} runs taken in turn; {machine}; {versions}; commit {origin['commit']}."


def figure_of(signals: Mapping[str, Array], ylabel: str) -> tuple[Figure, Axes]:
    """Error over run time of every series, and its axes."""
    names = series_in(signals)
    fig, ax = subplots(height=110)
    ax.set(ylabel=ylabel)
    draw(ax, signals, {name: name for name in names})
    return fig, ax
