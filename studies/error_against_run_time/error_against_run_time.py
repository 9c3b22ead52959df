"""Error against run time of several works: hand-tuned runs of the engine, runs of the compiled solver, runs by an accuracy.

A work is a mechanism and the numbers that are computed from it; its runs form three series. `engine` is Exudyn with the best
settings found by hand: scripts in Exudyn's own classes, except for rattling, where Buckler runs on Exudyn. `once` is a single run
of the compiled solver, or, for the buckled strip, statics of Buckler's beams on Exudyn. `known` is a run that is asked for an
accuracy: its error is known, because it reports an estimate.
Processor times run from the description of the mechanism to the numbers, and are measured in rounds (`kit.statistics`). A second
table lists the objects of each mechanism's scene, and what a run of it loads and compiles.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from math import isfinite, nan

import numpy as np

from buckler.mbs.geometry import Array

from ..kit.parameters import StudyParameters, choices, integer
from ..kit.report import QUIET, Metric, Progress, StudyResult, Table, status_of
from ..kit.statistics import WorkPoint, exponent, fastest, footnote, work_precision
from ..kit.style import COLOURS, Figure, subplots
from .ingredients import Ingredients, ingredients
from .work import ENGINE, KNOWN, ONCE, Work
from .works import WORKS

MARKERS = {ENGINE: "s", ONCE: "o", KNOWN: "^"}
"""Marks of the series in the figure."""


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    works: tuple[str, ...] = choices(tuple(WORKS), tuple(WORKS), "works to run", "works")
    scenes: int = integer(1, 0, 1, "1 to list what each run is made of, loads and compiles, 0 not to", "works")
    quick: int = integer(0, 0, 1, "1 for only the first two settings of each series, and the tuned one", "numerics")
    repeats: int = integer(5, 1, 1000, "rounds, in each of which every setting runs once", "numerics")


@dataclass(frozen=True)
class MeasuredWork:
    """Error and time of a work's runs by series and setting, and the difference of its references, below which none is known."""

    work: Work
    points: Mapping[tuple[str, str], WorkPoint]
    uncertainty: float

    @property
    def tuned_point(self) -> WorkPoint:
        """Error and time of the hand-tuned run of the engine."""
        return self.points[ENGINE, self.work.tuned]

    def of(self, series: str) -> list[WorkPoint]:
        """Return the points of a series."""
        return [point for (name, _), point in self.points.items() if name == series]

    def metrics(self) -> dict[str, Metric]:
        """Compute the error of the tuned run, and the smallest error and a ratio of times for each other series.

        The ratio is the tuned run's time over that of the fastest run in the series that is as accurate, nan without one.
        """
        found = {"engine_error": self.tuned_point.error, "uncertainty": self.uncertainty}
        for series in (ONCE, KNOWN):
            if points := self.of(series):
                best = fastest(points, self.tuned_point.error)
                found[f"{series}_error"] = min(point.error for point in points)
                found[f"{series}_ratio"] = best.speedup(self.tuned_point) if best else nan
        return {name: Metric(value, "1") for name, value in found.items()}

    def wrong(self) -> list[str]:
        """List runs without a result, and too large a difference of the references."""
        failed = [f"no result of {' at '.join(key)}" for key, point in self.points.items() if not isfinite(point.error)]
        allowed = 1e-2  # relative, chosen: above it the engine or the compiled solver counts as wrong
        difference = f"its two references differ by {self.uncertainty:.1e}, allowed {allowed:g}"
        return failed + ([] if self.uncertainty <= allowed else [difference])


def measure(work: Work, p: Parameters, progress: Progress = QUIET, label: str = "runs") -> MeasuredWork:
    """Run each setting once for its error, without timing, because first calls are slow; then measure the times."""
    by_series = [[key for key in work.runs if key[0] == series] for series in MARKERS]  # a key is (series, setting)
    quick = {(ENGINE, work.tuned)}.union(*(keys[:2] for keys in by_series))
    runs = {key: run for key, run in work.runs.items() if not p.quick or key in quick}
    # each series has its own reference, made by another code
    errors = {(series, setting): work.difference(run(), work.references[series]()) for (series, setting), run in runs.items()}
    points = work_precision(runs, errors, p.repeats, progress=partial(progress, label=label))
    uncertainty = 0.0 if work.largest else work.difference(work.references[ONCE](), work.references[ENGINE]())  # 0 if exact
    return MeasuredWork(work, points, uncertainty)


def run(p: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Measure every work, then find the ingredients of its runs."""
    found = {name: measure(WORKS[name](), p, progress, name) for name in p.works}
    motions = [name for name in p.works if p.scenes and found[name].work.motion]  # not the strip, which is a work of statics
    scenes = [(work, solver) for work in motions for solver in ("Spectral", "Exudyn")]
    contents = {key: ingredients(*key) for key in progress(scenes, label="scenes")}
    metrics = {f"{name}_{key}": metric for name, each in found.items() for key, metric in each.metrics().items()}
    if "strip" in found:
        once = {setting: point.error for (series, setting), point in found["strip"].points.items() if series == ONCE}
        elements, errors = [int(setting) for setting in once], list(once.values())  # these settings are numbers of elements
        # over the length of three-node elements: twice the order of the strains, which is 2
        metrics["strip_order"] = Metric(-exponent(elements, errors), "1", exact=4)
    curves = {f"{name}.{series}": each.of(series) for name, each in found.items() for series in MARKERS}
    signals = {key: np.array([[x.time, x.error] for x in points]) for key, points in curves.items() if points}
    tables = [_table(found, footnote(p))]
    if contents:
        title = "What scenes are made of, and what a run of each loads and compiles"
        rows = [[*key, *each.row()] for key, each in contents.items()]
        tables.append(Table(["work", "solver", *Ingredients.HEADERS], rows, title))
    wrong = [f"{name}: {fault}" for name, each in found.items() for fault in each.wrong()]
    return StudyResult(parameters=p, metrics=metrics, signals=signals, tables=tables, **status_of(wrong))


def _table(found: Mapping[str, MeasuredWork], notes: str) -> Table:
    rows = []
    for name, each in found.items():
        for key, point in each.points.items():
            numbers = [f"{point.error:.1e}", f"{1e3 * point.time:.3g}", f"{point.speedup(each.tuned_point):.2g}"]
            rows.append([name, *key, *numbers])
    headers = ["work", "series", "setting", "error", "time [ms]", "tuned run's time over this"]
    works = "\n".join(f"{name}: {each.work.about}; {each.work.measure}" for name, each in found.items())
    return Table(headers, rows, "Error against run time", f"{works}\n{notes}")


def figure(result: StudyResult) -> Figure:
    """Draw error over run time, a panel for each work."""
    signals: Mapping[str, Array] = result.signals
    works = list(dict.fromkeys(name.partition(".")[0] for name in signals))
    columns = min(3, len(works))
    lines = -(-len(works) // columns)
    fig, axes = subplots(lines, columns, height=25 + 50 * lines, squeeze=False)  # [mm], of legend and panels
    shown = {}
    for ax, work in zip(axes.flat, works, strict=False):
        for (series, marker), colour in zip(MARKERS.items(), COLOURS, strict=False):
            if f"{work}.{series}" in signals:
                time, error = signals[f"{work}.{series}"].T
                shown[series] = ax.loglog(1e3 * time, error, marker, color=colour)[0]
        ax.set(title=work, xlabel="time [ms]", ylabel="error [1]")
    fig.legend(shown.values(), shown.keys(), loc="outside upper center", ncols=len(shown))
    for ax in axes.flat[len(works) :]:
        ax.remove()
    return fig
