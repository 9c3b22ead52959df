"""Error against run time: what accuracy a model, a mesh or a tolerance buys for the time it takes; runs, tables and the figure.

A time alone says nothing, and neither does an error: a comparison needs both for every variant, taken in one run. The
variants take turns (A B C A B C ...), so that a machine that warms up or gets busy slows all of them alike; times are
medians, and a ratio of times is the median of the ratios within each turn. A study of precision has its runs by series and
setting, and draws the error of each over its time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import isfinite, nan
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.validate import whole

from .labels import Label, write_labels
from .parameters import StudyParameters
from .report import Metric, Progress, Table, provenance
from .style import Axes, Figure, plain_ticks, subplots

Runs = Mapping[str, Mapping[str, Callable[[], Any]]]
"""What makes a run, by series and setting."""
SETTING = ".setting"


@dataclass(frozen=True, eq=False)
class Point:
    """One variant: how wrong, how long.

    Attributes
    ----------
    name : str
    error : by the measure given; nan if the variant failed
    walls : wall time of each repetition, s, in order
    work : what the outcome says in its `work`: steps, iterations
    front : on the Pareto front: no other variant is at least as accurate and as fast, and better in one of the two
    """

    name: str
    error: float
    walls: tuple[float, ...]
    work: Mapping[str, float] = field(default_factory=dict)
    front: bool = False

    @property
    def wall_s(self) -> float:
        """Median wall time, s."""
        return median(self.walls)

    def speedup(self, other: Point) -> float:
        """How many times faster than another point of the same run: median ratio of the times within one turn."""
        return median(theirs / own for own, theirs in zip(self.walls, other.walls, strict=True))

    def beats(self, other: Point) -> bool:
        """Whether no worse than another point in error and time, and better in one of them."""
        no_worse = self.error <= other.error and self.wall_s <= other.wall_s
        return no_worse and (self.error < other.error or self.wall_s < other.wall_s)


def work_precision(
    variants: Mapping[str, Callable[[], Any]],
    error: Callable[[Any], float],
    repeats: int = 5,
    *,
    progress: Callable[[Sequence[str]], Iterable[str]] = iter,
    clock: Callable[[], float] | None = None,
) -> list[Point]:
    """Run every variant several times in turn, and measure its error and its run time.

    Parameters
    ----------
    variants : mapping of str to callable
        Each takes nothing, does the whole job from its input to its answer, and returns an outcome. A failure is an
        outcome too: a variant that raises ends the measurement.
    error : callable
        Error of an outcome, not negative; nan if it failed. Not timed.
    repeats : int
        Turns, at least 1. The first outcome of a variant gives its error and its work.
    progress : callable, optional
        Passes on the names of the runs ahead, as a progress bar does.
    clock : callable, optional
        Time, s: that of the wall by default; `time.process_time` for that of the processor alone.

    Returns
    -------
    list of Point
        In the order of the variants.

    Raises
    ------
    ValueError
        If there is no variant, or fewer than one repetition is asked for.
    """
    whole("repeats", repeats, 1, 10**6)
    if not variants:
        raise ValueError("variants: there must be at least one")
    now = clock or perf_counter
    outcomes: dict[str, Any] = {}
    walls: dict[str, list[float]] = {name: [] for name in variants}
    for name in progress([*variants] * repeats):
        start = now()
        outcome = variants[name]()
        walls[name].append(now() - start)
        outcomes.setdefault(name, outcome)
    points = [
        Point(name, float(error(outcome)), tuple(walls[name]), dict(getattr(outcome, "work", {})))
        for name, outcome in outcomes.items()
    ]
    return [replace(p, front=isfinite(p.error) and not any(q.beats(p) for q in points)) for p in points]


def fastest(points: Iterable[Point], error: float) -> Point | None:
    """The fastest point whose error is at most that; None if none is so accurate."""
    return min((p for p in points if p.error <= error), key=lambda p: p.wall_s, default=None)


def time_for(points: Iterable[Point], error: float) -> float:
    """Time, s, in which points reach an error: along their front, linear in logarithms; nan outside its errors."""
    points = [p for p in points if isfinite(p.error)]
    front = sorted((p.error, p.wall_s) for p in points if not any(q.beats(p) for q in points))
    if not front or not front[0][0] <= error <= front[-1][0]:
        return nan
    errors, walls = np.log(front).T
    return float(np.exp(np.interp(np.log(error), errors, walls)))


def verdict(point: Point, baseline: Point) -> str:
    """Compare two points of one run in a sentence."""
    ratio, share = point.speedup(baseline), point.error / baseline.error
    faster = f"{ratio:.1f} times faster" if ratio >= 1 else f"{1 / ratio:.1f} times slower"
    error = f"{share:.2g} times the error" if isfinite(share) else "an error the other does not reach"
    return (
        f"{point.name} has an error of {point.error:.1e} after {1e3 * point.wall_s:.3g} ms, {baseline.name} one of "
        f"{baseline.error:.1e} after {1e3 * baseline.wall_s:.3g} ms: {faster} at {error}."
    )


# --- studies of precision ----------------------------------------------------------------------------------------------

Series = Mapping[str, Mapping[str, Point]]
"""What came of the runs, by series and setting."""


def power(tolerance: float) -> str:
    """1e-5 for 1e-05."""
    return f"{tolerance:.0e}".replace("e-0", "e-")


def thousands(steps: float) -> str:
    """20k for 20000."""
    return f"{steps / 1000:g}k"


def by_tolerance(run: Callable[[float], Any], tolerances: Sequence[float]) -> dict[str, Callable[[], Any]]:
    """Runs by tolerance, coarsest first; `run(tolerance)` makes one."""
    return {power(x): partial(run, x) for x in sorted(tolerances, reverse=True)}


def by_steps(run: Callable[[int], Any], steps: Sequence[int]) -> dict[str, Callable[[], Any]]:
    """Runs by number of equal steps; `run(count)` makes one."""
    return {thousands(n): partial(run, n) for n in sorted(steps)}


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
