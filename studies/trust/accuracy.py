"""Accuracy asked for against accuracy delivered: random mechanisms of every kind, each against a reference of its own.

`simulate(mechanism, duration, accuracy)` chooses elements, integrator, steps and tolerances itself. Here its result is held
against another method or a far finer run (`accuracy_scenes`). A result is silent if it errs by more than three times what was
asked and does not say so; one that names its failure, or that it is SUSPECT, has said so.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from buckler.mbs import simulate
from buckler.studies.kit.cli import main
from buckler.studies.kit.parameters import StudyParameters, choices, integer, quantities, quantity
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import COLOURS, subplots
from buckler.studies.trust.accuracy_scenes import SCENES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SILENT = 3.0
"""Delivered over asked error from which a result must say that it is not what was asked for."""
WITHIN = 0.95
"""Share of all results that must be as accurate as asked."""
NOTES = """\
within: results no farther off than asked. worst: largest error over that asked. silent: more than three times off, and not
marked. told: SUSPECT, or failed by name. estimate/error: median of the result's own estimate over its error. Mechanisms whose two
reference runs do not agree are left out."""
MARKS = "os^vDP*Xph"


@dataclass(frozen=True)
class Parameters(StudyParameters):
    """Parameters of the study."""

    scenes: tuple[str, ...] = choices(tuple(SCENES), tuple(SCENES), "kinds of mechanism", "scenes")
    accuracies: tuple[float, ...] = quantities((1e-2, 1e-3), "1", 1e-6, 0.1, "what is asked for", "scenes")
    cases: int = integer(2, 1, 10_000, "random mechanisms of each kind, for each accuracy", "scenes")
    seed: int = integer(0, 0, 2**31 - 1, "draws the mechanisms", "scenes")
    timeout: float = quantity(60.0, "s", 0.1, 3600, "longest time a run may take", "numerics")


class Delivered(NamedTuple):
    """What came of one mechanism: what was asked for, found and estimated, how the run ended, and how long it took, s."""

    scene: str
    asked: float
    error: float
    estimate: float
    status: str
    message: str
    wall_s: float

    @property
    def ratio(self) -> float:
        """Delivered over asked error; infinite for a run without a result."""
        return self.error / self.asked if np.isfinite(self.error) else float("inf")

    @property
    def told(self) -> bool:
        """Whether the run itself says that it is not to be trusted."""
        return self.status != "OK"


def _outcomes(p: Parameters, progress: Progress) -> Iterator[Delivered]:
    jobs = [(name, asked, k) for k in range(p.cases) for name in p.scenes for asked in p.accuracies]
    for name, asked, k in progress(jobs, label="mechanisms"):
        case = SCENES[name](np.random.default_rng([p.seed, list(SCENES).index(name), k]), asked)
        start = perf_counter()
        result = simulate(case.mechanism, case.duration, asked, of=case.aim.of, timeout=p.timeout)
        wall = perf_counter() - start
        ended = result.time.size > 0 and result.time[-1] >= case.duration * (1 - 1e-6)
        error = case.error(result) if ended else float("inf")
        if not np.isnan(error):  # it has a reference
            estimate = result.error.motion if case.aim.motion else case.aim.largest(result.error, result.units)
            yield Delivered(name, asked, error, estimate, str(result.status), result.message, wall)


def run(parameters: Parameters, progress: Progress = QUIET) -> StudyResult:
    """Draw mechanisms, ask for each accuracy, and look at what comes."""
    found = list(_outcomes(parameters, progress))
    groups = {name: [o for o in found if o.scene == name] for name in parameters.scenes}
    silent = [o for o in found if o.ratio > SILENT and not o.told]
    within = _within(found)
    metrics = {
        "cases": Metric(float(len(found)), "1"),
        "within": Metric(within, "1"),
        "worst_ratio": Metric(_worst(found), "1"),
        "silent": Metric(float(len(silent)), "1"),
    }
    for name, group in groups.items():
        key = name.replace(" ", "_").replace("clearance", "play")  # metrics keep their first names
        metrics[f"{key}.within"] = Metric(_within(group), "1")
        metrics[f"{key}.worst_ratio"] = Metric(_worst(group), "1")
    wrong = [f"{o.scene}: {o.error:.1e} where {o.asked:g} was asked, not told" for o in silent]
    if not within >= WITHIN:
        wrong.append(f"{100 * within:.3g} % of all results as accurate as asked, must be {100 * WITHIN:g} %")
    return StudyResult(
        parameters=parameters,
        status="SUSPECT" if wrong else "OK",
        message="; ".join(wrong) or f"{100 * within:.3g} % of {len(found)} results as accurate as asked",
        metrics=metrics,
        signals={name: np.array([getattr(o, name) for o in found]) for name in ("asked", "error", "estimate", "wall_s")}
        | {"scene": np.array([list(SCENES).index(o.scene) for o in found]), "told": np.array([o.told for o in found])},
        tables=[_table(parameters, groups)],
    )


def _within(outcomes: Sequence[Delivered]) -> float:
    """Share of results as accurate as asked; nan of none."""
    return float(np.mean([o.ratio <= 1 for o in outcomes])) if outcomes else float("nan")


def _worst(outcomes: Sequence[Delivered]) -> float:
    return max((o.ratio for o in outcomes), default=float("nan"))


def _table(p: Parameters, groups: dict[str, list[Delivered]]) -> Table:
    rows: list[list[Any]] = []
    for name, group in groups.items():
        for asked in p.accuracies:
            if not (part := [o for o in group if o.asked == asked]):
                continue  # no reference
            silent, told = sum(o.ratio > SILENT and not o.told for o in part), sum(o.told for o in part)
            trust = float(np.median([o.estimate / o.error if o.error > 0 else np.nan for o in part]))
            time = 1e3 * float(np.median([o.wall_s for o in part]))
            rows.append([name, f"{asked:g}", len(part), _within(part), _worst(part), silent, told, f"{trust:.2g}", f"{time:.3g}"])
    headers = ["scene", "asked", "cases", "within", "worst", "silent", "told", "estimate/error", "median [ms]"]
    return Table(headers, rows, "Error delivered against error asked for", NOTES)


def figure(result: StudyResult) -> Figure:
    """Delivered over asked error, a mark a mechanism; hollow where the run said so itself."""
    s, fig_ax = result.signals, subplots(height=105)
    fig, ax = fig_ax
    names, spread = list(SCENES), np.random.default_rng(0)
    for k in np.unique(s["scene"]):
        mine = s["scene"] == k
        colour = COLOURS[int(k) % len(COLOURS)]
        x = s["asked"][mine] * 10 ** spread.uniform(-0.18, 0.18, mine.sum())
        y = np.clip(s["error"][mine] / s["asked"][mine], 1e-6, 1e3)
        faces = ["none" if told else colour for told in s["told"][mine]]
        ax.scatter(x, y, s=16, marker=MARKS[int(k)], facecolors=faces, edgecolors=colour, linewidths=0.8, label=names[int(k)])
    ax.axhline(1.0, color="#000000", linewidth=0.8)
    ax.axhline(SILENT, color="#000000", linewidth=0.8, linestyle=":")
    ax.set(xscale="log", yscale="log", xlabel="error asked for", ylabel="error delivered over error asked for")
    ax.annotate("beyond: must be told", (1.0, SILENT), xycoords=("axes fraction", "data"), xytext=(0, 3),
                textcoords="offset points", ha="right", fontsize=8)  # fmt: skip
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper center", ncols=4)
    return fig


if __name__ == "__main__":
    raise SystemExit(main("accuracy"))
